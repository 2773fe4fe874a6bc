// The rows of docs/faults.md about collisions: an arm that reaches, and COMAN in its squat.
#include "tests/runtime/estimated_run.hpp"
#include "tests/runtime/fault_row.hpp"

namespace tandem::runtime {
namespace {

using namespace test;

/// A push from 3 s after the drives are enabled, and how the run reacts.
struct PushedRun : EstimatedRun {
  PushedRun(const char* robot, const char* file, const char* joint, std::array<double, 3> force_N,
            double for_s, hal::StopCategory reaction)
      : EstimatedRun(robot, file, options(robot, reaction)) {
    const auto push = push_on(experiment->robot, joint, force_N, 3.0, for_s);
    EXPECT_EQ(backend->robot().inject(push), Code::kOk);
  }
  static Options options(const std::string& robot, hal::StopCategory reaction) {
    estimation::EstimationConfig config = for_legs();
    if (robot != "coman") config.base.reset();
    config.collision.emplace();
    config.collision->reaction = reaction;
    return {.noise = false,
            .estimation = config,
            .change =
                [](Experiment& e) {
                  for (const hal::JointConfig& one : e.robot.joints)
                    e.estimation.collision->thresholds.push_back({one.name, 1.0});
                },
            .on_fault = "wait"};
  }
  Outcome watch() {
    run_to(RunPhase::kRunning);
    run_to_fault();
    EXPECT_TRUE(cycle->faults().empty()) << cycle->faults()[0].text;
    Outcome found;
    for (int i = 1; i <= 4000 && found.open < 0; ++i) {
      if (found.noticed < 0 && !cycle->faults().empty()) found.noticed = i;
      if (found.safe < 0 && backend->robot().safe()) found.safe = i;
      if (found.safe >= 0 && backend->robot().powerless()) found.open = i;
      cycle->step();
    }
    return found;
  }
};

TEST(FaultRow, CollisionWarns) {
  PushedRun run("ur5e", "trajectory", "elbow_joint", {0.0, 50.0, -50.0}, 5.0,
                hal::StopCategory::kWarn);
  expect_row(run.watch());
  EXPECT_EQ(run.cycle->phase(), RunPhase::kRunning) << "the robot goes on";
  EXPECT_NE(run.cycle->faults()[0].text.find("collision: an external torque of"),
            std::string::npos);
  EXPECT_FALSE(run.cycle->faults()[0].joint.empty());
}

TEST(FaultRow, CollisionHolds) {
  PushedRun run("ur5e", "trajectory", "elbow_joint", {0.0, 50.0, -50.0}, 5.0,
                hal::StopCategory::kHold);
  expect_row(run.watch());
  EXPECT_EQ(run.cycle->phase(), RunPhase::kFaulted);
}

TEST(FaultRow, CollisionTakesTheTorqueAway) {
  PushedRun run("ur5e", "trajectory", "elbow_joint", {0.0, 50.0, -50.0}, 5.0,
                hal::StopCategory::kCategory0);
  expect_row(run.watch());
}

TEST(FaultRow, CollisionOfComanRetracts) {
  PushedRun run("coman", "squat", "LElbj", {30.0, 0.0, -40.0}, 0.1, hal::StopCategory::kCategory2);
  expect_row(run.watch());
  for (const runtime::FaultReport& fault : run.cycle->faults())
    EXPECT_NE(fault.text.find("collision"), std::string::npos) << fault.text << ": it did not fall";
}

// After a reset an operator may move a joint: what it meets then is a collision, too. What touches
// a robot that is merely held is none.
TEST(CollisionInAnOperatorsMove, StopsTheRobot) {
  PushedRun run("ur5e", "trajectory", "elbow_joint", {0.0, 50.0, -50.0}, 0.2,
                hal::StopCategory::kHold);
  const hal::RobotConfig& robot = run.experiment->robot;
  const double moving_s = 8.0, resting_s = 6.0;
  for (const double at_s : {resting_s, moving_s}) {
    const auto push = push_on(robot, "elbow_joint", {0.0, 50.0, -50.0}, at_s, 0.2);
    ASSERT_EQ(run.backend->robot().inject(push), Code::kOk);
  }
  run.run_to(RunPhase::kFaulted);
  for (int i = 0; i < 500; ++i) run.cycle->step();
  run.cycle->inbox().reset_faults();
  run.run_to(RunPhase::kHeld);
  const std::size_t before = run.cycle->faults().size();
  while (run.backend->robot().faults()[1].active == 0) run.cycle->step();
  for (int i = 0; i < 1000; ++i) run.cycle->step();
  EXPECT_EQ(run.cycle->phase(), RunPhase::kHeld) << "somebody touches it";
  EXPECT_EQ(run.cycle->faults().size(), before);
  ASSERT_TRUE(run.cycle->services().move_joint("elbow_joint",
                                               {.target_rad = 0.5, .speed_rad_s = 0.1}, kNow));
  int cycles = 0;
  while (run.backend->robot().faults()[2].active == 0) run.cycle->step();
  while (run.cycle->phase() == RunPhase::kHeld && ++cycles < 200) run.cycle->step();
  EXPECT_EQ(run.cycle->phase(), RunPhase::kFaulted);
  EXPECT_LE(cycles, 10);
  ASSERT_GT(run.cycle->faults().size(), before);
  EXPECT_NE(run.cycle->faults().back().text.find("collision"), std::string::npos);
}

}  // namespace
}  // namespace tandem::runtime
