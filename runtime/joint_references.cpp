#include "runtime/joint_references.hpp"

#include <algorithm>
#include <cmath>

#include "hal/motion_limits.hpp"

namespace tandem::runtime {

using hal::ControlMode;
using hal::InteractionMode;

namespace {

constexpr auto kPositionMode = static_cast<std::int8_t>(ControlMode::kPosition);
constexpr auto kIdleMode = static_cast<std::int8_t>(ControlMode::kIdle);
constexpr auto kStiffMode = static_cast<std::uint8_t>(InteractionMode::kStiff);

bool is_enabled(const hal::StateImage& state, std::size_t joint) noexcept TANDEM_RT {
  return state.drive_state()[joint] ==
         static_cast<std::uint8_t>(hal::DriveState::kOperationEnabled);
}

}  // namespace

JointReferences::JointReferences(const hal::Robot& robot,
                                 std::span<const hal::JointCapabilities> joints,
                                 hal::ParameterImage& gains, std::int64_t period_ns)
    : capabilities_(joints),
      recovers_(joints.size()),
      operator_(robot, gains, period_ns),
      transfer_(joints, period_ns) {
  for (const hal::JointCapabilities& joint : capabilities_) {
    impedance_.push_back({joint.stiffness_Nm_rad, joint.damping_Nms_rad});
  }
}

// Every joint.

void JointReferences::hold(JointImages images) noexcept TANDEM_RT {
  before_update(images.command);
  for (std::size_t j = 0; j < capabilities_.size(); ++j) stay(j, images);
  move_on(images);
  lead_back(images.command);
  transfer_.after_update(images.state, images.command);
}

void JointReferences::brake(JointImages images) noexcept TANDEM_RT {
  operator_.position.abandon();
  std::ranges::fill(recovers_, std::uint8_t{0});
  transfer_.clear();
  for (std::size_t j = 0; j < capabilities_.size(); ++j) {
    transfer_.begin(j, images.state, images.command, BumplessTransfer::Pace::kHard);
    release(j, images);
  }
}

void JointReferences::release(hal::CommandImage& command) noexcept TANDEM_RT {
  idle(command);
  transfer_.clear();
}

void JointReferences::idle(hal::CommandImage& command) noexcept TANDEM_RT {
  std::ranges::fill(command.mode(), kIdleMode);
  std::ranges::fill(recovers_, std::uint8_t{0});
  operator_.position.abandon();
}

void JointReferences::start(std::span<const std::int32_t> owner,
                            JointImages images) noexcept TANDEM_RT {
  hal::CommandImage& command = images.command;
  transfer_.clear();
  for (std::size_t j = 0; j < capabilities_.size(); ++j) {
    if (command.interaction()[j] != 0 || command.mode()[j] != kPositionMode) continue;
    if (owner[j] >= 0) {  // an impedance that nobody felt is no step
      command.stiffness_Nm_rad()[j] = impedance_[j].stiffness_Nm_rad;
      command.damping_Nms_rad()[j] = impedance_[j].damping_Nms_rad;
    }
    transfer_.begin_from(j, images.state, command);
  }
  idle(command);  // so that every joint stays at its measured position
  for (std::size_t j = 0; j < capabilities_.size(); ++j) {
    stay(j, images);
    settle(j, images);
  }
}

void JointReferences::before_update(hal::CommandImage& command) noexcept TANDEM_RT {
  transfer_.watch(command);
  transfer_.before_update(command);
}

void JointReferences::after_update(JointImages images) noexcept TANDEM_RT {
  move_on(images);
  transfer_.after_update(images.state, images.command);
}

void JointReferences::move_on(JointImages images) noexcept TANDEM_RT {
  operator_.begin(images.state, images.command);
  operator_.position.advance();
}

void JointReferences::lead_back(hal::CommandImage& command) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < recovers_.size(); ++j) {
    if (recovers_[j] == 0) continue;
    const hal::JointCapabilities& limit = capabilities_[j];
    double& reference = command.position_rad()[j];
    const double wanted = std::clamp(reference, limit.min_position_rad, limit.max_position_rad);
    if (wanted == reference) recovers_[j] = 0;  // it has arrived
    reference = wanted;
  }
}

// One joint.

void JointReferences::hold(std::size_t joint, JointImages images) noexcept TANDEM_RT {
  abandon(joint);
  stay(joint, images);
}

void JointReferences::abandon(std::size_t joint) noexcept TANDEM_RT {
  operator_.position.abandon(joint);
  recovers_[joint] = 0;
}

void JointReferences::stay(std::size_t joint, JointImages images) const noexcept TANDEM_RT {
  auto& [state, command] = images;
  if (!capabilities_[joint].can(hal::Capability::kPosition)) {
    command.mode()[joint] = kIdleMode;
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
void JointReferences::settle(std::size_t joint, JointImages images) const noexcept TANDEM_RT {
  auto& [state, command] = images;
  const BumplessTransfer::Brake brake =
      transfer_.brake(joint, state, static_cast<ControlMode>(command.mode()[joint]),
                      static_cast<InteractionMode>(command.interaction()[joint]));
  if (brake.way_rad == 0.0) return;
  command.position_rad()[joint] = brake.from_rad + brake.way_rad;
  command.velocity_rad_s()[joint] = 0.0;
}

void JointReferences::end(std::size_t joint, JointImages images) noexcept TANDEM_RT {
  if (images.command.mode()[joint] != kPositionMode) return;
  transfer_.begin(joint, images.state, images.command);
  settle(joint, images);
  images.command.velocity_rad_s()[joint] = 0.0;
}

void JointReferences::release(std::size_t joint, JointImages images) const noexcept TANDEM_RT {
  auto& [state, command] = images;
  const bool keeps = command.mode()[joint] == kPositionMode &&
                     command.interaction()[joint] == kStiffMode && is_enabled(state, joint);
  if (keeps) {
    command.velocity_rad_s()[joint] = 0.0;
    settle(joint, images);
    return;
  }
  const bool can = capabilities_[joint].can(hal::Capability::kPosition);
  assign(joint, can ? ControlMode::kPosition : ControlMode::kIdle, InteractionMode::kStiff, images);
}

/// Every reference at what is measured, or where the joint comes to rest. The torque is that of the
/// spring now: what carries the load goes on to carry it, as reference or as feed-forward.
void JointReferences::assign(std::size_t joint, ControlMode mode, InteractionMode interaction,
                             JointImages images) const noexcept TANDEM_RT {
  auto& [state, command] = images;
  const bool carries =
      is_enabled(state, joint) && mode != ControlMode::kIdle && command.mode()[joint] != kIdleMode;
  command.mode()[joint] = static_cast<std::int8_t>(mode);
  command.interaction()[joint] = static_cast<std::uint8_t>(interaction);
  command.position_rad()[joint] = state.position_rad()[joint];
  command.velocity_rad_s()[joint] = 0.0;
  command.torque_Nm()[joint] = carries ? state.torque_Nm()[joint] : 0.0;
  command.voltage_V()[joint] = mode == ControlMode::kOpenLoop ? state.voltage_V()[joint] : 0.0;
  command.current_A()[joint] = mode == ControlMode::kCurrent ? state.current_A()[joint] : 0.0;
  command.stiffness_Nm_rad()[joint] = impedance_[joint].stiffness_Nm_rad;
  command.damping_Nms_rad()[joint] = impedance_[joint].damping_Nms_rad;
  settle(joint, images);
}

double JointReferences::way_rad(const Claim& claim,
                                const hal::StateImage& state) const noexcept TANDEM_RT {
  return transfer_.brake(claim.joint, state, claim.mode, claim.interaction).way_rad;
}

void JointReferences::take_up(const Claim& claim,
                              hal::CommandImage& command) const noexcept TANDEM_RT {
  command.mode()[claim.joint] = static_cast<std::int8_t>(claim.mode);
  command.interaction()[claim.joint] = static_cast<std::uint8_t>(claim.interaction);
  command.stiffness_Nm_rad()[claim.joint] = impedance_[claim.joint].stiffness_Nm_rad;
  command.damping_Nms_rad()[claim.joint] = impedance_[claim.joint].damping_Nms_rad;
  command.velocity_rad_s()[claim.joint] = 0.0;  // an operator's, which nobody may write any more
}

// For an operator.

RejectReason JointReferences::set(std::size_t joint, const JointRequest& wish, bool writes,
                                  JointImages images) noexcept TANDEM_RT {
  auto& [state, command] = images;
  const auto mode = static_cast<ControlMode>(wish.mode >= 0 ? wish.mode : command.mode()[joint]);
  const auto interaction = static_cast<InteractionMode>(
      wish.interaction >= 0 ? wish.interaction : command.interaction()[joint]);
  if (wish.switches() && !capabilities_[joint].can(mode, interaction)) {
    return RejectReason::kIncapable;
  }
  // What is not asked for stays: a controller may have written other values than ours.
  BumplessTransfer::Impedance wanted{command.stiffness_Nm_rad()[joint],
                                     command.damping_Nms_rad()[joint]};
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
  if (!writes || (same && !yields)) return RejectReason::kNone;
  transfer_.begin(joint, state, command);
  if (same) {
    command.stiffness_Nm_rad()[joint] = wanted.stiffness_Nm_rad;
    command.damping_Nms_rad()[joint] = wanted.damping_Nms_rad;
  } else {
    assign(joint, mode, interaction, images);
  }
  return RejectReason::kNone;
}

RejectReason JointReferences::move(std::size_t joint, const MoveRequest& wish,
                                   JointImages images) noexcept TANDEM_RT {
  auto& [state, command] = images;
  hal::PositionControl& motions = operator_.position;
  const hal::JointCapabilities& limit = capabilities_[joint];
  operator_.begin(state, command);
  if (command.mode()[joint] != kPositionMode) return RejectReason::kOtherMode;
  if (!std::isfinite(wish.target_rad)) {
    recovers_[joint] = 0;
    (void)motions.stop(joint);
    return RejectReason::kNone;
  }
  if (recovers(joint)) return RejectReason::kRecovering;
  // The limits would slow it down, and then let it rush.
  if (!hal::reaches(limit, command.position_rad()[joint])) return RejectReason::kOutside;
  const double most = limit.max_velocity_rad_s;
  const double speed = std::isfinite(wish.speed_rad_s) ? wish.speed_rad_s : most / 4.0;
  const double acceleration = std::isfinite(wish.acceleration_rad_s2)
                                  ? wish.acceleration_rad_s2
                                  : std::min(speed / 0.5, limit.max_acceleration_rad_s2);
  // From what is commanded now, a transfer's offset included.
  if (motions.check_motion_done(joint)) {
    transfer_.begin(joint, state, command);
    settle(joint, images);
  }
  const bool begun = motions.set_ref_speed(joint, speed) == Code::kOk &&
                     motions.set_ref_acceleration(joint, acceleration) == Code::kOk &&
                     motions.position_move(joint, wish.target_rad) == Code::kOk;
  return begun ? RejectReason::kNone : RejectReason::kBeyond;
}

RejectReason JointReferences::recover(std::size_t joint,
                                      const hal::CommandImage& command) noexcept TANDEM_RT {
  if (command.mode()[joint] != kPositionMode) return RejectReason::kOtherMode;
  const bool within = hal::reaches(capabilities_[joint], command.position_rad()[joint]);
  if (within || recovers(joint)) return RejectReason::kWithin;
  recovers_[joint] = 1;
  return RejectReason::kNone;
}

}  // namespace tandem::runtime
