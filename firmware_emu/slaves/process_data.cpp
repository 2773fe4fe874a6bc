// The assignment (1C12, 1C13) names PDOs, these name objects; both are checked as they are written.
#include "firmware_emu/slaves/process_data.hpp"

#include <algorithm>

#include "canopen/bytes.hpp"

namespace tandem::firmware::esc {

using canopen::AbortCode;
using canopen::ObjectEntry;

namespace {

/// A gap: index 0, or a data type in the place of an object (CiA 301).
bool is_gap(std::uint32_t mapped) noexcept { return mapped >> 16 < 0x1000; }

}  // namespace

ProcessData::ProcessData(ProcessDirection direction, std::span<const PdoSetup> pdos, bool assigns)
    : direction_(direction), assigns_(assigns) {
  std::size_t most = 1;
  for (const PdoSetup& setup : pdos.first(std::min(pdos.size(), kMaxPdoObjects))) {
    Pdo& pdo = pdos_.emplace_back();
    pdo.index = setup.index;
    pdo.fixed = setup.fixed;
    pdo.power_on = setup.entries;
    pdo.power_on.resize(std::min(pdo.power_on.size(), kMostPdoEntries));
    pdo.entries.resize(std::min(setup.room(), kMostPdoEntries));
    most = std::max(most, pdo.entries.size());
    if (setup.assigned && power_on_count_ < kMaxPdos) power_on_[power_on_count_++] = setup.index;
  }
  copy_.resize(kMaxPdos * most);
  ProcessData::reset();
}

std::size_t ProcessData::objects(std::span<const PdoSetup> pdos) noexcept {
  std::size_t count = 1 + kMaxPdos;
  for (const PdoSetup& pdo : pdos) count += 1 + pdo.room();
  return count;
}

void ProcessData::reset() noexcept TANDEM_RT {
  assigned_count_ = power_on_count_;
  assigned_ = power_on_;
  for (Pdo& pdo : pdos_) {
    pdo.count = static_cast<std::uint8_t>(pdo.power_on.size());
    std::ranges::fill(pdo.entries, 0U);
    std::ranges::copy(pdo.power_on, pdo.entries.begin());
  }
}

bool ProcessData::add_to(canopen::ObjectDictionary& od) {
  od_ = &od;
  const std::uint16_t assign = assignment_object(direction_);
  const auto most = [](std::size_t count) {
    return canopen::ObjectRange{.min = 0, .max = static_cast<double>(count)};
  };
  const auto right = [](bool writable) { return writable ? canopen::kReadWrite : canopen::kRead; };
  bool done = od.add(assign, 0, assigned_count_, right(assigns_), most(kMaxPdos), this);
  for (std::size_t i = 0; i < kMaxPdos; ++i) {
    done &=
        od.add(assign, static_cast<std::uint8_t>(i + 1), assigned_[i], right(assigns_), {}, this);
  }
  for (Pdo& pdo : pdos_) {
    const std::uint8_t access = right(!pdo.fixed);
    done &= od.add(pdo.index, 0, pdo.count, access, most(pdo.entries.size()), this);
    for (std::size_t i = 0; i < pdo.entries.size(); ++i) {
      done &= od.add(pdo.index, static_cast<std::uint8_t>(i + 1), pdo.entries[i], access, {}, this);
    }
  }
  return done;
}

const ProcessData::Pdo* ProcessData::find(std::uint16_t index) const noexcept {
  const auto at = std::ranges::find(pdos_, index, &Pdo::index);
  return at == pdos_.end() ? nullptr : &*at;
}

std::size_t ProcessData::bits_of(const Pdo& pdo) noexcept {
  std::size_t bits = 0;
  for (std::size_t i = 0; i < pdo.count; ++i) bits += pdo.entries[i] & 0xFF;
  return bits;
}

std::size_t ProcessData::bytes() const noexcept TANDEM_RT {
  std::size_t bits = 0;
  for (std::size_t i = 0; i < assigned_count_; ++i) {
    const Pdo* pdo = find(assigned_[i]);
    if (pdo != nullptr) bits += bits_of(*pdo);
  }
  return (bits + 7) / 8;
}

/// @param at  bits before it in its PDO
AbortCode ProcessData::check_entry(std::uint32_t mapped, std::size_t at) const noexcept {
  const auto index = static_cast<std::uint16_t>(mapped >> 16);
  const auto sub = static_cast<std::uint8_t>(mapped >> 8);
  const std::uint32_t bits = mapped & 0xFF;
  if (bits == 0) return AbortCode::kNotMappable;
  if (is_gap(mapped)) return AbortCode::kNone;
  const ObjectEntry* entry = od_->find(index, sub);
  if (entry == nullptr) return od_->exists(index, sub);
  const std::uint8_t right =
      direction_ == ProcessDirection::kOutputs ? canopen::kMapRpdo : canopen::kMapTpdo;
  const bool fits = (entry->access & right) != 0 && bits == 8u * entry->size && at % 8 == 0;
  return fits ? AbortCode::kNone : AbortCode::kNotMappable;
}

AbortCode ProcessData::check(const ObjectEntry& entry,
                             const std::uint8_t* bytes) noexcept TANDEM_RT {
  if (!open_) return AbortCode::kDeviceState;
  const bool assignment = entry.index == assignment_object(direction_);
  const Pdo* pdo = assignment ? nullptr : find(entry.index);
  const std::uint8_t count = assignment ? assigned_count_ : pdo->count;
  if (entry.sub != 0) return count == 0 ? AbortCode::kNone : AbortCode::kUnsupportedAccess;
  std::size_t bits = 0;
  for (std::size_t i = 0; i < bytes[0]; ++i) {
    if (assignment) {
      const Pdo* one = find(assigned_[i]);
      if (one == nullptr) return AbortCode::kNotMappable;
      bits += bits_of(*one);
    } else {
      const AbortCode code = check_entry(pdo->entries[i], bits);
      if (code != AbortCode::kNone) return code;
      bits += pdo->entries[i] & 0xFF;
    }
  }
  return (bits + 7) / 8 > kMaxProcessBytes ? AbortCode::kMappingTooLong : AbortCode::kNone;
}

void ProcessData::lay_out() noexcept {
  copies_ = 0;
  std::size_t bits = 0;
  for (std::size_t i = 0; i < assigned_count_; ++i) {
    const Pdo* pdo = find(assigned_[i]);
    if (pdo == nullptr) continue;
    for (std::size_t n = 0; n < pdo->count; ++n) {
      const std::uint32_t mapped = pdo->entries[n];
      if (!is_gap(mapped) && check_entry(mapped, bits) == AbortCode::kNone) {
        copy_[copies_++] = {.entry = od_->find(static_cast<std::uint16_t>(mapped >> 16),
                                               static_cast<std::uint8_t>(mapped >> 8)),
                            .mapped = mapped,
                            .at = bits / 8,
                            .pdo = static_cast<std::uint8_t>(i)};
      }
      bits += mapped & 0xFF;
    }
  }
}

void ProcessData::compile() noexcept TANDEM_RT { lay_out(); }

void ProcessData::take(std::span<const std::uint8_t> image) noexcept TANDEM_RT {
  for (const Copy& copy : copies()) copy.entry->decode(&image[copy.at]);
}

void ProcessData::give(std::span<std::uint8_t> image) const noexcept TANDEM_RT {
  std::ranges::fill(image, std::uint8_t{0});
  for (const Copy& copy : copies()) copy.entry->encode(&image[copy.at]);
}

void ProcessData::archive_objects(Archive& ar) {
  ar(open_, assigned_count_, assigned_);
  for (Pdo& pdo : pdos_) {
    ar(pdo.count);
    for (std::uint32_t& entry : pdo.entries) ar(entry);
  }
  if (ar.reading() && od_ != nullptr) lay_out();
}

void ProcessData::archive(Archive& ar) { archive_objects(ar); }

}  // namespace tandem::firmware::esc
