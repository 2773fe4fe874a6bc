// The loop pushes the parts of controllers' signals before the cycle that they belong to, so that
// whoever finds a cycle in the ring finds its signals as well.
#include "studio/tap.hpp"

#include <algorithm>
#include <cstring>

namespace tandem::studio {
namespace {

constexpr std::size_t whole_words(std::size_t bytes) { return (bytes + 15) / 16 * 16; }

std::size_t cycles_of_a_second(std::int64_t period_ns) {
  const auto cycles =
      static_cast<std::size_t>(1'000'000'000 / std::max<std::int64_t>(1, period_ns));
  return std::clamp(cycles, Tap::kLeastCycles, Tap::kMostCycles);
}

}  // namespace

Tap::Tap(const Images& images, std::int64_t period_ns)
    : state_bytes_(images.state.bytes().size()),
      command_bytes_(images.command.bytes().size()),
      truth_bytes_(images.truth == nullptr ? 0 : images.truth->bytes().size()),
      estimate_bytes_(images.estimate == nullptr ? 0 : images.estimate->bytes().size()),
      state_at_(whole_words(sizeof(Head))),
      command_at_(state_at_ + whole_words(state_bytes_)),
      truth_at_(command_at_ + whole_words(command_bytes_)),
      estimate_at_(truth_at_ + whole_words(truth_bytes_)),
      cycles_(slot_bytes(), cycles_of_a_second(period_ns)),
      signals_(kPart, 4 * cycles_of_a_second(period_ns)) {}

void Tap::take(const hal::CycleView& view) noexcept TANDEM_RT {
  const auto slot = cycles_.begin_push();
  if (slot.empty()) return;
  const bool truth = truth_bytes_ != 0 && view.truth != nullptr;
  const bool estimate = estimate_bytes_ != 0 && view.estimate != nullptr;
  const Head head{view.time, view.times, view.phase, view.read_code, truth, estimate};
  std::memcpy(slot.data(), &head, sizeof head);
  std::memcpy(slot.data() + state_at_, view.state.bytes().data(), state_bytes_);
  std::memcpy(slot.data() + command_at_, view.command.bytes().data(), command_bytes_);
  if (truth) std::memcpy(slot.data() + truth_at_, view.truth->bytes().data(), truth_bytes_);
  if (estimate) {
    std::memcpy(slot.data() + estimate_at_, view.estimate->bytes().data(), estimate_bytes_);
  }
  cycles_.end_push();
}

void Tap::take_signals(const hal::CycleTime& time,
                       const hal::SignalBlock& block) noexcept TANDEM_RT {
  const std::span<const std::byte> image = block.image();
  for (std::size_t at = 0; at < image.size(); at += kPartBytes) {
    const auto slot = signals_.begin_push();
    if (slot.empty()) return;
    const auto bytes = image.subspan(at, std::min(kPartBytes, image.size() - at));
    const PartHead head{time.cycle, &block, static_cast<std::uint32_t>(at),
                        static_cast<std::uint32_t>(bytes.size())};
    std::memcpy(slot.data(), &head, sizeof head);
    std::memcpy(slot.data() + sizeof head, bytes.data(), bytes.size());
    signals_.end_push();
  }
}

bool Tap::next(const std::function<void(const Signals&)>& signals,
               const std::function<void(const Cycle&)>& cycle) {
  const auto slot = cycles_.front();
  if (slot.empty()) return false;
  Head head{};
  std::memcpy(&head, slot.data(), sizeof head);
  for (auto part = signals_.front(); !part.empty(); part = signals_.front()) {
    PartHead its{};
    std::memcpy(&its, part.data(), sizeof its);
    if (its.cycle > head.time.cycle) break;
    if (its.cycle == head.time.cycle) {
      signals({its.block, its.at, part.subspan(sizeof its, its.bytes)});
    }
    signals_.pop();
  }
  cycle({head.time, head.phase, head.read_code, head.times, slot.subspan(state_at_, state_bytes_),
         slot.subspan(command_at_, command_bytes_),
         slot.subspan(truth_at_, head.truth ? truth_bytes_ : 0),
         slot.subspan(estimate_at_, head.estimate ? estimate_bytes_ : 0)});
  cycles_.pop();
  return true;
}

}  // namespace tandem::studio
