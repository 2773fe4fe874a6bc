// Random allowed commands on four robots: while a run says that it is well, no joint moves beyond
// its limits by more than the margin, for longer than the time, that docs/safety.md states.
// TANDEM_MOTION_COMMANDS: how many in all (default 2000; 20000 take some minutes).
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>

#include "base/split_mix.hpp"
#include "hal/config/capabilities.hpp"
#include "hal/sim/sim_robot.hpp"
#include "rt/clock.hpp"
#include "runtime/robot_cycle.hpp"
#include "tests/runtime/test_controllers.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem::runtime {
namespace {

using hal::ControlMode;
using hal::InteractionMode;
using hal::PidLoop;

constexpr RunServices::Patience kNow{0};
constexpr std::size_t kModes = 8;  ///< by mode; the compliant ones after the stiff ones

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}
  [[nodiscard]] double share() { return static_cast<double>(split_mix(state_) >> 11) * 0x1.0p-53; }
  [[nodiscard]] double between(double from, double to) { return from + share() * (to - from); }
  [[nodiscard]] std::size_t below(std::size_t count) {
    return static_cast<std::size_t>(share() * static_cast<double>(count));
  }
  /// Mostly within +-most, now and then far beyond: CommandLimits has to cut it.
  [[nodiscard]] double reference(double most) {
    const double x = between(-1.0, 1.0) * most;
    return share() < 0.1 ? 3.0 * x : x;
  }

 private:
  std::uint64_t state_;
};

/// What a joint can do: one of these at random.
std::pair<ControlMode, InteractionMode> random_mode(Dice& dice, const hal::JointCapabilities& can) {
  for (;;) {
    const auto mode = static_cast<ControlMode>(dice.below(6));
    const auto interaction = static_cast<InteractionMode>(dice.below(2));
    if (can.can(mode, interaction)) return {mode, interaction};
  }
}

/// Writes anything to its joints: any mode, steps, ramps and sines of every reference.
class Wild final : public Controller {
 public:
  Wild(std::vector<std::size_t> joints, std::vector<hal::JointCapabilities> limits,
       std::uint64_t seed)
      : joints_(std::move(joints)),
        limits_(std::move(limits)),
        dice_(seed),
        plays_(joints_.size()) {}

  Status configure(ControllerSetup& setup) override {
    for (const std::size_t joint : joints_) setup.claim_with_modes(joint, ControlMode::kPosition);
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {
    for (Play& play : plays_) play.left = 0;
  }
  Code update(const hal::CycleTime&, const hal::StateImage& state,
              hal::CommandImage& command) noexcept override {
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const std::size_t j = joints_[i];
      Play& play = plays_[i];
      if (play.left-- <= 0) begin(play, limits_[j], state.position_rad()[j]);
      const double wave = play.hertz > 0.0 ? std::sin(play.phase) : 1.0;
      play.phase += 2.0 * std::numbers::pi * play.hertz * 1e-3;
      command.mode()[j] = static_cast<std::int8_t>(play.mode);
      command.interaction()[j] = static_cast<std::uint8_t>(play.interaction);
      command.position_rad()[j] = play.from_rad + wave * (play.position_rad - play.from_rad);
      command.velocity_rad_s()[j] = wave * play.velocity_rad_s;
      command.torque_Nm()[j] = wave * play.torque_Nm;
      command.voltage_V()[j] = wave * play.voltage_V;
      command.current_A()[j] = wave * play.current_A;
      command.stiffness_Nm_rad()[j] = play.stiffness_Nm_rad;
      command.damping_Nms_rad()[j] = play.damping_Nms_rad;
    }
    return Code::kOk;
  }

 private:
  struct Play {
    ControlMode mode;
    InteractionMode interaction;
    int left = 0;
    double hertz = 0.0, phase = 0.0, from_rad = 0.0, position_rad = 0.0, velocity_rad_s = 0.0;
    double torque_Nm = 0.0, voltage_V = 0.0, current_A = 0.0;
    double stiffness_Nm_rad = 0.0, damping_Nms_rad = 0.0;
  };
  void begin(Play& play, const hal::JointCapabilities& limit, double position_rad) {
    std::tie(play.mode, play.interaction) = random_mode(dice_, limit);
    play.left = static_cast<int>(dice_.between(20.0, 1500.0));
    play.hertz = dice_.share() < 0.5 ? 0.0 : dice_.between(0.2, 5.0);
    play.phase = 0.0;
    play.from_rad = position_rad;
    const double reach = std::min(3.0, limit.max_position_rad - limit.min_position_rad);
    play.position_rad = position_rad + dice_.reference(0.5 * reach);
    const bool feeds = dice_.share() < 0.5;
    const bool stiff = play.mode == ControlMode::kPosition || play.mode == ControlMode::kVelocity;
    play.velocity_rad_s = feeds || play.mode == ControlMode::kVelocity
                              ? dice_.reference(limit.max_velocity_rad_s)
                              : 0.0;
    play.torque_Nm = feeds || !stiff ? dice_.reference(limit.max_torque_Nm) : 0.0;
    play.voltage_V = dice_.reference(limit.max_voltage_V);
    play.current_A = dice_.reference(limit.max_current_A);
    play.stiffness_Nm_rad =
        dice_.share() < 0.3 ? 0.0 : dice_.between(0.0, limit.max_stiffness_Nm_rad);
    play.damping_Nms_rad =
        dice_.share() < 0.3 ? 0.0 : dice_.between(0.0, limit.max_damping_Nms_rad);
  }

  std::vector<std::size_t> joints_;
  std::vector<hal::JointCapabilities> limits_;
  Dice dice_;
  std::vector<Play> plays_;
};

/// How far the truth was beyond the limits, and for how long, while the run said it was well.
struct Found {
  std::uint64_t cycles = 0, commands = 0, accepted = 0, runs = 0;
  std::array<double, kModes> velocity{}, torque{}, power{};  ///< largest, over their limits
  double outside_rad = 0.0;                                  ///< of the position's range
  std::map<std::string, int> faults;
  std::vector<std::string> violations;
};

std::size_t index_of(std::int8_t mode, std::uint8_t interaction) {
  const bool yields = interaction == static_cast<std::uint8_t>(InteractionMode::kCompliant);
  const auto by = static_cast<std::size_t>(mode);
  return yields && (by == 1 || by == 2) ? 5 + by : by;
}
constexpr std::array<const char*, kModes> kModeNames{"idle",      "position",      "velocity",
                                                     "torque",    "open loop",     "current",
                                                     "compliant", "compliant vel."};

/// One run, until its commands are given or it cannot be reset.
class WildRun {
 public:
  WildRun(const tandem::test::TestRobot& loaded, const std::string& posture, std::uint64_t seed,
          Found& found)
      : robot_(loaded.robot),
        limits_(hal::joint_capabilities(robot_)),
        dice_(seed),
        found_(found),
        seed_(seed),
        host_(robot_, loaded.kernels.get(), 1'000'000),
        joints_(robot_.joints.size()),
        changed_(robot_.joints.size()) {
    auto made = sim::SimRobot::create(robot_, loaded.kernels.get(),
                                      {.posture = posture,
                                       .release_ns = 1'000'000'000'000'000,
                                       .seed = seed + 1,
                                       .tree = loaded.tree});
    if (!made) throw std::runtime_error(made.error().to_string());
    backend_ = std::move(*made);
    std::array<std::vector<std::size_t>, 2> claimed;
    for (std::size_t j = 0; j < joints_.size(); ++j)
      if (j % 3 < 2) claimed[j % 3].push_back(j);
    for (std::size_t c = 0; c < 2; ++c) {
      EXPECT_TRUE(host_.add(kWilds[c], std::make_shared<Wild>(claimed[c], limits_, seed + 7 + c),
                            test::parameters(), c == 0));
    }
    cycle_ = std::make_unique<RobotCycle>(CycleParts{robot_, *backend_, host_, clock_},
                                          CycleConfig{.loop = {.pacing = rt::Pacing::kSimulated},
                                                      .settle_cycles = 100,
                                                      .after_stop = AfterStop::kWait});
    ++found_.runs;
  }

  /// @return how many commands were given
  int give(int commands) {
    for (int n = 0; n < commands; ++n) {
      if (is_over() || (cycle_->phase() == RunPhase::kFaulted && !reset())) return std::max(n, 1);
      command();
      const int most = static_cast<int>(dice_.between(1.0, 200.0));
      for (int i = 0; i < most && step(); ++i) {
      }
    }
    return commands;
  }

 private:
  struct Joint {
    int fast = 0, strong = 0, powerful = 0, swung = 0;  ///< cycles in succession
    double swing = 0.0, moved = 0.0;  ///< mean squares of deviation and reference's velocity
    double reference_rad = 0.0, deviation_rad = 0.0;
    double position_rad = 0.0;  ///< a cycle ago
    std::size_t mode = 0;       ///< in which it was well last
  };

  [[nodiscard]] bool is_over() const {
    return cycle_->phase() == RunPhase::kDone || cycle_->phase() == RunPhase::kShutDown;
  }
  bool step() {
    const bool goes_on = cycle_->step();
    ++found_.cycles;
    const std::vector<FaultReport> faults = cycle_->faults();
    for (; told_ < faults.size(); ++told_) {
      const auto& fault = faults[told_];
      const int joint = robot_.joint_index(fault.joint);
      std::string who;
      if (joint >= 0) {
        const auto j = static_cast<std::size_t>(joint);
        who = fmt::format(", {}{}", kModeNames[joints_[j].mode],
                          changed_[j] != 0 ? ", gains changed"
                          : owned(j)       ? ", of a wild controller"
                                           : ", with the gains of the file");
      }
      ++found_.faults[fault.text + who];
    }
    for (std::size_t j = 0; j < joints_.size(); ++j) look(j);
    return goes_on;
  }
  void look(std::size_t j) {
    const hal::StateImage& state = cycle_->state();
    Joint& joint = joints_[j];
    const sim::JointReading is = backend_->plant().joint(j);
    // From the way of the cycle: where a foot strikes the ground the velocity turns within the
    // cycle.
    const double velocity_rad_s = (is.position_rad - joint.position_rad) / 1e-3;
    joint.position_rad = is.position_rad;
    const bool well =
        backend_->phase() == hal::Phase::kOperational && state.fault()[j] == 0 &&
        state.drive_state()[j] == static_cast<std::uint8_t>(hal::DriveState::kOperationEnabled) &&
        state.mode()[j] != 0;
    if (!well) {
      joint = {.position_rad = is.position_rad, .mode = joint.mode};
      return;
    }
    const hal::JointConfig& config = robot_.joints[j];
    const double velocity = std::abs(velocity_rad_s) / config.max_velocity_rad_s;
    const double torque = std::abs(is.torque_Nm) / config.max_torque_Nm;
    const std::size_t mode = index_of(state.mode()[j], state.interaction()[j]);
    joint.mode = mode;
    const auto most = [](double& largest, double value) { largest = std::max(largest, value); };
    most(found_.velocity[mode], velocity);
    most(found_.torque[mode], torque);
    most(found_.power[mode], velocity * torque);
    most(found_.outside_rad, std::max(is.position_rad - config.max_position_rad,
                                      config.min_position_rad - is.position_rad));
    last(j, "velocity", joint.fast, velocity);
    last(j, "torque", joint.strong, torque);
    last(j, "power", joint.powerful, velocity * torque);
    swing(j, mode, is);
  }
  /// Beyond the declared limit by kMargin for longer than kCycles.
  void last(std::size_t j, const char* what, int& cycles, double share) {
    constexpr double kMargin = 1.25;
    constexpr int kCycles = 110;  // 0.1 s; the measurement's filter, SYNC, and the way of the fault
    cycles = share > kMargin ? cycles + 1 : 0;
    if (cycles == kCycles)
      violation(j, fmt::format("{} {:.2f} of its limit for 0.11 s", what, share));
  }
  /// In position control with gains of the operator's: the deviation's velocity, its RMS over 2 s
  /// beyond 0.35 of the largest while the reference moves by less. A joint with the gains of the
  /// file may be shaken by its neighbours, and one of a wild controller by its feed-forward.
  void swing(std::size_t j, std::size_t mode, const sim::JointReading& is) {
    Joint& joint = joints_[j];
    const double reference_rad = cycle_->command().position_rad()[j];
    const double deviation_rad = is.position_rad - reference_rad;
    if (mode != 1 || changed_[j] == 0 || owned(j)) {
      joint.swing = joint.moved = 0.0;
    } else if (joint.reference_rad != 0.0) {
      constexpr double kShare = 1e-3 / 2.0;
      const auto mean = [&](double& square, double change) {
        const double share = change / 1e-3 / robot_.joints[j].max_velocity_rad_s;
        square += (share * share - square) * kShare;
      };
      mean(joint.swing, deviation_rad - joint.deviation_rad);
      mean(joint.moved, reference_rad - joint.reference_rad);
    }
    joint.reference_rad = reference_rad;
    joint.deviation_rad = deviation_rad;
    const bool swings = joint.swing > 0.35 * 0.35 + 4.0 * joint.moved;
    joint.swung = swings ? joint.swung + 1 : 0;
    if (joint.swung == 1000)
      violation(j, "it swings about a reference that does not, for 1 s more");
  }
  /// By a wild controller that runs.
  [[nodiscard]] bool owned(std::size_t j) const {
    return j % 3 < 2 && (running_ >> (j % 3) & 1U) != 0;
  }
  void violation(std::size_t j, const std::string& what) {
    const auto gains = cycle_->services().joints()[j].gains[0];
    const std::size_t mode = index_of(cycle_->state().mode()[j], cycle_->state().interaction()[j]);
    found_.violations.push_back(
        fmt::format("seed {} cycle {}: {} in mode {}, position gains {:.4g} {:.4g} {:.4g}: {}",
                    seed_, found_.cycles, robot_.joints[j].name, kModeNames[mode], gains.kp,
                    gains.ki, gains.kd, what));
  }

  /// The gains of the file, a reset, and the controllers again.
  bool reset() {
    for (const hal::JointConfig& joint : robot_.joints) {
      const hal::GainsConfig& file = robot_.gains_of(joint);
      for (const auto& [loop, pid] :
           {std::pair{PidLoop::kPosition, &file.position}, {PidLoop::kVelocity, &file.velocity}}) {
        const hal::PidGains& g = pid->gains;
        (void)cycle_->services().set_gains(joint.name, loop, {.kp = g.kp, .ki = g.ki, .kd = g.kd},
                                           kNow);
        (void)step();
      }
    }
    std::ranges::fill(changed_, 0);
    for (int i = 0; i < 1500 && step(); ++i) {
    }
    for (int tries = 0; tries < 3 && cycle_->phase() == RunPhase::kFaulted; ++tries) {
      cycle_->inbox().reset_faults();
      for (int i = 0; i < 5000 && step(); ++i)
        if (i > 10 && (cycle_->phase() == RunPhase::kHeld || cycle_->phase() == RunPhase::kRunning))
          break;
    }
    (void)cycle_->services().go_on(kNow);
    (void)step();
    return cycle_->phase() != RunPhase::kFaulted && !is_over();
  }
  /// One of what an operator can ask for.
  void command() {
    const std::size_t j = dice_.below(joints_.size());
    const std::string& name = robot_.joints[j].name;
    RunServices& services = cycle_->services();
    const double kind = dice_.share();
    Result<RequestResult> answer;
    if (kind < 0.3) {
      const auto [mode, interaction] = random_mode(dice_, limits_[j]);
      JointRequest wish{.mode = static_cast<std::int32_t>(mode),
                        .interaction = static_cast<std::int32_t>(interaction)};
      if (dice_.share() < 0.6) {
        wish.stiffness_Nm_rad =
            dice_.share() < 0.5 ? 0.0 : dice_.between(0.0, limits_[j].max_stiffness_Nm_rad);
        wish.damping_Nms_rad =
            dice_.share() < 0.5 ? 0.0 : dice_.between(0.0, limits_[j].max_damping_Nms_rad);
      }
      answer = services.set_joint(name, wish, kNow);
    } else if (kind < 0.55) {
      MoveRequest wish{.target_rad = cycle_->state().position_rad()[j] + dice_.reference(1.5)};
      if (dice_.share() < 0.5)
        wish.speed_rad_s = dice_.between(0.01, limits_[j].max_velocity_rad_s);
      if (dice_.share() < 0.3) wish.acceleration_rad_s2 = std::pow(10.0, dice_.between(-1.0, 9.0));
      answer = services.move_joint(name, wish, kNow);
    } else if (kind < 0.75) {
      const hal::GainsConfig& file = robot_.gains_of(robot_.joints[j]);
      const bool position = dice_.share() < 0.7;
      const hal::PidGains& from = position ? file.position.gains : file.velocity.gains;
      const auto gain = [&](double value) {
        return dice_.share() < 0.25 ? 0.0 : value * std::pow(10.0, dice_.between(-1.5, 1.2));
      };
      const GainsRequest wish{.kp = gain(from.kp), .ki = gain(from.ki), .kd = gain(from.kd)};
      answer =
          services.set_gains(name, position ? PidLoop::kPosition : PidLoop::kVelocity, wish, kNow);
    } else {
      std::vector<std::string> stop, start;
      for (const char* wild : kWilds) {
        const double way = dice_.share();
        if (way < 0.33) stop.emplace_back(wild);
        if (way > 0.67) start.emplace_back(wild);
      }
      answer = services.switch_controllers(stop, start, kNow);
    }
    ++found_.commands;
    if (answer) ++found_.accepted;
    if (answer && kind >= 0.55 && kind < 0.75) changed_[j] = 1;
    running_ = 0;
    for (const ControllerStatus& one : services.controllers())
      if (one.active) running_ |= one.name == kWilds[0] ? 1U : 2U;
  }

  static constexpr std::array<const char*, 2> kWilds{"wild_a", "wild_b"};

  const hal::RobotConfig& robot_;
  std::vector<hal::JointCapabilities> limits_;
  Dice dice_;
  Found& found_;
  std::uint64_t seed_;
  ControllerHost host_;
  std::unique_ptr<sim::SimRobot> backend_;
  rt::WallClock clock_;
  std::unique_ptr<RobotCycle> cycle_;
  std::vector<Joint> joints_;
  std::vector<char> changed_;  ///< it has had other gains than the file's since the last reset
  unsigned running_ = 1;       ///< wild controllers, by bit
  std::size_t told_ = 0;
};

struct Subject {
  const char* name;
  const char* posture;
};
class MotionBounds : public testing::TestWithParam<Subject> {};

INSTANTIATE_TEST_SUITE_P(Robots, MotionBounds,
                         testing::Values(Subject{"double_pendulum", "ready"},
                                         Subject{"panda", "ready"}, Subject{"ur5e", "ready"},
                                         Subject{"coman", "stand"}),
                         [](const auto& one) { return std::string(one.param.name); });

void print(const char* name, const Found& found) {
  fmt::print("{}: {} commands ({} accepted), {} cycles, {} runs, outside by at most {:.3f} rad\n",
             name, found.commands, found.accepted, found.cycles, found.runs, found.outside_rad);
  for (std::size_t mode = 1; mode < kModes; ++mode) {
    fmt::print("  {:<15} velocity {:.2f}, torque {:.2f}, power {:.2f} of the limits at most\n",
               kModeNames[mode], found.velocity[mode], found.torque[mode], found.power[mode]);
  }
  for (const auto& [text, count] : found.faults) fmt::print("  {:4} x {}\n", count, text);
}

TEST_P(MotionBounds, HoldForEveryAllowedCommandWhileTheRunIsWell) {
  const char* all = std::getenv("TANDEM_MOTION_COMMANDS");
  const int commands = std::max(4, all != nullptr ? std::atoi(all) : 2000) / 4;
  const auto loaded = tandem::test::load_test_robot(GetParam().name);
  Found found;
  std::uint64_t seed = 1;
  for (int given = 0; given < commands; ++seed) {
    given += WildRun(loaded, GetParam().posture, seed, found).give(commands - given);
  }
  print(GetParam().name, found);
  EXPECT_GT(found.accepted, found.commands / 4) << "it has tried little";
  for (std::size_t i = 0; i < found.violations.size() && i < 10; ++i) {
    ADD_FAILURE() << found.violations[i];
  }
  EXPECT_EQ(found.violations.size(), 0U);
}

}  // namespace
}  // namespace tandem::runtime
