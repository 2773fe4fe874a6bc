// Decides each cycle who leads each joint, and writes the command before the limits.
// Layer: runtime.  Thread: the loop's.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/command_delay.hpp"
#include "runtime/joint_homing.hpp"
#include "runtime/joint_lead.hpp"
#include "runtime/unfollowed_references.hpp"

namespace tandem::runtime {

/// The only one who writes the command before it goes to the limits. lead_of() says who leads a
/// joint; write() lets each of them write, once a cycle. What others ask for in between (a switch
/// of controllers, a joint's motion) goes through here, too.
class JointArbiter {
 public:
  /// All outlive it.
  JointArbiter(CycleNow& now, const DriveResets& resets, const JointHoming& homing);

  /// Who leads `joint` in this cycle; before write(): in the last one.
  [[nodiscard]] JointLead lead(std::size_t joint) const noexcept TANDEM_RT { return leads_[joint]; }
  /// For the limits and the drives; between two cycles: what was sent last.
  [[nodiscard]] const hal::CommandImage& command() const noexcept TANDEM_RT { return command_; }
  /// What those who lead the joints want, before a declared delay and the limits.
  [[nodiscard]] const hal::CommandImage& wanted() const noexcept TANDEM_RT {
    return is_delayed() ? wanted_ : command_;
  }
  /// As log and statistics have it: command(), but for references that no drive follows.
  [[nodiscard]] const hal::CommandImage& told() noexcept TANDEM_RT {
    return unfollowed_.in(command_);
  }
  /// By joint: whether told() has a position reference of it that no drive follows.
  [[nodiscard]] std::span<const std::uint8_t> unfollowed() const noexcept TANDEM_RT {
    return unfollowed_.written();
  }
  /// Controllers are started.
  [[nodiscard]] bool controls() const noexcept TANDEM_RT { return controls_; }
  /// Cycles of kRunning in which they ran.
  [[nodiscard]] std::uint64_t running_cycles() const noexcept { return ran_; }

  // Whether somebody may lead.

  /// @param drives  what is asked for needs a drive that is well
  [[nodiscard]] CycleAnswer may_lead(std::size_t joint, bool drives) const noexcept TANDEM_RT;
  [[nodiscard]] CycleAnswer may_start(ControllerSet start) const noexcept TANDEM_RT;

  // Changes of who leads, between check and update. What they answer: ControllerHost, and
  // JointReferences for what an operator asks for.

  /// The run's next phase, if this leads to one. Controllers stop with it, but for a retreat, which
  /// they carry out. Joints that a stop finds in motion brake.
  void on(RunEvent event, bool holds_back = false) noexcept TANDEM_RT;
  [[nodiscard]] CycleAnswer switch_over(ControllerSet stop, ControllerSet start) noexcept TANDEM_RT;
  /// Puts `next` in the place of the controller in `slot`.
  [[nodiscard]] CycleAnswer replace(std::size_t slot, HostedController& next) noexcept TANDEM_RT;
  /// From held joints to controllers, which run from now on: no joint jumps.
  [[nodiscard]] CycleAnswer leave_hold(ControllerSet stop, ControllerSet start) noexcept TANDEM_RT;
  [[nodiscard]] bool retreat() noexcept TANDEM_RT;
  /// Goes on from what the robot follows, when that is another loop's.
  void follow_robot() noexcept TANDEM_RT;
  /// In lockstep the owner's end has led its joints over from what is in force here, and its delay
  /// and its limits have passed that on: what arrives is the command, to the last bit.
  void take_from_owner() noexcept TANDEM_RT;
  [[nodiscard]] CycleAnswer set_joint(std::size_t joint,
                                      const JointRequest& wish) noexcept TANDEM_RT;
  [[nodiscard]] CycleAnswer move(std::size_t joint, const MoveRequest& wish) noexcept TANDEM_RT;
  [[nodiscard]] CycleAnswer recover(std::size_t joint) noexcept TANDEM_RT;
  /// Its homing has ended: it is held where it is.
  void end_homing(std::size_t joint) noexcept TANDEM_RT;

  // The cycle.

  /// @param repeats  the cycle is late: the controllers' last command goes out once more
  /// @return ControllerHost::update()'s; kOk where no controller runs
  [[nodiscard]] Code write(bool repeats) noexcept TANDEM_RT;
  /// What write() has written, for the limits to correct.
  [[nodiscard]] hal::CommandImage& to_limit() noexcept TANDEM_RT;
  /// Tells the drives whose reset begins in this cycle, or that they have heard of it.
  void tell_resets(bool begun) noexcept TANDEM_RT;
  /// A stop: nothing is reset any more, for a controller neither.
  void forget_resets() noexcept TANDEM_RT;

  void archive(Archive& ar);

 private:
  [[nodiscard]] bool is_delayed() const noexcept TANDEM_RT { return controls_ && delay_.on(); }
  /// What those who lead the joints write.
  [[nodiscard]] JointImages led() noexcept TANDEM_RT {
    return {now_.state, is_delayed() ? wanted_ : command_};
  }
  /// What is sent, whatever delay there is.
  [[nodiscard]] JointImages sent() noexcept TANDEM_RT { return {now_.state, command_}; }
  [[nodiscard]] CycleAnswer owner_of(std::size_t joint) const noexcept TANDEM_RT;
  void stamp(hal::CommandImage& command) const noexcept TANDEM_RT;
  void decide() noexcept TANDEM_RT;
  void start_controllers() noexcept TANDEM_RT;
  [[nodiscard]] Code run_controllers() noexcept TANDEM_RT;
  void overrule() noexcept TANDEM_RT;
  [[nodiscard]] bool go_on_from_robot() noexcept TANDEM_RT;
  void fill_delay() noexcept TANDEM_RT;

  CycleNow& now_;
  JointReferences& references_;
  const DriveResets& resets_;
  const JointHoming& homing_;

  std::vector<JointLead> leads_;
  hal::CommandImage command_;
  hal::CommandImage wanted_;  // by the controllers, when what they want is delayed
  CommandDelay delay_;
  UnfollowedReferences unfollowed_;
  bool controls_ = false;
  bool brakes_ = false;  // a stop has found joints that nobody has any more
  std::uint64_t ran_ = 0;
};

}  // namespace tandem::runtime
