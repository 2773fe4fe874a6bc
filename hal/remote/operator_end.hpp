// What the operator's ends of a link have in common, TeleBackend's in simulated time and LiveLink's
// in real time: the robot, and beside it the predicted one.
// Layer: hal/remote.  Thread: made non-RT; the rest the loop's, as hal::Backend says.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "hal/forwarding_backend.hpp"
#include "hal/remote/answers.hpp"
#include "hal/remote/network.hpp"
#include "hal/remote/robot_side.hpp"

namespace tandem::remote {

/// When nothing passes, in the loop's time since the link began to work.
struct Outage {
  std::int64_t from_ns = 0;
  std::int64_t to_ns = 0;
};

struct TeleConfig {
  NetworkConfig up;    ///< of commands, to the robot
  NetworkConfig down;  ///< of states, to the operator
  std::uint64_t seed = 1;
  bool predict = true;          ///< the operator sees the predicted robot, else the last state
  std::int64_t playout_ns = 0;  ///< a command takes effect so long after it was given
  std::int64_t correction_ns = 500'000'000;  ///< time constant of the prediction's correction
  std::int64_t brake_ns = 250'000'000;       ///< in which the robot stops when commands end
  /// Time without a state that shows a newer command in force: the link is lost. It is reported.
  std::int64_t unanswered_ns = 1'000'000'000;
  std::vector<Outage> outages;

  [[nodiscard]] bool is_cut(std::int64_t since_ns) const noexcept TANDEM_RT {
    return std::ranges::any_of(outages, [since_ns](const Outage& one) {
      return since_ns >= one.from_ns && since_ns < one.to_ns;
    });
  }
};

/// What the operator's end knows of the link and of the prediction. For the loop's thread, or when
/// it has stopped.
struct TeleFigures {
  Network::Counts up, down;
  bool robot_end = true;                 ///< it is here: the next two are known
  std::uint64_t starved_cycles = 0;      ///< in which the robot had no command and braked or held
  std::uint64_t holds = 0;               ///< how often that began
  std::uint64_t silent_cycles = 0;       ///< since the newest state came, until now
  std::uint64_t most_silent_cycles = 0;  ///< the longest time without one, the first included
  /// The same, since a state came that showed a newer command in force.
  std::uint64_t unanswered_cycles = 0;
  std::uint64_t most_unanswered_cycles = 0;
  /// By which the numbers of commands followed the robot's clock: negative when it is the slower
  /// one. 0 in simulated time.
  std::int64_t clock_cycles = 0;
  std::uint64_t compared = 0;         ///< states that were held against their prediction
  double worst_prediction_rad = 0.0;  ///< of a joint of these: the state less its prediction
};

/// Cycles that begin within `ns`.
[[nodiscard]] constexpr std::uint64_t cycles_in(std::int64_t ns, std::int64_t period_ns) {
  return static_cast<std::uint64_t>((ns + period_ns - 1) / period_ns);
}

/// Stops, resets and the shut-down are the robot's and the twin's at once: they do not cross the
/// declared network.
class OperatorEnd : public hal::ForwardingBackend {
 public:
  /// A robot, and control of its own; that may be null.
  struct End {
    std::unique_ptr<hal::Backend> robot = nullptr;
    std::unique_ptr<RobotSide> side = nullptr;
  };

  [[nodiscard]] hal::Phase phase() const noexcept override;
  void stop(hal::StopCategory category) noexcept TANDEM_RT override;
  void reset() noexcept TANDEM_RT override;
  [[nodiscard]] bool resets_one_joint() const noexcept TANDEM_RT override { return false; }
  /// Nothing is homed over the link: a command is on its way for too long.
  bool home(std::size_t /*joint*/) noexcept TANDEM_RT override { return false; }
  [[nodiscard]] bool shut_down() noexcept TANDEM_RT override;
  [[nodiscard]] hal::FaultCause link_loss() const noexcept TANDEM_RT override {
    return linked_ ? answers_.loss() : hal::FaultCause::kNone;
  }

  /// What a run's table, JSON and report ask.
  [[nodiscard]] virtual TeleFigures figures() const noexcept = 0;

 protected:
  /// @param robot  outlives it
  /// @param twin   without a robot: nothing is predicted
  /// @param unanswered_cycles  after which the link is lost
  OperatorEnd(hal::Backend& robot, End twin, std::uint64_t unanswered_cycles);

  std::unique_ptr<hal::Backend> twin_;
  std::unique_ptr<RobotSide> twin_side_;
  bool linked_ = false;
  Answers answers_;
  bool ended_ = false;  // the robot follows no command any more: it says nothing of the model
};

}  // namespace tandem::remote
