// Looks through the state image once a cycle for joints and sensors that are in fault or lost.
#include "runtime/fault_watch.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::runtime {
namespace {

bool drive_in_fault(const hal::StateImage& state, std::size_t joint) noexcept TANDEM_RT {
  const auto drive = static_cast<hal::DriveState>(state.drive_state()[joint]);
  return drive == hal::DriveState::kFault || drive == hal::DriveState::kFaultReactionActive ||
         state.fault()[joint] != 0;
}

/// Shares of a winding's limit: where it is hot, and where it is not any more.
constexpr double kHotShare = 0.9, kCooledShare = 0.85;

constexpr int kWarning = 1, kFault = 2, kDisobedient = 3;

/// What is heavier is news of a joint. A stop that is not obeyed is, of one in fault, too.
int weight_of(hal::FaultCause cause) noexcept TANDEM_RT {
  if (cause == hal::FaultCause::kIgnoresStop) return kDisobedient;
  return hal::is_of_drive(cause) ? kFault : cause == hal::FaultCause::kHot ? kWarning : 0;
}

}  // namespace

FaultWatch::FaultWatch(const hal::RobotConfig& robot, const hal::Backend& backend,
                       std::uint32_t lost_after_cycles, const FallLimits& fall)
    : robot_(&robot),
      backend_(&backend),
      lost_after_cycles_(lost_after_cycles),
      fall_(fall),
      joint_told_(robot.joints.size(), hal::FaultCause::kNone),
      code_told_(robot.joints.size()),
      sensor_told_(robot.sensors.size()) {}

bool FaultWatch::is_ill(const hal::StateImage& state, std::size_t joint) const noexcept TANDEM_RT {
  return drive_in_fault(state, joint) || state.age_cycles()[joint] > lost_after_cycles_;
}

hal::FaultCause FaultWatch::found(const hal::StateImage& state, std::size_t joint) const noexcept {
  if (drive_in_fault(state, joint)) {
    const hal::FaultCause cause = backend_->fault_cause(joint);
    return hal::is_of_drive(cause) ? cause : hal::FaultCause::kDrive;
  }
  if (is_ill(state, joint)) return hal::FaultCause::kJointLost;
  const double share = joint_told_[joint] == hal::FaultCause::kHot ? kCooledShare : kHotShare;
  const double limit_C = robot_->joints[joint].drive.temperature_limit_C;  // NaN: not known
  return limit_C > 0.0 && state.temperature_C()[joint] >= share * limit_C ? hal::FaultCause::kHot
                                                                          : hal::FaultCause::kNone;
}

std::optional<FaultRecord> FaultWatch::next_joint(const hal::StateImage& state) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < joint_told_.size(); ++j) {
    const hal::FaultCause now = found(state, j);
    const std::uint32_t code = state.fault()[j];
    const bool another =
        weight_of(now) == kFault && code_told_[j] != 0 && code != 0 && code != code_told_[j];
    if (now == hal::FaultCause::kNone && weight_of(joint_told_[j]) == kWarning) {
      joint_told_[j] = now;  // it has cooled down: the next time is news
    }
    if (weight_of(now) <= weight_of(joint_told_[j]) && !another) continue;
    joint_told_[j] = now;
    if (now == hal::FaultCause::kHot) {
      return FaultRecord{
          .index = static_cast<std::int32_t>(j),
          .code = static_cast<std::uint32_t>(std::min(state.temperature_C()[j], 1e6)),
          .cause = now};
    }
    code_told_[j] = code;
    joint_in_fault_ = true;
    return FaultRecord{.index = static_cast<std::int32_t>(j),
                       .code = now == hal::FaultCause::kJointLost ? state.age_cycles()[j] : code,
                       .cause = now,
                       .category = robot_->category_of(j, now)};
  }
  return std::nullopt;
}

std::optional<FaultRecord> FaultWatch::next_disobedient(
    const hal::StateImage& state) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < joint_told_.size(); ++j) {
    constexpr auto kCause = hal::FaultCause::kIgnoresStop;
    if (joint_told_[j] == kCause || backend_->fault_cause(j) != kCause) continue;
    joint_told_[j] = kCause;
    joint_in_fault_ = true;
    return FaultRecord{.index = static_cast<std::int32_t>(j),
                       .code = state.fault()[j],
                       .cause = kCause,
                       .category = robot_->category_of(j, kCause)};
  }
  return std::nullopt;
}

std::optional<FaultRecord> FaultWatch::next_sensor(
    const hal::StateImage& state) noexcept TANDEM_RT {
  const auto ages = state.sensor_age_cycles();
  for (std::size_t s = 0; s < ages.size(); ++s) {
    const std::uint8_t lost = ages[s] > lost_after_cycles_ ? 1 : 0;
    const bool is_new = lost != 0 && sensor_told_[s] == 0;
    sensor_told_[s] = lost;
    if (!is_new) continue;
    return FaultRecord{.index = static_cast<std::int32_t>(s),
                       .code = ages[s],
                       .cause = hal::FaultCause::kSensorLost};
  }
  return std::nullopt;
}

std::optional<FaultRecord> FaultWatch::lost_link() noexcept TANDEM_RT {
  const hal::FaultCause loss = backend_->link_loss();
  if (link_lost_ || loss == hal::FaultCause::kNone) return std::nullopt;
  link_lost_ = true;
  return FaultRecord{.cause = loss};
}

bool FaultWatch::link_is_back() noexcept TANDEM_RT {
  if (!link_lost_ || backend_->link_loss() != hal::FaultCause::kNone) return false;
  link_lost_ = false;
  return true;
}

std::optional<FaultRecord> FaultWatch::fall(const hal::TruthImage& truth) noexcept TANDEM_RT {
  const Fall found = fall_.look(truth);
  if (found.cause == hal::FaultCause::kNone) return std::nullopt;
  return FaultRecord{.index = found.thousandths, .cause = found.cause};
}

std::optional<FaultRecord> FaultWatch::collision(estimation::Estimator& estimator,
                                                 bool counts) noexcept TANDEM_RT {
  const auto found = estimator.collision();
  if (!found || !counts) return std::nullopt;
  const double thousandths = std::clamp(1e3 * std::abs(found->torque_Nm), 0.0, 4e9);
  const auto joints = static_cast<std::int32_t>(estimator.image().joints());
  const auto channel = static_cast<std::int32_t>(found->joint);
  return FaultRecord{.index = channel < joints ? channel : joints - 1 - channel,
                     .code = static_cast<std::uint32_t>(thousandths),
                     .cause = hal::FaultCause::kCollision,
                     .category = estimator.reaction()};
}

void FaultWatch::reset(const hal::StateImage& state) noexcept TANDEM_RT {
  joint_in_fault_ = false;
  for (std::size_t j = 0; j < joint_told_.size(); ++j) {
    joint_told_[j] = found(state, j);
    const bool in_fault = weight_of(joint_told_[j]) >= kFault;
    code_told_[j] = in_fault ? state.fault()[j] : 0;
    joint_in_fault_ = joint_in_fault_ || in_fault;
  }
}

void FaultWatch::forget(std::size_t joint) noexcept TANDEM_RT {
  joint_told_[joint] = hal::FaultCause::kNone;
  code_told_[joint] = 0;
  joint_in_fault_ =
      std::ranges::any_of(joint_told_, [](auto told) { return weight_of(told) >= kFault; });
}

bool FaultWatch::is_there(const FaultRecord& record) const noexcept TANDEM_RT {
  const auto index = static_cast<std::size_t>(record.index);
  if (hal::is_of_drive(record.cause)) return weight_of(joint_told_[index]) >= kFault;
  if (record.cause == hal::FaultCause::kHot) return joint_told_[index] == record.cause;
  if (record.cause == hal::FaultCause::kSensorLost) return sensor_told_[index] != 0;
  return is_of_link(record) && link_lost_;
}

}  // namespace tandem::runtime
