// Faults in every mode of operation, and every stop category.
#include "tests/runtime/fault_row.hpp"

namespace tandem::runtime {
namespace {

using namespace test;
using sim::ScenarioFault;

/// Every mode of operation is watched alike.
struct ModeCase {
  const char* name;
  hal::ControlMode mode;
  hal::InteractionMode interaction;
  std::int8_t on_wire;
};

class EveryMode : public testing::TestWithParam<ModeCase> {};

TEST_P(EveryMode, BoardsReachTheirSafeStateWithoutCommandsSyncOrHeartbeat) {
  for (const bool with_sync : {false, true}) {
    hal::RobotConfig config = tandem::test::swing_robot();
    auto made = std::make_unique<test::FaultRobot>(config, tandem::test::swing_kernels(2),
                                                   sim::SimRobotConfig{.posture = "up"});
    hal::StateImage state(config.shape());
    hal::CommandImage command(config.shape());
    const hal::ParameterImage parameters = hal::initial_parameters(config);
    hal::CycleTime time;
    for (; time.cycle < 2500; ++time.cycle) {
      time.time_ns = static_cast<std::int64_t>(time.cycle) * 1'000'000;
      (void)made->read(time, state);
      command.mode()[0] = static_cast<std::int8_t>(GetParam().mode);
      command.interaction()[0] = static_cast<std::uint8_t>(GetParam().interaction);
      command.position_rad()[0] = state.position_rad()[0];
      if (GetParam().mode == hal::ControlMode::kOpenLoop) command.voltage_V()[0] = 1.0;
      if (GetParam().mode == hal::ControlMode::kCurrent) command.current_A()[0] = 1.0;
      (void)made->write(command, parameters);
    }
    const firmware::Axis& axis = made->emulated->board(0).axis(0);
    ASSERT_EQ(axis.objects().mode_display, GetParam().on_wire);
    ASSERT_EQ(axis.machine().motion(), DriveMotion::kFollow) << made->status_text();
    ScenarioFault silent =
        of(FaultKind::kFrameDrop);  // all of the master's frames, SYNC perhaps not
    silent.direction = sim::FrameDirection::kToBoards;
    if (with_sync) silent.node_id = 1;
    ASSERT_EQ(made->emulated->inject(silent), Code::kOk);
    int noticed = -1, open = -1;
    for (int i = 1; i < 3000 && open < 0; ++i, ++time.cycle) {
      time.time_ns = static_cast<std::int64_t>(time.cycle) * 1'000'000;
      (void)made->read(time, state);
      (void)made->write(command, parameters);
      if (noticed < 0 && axis.objects().error_code != 0) {
        noticed = i;
        EXPECT_EQ(axis.machine().motion(), DriveMotion::kShorted) << "safe in the same cycle";
      }
      const sim::JointReading joint = made->emulated->plant().joint(0);
      if (noticed >= 0 && joint.current_A == 0.0 && joint.voltage_V == 0.0) open = i;
    }
    EXPECT_EQ(axis.objects().error_code, with_sync ? 0xFF01 : 0x8700);
    EXPECT_EQ(noticed, with_sync ? 11 : 12);
    EXPECT_GE(open, noticed);
    EXPECT_LE(open, noticed + kLongestStop);
  }
}

INSTANTIATE_TEST_SUITE_P(
    ScenarioFault, EveryMode,
    testing::Values(
        ModeCase{"csp", hal::ControlMode::kPosition, hal::InteractionMode::kStiff, 8},
        ModeCase{"csv", hal::ControlMode::kVelocity, hal::InteractionMode::kStiff, 9},
        ModeCase{"cst", hal::ControlMode::kTorque, hal::InteractionMode::kStiff, 10},
        ModeCase{"impedance", hal::ControlMode::kPosition, hal::InteractionMode::kCompliant, -1},
        ModeCase{"open_loop", hal::ControlMode::kOpenLoop, hal::InteractionMode::kStiff, -2},
        ModeCase{"current", hal::ControlMode::kCurrent, hal::InteractionMode::kStiff, -3},
        ModeCase{"velocity_impedance", hal::ControlMode::kVelocity,
                 hal::InteractionMode::kCompliant, -4}),
    [](const auto& one) { return std::string(one.param.name); });

// --- other categories ---

class Category : public testing::TestWithParam<hal::StopCategory> {};

TEST_P(Category, IsWhatTheOtherJointsDoWhenABoardDies) {
  RowRig rig("ur5e", {}, GetParam());
  rig.run();
  rig.inject(of(FaultKind::kBoardKill));
  for (int i = 0; i < 40; ++i) rig.step();
  const DriveMotion others = rig.axis(1).machine().motion();
  switch (GetParam()) {
    case hal::StopCategory::kCategory0: EXPECT_EQ(others, DriveMotion::kNone); break;
    case hal::StopCategory::kCategory1:
    case hal::StopCategory::kCategory2:  // the sine cannot retreat
      EXPECT_NE(others, DriveMotion::kFollow);
      break;
    case hal::StopCategory::kHold:
      EXPECT_EQ(others, DriveMotion::kFollow);
      EXPECT_EQ(rig.backend->phase(), hal::Phase::kFault);
      break;
    case hal::StopCategory::kWarn:
      EXPECT_EQ(others, DriveMotion::kFollow);
      EXPECT_EQ(rig.backend->phase(), hal::Phase::kOperational);
      break;
  }
  EXPECT_FALSE(rig.cycle->faults().empty()) << "told in every category";
}

INSTANTIATE_TEST_SUITE_P(Fault, Category,
                         testing::Values(hal::StopCategory::kCategory0,
                                         hal::StopCategory::kCategory1,
                                         hal::StopCategory::kCategory2, hal::StopCategory::kHold,
                                         hal::StopCategory::kWarn),
                         [](const auto& one) { return "category" + std::to_string(one.index); });

}  // namespace
}  // namespace tandem::runtime
