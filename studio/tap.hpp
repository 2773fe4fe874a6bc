// Copies every cycle into a wait-free ring, for the studio's thread.
// Layer: studio.  Thread: take…() the loop's, or the emulation's; next() and lost() the studio's.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "base/spsc_ring.hpp"
#include "hal/boards.hpp"
#include "hal/cycle_observer.hpp"
#include "hal/estimate.hpp"
#include "hal/image.hpp"
#include "hal/truth.hpp"

namespace tandem::studio {

class Tap final : public hal::CycleObserver {
 public:
  /// What a cycle has: of a run all but the boards, of an emulation truth and boards.
  enum Part : std::uint8_t { kState, kCommand, kTruth, kEstimate, kBoards };
  static constexpr std::size_t kParts = 5;
  /// The images of a run or an emulation, for their sizes. Null: the cycles bring none.
  struct Images {
    const hal::StateImage* state = nullptr;
    const hal::CommandImage* command = nullptr;
    const hal::TruthImage* truth = nullptr;
    const hal::EstimateImage* estimate = nullptr;
    const hal::BoardsImage* boards = nullptr;

    /// By Part.
    [[nodiscard]] std::array<const hal::Image*, kParts> all() const noexcept {
      return {state, command, truth, estimate, boards};
    }
  };
  /// A second of cycles has room, and not less than kLeastCycles.
  static constexpr std::size_t kLeastCycles = 256, kMostCycles = 8192;

  Tap(const Images& images, std::int64_t period_ns);

  /// @rt copies the images: no lock, no heap, no system call.
  void take(const hal::CycleView& view) noexcept TANDEM_RT override;
  /// @rt the same of its numbers
  void take_signals(const hal::CycleTime& time,
                    const hal::SignalBlock& block) noexcept TANDEM_RT override;
  /// A step of an emulation.
  /// @rt the same
  void take_step(const hal::CycleTime& time, const hal::TruthImage& truth,
                 const hal::BoardsImage& boards) noexcept TANDEM_RT;

  /// One cycle, as it was taken. References are good during the call.
  struct Cycle {
    hal::CycleTime time;
    hal::RunPhase phase;  ///< of a run
    Code read_code;
    hal::CycleTimes times;
    std::array<std::span<const std::byte>, kParts> parts;  ///< by Part; empty: none
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
    hal::CycleTimes times;
    hal::RunPhase phase;
    Code read_code;
    std::array<bool, kParts> there;
    std::uint64_t turn;
  };
  /// A controller's signals cross in parts of this many bytes, so that few numbers take little.
  static constexpr std::size_t kPart = 512;
  struct PartHead {
    std::uint64_t turn;
    const hal::SignalBlock* block;
    std::uint32_t at, bytes;
  };
  static constexpr std::size_t kPartBytes = kPart - sizeof(PartHead);

  struct Places {
    explicit Places(const Images& images);

    std::array<std::size_t, kParts> at{}, bytes{};  // in a slot
    std::size_t slot_bytes = 0;
  };
  void push(Head head, const Images& images) noexcept TANDEM_RT;

  Places places_;
  SpscRing cycles_, signals_;
  std::uint64_t turn_ = 0;  // calls of take(): cycles' numbers come again where time goes back
};

}  // namespace tandem::studio
