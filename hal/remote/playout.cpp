#include "hal/remote/playout.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::remote {
namespace {

constexpr double kShortestReturn_s = 0.2;
constexpr double kReturnShare = 0.25;  // of a joint's maximum velocity
constexpr double kPeakOfMinJerk = 1.875;

/// From 0 to 1 with velocity and acceleration 0 at both ends.
double min_jerk(double s) noexcept { return s * s * s * (10.0 + s * (6.0 * s - 15.0)); }

}  // namespace

void move_towards(hal::CommandImage& command, const hal::CommandImage& goal,
                  double share) noexcept TANDEM_RT {
  const auto move = [share](std::span<double> values, std::span<const double> to) {
    for (std::size_t j = 0; j < values.size(); ++j) values[j] += share * (to[j] - values[j]);
  };
  move(command.position_rad(), goal.position_rad());
  move(command.velocity_rad_s(), goal.velocity_rad_s());
  move(command.torque_Nm(), goal.torque_Nm());
}

Playout::Playout(const hal::Robot& robot, std::uint64_t delay_cycles, std::uint64_t brake_cycles,
                 std::int64_t period_ns)
    : delay_(delay_cycles),
      brake_cycles_(std::max<std::uint64_t>(1, brake_cycles)),
      period_s_(static_cast<double>(period_ns) * 1e-9),
      buffer_(delay_cycles + 2, hal::CommandImage(robot.shape())),
      given_(delay_cycles + 2, 0),
      last_(robot.shape()),
      brake_velocity_(robot.joints.size()),
      offset_(robot.joints.size()) {
  for (const hal::DrivenJoint& joint : robot.joints)
    max_velocity_.push_back(joint.max_velocity_rad_s);
}

void Playout::start(std::uint64_t cycle, const hal::CommandImage& command) noexcept TANDEM_RT {
  last_.assign(command);
  std::ranges::fill(given_, 0);
  newest_ = source_ = cycle;
  // What was in force holds until the first command has had its delay.
  for (std::uint64_t i = 0; i < buffer_.size() && i <= cycle; ++i) {
    buffer_[(cycle - i) % buffer_.size()].assign(command);
    given_[(cycle - i) % given_.size()] = cycle - i + 1;
  }
}

void Playout::take(std::uint64_t cycle, const hal::CommandImage& command) noexcept TANDEM_RT {
  const std::uint64_t of = command.cycle()[0];
  if (of > cycle || of + delay_ < cycle || has(of)) return;
  buffer_[of % buffer_.size()].assign(command);
  given_[of % given_.size()] = of + 1;
  newest_ = std::max(newest_, of);
}

/// Fills the place of `wanted`, whose command is missing, from those before and after it.
void Playout::bridge(std::uint64_t wanted, std::uint64_t next) noexcept TANDEM_RT {
  hal::CommandImage& out = buffer_[wanted % buffer_.size()];
  out.assign(at(wanted - 1));
  move_towards(out, at(next), 1.0 / static_cast<double>(next - wanted + 1));
  given_[wanted % given_.size()] = wanted + 1;
}

/// References run down to rest. A joint in another mode than position keeps its last reference, but
/// a velocity.
void Playout::brake(hal::CommandImage& out) noexcept TANDEM_RT {
  if (braked_ == 0) {
    ++holds_;
    std::ranges::copy(last_.velocity_rad_s(), brake_velocity_.begin());
  }
  braked_ = std::min(braked_ + 1, brake_cycles_);
  const double left = 1.0 - static_cast<double>(braked_) / static_cast<double>(brake_cycles_);
  const bool moving = braked_ < brake_cycles_;
  for (std::size_t j = 0; j < brake_velocity_.size(); ++j) {
    const double velocity = brake_velocity_[j] * left;
    if (moving) out.position_rad()[j] += velocity * period_s_;
    out.velocity_rad_s()[j] = velocity;
  }
  ++starved_cycles_;
}

/// Commands are there again: from where the references stand back to them.
void Playout::begin_return(const hal::CommandImage& out) noexcept TANDEM_RT {
  starved_ = false;
  braked_ = 0;
  double longest_s = kShortestReturn_s;
  for (std::size_t j = 0; j < offset_.size(); ++j) {
    offset_[j] = last_.position_rad()[j] - out.position_rad()[j];
    const double speed = kReturnShare * max_velocity_[j];
    if (speed > 0.0 && std::isfinite(speed)) {
      longest_s = std::max(longest_s, kPeakOfMinJerk * std::abs(offset_[j]) / speed);
    }
  }
  returned_ = 0;
  return_cycles_ = static_cast<std::uint64_t>(std::ceil(longest_s / period_s_));
}

/// What is left of the way back to the commands is added.
void Playout::return_to(hal::CommandImage& out) noexcept TANDEM_RT {
  if (returned_ >= return_cycles_) return;
  ++returned_;
  const double left =
      1.0 - min_jerk(static_cast<double>(returned_) / static_cast<double>(return_cycles_));
  for (std::size_t j = 0; j < offset_.size(); ++j) out.position_rad()[j] += left * offset_[j];
}

void Playout::play(std::uint64_t cycle, hal::CommandImage& out) noexcept TANDEM_RT {
  const std::uint64_t wanted = cycle < delay_ ? 0 : cycle - delay_;
  std::uint64_t next = wanted;
  while (next <= newest_ && !has(next)) ++next;
  // Once starved, it waits for the command of a cycle itself.
  if (next > newest_ || (starved_ && next != wanted)) {
    starved_ = true;
    out.assign(last_);
    brake(out);
    last_.assign(out);
    return;
  }
  if (next != wanted) bridge(wanted, next);
  out.assign(at(wanted));
  source_ = wanted;
  if (starved_) begin_return(out);
  return_to(out);
  last_.assign(out);
}

void Playout::archive(Archive& ar) {
  ar(buffer_, given_, last_, newest_, source_, starved_, braked_, brake_velocity_, offset_,
     returned_, return_cycles_, starved_cycles_, holds_);
}

}  // namespace tandem::remote
