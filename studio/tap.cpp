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

Tap::Places::Places(const Images& images) : slot_bytes(whole_words(sizeof(Head))) {
  const auto all = images.all();
  for (std::size_t i = 0; i < kParts; ++i) {
    bytes[i] = all[i] == nullptr ? 0 : all[i]->bytes().size();
    at[i] = slot_bytes;
    slot_bytes += whole_words(bytes[i]);
  }
}

Tap::Tap(const Images& images, std::int64_t period_ns)
    : places_(images),
      cycles_(places_.slot_bytes, cycles_of_a_second(period_ns)),
      signals_(kPart, 4 * cycles_of_a_second(period_ns)) {}

void Tap::push(Head head, const Images& images) noexcept TANDEM_RT {
  head.turn = turn_++;
  const auto slot = cycles_.begin_push();
  if (slot.empty()) return;
  const auto all = images.all();
  for (std::size_t i = 0; i < kParts; ++i) {
    head.there[i] = places_.bytes[i] != 0 && all[i] != nullptr;
    if (!head.there[i]) continue;
    std::memcpy(slot.data() + places_.at[i], all[i]->bytes().data(), places_.bytes[i]);
  }
  std::memcpy(slot.data(), &head, sizeof head);
  cycles_.end_push();
}

void Tap::take(const hal::CycleView& view) noexcept TANDEM_RT {
  push({view.time, view.times, view.phase, view.read_code, {}, 0}, {.state = &view.state,
                                                                    .command = &view.command,
                                                                    .truth = view.truth,
                                                                    .estimate = view.estimate});
}

void Tap::take_step(const hal::CycleTime& time, const hal::TruthImage& truth,
                    const hal::BoardsImage& boards) noexcept TANDEM_RT {
  push({time, {}, hal::RunPhase::kRunning, Code::kOk, {}, 0}, {.truth = &truth, .boards = &boards});
}

void Tap::take_signals(const hal::CycleTime& /*time*/,
                       const hal::SignalBlock& block) noexcept TANDEM_RT {
  const std::span<const std::byte> image = block.image();
  for (std::size_t at = 0; at < image.size(); at += kPartBytes) {
    const auto slot = signals_.begin_push();
    if (slot.empty()) return;
    const auto bytes = image.subspan(at, std::min(kPartBytes, image.size() - at));
    const PartHead head{turn_, &block, static_cast<std::uint32_t>(at),
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
    if (its.turn > head.turn) break;
    if (its.turn == head.turn) {
      signals({its.block, its.at, part.subspan(sizeof its, its.bytes)});
    }
    signals_.pop();
  }
  Cycle one{head.time, head.phase, head.read_code, head.times, {}};
  for (std::size_t i = 0; i < kParts; ++i) {
    one.parts[i] = slot.subspan(places_.at[i], head.there[i] ? places_.bytes[i] : 0);
  }
  cycle(one);
  cycles_.pop();
  return true;
}

}  // namespace tandem::studio
