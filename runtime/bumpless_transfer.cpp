#include "runtime/bumpless_transfer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controllers/min_jerk.hpp"
#include "controllers/segment.hpp"

namespace tandem::runtime {
namespace {

using hal::ControlMode;
using hal::InteractionMode;

enum Reference : std::size_t { kPosition, kVelocity, kTorque, kStiffness, kDamping };

// The brake's velocity falls as 1 - 3 x^2 + 2 x^3 (quintic() from half of the way of its time): its
// largest acceleration and jerk, by the velocity and the time.
constexpr double kBrakeAcceleration = 1.5, kBrakeJerk = 6.0;
constexpr double kMinJerkAcceleration = 5.7735;  // by the way and the time's square

bool is(std::int8_t mode, ControlMode wanted) noexcept TANDEM_RT {
  return mode == static_cast<std::int8_t>(wanted);
}

bool in_operation(const hal::StateImage& state, std::size_t joint) noexcept TANDEM_RT {
  return state.drive_state()[joint] ==
         static_cast<std::uint8_t>(hal::DriveState::kOperationEnabled);
}

}  // namespace

BumplessTransfer::BumplessTransfer(std::span<const hal::JointCapabilities> joints,
                                   std::int64_t period_ns)
    : limits_(joints),
      period_s_(static_cast<double>(period_ns) * 1e-9),
      cycles_(std::max<std::int64_t>(1, kTime_ns / period_ns)),
      joints_(joints.size()),
      before_rad_(joints.size(), std::numeric_limits<double>::quiet_NaN()) {}

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

void BumplessTransfer::watch(const hal::CommandImage& command) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const bool begun = joints_[j].left > 0 && joints_[j].known == 0;
    before_rad_[j] = begun ? joints_[j].offset[kPosition] : command.position_rad()[j];
  }
}

void BumplessTransfer::begin(std::size_t joint, const hal::StateImage& state,
                             hal::CommandImage& command, Pace pace) noexcept TANDEM_RT {
  const double speed = (command.position_rad()[joint] - before_rad_[joint]) / period_s_;
  begin(joint, state, command, speed, pace);
}

void BumplessTransfer::begin_from(std::size_t joint, const hal::StateImage& state,
                                  hal::CommandImage& command) noexcept TANDEM_RT {
  begin(joint, state, command, command.velocity_rad_s()[joint], Pace::kEven);
}

void BumplessTransfer::begin(std::size_t joint, const hal::StateImage& state,
                             hal::CommandImage& command, double speed_rad_s,
                             Pace pace) noexcept TANDEM_RT {
  JointTransfer& of = joints_[joint];
  if (of.left > 0 && of.known == 0) {  // of this cycle: `command` is not the last one any more
    of.pace = std::max(of.pace, pace);
    return;
  }
  const double most = limits_[joint].max_velocity_rad_s;
  of.offset = read(command, joint);
  of.speed_rad_s = std::isfinite(speed_rad_s) ? std::clamp(speed_rad_s, -most, most) : 0.0;
  if (of.left == 0) ++going_;
  if (of.left > 0) write(command, joint, of.written);
  ++begun_;
  of.left = cycles_ + 1;  // the last one with nothing left
  of.mode = command.mode()[joint];
  of.interaction = command.interaction()[joint];
  of.known = 0;
  of.pace = pace;
  of.enabled = in_operation(state, joint) ? 1 : 0;
}

BumplessTransfer::Brake BumplessTransfer::brake(
    std::size_t joint, const hal::StateImage& state, ControlMode mode,
    InteractionMode interaction) const noexcept TANDEM_RT {
  const JointTransfer& of = joints_[joint];
  Brake brake{.from_rad = state.position_rad()[joint]};
  const bool moved =
      of.left > 0 && of.known == 0 && of.enabled != 0 && !is(of.mode, ControlMode::kIdle);
  if (!moved || mode != ControlMode::kPosition) return brake;
  if (is(of.mode, mode) && of.interaction == static_cast<std::uint8_t>(interaction)) {
    brake.from_rad = of.offset[kPosition];
    brake.speed_rad_s = of.speed_rad_s;
  } else {
    const double most = limits_[joint].max_velocity_rad_s;
    const double measured = std::clamp(state.velocity_rad_s()[joint], -most, most);
    if (std::abs(measured) > hal::kRestShare * most) brake.speed_rad_s = measured;
  }
  if (brake.speed_rad_s == 0.0) return brake;
  const hal::JointCapabilities& limit = limits_[joint];
  const double speed = brake.speed_rad_s;
  const double end = speed > 0.0 ? limit.max_position_rad : limit.min_position_rad;
  const double room = std::max(0.0, (end - brake.from_rad) * (speed > 0.0 ? 1.0 : -1.0));
  brake.cycles = brake_cycles(joint, speed, room, of.pace);
  const double way = speed * period_s_ * (1.0 + static_cast<double>(brake.cycles) / 2.0);
  brake.way_rad = std::clamp(way, -room, room);
  return brake;
}

std::int64_t BumplessTransfer::brake_cycles(std::size_t joint, double speed_rad_s, double room_rad,
                                            Pace pace) const noexcept TANDEM_RT {
  const hal::JointCapabilities& limit = limits_[joint];
  const double speed = std::abs(speed_rad_s);
  const bool hard = pace == Pace::kHard && std::isfinite(limit.max_acceleration_rad_s2);
  double time_s = hard ? 0.0 : kBrake_s;
  time_s = std::max(time_s, kBrakeAcceleration * speed / limit.max_acceleration_rad_s2);
  time_s = std::max(time_s, std::sqrt(kBrakeJerk * speed / limit.max_jerk_rad_s3));
  const double cycles = std::min(std::ceil(time_s / period_s_ - 1e-6),
                                 std::floor(2.0 * (room_rad / speed / period_s_ - 1.0)));
  return std::max<std::int64_t>(1, std::llround(cycles));
}

std::int64_t BumplessTransfer::fade_cycles(std::size_t joint,
                                           double way_rad) const noexcept TANDEM_RT {
  const hal::JointCapabilities& limit = limits_[joint];
  const double way = std::abs(way_rad);
  double time_s = std::sqrt(2.0 * kMinJerkAcceleration * way / limit.max_acceleration_rad_s2);
  if (limit.max_velocity_rad_s > 0.0) {
    time_s = std::max(time_s, 2.0 * kMinJerkPeak * way / limit.max_velocity_rad_s);
  }
  return std::max<std::int64_t>(cycles_, std::llround(std::min(time_s, kMost_s) / period_s_));
}

BumplessTransfer::Impedance BumplessTransfer::written(
    std::size_t joint, const hal::CommandImage& command) const noexcept TANDEM_RT {
  const JointTransfer& of = joints_[joint];
  if (of.left > 0 && of.known != 0) return {of.written[kStiffness], of.written[kDamping]};
  return {command.stiffness_Nm_rad()[joint], command.damping_Nms_rad()[joint]};
}

void BumplessTransfer::before_update(hal::CommandImage& command) const noexcept TANDEM_RT {
  if (going_ == 0) return;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    if (joints_[j].left == 0 || joints_[j].known == 0) continue;
    References last = joints_[j].written;
    const auto mode = static_cast<ControlMode>(command.mode()[j]);
    if (mode != ControlMode::kPosition) last[kPosition] = command.position_rad()[j];
    write(command, j, last);
  }
}

void BumplessTransfer::find_offset(std::size_t index, const hal::StateImage& state,
                                   const hal::CommandImage& command) noexcept TANDEM_RT {
  JointTransfer& joint = joints_[index];
  const auto mode = static_cast<ControlMode>(command.mode()[index]);
  const auto interaction = static_cast<InteractionMode>(command.interaction()[index]);
  const Brake from = brake(index, state, mode, interaction);
  const References last = joint.offset;
  const bool same =
      is(joint.mode, mode) && joint.interaction == static_cast<std::uint8_t>(interaction);
  const bool none = joint.enabled == 0 || is(joint.mode, ControlMode::kIdle);
  --begun_;
  joint.offset = {};
  joint.speed_rad_s = 0.0;
  joint.since = 0;
  joint.known = 2;
  joint.brake_cycles = 0;
  joint.fade_cycles = cycles_;
  joint.mode = command.mode()[index];
  joint.interaction = command.interaction()[index];
  if (none) return;
  if (same) {
    for (std::size_t i = kTorque; i < kReferences; ++i)
      joint.offset[i] = last[i] - joint.written[i];
  } else {
    joint.offset[kTorque] = state.torque_Nm()[index] - joint.written[kTorque];
  }
  if (mode == ControlMode::kPosition && (same || from.speed_rad_s != 0.0)) {
    const double goes_on_rad = from.from_rad + from.speed_rad_s * period_s_;
    if (!sets_out(index, goes_on_rad, from.speed_rad_s)) {
      lead_from(index, goes_on_rad, from.speed_rad_s, joint.written[kVelocity], from.cycles);
    }
    if (same) joint.offset[kVelocity] = last[kVelocity] - from.speed_rad_s;
  } else if (same) {
    joint.offset[kVelocity] = last[kVelocity] - joint.written[kVelocity];
  } else if (mode == ControlMode::kPosition || mode == ControlMode::kVelocity) {
    joint.offset[kVelocity] = state.velocity_rad_s()[index] - joint.written[kVelocity];
  }
}

/// Whether the owner's first reference is the first step of a motion from there, no harder than the
/// joint may: there is nothing to lead over, and an offset would make it harder.
bool BumplessTransfer::sets_out(std::size_t index, double from_rad,
                                double speed_rad_s) const noexcept TANDEM_RT {
  const References& written = joints_[index].written;
  const double change = std::abs(written[kVelocity] - speed_rad_s);
  return change > 0.0 &&
         change <= limits_[index].max_acceleration_rad_s2 * period_s_ * (1 + 1e-9) &&
         std::abs(written[kPosition] - from_rad) <= change * period_s_;
}

/// From a place and a speed in this cycle to the owner's reference, which moves at `owner_rad_s`.
void BumplessTransfer::lead_from(std::size_t index, double from_rad, double speed_rad_s,
                                 double owner_rad_s, std::int64_t cycles) noexcept TANDEM_RT {
  constexpr double kAnyRoom = std::numeric_limits<double>::infinity();
  JointTransfer& joint = joints_[index];
  const double speed = speed_rad_s - owner_rad_s;
  joint.since = 0;
  joint.known = 1;
  joint.speed_rad_s = speed;
  if (speed == 0.0) cycles = 0;
  if (speed != 0.0 && cycles == 0) cycles = brake_cycles(index, speed, kAnyRoom, joint.pace);
  joint.brake_cycles = cycles;
  const double brake_s = static_cast<double>(cycles) * period_s_;
  joint.offset[kPosition] = from_rad - joint.written[kPosition] + speed * brake_s / 2.0;
  joint.fade_cycles = fade_cycles(index, joint.offset[kPosition]);
  joint.left = std::max({cycles_, joint.brake_cycles, joint.fade_cycles}) + 1;
}

/// An owner may move its position reference and leave the velocity's alone: its second one tells.
void BumplessTransfer::notice_unwritten_speed(std::size_t index,
                                              const References& first) noexcept TANDEM_RT {
  JointTransfer& joint = joints_[index];
  joint.known = 2;
  const double most = limits_[index].max_velocity_rad_s;
  const double speed = (joint.written[kPosition] - first[kPosition]) / period_s_;
  const double unwritten = speed - first[kVelocity];
  // One that says its speeds may correct its place at first: that is no motion.
  const bool silent = first[kVelocity] == 0.0 && joint.written[kVelocity] == 0.0;
  if (!silent || !(std::abs(unwritten) > hal::kRestShare * most && std::abs(speed) <= most)) return;
  const double brake_s = static_cast<double>(joint.brake_cycles) * period_s_;
  const double was_rad =
      first[kPosition] + joint.offset[kPosition] - joint.speed_rad_s * brake_s / 2.0;
  const double was_rad_s = first[kVelocity] + joint.speed_rad_s;
  lead_from(index, was_rad + was_rad_s * period_s_, was_rad_s, speed, joint.brake_cycles);
  joint.known = 2;
  joint.offset[kVelocity] += unwritten;
}

BumplessTransfer::References BumplessTransfer::sum(
    const JointTransfer& joint) const noexcept TANDEM_RT {
  const auto cycles = static_cast<double>(joint.since);
  const MinJerk fade = min_jerk(cycles / static_cast<double>(joint.fade_cycles));
  const double share = 1.0 - fade.s;  // position and torque carry a load together
  const double fade_s = static_cast<double>(joint.fade_cycles) * period_s_;
  References sum = joint.written;
  const double impedance = 1.0 - min_jerk(cycles / static_cast<double>(cycles_)).s;
  for (std::size_t i = 0; i < kStiffness; ++i) sum[i] += share * joint.offset[i];
  for (std::size_t i = kStiffness; i < kReferences; ++i) sum[i] += impedance * joint.offset[i];
  sum[kVelocity] -= fade.ds / fade_s * joint.offset[kPosition];
  if (joint.speed_rad_s != 0.0 && joint.since < joint.brake_cycles) {
    const double brake_s = static_cast<double>(joint.brake_cycles) * period_s_;
    const TrajectoryPoint left =
        quintic({-joint.speed_rad_s * brake_s / 2.0, joint.speed_rad_s, 0.0}, {}, brake_s,
                cycles * period_s_);
    sum[kPosition] += left.position;
    sum[kVelocity] += left.velocity;
  }
  return sum;
}

void BumplessTransfer::after_update(const hal::StateImage& state,
                                    hal::CommandImage& command) noexcept TANDEM_RT {
  if (going_ == 0) return;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    JointTransfer& joint = joints_[j];
    if (joint.left == 0) continue;
    const References before = joint.written;
    joint.written = read(command, j);
    if (joint.known == 0) {
      find_offset(j, state, command);
    } else if (command.mode()[j] != joint.mode || !in_operation(state, j)) {
      joint.left = 1;  // its owner has changed its mode, or its drive does not follow any more
      joint.offset = {};
      joint.speed_rad_s = 0.0;
    } else if (joint.known == 1) {
      notice_unwritten_speed(j, before);
    }
    write(command, j, sum(joint));
    ++joint.since;
    if (--joint.left == 0) --going_;
  }
}

void BumplessTransfer::cancel(hal::CommandImage& command) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    if (joints_[j].left > 0 && joints_[j].known == 0) write(command, j, joints_[j].offset);
  }
  clear();
}

void BumplessTransfer::clear() noexcept TANDEM_RT {
  for (JointTransfer& joint : joints_) joint.left = 0;
  going_ = begun_ = 0;
}

}  // namespace tandem::runtime
