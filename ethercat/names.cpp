// States and status codes of the application layer in words.
#include "ethercat/errors.hpp"
#include "ethercat/registers.hpp"

#include <cstddef>
#include <iterator>

namespace tandem::ethercat {

const char* to_string(AlState state) noexcept {
  switch (state) {
    case AlState::kInit: return "INIT";
    case AlState::kPreOp: return "PREOP";
    case AlState::kBoot: return "BOOT";
    case AlState::kSafeOp: return "SAFEOP";
    case AlState::kOp: return "OP";
    case AlState::kNone: break;
  }
  return "no state";
}

const char* to_string(AlCode code) noexcept {
  switch (code) {
    case AlCode::kNone: return "no error";
    case AlCode::kUnspecified: return "unspecified error";
    case AlCode::kNoMemory: return "no memory";
    case AlCode::kInvalidChange: return "invalid requested state change";
    case AlCode::kUnknownState: return "unknown requested state";
    case AlCode::kNoBoot: return "BOOT is not supported";
    case AlCode::kNoFirmware: return "no valid firmware";
    case AlCode::kBootMailbox: return "invalid mailbox configuration for BOOT";
    case AlCode::kMailbox: return "invalid mailbox configuration";
    case AlCode::kSyncManagers: return "invalid sync manager configuration";
    case AlCode::kNoInputs: return "no valid inputs";
    case AlCode::kNoOutputs: return "no valid outputs";
    case AlCode::kSynchronisation: return "synchronisation error";
    case AlCode::kWatchdog: return "process data watchdog: no outputs came in time";
    case AlCode::kSyncManagerTypes: return "invalid sync manager types";
    case AlCode::kOutputs: return "invalid output configuration";
    case AlCode::kInputs: return "invalid input configuration";
    case AlCode::kWatchdogConfiguration: return "invalid watchdog configuration";
    case AlCode::kNeedsColdStart: return "needs a cold start";
    case AlCode::kNeedsInit: return "needs INIT";
    case AlCode::kNeedsPreOp: return "needs PREOP";
    case AlCode::kNeedsSafeOp: return "needs SAFEOP";
    case AlCode::kInputMapping: return "invalid input mapping";
    case AlCode::kOutputMapping: return "invalid output mapping";
    case AlCode::kInconsistentSettings: return "inconsistent settings";
    case AlCode::kFreeRunOnly: return "works only without synchronisation";
    case AlCode::kSyncOnly: return "works only with synchronisation";
    case AlCode::kFatalSync: return "fatal synchronisation error";
    case AlCode::kNoSync: return "no synchronisation signal";
    case AlCode::kDcConfiguration: return "invalid SYNC0 configuration";
    case AlCode::kDcLatch: return "invalid latch configuration";
    case AlCode::kPll: return "the drive's own clock does not follow SYNC0";
    case AlCode::kDcIo: return "invalid input or output of the clocks";
    case AlCode::kDcTimeout: return "time-out of the clocks";
    case AlCode::kDcPeriod: return "invalid cycle time";
    case AlCode::kDcSync0Period: return "the cycle time of SYNC0 does not suit the application";
    case AlCode::kDcSync1Period: return "the cycle time of SYNC1 does not suit the application";
    case AlCode::kMailboxCoe: return "CoE mailbox error";
    case AlCode::kEepromNoAccess: return "no access to the SII";
    case AlCode::kEepromError: return "error of the SII";
  }
  return "unknown code";
}

namespace {
struct LineErrorRow {
  bool lasts;
  const char* words;
};
constexpr LineErrorRow kLineErrors[] = {
#define TANDEM_LINE_ERROR(name, lasts, words) {lasts, words},
#include "ethercat/errors.inc"
#undef TANDEM_LINE_ERROR
};

const LineErrorRow& row_of(LineError error) noexcept {
  const auto row = static_cast<std::size_t>(error);  // bytes of a snapshot are anybody's
  return kLineErrors[row < std::size(kLineErrors) ? row : 0];
}
}  // namespace

const char* to_string(LineError error) noexcept { return row_of(error).words; }
bool lasts(LineError error) noexcept TANDEM_RT { return row_of(error).lasts; }

}  // namespace tandem::ethercat
