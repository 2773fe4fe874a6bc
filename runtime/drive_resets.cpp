#include "runtime/drive_resets.hpp"

namespace tandem::runtime {

using log::EventKind;

namespace {

/// Longer than a drive master waits for a fault to go, and then for the drive to be enabled.
constexpr std::int64_t kDriveReset_ns = 4'000'000'000;

}  // namespace

DriveResets::DriveResets(CycleNow& now)
    : now_(now),
      cycles_(static_cast<std::uint64_t>(kDriveReset_ns / now.config.loop.period_ns)),
      left_(now.robot.joints.size()) {}

CycleAnswer DriveResets::begin(std::size_t joint) noexcept TANDEM_RT {
  CycleAnswer answer{.joint = static_cast<std::int32_t>(joint)};
  if (!now_.watch.is_ill(now_.state, joint)) return answer;
  const bool controlled = now_.run.in(RunPhase::kRunning) || now_.run.in(RunPhase::kSettling);
  if (!controlled && !now_.run.in(RunPhase::kHeld) && !now_.run.in(RunPhase::kFaulted)) {
    answer.reason = RejectReason::kNotNow;
  } else if (!now_.backend.resets_one_joint()) {
    answer.reason = RejectReason::kServed;
  } else if (controlled && now_.controllers.owner(joint) >= 0) {
    answer.reason = RejectReason::kClaimed;
    answer.one = now_.controllers.owner(joint);
  } else if (now_.state.fault()[joint] == 0 || hal::is_of_board(now_.backend.fault_cause(joint))) {
    answer.reason = RejectReason::kBoardLost;
  } else if (!is_on(joint)) {
    now_.event(EventKind::kResetRequested, answer.joint);
    left_[joint] = cycles_;
  }
  return answer;
}

void DriveResets::watch(const hal::CommandImage& command) noexcept TANDEM_RT {
  const bool stopped = now_.run.in(RunPhase::kFaulted);
  for (std::size_t j = 0; j < left_.size(); ++j) {
    if (!is_on(j)) continue;
    const auto drive = static_cast<hal::DriveState>(now_.state.drive_state()[j]);
    const bool follows = drive == hal::DriveState::kOperationEnabled ||
                         command.mode()[j] == static_cast<std::int8_t>(hal::ControlMode::kIdle);
    if (!now_.watch.is_ill(now_.state, j) && (stopped || follows)) {
      left_[j] = 0;
      now_.event(EventKind::kResetDone, static_cast<std::int32_t>(j));
      if (!stopped) clear_fault(j);
    } else if (--left_[j] == 0) {
      now_.event(EventKind::kResetFailed, static_cast<std::int32_t>(j));
    }
  }
}

void DriveResets::fail() noexcept TANDEM_RT {
  for (std::size_t j = 0; j < left_.size(); ++j) {
    if (is_on(j)) now_.event(EventKind::kResetFailed, static_cast<std::int32_t>(j));
    left_[j] = 0;
  }
}

void DriveResets::clear_fault(std::size_t joint) noexcept TANDEM_RT {
  now_.watch.forget(joint);
  now_.faults.clear_latched(now_.time.time_ns, [joint](const FaultRecord& fault) {
    return hal::is_of_drive(fault.cause) && fault.index == static_cast<std::int32_t>(joint);
  });
}

}  // namespace tandem::runtime
