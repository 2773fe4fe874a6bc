// The operator's end of a link in real time: a loop with a clock of its own, and the predicted
// robot.
// Layer: hal/remote.  Thread: made non-RT; the rest the loop's, as hal::Backend says.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hal/remote/image_network.hpp"
#include "hal/remote/operator_end.hpp"
#include "hal/remote/prediction.hpp"
#include "hal/remote/remote_backend.hpp"
#include "hal/robot.hpp"

namespace tandem::remote {

/// The operator's loop keeps the wall clock's time and waits for no state. The robot's end is
/// another process (Server with a Playout).
///
/// - Commands are numbered by the robot's cycle that the operator sees when it gives them. A state
///   of the robot is compared with the twin under the command that was due then, whether the robot
///   had got it or not.
/// - The two clocks differ. The numbers follow the robot's clock: once in 100 cycles one is left
///   out, for which the robot interpolates, or given twice, of which the robot takes the first.
///   When the robot's clock has jumped it is up to every fourth.
/// - The loop may be late by as long as play-out and lease bear: the numbers go on with the clock,
///   the robot interpolates or holds, and the twin makes the cycles up. The twin has a clock of its
///   own, without gaps.
/// - The declared networks lie before the real link. Bring-up, stops, resets, gains and shut-down
///   cross the real link alone.
class LiveLink final : public OperatorEnd {
 public:
  /// @param robot    with a pace of its own (ClientConfig::own_pace)
  /// @param twin     without a robot when config.predict is false
  /// @param config   its networks are what is added to the real link
  /// @param delay_ns of states that are on their way: the numbers begin so much before the robot's
  /// cycle
  /// @param playout_cycles  from a command's number to the robot's cycle in which it takes effect
  LiveLink(const hal::Robot& description, std::unique_ptr<RemoteBackend> robot, End twin,
           const TeleConfig& config, std::int64_t delay_ns, std::uint64_t playout_cycles,
           std::int64_t period_ns);

  [[nodiscard]] std::string status_text() const override;
  /// Sends what has crossed the declared network.
  void exchange(const hal::CycleTime& time) noexcept override;
  [[nodiscard]] Code read(const hal::CycleTime& time,
                          hal::StateImage& state) noexcept TANDEM_RT override;
  [[nodiscard]] Code write(const hal::CommandImage& command,
                           const hal::ParameterImage& parameters) noexcept TANDEM_RT override;
  void last_command(const hal::CommandImage& command) noexcept TANDEM_RT override;
  void reset() noexcept TANDEM_RT override;
  [[nodiscard]] bool archive(Archive& /*ar*/) override { return false; }

  [[nodiscard]] TeleFigures figures() const noexcept override;

 private:
  void begin_link(const hal::CycleTime& time) noexcept TANDEM_RT;
  void count_on(const hal::CycleTime& time) noexcept TANDEM_RT;
  [[nodiscard]] Code read_twin() noexcept TANDEM_RT;
  void lead_twin(const hal::CommandImage& command,
                 const hal::ParameterImage& parameters) noexcept TANDEM_RT;
  void carry_state(const hal::CycleTime& time) noexcept TANDEM_RT;
  void move_twin(const hal::CommandImage& command,
                 const hal::ParameterImage& parameters) noexcept TANDEM_RT;

  std::unique_ptr<RemoteBackend> robot_;
  TeleConfig config_;
  std::uint64_t delay_cycles_, playout_cycles_;
  ImageNetwork up_, down_;
  hal::StateImage robot_state_, twin_state_, arrived_;
  hal::CommandImage sent_, twin_command_, twin_goal_;
  TwinCorrection prediction_;
  bool twin_failed_ = false;  // and not the robot
  hal::CycleTime now_, twin_now_;
  std::int64_t linked_ns_ = 0;
  std::uint64_t number_ = 0;           // of the next command
  std::uint64_t next_kept_ = 0;        // the first number whose twin is not kept
  std::uint64_t late_ = 0;             // cycles that the loop left out before this one
  std::int64_t least_lead_ = 0;        // of the numbers before the robot's cycles, lately
  std::uint64_t led_ = 0, count_ = 0;  // states and cycles, lately
  std::int64_t owed_ = 0;              // what the next numbers are to be corrected by
  std::int64_t drifted_ = 0;           // what they were
  std::uint64_t arrived_cycle_ = 0;
};

}  // namespace tandem::remote
