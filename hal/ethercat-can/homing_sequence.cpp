#include "hal/ethercat-can/homing_sequence.hpp"

#include "base/archive.hpp"

namespace tandem::hal::can {

namespace controlword = canopen::controlword;
namespace statusword = canopen::statusword;

namespace {

/// A drive's answer to a step is in its statusword after so long at the latest; what comes earlier
/// may be of the step before.
constexpr std::uint32_t kAnswerCycles = 5;
constexpr std::int64_t kAnswerNs = 20'000'000;
constexpr std::int64_t kModeNs = 1'000'000'000;  // to show mode 6
constexpr std::int64_t kHaltNs = 500'000'000;    // to rest

}  // namespace

void HomingSequence::begin(std::int64_t now_ns, std::int64_t timeout_ns) noexcept TANDEM_RT {
  homed_ = false;
  error_ = FaultCause::kNone;
  begun_ns_ = now_ns;
  timeout_ns_ = timeout_ns;
  enter(Step::kMode, now_ns);
}

void HomingSequence::stop(std::int64_t now_ns) noexcept TANDEM_RT {
  const bool seeks = step_ == Step::kMode || step_ == Step::kSeeks;
  if (seeks) fail(FaultCause::kHomingStopped, now_ns);
}

void HomingSequence::interrupt() noexcept TANDEM_RT {
  if (!under_way()) return;
  if (error_ == FaultCause::kNone) error_ = FaultCause::kHomingInterrupted;
  homed_ = false;
  step_ = Step::kOver;
}

void HomingSequence::forget() noexcept TANDEM_RT {
  interrupt();
  homed_ = false;
}

std::uint16_t HomingSequence::step(std::uint16_t word, bool shows_mode,
                                   std::int64_t now_ns) noexcept TANDEM_RT {
  ++cycles_;
  const std::int64_t in_step_ns = now_ns - since_ns_;
  const bool answered = cycles_ > kAnswerCycles && in_step_ns >= kAnswerNs;
  const bool reached = (word & statusword::kTargetReached) != 0;
  switch (step_) {
    case Step::kOver: break;
    case Step::kMode:
      if (answered && shows_mode) {
        enter(Step::kSeeks, now_ns);
      } else if (in_step_ns >= kModeNs) {
        fail(FaultCause::kHomingMode, now_ns);
      }
      break;
    case Step::kSeeks:
      if (answered && (word & statusword::kHomingError) != 0) {
        fail(FaultCause::kHomingDrive, now_ns);
      } else if (answered && reached && (word & statusword::kHomingAttained) != 0) {
        homed_ = true;
        enter(Step::kEnds, now_ns);
      } else if (now_ns - begun_ns_ >= timeout_ns_) {
        fail(FaultCause::kHomingTimeout, now_ns);
      }
      break;
    case Step::kEnds:
      if (answered && (homed_ || reached || in_step_ns >= kHaltNs)) enter(Step::kOver, now_ns);
      break;
  }
  const bool starts = step_ == Step::kSeeks || (step_ != Step::kMode && homed_);
  const bool halts = step_ == Step::kEnds && !homed_;
  return static_cast<std::uint16_t>(controlword::kCommandEnableOperation |
                                    (starts ? controlword::kStartHoming : 0u) |
                                    (halts ? controlword::kHalt : 0u));
}

void HomingSequence::enter(Step step, std::int64_t now_ns) noexcept {
  step_ = step;
  cycles_ = 0;
  since_ns_ = now_ns;
}

void HomingSequence::fail(FaultCause error, std::int64_t now_ns) noexcept {
  error_ = error;
  enter(Step::kEnds, now_ns);
}

void HomingSequence::archive(Archive& ar) {
  ar(step_, error_, homed_, cycles_, since_ns_, begun_ns_, timeout_ns_);
}

}  // namespace tandem::hal::can
