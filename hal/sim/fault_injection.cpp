// A fixed number of slots, each a fault with its own random generator; held frames wait in a fixed
// pool. Nothing allocates while frames pass.
#include "hal/sim/fault_injection.hpp"

#include <algorithm>

#include "base/archive.hpp"
#include "base/split_mix.hpp"

namespace tandem::sim {

using canopen::Frame;
using canopen::FrameSink;
using hal::FaultKind;

namespace {

constexpr std::uint64_t kNever = ~std::uint64_t{0};

bool goes(FrameDirection which, FrameDirection frame) noexcept {
  return (static_cast<unsigned>(which) & static_cast<unsigned>(frame)) != 0;
}

bool selects(const ScenarioFault& fault, FrameDirection direction, std::size_t bus,
             const Frame& frame) noexcept {
  if (!goes(fault.direction, direction)) return false;
  if (fault.bus >= 0 && static_cast<std::size_t>(fault.bus) != bus) return false;
  // Identifiers without a node are those of NMT, SYNC and TIME.
  if (fault.node_id != 0 && (frame.id & 0x7F) != fault.node_id) return false;
  return ((frame.id ^ fault.cob_id) & fault.cob_mask) == 0;
}

void corrupt(FaultSlot& slot, Frame& frame) noexcept {
  if (slot.fault.length >= 0) {
    const auto most = frame.fd() ? canopen::kMaxFrameBytes : canopen::kClassicFrameBytes;
    const std::size_t bytes = std::min(static_cast<std::size_t>(slot.fault.length), most);
    std::fill(frame.data.begin() + slot.fault.length, frame.data.end(), std::uint8_t{0});
    frame.length = canopen::frame_length(bytes);
    return;
  }
  if (frame.length == 0) return;
  for (std::uint32_t i = 0; i < slot.fault.bits; ++i) {
    const std::uint64_t bit = split_mix(slot.random) % (std::uint64_t{frame.length} * 8);
    frame.data[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
  }
}

}  // namespace

/// A push that is over leaves nothing behind.
std::size_t FaultInjection::free_slot() const noexcept TANDEM_RT {
  for (std::size_t i = 0; i < count_; ++i) {
    const FaultSlot& slot = slots_[i];
    if (slot.fault.kind == FaultKind::kPush && slot.told == 2 && slot.ended == 0) return i;
  }
  return count_;
}

std::size_t FaultInjection::room() const noexcept TANDEM_RT {
  std::size_t over = 0;
  for (const FaultSlot& slot : slots())
    over += slot.fault.kind == FaultKind::kPush && slot.told == 2 && slot.ended == 0 ? 1 : 0;
  return slots_.size() - count_ + over;
}

bool FaultInjection::add(const ScenarioFault& fault) noexcept TANDEM_RT {
  const std::size_t place = free_slot();
  if (place == slots_.size()) return false;
  count_ = std::max(count_, place + 1);
  FaultSlot& slot = slots_[place];
  slot = {};
  slot.fault = fault;
  slot.random = seed_;
  slot.random = split_mix(slot.random) ^ fault.seed;
  slot.random = split_mix(slot.random) ^ (place + 1);
  return true;
}

void FaultInjection::begin_step(std::int64_t time_ns, std::int64_t enabled_ns) noexcept TANDEM_RT {
  ++step_;
  for (FaultSlot& slot : std::span(slots_).first(count_)) {
    const ScenarioFault& fault = slot.fault;
    const bool enabled = fault.from == FaultFrom::kEnabled;
    const std::int64_t since_ns = time_ns - (enabled ? enabled_ns : 0) - fault.start_ns;
    const bool begun = (!enabled || enabled_ns >= 0) && since_ns >= 0;
    const bool over = fault.duration_ns >= 0 && since_ns >= fault.duration_ns;
    const std::uint8_t active = begun && !over ? 1 : 0;
    // A fault shorter than the way between two steps still acts on one.
    const bool missed = begun && over && slot.acted == 0;
    const std::uint8_t now = missed ? 1 : active;
    slot.began = now != 0 && slot.active == 0 ? 1 : 0;
    slot.ended = now == 0 && slot.active != 0 ? 1 : 0;
    slot.active = now;
    if (now != 0) slot.acted = 1;
  }
}

bool FaultInjection::strikes(FaultSlot& slot) noexcept {
  const ScenarioFault& fault = slot.fault;
  if (fault.count != 0 && slot.struck >= fault.count) return false;
  if (fault.probability < 1.0) {
    const double share = static_cast<double>(split_mix(slot.random) >> 11) * 0x1p-53;
    if (share >= fault.probability) return false;
  }
  ++slot.struck;
  return true;
}

void FaultInjection::pass(FrameDirection direction, std::size_t bus, const Frame& in,
                          FrameSink& out) noexcept TANDEM_RT {
  Frame frame = in;
  Frame behind;  // that changes places with this one
  bool follows = false;
  std::size_t copies = 1;
  for (std::size_t s = 0; s < count_ && copies > 0; ++s) {
    FaultSlot& slot = slots_[s];
    const FaultKind kind = slot.fault.kind;
    if (slot.active == 0) continue;
    if (kind == FaultKind::kBusDown && static_cast<std::size_t>(slot.fault.bus) == bus) copies = 0;
    if (!is_frame_fault(kind) || !selects(slot.fault, direction, bus, frame)) continue;
    const std::size_t waiting = held_by(s, direction, bus);
    if (kind == FaultKind::kFrameReorder && waiting < held_count_) {
      if (!follows) take_held(waiting, behind);
      follows = true;
      continue;
    }
    if (!strikes(slot)) continue;
    if (kind == FaultKind::kFrameDrop) copies = 0;
    if (kind == FaultKind::kFrameDuplicate) copies = 2;
    if (kind == FaultKind::kFrameCorrupt) corrupt(slot, frame);
    const std::uint64_t due = kind == FaultKind::kFrameReorder ? kNever : step_ + slot.fault.steps;
    const bool waits = kind == FaultKind::kFrameReorder || kind == FaultKind::kFrameDelay;
    if (waits && hold(s, due, direction, bus, frame)) copies = 0;
  }
  for (std::size_t i = 0; i < copies; ++i) out.push(frame);
  if (follows) out.push(behind);
}

hal::FaultKind FaultInjection::fate(FrameDirection direction, std::size_t bus) noexcept TANDEM_RT {
  for (FaultSlot& slot : std::span(slots_).first(count_)) {
    const bool wire = slot.fault.kind == FaultKind::kFrameDrop ||
                      slot.fault.kind == FaultKind::kFrameDelay ||
                      slot.fault.kind == FaultKind::kFrameDuplicate;
    if (slot.active == 0 || !wire || !goes(slot.fault.direction, direction)) continue;
    if (slot.fault.bus >= 0 && static_cast<std::size_t>(slot.fault.bus) != bus) continue;
    if (strikes(slot)) return slot.fault.kind;
  }
  return FaultKind::kNone;
}

bool FaultInjection::next_due(FrameDirection direction, std::size_t bus,
                              Frame& frame) noexcept TANDEM_RT {
  for (std::size_t i = 0; i < held_count_; ++i) {
    const Held& held = held_[i];
    if (held.direction != direction || held.bus != bus) continue;
    const FaultSlot& slot = slots_[held.slot];
    // One that waits for its successor must not wait longer than the fault lasts.
    if (held.due > step_ && (held.due != kNever || slot.active != 0)) continue;
    take_held(i, frame);
    return true;
  }
  return false;
}

bool FaultInjection::hold(std::size_t slot, std::uint64_t due, FrameDirection direction,
                          std::size_t bus, const Frame& frame) noexcept {
  if (held_count_ == held_.size()) return false;
  Held& held = held_[held_count_++];
  held = {};
  held.due = due;
  held.bus = static_cast<std::uint32_t>(bus);
  held.slot = static_cast<std::uint32_t>(slot);
  held.direction = direction;
  held.frame = frame;
  return true;
}

void FaultInjection::take_held(std::size_t index, Frame& frame) noexcept {
  frame = held_[index].frame;
  const auto at = held_.begin() + static_cast<std::ptrdiff_t>(index);
  std::copy(at + 1, held_.begin() + static_cast<std::ptrdiff_t>(held_count_), at);
  --held_count_;
}

/// Index in held_, or held_count_.
std::size_t FaultInjection::held_by(std::size_t slot, FrameDirection direction,
                                    std::size_t bus) const noexcept {
  std::size_t i = 0;
  while (i < held_count_ &&
         (held_[i].slot != slot || held_[i].direction != direction || held_[i].bus != bus)) {
    ++i;
  }
  return i;
}

const FaultSlot* FaultInjection::next_begun() noexcept TANDEM_RT {
  for (FaultSlot& slot : std::span(slots_).first(count_)) {
    if (slot.acted == 0 || slot.told != 0) continue;
    slot.told = 1;
    return &slot;
  }
  return nullptr;
}

const FaultSlot* FaultInjection::next_over() noexcept TANDEM_RT {
  for (FaultSlot& slot : std::span(slots_).first(count_)) {
    const bool body = slot.fault.kind == FaultKind::kPayload || slot.fault.kind == FaultKind::kPush;
    if (!body || slot.told != 1 || slot.active != 0) continue;
    slot.told = 2;
    return &slot;
  }
  return nullptr;
}

void FaultInjection::come_later(const FaultInjection& own, std::span<const std::size_t> slots,
                                bool alone) {
  for (const std::size_t i : slots) slots_[i] = own.slots_[i];
  if (alone) count_ = own.count_;
}

/// Only what is in use: what the arrays held before is no state.
void FaultInjection::archive(Archive& ar) {
  ar(count_, held_count_, step_, seed_);
  count_ = std::min(count_, slots_.size());
  held_count_ = std::min(held_count_, held_.size());
  for (std::size_t i = 0; i < count_; ++i) ar(slots_[i]);
  for (std::size_t i = 0; i < held_count_; ++i) ar(held_[i]);
}

}  // namespace tandem::sim
