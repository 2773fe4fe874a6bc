// A joint that moves changes hands: whatever it did, whatever happens to it, it brakes.
#include <cmath>
#include <functional>

#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime {
namespace {

using hal::ControlMode;
using test::Keeper;
using test::Runner;

constexpr double kSpeed_rad_s = 1.0;
constexpr double kMostAcceleration_rad_s2 = 20.0;

class Retreater : public test::Sine {
 public:
  Retreater() : Sine({2}) { retreats = true; }
};

/// An owner in another process: runs joint 0 at a speed, from where it is when it comes.
struct FakeOwner : hal::RemoteCommandPort {
  explicit FakeOwner(const hal::ImageShape& shape) : command(shape) {}
  bool lockstep() const noexcept override { return false; }
  void send(const hal::PortView&) noexcept override {}
  std::int64_t wait_until_ns(const hal::PortView&) noexcept override { return 0; }
  void on_news(std::function<void()>) override {}
  hal::RemoteCommand exchange(const hal::PortView& view) noexcept override {
    if (!here) return {.loss = std::exchange(loss, hal::FaultCause::kNone)};
    if (std::exchange(comes, false)) {
      command.assign(view.command);
      command.position_rad()[0] = view.state.position_rad()[0];
      command.velocity_rad_s()[0] = 0.0;
      for (std::int8_t& mode : command.mode())
        mode = static_cast<std::int8_t>(ControlMode::kPosition);
    }
    double& speed = command.velocity_rad_s()[0];
    speed = std::min(speed + 5e-3, speed_rad_s);
    command.position_rad()[0] += speed * 1e-3;
    return {.live = true, .command = &command};
  }
  hal::CommandImage command;
  bool here = false, comes = true;
  double speed_rad_s = kSpeed_rad_s;
  hal::FaultCause loss = hal::FaultCause::kNone;
};

/// In other modes than position control its first joint turns at kSpeed_rad_s.
class Coasting : public test::FirstOrderRobot {
 public:
  using FirstOrderRobot::FirstOrderRobot;
  Code read(const hal::CycleTime& time, hal::StateImage& state) noexcept override {
    const Code code = FirstOrderRobot::read(time, state);
    if (state.mode()[0] <= static_cast<std::int8_t>(ControlMode::kPosition)) return code;
    state.velocity_rad_s()[0] = kSpeed_rad_s;
    state.position_rad()[0] += kSpeed_rad_s * 1e-3;
    push(0, state.position_rad()[0]);
    return code;
  }
};

hal::RobotConfig wide_robot() {
  hal::RobotConfig robot = hal::test::fake_robot();
  for (hal::JointConfig& joint : robot.joints) {
    joint.min_position_rad = -50.0;
    joint.max_position_rad = 50.0;
    joint.max_acceleration_rad_s2 = kMostAcceleration_rad_s2;
    joint.on_fault = hal::StopCategory::kHold;
  }
  return robot;
}

/// What has joint 0, and moves it.
enum class By { kController, kSilentController, kOperator, kVelocityMode, kTorqueMode, kOwner };

struct MovingRun : test::LoopRun {
  explicit MovingRun(By by, std::uint32_t delay_cycles = 0) : LoopRun(wide_robot()), by_(by) {
    runner = std::make_shared<Runner>(kSpeed_rad_s, by != By::kSilentController);
    const bool controlled = by == By::kController || by == By::kSilentController;
    add("runner", runner, controlled);
    add("keeper", std::make_shared<Keeper>(false), false);
    add("elsewhere", std::make_shared<Keeper>(true), false);
    add("opposite", std::make_shared<Runner>(-0.5), false);
    add("at_once", std::make_shared<test::Sine>(std::vector<std::size_t>{0}), false);
    add("retreater", std::make_shared<Retreater>(), true);
    auto remote = std::make_shared<OwnerController>();
    LoopRun::owner = {&owner, remote.get(), host->size()};
    add(kOwnerController, remote, false);
    begin(backend,
          {.settle_cycles = 20, .after_stop = AfterStop::kWait, .delay_cycles = delay_cycles});
    steps(100);
    if (by == By::kOperator) {
      EXPECT_TRUE(cycle->services().move_joint(
          "shoulder", {.target_rad = 40.0, .speed_rad_s = kSpeed_rad_s}, test::kNow));
    } else if (by == By::kOwner) {
      owner.here = true;
    } else if (!controlled) {
      const auto mode = by == By::kVelocityMode ? ControlMode::kVelocity : ControlMode::kTorque;
      EXPECT_TRUE(cycle->services().set_joint("shoulder", {.mode = static_cast<std::int32_t>(mode)},
                                              test::kNow));
    }
    steps(700);
    EXPECT_NEAR(speed(), kSpeed_rad_s, 1e-6);
  }
  ~MovingRun() { cycle.reset(); }  // it lets the owner go
  void steps(int count) {
    for (int i = 0; i < count; ++i) {
      before_rad = reference();
      ASSERT_TRUE(cycle->step());
    }
  }
  [[nodiscard]] double reference() const { return cycle->command().position_rad()[0]; }
  [[nodiscard]] double speed() const { return (reference() - before_rad) * 1e3; }
  /// Speed of a position loop that closes in this cycle.
  [[nodiscard]] double departs_at() const {
    return (reference() - cycle->state().position_rad()[0]) * 1e3;
  }
  [[nodiscard]] bool moves_by_position() const {
    return by_ != By::kVelocityMode && by_ != By::kTorqueMode;
  }

  By by_;
  Coasting backend{robot};
  FakeOwner owner{robot.shape()};
  std::shared_ptr<Runner> runner;
  double before_rad = 0.0;
};

/// What happens to it.
struct Change {
  const char* name;
  std::function<void(MovingRun&)> make;
  double lowest_rad_s;  ///< of the reference from then on
  double end_rad_s;     ///< at last; NaN: it goes on to move
  enum { kAny, kControllers, kNoOwner, kOwners } where = kNoOwner;  ///< who has it before
  [[nodiscard]] bool happens_to(By by) const {
    const bool controlled = by == By::kController || by == By::kSilentController;
    const bool owned = by == By::kOwner;
    return where == kAny || (where == kControllers ? controlled : owned == (where == kOwners));
  }
};

void owner_comes(MovingRun& run) {
  run.owner.speed_rad_s = 0.0;
  run.owner.here = true;
}
void owner_is_lost(MovingRun& run) {
  run.owner.loss = hal::FaultCause::kOwnerSilent;
  run.owner.here = false;
}

void switched(MovingRun& run, const char* to) {
  const bool controlled = run.by_ == By::kController || run.by_ == By::kSilentController;
  const std::vector<std::string> stop =
      controlled ? std::vector<std::string>{"runner"} : std::vector<std::string>{};
  const std::vector<std::string> start =
      to == nullptr ? std::vector<std::string>{} : std::vector<std::string>{to};
  if (run.by_ == By::kOwner) {
    run.owner.here = false;
  } else if (!controlled && to == nullptr && run.moves_by_position()) {
    ASSERT_TRUE(run.cycle->services().move_joint("shoulder", {}, test::kNow));
  } else if (!controlled && to == nullptr) {
    ASSERT_TRUE(run.cycle->services().set_joint("shoulder", {.mode = 1}, test::kNow));
  } else {
    ASSERT_TRUE(run.cycle->services().switch_controllers(stop, start, test::kNow));
  }
}

const Change kChanges[] = {
    {"released", [](MovingRun& run) { switched(run, nullptr); }, 0.0, 0.0, Change::kAny},
    {"to one that keeps it", [](MovingRun& run) { switched(run, "keeper"); }, 0.0, 0.0},
    {"to one elsewhere", [](MovingRun& run) { switched(run, "elsewhere"); }, -1.0, 0.0},
    {"to one that moves", [](MovingRun& run) { switched(run, "opposite"); }, -1.0, -0.5},
    {"to one that moves at once", [](MovingRun& run) { switched(run, "at_once"); }, -1.5, NAN},
    {"it ends", [](MovingRun& run) { run.runner->ends = true; }, 0.0, 0.0, Change::kControllers},
    {"stop of category hold", [](MovingRun& run) { run.backend.faulted_joint = 1; }, 0.0, 0.0,
     Change::kAny},
    {"the others retreat",
     [](MovingRun& run) { run.cycle->inbox().emergency_stop(hal::StopCategory::kCategory2); }, 0.0,
     0.0, Change::kControllers},
    {"an owner comes, at rest", owner_comes, -1.0, 0.0},
    {"the owner is lost", owner_is_lost, 0.0, 0.0, Change::kOwners},
};

TEST(ChangeOfHands, BrakesAJointThatMovesWhateverItDidAndWhateverHappens) {
  const char* const names[] = {"controller",  "controller without velocities",
                               "operator",    "velocity mode",
                               "torque mode", "owner"};
  for (const By by : {By::kController, By::kSilentController, By::kOperator, By::kVelocityMode,
                      By::kTorqueMode, By::kOwner}) {
    for (const Change& change : kChanges) {
      if (!change.happens_to(by)) continue;
      SCOPED_TRACE(std::string(names[static_cast<int>(by)]) + ", " + change.name);
      MovingRun run(by);
      change.make(run);
      double speed = kSpeed_rad_s, lowest = kSpeed_rad_s, hardest = 0.0, apart = 0.0;
      for (int i = 0; i < 2000; ++i) {
        const double said = run.cycle->command().velocity_rad_s()[0];
        run.steps(1);
        const double now = i == 0 && !run.moves_by_position() ? run.departs_at() : run.speed();
        hardest = std::max(hardest, std::abs(now - speed) * 1e3);
        if (i > 1) apart = std::max(apart, std::abs((speed + now) / 2.0 - said));
        lowest = std::min(lowest, now);
        speed = now;
      }
      std::printf("%-30s %-26s hardest %5.1f rad/s2, apart %.4f, lowest %.3f, last %.3f rad/s\n",
                  names[static_cast<int>(by)], change.name, hardest, apart, lowest, speed);
      EXPECT_LE(hardest, kMostAcceleration_rad_s2 * 1.001);
      EXPECT_GE(lowest, change.lowest_rad_s - 1e-3);
      if (!std::isnan(change.end_rad_s)) {
        EXPECT_NEAR(speed, change.end_rad_s, 1e-6);
      }
      // One that says nothing of its speed keeps that: nothing is made up for it.
      const bool silent = by == By::kSilentController;
      const bool silent_then = std::isnan(change.end_rad_s);
      EXPECT_LE(apart, silent_then ? 1.26 : silent ? kSpeed_rad_s : 0.02);
    }
  }
}

/// What is in the delay when the run stops is not sent any more.
TEST(ChangeOfHands, AStopBrakesFromWhatWasSentWhateverTheDelay) {
  MovingRun run(By::kController, 20);
  run.backend.faulted_joint = 1;
  double speed = kSpeed_rad_s, lowest = kSpeed_rad_s, hardest = 0.0;
  for (int i = 0; i < 1000; ++i) {
    run.steps(1);
    hardest = std::max(hardest, std::abs(run.speed() - speed) * 1e3);
    speed = run.speed();
    lowest = std::min(lowest, speed);
    if (i == 0) {
      EXPECT_NEAR(speed, kSpeed_rad_s, 1e-6) << "it goes on as it did";
    }
  }
  EXPECT_LE(hardest, kMostAcceleration_rad_s2 * 1.001);
  EXPECT_GE(lowest, -1e-3);
  EXPECT_NEAR(speed, 0.0, 1e-6);
}

}  // namespace
}  // namespace tandem::runtime
