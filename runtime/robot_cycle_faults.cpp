// Faults of a run, from the cycle that notices one to the reset: noted, reacted to, cleared.
#include <algorithm>
#include <utility>

#include "rt/stop_signal.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::runtime {

using hal::StopCategory;
using log::EventKind;

/// What other threads and signals have asked for since the last cycle.
void RobotCycle::take_requests() noexcept TANDEM_RT {
  const Requests::Pending asked = requests_.take();
  if (asked.emergency_stop != StopCategory::kWarn) {
    emergency_stop(EmergencyInput::kRequest, asked.emergency_stop);
  }
  if (asked.by_watchdog) {
    // Not category 2: who hung cannot be trusted to retreat.
    emergency_stop(EmergencyInput::kWatchdog,
                   std::min(robot_->emergency_stop, StopCategory::kCategory1), asked.controller);
  }
  if (rt::take_emergency_stop()) emergency_stop(EmergencyInput::kSignal, robot_->emergency_stop);
  if (asked.reset) begin_reset();
  const bool end = asked.end || rt::stop_requested();
  if (end && phase_ != RunPhase::kShutDown) {
    event(EventKind::kStopRequested);
    go(RunPhase::kShutDown);
  }
  take_services();
}

void RobotCycle::emergency_stop(EmergencyInput input, StopCategory category,
                                std::int32_t controller) noexcept TANDEM_RT {
  event(EventKind::kEmergencyStop, -1, static_cast<std::uint32_t>(input));
  fault({.index = controller,
         .code = static_cast<std::uint32_t>(input),
         .source = FaultSource::kEmergencyStop,
         .category = category});
}

/// A missed sample shows as age, a lost command as the board's own time-out, and a drive's fault
/// as its joint's: the joint's stop category decides then. All else stops the robot.
void RobotCycle::check_backend(Code code) noexcept TANDEM_RT {
  if (phase_ == RunPhase::kShutDown) return;
  if (code == Code::kDiverged) {
    fault({.code = static_cast<std::uint32_t>(code),
           .source = FaultSource::kBackend,
           .category = StopCategory::kCategory1});
    return go(RunPhase::kShutDown);  // there is nothing left to wait for
  }
  if (phase_ == RunPhase::kFaulted || phase_ == RunPhase::kResetting) return;
  const bool latched = backend_->phase() == hal::Phase::kFault;
  if (latched && code == Code::kOk) code = Code::kFault;
  if (code == Code::kOk || code == Code::kTimeout || code == Code::kQueueFull) return;
  if (code == Code::kFault && joint_fault_) return;
  fault({.code = static_cast<std::uint32_t>(code),
         .source = FaultSource::kBackend,
         .category = StopCategory::kCategory1});
}

bool RobotCycle::in_fault(std::size_t joint) const noexcept TANDEM_RT {
  const auto drive = static_cast<hal::DriveState>(state_.drive_state()[joint]);
  return drive == hal::DriveState::kFault || drive == hal::DriveState::kFaultReactionActive ||
         state_.fault()[joint] != 0;
}

bool RobotCycle::is_lost(std::size_t joint) const noexcept TANDEM_RT {
  return state_.age_cycles()[joint] > config_.lost_after_cycles;
}

void RobotCycle::check_joints() noexcept TANDEM_RT {
  for (std::size_t j = 0; j < joint_faulted_.size(); ++j) {
    if (joint_faulted_[j] != 0 || (!in_fault(j) && !is_lost(j))) continue;
    joint_faulted_[j] = 1;
    joint_fault_ = true;
    FaultRecord record{.index = static_cast<std::int32_t>(j),
                       .code = state_.age_cycles()[j],
                       .source = FaultSource::kJointLost};
    if (in_fault(j)) {
      record.source = FaultSource::kDrive;
      record.code = state_.fault()[j];
      record.cause = backend_->fault_cause(j);
    }
    record.category = robot_->category_of(j, record.cause);
    fault(record);
  }
}

void RobotCycle::check_sensors() noexcept TANDEM_RT {
  const auto ages = state_.sensor_age_cycles();
  for (std::size_t s = 0; s < ages.size(); ++s) {
    const std::uint8_t lost = ages[s] > config_.lost_after_cycles ? 1 : 0;
    if (lost != 0 && sensor_lost_[s] == 0) {
      fault({.index = static_cast<std::int32_t>(s),
             .code = ages[s],
             .source = FaultSource::kSensorLost,
             .category = StopCategory::kWarn});  // the joints can still be controlled
    }
    sensor_lost_[s] = lost;
  }
}

/// While controllers run: what has been stopped may lie as it likes.
void RobotCycle::check_fall() noexcept TANDEM_RT {
  if (truth_ == nullptr) return;
  const Fall fall = fall_watch_.look(*truth_);
  if (fall.kind == FallKind::kNone) return;
  fault({.index = fall.thousandths,
         .code = static_cast<std::uint32_t>(fall.kind),
         .source = FaultSource::kFall,
         .category = StopCategory::kCategory1});
}

/// Notes it, and carries out what its category says.
void RobotCycle::fault(FaultRecord record) noexcept TANDEM_RT {
  const bool of_joint =
      record.source == FaultSource::kDrive || record.source == FaultSource::kJointLost ||
      record.source == FaultSource::kCommand || record.source == FaultSource::kStray;
  record.cycle = time_.cycle;
  record.time_ns = time_.time_ns;
  if (record.source != FaultSource::kEmergencyStop) {
    const bool of_sensor = record.source == FaultSource::kSensorLost;
    event(of_sensor ? EventKind::kSensorLost : EventKind::kFault, of_joint ? record.index : -1,
          record.code);
  }
  if (record.category == StopCategory::kCategory2 && phase_ != RunPhase::kRetreating &&
      !retreat()) {
    record.category = StopCategory::kCategory1;  // nobody can
  }
  faults_.note(record);
  react(record.category);
}

void RobotCycle::react(StopCategory category) noexcept TANDEM_RT {
  if (category == StopCategory::kWarn) return;
  if (phase_ == RunPhase::kRetreating && category >= StopCategory::kCategory2) return;
  reaction_ = std::min(reaction_, category);
  backend_->stop(category);
  if (phase_ == RunPhase::kShutDown) return;
  if (phase_ == RunPhase::kResetting) reset_failed();
  const bool stays = config_.after_stop == AfterStop::kWait || reaction_ == StopCategory::kHold;
  if (phase_ == RunPhase::kBringUp || !stays) {
    go(RunPhase::kShutDown);
  } else if (phase_ != RunPhase::kFaulted) {
    go(RunPhase::kFaulted);
  }
}

/// The drives go on to follow those controllers that can bring the robot to a safe posture.
bool RobotCycle::retreat() noexcept TANDEM_RT {
  if (phase_ != RunPhase::kRunning || !controlling_) return false;
  const ControllerSet active = controllers_->shown().active;
  if (!controllers_->retreat(time_, state_, controlled())) return false;
  before_retreat_ = active;
  spent_ += time_.cycle - phase_began_;
  phase_ = RunPhase::kRetreating;  // not go(), which stops controllers
  phase_began_ = time_.cycle;
  return true;
}

/// Nothing latched: nothing to do, and no bump.
void RobotCycle::begin_reset() noexcept TANDEM_RT {
  const bool controlled = phase_ == RunPhase::kRunning || phase_ == RunPhase::kSettling;
  if (phase_ != RunPhase::kFaulted && !controlled) return;
  if (faults_.latched() == 0) return;
  event(EventKind::kResetRequested);
  if (controlled && !joint_fault_) return reset_done();  // a sensor's warning
  backend_->reset();
  go(RunPhase::kResetting);
}

/// Every joint is enabled again, or a cause is still there.
void RobotCycle::watch_reset() noexcept TANDEM_RT {
  const hal::Phase at = backend_->phase();
  const bool late = time_.cycle - phase_began_ >= config_.bring_up_cycles;
  if (at == hal::Phase::kOperational) {
    reset_done();
    hold_back();
    go(held_back_ != 0             ? RunPhase::kHeld
       : config_.settle_cycles > 0 ? RunPhase::kSettling
                                   : RunPhase::kRunning);
  } else if (at == hal::Phase::kFault || late) {
    reset_failed();
    const StopCategory again = std::min(reaction_, StopCategory::kHold);
    backend_->stop(again);  // what the reset has taken away of it
    go(RunPhase::kFaulted);
  }
}

void RobotCycle::reset_done() noexcept TANDEM_RT {
  joint_fault_ = false;
  for (std::size_t j = 0; j < joint_faulted_.size(); ++j) {
    joint_faulted_[j] = in_fault(j) || is_lost(j) ? 1 : 0;  // its category is "warn"
    joint_fault_ = joint_fault_ || joint_faulted_[j] != 0;
  }
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    if (faults_.cleared_ns(i) == FaultLog::kLatched && !is_there(faults_[i])) {
      faults_.clear(i, time_.time_ns);
    }
  }
  reaction_ = StopCategory::kWarn;
  loop_.forget_late();
  event(EventKind::kResetDone);
  progress_.resets.fetch_add(1, std::memory_order_relaxed);
}

/// A reset is no start: who was active waits for a second, deliberate act. Not an owner in another
/// process, which comes and goes by itself, and holds its own controllers back.
void RobotCycle::hold_back() noexcept TANDEM_RT {
  const ControllerSet now = controllers_->shown().active;
  const ControllerSet active = now | std::exchange(before_retreat_, ControllerSet{0});
  if (config_.after_reset == AfterReset::kContinue) {  // those, too, that a retreat has stopped
    if (active != now) {
      (void)controllers_->switch_over(0, active & ~now, false, time_, state_, controlled());
    }
    return;
  }
  if (active == 0) return;
  if (go_on_from_robot()) limits_.follow(command_);
  (void)controllers_->switch_over(now, 0, false, time_, state_, controlled());
  held_back_ |= seat_.port != nullptr ? active & ~only(seat_.slot) : active;
}

bool RobotCycle::is_there(const FaultRecord& record) const noexcept TANDEM_RT {
  const auto index = static_cast<std::size_t>(record.index);
  switch (record.source) {
    case FaultSource::kDrive:
    case FaultSource::kJointLost: return joint_faulted_[index] != 0;
    case FaultSource::kSensorLost: return sensor_lost_[index] != 0;
    default: return false;
  }
}

void RobotCycle::reset_failed() noexcept TANDEM_RT {
  event(EventKind::kResetFailed);
  progress_.failed_resets.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace tandem::runtime
