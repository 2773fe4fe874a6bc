// The references of joints that nobody leads, that an operator leads, or that change hands.
// Layer: runtime.  Thread: the loop's.
#pragma once

#include <span>
#include <vector>

#include "base/realtime.hpp"
#include "controllers/controller.hpp"
#include "hal/devices.hpp"
#include "hal/image.hpp"
#include "hal/robot.hpp"
#include "runtime/bumpless_transfer.hpp"
#include "runtime/cycle_request.hpp"

namespace tandem::runtime {

/// What is measured, and the command that is written from it.
struct JointImages {
  const hal::StateImage& state;
  hal::CommandImage& command;
};

/// A joint that nobody leads is held where it was measured or came to rest, or is in the mode that
/// an operator has given it since. Whoever gets a joint gets it without a bump.
class JointReferences {
 public:
  using Claim = ControllerSetup::Claim;

  /// `joints` and `gains` outlive it.
  JointReferences(const hal::Robot& robot, std::span<const hal::JointCapabilities> joints,
                  hal::ParameterImage& gains, std::int64_t period_ns);

  // Every joint.

  /// Each cycle in which no controller writes: "stay where you are": position control at the
  /// measured position. A joint that is enabled and whose last command was in position control
  /// keeps its reference and feed-forward; it goes on to brake, and with a motion of move().
  void hold(JointImages images) noexcept TANDEM_RT;
  /// The cycle in which a stop takes every joint from whoever has it, before hold(): those that
  /// move brake as hard as their limits allow, and are held where they come to rest.
  void brake(JointImages images) noexcept TANDEM_RT;
  /// Idle: no torque. Forgets whatever led a joint.
  void release(hal::CommandImage& command) noexcept TANDEM_RT;
  /// Holds every joint, before those who own them (by joint, negative: nobody) start. They go over
  /// from what is commanded, which may be in motion when another loop sent it.
  void start(std::span<const std::int32_t> owner, JointImages images) noexcept TANDEM_RT;
  /// Around what controllers write in a cycle.
  void before_update(hal::CommandImage& command) noexcept TANDEM_RT;
  void after_update(JointImages images) noexcept TANDEM_RT;
  /// Each cycle in which joints are held, last: those of recover(), toward their limits.
  void lead_back(hal::CommandImage& command) noexcept TANDEM_RT;

  // One joint.

  /// As hold() of every joint; ends its motion.
  void hold(std::size_t joint, JointImages images) noexcept TANDEM_RT;
  /// Ends the motion that move() or recover() leads.
  void abandon(std::size_t joint) noexcept TANDEM_RT;
  /// Its controller was done in the cycle before: if that left it in motion, it brakes.
  void end(std::size_t joint, JointImages images) noexcept TANDEM_RT;
  /// It changes hands, and nobody has it any more: it stays, with its reference when that was a
  /// stiff position. @pre transfer().begin()
  void release(std::size_t joint, JointImages images) const noexcept TANDEM_RT;
  /// Its way to where it comes to rest, when it changes hands to this claim.
  [[nodiscard]] double way_rad(const Claim& claim,
                               const hal::StateImage& state) const noexcept TANDEM_RT;
  /// In the mode of its claim, with the impedance that a start gives it.
  void take_up(const Claim& claim, hal::CommandImage& command) const noexcept TANDEM_RT;

  // For an operator. What a joint that a controller claims may not: JointArbiter knows.

  /// Sets a joint's impedance and mode: position at the measured one, velocity 0, torque
  /// (reference or feed-forward) the measured one.
  /// @param writes  what is written goes to the robot; else it is for the next start
  /// @return kNone or kIncapable
  [[nodiscard]] RejectReason set(std::size_t joint, const JointRequest& wish, bool writes,
                                 JointImages images) noexcept TANDEM_RT;
  /// Starts a motion in position control; one under way goes over into it. A claim, another mode, a
  /// stop and a reset end it.
  [[nodiscard]] RejectReason move(std::size_t joint, const MoveRequest& wish,
                                  JointImages images) noexcept TANDEM_RT;
  /// Lets the joint come back to its limits, by lead_back(), at the speed that CommandLimits allows
  /// out there. A reset ends that.
  [[nodiscard]] RejectReason recover(std::size_t joint,
                                     const hal::CommandImage& command) noexcept TANDEM_RT;
  /// Whether recover() leads the joint back to its limits.
  [[nodiscard]] bool recovers(std::size_t joint) const noexcept TANDEM_RT {
    return recovers_[joint] != 0;
  }
  /// Whether move() or recover() leads the joint. The rest of a transfer is no motion.
  [[nodiscard]] bool leads(std::size_t joint) const noexcept TANDEM_RT {
    return !operator_.position.check_motion_done(joint) || recovers(joint);
  }
  /// Whether they lead any joint.
  [[nodiscard]] bool leads() const noexcept TANDEM_RT {
    for (std::size_t joint = 0; joint < recovers_.size(); ++joint) {
      if (leads(joint)) return true;
    }
    return false;
  }

  [[nodiscard]] BumplessTransfer& transfer() noexcept { return transfer_; }

  void archive(Archive& ar) { ar(impedance_, recovers_, transfer_, operator_); }

 private:
  void idle(hal::CommandImage& command) noexcept TANDEM_RT;
  void stay(std::size_t joint, JointImages images) const noexcept TANDEM_RT;
  void settle(std::size_t joint, JointImages images) const noexcept TANDEM_RT;
  void assign(std::size_t joint, hal::ControlMode mode, hal::InteractionMode interaction,
              JointImages images) const noexcept TANDEM_RT;
  void move_on(JointImages images) noexcept TANDEM_RT;

  const std::span<const hal::JointCapabilities> capabilities_;
  std::vector<BumplessTransfer::Impedance> impedance_;  // by joint: that a start gives it
  std::vector<std::uint8_t> recovers_;                  // by joint: it is led back to its limits
  hal::Devices operator_;                               // moves joints that nobody claims
  BumplessTransfer transfer_;
};

}  // namespace tandem::runtime
