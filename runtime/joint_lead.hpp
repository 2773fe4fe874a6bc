// Who leads a joint: one table for the whole house. Pure: no robot, no clock, no image.
// Layer: runtime.  Thread: plain data.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"
#include "hal/run_phase.hpp"

namespace tandem::runtime {

/// Where a joint's command of a cycle comes from.
enum class JointLead : std::uint8_t {
  kNobody,      ///< it has no torque
  kEnabling,    ///< its drive is not enabled yet: the reference follows the joint
  kHold,        ///< it stays where it is, or in the mode that an operator has given it
  kOperator,    ///< a motion that was asked for, or the way back to its limits
  kController,  ///< the active controller that claims it
  kOwner,       ///< the owner in another process
  kRetreat,     ///< a controller that brings the robot to a safe posture
  kReset,       ///< its drive is reset: held where it is, whoever led it before
  kUnhomed,     ///< held where it is, whoever claims it, for it has to be homed first
  kHoming,      ///< its drive looks for its place: it has no reference
};

/// What a joint's lead depends on.
struct JointSituation {
  hal::RunPhase phase = hal::RunPhase::kBringUp;
  bool released = false;   ///< a stop of category 0 is latched
  bool claimed = false;    ///< by an active controller,
  bool owned = false;      ///< which is that of the owner in another process
  bool moving = false;     ///< on an operator's motion, or the way back to its limits
  bool resetting = false;  ///< the reset of its drive is under way
  bool homing = false;     ///< its homing is under way
  bool unhomed = false;    ///< nothing but its homing may move it
};

[[nodiscard]] constexpr JointLead lead_of(const JointSituation& joint) noexcept TANDEM_RT {
  using enum hal::RunPhase;
  const bool retreats = joint.phase == kRetreating;
  const bool claimed = joint.claimed && (joint.phase == kRunning || retreats);
  if (joint.phase == kDone) return JointLead::kNobody;
  if (joint.phase == kBringUp || joint.phase == kResetting) return JointLead::kEnabling;
  if (joint.phase == kFaulted || joint.phase == kShutDown) {
    return joint.released ? JointLead::kNobody : JointLead::kHold;
  }
  if (joint.homing) return JointLead::kHoming;
  if (joint.unhomed && claimed) return JointLead::kUnhomed;
  if (joint.resetting && !claimed) return JointLead::kReset;
  if (claimed && retreats) return JointLead::kRetreat;
  if (claimed) return joint.owned ? JointLead::kOwner : JointLead::kController;
  return joint.moving && !retreats ? JointLead::kOperator : JointLead::kHold;
}

}  // namespace tandem::runtime
