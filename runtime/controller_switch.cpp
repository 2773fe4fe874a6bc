// ControllerHost's references: who holds a joint, and what changes when it changes hands.
#include <algorithm>
#include <cmath>

#include "hal/motion_limits.hpp"
#include "runtime/controller_host.hpp"

namespace tandem::runtime {

using hal::ControlMode;
using hal::InteractionMode;

namespace {

constexpr auto kPositionMode = static_cast<std::int8_t>(ControlMode::kPosition);
constexpr auto kStiffMode = static_cast<std::uint8_t>(InteractionMode::kStiff);

bool is_enabled(const hal::StateImage& state, std::size_t joint) noexcept TANDEM_RT {
  return state.drive_state()[joint] ==
         static_cast<std::uint8_t>(hal::DriveState::kOperationEnabled);
}

LoopAnswer refuse(RejectReason why, std::size_t one) noexcept TANDEM_RT {
  return {.reason = why, .one = static_cast<std::int32_t>(one)};
}

}  // namespace

void ControllerHost::hold(const hal::StateImage& state,
                          hal::CommandImage& command) noexcept TANDEM_RT {
  transfer_.watch(command);
  transfer_.before_update(command);
  for (std::size_t j = 0; j < capabilities_.size(); ++j) stay(j, state, command);
  move_on(state, command);
  lead_back(command);
  transfer_.after_update(state, command);
}

void ControllerHost::hold(std::size_t joint, const hal::StateImage& state,
                          hal::CommandImage& command) noexcept TANDEM_RT {
  operator_.position.abandon(joint);
  recovers_[joint] = 0;
  stay(joint, state, command);
}

void ControllerHost::brake(const hal::StateImage& state,
                           hal::CommandImage& command) noexcept TANDEM_RT {
  operator_.position.abandon();
  std::ranges::fill(recovers_, std::uint8_t{0});
  transfer_.clear();
  for (std::size_t j = 0; j < capabilities_.size(); ++j) {
    transfer_.begin(j, state, command, BumplessTransfer::Pace::kHard);
    release(j, state, command);
  }
}

void ControllerHost::stay(std::size_t joint, const hal::StateImage& state,
                          hal::CommandImage& command) const noexcept TANDEM_RT {
  if (!capabilities_[joint].can(hal::Capability::kPosition)) {
    command.mode()[joint] = static_cast<std::int8_t>(ControlMode::kIdle);
    return;
  }
  if (command.mode()[joint] != kPositionMode || !is_enabled(state, joint)) {
    command.mode()[joint] = kPositionMode;
    command.interaction()[joint] = kStiffMode;
    command.position_rad()[joint] = state.position_rad()[joint];
    command.torque_Nm()[joint] = 0.0;
  }
  command.velocity_rad_s()[joint] = 0.0;
}

/// A joint that has begun to change hands, whose reference is in position control: where it comes
/// to rest.
void ControllerHost::settle(std::size_t joint, const hal::StateImage& state,
                            hal::CommandImage& command) const noexcept TANDEM_RT {
  const BumplessTransfer::Brake brake =
      transfer_.brake(joint, state, static_cast<ControlMode>(command.mode()[joint]),
                      static_cast<InteractionMode>(command.interaction()[joint]));
  if (brake.way_rad == 0.0) return;
  command.position_rad()[joint] = brake.from_rad + brake.way_rad;
  command.velocity_rad_s()[joint] = 0.0;
}

/// The joints of controllers that were done in the cycle before: one that ended in motion brakes.
void ControllerHost::settle_ended(const hal::StateImage& state,
                                  hal::CommandImage& command) noexcept TANDEM_RT {
  for (std::size_t slot = 0; ended_ != 0 && slot < table_.size(); ++slot) {
    if ((ended_ & only(slot)) == 0 || table_[slot] == nullptr || !is_active(slot)) continue;
    for (const auto& claim : table_[slot]->claims) {
      if (command.mode()[claim.joint] != kPositionMode) continue;
      transfer_.begin(claim.joint, state, command);
      settle(claim.joint, state, command);
      command.velocity_rad_s()[claim.joint] = 0.0;
    }
  }
  ended_ = 0;
}

/// `state`, but with the joints that `start` claims, and that brake, where they come to rest.
const hal::StateImage& ControllerHost::at_rest(const hal::StateImage& state,
                                               ControllerSet start) noexcept TANDEM_RT {
  bool brakes = false;
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if ((start & only(slot)) == 0 || table_[slot] == nullptr) continue;
    for (const auto& claim : table_[slot]->claims) {
      const double way_rad =
          transfer_.brake(claim.joint, state, claim.mode, claim.interaction).way_rad;
      if (way_rad == 0.0) continue;
      if (!brakes) at_rest_.assign(state);
      brakes = true;
      at_rest_.position_rad()[claim.joint] += way_rad;
      at_rest_.velocity_rad_s()[claim.joint] = 0.0;
    }
  }
  return brakes ? at_rest_ : state;
}

void ControllerHost::release(hal::CommandImage& command) noexcept TANDEM_RT {
  idle(command);
  transfer_.clear();
}

void ControllerHost::idle(hal::CommandImage& command) noexcept TANDEM_RT {
  std::ranges::fill(command.mode(), static_cast<std::int8_t>(ControlMode::kIdle));
  std::ranges::fill(recovers_, std::uint8_t{0});
  operator_.position.abandon();
}

void ControllerHost::set_modes(const HostedController& one,
                               hal::CommandImage& command) const noexcept TANDEM_RT {
  for (const auto& claim : one.claims) {
    command.mode()[claim.joint] = static_cast<std::int8_t>(claim.mode);
    command.interaction()[claim.joint] = static_cast<std::uint8_t>(claim.interaction);
    command.stiffness_Nm_rad()[claim.joint] = impedance_[claim.joint].stiffness_Nm_rad;
    command.damping_Nms_rad()[claim.joint] = impedance_[claim.joint].damping_Nms_rad;
    command.velocity_rad_s()[claim.joint] = 0.0;  // an operator's, which nobody may write any more
  }
}

/// Every reference at what is measured, or where the joint comes to rest. The torque is that of the
/// spring now: what carries the load goes on to carry it, as reference or as feed-forward.
void ControllerHost::assign(std::size_t joint, ControlMode mode, InteractionMode interaction,
                            const hal::StateImage& state,
                            hal::CommandImage& command) const noexcept TANDEM_RT {
  const bool carries = is_enabled(state, joint) && mode != ControlMode::kIdle &&
                       command.mode()[joint] != static_cast<std::int8_t>(ControlMode::kIdle);
  command.mode()[joint] = static_cast<std::int8_t>(mode);
  command.interaction()[joint] = static_cast<std::uint8_t>(interaction);
  command.position_rad()[joint] = state.position_rad()[joint];
  command.velocity_rad_s()[joint] = 0.0;
  command.torque_Nm()[joint] = carries ? state.torque_Nm()[joint] : 0.0;
  command.voltage_V()[joint] = mode == ControlMode::kOpenLoop ? state.voltage_V()[joint] : 0.0;
  command.current_A()[joint] = mode == ControlMode::kCurrent ? state.current_A()[joint] : 0.0;
  command.stiffness_Nm_rad()[joint] = impedance_[joint].stiffness_Nm_rad;
  command.damping_Nms_rad()[joint] = impedance_[joint].damping_Nms_rad;
  settle(joint, state, command);
}

/// A joint that nobody has any more stays: with its reference, when that was a stiff position.
void ControllerHost::release(std::size_t joint, const hal::StateImage& state,
                             hal::CommandImage& command) const noexcept TANDEM_RT {
  const bool keeps = command.mode()[joint] == kPositionMode &&
                     command.interaction()[joint] == kStiffMode && is_enabled(state, joint);
  if (keeps) {
    command.velocity_rad_s()[joint] = 0.0;
    settle(joint, state, command);
    return;
  }
  const bool can = capabilities_[joint].can(hal::Capability::kPosition);
  assign(joint, can ? ControlMode::kPosition : ControlMode::kIdle, InteractionMode::kStiff, state,
         command);
}

bool ControllerHost::is_claimed(std::size_t joint, ControllerSet by) const noexcept TANDEM_RT {
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if ((by & only(slot)) == 0 || table_[slot] == nullptr) continue;
    if (table_[slot]->claimed[joint] != 0) return true;
  }
  return false;
}

LoopAnswer ControllerHost::insert(std::size_t slot,
                                  HostedController& controller) noexcept TANDEM_RT {
  table_[slot] = &controller;
  return {};
}

LoopAnswer ControllerHost::remove(std::size_t slot) noexcept TANDEM_RT {
  if (table_[slot] == nullptr) return refuse(RejectReason::kGone, slot);
  if (is_active(slot)) return refuse(RejectReason::kActive, slot);
  table_[slot] = nullptr;
  return {};
}

LoopAnswer ControllerHost::switch_over(ControllerSet stop, ControllerSet start, bool running,
                                       const hal::CycleTime& time, const hal::StateImage& state,
                                       hal::CommandImage& command) noexcept TANDEM_RT {
  const ControllerSet after = (active_ & ~stop) | start;
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    const bool named = ((stop | start) & only(slot)) != 0;
    if (named && table_[slot] == nullptr) return refuse(RejectReason::kGone, slot);
    if (named && is_active(slot) != ((stop & only(slot)) != 0)) {
      return refuse(RejectReason::kActive, slot);
    }
  }
  if (const auto conflict = find_conflict(table_, after)) {
    return {.reason = RejectReason::kConflict,
            .joint = static_cast<std::int32_t>(conflict->joint),
            .one = static_cast<std::int32_t>(conflict->one),
            .other = static_cast<std::int32_t>(conflict->other)};
  }
  done_ &= ~(stop | start);
  ended_ &= ~(stop | start);
  set_active(after);
  if (!running) return {};
  for (std::size_t j = 0; j < capabilities_.size(); ++j) {
    if (is_claimed(j, stop | start)) transfer_.begin(j, state, command);
  }
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if ((stop & only(slot)) == 0) continue;
    enter(*table_[slot]).stop();
    for (const auto& claim : table_[slot]->claims) release(claim.joint, state, command);
  }
  const hal::StateImage& shown = at_rest(state, start);
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if ((start & only(slot)) == 0) continue;
    set_modes(*table_[slot], command);
    call_start(*table_[slot], time, shown, command);
  }
  leave_calls();
  return {};
}

bool ControllerHost::retreat(const hal::CycleTime& time, const hal::StateImage& state,
                             hal::CommandImage& command) noexcept TANDEM_RT {
  ControllerSet retreating = 0;
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if (!is_active(slot) || (done_ & only(slot)) != 0) continue;
    Controller& controller = enter(*table_[slot]);
    if (controller.can_retreat() && controller.retreat(time, state)) retreating |= only(slot);
  }
  leave_calls();
  if (retreating == 0) return false;
  (void)switch_over(active_ & ~retreating, 0, true, time, state, command);
  return true;
}

LoopAnswer ControllerHost::set_joint(std::size_t joint, const JointRequest& wish, bool running,
                                     const hal::StateImage& state,
                                     hal::CommandImage& command) noexcept TANDEM_RT {
  const auto number = static_cast<std::int32_t>(joint);
  const bool moves = wish.mode >= 0 || wish.interaction >= 0;
  const std::int32_t owned_by = owner(joint);
  const auto mode = static_cast<ControlMode>(wish.mode >= 0 ? wish.mode : command.mode()[joint]);
  const auto interaction = static_cast<InteractionMode>(
      wish.interaction >= 0 ? wish.interaction : command.interaction()[joint]);
  if (moves) {
    LoopAnswer refused{.joint = number, .one = owned_by};
    if (owned_by >= 0) {
      refused.reason = RejectReason::kClaimed;
    } else if (!running) {
      refused.reason = RejectReason::kNotRunning;
    } else if (!capabilities_[joint].can(mode, interaction)) {
      refused.reason = RejectReason::kIncapable;
    }
    if (refused.reason != RejectReason::kNone) return refused;
  }
  // What is not asked for stays: a controller may have written other values than ours.
  Impedance wanted{command.stiffness_Nm_rad()[joint], command.damping_Nms_rad()[joint]};
  if (std::isfinite(wish.stiffness_Nm_rad)) {
    wanted.stiffness_Nm_rad = impedance_[joint].stiffness_Nm_rad = wish.stiffness_Nm_rad;
  }
  if (std::isfinite(wish.damping_Nms_rad)) {
    wanted.damping_Nms_rad = impedance_[joint].damping_Nms_rad = wish.damping_Nms_rad;
  }
  const bool same = command.mode()[joint] == static_cast<std::int8_t>(mode) &&
                    command.interaction()[joint] == static_cast<std::uint8_t>(interaction);
  const bool yields = wanted.stiffness_Nm_rad != command.stiffness_Nm_rad()[joint] ||
                      wanted.damping_Nms_rad != command.damping_Nms_rad()[joint];
  if (!running || (same && !yields)) return {.joint = number, .one = owned_by};
  transfer_.begin(joint, state, command);
  if (same) {
    command.stiffness_Nm_rad()[joint] = wanted.stiffness_Nm_rad;
    command.damping_Nms_rad()[joint] = wanted.damping_Nms_rad;
  } else {
    assign(joint, mode, interaction, state, command);
  }
  return {.joint = number, .one = owned_by};
}

LoopAnswer ControllerHost::move(std::size_t joint, const MoveRequest& wish,
                                const hal::StateImage& state,
                                hal::CommandImage& command) noexcept TANDEM_RT {
  LoopAnswer answer{.joint = static_cast<std::int32_t>(joint), .one = owner_[joint]};
  hal::PositionControl& motions = operator_.position;
  const hal::JointCapabilities& limit = capabilities_[joint];
  operator_.begin(state, command);
  if (owner_[joint] >= 0) {
    answer.reason = RejectReason::kClaimed;
  } else if (command.mode()[joint] != kPositionMode) {
    answer.reason = RejectReason::kOtherMode;
  } else if (!std::isfinite(wish.target_rad)) {
    recovers_[joint] = 0;
    (void)motions.stop(joint);
  } else if (recovers_[joint] != 0) {
    answer.reason = RejectReason::kRecovering;
  } else if (!hal::reaches(limit, command.position_rad()[joint])) {
    answer.reason = RejectReason::kOutside;  // the limits would slow it down, and then let it rush
  } else {
    const double most = limit.max_velocity_rad_s;
    const double speed = std::isfinite(wish.speed_rad_s) ? wish.speed_rad_s : most / 4.0;
    const double acceleration = std::isfinite(wish.acceleration_rad_s2)
                                    ? wish.acceleration_rad_s2
                                    : std::min(speed / 0.5, limit.max_acceleration_rad_s2);
    // From what is commanded now, a transfer's offset included.
    if (motions.check_motion_done(joint)) {
      transfer_.begin(joint, state, command);
      settle(joint, state, command);
    }
    const bool begun = motions.set_ref_speed(joint, speed) == Code::kOk &&
                       motions.set_ref_acceleration(joint, acceleration) == Code::kOk &&
                       motions.position_move(joint, wish.target_rad) == Code::kOk;
    if (!begun) answer.reason = RejectReason::kBeyond;
  }
  return answer;
}

void ControllerHost::move_on(const hal::StateImage& state,
                             hal::CommandImage& command) noexcept TANDEM_RT {
  operator_.begin(state, command);
  operator_.position.advance();
}

LoopAnswer ControllerHost::recover(std::size_t joint,
                                   const hal::CommandImage& command) noexcept TANDEM_RT {
  const auto index = static_cast<std::int32_t>(joint);
  if (owner_[joint] >= 0) {
    return {.reason = RejectReason::kClaimed, .joint = index, .one = owner_[joint]};
  }
  const bool within = hal::reaches(capabilities_[joint], command.position_rad()[joint]);
  if (command.mode()[joint] != kPositionMode)
    return {.reason = RejectReason::kOtherMode, .joint = index};
  if (within || recovers_[joint] != 0) return {.reason = RejectReason::kWithin, .joint = index};
  recovers_[joint] = 1;
  return {};
}

LoopAnswer ControllerHost::may_start(ControllerSet start) const noexcept TANDEM_RT {
  for (std::size_t slot = 0; slot < table_.size(); ++slot) {
    if ((start & only(slot)) == 0 || table_[slot] == nullptr) continue;
    for (const auto& claim : table_[slot]->claims) {
      if (recovers_[claim.joint] == 0) continue;
      return {.reason = RejectReason::kRecovering,
              .joint = static_cast<std::int32_t>(claim.joint),
              .one = static_cast<std::int32_t>(slot)};
    }
  }
  return {};
}

void ControllerHost::lead_back(hal::CommandImage& command) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < recovers_.size(); ++j) {
    if (recovers_[j] == 0) continue;
    const hal::JointCapabilities& limit = capabilities_[j];
    double& reference = command.position_rad()[j];
    const double wanted = std::clamp(reference, limit.min_position_rad, limit.max_position_rad);
    if (wanted == reference) recovers_[j] = 0;  // it has arrived
    reference = wanted;
  }
}

}  // namespace tandem::runtime
