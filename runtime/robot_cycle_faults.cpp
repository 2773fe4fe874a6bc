// Faults of a run, from the cycle that notices one to the reset: noted, reacted to, cleared.
#include <algorithm>
#include <utility>

#include "runtime/robot_cycle.hpp"

namespace tandem::runtime {

using hal::StopCategory;
using log::EventKind;

void RobotCycle::emergency_stop(EmergencyInput input, StopCategory category,
                                std::int32_t controller) noexcept TANDEM_RT {
  event(EventKind::kEmergencyStop, -1, static_cast<std::uint32_t>(input));
  fault({.index = controller,
         .code = static_cast<std::uint32_t>(input),
         .source = FaultSource::kEmergencyStop,
         .category = category});
}

/// Notes it, and carries out what its category says.
void RobotCycle::fault(FaultRecord record) noexcept TANDEM_RT {
  const SourceRow row = row_of(record.source);
  record.cycle = time_.cycle;
  record.time_ns = time_.time_ns;
  if (record.source != FaultSource::kEmergencyStop) {
    const bool of_joint = row.strikes == FaultStrikes::kJoint;
    const bool of_base = of_joint && record.index < 0;
    const bool by_value = row.strikes == FaultStrikes::kSensor || of_base;
    log_.event(time_, row.event, of_joint && !of_base ? record.index : -1, record.code,
               by_value ? static_cast<float>(record.index) : 0.0F,
               record.category == StopCategory::kWarn);
  }
  if (record.category == StopCategory::kCategory2 && !run_.in(RunPhase::kRetreating) &&
      !retreat()) {
    record.category = StopCategory::kCategory1;  // nobody can
  }
  faults_.note(record);
  react(record.category);
}

/// A link that is back needs no reset: the robot has returned to the commands by itself.
void RobotCycle::check_link() noexcept TANDEM_RT {
  if (!run_.controllers_run()) return;
  if (const auto lost = watch_.lost_link()) fault(*lost);
  if (!watch_.link_is_back()) return;
  event(EventKind::kLinkBack);
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    const bool latched = faults_.cleared_ns(i) == FaultLog::kLatched;
    if (latched && faults_[i].source == FaultSource::kLink) faults_.clear(i, time_.time_ns);
  }
}

void RobotCycle::react(StopCategory category) noexcept TANDEM_RT {
  if (!run_.latch(category)) return;
  note_stop();
  backend_->stop(category);
  if (run_.in(RunPhase::kResetting)) reset_failed();
  on(RunEvent::kStop);
}

/// Whoever asked for something until now did not know of it. Resets of drives end with it.
void RobotCycle::note_stop() noexcept TANDEM_RT {
  stopped_before_ = time_.cycle + 1;
  progress_.stopped_before.store(stopped_before_, std::memory_order_relaxed);
  for (std::size_t j = 0; j < resets_.size(); ++j) {
    if (resets_[j] != 0) event(EventKind::kResetFailed, static_cast<std::int32_t>(j));
    resets_[j] = 0;
    command_.fault_reset()[j] = wanted_.fault_reset()[j] = 0;  // a controller's too
  }
}

/// The drives go on to follow those controllers that can bring the robot to a safe posture.
bool RobotCycle::retreat() noexcept TANDEM_RT {
  if (!run_.in(RunPhase::kRunning) || !controlling_) return false;
  const ControllerSet active = controllers_->shown().active;
  if (!controllers_->retreat(time_, state_, controlled())) return false;
  before_retreat_ = active;
  note_stop();
  on(RunEvent::kRetreat);
  return true;
}

/// Nothing latched: nothing to do, and no bump. Stopped since it was asked for: it is not done.
/// @param known  Progress::stopped_before then
void RobotCycle::begin_reset(std::uint64_t known) noexcept TANDEM_RT {
  if (std::min(known, time_.cycle) < stopped_before_ && !ends(run_.phase())) {
    event(EventKind::kResetRequested);
    return reset_failed();
  }
  const bool controlled = run_.in(RunPhase::kRunning) || run_.in(RunPhase::kSettling);
  if (!run_.in(RunPhase::kFaulted) && !controlled) return;
  if (faults_.latched() == 0) return;
  event(EventKind::kResetRequested);
  std::ranges::fill(resets_, std::uint64_t{0});
  if (controlled && !watch_.joint_in_fault()) return reset_done();  // a sensor's warning
  backend_->reset();
  on(RunEvent::kReset);
}

/// Every joint is enabled again, or a cause is still there.
void RobotCycle::watch_reset() noexcept TANDEM_RT {
  const hal::Phase at = backend_->phase();
  if (at == hal::Phase::kOperational) {
    reset_done();
    hold_back();
    on(RunEvent::kEnabled, held_back_ != 0);
  } else if (at == hal::Phase::kFault || run_.time_is_over(time_.cycle)) {
    reset_failed();
    backend_->stop(
        std::min(run_.latched(), StopCategory::kHold));  // what the reset took away of it
    on(RunEvent::kResetFailed);
  }
}

void RobotCycle::reset_done() noexcept TANDEM_RT {
  watch_.reset(state_);
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    if (faults_.cleared_ns(i) == FaultLog::kLatched && !watch_.is_there(faults_[i])) {
      faults_.clear(i, time_.time_ns);
    }
  }
  run_.unlatch();
  loop_.forget_late();
  event(EventKind::kResetDone);
  progress_.resets.fetch_add(1, std::memory_order_relaxed);
}

/// A reset is no start: who was active waits for a second, deliberate act. Not an owner in another
/// process, which comes and goes by itself, and holds its own controllers back.
void RobotCycle::hold_back() noexcept TANDEM_RT {
  const ControllerSet now = controllers_->shown().active;
  const ControllerSet active = now | std::exchange(before_retreat_, ControllerSet{0});
  if (config_.after_reset == AfterReset::kContinue &&
      !claims_unhomed(active)) {  // those, too, that a retreat has stopped
    if (active != now) {
      (void)controllers_->switch_over(0, active & ~now, false, time_, state_, controlled());
    }
    return;
  }
  if (active == 0) return;
  if (go_on_from_robot()) limits_.follow(command_);
  (void)controllers_->switch_over(now, 0, false, time_, state_, controlled());
  held_back_ |= owner_.port != nullptr ? active & ~only(owner_.slot) : active;
}

void RobotCycle::reset_failed() noexcept TANDEM_RT {
  event(EventKind::kResetFailed);
  progress_.failed_resets.fetch_add(1, std::memory_order_relaxed);
}

/// Resets one drive. It is enabled only where nothing is latched that stops the robot, held where
/// it is, and only for a joint that no controller would move on.
LoopAnswer RobotCycle::reset_drive(std::size_t joint) noexcept TANDEM_RT {
  LoopAnswer answer{.joint = static_cast<std::int32_t>(joint)};
  if (!watch_.is_ill(state_, joint)) return answer;
  const bool controlled = run_.in(RunPhase::kRunning) || run_.in(RunPhase::kSettling);
  if (!controlled && !run_.in(RunPhase::kHeld) && !run_.in(RunPhase::kFaulted)) {
    answer.reason = RejectReason::kNotNow;
  } else if (!backend_->resets_one_joint()) {
    answer.reason = RejectReason::kServed;
  } else if (controlled && controllers_->owner(joint) >= 0) {
    answer.reason = RejectReason::kClaimed;
    answer.one = controllers_->owner(joint);
  } else if (state_.fault()[joint] == 0 || hal::is_of_board(backend_->fault_cause(joint))) {
    answer.reason = RejectReason::kBoardLost;
  } else if (resets_[joint] == 0) {
    event(EventKind::kResetRequested, answer.joint);
    resets_[joint] = reset_cycles_;
  }
  return answer;
}

/// While the run is stopped the drive stays disabled, and its fault latched in the run.
void RobotCycle::watch_drive_resets() noexcept TANDEM_RT {
  const bool stopped = run_.in(RunPhase::kFaulted);
  for (std::size_t j = 0; j < resets_.size(); ++j) {
    if (resets_[j] == 0) continue;
    command_.fault_reset()[j] = 0;
    const auto joint = static_cast<std::int32_t>(j);
    const auto drive = static_cast<hal::DriveState>(state_.drive_state()[j]);
    const bool follows = drive == hal::DriveState::kOperationEnabled ||
                         command_.mode()[j] == static_cast<std::int8_t>(hal::ControlMode::kIdle);
    if (!watch_.is_ill(state_, j) && (stopped || follows)) {
      resets_[j] = 0;
      event(EventKind::kResetDone, joint);
      if (!stopped) drive_is_well(j);
    } else if (--resets_[j] == 0) {
      event(EventKind::kResetFailed, joint);
    }
  }
}

/// Each joint where it is, until its drive is enabled: whoever led it before does so no more. An
/// owner in another process, who comes meanwhile, commands it.
void RobotCycle::hold_drives_in_reset(hal::CommandImage& command) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < resets_.size(); ++j) {
    const bool owned = run_.in(RunPhase::kRunning) && controllers_->owner(j) >= 0;
    if (resets_[j] != 0 && !owned) controllers_->hold(j, state_, command);
  }
}

void RobotCycle::drive_is_well(std::size_t joint) noexcept TANDEM_RT {
  watch_.forget(joint);
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    const bool of_drive =
        faults_[i].source == FaultSource::kDrive || faults_[i].source == FaultSource::kJointLost;
    const bool its = of_drive && faults_[i].index == static_cast<std::int32_t>(joint);
    if (its && faults_.cleared_ns(i) == FaultLog::kLatched) faults_.clear(i, time_.time_ns);
  }
}

}  // namespace tandem::runtime
