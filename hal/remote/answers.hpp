// Whether a robot far away still answers: with states, and with newer commands in force.
// Layer: hal/remote.  Thread: the loop's.
#pragma once

#include <algorithm>
#include <cstdint>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/backend.hpp"

namespace tandem::remote {

/// In cycles of the operator's loop.
class Answers {
 public:
  /// @param limit_cycles  of a silence that is a loss
  explicit Answers(std::uint64_t limit_cycles) : limit_(limit_cycles) {}

  /// The link begins to work.
  void start(std::uint64_t cycle) noexcept TANDEM_RT {
    heard_ = answered_ = now_ = cycle;
    newest_ = 0;
  }
  /// The loop itself has left out so many cycles: no silence of the robot's.
  void left_out(std::uint64_t cycles) noexcept TANDEM_RT {
    heard_ += cycles;
    answered_ += cycles;
    now_ += cycles;
  }
  /// A state has come, of the robot under the command `number`.
  void take(std::uint64_t number, std::uint64_t cycle) noexcept TANDEM_RT {
    heard_ = cycle;
    if (number <= newest_) return;
    newest_ = number;
    answered_ = cycle;
  }
  /// Once a cycle, after what has come.
  void count(std::uint64_t cycle) noexcept TANDEM_RT {
    now_ = cycle;
    most_silent_ = std::max(most_silent_, silent());
    most_unanswered_ = std::max(most_unanswered_, unanswered());
  }

  [[nodiscard]] hal::FaultCause loss() const noexcept TANDEM_RT {
    if (unanswered() <= limit_) return hal::FaultCause::kNone;
    return 2 * silent() > limit_ ? hal::FaultCause::kLinkStates : hal::FaultCause::kLinkCommands;
  }
  /// Since a state came.
  [[nodiscard]] std::uint64_t silent() const noexcept TANDEM_RT { return now_ - heard_; }
  [[nodiscard]] std::uint64_t most_silent() const noexcept { return most_silent_; }
  /// Since a state came that showed a newer command in force.
  [[nodiscard]] std::uint64_t unanswered() const noexcept TANDEM_RT { return now_ - answered_; }
  [[nodiscard]] std::uint64_t most_unanswered() const noexcept { return most_unanswered_; }
  void archive(Archive& ar) {
    ar(heard_, answered_, newest_, now_, most_silent_, most_unanswered_);
  }

 private:
  std::uint64_t limit_;
  std::uint64_t heard_ = 0, answered_ = 0, newest_ = 0, now_ = 0;
  std::uint64_t most_silent_ = 0, most_unanswered_ = 0;
};

}  // namespace tandem::remote
