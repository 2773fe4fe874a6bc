// The only place where the loop meets the recorder.
#include "runtime/cycle_log.hpp"

namespace tandem::runtime {

CycleLog::CycleLog(log::Recorder* recorder, const hal::StateImage& state,
                   const hal::CommandImage& command, const hal::TruthImage* truth,
                   const hal::EstimateImage* estimate)
    : recorder_(recorder) {
  if (recorder_ == nullptr) return;
  state_ = recorder_->add_channel("/tandem/state", "tandem/msg/State", state.layout());
  command_ = recorder_->add_channel("/tandem/command", "tandem/msg/Command", command.layout());
  if (truth != nullptr) {
    truth_ = recorder_->add_channel("/tandem/truth", "tandem/msg/Truth", truth->layout());
  }
  if (estimate != nullptr) {
    estimate_ =
        recorder_->add_channel("/tandem/estimate", "tandem/msg/Estimate", estimate->layout());
  }
  recorder_->start();
}

void CycleLog::event(const hal::CycleTime& time, log::EventKind kind, std::int32_t joint,
                     std::uint32_t code, float value, bool reported) noexcept TANDEM_RT {
  if (recorder_ == nullptr) return;
  recorder_->push(log::Event{.cycle = time.cycle,
                             .time_ns = time.time_ns,
                             .code = code,
                             .joint = joint,
                             .kind = kind,
                             .reported = static_cast<std::uint8_t>(reported ? 1 : 0),
                             .value = value});
}

void CycleLog::event(const hal::CycleTime& time,
                     const hal::InjectedFault& fault) noexcept TANDEM_RT {
  if (recorder_ == nullptr) return;
  const bool of_joint = fault.target == hal::FaultTarget::kJoint;
  recorder_->push(log::Event{.cycle = time.cycle,
                             .time_ns = time.time_ns,
                             .code = static_cast<std::uint32_t>(fault.kind),
                             .joint = of_joint ? fault.index : -1,
                             .kind = log::EventKind::kInjected,
                             .target = fault.target,
                             .value = static_cast<float>(fault.index)});
}

void CycleLog::event(const hal::CycleTime& time, std::string_view name,
                     double value) noexcept TANDEM_RT {
  if (recorder_ == nullptr) return;
  recorder_->push(
      log::Event{
          .cycle = time.cycle, .time_ns = time.time_ns, .kind = log::EventKind::kParameterSet},
      name, value);
}

void CycleLog::images(const hal::CycleTime& time, const hal::StateImage& state,
                      const hal::CommandImage& command, const hal::TruthImage* truth,
                      const hal::EstimateImage* estimate) noexcept TANDEM_RT {
  if (recorder_ == nullptr) return;
  recorder_->push(state_, time.time_ns, state.bytes());
  recorder_->push(command_, time.time_ns, command.bytes());
  if (truth != nullptr) recorder_->push(truth_, time.time_ns, truth->bytes());
  if (estimate != nullptr) recorder_->push(estimate_, time.time_ns, estimate->bytes());
}

}  // namespace tandem::runtime
