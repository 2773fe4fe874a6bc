// A robot behind a narrow, noisy link: what an operator sees of it, and what the robot does alone.
// Layer: hal/remote.  Thread: made non-RT; the rest the loop's, as hal::Backend says.
#pragma once

#include <cstdint>
#include <memory>

#include "hal/command_limits.hpp"
#include "hal/remote/image_network.hpp"
#include "hal/remote/operator_end.hpp"
#include "hal/remote/playout.hpp"
#include "hal/remote/prediction.hpp"
#include "hal/robot.hpp"

namespace tandem::remote {

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
///   difference of a state and of what the twin was under the command that was due at the robot
///   then: under the same one, or the robot has not got it.
/// - Bring-up, stops, resets and shut-down do not cross the network.
class TeleBackend final : public OperatorEnd {
 public:
  /// @param twin  without a robot when config.predict is false; else as `robot`, of the same period
  TeleBackend(const hal::Robot& description, End robot, End twin, const TeleConfig& config,
              std::int64_t period_ns);

  [[nodiscard]] Code read(const hal::CycleTime& time,
                          hal::StateImage& state) noexcept TANDEM_RT override;
  [[nodiscard]] Code write(const hal::CommandImage& command,
                           const hal::ParameterImage& parameters) noexcept TANDEM_RT override;
  bool set_link(const hal::LinkChange& change) noexcept TANDEM_RT override;
  void heed(hal::Outside& outside) noexcept override { robot_->heed(outside); }
  std::size_t forget_waiting() noexcept override { return robot_->forget_waiting(); }
  [[nodiscard]] bool archive(Archive& ar) override;

  [[nodiscard]] TeleFigures figures() const noexcept override;
  /// What the robot follows in this cycle.
  [[nodiscard]] const hal::CommandImage& robot_command() const noexcept { return robot_command_; }

 private:
  void begin_link(const hal::CycleTime& time) noexcept TANDEM_RT;
  void carry_state(const hal::CycleTime& time) noexcept TANDEM_RT;
  void show(const hal::CycleTime& time, hal::StateImage& state) noexcept TANDEM_RT;
  void carry_command(const hal::CommandImage& command) noexcept TANDEM_RT;

  std::unique_ptr<hal::Backend> robot_;
  std::unique_ptr<RobotSide> robot_side_;
  TeleConfig config_;
  ImageNetwork up_, down_;
  Playout playout_;
  hal::CommandLimits limits_;
  hal::StateImage robot_state_, twin_state_, arrived_;
  hal::CommandImage robot_command_, twin_command_, received_;
  hal::CycleTime now_;
  std::int64_t linked_ns_ = 0;       // when it began
  std::uint64_t arrived_cycle_ = 0;  // of the newest state that the operator has
  std::uint64_t playout_cycles_;
  TwinCorrection prediction_;
};

}  // namespace tandem::remote
