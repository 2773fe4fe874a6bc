// The only place where the loop meets the recorder.
#include "runtime/cycle_log.hpp"

#include <set>
#include <string>

#include "hal/wire_name.hpp"
#include "runtime/controller_host.hpp"

namespace tandem::runtime {
namespace {

/// A component as the field of a message: in lower case, what is no letter or digit becomes '_'.
std::string field_name(const std::string& component) {
  std::string name = hal::wire_name(component);
  for (char& c : name) {
    if ((c < 'a' || c > 'z') && (c < '0' || c > '9')) c = '_';
  }
  return name.front() >= '0' && name.front() <= '9' ? "c" + name : name;
}

hal::Layout layout_of(const InputBlock& input) {
  hal::Layout layout;
  layout.add("cycle", hal::FieldType::kU64, 1, "in which it reached the controller");
  layout.add("sequence", hal::FieldType::kU64, 1, "samples since the controller's start");
  if (input.kind == InputKind::kTrajectory) {
    layout.add("value", hal::FieldType::kF64, input.values(), "as InputBlock::values() says");
    return layout;
  }
  std::set<std::string> taken;
  for (std::size_t i = 0; i < input.components.size(); ++i) {
    std::string name = field_name(input.components[i]);
    while (!taken.insert(name).second) name += "_";
    layout.add(name, hal::FieldType::kF64, 1,
               input.components[i] + (input.units[i].empty() ? "" : " [" + input.units[i] + "]"));
  }
  return layout;
}

std::string topic_of(const InputPort& port) { return "/tandem/input/" + port.full_name(); }

std::string type_of(int number) { return "tandem/msg/Input" + std::to_string(number); }

}  // namespace

CycleLog::CycleLog(log::Recorder* recorder, const hal::StateImage& state,
                   const hal::CommandImage& command, const hal::TruthImage* truth,
                   const hal::EstimateImage* estimate, ControllerHost& controllers)
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
  for (const auto& one : controllers.owned()) {
    if (one == nullptr) continue;
    for (const auto& port : one->inputs) {
      port->channel =
          recorder_->add_channel(topic_of(*port), type_of(++inputs_), layout_of(port->input()));
    }
  }
  recorder_->start();
}

bool CycleLog::add(const HostedController& controller) {
  for (const auto& port : controller.inputs) {
    if (recorder_ == nullptr) break;
    const auto channel =
        recorder_->add_late_channel(topic_of(*port), type_of(++inputs_), layout_of(port->input()));
    if (!channel) return false;
    port->channel = *channel;
  }
  return true;
}

void CycleLog::input(const hal::CycleTime& time, InputPort& port) noexcept TANDEM_RT {
  if (recorder_ == nullptr || port.channel < 0) return;
  recorder_->push(static_cast<log::Recorder::Channel>(port.channel), time.time_ns, port.message());
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
