#include "runtime/fault_response.hpp"

#include <algorithm>

namespace tandem::runtime {

using hal::StopCategory;
using log::EventKind;

void FaultResponse::raise(FaultRecord record) noexcept TANDEM_RT {
  const hal::CauseRow row = hal::row_of(record.cause);
  record.cycle = now_.time.cycle;
  record.time_ns = now_.time.time_ns;
  const bool of_joint = hal::strikes_joint(row.strikes);
  const bool of_base = of_joint && record.index < 0;
  if (row.strikes == hal::FaultStrikes::kController) record.controller = record.index;
  const bool by_drive = hal::is_of_drive(record.cause) && record.cause != hal::FaultCause::kDrive &&
                        record.cause != hal::FaultCause::kJointLost;
  if (by_drive) {  // its event does not tell these apart
    now_.log.given(now_.time, {.values = {static_cast<double>(record.cause)},
                               .index = record.index,
                               .kind = log::GivenKind::kCause});
  }
  const bool by_value = row.strikes == hal::FaultStrikes::kSensor || of_base;
  now_.log.event(now_.time, log::event_of(record.cause), of_joint && !of_base ? record.index : -1,
                 row.number != 0 ? row.number : record.code,
                 by_value ? static_cast<float>(record.index) : 0.0F,
                 record.category == StopCategory::kWarn, record.controller, record.met);
  if (record.category == StopCategory::kCategory2 && !now_.run.in(RunPhase::kRetreating) &&
      !retreat()) {
    record.category = StopCategory::kCategory1;  // nobody can
  }
  now_.faults.note(record);
  react(record.category);
}

void FaultResponse::check_backend(Code code) noexcept TANDEM_RT {
  const auto stop = [&] {
    raise({.code = static_cast<std::uint32_t>(code), .cause = hal::FaultCause::kBackend});
  };
  if (now_.run.in(RunPhase::kShutDown)) return;
  if (code == Code::kDiverged) {
    stop();
    return arbiter_.on(RunEvent::kEnd);  // there is nothing left to wait for
  }
  if (now_.run.in(RunPhase::kFaulted) || now_.run.in(RunPhase::kResetting)) return;
  if (now_.backend.phase() == hal::Phase::kFault && code == Code::kOk) code = Code::kFault;
  if (code == Code::kOk || code == Code::kTimeout || code == Code::kQueueFull) return;
  if (code == Code::kFault && now_.watch.joint_in_fault()) return;
  stop();
}

void FaultResponse::check_link() noexcept TANDEM_RT {
  if (!now_.run.controllers_run()) return;
  if (const auto lost = now_.watch.lost_link()) raise(*lost);
  if (!now_.watch.link_is_back()) return;
  now_.event(EventKind::kLinkBack);
  now_.faults.clear_latched(now_.time.time_ns, is_of_link);
}

void FaultResponse::check_controllers(Code code) noexcept TANDEM_RT {
  const bool done = code == Code::kStopped;
  if (code != Code::kOk && !done) {
    return raise({.index = static_cast<std::int32_t>(now_.controllers.failed_controller()),
                  .code = static_cast<std::uint32_t>(code),
                  .cause = hal::FaultCause::kController});
  }
  if (now_.run.in(RunPhase::kRetreating)) {  // to the posture, or until its time is over
    if (done || now_.run.time_is_over(now_.time.cycle)) react(StopCategory::kCategory1);
  } else if (done) {
    now_.event(EventKind::kControllersDone);
    arbiter_.on(RunEvent::kFinished);
  }
}

void FaultResponse::react(StopCategory category) noexcept TANDEM_RT {
  if (!now_.run.latch(category)) return;
  note_stop();
  now_.backend.stop(category);
  if (now_.run.in(RunPhase::kResetting)) reset_failed();
  arbiter_.on(RunEvent::kStop);
}

/// Whoever asked for something until now did not know of it. Resets of drives end with it.
void FaultResponse::note_stop() noexcept TANDEM_RT {
  stopped_before_ = now_.time.cycle + 1;
  now_.progress.stopped_before.store(stopped_before_, std::memory_order_relaxed);
  resets_.fail();
  arbiter_.forget_resets();
}

/// The drives go on to follow those controllers that can bring the robot to a safe posture.
bool FaultResponse::retreat() noexcept TANDEM_RT {
  const ControllerSet active = now_.controllers.shown().active;
  if (!now_.run.in(RunPhase::kRunning) || !arbiter_.retreat()) return false;
  waiting_.note_retreat(active);
  note_stop();
  arbiter_.on(RunEvent::kRetreat);
  return true;
}

void FaultResponse::begin_reset(std::uint64_t known) noexcept TANDEM_RT {
  if (std::min(known, now_.time.cycle) < stopped_before_ && !ends(now_.run.phase())) {
    now_.event(EventKind::kResetRequested);
    return reset_failed();
  }
  const bool controlled = now_.run.in(RunPhase::kRunning) || now_.run.in(RunPhase::kSettling);
  if (!now_.run.in(RunPhase::kFaulted) && !controlled) return;
  if (now_.faults.latched() == 0) return;
  now_.event(EventKind::kResetRequested);
  resets_.forget();
  if (controlled && !now_.watch.joint_in_fault()) return reset_done();  // a sensor's warning
  now_.backend.reset();
  arbiter_.on(RunEvent::kReset);
}

bool FaultResponse::watch_reset() noexcept TANDEM_RT {
  const hal::Phase at = now_.backend.phase();
  if (at == hal::Phase::kOperational) {
    reset_done();
    return true;
  }
  if (at == hal::Phase::kFault || now_.run.time_is_over(now_.time.cycle)) {
    reset_failed();  // a cause is still there
    now_.backend.stop(
        std::min(now_.run.latched(), StopCategory::kHold));  // what the reset took away of it
    arbiter_.on(RunEvent::kResetFailed);
  }
  return false;
}

void FaultResponse::reset_done() noexcept TANDEM_RT {
  now_.watch.reset(now_.state);
  now_.faults.clear_latched(
      now_.time.time_ns, [this](const FaultRecord& fault) { return !now_.watch.is_there(fault); });
  now_.run.unlatch();
  now_.loop.forget_late();
  now_.event(EventKind::kResetDone);
  now_.progress.resets.fetch_add(1, std::memory_order_relaxed);
}

void FaultResponse::reset_failed() noexcept TANDEM_RT {
  now_.event(EventKind::kResetFailed);
  now_.progress.failed_resets.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace tandem::runtime
