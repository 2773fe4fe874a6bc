#include "controllers/motion_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/bounds.hpp"
#include "controllers/min_jerk.hpp"

namespace tandem {
namespace {

constexpr std::size_t kMostNumbers = 200'000'000;  // 1.6 GB
constexpr double kRounding = 1e-9;                 // of a limit
constexpr double kSpeedOver_s = 0.01;              // of the recording: for the speed at both ends
constexpr double kRest = 0.01;                     // of a joint's speed, as recorded: it rests
constexpr double kApproachShare = 0.5;             // of a joint's speed

/// The slope of a track at sample `i`, by its neighbours.
double slope(const log::JointTrack& track, std::size_t i) {
  const std::size_t a = i == 0 ? 0 : i - 1;
  const std::size_t b = std::min(i + 1, track.time_ns.size() - 1);
  const double over_s = static_cast<double>(track.time_ns[b] - track.time_ns[a]) * 1e-9;
  return (track.position_rad[b] - track.position_rad[a]) / over_s;
}

double line(const std::vector<double>& values, std::size_t i, double share) {
  return share == 0.0 ? values[i] : values[i] + share * (values[i + 1] - values[i]);
}

/// Position and velocity of the cubic from sample `i` to the next, at `share` of the way.
TrajectoryPoint cubic(const log::JointTrack& track, std::size_t i, double share) {
  if (share == 0.0) return {track.position_rad[i], slope(track, i), 0.0};
  const double T = static_cast<double>(track.time_ns[i + 1] - track.time_ns[i]) * 1e-9;
  const double p = track.position_rad[i], way = track.position_rad[i + 1] - p;
  const double m0 = slope(track, i) * T, m1 = slope(track, i + 1) * T;
  const double x = share;
  const double b = 3.0 * way - 2.0 * m0 - m1, c = m0 + m1 - 2.0 * way;
  return {p + x * (m0 + x * (b + x * c)), (m0 + x * (2.0 * b + x * 3.0 * c)) / T, 0.0};
}

std::unexpected<Error> beyond(const hal::DrivenJoint& joint, const std::string& when,
                              const char* what, double value, double low, double high,
                              const char* unit, std::string hint) {
  char text[200];
  std::snprintf(text, sizeof text, " would %s %.6g %s %s, its limits are %.6g and %.6g", what,
                value, unit, when.c_str(), low, high);
  return fail("joint '" + joint.name + "'" + text, std::move(hint));
}

}  // namespace

Result<MotionPlan> MotionPlan::make(const log::JointMotion& motion, const hal::Robot& robot,
                                    const std::vector<std::size_t>& joints, std::int64_t period_ns,
                                    double speed) {
  MotionPlan plan;
  plan.joints_ = joints.size();
  plan.period_ns_ = period_ns;
  plan.period_s_ = static_cast<double>(period_ns) * 1e-9;
  plan.speed_ = speed;
  plan.run_up_ =
      static_cast<std::size_t>(std::max(1.0, std::round(log::kReplayRunUp_s / plan.period_s_)));
  const double takes_ns = static_cast<double>(motion.end_ns - motion.begin_ns) / speed;
  plan.recorded_ =
      static_cast<std::size_t>(std::floor(takes_ns / static_cast<double>(period_ns))) + 1;
  plan.cycles_ = plan.recorded_ + 2 * plan.run_up_;
  const bool torque = !motion.tracks.empty() && !motion.tracks.front().torque_Nm.empty();
  if (plan.recorded_ < 2) {
    return fail("the recording is shorter than a cycle of the run", "play more of it");
  }
  if (plan.cycles_ > kMostNumbers / (3 * std::max<std::size_t>(1, plan.joints_))) {
    return fail("the recording has " + std::to_string(plan.recorded_) +
                    " cycles of the run: too many for memory",
                "play it in parts: from_s and to_s");
  }
  const std::size_t samples = motion.tracks.empty() ? 0 : motion.tracks.front().time_ns.size();
  if (plan.recorded_ > samples * bounds::kReplayCycles.most) {
    return fail("the recording has " + std::to_string(samples) + " samples for " +
                    std::to_string(plan.recorded_) + " cycles of the run",
                "play a recording with more samples, or a shorter stretch: from_s and to_s");
  }
  const std::size_t numbers = plan.cycles_ * plan.joints_;
  plan.position_rad_.resize(numbers);
  plan.velocity_rad_s_.resize(numbers);
  if (torque) plan.torque_Nm_.resize(numbers);
  for (std::size_t k = 0; k < joints.size(); ++k) {
    plan.sample(motion.tracks[k], k, motion.begin_ns);
    plan.ramp(k, speed * kRest * robot.joints[joints[k]].max_velocity_rad_s);
    if (Status s = plan.check(motion, robot.joints[joints[k]], k); !s) {
      return std::unexpected(s.error());
    }
  }
  return plan;
}

void MotionPlan::sample(const log::JointTrack& track, std::size_t joint, std::int64_t begin_ns) {
  std::size_t i = 0;
  const std::size_t last = track.time_ns.size() - 1;
  for (std::size_t cycle = 0; cycle < recorded_; ++cycle) {
    const double since_ns = speed_ * static_cast<double>(cycle) * static_cast<double>(period_ns_);
    const std::int64_t t_ns = begin_ns + std::llround(since_ns);
    while (i < last && track.time_ns[i + 1] <= t_ns) ++i;
    double share = 0.0;  // before its first and after its last sample it stands there
    if (i < last && t_ns > track.time_ns[i]) {
      share = static_cast<double>(t_ns - track.time_ns[i]) /
              static_cast<double>(track.time_ns[i + 1] - track.time_ns[i]);
    }
    const TrajectoryPoint now = cubic(track, i, share);
    const std::size_t at = (run_up_ + cycle) * joints_ + joint;
    position_rad_[at] = now.position;
    velocity_rad_s_[at] =
        speed_ *
        (track.velocity_rad_s.empty() ? now.velocity : line(track.velocity_rad_s, i, share));
    if (has_torque()) torque_Nm_[at] = line(track.torque_Nm, i, share);
  }
}

void MotionPlan::ramp(std::size_t joint, double rest_rad_s) {
  const std::size_t first = run_up_, last = run_up_ + recorded_ - 1;
  const auto over = std::clamp<std::size_t>(
      static_cast<std::size_t>(std::ceil(kSpeedOver_s / (speed_ * period_s_))), 1, recorded_ - 1);
  const double over_s = static_cast<double>(over) * period_s_;
  const double ramp_s = static_cast<double>(run_up_) * period_s_;
  const auto moving = [&](double way) {  // what rests stays exactly where it is
    const double speed = way / over_s;
    return std::abs(speed) > rest_rad_s ? speed : 0.0;
  };
  const double from = position(joint, first), to = position(joint, last);
  const TrajectoryPoint begin{from, moving(position(joint, first + over) - from), 0.0};
  const TrajectoryPoint end{to, moving(to - position(joint, last - over)), 0.0};
  const TrajectoryPoint before{begin.position - 0.5 * ramp_s * begin.velocity, 0.0, 0.0};
  const TrajectoryPoint after{end.position + 0.5 * ramp_s * end.velocity, 0.0, 0.0};
  const auto put = [&](std::size_t cycle, const TrajectoryPoint& now, std::size_t torque_of) {
    position_rad_[cycle * joints_ + joint] = now.position;
    velocity_rad_s_[cycle * joints_ + joint] = now.velocity;
    if (has_torque()) torque_Nm_[cycle * joints_ + joint] = torque(joint, torque_of);
  };
  for (std::size_t k = 0; k < run_up_; ++k) {
    put(k, quintic(before, begin, ramp_s, static_cast<double>(k) * period_s_), first);
    const TrajectoryPoint down =
        quintic(end, after, ramp_s, static_cast<double>(k + 1) * period_s_);
    put(last + 1 + k, k + 1 == run_up_ ? after : down, last);
  }
}

std::string MotionPlan::when(const log::JointMotion& motion, std::size_t cycle) const {
  const double since_s = (static_cast<double>(cycle) - static_cast<double>(run_up_)) * period_s_;
  const double after_s = since_s - static_cast<double>(recorded_ - 1) * period_s_;
  char text[100];
  if (cycle < run_up_) {
    std::snprintf(text, sizeof text, "%.3f s before the recording, on the way to its first speed",
                  -since_s);
  } else if (cycle >= run_up_ + recorded_) {
    std::snprintf(text, sizeof text, "%.3f s after the recording, on the way to rest", after_s);
  } else {
    std::snprintf(text, sizeof text, "at %.3f s of the recording",
                  static_cast<double>(motion.begin_ns) * 1e-9 + since_s * speed_);
  }
  return text;
}

Status MotionPlan::check(const log::JointMotion& motion, const hal::DrivenJoint& limits,
                         std::size_t joint) const {
  const char* const unit = limits.slides ? "m" : "rad";
  const char* const speed_unit = limits.slides ? "m/s" : "rad/s";
  const char* const where =
      "leave it out of `joints`, play another stretch with from_s and to_s, or correct the limits "
      "of robot.toml";
  const char* const slower =
      "play it slower (speed), leave it out of `joints`, play another stretch with from_s and "
      "to_s, "
      "or correct the limits of robot.toml";
  const double fastest = limits.max_velocity_rad_s;
  const double strongest = limits.max_torque_Nm;
  for (std::size_t cycle = 0; cycle < cycles_; ++cycle) {
    const double here = position(joint, cycle);
    if (here < limits.min_position_rad - kRounding || here > limits.max_position_rad + kRounding) {
      return beyond(limits, when(motion, cycle), "be at", here, limits.min_position_rad,
                    limits.max_position_rad, unit, where);
    }
    const double step = cycle == 0 ? 0.0 : (here - position(joint, cycle - 1)) / period_s_;
    for (const double speed : {step, velocity(joint, cycle)}) {
      if (std::abs(speed) <= fastest * (1.0 + kRounding) + kRounding) continue;
      return beyond(limits, when(motion, cycle), "move with", speed, -fastest, fastest, speed_unit,
                    slower);
    }
    if (!has_torque() || std::abs(torque(joint, cycle)) <= strongest * (1.0 + kRounding)) continue;
    return beyond(limits, when(motion, cycle), "get", torque(joint, cycle), -strongest, strongest,
                  limits.slides ? "N" : "Nm", "play it without: torque = false");
  }
  return {};
}

double approach_time_s(double way_rad, const hal::DrivenJoint& joint) noexcept TANDEM_RT {
  constexpr double kPeakAcceleration = 5.7736;  // 10 / sqrt 3: of the profile, by way / T^2
  constexpr double kPeakJerk = 60.0;            // by way / T^3
  const double way = std::abs(way_rad);
  return std::max({kMinJerkPeak * way / (kApproachShare * joint.max_velocity_rad_s),
                   std::sqrt(kPeakAcceleration * way / joint.max_acceleration_rad_s2),
                   std::cbrt(kPeakJerk * way / joint.max_jerk_rad_s3)});
}

}  // namespace tandem
