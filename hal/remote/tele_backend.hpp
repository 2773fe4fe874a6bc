// A robot behind a narrow, noisy link: what an operator sees of it, and what the robot does alone.
// Layer: hal/remote.  Thread: made non-RT; the rest the loop's, as hal::Backend says.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/command_limits.hpp"
#include "hal/forwarding_backend.hpp"
#include "hal/remote/image_network.hpp"
#include "hal/remote/playout.hpp"
#include "hal/remote/prediction.hpp"
#include "hal/remote/robot_side.hpp"
#include "hal/robot.hpp"

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
  /// By which the numbers of commands followed the robot's clock: negative when it is the slower
  /// one. 0 in simulated time.
  std::int64_t clock_cycles = 0;
  std::uint64_t compared = 0;         ///< states that were held against their prediction
  double worst_prediction_rad = 0.0;  ///< of a joint of these: the state less its prediction
};

/// What a run's table, JSON and report ask of the operator's end, whichever it is.
class OperatorEnd {
 public:
  virtual ~OperatorEnd() = default;
  [[nodiscard]] virtual TeleFigures figures() const noexcept = 0;
};

/// The loop that uses this backend is the operator's. Each of its cycles is one of the robot's.
///
/// From when both are operational:
/// - A command crosses `up` and waits at the robot until `playout_ns` after it was given, so that
///   jitter and loss do not reach the drives; between commands that arrived the robot interpolates.
///   Without a command it brakes within `brake_ns` and holds. When commands come again, it returns
///   to them without a step, at its joints' speed at most. Controllers of its own have
///   their joints by its own state. Range and rate limits apply at the robot once more.
/// - States cross `down`. With `predict` the operator's loop sees the twin, a robot of the same
///   description that follows each command at once. It is corrected by what arrives: the low-passed
///   difference of a state and of what the twin was when it had been given the same commands.
/// - Bring-up, stops, resets and shut-down do not cross the network.
class TeleBackend final : public hal::ForwardingBackend, public OperatorEnd {
 public:
  /// A robot, and control of its own; that may be null.
  struct End {
    std::unique_ptr<hal::Backend> robot = nullptr;
    std::unique_ptr<RobotSide> side = nullptr;
  };
  /// @param twin  without a robot when config.predict is false; else as `robot`, of the same period
  TeleBackend(const hal::Robot& description, End robot, End twin, const TeleConfig& config,
              std::int64_t period_ns);

  [[nodiscard]] hal::Phase phase() const noexcept override;
  [[nodiscard]] Code read(const hal::CycleTime& time,
                          hal::StateImage& state) noexcept TANDEM_RT override;
  [[nodiscard]] Code write(const hal::CommandImage& command,
                           const hal::ParameterImage& parameters) noexcept TANDEM_RT override;
  void stop(hal::StopCategory category) noexcept TANDEM_RT override;
  void reset() noexcept TANDEM_RT override;
  [[nodiscard]] bool resets_one_joint() const noexcept TANDEM_RT override { return false; }
  /// Nothing is homed over the link: a command is on its way for too long.
  bool home(std::size_t /*joint*/) noexcept TANDEM_RT override { return false; }
  [[nodiscard]] bool shut_down() noexcept TANDEM_RT override;
  [[nodiscard]] bool archive(Archive& ar) override;

  [[nodiscard]] TeleFigures figures() const noexcept override;
  /// The robot's own state in this cycle, which the operator has not seen yet.
  [[nodiscard]] const hal::StateImage& robot_state() const noexcept { return robot_state_; }
  /// What the robot follows in this cycle.
  [[nodiscard]] const hal::CommandImage& robot_command() const noexcept { return robot_command_; }

 private:
  void begin_link(const hal::CycleTime& time) noexcept TANDEM_RT;
  void carry_state(const hal::CycleTime& time) noexcept TANDEM_RT;
  void show(const hal::CycleTime& time, hal::StateImage& state) noexcept TANDEM_RT;
  void carry_command(const hal::CommandImage& command) noexcept TANDEM_RT;

  std::unique_ptr<hal::Backend> robot_, twin_;
  std::unique_ptr<RobotSide> robot_side_, twin_side_;
  TeleConfig config_;
  ImageNetwork up_, down_;
  Playout playout_;
  hal::CommandLimits limits_;
  hal::StateImage robot_state_, twin_state_, arrived_;
  hal::CommandImage robot_command_, twin_command_, received_;
  bool linked_ = false;
  bool ended_ = false;  // the robot follows no command any more: it says nothing of the model
  hal::CycleTime now_;
  std::int64_t linked_ns_ = 0;       // when it began
  std::uint64_t arrived_cycle_ = 0;  // of the newest state that the operator has
  std::uint64_t heard_cycle_ = 0;    // in which it came
  std::uint64_t most_silent_ = 0;
  Prediction prediction_;
};

}  // namespace tandem::remote
