// trajectory_follower: where a trajectory begins, when it ends and how, and how joints come to
// rest. The harness' joints are where they were commanded to be; a test moves them from there.
#include <cmath>
#include <limits>

#include "controllers/trajectory_outcome.hpp"
#include "tests/controllers/harness.hpp"
#include "tests/hal/fake_backend.hpp"

namespace tandem {
namespace {

using Outcome = TrajectoryOutcome;

struct Point {
  double time_s;
  std::vector<double> position_rad;
  std::vector<double> velocity_rad_s = {};
};

class Following : public test::Harness {
 public:
  explicit Following(const std::string& parameters = "")
      : test::Harness(fake_robot(), "trajectory_follower", parameters) {
    EXPECT_EQ(problem(), "");
    EXPECT_TRUE(setup.io->signals.close());
    start();
  }
  [[nodiscard]] InputBlock& block() { return setup.io->inputs.all.front(); }

  /// It arrives in the next cycle.
  void give(const std::vector<Point>& points, const TrajectoryTerms& terms = {},
            const std::vector<JointTerms>& joints = {}) {
    InputBlock& to = block();
    std::ranges::fill(to.value, 0.0);
    to.value[0] = static_cast<double>(points.size());
    auto at = to.value.begin() + 2;
    for (const Point& point : points) {
      if (!point.velocity_rad_s.empty()) to.value[1] = 1.0;
      *at++ = point.time_s;
      at = std::ranges::copy(point.position_rad, at).out;
      std::ranges::copy(point.velocity_rad_s, at);
      at += 3;
    }
    at = to.value.begin() + static_cast<std::ptrdiff_t>(to.terms_at());
    *at++ = terms.start_s;
    *at++ = terms.goal_time_s;
    for (const JointTerms& one : joints) {
      for (const double value :
           {one.stays, one.path_rad, one.path_rad_s, one.goal_rad, one.goal_rad_s}) {
        *at++ = value;
      }
    }
    to.arrived = true;
    to.cycle = time.cycle;
    ++to.sequence;
  }
  void cycle() {
    ASSERT_EQ(step(), Code::kOk);
    block().arrived = false;
    setup.io->signals.publish(time.cycle, time.time_ns);
  }
  void cycles(int count) {
    for (int i = 0; i < count; ++i) cycle();
  }
  /// The same, while no reference jumps, in place or in speed.
  void smoothly(int count, double most_rad_s2) {
    for (int i = 0; i < count; ++i) {
      const std::vector<double> place(command.position_rad().begin(), command.position_rad().end());
      const std::vector<double> speed(command.velocity_rad_s().begin(),
                                      command.velocity_rad_s().end());
      cycle();
      for (std::size_t j = 0; j < place.size(); ++j) {
        const double now = command.velocity_rad_s()[j];
        ASSERT_LE(std::abs(now - speed[j]), most_rad_s2 * 1e-3 + 1e-9) << "cycle " << i;
        ASSERT_NEAR(command.position_rad()[j] - place[j], 0.5e-3 * (now + speed[j]), 1e-5)
            << "cycle " << i;
      }
    }
  }
  [[nodiscard]] double told(const char* name) const {
    const auto signals = setup.io->signals.declared();
    const auto its = std::ranges::find(signals, name, &hal::SignalInfo::name);
    return setup.io->signals.look().values.at(its->first);
  }
  [[nodiscard]] Outcome outcome() const {
    return static_cast<Outcome>(told(TrajectorySignals::kOutcome));
  }

 private:
  static hal::RobotConfig fake_robot() {
    hal::RobotConfig robot = hal::test::fake_robot();
    for (auto& joint : robot.joints) joint.max_acceleration_rad_s2 = 4.0;
    return robot;
  }
};

const std::vector<Point> kFar{{1.0, {0.8, -0.8, 0.0}}};

TEST(TrajectoryFollower, GoesOverFromTheReferenceInMotion) {
  Following run;
  run.give(kFar);
  run.cycles(400);
  EXPECT_GT(run.command.velocity_rad_s()[0], 0.5);
  run.give({{0.0, {0.1, 0.1, 0.1}}, {1.0, {-0.5, 0.5, 0.5}}});  // a planner's first point is where
  run.smoothly(1001, 20.0);                                     // it saw the joint
  EXPECT_EQ(run.command.position_rad()[0], -0.5);
  run.cycle();
  EXPECT_EQ(run.outcome(), Outcome::kReached);
  run.smoothly(100, 0.0);
}

TEST(TrajectoryFollower, WithoutWayPointsComesToRestWithinTheJointsAcceleration) {
  Following run;
  run.give(kFar);
  run.cycles(500);
  const double speed = run.command.velocity_rad_s()[0], at = run.command.position_rad()[0];
  EXPECT_GT(speed, 1.0);
  run.give({});
  run.smoothly(1, 4.0);
  EXPECT_EQ(run.outcome(), Outcome::kUnderWay);
  EXPECT_EQ(run.told(TrajectorySignals::kCycle), 500.0);
  const int brakes = static_cast<int>(std::ceil(speed / 4.0 * 1e3));
  run.smoothly(brakes, 4.0);
  EXPECT_EQ(run.outcome(), Outcome::kHolds);
  EXPECT_EQ(run.command.velocity_rad_s()[0], 0.0);
  EXPECT_NEAR(run.command.position_rad()[0], at + speed * speed / 8.0, 2e-3);
  run.smoothly(100, 0.0);
}

TEST(TrajectoryFollower, RestsAtALimitThatItCannotStopBefore) {
  Following run;
  run.give({{1.0, {1.45, 0.0, 0.0}, {2.0, 0.0, 0.0}}});
  run.cycles(995);
  run.give({});
  run.cycles(500);
  EXPECT_EQ(run.command.position_rad()[0], 1.5);
  EXPECT_EQ(run.command.velocity_rad_s()[0], 0.0);
}

TEST(TrajectoryFollower, EndsWhereAJointLeavesItsPathTolerance) {
  for (const bool by_parameter : {true, false}) {
    Following run(by_parameter ? "path_tolerance_rad = [0.5, 0.1, 0]" : "");
    const JointTerms wide{.path_rad = 0.5}, narrow{.path_rad = 0.1};
    const std::vector<JointTerms> terms{wide, narrow, {}};
    run.give(kFar, {}, by_parameter ? std::vector<JointTerms>{} : terms);
    run.cycles(300);
    ASSERT_EQ(run.outcome(), Outcome::kUnderWay);
    run.state.position_rad()[0] += 0.4;
    run.state.position_rad()[1] += 0.09;
    run.state.position_rad()[2] += 5.0;
    run.cycle();
    ASSERT_EQ(run.outcome(), Outcome::kUnderWay) << "each has its own, and the third none";
    run.state.position_rad()[1] += 0.12;
    run.smoothly(1, 4.0);
    EXPECT_EQ(run.outcome(), Outcome::kOffPath);
    EXPECT_EQ(run.told(TrajectorySignals::kJoint), 1.0);
    EXPECT_NEAR(run.told(TrajectorySignals::kError), 0.12, 1e-9);
    EXPECT_EQ(run.told(TrajectorySignals::kTolerance), 0.1);
    EXPECT_EQ(run.told(TrajectorySignals::kOfVelocity), 0.0);
    EXPECT_NEAR(run.told(TrajectorySignals::kTime), 0.301, 1e-6);
    run.smoothly(1000, 4.0);
    EXPECT_EQ(run.command.velocity_rad_s()[0], 0.0);
    EXPECT_EQ(run.outcome(), Outcome::kOffPath) << "the outcome stays until the next trajectory";
    const auto said = run.setup.io->texts.take(1.0);
    ASSERT_EQ(said.size(), 1U);
    EXPECT_NE(said.front().words().find("elbow left the path by 0.12 rad"), std::string::npos)
        << said.front().words();
  }
}

TEST(TrajectoryFollower, ATrajectoryTakesAwayAToleranceOfTheParameters) {
  Following run("path_tolerance_rad = 0.1");
  const JointTerms none{.path_rad = -1.0};
  run.give(kFar, {}, {none, none, none});
  run.cycles(300);
  run.state.position_rad()[1] += 0.9;
  run.cycle();
  EXPECT_EQ(run.outcome(), Outcome::kUnderWay);
}

TEST(TrajectoryFollower, JudgesVelocitiesAndWhatIsNotFinite) {
  Following run;
  run.give(kFar, {}, {{.path_rad_s = 0.2}, {}, {}});
  run.state.velocity_rad_s()[0] = 0.1;
  run.cycle();
  ASSERT_EQ(run.outcome(), Outcome::kUnderWay);
  run.state.velocity_rad_s()[0] = 0.4;
  run.cycle();
  EXPECT_EQ(run.outcome(), Outcome::kOffPath);
  EXPECT_EQ(run.told(TrajectorySignals::kOfVelocity), 1.0);
  run.state.velocity_rad_s()[0] = 0.0;
  run.give(kFar, {}, {{.path_rad = 0.2}, {}, {}});
  run.state.position_rad()[0] = std::numeric_limits<double>::quiet_NaN();
  run.cycle();
  EXPECT_EQ(run.outcome(), Outcome::kOffPath);
}

TEST(TrajectoryFollower, WaitsForTheGoalAsLongAsItsTime) {
  Following run("goal_tolerance_rad = 0.01");
  run.give(kFar, {.goal_time_s = 0.5});
  const auto aside = [&run] {
    run.state.position_rad()[1] = -0.7;
    run.cycle();
  };
  for (int i = 0; i < 1499; ++i) {
    aside();
    ASSERT_EQ(run.outcome(), Outcome::kUnderWay) << i;
  }
  for (int i = 0; i < 3; ++i) aside();
  EXPECT_EQ(run.outcome(), Outcome::kOffGoal);
  EXPECT_EQ(run.told(TrajectorySignals::kJoint), 1.0);
  EXPECT_NEAR(run.told(TrajectorySignals::kError), 0.1, 1e-9);
  run.smoothly(100, 0.0);
  EXPECT_EQ(run.command.position_rad()[1], -0.8);

  run.give({{0.5, {0.0, 0.0, 0.0}}});  // no time: for ever
  run.cycles(500);
  for (int i = 0; i < 3000; ++i) {
    run.state.position_rad()[2] = 0.02;
    run.cycle();
    ASSERT_EQ(run.outcome(), Outcome::kUnderWay);
  }
  run.cycle();
  EXPECT_EQ(run.outcome(), Outcome::kReached);
}

TEST(TrajectoryFollower, ReachesAGoalWhenTheJointsStand) {
  Following run;
  run.give(kFar);
  run.cycles(1000);
  run.state.velocity_rad_s()[2] = 0.02;
  run.cycles(100);
  EXPECT_EQ(run.outcome(), Outcome::kUnderWay);
  run.state.velocity_rad_s()[2] = 0.005;
  run.cycle();
  EXPECT_EQ(run.outcome(), Outcome::kReached);
}

TEST(TrajectoryFollower, LetsJointsStayThatATrajectoryDoesNotName) {
  Following run;
  run.give(kFar);
  run.cycles(500);
  const double elbow = run.command.position_rad()[1];
  const double speed = run.command.velocity_rad_s()[1];
  run.give({{1.0, {0.2, 0.0, 0.3}}}, {}, {{}, {.stays = 1.0}, {}});
  run.smoothly(1002, 10.0);
  EXPECT_EQ(run.outcome(), Outcome::kReached);
  EXPECT_EQ(run.command.position_rad()[0], 0.2);
  EXPECT_EQ(run.command.position_rad()[2], 0.3);
  EXPECT_NEAR(run.command.position_rad()[1], elbow - speed * speed / 8.0, 2e-3) << "it braked";
}

TEST(TrajectoryFollower, LeavesOutWayPointsWhoseTimeIsPast) {
  Following run;
  run.give({{0.2, {1.0, 1.0, 1.0}}, {0.4, {-1.0, 1.0, 1.0}}, {1.5, {0.3, 0.2, 0.1}}},
           {.start_s = -0.5});
  run.smoothly(1001, 4.0);
  EXPECT_EQ(run.command.position_rad()[0], 0.3) << "1 s after the arrival";
}

/// As joint_trajectory_controller does: the way to the first point has all the time until then.
TEST(TrajectoryFollower, GoesToTheFirstPointOfATrajectoryToCome) {
  Following run;
  run.give({{0.5, {0.6, 0.0, 0.0}}, {1.0, {0.3, 0.0, 0.0}}}, {.start_s = 1.5});
  run.smoothly(2001, 4.0);
  EXPECT_NEAR(run.command.position_rad()[0], 0.6, 1e-9);
  run.smoothly(500, 20.0);
  EXPECT_EQ(run.command.position_rad()[0], 0.3);
}

}  // namespace
}  // namespace tandem
