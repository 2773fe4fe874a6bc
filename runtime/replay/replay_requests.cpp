#include "runtime/replay/replay_requests.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "runtime/refusal_text.hpp"

namespace tandem::runtime {

using log::EventKind;
using log::GivenKind;
using Kind = CycleRequest::Kind;

namespace {

constexpr const char* kOldLog =
    "an earlier version wrote this log, which kept no record of what was asked: ";

bool has(const RecordedCycle& cycle, std::initializer_list<GivenKind> kinds) {
  return std::ranges::any_of(cycle.given, [&](const log::Given& one) {
    return std::ranges::find(kinds, one.kind) != kinds.end();
  });
}

hal::StopCategory category_of(double number) {
  const bool known = number >= 0.0 && number <= static_cast<double>(hal::StopCategory::kWarn);
  return known ? static_cast<hal::StopCategory>(static_cast<int>(number))
               : hal::StopCategory::kCategory1;
}

}  // namespace

ReplayRequests::ReplayRequests(RobotCycle& cycle, ControllerHost& host,
                               const hal::RobotConfig& robot, const RecordedRun& run)
    : cycle_(cycle),
      host_(host),
      robot_(robot),
      has_given_(run.has_given()),
      has_truth_(run.truth() != nullptr) {}

std::string ReplayRequests::ask(const RecordedCycle& cycle) {
  changes_.clear();
  for (const RecordedCycle::Sample& sample : cycle.samples) offer(sample);
  for (const log::Given& given : cycle.given) {
    if (std::string why = ask(given); !why.empty()) return why;
  }
  for (const log::EventText& one : cycle.events) {
    if (std::string why = ask_by_event(cycle, one); !why.empty()) return why;
  }
  set_parameters(cycle);
  return {};
}

std::string ReplayRequests::check() {
  std::string refused;
  while (const auto answer = cycle_.inbox().take_answer()) {
    if (answer->reason == RejectReason::kNone || !refused.empty()) continue;
    const auto name = [&](std::int32_t slot) {
      return slot < 0 ? std::string() : host_.at(static_cast<std::size_t>(slot))->name;
    };
    refused = refusal_text(answer->reason, cycle_.phase(),
                           answer->joint < 0
                               ? std::string()
                               : robot_.joints[static_cast<std::size_t>(answer->joint)].name,
                           name(answer->one), name(answer->other))
                  .message;
  }
  return refused;
}

/// Named as in the log's list; of one that is not loaded its slot.
std::string ReplayRequests::name_of(std::uint32_t slot) const {
  const HostedController* one = slot < kMostControllers ? host_.at(slot) : nullptr;
  return one == nullptr ? "in slot " + std::to_string(slot) : "'" + one->name + "'";
}

std::string ReplayRequests::ask(const log::Given& given) {
  const auto joint = static_cast<std::uint32_t>(given.index);
  const auto& value = given.values;
  CycleRequest what{.slot = joint, .start = given.start, .stop = given.stop, .joint = joint};
  const bool of_joint = given.kind >= GivenKind::kJoint && given.kind <= GivenKind::kCause;
  if (of_joint && joint >= robot_.joints.size()) return "a request names a joint that is not there";
  switch (given.kind) {
    case GivenKind::kStop: (void)cycle_.inbox().emergency_stop(category_of(value[0])); return {};
    case GivenKind::kReset:
      cycle_.inbox().reset_faults(value[0] < 0.0 ? Inbox::kNow
                                                 : static_cast<std::uint64_t>(value[0]));
      return {};
    case GivenKind::kInsert:
    case GivenKind::kCause: return {};  // it waits to be started; RecordedRobot's
    case GivenKind::kRemove:
      if (joint >= kMostControllers || host_.at(joint) == nullptr) return {};
      what.kind = Kind::kRemove;
      break;
    case GivenKind::kReplace:
      return "the controller " + name_of(joint) +
             " was loaded anew: its new build and parameters are in no log";
    case GivenKind::kShadow:
    case GivenKind::kEndShadow:
      if (joint >= kMostControllers || host_.at(joint) == nullptr)
        return "the shadow " + name_of(joint) +
               " was loaded while the run went on: its parameters are in no log";
      what.kind = given.kind == GivenKind::kShadow ? Kind::kShadow : Kind::kEndShadow;
      break;
    case GivenKind::kSwitch:
    case GivenKind::kSwitchWhen:
      for (std::uint32_t left = given.start | given.stop; left != 0; left &= left - 1) {
        const auto slot = static_cast<std::uint32_t>(std::countr_zero(left));
        if (host_.at(slot) == nullptr)
          return "the controller " + name_of(slot) +
                 " was loaded while the run went on: its parameters are in no log";
      }
      what.kind = Kind::kSwitch;
      if (given.kind == GivenKind::kSwitch) break;
      what.kind = Kind::kSwitchWhen;
      what.within = value[0];
      what.cycles = static_cast<std::uint64_t>(value[1] >= 0.0 && value[1] < 1e15 ? value[1] : 0.0);
      switch_waits_ = true;  // the cycle in which it happens follows
      break;
    case GivenKind::kGoOn: what.kind = Kind::kGoOn; break;
    case GivenKind::kLink: return {};  // the recorded robot answers as it did
    case GivenKind::kJoint:
      what.kind = Kind::kJoint;
      what.wish = {value[0], value[1], static_cast<std::int32_t>(value[2]),
                   static_cast<std::int32_t>(value[3])};
      break;
    case GivenKind::kGains:
      what.kind = Kind::kGains;
      what.gains = {value[0], value[1], value[2]};
      what.loop = static_cast<hal::PidLoop>(static_cast<std::uint8_t>(value[3]) % hal::kPidLoops);
      break;
    case GivenKind::kRecover: what.kind = Kind::kRecover; break;
    case GivenKind::kMove:
      what.kind = Kind::kMove;
      what.move = {value[0], value[1], value[2]};
      break;
    case GivenKind::kResetDrive: what.kind = Kind::kReset; break;
    case GivenKind::kHome: what.kind = Kind::kHome; break;
    default: return "a later version gave it something that this one does not know";
  }
  request(what);
  return {};
}

/// What events alone tell, and what they show that nobody could repeat.
std::string ReplayRequests::ask_by_event(const RecordedCycle& cycle, const log::EventText& one) {
  const log::Event& event = one.event;
  switch (event.kind) {
    case EventKind::kStopRequested: cycle_.inbox().end_run(); return {};
    case EventKind::kEmergencyStop:
      if (log::cause_of(event.kind, event.code) == hal::FaultCause::kByWatchdog) {
        cycle_.inbox().watchdog_stop(-1);
      } else if (!has(cycle, {GivenKind::kStop})) {  // by a signal, or of an old log
        (void)cycle_.inbox().emergency_stop(robot_.emergency_stop);
      }
      return {};
    case EventKind::kResetRequested:
      if (has_given_) return {};
      if (event.joint < 0) {
        cycle_.inbox().reset_faults();
      } else {
        request({.kind = Kind::kReset, .joint = static_cast<std::uint32_t>(event.joint)});
      }
      return {};
    case EventKind::kControllersSwitched:
      if (has(cycle, {GivenKind::kSwitch, GivenKind::kGoOn}) || switch_waits_) return {};
      return has_given_ ? "another process took the robot over DDS, or gave it back: its commands "
                          "are in no log"
                        : kOldLog + one.text;
    case EventKind::kOwnerLost:
      return "the robot was another process' over DDS, whose commands are in no log";
    case EventKind::kFell:
      return has_truth_ ? std::string()
                        : "the robot fell, and the truth that shows it is not in the log";
    case EventKind::kJointSet:
    case EventKind::kMotionRequested:
    case EventKind::kMotionStopped:
    case EventKind::kRecoveryRequested:
    case EventKind::kControllerReloaded: return has_given_ ? std::string() : kOldLog + one.text;
    default: return {};
  }
}

void ReplayRequests::offer(const RecordedCycle::Sample& sample) {
  for (const HostedController* controller : host_.loaded()) {
    if (controller == nullptr) continue;
    for (const auto& port : controller->inputs) {
      const InputFeeder feeder = port->source().feeder;
      const bool plays = feeder == InputFeeder::kTimeline || feeder == InputFeeder::kFile;
      // Refused, as by a changed controller with other bounds: it is as if it never came.
      if (!plays && port->full_name() == sample.input) (void)port->offer(feeder, sample.values);
    }
  }
}

/// All of a cycle at once: they count from its update on, whatever was asked beside them.
void ReplayRequests::set_parameters(const RecordedCycle& cycle) {
  for (const log::EventText& one : cycle.events) {
    if (one.event.kind != EventKind::kParameterSet) continue;
    const auto set = log::parameter_of(one.text);
    if (!set) continue;
    for (std::size_t slot = 0; slot < kMostControllers; ++slot) {
      HostedController* controller = host_.at(slot);
      if (controller == nullptr || !set->name.starts_with(controller->name + ".")) continue;
      for (ParameterRow& row : controller->io->parameters.rows()) {
        if (controller->name + "." + row.name != set->name) continue;
        double value = set->value;
        if (!set->word.empty()) {
          const auto& words = row.facts.choices;
          value = row.type == ParameterType::kBoolean
                      ? (set->word == "true" ? 1.0 : 0.0)
                      : static_cast<double>(std::ranges::find(words, set->word) - words.begin());
        }
        if (row.fits(value)) changes_.push_back({slot, &row, value, set->name});
      }
    }
  }
  if (!changes_.empty()) request({.kind = Kind::kSet, .changes = &changes_});
}

void ReplayRequests::request(CycleRequest request) {
  request.number = ++number_;
  (void)cycle_.inbox().ask(request);
}

}  // namespace tandem::runtime
