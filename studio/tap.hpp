// Copies every cycle into a wait-free ring, for the studio's thread.
// Layer: studio.  Thread: take() and take_signals() the loop's; next() and lost() the studio's.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "base/spsc_ring.hpp"
#include "hal/cycle_observer.hpp"
#include "hal/estimate.hpp"
#include "hal/image.hpp"
#include "hal/truth.hpp"

namespace tandem::studio {

class Tap final : public hal::CycleObserver {
 public:
  /// The images of a run, for their sizes.
  struct Images {
    const hal::StateImage& state;
    const hal::CommandImage& command;
    const hal::TruthImage* truth = nullptr;        ///< null: the cycles bring none
    const hal::EstimateImage* estimate = nullptr;  ///< the same
  };
  /// A second of cycles has room, and not less than kLeastCycles.
  static constexpr std::size_t kLeastCycles = 256, kMostCycles = 8192;

  Tap(const Images& images, std::int64_t period_ns);

  /// @rt copies the images: no lock, no heap, no system call.
  void take(const hal::CycleView& view) noexcept TANDEM_RT override;
  /// @rt the same of its numbers
  void take_signals(const hal::CycleTime& time,
                    const hal::SignalBlock& block) noexcept TANDEM_RT override;

  /// One cycle, as it was taken. References are good during the call.
  struct Cycle {
    hal::CycleTime time;
    hal::RunPhase phase;
    std::span<const std::byte> state, command;
    std::span<const std::byte> truth, estimate;  ///< empty: none
  };
  /// Numbers of a controller's block in the same cycle, or some of them.
  struct Signals {
    const hal::SignalBlock* block;  ///< whose; it may have gone
    std::size_t at;                 ///< in its image [bytes]
    std::span<const std::byte> bytes;
  };
  /// Hands out the oldest cycle: first `signals` of each part, then `cycle`. The same again while
  /// it answers true. Signals of a cycle that found no room are dropped.
  bool next(const std::function<void(const Signals&)>& signals,
            const std::function<void(const Cycle&)>& cycle);
  /// Cycles that were taken so far. Any thread.
  [[nodiscard]] std::uint64_t taken() const noexcept { return cycles_.pushed(); }
  /// Cycles, and parts of controllers' signals, that found no room so far.
  [[nodiscard]] std::uint64_t lost() const noexcept {
    return cycles_.dropped() + signals_.dropped();
  }

 private:
  struct Head {
    hal::CycleTime time;
    hal::RunPhase phase;
    bool truth, estimate;
  };
  /// A controller's signals cross in parts of this many bytes, so that few numbers take little.
  static constexpr std::size_t kPart = 512;
  struct PartHead {
    std::uint64_t cycle;
    const hal::SignalBlock* block;
    std::uint32_t at, bytes;
  };
  static constexpr std::size_t kPartBytes = kPart - sizeof(PartHead);

  [[nodiscard]] std::size_t slot_bytes() const noexcept { return estimate_at_ + estimate_bytes_; }

  std::size_t state_bytes_, command_bytes_, truth_bytes_, estimate_bytes_;
  std::size_t state_at_, command_at_, truth_at_, estimate_at_;  // in a slot
  SpscRing cycles_, signals_;
};

}  // namespace tandem::studio
