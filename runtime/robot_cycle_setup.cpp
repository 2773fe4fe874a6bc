// Construction, snapshots and results of RobotCycle: everything outside of the cycle itself.
#include "runtime/robot_cycle.hpp"

namespace tandem::runtime {

RobotCycle::RobotCycle(const CycleParts& parts, const CycleConfig& config)
    : robot_(&parts.robot),
      backend_(&parts.backend),
      controllers_(&parts.controllers),
      clock_(&parts.clock),
      recorder_(parts.recorder),
      truth_(parts.truth),
      observer_(parts.observer),
      seat_(parts.owner),
      config_(config),
      clock_control_(config.loop, bell_),
      loop_(config.loop, parts.clock, &clock_control_),
      state_(parts.robot.shape()),
      command_(parts.robot.shape()),
      wanted_(parts.robot.shape()),
      delay_(parts.robot.shape(), config.delay_cycles),
      parameters_(hal::initial_parameters(parts.robot)),
      limits_(hal::robot_of(parts.robot), config.loop.period_ns),
      statistics_(parts.robot.joints.size(), parts.truth == nullptr ? 0 : parts.truth->feet(),
                  parts.truth == nullptr ? 0 : parts.truth->loops()),
      fall_watch_(config.fall),
      joint_faulted_(parts.robot.joints.size()),
      sensor_lost_(parts.robot.sensors.size()),
      joint_limited_(parts.robot.joints.size()),
      causes_(parts.robot.joints.size()),
      services_(parts.robot, parts.controllers, mailbox_, progress_, clock_control_, parameters_),
      looks_(parts.robot.joints.size()),
      trace_(config.trace_cycles) {
  progress_.total_cycles = config.running_cycles;
  if (seat_.port != nullptr) seat_.port->on_news([this] { bell_.ring(); });
  if (recorder_ == nullptr) return;
  state_channel_ = recorder_->add_channel("/tandem/state", "tandem/msg/State", state_.layout());
  command_channel_ =
      recorder_->add_channel("/tandem/command", "tandem/msg/Command", command_.layout());
  if (truth_ != nullptr) {
    truth_channel_ = recorder_->add_channel("/tandem/truth", "tandem/msg/Truth", truth_->layout());
  }
  recorder_->start();
}

void RobotCycle::archive(Archive& ar) {
  std::uint64_t controllers = controllers_->fingerprint();
  ar(controllers);  // first: restore() looks at it before anything changes
  loop_.archive(ar);
  state_.archive(ar);
  command_.archive(ar);
  wanted_.archive(ar);
  delay_.archive(ar);
  parameters_.archive(ar);
  limits_.archive(ar);
  statistics_.archive(ar);
  fall_watch_.archive(ar);
  controllers_->archive(ar);
  ar(time_, phase_, started_, controlling_, held_back_, before_retreat_, joint_fault_, reaction_,
     read_code_, phase_began_, spent_, ran_);
  ar(joint_faulted_, sensor_lost_, joint_limited_, faults_);
}

Result<std::vector<std::byte>> RobotCycle::save() {
  Archive ar;
  archive(ar);
  if (!backend_->archive(ar)) {
    return fail("this robot cannot be saved", "snapshots need a simulated robot");
  }
  return std::vector<std::byte>(ar.bytes().begin(), ar.bytes().end());
}

Status RobotCycle::restore(std::span<const std::byte> snapshot) {
  Archive ar(snapshot);
  std::uint64_t controllers = 0;
  Archive first(snapshot);
  first(controllers);
  if (controllers != controllers_->fingerprint()) {
    return fail("the snapshot was taken with other controllers than are loaded now",
                "load and unload, in the same order, what was loaded then");
  }
  archive(ar);
  services_.restored(parameters_);
  if (!backend_->archive(ar)) {
    return fail("this robot cannot be rewound", "snapshots need a simulated robot");
  }
  if (ar.ok() && ar.at_end()) return {};
  return fail("the snapshot is of another robot or experiment",
              "restore it with the configuration that it was saved with");
}

Fault RobotCycle::tell(std::size_t number) const {
  const FaultRecord& record = faults_[number];
  const std::int64_t cleared_ns = faults_.cleared_ns(number);
  Fault fault;
  fault.cycle = record.cycle;
  fault.time_s = static_cast<double>(record.time_ns) * 1e-9;
  fault.category = record.category;
  fault.latched = cleared_ns == FaultLog::kLatched;
  fault.cleared_s = fault.latched ? 0.0 : static_cast<double>(cleared_ns) * 1e-9;
  const auto index = static_cast<std::size_t>(record.index);
  const char* code = tandem::to_string(static_cast<Code>(record.code));
  switch (record.source) {
    case FaultSource::kDrive: fault.text = backend_->fault_text(record.cause, record.code); break;
    case FaultSource::kJointLost:
      fault.text = "no feedback for " + std::to_string(record.code) + " cycles";
      break;
    case FaultSource::kSensorLost:
      fault.joint = robot_->sensors[index].name;
      fault.text = "no sample for " + std::to_string(record.code) + " cycles";
      break;
    case FaultSource::kBackend: fault.text = "the robot answered " + std::string(code); break;
    case FaultSource::kController:
      fault.joint = controllers_->name(index);
      fault.text = "the controller gave up: " + std::string(code);
      break;
    case FaultSource::kCommand:
      fault.text = "a controller's command was not a finite number";
      break;
    case FaultSource::kStray:
      fault.text = "the controller '" + controllers_->name(record.code) +
                   "' wrote to this joint, or its mode, without a claim: taken back";
      break;
    case FaultSource::kOverrun:
      fault.text = std::to_string(config_.loop.stop_late) + " of the last " +
                   std::to_string(config_.loop.stop_window) + " cycles were late";
      break;
    case FaultSource::kBringUp: fault.text = "the drives were not enabled in time"; break;
    case FaultSource::kEmergencyStop:
      switch (static_cast<EmergencyInput>(record.code)) {
        case EmergencyInput::kSignal: fault.text = "emergency stop by a signal"; break;
        case EmergencyInput::kRequest: fault.text = "emergency stop on request"; break;
        case EmergencyInput::kWatchdog:
          if (record.index >= 0) fault.joint = controllers_->name(index);
          fault.text = "emergency stop by the watchdog: the loop hung";
          break;
      }
      break;
    case FaultSource::kOwner:
      switch (static_cast<hal::OwnerLoss>(record.code)) {
        case hal::OwnerLoss::kNone: fault.text = "the remote owner asked for a stop"; break;
        case hal::OwnerLoss::kSilent:
          fault.text = "the remote owner is gone: its lease has run out";
          break;
        case hal::OwnerLoss::kStale:
          fault.text = "the remote owner's commands stopped, or came too late";
          break;
        case hal::OwnerLoss::kLate:
          fault.text = "the remote owner gave no command for this cycle in time";
          break;
      }
      break;
    case FaultSource::kFall:
      fault.text =
          fall_text({static_cast<FallKind>(record.code), record.index}, fall_watch_.limits());
      break;
  }
  if (record.source == FaultSource::kDrive || record.source == FaultSource::kJointLost ||
      record.source == FaultSource::kCommand || record.source == FaultSource::kStray) {
    fault.joint = robot_->joints[index].name;
    fault.board = robot_->joints[index].board;
  }
  return fault;
}

std::vector<Fault> RobotCycle::faults() const {
  std::vector<Fault> out;
  for (std::size_t i = 0; i < faults_.size(); ++i) out.push_back(tell(i));
  // The backend's own words are the loop's until the loop has stopped.
  if (progress_.phase.load() != RunPhase::kDone) return out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::string status = out[i].latched ? backend_->status_text() : std::string();
    if (status.empty()) continue;
    if (faults_[i].source == FaultSource::kBackend) out[i].text = status;
    if (faults_[i].source == FaultSource::kBringUp) out[i].text += ": " + status;
  }
  return out;
}

}  // namespace tandem::runtime
