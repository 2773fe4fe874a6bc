// Whatever frames pass between the drive master and the boards: a stranger's, lost, doubled, cut
// and swapped ones, to either end, from power-on to a stopped robot. Neither end breaks; what the
// loop is shown are numbers; a board stays within its limits; a stop holds whatever the master
// hears.
//
// The input: the first byte is where the robot stands (situation()), then steps (Play).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "hal/config/capabilities.hpp"
#include "tests/ethercat_can/rig.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using namespace tandem;
using canopen::Frame;
using fuzz::require;
using hal::can::DriveMaster;
using hal::can::LoopbackBus;

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr std::size_t kBoards = 2, kAxes = 1, kJoints = kBoards * kAxes;
constexpr int kMostCycles = 32;  // of an input
constexpr double kRounding = 1e-6;

/// Two boards of an axis on one bus, a sensor node on the other.
hal::RobotConfig small_robot() {
  hal::RobotConfig robot = hal::can::test::robot_config();
  robot.boards.resize(kBoards);
  robot.joints.resize(kJoints);
  robot.joints[1].board = robot.boards[1].name;
  robot.joints[1].axis = 0;
  robot.sensors[0].joint = robot.joints.back().name;
  return robot;
}

/// What an input gives, byte by byte; zeros behind its end.
class Input {
 public:
  explicit Input(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool more() const { return !bytes_.empty(); }
  std::uint8_t byte() {
    if (bytes_.empty()) return 0;
    const std::uint8_t value = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return value;
  }
  double small() { return static_cast<std::int8_t>(byte()) / 64.0; }  // -2 to 2

 private:
  std::span<const std::uint8_t> bytes_;
};

/// Both ends and the wires between them.
struct Wires {
  Wires() {
    for (std::size_t b = 0; b < kBoards; ++b) {
      boards.push_back(std::make_unique<firmware::Board>(hal::can::test::board_setup(robot, b)));
    }
    const std::array<hal::can::Bus*, 2> ends{&legs.master(), &arms.master()};
    auto created = DriveMaster::create(robot, ends);
    require(created.has_value());
    master = std::move(*created);
    for (std::size_t j = 0; j < kJoints; ++j) {
      command.stiffness_Nm_rad()[j] = 100.0;
      command.damping_Nms_rad()[j] = 5.0;
      command.mode()[j] = static_cast<std::int8_t>(hal::ControlMode::kPosition);
    }
  }

  void archive(Archive& ar) {
    ar(*master, legs, arms, sensor, cycle, sense, drive);
    for (auto& board : boards) ar(*board);
    state.archive(ar);
    command.archive(ar);
  }

  /// A cycle, with what a stranger sends in it.
  struct Strangers {
    std::vector<Frame> to_master, to_boards;
    bool late = false;  ///< behind the boards' answers, not before SYNC
  };
  void step(const Strangers& strangers, bool shut_down) {
    if (!strangers.late) (void)legs.boards().send(strangers.to_master);
    (void)legs.master().send(strangers.to_boards);
    master->cycle_begin({.cycle = cycle,
                         .time_ns = static_cast<std::int64_t>(cycle) * kPeriod_ns,
                         .period_ns = kPeriod_ns});
    ++cycle;
    run_boards();
    if (strangers.late) (void)legs.boards().send(strangers.to_master);
    (void)master->receive(state);
    if (shut_down) {
      (void)master->shut_down();
    } else {
      (void)master->send(command, parameters);
    }
  }

  void run_boards() {
    for (std::size_t b = 0; b < kBoards; ++b) {
      if (!powered[b]) continue;
      firmware::Board& board = *boards[b];
      for (const Frame& frame : legs.to_boards()) board.receive(frame);
      board.step(kPeriod_ns, std::span(sense).subspan(b * kAxes, kAxes),
                 std::span(drive).subspan(b * kAxes, kAxes));
      (void)legs.boards().send(board.outgoing());
      board.clear_outgoing();
    }
    legs.take_to_boards(legs.to_boards().size());
    for (const Frame& frame : arms.to_boards()) sensor.receive(frame);
    sensor.step(kPeriod_ns, wrench);
    (void)arms.boards().send(sensor.outgoing());
    sensor.clear_outgoing();
    arms.take_to_boards(arms.to_boards().size());
  }

  /// A board whose power comes back boots: it knows nothing of before.
  void power(std::size_t b, bool on) {
    if (on && !powered[b]) {
      boards[b] = std::make_unique<firmware::Board>(hal::can::test::board_setup(robot, b));
    }
    powered[b] = on;
  }

  [[nodiscard]] const firmware::Axis& axis(std::size_t joint) const {
    return boards[joint / kAxes]->axis(joint % kAxes);
  }

  const hal::RobotConfig robot = small_robot();
  LoopbackBus legs, arms;
  std::vector<std::unique_ptr<firmware::Board>> boards;
  firmware::SensorBoard sensor{hal::can::test::sensor_setup()};
  std::array<double, 6> wrench{1.0, 2.0, 300.0, -4.0, 5.5, -6.25};
  std::unique_ptr<DriveMaster> master;
  hal::StateImage state{robot.shape()};
  hal::CommandImage command{robot.shape()};
  hal::ParameterImage parameters = hal::initial_parameters(robot);
  std::array<firmware::AxisSense, kJoints> sense = [] {
    std::array<firmware::AxisSense, kJoints> still;
    still.fill({.bus_voltage_V = 40.0});
    return still;
  }();
  std::array<firmware::AxisDrive, kJoints> drive{};
  std::array<bool, kBoards> powered{true, true};
  std::uint64_t cycle = 0;
};

/// Where inputs begin, as snapshots of one robot.
enum Situation : std::size_t { kPowerOn, kConfiguring, kOperational, kFollowing, kStopped, kAll };

class Rig {
 public:
  Rig() {
    save(kPowerOn);
    for (int i = 0; i < 20; ++i) wires.step({}, false);
    require(wires.master->phase() == hal::Phase::kBringUp);
    save(kConfiguring);
    for (int i = 0; i < 5000 && wires.master->phase() == hal::Phase::kBringUp; ++i) {
      wires.step({}, false);
    }
    require(wires.master->phase() == hal::Phase::kOperational);
    save(kOperational);
    for (std::size_t j = 0; j < kJoints; ++j) wires.command.position_rad()[j] = 0.3;
    for (int i = 0; i < 20; ++i) wires.step({}, false);
    for (const firmware::AxisDrive& one : wires.drive) require(one.enabled);
    save(kFollowing);
    wires.master->stop(hal::StopCategory::kCategory0);
    for (int i = 0; i < 5; ++i) wires.step({}, false);
    for (const firmware::AxisDrive& one : wires.drive) require(!one.enabled);
    save(kStopped);
  }
  void restore(Situation situation) {
    Archive ar(snapshots_[situation]);
    wires.archive(ar);
    require(ar.ok() && ar.at_end());
    wires.powered.fill(true);
  }
  Wires wires;

 private:
  void save(Situation situation) {
    Archive ar;
    wires.archive(ar);
    snapshots_[situation].assign(ar.bytes().begin(), ar.bytes().end());
  }
  std::array<std::vector<std::byte>, kAll> snapshots_;
};

/// One input's story.
class Play {
 public:
  Play(Rig& rig, Input input) : wires_(rig.wires), input_(input) {
    const auto situation = static_cast<Situation>(input_.byte() % kAll);
    rig.restore(situation);
    stopped_ = situation == kStopped;
    while (input_.more() && cycles_ < kMostCycles) act();
    cycle();
    (void)wires_.master->warnings();
    if (wires_.master->phase() == hal::Phase::kFault) {
      require(!wires_.master->status_text().empty());
    }
  }

 private:
  void act() {
    const std::uint8_t what = input_.byte();
    const unsigned more = what >> 3;
    switch (what & 7) {
      case 0: strangers_.to_master.push_back(frame()); break;
      case 1: {
        const Frame one = frame();
        strangers_.to_boards.push_back(one);
        heard_.push_back(one);
        break;
      }
      case 2:
        for (unsigned i = 0; i <= more; ++i) cycle();
        break;
      case 3: disturb(more); break;
      case 4: command(more % kJoints); break;
      case 5: surroundings(more % kJoints); break;
      case 6: ask(more); break;
      case 7:
        strangers_.late = (more & 1) != 0;
        cycle();
        break;
    }
  }

  /// One of the ids that are used here, or any.
  Frame frame() {
    static constexpr std::array<std::uint16_t, 12> kFunctions{
        0x000, 0x080, 0x100, 0x180, 0x280, 0x380, 0x480, 0x200, 0x300, 0x580, 0x600, 0x700};
    static constexpr std::array<std::uint8_t, 4> kNodes{10, 11, 0, 127};
    Frame one;
    const std::uint8_t choice = input_.byte();
    if (choice < kFunctions.size() * kNodes.size()) {
      one.id = kFunctions[choice % kFunctions.size()] + kNodes[choice / kFunctions.size()];
    } else {
      one.id = ((choice & 7U) << 8) | input_.byte();
    }
    const std::uint8_t length = input_.byte();
    one.length = length & 0x7F;
    if (one.length > canopen::kMaxFrameBytes) one.length = canopen::kMaxFrameBytes;
    if (one.length > canopen::kClassicFrameBytes) one.flags = canopen::kFlagFd;
    if ((length & 0x80) != 0) one.flags = input_.byte();
    for (std::size_t i = 0; i < one.length; ++i) one.data[i] = input_.byte();
    return one;
  }

  /// What a wire does to the frames that wait for the boards.
  void disturb(unsigned how) {
    disturbed_ = true;
    const auto waiting = wires_.legs.to_boards();
    std::vector<Frame> frames(waiting.begin(), waiting.end());
    wires_.legs.take_to_boards(frames.size());
    if (frames.empty()) return;
    const std::size_t at = input_.byte() % frames.size();
    switch (how % 5) {
      case 0: frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(at)); break;
      case 1: frames.push_back(frames[at]); break;
      case 2: std::swap(frames[at], frames.front()); break;
      case 3: frames[at].length = input_.byte() % (frames[at].length + 1U); break;
      case 4: frames[at].data[input_.byte() % canopen::kMaxFrameBytes] ^= input_.byte(); break;
    }
    if (how % 5 > 2) heard_.push_back(frames[at]);
    (void)wires_.legs.master().send(frames);
  }

  void command(std::size_t joint) {
    hal::CommandImage& to = wires_.command;
    to.mode()[joint] = static_cast<std::int8_t>(input_.byte() % 6);
    to.interaction()[joint] = input_.byte() & 1;
    to.position_rad()[joint] = input_.small();
    to.velocity_rad_s()[joint] = 5.0 * input_.small();
    to.torque_Nm()[joint] = to.current_A()[joint] = to.voltage_V()[joint] = 50.0 * input_.small();
  }

  void surroundings(std::size_t joint) {
    firmware::AxisSense& at = wires_.sense[joint];
    at.link_position_rad = at.motor_position_rad = input_.small();
    at.spring_torque_Nm = 50.0 * input_.small();
    const std::uint8_t how = input_.byte();
    at.bus_voltage_V = how & 1 ? 40.0 : 10.0;
    at.temperature_C = how & 2 ? 25.0 : 130.0;
    at.emergency_stop = (how & 4) != 0;
    wires_.power(joint / kAxes, (how & 8) == 0);
  }

  void ask(unsigned what) {
    DriveMaster& master = *wires_.master;
    if (what == 0) {
      master.reset();
      stopped_ = false;
      stops_at_ = kNever;
    } else if (what == 1) {
      shut_down_ = true;
    } else {
      const auto category = static_cast<hal::StopCategory>(what % 4);
      master.stop(category);
      if (category == hal::StopCategory::kCategory0) stops_at_ = std::min(stops_at_, cycles_ + 1);
    }
  }

  void cycle() {
    ++cycles_;
    wires_.step(strangers_, shut_down_);
    strangers_.to_master.clear();
    strangers_.to_boards.clear();
    stopped_ = stopped_ || (cycles_ > stops_at_ && !disturbed_);
    check_image();
    for (std::size_t j = 0; j < kJoints; ++j) check_axis(j);
  }

  void check_image() const {
    const hal::StateImage& state = wires_.state;
    for (const auto values :
         {state.position_rad(), state.velocity_rad_s(), state.acceleration_rad_s2(),
          state.torque_Nm(), state.motor_position_rad(), state.motor_velocity_rad_s(),
          state.current_A(), state.voltage_V(), state.temperature_C(), state.sensor()}) {
      for (const double value : values) require(std::isfinite(value));
    }
    for (const std::uint8_t one : state.drive_state()) {
      require(one <= static_cast<std::uint8_t>(hal::DriveState::kFault));
    }
  }

  /// Whether a stranger may have written to the board's objects, or commanded its axes.
  [[nodiscard]] bool heard_stranger() const { return !heard_.empty(); }

  void check_axis(std::size_t joint) const {
    if (!wires_.powered[joint / kAxes]) return;
    const firmware::AxisDrive& drive = wires_.drive[joint];
    const firmware::AxisSense& sense = wires_.sense[joint];
    const firmware::JointController& controller = wires_.axis(joint).controller();
    const canopen::DriveParameters& limits = controller.config();
    require(std::isfinite(drive.voltage_V));
    require(drive.enabled || drive.voltage_V == 0.0);
    require(std::abs(drive.voltage_V) <= std::max(sense.bus_voltage_V, 0.0) + kRounding);
    require(std::abs(drive.voltage_V) <= std::abs(limits.voltage_limit_V) + kRounding);
    const double torque_Nm = controller.terms().torque_reference_Nm;
    require(std::abs(torque_Nm) <= std::abs(limits.torque_limit_Nm) + kRounding);
    if (heard_stranger()) return;
    const auto& actuator = wires_.robot.actuator_of(wires_.robot.joints[joint]);
    require(std::abs(torque_Nm) <= wires_.robot.joints[joint].max_torque_Nm + kRounding);
    require(limits.current_limit_A <= actuator.current_limit_A + kRounding);
    require(limits.voltage_limit_V <= actuator.voltage_limit_V + kRounding);
    if (!stopped_) return;
    // Whatever the master hears, no motor drives: its bridge is open, or it brakes for the board's
    // own reasons.
    const canopen::DriveMotion motion = wires_.axis(joint).machine().motion();
    require(motion == canopen::DriveMotion::kNone || motion == canopen::DriveMotion::kQuickStop ||
            motion == canopen::DriveMotion::kShorted);
  }

  Wires& wires_;
  Input input_;
  Wires::Strangers strangers_;
  std::vector<Frame> heard_;  // by the boards, of the stranger
  bool stopped_ = false;      // no axis may be enabled until a reset
  bool disturbed_ = false;    // a stop's frame may be lost
  bool shut_down_ = false;
  static constexpr int kNever = 1 << 20;
  int cycles_ = 0, stops_at_ = kNever;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Rig rig;
  const Play play(rig, Input({data, size}));
  return 0;
}
