// Asking the loop for joints: what they are, what can be set of them, and how far they go.
#include <fmt/core.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <thread>
#include <utility>

#include "hal/motion_limits.hpp"
#include "runtime/run_services.hpp"

namespace tandem::runtime {
namespace {

hal::Capability needed_by(hal::PidLoop loop) {
  switch (loop) {
    case hal::PidLoop::kPosition: return hal::Capability::kPosition;
    case hal::PidLoop::kVelocity: return hal::Capability::kVelocity;
    case hal::PidLoop::kTorque: return hal::Capability::kTorque;
    case hal::PidLoop::kCurrent: break;
  }
  return hal::Capability::kCurrent;
}

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

/// "0.5 rad/s (28.65 deg/s)", "0.02 m/s" with `per` "/s".
std::string quantity(double value, bool slides, const char* per) {
  if (slides) return fmt::format("{:g} m{}", value, per);
  return fmt::format("{0:g} rad{2} ({1:.4g} deg{2})", value, value * kDegPerRad, per);
}

/// @param unit  empty, or " Nm/rad": behind each number
Status check_range(const std::string& joint, const char* what, double value, double max,
                   const char* unit = "") {
  if (value >= 0.0 && value <= max) return {};
  return fail_at(joint, fmt::format("{} {:g}{} is beyond the joint's limit", what, value, unit),
                 fmt::format("give 0 to {:g}{}", max, unit));
}

/// Checks what is asked for: NaN stays as it is.
Status check_impedance(const std::string& joint, const JointRequest& wish,
                       const hal::JointCapabilities& limit) {
  const double stiffness = wish.stiffness_Nm_rad, damping = wish.damping_Nms_rad;
  if (std::isnan(stiffness) && std::isnan(damping)) return {};
  if (!limit.can(hal::Capability::kCompliant)) {
    return fail_at(joint, "this joint cannot be compliant", "it has no torque control");
  }
  if (!std::isnan(stiffness)) {
    const Status fits = check_range(joint, "the stiffness", stiffness, limit.max_stiffness_Nm_rad,
                                    limit.slides ? " N/m" : " Nm/rad");
    if (!fits) return fits;
  }
  if (std::isnan(damping)) return {};
  return check_range(joint, "the damping", damping, limit.max_damping_Nms_rad,
                     limit.slides ? " Ns/m" : " Nms/rad");
}

Status check_target(const std::string& joint, double target, const hal::JointCapabilities& limit) {
  if (std::isnan(target) || hal::reaches(limit, target)) return {};
  const double min = limit.min_position_rad, max = limit.max_position_rad;
  return fail_at(
      joint,
      fmt::format("the target {} is beyond the joint's limits", quantity(target, limit.slides, "")),
      limit.slides ? fmt::format("give {:g} to {:g} m", min, max)
                   : fmt::format("give {:g} to {:g} rad, which is {:.4g} to {:.4g} deg", min, max,
                                 min * kDegPerRad, max * kDegPerRad));
}

/// Checks a speed or an acceleration, which is above 0. @param value  NaN: not given
Status check_rate_of_motion(const std::string& joint, const char* what, double value, double max,
                            bool slides, const char* per) {
  if (std::isnan(value) || hal::is_rate_within(value, max)) return {};
  std::string hint = "give more than 0";
  if (std::isfinite(max)) hint += ", at most " + quantity(max, slides, per);
  return fail_at(
      joint,
      fmt::format("the {} {} is beyond the joint's limit", what, quantity(value, slides, per)),
      hint);
}

Status check_move(const std::string& joint, const MoveRequest& wish,
                  const hal::JointCapabilities& limit) {
  if (Status fits = check_target(joint, wish.target_rad, limit); !fits) return fits;
  const Status fits = check_rate_of_motion(joint, "speed", wish.speed_rad_s,
                                           limit.max_velocity_rad_s, limit.slides, "/s");
  if (!fits) return fits;
  return check_rate_of_motion(joint, "acceleration", wish.acceleration_rad_s2,
                              limit.max_acceleration_rad_s2, limit.slides, "/s2");
}

}  // namespace

Result<std::size_t> RunServices::joint_of(const std::string& name) const {
  const int index = robot_->joint_index(name);
  if (index >= 0) return static_cast<std::size_t>(index);
  return std::unexpected(robot_->no_joint(name));
}

/// The joint's index, when the run can still be asked for something.
Result<std::size_t> RunServices::joint_to_change(const std::string& name) {
  collect();
  if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
  return joint_of(name);
}

std::vector<JointStatus> RunServices::looks() const {
  std::vector<JointStatus> looks(robot_->joints.size());
  while (!looks_.read(looks)) std::this_thread::yield();
  return looks;
}

std::vector<JointInfo> RunServices::joints() {
  const Lock lock(mutex_);
  collect();
  const std::vector<JointStatus> now = looks();
  std::vector<hal::PidGains> gains(gain_looks_.size());
  while (!gain_looks_.read(gains)) std::this_thread::yield();
  std::vector<JointInfo> all;
  for (std::size_t j = 0; j < now.size(); ++j) {
    JointInfo& joint = all.emplace_back();
    joint.name = robot_->joints[j].name;
    joint.owner = controller_name(now[j].owner);
    joint.slides = robot_->joints[j].slides;
    joint.look = now[j];
    for (std::size_t loop = 0; loop < hal::kPidLoops; ++loop)
      joint.gains[loop] = gains[j * hal::kPidLoops + loop];
  }
  return all;
}

std::vector<SensorReport> RunServices::sensors() const {
  std::vector<SensorStatus> now(robot_->sensors.size());
  while (!sensor_looks_.read(now)) std::this_thread::yield();
  std::vector<SensorReport> all;
  for (std::size_t s = 0; s < now.size(); ++s) {
    const hal::SensorConfig& sensor = robot_->sensors[s];
    all.push_back({sensor.name, sensor.type, sensor.joint, sensor.link, now[s]});
  }
  return all;
}

/// Whether the loop would put the joint into the mode. The loop looks again.
Status RunServices::check_mode(std::size_t joint, const JointRequest& wish,
                               const JointStatus& now) const {
  if (asks_ahead_ && wish.mode < 0) return {};  // nobody knows which it will have
  const auto mode = static_cast<hal::ControlMode>(wish.mode >= 0 ? wish.mode : now.mode);
  const auto interaction =
      static_cast<hal::InteractionMode>(wish.interaction >= 0 ? wish.interaction : now.interaction);
  if (Status able = hal::check_capability(*robot_, joint, mode, interaction); !able) return able;
  if (Status free = check_unclaimed(joint); !free) return free;
  if (asks_ahead_ || progress_->phase.load() == RunPhase::kRunning) return {};
  return std::unexpected(
      refusal({.reason = RejectReason::kNotRunning, .joint = static_cast<std::int32_t>(joint)}));
}

/// As check_unclaimed(), in the phase in which controllers have joints.
Status RunServices::check_free_to_move(std::size_t joint) const {
  return progress_->phase.load() == RunPhase::kRunning ? check_unclaimed(joint) : Status();
}

/// Whether no controller has the joint. The loop looks again: late, when its time stands.
Status RunServices::check_unclaimed(std::size_t joint) const {
  const ControllerSet active = planned();
  for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
    const auto& one = host_->owned()[slot];
    if ((active & only(slot)) == 0 || one == nullptr || one->claimed[joint] == 0) continue;
    return std::unexpected(refusal({.reason = RejectReason::kClaimed,
                                    .joint = static_cast<std::int32_t>(joint),
                                    .one = static_cast<std::int32_t>(slot)}));
  }
  return {};
}

Result<RequestResult> RunServices::set_joint(const std::string& joint, const JointRequest& wish,
                                             Patience patience) {
  Lock lock(mutex_);
  const Result<std::size_t> index = joint_to_change(joint);
  if (!index) return std::unexpected(index.error());
  const JointStatus now = looks()[*index];
  if (wish.mode >= 0 || wish.interaction >= 0) {
    if (Status free = check_mode(*index, wish, now); !free) return std::unexpected(free.error());
  }
  if (Status fits = check_impedance(joint, wish, host_->capabilities()[*index]); !fits) {
    return std::unexpected(fits.error());
  }
  return ask(lock,
             {.kind = CycleRequest::Kind::kJoint,
              .joint = static_cast<std::uint32_t>(*index),
              .wish = wish},
             patience);
}

Result<RequestResult> RunServices::ask_of_joint(CycleRequest::Kind kind, const std::string& joint,
                                                Patience patience) {
  Lock lock(mutex_);
  const Result<std::size_t> index = joint_to_change(joint);
  if (!index) return std::unexpected(index.error());
  const hal::JointConfig& config = robot_->joints[*index];
  if (kind == CycleRequest::Kind::kHome && !config.homing) {
    return std::unexpected(Error{.message = "has no homing: its encoder is taken for absolute",
                                 .hint = "give its [[joint]] the key `homing`",
                                 .file = robot_->file,
                                 .line = config.line,
                                 .key = joint});
  }
  if (kind != CycleRequest::Kind::kReset) {
    if (Status free = check_free_to_move(*index); !free) return std::unexpected(free.error());
  }
  return ask(lock, {.kind = kind, .joint = static_cast<std::uint32_t>(*index)}, patience);
}

Result<RequestResult> RunServices::move_joint(const std::string& joint, const MoveRequest& wish,
                                              Patience patience) {
  Lock lock(mutex_);
  const Result<std::size_t> index = joint_to_change(joint);
  if (!index) return std::unexpected(index.error());
  if (Status fits = check_move(joint, wish, host_->capabilities()[*index]); !fits) {
    return std::unexpected(fits.error());
  }
  if (Status free = check_free_to_move(*index); !free) return std::unexpected(free.error());
  const JointStatus now = looks()[*index];
  const bool yields =
      now.interaction == static_cast<std::uint8_t>(hal::InteractionMode::kCompliant);
  if (yields && now.stiffness_Nm_rad == 0.0) {
    return fail_at(joint, "is compliant without stiffness: nothing would move it",
                   fmt::format("tandem joint set {} --stiffness, or --interaction stiff", joint));
  }
  return ask(lock,
             {.kind = CycleRequest::Kind::kMove,
              .joint = static_cast<std::uint32_t>(*index),
              .move = wish},
             patience);
}

Result<std::size_t> RunServices::gains_fit(const std::string& joint, hal::PidLoop loop,
                                           const GainsRequest& wish) {
  const Result<std::size_t> index = joint_to_change(joint);
  if (!index) return index;
  if (!host_->capabilities()[*index].can(needed_by(loop))) {
    return fail_at(joint, std::string("this joint has no ") + hal::to_string(loop) + " loop",
                   "give [gains." + robot_->joints[*index].gains + "] one");
  }
  const hal::PidGains& most =
      host_->capabilities()[*index].most_gains[static_cast<std::size_t>(loop)];
  for (const auto& [what, value, limit] :
       {std::tuple{"kp", wish.kp, most.kp}, {"ki", wish.ki, most.ki}, {"kd", wish.kd, most.kd}}) {
    const Status in_range = check_range(joint, what, value.value_or(0.0), limit);
    if (!in_range) return std::unexpected(in_range.error());
  }
  return index;
}

Status RunServices::check_gains(const std::string& joint, hal::PidLoop loop,
                                const GainsRequest& wish) {
  const Lock lock(mutex_);
  const Result<std::size_t> fits = gains_fit(joint, loop, wish);
  return fits ? Status() : std::unexpected(fits.error());
}

Result<RequestResult> RunServices::set_gains(const std::string& joint, hal::PidLoop loop,
                                             const GainsRequest& wish, Patience patience) {
  Lock lock(mutex_);
  const Result<std::size_t> index = gains_fit(joint, loop, wish);
  if (!index) return std::unexpected(index.error());
  constexpr double kStays = std::numeric_limits<double>::quiet_NaN();
  return ask(
      lock,
      {.kind = CycleRequest::Kind::kGains,
       .joint = static_cast<std::uint32_t>(*index),
       .loop = loop,
       .gains = {wish.kp.value_or(kStays), wish.ki.value_or(kStays), wish.kd.value_or(kStays)}},
      patience);
}

}  // namespace tandem::runtime
