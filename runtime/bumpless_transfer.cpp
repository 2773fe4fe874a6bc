#include "runtime/bumpless_transfer.hpp"

#include <algorithm>

#include "controllers/min_jerk.hpp"

namespace tandem::runtime {
namespace {

using hal::ControlMode;

enum Reference : std::size_t { kPosition, kVelocity, kTorque, kStiffness, kDamping };

bool is(std::int8_t mode, ControlMode wanted) noexcept TANDEM_RT {
  return mode == static_cast<std::int8_t>(wanted);
}

bool follows_a_motion(std::int8_t mode) noexcept TANDEM_RT {
  return is(mode, ControlMode::kPosition) || is(mode, ControlMode::kVelocity);
}

}  // namespace

BumplessTransfer::BumplessTransfer(std::size_t joints, std::int64_t period_ns)
    : cycles_(std::max<std::int64_t>(1, kTime_ns / period_ns)), joints_(joints) {}

BumplessTransfer::References BumplessTransfer::read(const hal::CommandImage& command,
                                                    std::size_t joint) noexcept TANDEM_RT {
  return {command.position_rad()[joint], command.velocity_rad_s()[joint],
          command.torque_Nm()[joint], command.stiffness_Nm_rad()[joint],
          command.damping_Nms_rad()[joint]};
}

void BumplessTransfer::write(hal::CommandImage& command, std::size_t joint,
                             const References& values) noexcept TANDEM_RT {
  command.position_rad()[joint] = values[kPosition];
  command.velocity_rad_s()[joint] = values[kVelocity];
  command.torque_Nm()[joint] = values[kTorque];
  command.stiffness_Nm_rad()[joint] = values[kStiffness];
  command.damping_Nms_rad()[joint] = values[kDamping];
}

void BumplessTransfer::begin(std::size_t joint, const hal::StateImage& state,
                             hal::CommandImage& command) noexcept TANDEM_RT {
  Joint& of = joints_[joint];
  of.offset = read(command, joint);
  if (of.left == 0) ++going_;
  if (of.left > 0 && of.known != 0) write(command, joint, of.written);
  of.left = cycles_ + 1;  // the last one with nothing left
  of.mode = command.mode()[joint];
  of.interaction = command.interaction()[joint];
  of.known = 0;
  of.enabled =
      state.drive_state()[joint] == static_cast<std::uint8_t>(hal::DriveState::kOperationEnabled)
          ? 1
          : 0;
}

BumplessTransfer::Impedance BumplessTransfer::written(
    std::size_t joint, const hal::CommandImage& command) const noexcept TANDEM_RT {
  const Joint& of = joints_[joint];
  if (of.left > 0 && of.known != 0) return {of.written[kStiffness], of.written[kDamping]};
  return {command.stiffness_Nm_rad()[joint], command.damping_Nms_rad()[joint]};
}

void BumplessTransfer::before_update(hal::CommandImage& command) const noexcept TANDEM_RT {
  if (going_ == 0) return;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    if (joints_[j].left > 0 && joints_[j].known != 0) write(command, j, joints_[j].written);
  }
}

void BumplessTransfer::find_offset(Joint& joint, std::size_t index, const hal::StateImage& state,
                                   const hal::CommandImage& command) const noexcept TANDEM_RT {
  const std::int8_t mode = command.mode()[index];
  const References last = joint.offset;
  joint.offset = {};
  joint.known = 1;
  if (joint.enabled == 0 || is(joint.mode, ControlMode::kIdle)) return;
  if (mode == joint.mode && command.interaction()[index] == joint.interaction) {
    for (std::size_t i = 0; i < kReferences; ++i) joint.offset[i] = last[i] - joint.written[i];
    return;
  }
  joint.offset[kTorque] = state.torque_Nm()[index] - joint.written[kTorque];
  if (follows_a_motion(mode)) {
    joint.offset[kVelocity] = state.velocity_rad_s()[index] - joint.written[kVelocity];
  }
}

void BumplessTransfer::after_update(const hal::StateImage& state,
                                    hal::CommandImage& command) noexcept TANDEM_RT {
  if (going_ == 0) return;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Joint& joint = joints_[j];
    if (joint.left == 0) continue;
    joint.written = read(command, j);
    if (joint.known == 0) find_offset(joint, j, state, command);
    const double past =
        static_cast<double>(cycles_ + 1 - joint.left) / static_cast<double>(cycles_);
    const double share = 1.0 - min_jerk(past).s;
    References sum = joint.written;
    for (std::size_t i = 0; i < kReferences; ++i) sum[i] += share * joint.offset[i];
    write(command, j, sum);
    if (--joint.left == 0) --going_;
  }
}

void BumplessTransfer::clear() noexcept TANDEM_RT {
  for (Joint& joint : joints_) joint.left = 0;
  going_ = 0;
}

}  // namespace tandem::runtime
