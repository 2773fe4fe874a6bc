// The only place where the loop meets the recorder.
#include "runtime/cycle_log.hpp"

#include <cstdlib>
#include <set>
#include <utility>

#include "base/file_name.hpp"
#include "hal/wire_name.hpp"
#include "log/controller_messages.hpp"
#include "log/schema.hpp"
#include "runtime/controller_host.hpp"

namespace tandem::runtime {
namespace {

/// As Event::controller has it; of what is loaded later than 254 others, nobody's.
std::uint8_t controller_number(std::int32_t id) noexcept TANDEM_RT {
  return id >= 0 && id < 255 ? static_cast<std::uint8_t>(id + 1) : std::uint8_t{0};
}

/// "SignalsJointTrajectory": ROS 2 allows a type no _.
std::string type_of(const std::string& token) {
  std::string type = "tandem/msg/Signals";
  bool begins = true;
  for (const char c : token) {
    if (c != '_') type += begins && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    begins = c == '_';
  }
  return type;
}

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

/// What the bytes of marks mean: the same of a controller that is loaded again with the same ones.
std::string fingerprint_of(std::span<const hal::MarkInfo> marks) {
  std::string text;
  for (const hal::MarkInfo& mark : marks) {
    text += mark.name + "\n" + mark.frame + "\n" + std::to_string(static_cast<int>(mark.shape)) +
            " " + std::to_string(mark.points) + " " + std::to_string(mark.size_m);
    for (const float part : mark.rgba) text += " " + std::to_string(part);
    text += "\n";
  }
  return text;
}

std::string topic_of(const InputPort& port) { return "/tandem/input/" + port.full_name(); }

std::string type_of(int number) { return "tandem/msg/Input" + std::to_string(number); }

}  // namespace

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

void CycleLog::open(HostedController& controller) {
  if (recorder_ == nullptr) return;
  const ControllerIo& io = *controller.io;
  const std::string topic = "/tandem/controller/" + controller.name;
  if (io.signals.numbers() > 0) {
    controller.signal_channel = recorder_->add_late_channel(
        topic, type_of(controller.name), recorder_->ros2msg_of(io.signals.layout()));
  }
  for (const auto& port : controller.inputs) {
    port->channel = recorder_->add_late_channel(topic_of(*port), type_of(++inputs_),
                                                recorder_->ros2msg_of(layout_of(port->input())));
  }
  if (io.marks.declared().empty()) return;
  std::vector marks(io.marks.declared().begin(), io.marks.declared().end());
  const std::string meaning = controller.name + "\n" + fingerprint_of(marks);
  controller.mark_channel = recorder_->add_late_channel(
      topic + "/marks", log::kMarksType, log::marks_definition(),
      [name = controller.name, marks = std::move(marks)](
          std::int64_t time_ns, std::span<const std::byte> state, log::Bytes& out) {
        log::encode_marks(name, marks, time_ns, state, out);
      },
      meaning);
}

void CycleLog::signals(const hal::CycleTime& time,
                       const HostedController& controller) noexcept TANDEM_RT {
  if (silent() || controller.signal_channel < 0) return;
  recorder_->push(static_cast<log::Recorder::Channel>(controller.signal_channel), time.time_ns,
                  controller.io->signals.image());
}

void CycleLog::marks(const hal::CycleTime& time,
                     const HostedController& controller) noexcept TANDEM_RT {
  if (silent() || controller.mark_channel < 0) return;
  recorder_->push(static_cast<log::Recorder::Channel>(controller.mark_channel), time.time_ns,
                  controller.io->marks.bytes());
}

void CycleLog::input(const hal::CycleTime& time, InputPort& port) noexcept TANDEM_RT {
  if (silent() || port.channel < 0) return;
  recorder_->push(static_cast<log::Recorder::Channel>(port.channel), time.time_ns, port.message());
}

void CycleLog::event(const hal::CycleTime& time, log::EventKind kind, std::int32_t joint,
                     std::uint32_t code, float value, bool reported, std::int32_t controller,
                     const hal::LimitMet& met) noexcept TANDEM_RT {
  if (silent()) return;
  const log::Event event{.cycle = time.cycle,
                         .time_ns = time.time_ns,
                         .code = code,
                         .joint = joint,
                         .kind = kind,
                         .reported = static_cast<std::uint8_t>(reported ? 1 : 0),
                         .controller = controller_number(controller),
                         .value = value};
  if (met.kind == hal::LimitKind::kNone) {
    recorder_->push(event);
  } else {
    recorder_->push(event, met);
  }
}

void CycleLog::event(const hal::CycleTime& time,
                     const hal::InjectedFault& fault) noexcept TANDEM_RT {
  if (silent()) return;
  const bool of_joint = fault.target == hal::FaultTarget::kJoint;
  log::Event event{.cycle = time.cycle,
                   .time_ns = time.time_ns,
                   .code = static_cast<std::uint32_t>(fault.kind),
                   .joint = of_joint ? fault.index : -1,
                   .kind = fault.over ? log::EventKind::kEnded : log::EventKind::kInjected,
                   .target = fault.target,
                   .value = static_cast<float>(fault.index)};
  if (fault.kind == hal::FaultKind::kPayload) {
    event.kind = fault.index < 0 ? log::EventKind::kDropped : log::EventKind::kPickedUp;
    event.code = static_cast<std::uint32_t>(std::abs(fault.index));
  }
  recorder_->push(event);
}

void CycleLog::event(const hal::CycleTime& time, log::EventKind kind,
                     const ParameterChange& change) noexcept TANDEM_RT {
  if (silent()) return;
  recorder_->push(log::Event{.cycle = time.cycle, .time_ns = time.time_ns, .kind = kind},
                  change.name, change.value, change.parameter->word_of(change.value));
}

void CycleLog::images(const hal::CycleTime& time, const hal::StateImage& state,
                      const hal::CommandImage& command, const hal::TruthImage* truth,
                      const hal::EstimateImage* estimate) noexcept TANDEM_RT {
  if (silent()) return;
  recorder_->push(state_, time.time_ns, state.bytes());
  recorder_->push(command_, time.time_ns, command.bytes());
  if (truth != nullptr) recorder_->push(truth_, time.time_ns, truth->bytes());
  if (estimate != nullptr) recorder_->push(estimate_, time.time_ns, estimate->bytes());
}

}  // namespace tandem::runtime
