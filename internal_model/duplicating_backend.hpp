// The first robot's backend, with a copy of every call on a tape for the second.
// Layer: internal_model.  Thread: as hal::Backend.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "hal/forwarding_backend.hpp"
#include "hal/truth.hpp"
#include "internal_model/command_tape.hpp"

namespace tandem::internal_model {

/// Passes every call on to `first`, unchanged, and records it. What stands behind `first` makes no
/// difference: a simulation, boards on a wire, a robot of another process.
///
/// In simulated time no cycle is left out: exchange(), the only call that may block, waits until
/// the second robot is at most kMostBehind cycles behind. On a clock nothing waits: a cycle that
/// finds no free record is counted (CommandTape::dropped()).
class DuplicatingBackend final : public hal::ForwardingBackend {
 public:
  /// Cycles that the second robot may be behind in simulated time.
  static constexpr std::uint64_t kMostBehind = 64;

  /// @param done   how many records the second robot has carried out
  /// @param truth  the first robot's, filled by its read(); null: none
  /// All outlive it.
  DuplicatingBackend(hal::Backend& first, CommandTape& tape, std::size_t joints,
                     const std::atomic<std::uint64_t>& done, const hal::TruthImage* truth);

  /// Cycles so far. The loop's. @rt
  [[nodiscard]] std::uint64_t cycles() const noexcept TANDEM_RT { return cycles_; }

  void exchange(const hal::CycleTime& time) noexcept override;
  [[nodiscard]] Code read(const hal::CycleTime& time,
                          hal::StateImage& state) noexcept TANDEM_RT override;
  [[nodiscard]] Code write(const hal::CommandImage& command,
                           const hal::ParameterImage& gains) noexcept TANDEM_RT override;
  void stop(hal::StopCategory category) noexcept TANDEM_RT override;
  void reset() noexcept TANDEM_RT override;
  bool home(std::size_t joint) noexcept TANDEM_RT override;
  void stop_homing(std::size_t joint) noexcept TANDEM_RT override;
  [[nodiscard]] bool shut_down() noexcept TANDEM_RT override;
  void heed(hal::Outside& outside) noexcept override {
    outside_ = &outside;
    to().heed(outside);
  }
  /// Both robots, where the first can be rewound: waits for the second, whose thread stands then.
  [[nodiscard]] bool archive(Archive& ar) override;
  /// How the second writes itself down, or reads itself; false: it cannot. Before the first cycle.
  void archive_second_by(std::function<bool(Archive&)> archive) { second_ = std::move(archive); }

 private:
  void note(const BackendCall& call) noexcept TANDEM_RT;
  void end_record() noexcept TANDEM_RT;
  void wait_for_second(std::uint64_t most_behind) const noexcept;

  std::function<bool(Archive&)> second_;
  const hal::Outside* outside_ = nullptr;
  CommandTape* tape_;
  const std::atomic<std::uint64_t>* done_;
  const hal::TruthImage* truth_;
  CommandRecord* record_ = nullptr;  // of this cycle; null: there was no place
  std::uint64_t cycles_ = 0;
  std::array<BackendCall, CommandRecord::kMostCalls> late_{};  // since the last record's end
  std::size_t late_calls_ = 0;
  bool gains_known_ = false;              // the tape has had some
  std::vector<std::uint32_t> revisions_;  // of them
};

}  // namespace tandem::internal_model
