// Creates plant, boards and sensor nodes from robot.toml, and makes one step: plant to the time of
// SYNC, frames in, boards at their control periods, answers out.
#include "hal/sim/emulated_robot.hpp"

#include <algorithm>
#include <numeric>

#include "base/archive.hpp"
#include "hal/sim/engine_loader.hpp"
#include "hal/sim/make_plant.hpp"
#include "hal/sim/setup.hpp"

namespace tandem::sim {
namespace {

using hal::can::LoopbackBus;

std::size_t bus_index(const hal::RobotConfig& robot, const std::string& name) {
  std::size_t index = 0;
  while (robot.buses[index].name != name) ++index;  // the configuration was checked
  return index;
}

std::int64_t common_tick(const hal::RobotConfig& robot, std::int64_t period_ns) {
  std::int64_t tick = period_ns;
  for (const hal::BoardConfig& board : robot.boards) {
    tick = std::gcd(tick, board.control_period_ns);
  }
  return tick;
}

Status named(Status status, const std::string& key) {
  if (!status)
    status.error().key = key + (status.error().key.empty() ? "" : ".") + status.error().key;
  return status;
}

}  // namespace

Status check_engine(const hal::RobotConfig& robot, const SimRobotConfig& config) {
  if (config.engine == kOwnEngine) return {};
  const PlantChanges* changes = config.changes.get();
  const auto engine = make_engine(config.engine, changes != nullptr ? changes->robot : robot,
                                  changes != nullptr ? changes->tree : *config.tree,
                                  static_cast<double>(config.substep_ns) * 1e-9,
                                  config.integrator == Integrator::kRungeKutta4);
  if (!engine) return std::unexpected(engine.error());
  return {};
}

Result<std::unique_ptr<EmulatedRobot>> EmulatedRobot::create(const hal::RobotConfig& robot,
                                                             const tandem_kernels* kernels,
                                                             const SimRobotConfig& config) {
  if (config.period_ns <= 0) return fail("the loop's period has to be above 0 ns");
  const bool line = std::ranges::find(robot.buses, hal::BusKind::kEthercat,
                                      &hal::BusConfig::kind) != robot.buses.end();
  if (config.bus_timing && line) {
    return fail_at("sim.bus_timing", "a robot on EtherCAT has no CAN frames whose time could count",
                   "leave it out");
  }
  Result<Plant> body = make_plant(robot, kernels, config);
  if (!body) return std::unexpected(body.error());
  Result<Sensors> sensors = Sensors::create(robot, *kernels);
  if (!sensors) return std::unexpected(sensors.error());

  std::unique_ptr<EmulatedRobot> made(
      new EmulatedRobot(robot, config, std::move(*body), std::move(*sensors)));
  if (Status status = made->add_nodes(robot, config); !status) {
    return std::unexpected(status.error());
  }
  return made;
}

EmulatedRobot::EmulatedRobot(const hal::RobotConfig& robot, const SimRobotConfig& config,
                             Plant plant, Sensors sensors)
    : plant_(std::move(plant)),
      sensors_(std::move(sensors)),
      sensor_truth_(sensors_.channels(), 0.0),
      answer_window_ns_(config.answer_window_ns),
      faults_(config.seed),
      disturbances_(robot.joints.size()),
      changes_(config.changes),
      tree_(config.tree),
      period_ns_(config.period_ns),
      tick_ns_(common_tick(robot, config.period_ns)) {
  for (std::size_t b = 0; b < robot.buses.size(); ++b) {
    buses_.push_back(std::make_unique<LoopbackBus>());
  }
  attached_.resize(buses_.size());
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    attached_[b].line = robot.buses[b].kind == hal::BusKind::kEthercat;
  }
  for (const hal::JointConfig& joint : robot.joints) {
    supply_V_.push_back(robot.actuator_of(joint).voltage_limit_V);
  }
  if (config.changes != nullptr) zero_error_rad_ = config.changes->zero_error_rad;
}

Status EmulatedRobot::add_nodes(const hal::RobotConfig& robot, const SimRobotConfig& config) {
  for (std::size_t b = 0; b < robot.boards.size(); ++b) {
    const firmware::BoardSetup setup = board_setup(robot, b, config.seed);
    if (Status status = named(firmware::check(setup), "board." + setup.name); !status) {
      return status;
    }
    boards_.push_back({std::make_unique<firmware::Board>(setup),
                       bus_index(robot, robot.boards[b].bus), joints_of(robot, robot.boards[b]),
                       sense_.size(), setup.product, setup.revision, setup.sheet});
    attached_[boards_[b].bus].boards.push_back(b);
    sense_.resize(sense_.size() + setup.axes.size());
  }
  drive_.resize(sense_.size());
  std::size_t channel = 0;
  for (std::size_t s = 0; s < robot.sensors.size(); ++s) {
    const firmware::SensorSetup setup = sensor_setup(robot, s, config.seed);
    if (Status status = named(firmware::check(setup), "sensor." + setup.name); !status) {
      return status;
    }
    sensor_nodes_.push_back({std::make_unique<firmware::SensorBoard>(setup),
                             bus_index(robot, robot.sensors[s].bus), channel, setup.channels});
    attached_[sensor_nodes_[s].bus].sensors.push_back(s);
    channel += setup.channels;
  }
  Status added = add_faults(robot, config);
  if (config.bus_timing) add_wires(robot, config);
  return added;
}

Code EmulatedRobot::step(std::int64_t time_ns) noexcept TANDEM_RT {
  if (started_ == 0) now_ns_ = first_ns_ = time_ns;
  started_ = 1;
  if (faults_.any()) begin_faults(time_ns);
  if (!wires_.empty()) load_wires(time_ns);
  while (now_ns_ < time_ns) {
    if (const Code code = plant_.advance(tick_ns_); code != Code::kOk) return code;
    now_ns_ += tick_ns_;
    if (now_ns_ >= time_ns) break;
    sense();  // boards that are faster than the loop
    deliver(false);
    run_boards();
  }
  hook_(SimStage::kPlant);
  sense();
  hook_(SimStage::kSense);
  deliver(true);
  run_boards();
  for (std::size_t b = 0; b < wires_.size(); ++b) carry(b, time_ns + answer_window_ns_, false);
  if (let_down_ == 0 && all_enabled()) {
    let_down_ = 1;
    enabled_ns_ = now_ns_ - first_ns_;
    plant_.release();
  }
  hook_(SimStage::kBoards);
  return Code::kOk;
}

std::vector<EmulatedRobot::Node> EmulatedRobot::nodes(std::size_t bus) {
  std::vector<Node> all;
  for (const std::size_t b : attached_[bus].boards) {
    firmware::Board& board = *boards_[b].board;
    all.push_back({board.name(), board.node_id(), static_cast<int>(b), &board.dictionary(),
                   &boards_[b].powered, boards_[b].sheet.get()});
  }
  for (const std::size_t s : attached_[bus].sensors) {
    firmware::SensorBoard& board = *sensor_nodes_[s].board;
    all.push_back(
        {board.name(), board.node_id(), -1, &board.dictionary(), &sensor_nodes_[s].powered});
  }
  return all;
}

bool EmulatedRobot::all_enabled() const noexcept {
  return std::ranges::all_of(boards_, [](const BoardNode& node) {
    for (std::size_t axis = 0; axis < node.joints.size(); ++axis) {
      const canopen::DriveMachineState state = node.board->axis(axis).machine().state();
      if (state != canopen::DriveMachineState::kOperationEnabled) return false;
    }
    return true;
  });
}

bool EmulatedRobot::safe(std::size_t board) const noexcept TANDEM_RT {
  const BoardNode& node = boards_[board];
  if (node.powered == 0) return true;
  for (std::size_t axis = 0; axis < node.joints.size(); ++axis) {
    const canopen::DriveMotion motion = node.board->axis(axis).machine().motion();
    const bool brakes =
        motion == canopen::DriveMotion::kQuickStop || motion == canopen::DriveMotion::kShorted;
    if (!brakes && motion != canopen::DriveMotion::kNone) return false;
  }
  return true;
}

bool EmulatedRobot::powerless(std::size_t board) const noexcept TANDEM_RT {
  const BoardNode& node = boards_[board];
  return std::ranges::none_of(std::span(drive_).subspan(node.first, node.joints.size()),
                              &firmware::AxisDrive::enabled);
}

bool EmulatedRobot::safe() const noexcept TANDEM_RT {
  for (std::size_t b = 0; b < boards_.size(); ++b) {
    if (!safe(b)) return false;
  }
  return true;
}

bool EmulatedRobot::powerless() const noexcept TANDEM_RT {
  return std::ranges::none_of(drive_, &firmware::AxisDrive::enabled);
}

void EmulatedRobot::sense() noexcept {
  plant_.evaluate();
  sensors_.sample(plant_, sensor_truth_);
  for (const BoardNode& node : boards_) {
    for (std::size_t axis = 0; axis < node.joints.size(); ++axis) {
      const std::size_t j = node.joints[axis];
      const JointReading joint = plant_.joint(j);
      firmware::AxisSense& pins = sense_[node.first + axis];
      pins = {.link_position_rad = joint.position_rad,
              .motor_position_rad = joint.motor_position_rad,
              .spring_torque_Nm = joint.torque_Nm,
              .current_A = joint.current_A,
              .temperature_C = joint.temperature_C,
              .bus_voltage_V = supply_V_[j]};
      if (!zero_error_rad_.empty()) {
        pins.link_position_rad += zero_error_rad_[j];
        pins.motor_position_rad += zero_error_rad_[j];
      }
      if (faults_.any()) disturb(j, pins);
    }
  }
}

/// How many of the frames that wait come up to the last SYNC; without one, all: there is nothing
/// to wait for.
std::size_t EmulatedRobot::up_to_sync(std::span<const canopen::Frame> waiting) noexcept {
  std::size_t count = waiting.size();
  while (count > 0 && !is_sync(waiting[count - 1])) --count;
  return count == 0 ? waiting.size() : count;
}

/// What has come before SYNC and, at the step's end, SYNC itself. Frames after it stay.
void EmulatedRobot::deliver(bool at_sync) noexcept {
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    canopen::Frame late;
    while (at_sync && faults_.next_due(FrameDirection::kToBoards, b, late)) receive(b, late);
    if (!wires_.empty()) {
      Wire& wire = wires_[b];
      wire.answers_ns = now_ns_;
      carry(b, now_ns_, false);
      if (at_sync && wire.sync_waits != 0) carry(b, now_ns_ + answer_window_ns_, true);
      continue;
    }
    const std::span<const canopen::Frame> waiting = buses_[b]->to_boards();
    std::size_t count = up_to_sync(waiting);
    if (!at_sync && count > 0 && is_sync(waiting[count - 1])) --count;
    for (const canopen::Frame& frame : waiting.first(count)) pass_to_boards(b, frame);
    buses_[b]->take_to_boards(count);
  }
}

void EmulatedRobot::pass_to_boards(std::size_t bus, const canopen::Frame& frame) noexcept {
  if (!faults_.any() || attached_[bus].line) return receive(bus, frame);
  canopen::FrameSink out(passed_);
  faults_.pass(FrameDirection::kToBoards, bus, frame, out);
  for (const canopen::Frame& one : out.frames()) receive(bus, one);
}

/// Everybody on the bus who has power hears it.
void EmulatedRobot::receive(std::size_t bus, const canopen::Frame& frame) noexcept {
  for (const std::size_t b : attached_[bus].boards) {
    if (boards_[b].powered == 0) continue;
    boards_[b].board->receive(frame);
    if (listener_ != nullptr) listener_->received(b, frame);
  }
  for (const std::size_t s : attached_[bus].sensors) {
    if (sensor_nodes_[s].powered != 0) sensor_nodes_[s].board->receive(frame);
  }
  for (Twin& twin : twins_) {
    if (twin.bus == bus && faults_.slots()[twin.slot].active != 0) twin.board->receive(frame);
  }
}

void EmulatedRobot::run_boards() noexcept {
  if (faults_.any()) release_late_answers();
  std::size_t sender = kMasterSender;
  for (BoardNode& node : boards_) {
    ++sender;
    const std::size_t axes = node.joints.size();
    const std::span<firmware::AxisDrive> drives(drive_.data() + node.first, axes);
    if (node.powered != 0) {
      const std::span<const firmware::AxisSense> sense(sense_.data() + node.first, axes);
      node.board->step(tick_ns_, sense, drives);
      if (listener_ != nullptr) {
        const auto board = static_cast<std::size_t>(&node - boards_.data());
        listener_->stepped(board, tick_ns_, sense, node.board->outgoing(), drives);
      }
      answer(node.bus, sender, node.board->outgoing());
      node.board->clear_outgoing();
    } else {
      std::ranges::fill(drives, firmware::AxisDrive{});
    }
    for (std::size_t axis = 0; axis < axes; ++axis) {
      double voltage_V = drives[axis].voltage_V;
      if (faults_.any()) {  // a bridge gives no more than its supply
        const double most_V = sense_[node.first + axis].bus_voltage_V;
        voltage_V = std::clamp(voltage_V, -most_V, most_V);
      }
      plant_.set_drive(node.joints[axis], voltage_V, drives[axis].enabled);
      plant_.set_brake_coil(node.joints[axis], drives[axis].brake_open);
    }
  }
  for (SensorNode& node : sensor_nodes_) {
    ++sender;
    if (node.powered == 0) continue;
    node.board->step(tick_ns_, {sensor_truth_.data() + node.first, node.channels});
    answer(node.bus, sender, node.board->outgoing());
    node.board->clear_outgoing();
  }
  run_twins();
}

void EmulatedRobot::answer(std::size_t bus, std::size_t sender,
                           std::span<const canopen::Frame> frames) noexcept {
  if (!faults_.any() || attached_[bus].line) return put_out(bus, sender, frames);
  for (const canopen::Frame& frame : frames) {
    canopen::FrameSink out(passed_);
    faults_.pass(FrameDirection::kToMaster, bus, frame, out);
    put_out(bus, sender, out.frames());
  }
}

void EmulatedRobot::archive(Archive& ar) {
  ar(plant_);
  for (const auto& bus : buses_) ar(*bus);
  for (BoardNode& node : boards_) ar(*node.board, node.powered);
  for (SensorNode& node : sensor_nodes_) ar(*node.board, node.powered);
  for (const Twin& twin : twins_) ar(*twin.board);
  for (firmware::AxisDrive& drive : drive_) ar(drive.voltage_V, drive.enabled, drive.brake_open);
  for (Wire& wire : wires_) ar(wire.model, wire.answers_ns, wire.sync_waits);
  ar(faults_, disturbances_, now_ns_, first_ns_, enabled_ns_, started_, let_down_, told_kept_);
}

}  // namespace tandem::sim
