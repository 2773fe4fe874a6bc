// What injected faults do to boards, joints and supply.
#include <algorithm>
#include <limits>

#include "canopen/messages.hpp"
#include "hal/sim/emulated_robot.hpp"
#include "hal/sim/setup.hpp"

namespace tandem::sim {

using hal::FaultKind;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kAmbient_C = 25.0;

/// From `from` to `to` in `ramp_ns`.
double ramp(double from, double to, std::int64_t since_ns, std::int64_t ramp_ns) noexcept {
  if (since_ns >= ramp_ns) return to;
  return from + (to - from) * static_cast<double>(since_ns) / static_cast<double>(ramp_ns);
}

}  // namespace

Status EmulatedRobot::add_faults(const hal::RobotConfig& robot, const SimRobotConfig& config) {
  std::vector<ScenarioFault> all = config.faults;  // first, for their numbers seed what is random
  if (config.changes != nullptr) {
    all.insert(all.end(), config.changes->carried.begin(), config.changes->carried.end());
  }
  for (const ScenarioFault& fault : all) {
    if (!faults_.add(fault)) {
      return fail("there are at most " + std::to_string(FaultInjection::kMostFaults) +
                  " faults, and payloads that come and go, together");
    }
    if (fault.kind == FaultKind::kPush && config.tree == nullptr)
      return fail("a push needs the robot's description", "give SimRobotConfig its tree");
    if (fault.kind == FaultKind::kPayload && config.engine != kOwnEngine) {
      return fail("the engine '" + config.engine + "' cannot carry a payload that comes or goes",
                  "set engine = \"tandem\" in [sim]");
    }
    if (fault.kind != FaultKind::kBoardDuplicate) continue;
    const auto index = static_cast<std::size_t>(fault.board);
    firmware::BoardSetup setup = board_setup(robot, index, config.seed);
    setup.serial += static_cast<std::uint32_t>(robot.boards.size());
    const std::size_t axes = setup.axes.size();
    Twin twin{std::make_unique<firmware::Board>(setup), boards_[index].bus,
              faults_.slots().size() - 1, std::vector<firmware::AxisSense>(axes),
              std::vector<firmware::AxisDrive>(axes)};
    for (std::size_t axis = 0; axis < axes; ++axis) {
      twin.sense[axis].bus_voltage_V = supply_V_[boards_[index].joints[axis]];
    }
    twins_.push_back(std::move(twin));
  }
  return {};
}

Code EmulatedRobot::inject(const ScenarioFault& fault) noexcept TANDEM_RT {
  if (!can_begin(fault)) return Code::kOutOfRange;
  ScenarioFault added = fault;
  const bool on_enabled = fault.from == FaultFrom::kEnabled;
  const bool counts = started_ != 0 && (!on_enabled || enabled_ns_ >= 0);
  const std::int64_t next_ns = now_ns_ - first_ns_ + period_ns_ - (on_enabled ? enabled_ns_ : 0);
  if (counts) added.start_ns = std::max(added.start_ns, next_ns);
  return faults_.add(added) ? Code::kOk : Code::kQueueFull;
}

/// Begins and ends what is due; then every active fault acts on what is whole.
void EmulatedRobot::begin_faults(std::int64_t time_ns) noexcept {
  faults_.begin_step(time_ns - first_ns_, enabled_ns_);
  for (std::size_t j = 0; j < disturbances_.size(); ++j) {
    Disturbance& one = disturbances_[j];
    one.supply_V = supply_V_[j];
    one.emergency_stop = 0;
    for (std::size_t side : {0u, 1u}) {
      one.jump_rad[side] = 0.0;
      one.frozen[side] = one.unplugged[side] = 0;
    }
  }
  bool loads = false;
  for (const FaultSlot& slot : faults_.slots()) {
    if (slot.fault.kind == FaultKind::kPush) {  // it ends by itself, between two steps
      if (slot.began != 0) plant_.pushes().begin(slot.fault, plant_.time_ns());
      continue;
    }
    if (slot.active != 0 || slot.ended != 0) apply(slot, time_ns - first_ns_);
    loads |= slot.fault.kind == FaultKind::kPayload && (slot.began != 0 || slot.ended != 0);
  }
  if (loads) carry();
}

/// What is carried has changed: it moves as its link did, and goes as it comes.
void EmulatedRobot::carry() noexcept {
  std::array<Load, FaultInjection::kMostFaults> loads;
  std::size_t count = 0;
  for (const FaultSlot& slot : faults_.slots()) {
    if (slot.active == 0 || slot.fault.kind != FaultKind::kPayload) continue;
    loads[count++] = load_of(slot.fault);
  }
  plant_.carry({loads.data(), count});
}

hal::InjectedFault EmulatedRobot::next_injected() noexcept TANDEM_RT {
  const auto payload = [](std::int64_t number) {
    return hal::InjectedFault{.kind = FaultKind::kPayload,
                              .index = static_cast<std::int32_t>(number)};
  };
  if (changes_ != nullptr && started_ != 0 && told_kept_ < changes_->kept.size())
    return payload(changes_->kept[told_kept_++].number);
  if (const FaultSlot* slot = faults_.next_begun(); slot != nullptr) {
    if (slot->fault.kind != FaultKind::kPayload) return injected(slot->fault);
    return payload(payload_number(*slot));
  }
  const FaultSlot* over = faults_.next_over();
  if (over == nullptr) return {};
  if (over->fault.kind == FaultKind::kPayload) return payload(-std::int64_t{payload_number(*over)});
  hal::InjectedFault push = injected(over->fault);
  push.over = true;
  return push;
}

std::uint32_t EmulatedRobot::payload_number(const FaultSlot& slot) const noexcept TANDEM_RT {
  if (slot.fault.number != 0) return slot.fault.number;
  const std::size_t named = changes_ != nullptr ? changes_->payloads.size() : 0;
  return static_cast<std::uint32_t>(1 + named) +
         static_cast<std::uint32_t>(&slot - faults_.slots().data());
}

std::string EmulatedRobot::payload_text(std::uint32_t number) const {
  const std::size_t named = changes_ != nullptr ? changes_->payloads.size() : 0;
  if (number == 0) return {};
  if (number <= named) return changes_->payloads[number - 1];
  return tree_ == nullptr ? std::string() : words_of(faults_.fault(number - 1 - named), *tree_);
}

double EmulatedRobot::carried_kg(std::int64_t from_ns, std::int64_t to_ns) const noexcept {
  double sum = 0.0;
  for (const FaultSlot& slot : faults_.slots()) {
    if (slot.fault.kind != FaultKind::kPayload || slot.acted == 0) continue;
    const std::int64_t after_ns = slot.fault.from == FaultFrom::kEnabled ? enabled_ns_ : 0;
    const std::int64_t begin_ns = first_ns_ + after_ns + slot.fault.start_ns;
    const std::int64_t length_ns = slot.fault.duration_ns;
    const std::int64_t end_ns = length_ns < 0 ? to_ns : std::min(to_ns, begin_ns + length_ns);
    const std::int64_t held_ns = std::max<std::int64_t>(0, end_ns - std::max(from_ns, begin_ns));
    sum += slot.fault.value * static_cast<double>(held_ns);
  }
  return to_ns > from_ns ? sum / static_cast<double>(to_ns - from_ns) : 0.0;
}

void EmulatedRobot::apply(const FaultSlot& slot, std::int64_t time_ns) noexcept {
  const ScenarioFault& fault = slot.fault;
  const std::int64_t from_ns = fault.from == FaultFrom::kEnabled ? enabled_ns_ : 0;
  const std::int64_t since_ns = time_ns - from_ns - fault.start_ns;
  if (fault.joint >= 0) {
    if (slot.active != 0) apply_to_joint(slot, since_ns);
  } else if (fault.kind == FaultKind::kSupplySag && slot.active != 0) {
    for (const std::size_t j : boards_[static_cast<std::size_t>(fault.board)].joints) {
      const double volts = ramp(supply_V_[j], fault.value, since_ns, fault.ramp_ns);
      disturbances_[j].supply_V = std::min(disturbances_[j].supply_V, volts);
    }
  } else if (fault.kind == FaultKind::kEmergencyStop) {
    for (const std::size_t j : boards_[static_cast<std::size_t>(fault.board)].joints) {
      disturbances_[j].emergency_stop |= slot.active;
    }
  } else {
    apply_to_board(slot);
  }
}

/// What happens once, at the beginning or the end.
void EmulatedRobot::apply_to_board(const FaultSlot& slot) noexcept {
  const ScenarioFault& fault = slot.fault;
  const bool reset = fault.kind == FaultKind::kBoardReset && slot.began != 0;
  const bool kill = fault.kind == FaultKind::kBoardKill;
  const auto act = [&](auto& node) {
    if (kill) node.powered = slot.active != 0 ? 0 : 1;
    if (!reset && !(kill && slot.ended != 0)) return;
    node.board->clear_outgoing();
    node.board->receive(canopen::make_nmt(canopen::NmtCommand::kResetNode, 0));
  };
  if (fault.sensor >= 0) act(sensor_nodes_[static_cast<std::size_t>(fault.sensor)]);
  if (fault.board < 0) return;
  BoardNode& node = boards_[static_cast<std::size_t>(fault.board)];
  act(node);
  if (kill && slot.began != 0) {
    for (const std::size_t j : node.joints) plant_.set_drive(j, 0.0, false);
  }
  const bool on = slot.active != 0;
  if (fault.kind == FaultKind::kBoardIdentity) {
    node.board->set_identity(canopen::kProduct, on ? fault.number : node.product);
  } else if (fault.kind == FaultKind::kBoardRevision) {
    node.board->set_identity(canopen::kRevision, on ? fault.number : node.revision);
  }
}

void EmulatedRobot::apply_to_joint(const FaultSlot& slot, std::int64_t since_ns) noexcept {
  const ScenarioFault& fault = slot.fault;
  const auto j = static_cast<std::size_t>(fault.joint);
  const auto side = static_cast<std::size_t>(fault.encoder);
  Disturbance& one = disturbances_[j];
  switch (fault.kind) {
    case FaultKind::kEncoderFreeze:
      if (slot.began != 0) {  // where it stood at the last SYNC
        const JointReading now = plant_.joint(j);
        one.frozen_rad[side] =
            fault.encoder == EncoderSide::kLink ? now.position_rad : now.motor_position_rad;
      }
      one.frozen[side] = 1;
      break;
    case FaultKind::kEncoderJump: one.jump_rad[side] += fault.value; break;
    case FaultKind::kEncoderUnplug: one.unplugged[side] = 1; break;
    case FaultKind::kMotorOverheat:
      plant_.heat_winding(j, ramp(kAmbient_C, fault.value, since_ns, fault.ramp_ns));
      break;
    case FaultKind::kSpringBreak:
      if (slot.began != 0) plant_.break_spring(j);
      break;
    default: break;
  }
}

void EmulatedRobot::disturb(std::size_t joint, firmware::AxisSense& pins) const noexcept {
  const Disturbance& one = disturbances_[joint];
  double* const angle[2] = {&pins.link_position_rad, &pins.motor_position_rad};
  for (std::size_t side : {0u, 1u}) {
    if (one.frozen[side] != 0) *angle[side] = one.frozen_rad[side];
    *angle[side] += one.jump_rad[side];
    if (one.unplugged[side] != 0) *angle[side] = kNaN;
  }
  pins.bus_voltage_V = one.supply_V;
  pins.emergency_stop = one.emergency_stop != 0;
}

void EmulatedRobot::release_late_answers() noexcept {
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    canopen::Frame late;
    while (faults_.next_due(FrameDirection::kToMaster, b, late)) {
      put_out(b, other_sender(), {&late, 1});
    }
  }
}

/// After the boards proper, as of two answers with one identifier the other may come first.
void EmulatedRobot::run_twins() noexcept {
  for (Twin& twin : twins_) {
    if (faults_.slots()[twin.slot].active == 0) continue;
    twin.board->step(tick_ns_, twin.sense, twin.drive);
    answer(twin.bus, other_sender(), twin.board->outgoing());
    twin.board->clear_outgoing();
  }
}

}  // namespace tandem::sim
