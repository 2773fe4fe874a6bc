// The assignment is checked as it is written; the mappings were, by the board.
#include "firmware_emu/ethercat/board_data.hpp"

#include <algorithm>

#include "canopen/bytes.hpp"
#include "canopen/objects.hpp"

namespace tandem::firmware::esc {

using canopen::AbortCode;
using canopen::ObjectEntry;
namespace object = canopen::object;

BoardData::BoardData(Direction direction, canopen::ObjectDictionary& board, int node_id) noexcept
    : direction_(direction), board_(&board), node_(node_id) {}

bool BoardData::add_to(canopen::ObjectDictionary& od) {
  const std::uint16_t assign = assignment_object(direction_);
  bool done = od.add(assign, 0, assigned_count_, canopen::kReadWrite,
                     {.min = 0, .max = static_cast<double>(kMaxPdos)}, this);
  for (std::size_t i = 0; i < kMaxPdos; ++i) {
    done &= od.add(assign, static_cast<std::uint8_t>(i + 1), assigned_[i], canopen::kReadWrite, {},
                   this);
  }
  return done;
}

int BoardData::number_of(std::uint16_t index) const noexcept {
  const int first = direction_ == Direction::kOutputs ? object::kRpdoMapping : object::kTpdoMapping;
  const int number = index - first + 1;
  const bool there = number >= 1 && number <= canopen::kPdosPerNode;
  return there && board_->find(index, 0) != nullptr ? number : 0;
}

std::size_t BoardData::mapped_bytes(std::uint16_t index) const noexcept {
  if (number_of(index) == 0) return 0;
  std::size_t bits = 0;
  const auto count = board_->value<std::uint8_t>(index, 0);
  for (int sub = 1; sub <= count; ++sub) {
    const ObjectEntry* entry = board_->find(index, static_cast<std::uint8_t>(sub));
    if (entry == nullptr) break;
    bits += *static_cast<const std::uint32_t*>(entry->data) & 0xFF;
  }
  return bits / 8;
}

std::uint32_t BoardData::cob_id(int number) const noexcept {
  return direction_ == Direction::kOutputs ? canopen::cob::rpdo(number, node_)
                                           : canopen::cob::tpdo(number, node_);
}

/// What the board's sheet does not let be written stays.
void BoardData::switch_pdo(int number, bool on) noexcept {
  const int first =
      direction_ == Direction::kOutputs ? object::kRpdoParameter : object::kTpdoParameter;
  const auto parameter = static_cast<std::uint16_t>(first + number - 1);
  std::array<std::uint8_t, 4> id{};
  canopen::put(id.data(), cob_id(number) | (on ? 0 : canopen::cob::kInvalid));
  const std::uint8_t type = canopen::kEverySync;
  if (on) (void)board_->write(parameter, canopen::kPdoType, {&type, 1});
  (void)board_->write(parameter, canopen::kPdoCobId, id);
}

void BoardData::set_open(bool open) noexcept TANDEM_RT {
  if (open && !open_) {
    for (int number = 1; number <= canopen::kPdosPerNode; ++number) switch_pdo(number, false);
    image_.fill(0);
    count_ = 0;
  }
  open_ = open;
}

std::size_t BoardData::bytes() const noexcept TANDEM_RT {
  if (!open_ && count_ > 0) return parts_[count_ - 1].offset + parts_[count_ - 1].bytes;
  std::size_t sum = 0;
  for (std::size_t i = 0; i < assigned_count_; ++i) sum += mapped_bytes(assigned_[i]);
  return sum;
}

AbortCode BoardData::check(const ObjectEntry& entry, const std::uint8_t* value) noexcept TANDEM_RT {
  if (!open_) return AbortCode::kDeviceState;
  if (entry.sub != 0) {
    return assigned_count_ == 0 ? AbortCode::kNone : AbortCode::kUnsupportedAccess;
  }
  std::size_t sum = 0;
  for (std::size_t i = 0; i < value[0]; ++i) {
    if (number_of(assigned_[i]) == 0) return AbortCode::kNotMappable;
    sum += mapped_bytes(assigned_[i]);
  }
  return sum > kMaxProcessBytes ? AbortCode::kMappingTooLong : AbortCode::kNone;
}

void BoardData::compile() noexcept TANDEM_RT {
  count_ = 0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < assigned_count_; ++i) {
    const int number = number_of(assigned_[i]);
    if (number == 0) continue;
    const std::size_t bytes = mapped_bytes(assigned_[i]);
    parts_[count_++] = {.cob_id = cob_id(number), .offset = at, .bytes = bytes};
    at += bytes;
    switch_pdo(number, true);
  }
}

void BoardData::take(std::span<const std::uint8_t> image) noexcept TANDEM_RT {
  std::ranges::copy(image, image_.begin());
  fresh_ = true;
}

void BoardData::give(std::span<std::uint8_t> image) const noexcept TANDEM_RT {
  std::copy_n(image_.begin(), image.size(), image.begin());
}

void BoardData::archive(Archive& ar) {
  ar(open_, fresh_, assigned_count_, assigned_, image_, count_);
  for (Part& part : parts_) ar(part.cob_id, part.offset, part.bytes);
}

}  // namespace tandem::firmware::esc
