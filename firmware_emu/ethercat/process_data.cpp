// The assignment (1C12, 1C13) names PDOs, these name objects; both are checked as they are written.
#include "firmware_emu/ethercat/process_data.hpp"

#include <algorithm>

#include "canopen/bytes.hpp"

namespace tandem::firmware::esc {

using canopen::AbortCode;
using canopen::ObjectEntry;

ProcessData::ProcessData(Direction direction, std::span<const PdoSetup> pdos)
    : direction_(direction) {
  for (const PdoSetup& setup : pdos.first(std::min(pdos.size(), kMaxPdos))) {
    Pdo& pdo = pdos_.emplace_back();
    pdo.index = setup.index;
    pdo.count = static_cast<std::uint8_t>(std::min(setup.entries.size(), kMaxPdoEntries));
    std::copy_n(setup.entries.begin(), pdo.count, pdo.entries.begin());
    if (setup.assigned) assigned_[assigned_count_++] = setup.index;
  }
}

bool ProcessData::add_to(canopen::ObjectDictionary& od) {
  od_ = &od;
  const std::uint16_t assign = assignment_object(direction_);
  const auto most = [](std::size_t count) {
    return canopen::ObjectRange{.min = 0, .max = static_cast<double>(count)};
  };
  bool done = od.add(assign, 0, assigned_count_, canopen::kReadWrite, most(kMaxPdos), this);
  for (std::size_t i = 0; i < kMaxPdos; ++i) {
    done &= od.add(assign, static_cast<std::uint8_t>(i + 1), assigned_[i], canopen::kReadWrite, {},
                   this);
  }
  for (Pdo& pdo : pdos_) {
    done &= od.add(pdo.index, 0, pdo.count, canopen::kReadWrite, most(kMaxPdoEntries), this);
    for (std::size_t i = 0; i < kMaxPdoEntries; ++i) {
      done &= od.add(pdo.index, static_cast<std::uint8_t>(i + 1), pdo.entries[i],
                     canopen::kReadWrite, {}, this);
    }
  }
  return done;
}

const ProcessData::Pdo* ProcessData::find(std::uint16_t index) const noexcept {
  const auto at = std::ranges::find(pdos_, index, &Pdo::index);
  return at == pdos_.end() ? nullptr : &*at;
}

std::size_t ProcessData::bytes_of(const Pdo& pdo) noexcept {
  std::size_t bits = 0;
  for (std::size_t i = 0; i < pdo.count; ++i) bits += pdo.entries[i] & 0xFF;
  return bits / 8;
}

std::size_t ProcessData::bytes() const noexcept TANDEM_RT {
  std::size_t sum = 0;
  for (std::size_t i = 0; i < assigned_count_; ++i) {
    const Pdo* pdo = find(assigned_[i]);
    if (pdo != nullptr) sum += bytes_of(*pdo);
  }
  return sum;
}

AbortCode ProcessData::check_entry(std::uint32_t mapped) const noexcept {
  const auto index = static_cast<std::uint16_t>(mapped >> 16);
  const auto sub = static_cast<std::uint8_t>(mapped >> 8);
  const std::uint32_t bits = mapped & 0xFF;
  if (bits == 0 || bits % 8 != 0) return AbortCode::kNotMappable;
  if (index == 0) return AbortCode::kNone;  // a gap
  const ObjectEntry* entry = od_->find(index, sub);
  if (entry == nullptr) return od_->exists(index, sub);
  const std::uint8_t right =
      direction_ == Direction::kOutputs ? canopen::kMapRpdo : canopen::kMapTpdo;
  const bool fits = (entry->access & right) != 0 && bits == 8u * entry->size;
  return fits ? AbortCode::kNone : AbortCode::kNotMappable;
}

AbortCode ProcessData::check(const ObjectEntry& entry,
                             const std::uint8_t* bytes) noexcept TANDEM_RT {
  if (!open_) return AbortCode::kDeviceState;
  const bool assignment = entry.index == assignment_object(direction_);
  const Pdo* pdo = assignment ? nullptr : find(entry.index);
  const std::uint8_t count = assignment ? assigned_count_ : pdo->count;
  if (entry.sub != 0) return count == 0 ? AbortCode::kNone : AbortCode::kUnsupportedAccess;
  std::size_t sum = 0;
  for (std::size_t i = 0; i < bytes[0]; ++i) {
    if (assignment) {
      const Pdo* one = find(assigned_[i]);
      if (one == nullptr) return AbortCode::kNotMappable;
      sum += bytes_of(*one);
    } else {
      const AbortCode code = check_entry(pdo->entries[i]);
      if (code != AbortCode::kNone) return code;
      sum += (pdo->entries[i] & 0xFF) / 8;
    }
  }
  return sum > kMaxProcessBytes ? AbortCode::kMappingTooLong : AbortCode::kNone;
}

void ProcessData::compile() noexcept TANDEM_RT {
  copies_ = 0;
  for (std::size_t i = 0; i < assigned_count_; ++i) {
    const Pdo* pdo = find(assigned_[i]);
    if (pdo == nullptr) continue;
    for (std::size_t n = 0; n < pdo->count; ++n) {
      const std::uint32_t mapped = pdo->entries[n];
      const bool known = check_entry(mapped) == AbortCode::kNone;
      copy_[copies_++] = {.entry = known ? od_->find(static_cast<std::uint16_t>(mapped >> 16),
                                                     static_cast<std::uint8_t>(mapped >> 8))
                                         : nullptr,
                          .bytes = (mapped & 0xFF) / 8};
    }
  }
}

void ProcessData::take(std::span<const std::uint8_t> image) noexcept TANDEM_RT {
  for (std::size_t i = 0, at = 0; i < copies_; at += copy_[i++].bytes) {
    if (copy_[i].entry != nullptr) copy_[i].entry->decode(&image[at]);
  }
}

void ProcessData::give(std::span<std::uint8_t> image) const noexcept TANDEM_RT {
  for (std::size_t i = 0, at = 0; i < copies_; at += copy_[i++].bytes) {
    if (copy_[i].entry != nullptr) {
      copy_[i].entry->encode(&image[at]);
    } else {
      std::fill_n(&image[at], copy_[i].bytes, std::uint8_t{0});
    }
  }
}

void ProcessData::archive(Archive& ar) {
  ar(open_, assigned_count_, assigned_);
  for (Pdo& pdo : pdos_) ar(pdo.count, pdo.entries);
  if (ar.reading() && od_ != nullptr) compile();
}

}  // namespace tandem::firmware::esc
