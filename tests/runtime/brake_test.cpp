// An arm with motor brakes: what docs/safety.md and docs/faults.md say of it.
#include <cmath>

#include "tests/runtime/fault_row.hpp"

namespace tandem::runtime {
namespace {

using namespace test;

constexpr double kHeld_rad = 0.01;  // what docs/safety.md says

/// The UR5e with a brake on every joint; without torque_Nm with none.
struct BrakedArm : private LoadedRobot, FaultRig {
  explicit BrakedArm(double share_of_torque, int release_ms = 50, int engage_ms = 20)
      : LoadedRobot("ur5e"),
        FaultRig(with(loaded.robot, share_of_torque, release_ms, engage_ms), loaded.kernels.get(),
                 "ready") {}
  static hal::RobotConfig with(hal::RobotConfig config, double share, int release_ms,
                               int engage_ms) {
    for (hal::JointConfig& joint : config.joints) {
      if (!(share > 0.0)) continue;
      joint.brake = hal::BrakeConfig{.torque_Nm = share * joint.max_torque_Nm,
                                     .release_ms = release_ms,
                                     .engage_ms = engage_ms};
    }
    return config;
  }
  [[nodiscard]] double at(std::size_t joint) const {
    return backend->emulated->plant().joint(joint).position_rad;
  }
  /// By how much the joints that were held have moved at most, 3 s from now.
  double held_joints_move() {
    std::vector<double> from;
    for (std::size_t j = 0; j < 6; ++j) from.push_back(at(j));
    double most = 0.0;
    for (int i = 0; i < 3000; ++i) {
      step();
      for (std::size_t j = 1; j < 6; ++j) most = std::max(most, std::abs(at(j) - from[j]));
    }
    return most;
  }
  void stop(hal::StopCategory category) { cycle->inbox().emergency_stop(category); }
};

TEST(Brakes, HoldAnArmAfterCategory0ThatSinksWithoutThem) {
  BrakedArm with(1.0);
  with.run();
  with.stop(hal::StopCategory::kCategory0);
  EXPECT_LT(with.held_joints_move(), kHeld_rad);
  EXPECT_TRUE(with.powerless());

  BrakedArm without(0.0);
  without.run();
  without.stop(hal::StopCategory::kCategory0);
  EXPECT_GT(without.held_joints_move(), 0.1);
}

TEST(Brakes, HoldAnArmAfterCategory1AndLetItGoOnAfterAReset) {
  BrakedArm rig(1.0);
  rig.run();
  rig.stop(hal::StopCategory::kCategory1);
  EXPECT_LT(rig.held_joints_move(), kHeld_rad);
  EXPECT_TRUE(rig.powerless());
  for (std::size_t j = 0; j < 6; ++j) EXPECT_TRUE(rig.backend->emulated->plant().brake_closed(j));
}

TEST(Brakes, HoldTheJointsOfABoardThatLosesItsPower) {
  BrakedArm rig(1.0);
  rig.run();
  rig.inject(of(FaultKind::kBoardKill));
  EXPECT_LT(rig.held_joints_move(), kHeld_rad);
  EXPECT_TRUE(rig.backend->emulated->plant().brake_closed(1));
}

TEST(Brakes, StopAJointThatAFaultDisablesInMotion) {
  BrakedArm rig(1.0);
  rig.run();
  ASSERT_GT(std::abs(rig.backend->emulated->plant().joint(0).velocity_rad_s), 0.3) << "it moves";
  const double from = rig.at(0);
  rig.inject(of(FaultKind::kEncoderUnplug));
  EXPECT_LT(rig.held_joints_move(), kHeld_rad);
  EXPECT_TRUE(rig.powerless());
  EXPECT_LT(std::abs(rig.at(0) - from), 0.1);
  EXPECT_LT(std::abs(rig.backend->emulated->plant().joint(0).velocity_rad_s), 1.0e-6);
}

TEST(Brakes, SlipUnderMoreThanTheyHold) {
  BrakedArm rig(0.02);  // 3 Nm on a shoulder
  rig.run();
  rig.stop(hal::StopCategory::kCategory0);
  EXPECT_GT(rig.held_joints_move(), 0.05);
}

TEST(Brakes, AreOpenToTheCycleWhenOperationIsEnabled) {
  BrakedArm rig(1.0, 40, 20);
  const sim::Plant& plant = rig.backend->emulated->plant();
  int powered = 0;
  while (rig.axis(0).machine().state() != canopen::DriveMachineState::kOperationEnabled) {
    ASSERT_TRUE(rig.cycle->step());
    if (rig.axis(0).machine().motion() == DriveMotion::kSlowDown) ++powered;
    if (powered > 0 && powered < 40) {
      EXPECT_TRUE(plant.brake_closed(0)) << powered;
    }
  }
  EXPECT_EQ(powered, 40) << "cycles in which bridge and brake hold";
  EXPECT_FALSE(plant.brake_closed(0));
  EXPECT_EQ(rig.axis(0).objects().digital_outputs, 0U);
}

}  // namespace
}  // namespace tandem::runtime
