// PositionControl and VelocityControl: the interfaces that make their own references.
#include <algorithm>

#include "base/archive.hpp"
#include "hal/joint_access.hpp"
#include "hal/joint_devices.hpp"
#include "hal/motion_limits.hpp"

namespace tandem::hal {
namespace {

Code checked_rate(double value, double most) noexcept TANDEM_RT {
  if (!std::isfinite(value)) return Code::kNotFinite;
  return is_rate_within(value, most) ? Code::kOk : Code::kOutOfRange;
}

double seconds(const JointAccess& io) noexcept { return static_cast<double>(io.period_ns) * 1e-9; }

double default_speed_rad_s(const JointCapabilities& joint) noexcept {
  return joint.max_velocity_rad_s / 4.0;
}
double default_acceleration_rad_s2(const JointCapabilities& joint) noexcept {
  return std::min(default_speed_rad_s(joint) / 0.5, joint.max_acceleration_rad_s2);
}
double most_acceleration_rad_s2(const JointAccess& io, std::size_t j) noexcept {
  return j < io.joints.size() ? io.joints[j].max_acceleration_rad_s2 : 0.0;
}

}  // namespace

PositionControl::PositionControl(JointAccess& access)
    : io_(access), motions_(access.joints.size()) {
  for (std::size_t j = 0; j < motions_.size(); ++j) {
    motions_[j].speed_rad_s = default_speed_rad_s(io_.joints[j]);
    motions_[j].acceleration_rad_s2 = default_acceleration_rad_s2(io_.joints[j]);
  }
}

Code PositionControl::position_move(std::size_t j, double target_rad) noexcept TANDEM_RT {
  if (j >= motions_.size() || !in_mode(io_, j, ControlMode::kPosition)) return Code::kOutOfRange;
  if (!std::isfinite(target_rad)) return Code::kNotFinite;
  if (!reaches(io_.joints[j], target_rad)) return Code::kOutOfRange;
  Motion& motion = motions_[j];
  if (motion.phase == kResting) {
    motion.reference = {io_.command->position_rad()[j], 0.0};
    motion.hardest_rad_s2 = 0.0;
  }
  motion.target_rad = target_rad;
  motion.phase = kMoving;
  return Code::kOk;
}

Code PositionControl::relative_move(std::size_t j, double way_rad) noexcept TANDEM_RT {
  if (j >= motions_.size()) return Code::kOutOfRange;
  return position_move(j, io_.command->position_rad()[j] + way_rad);
}

bool PositionControl::check_motion_done(std::size_t j) const noexcept TANDEM_RT {
  return j >= motions_.size() || motions_[j].phase == kResting;
}

bool PositionControl::check_motion_done() const noexcept TANDEM_RT {
  return std::all_of(motions_.begin(), motions_.end(),
                     [](const Motion& motion) { return motion.phase == kResting; });
}

Code PositionControl::set_ref_speed(std::size_t j, double rad_s) noexcept TANDEM_RT {
  const double max = j < motions_.size() ? io_.joints[j].max_velocity_rad_s : 0.0;
  const Code code = checked_rate(rad_s, max);
  if (code == Code::kOk) motions_[j].speed_rad_s = rad_s;
  return code;
}
double PositionControl::ref_speed_rad_s(std::size_t j) const noexcept TANDEM_RT {
  return j < motions_.size() ? motions_[j].speed_rad_s : at({}, j);
}

Code PositionControl::set_ref_acceleration(std::size_t j, double rad_s2) noexcept TANDEM_RT {
  const Code code = checked_rate(rad_s2, most_acceleration_rad_s2(io_, j));
  if (code == Code::kOk) motions_[j].acceleration_rad_s2 = rad_s2;
  return code;
}
double PositionControl::ref_acceleration_rad_s2(std::size_t j) const noexcept TANDEM_RT {
  return j < motions_.size() ? motions_[j].acceleration_rad_s2 : at({}, j);
}

Code PositionControl::stop(std::size_t j) noexcept TANDEM_RT {
  if (j >= motions_.size()) return Code::kOutOfRange;
  Motion& motion = motions_[j];
  if (motion.phase == kMoving) motion.phase = kBraking;
  motion.hardest_rad_s2 =
      std::max(motion.hardest_rad_s2, default_acceleration_rad_s2(io_.joints[j]));
  return Code::kOk;
}

void PositionControl::abandon() noexcept TANDEM_RT {
  for (std::size_t j = 0; j < motions_.size(); ++j) abandon(j);
}

void PositionControl::abandon(std::size_t j) noexcept TANDEM_RT {
  if (j < motions_.size()) motions_[j].phase = kResting;
}

double PositionControl::target_position_rad(std::size_t j) const noexcept TANDEM_RT {
  if (check_motion_done(j)) return at(std::as_const(*io_.command).position_rad(), j);
  return motions_[j].target_rad;
}

void PositionControl::advance() noexcept TANDEM_RT {
  const double dt = seconds(io_);
  for (std::size_t j = 0; j < motions_.size(); ++j) {
    Motion& motion = motions_[j];
    if (motion.phase == kResting) continue;
    if (!in_mode(io_, j, ControlMode::kPosition)) {  // another mode ends the motion
      motion.phase = kResting;
      continue;
    }
    motion.hardest_rad_s2 = std::max(motion.hardest_rad_s2, motion.acceleration_rad_s2);
    Trapezoid& reference = motion.reference;
    // What the limits hold back arrives later: it is led until then.
    const bool held_back = io_.command->position_rad()[j] != reference.position_rad;
    bool done = false;
    if (motion.phase == kMoving) {
      done = reference.step(motion.target_rad, motion.speed_rad_s, motion.hardest_rad_s2, dt);
    } else {
      reference.run(0.0, motion.hardest_rad_s2, dt);
      motion.target_rad = reference.position_rad;
      done = reference.velocity_rad_s == 0.0;
    }
    io_.command->position_rad()[j] = reference.position_rad;
    io_.command->velocity_rad_s()[j] = reference.velocity_rad_s;
    if (done && !held_back) motion.phase = kResting;
  }
}

void PositionControl::archive(Archive& ar) { ar(motions_); }

VelocityControl::VelocityControl(JointAccess& access) : io_(access), ramps_(access.joints.size()) {
  for (std::size_t j = 0; j < ramps_.size(); ++j) {
    const JointCapabilities& limit = io_.joints[j];
    ramps_[j].acceleration_rad_s2 =
        std::min(limit.max_velocity_rad_s / 2.0, limit.max_acceleration_rad_s2);
  }
}

Code VelocityControl::velocity_move(std::size_t j, double rad_s) noexcept TANDEM_RT {
  if (j >= ramps_.size() || !in_mode(io_, j, ControlMode::kVelocity)) return Code::kOutOfRange;
  const double max = io_.joints[j].max_velocity_rad_s;
  const Code code = checked(io_, j, rad_s, -max, max);
  if (code != Code::kOk) return code;
  ramps_[j].target_rad_s = rad_s;
  ramps_[j].asked = 1;
  return Code::kOk;
}
double VelocityControl::target_velocity_rad_s(std::size_t j) const noexcept TANDEM_RT {
  return j < ramps_.size() ? ramps_[j].target_rad_s : at({}, j);
}

Code VelocityControl::set_ref_acceleration(std::size_t j, double rad_s2) noexcept TANDEM_RT {
  const Code code = checked_rate(rad_s2, most_acceleration_rad_s2(io_, j));
  if (code == Code::kOk) ramps_[j].acceleration_rad_s2 = rad_s2;
  return code;
}
double VelocityControl::ref_acceleration_rad_s2(std::size_t j) const noexcept TANDEM_RT {
  return j < ramps_.size() ? ramps_[j].acceleration_rad_s2 : at({}, j);
}

void VelocityControl::advance() noexcept TANDEM_RT {
  const double dt = seconds(io_);
  for (std::size_t j = 0; j < ramps_.size(); ++j) {
    Ramp& ramp = ramps_[j];
    if (!in_mode(io_, j, ControlMode::kVelocity)) {  // another mode ends the motion
      ramp.target_rad_s = 0.0;
      ramp.asked = 0;
      continue;
    }
    if (ramp.asked == 0) continue;
    double& reference = io_.command->velocity_rad_s()[j];
    const double change = ramp.acceleration_rad_s2 * dt;
    reference = std::clamp(ramp.target_rad_s, reference - change, reference + change);
  }
}

void VelocityControl::archive(Archive& ar) { ar(ramps_); }

}  // namespace tandem::hal
