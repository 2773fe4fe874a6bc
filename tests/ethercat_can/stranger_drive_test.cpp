// Our master at a drive that is not ours: npm canopen's device, in a process of its own.
#include <filesystem>
#include <thread>

#include "canopen/data_sheet.hpp"
#include "tests/ethercat_can/rig.hpp"
#include "tests/support/node.hpp"
#include "tests/support/script.hpp"

namespace tandem::hal::can {
namespace {

using tandem::test::kNode;

const std::string kFolder = TANDEM_SOURCE_DIR "/tests/firmware_emu";
const std::string kSheet = TANDEM_SOURCE_DIR "/config/drives/servo.eds";
constexpr int kNodeId = 5;

RobotConfig one_joint() {
  RobotConfig robot = test::classic_config();
  robot.sensors.clear();
  robot.joints.resize(1);
  robot.boards.resize(1);
  robot.boards[0].node_id = kNodeId;
  robot.boards[0].eds = kSheet;
  auto sheet = canopen::load_data_sheet(kSheet);
  EXPECT_TRUE(sheet.has_value()) << sheet.error().to_string();
  robot.boards[0].sheet = std::make_shared<const canopen::DataSheet>(std::move(*sheet));
  return robot;
}

/// The master's cycles, none faster than a millisecond: the drive's heartbeat has a real clock.
struct Encounter {
  Encounter()
      : script({kNode, kFolder + "/answer_master.mjs", kSheet, std::to_string(kNodeId)}),
        state(robot.shape()),
        command(robot.shape()),
        parameters(initial_parameters(robot)) {
    const std::array<Bus*, 2> ends{&bus.master(), &other.master()};
    auto created = DriveMaster::create(robot, ends);
    EXPECT_TRUE(created.has_value()) << created.error().to_string();
    master = std::move(*created);
    command.mode()[0] = static_cast<std::int8_t>(ControlMode::kPosition);
  }
  void step() {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    master->cycle_begin({.cycle = cycle, .time_ns = static_cast<std::int64_t>(cycle) * 1'000'000});
    ++cycle;
    for (const canopen::Frame& frame : bus.to_boards()) script.tell(frame);
    bus.take_to_boards(bus.to_boards().size());
    script.say(".");
    for (std::string line = script.line(); !line.empty() && line[0] != '.'; line = script.line()) {
      const canopen::Frame frame = tandem::test::frame_of(line);
      heartbeats += frame.id == 0x700 + kNodeId && frame.data[0] != 0 ? 1 : 0;
      (void)bus.boards().send({&frame, 1});
    }
    (void)master->receive(state);
    (void)master->send(command, parameters);
  }

  RobotConfig robot = one_joint();
  tandem::test::Script script;
  LoopbackBus bus, other;
  StateImage state;
  CommandImage command;
  ParameterImage parameters;
  std::unique_ptr<DriveMaster> master;
  std::uint64_t cycle = 0;
  int heartbeats = 0;
};

TEST(StrangerDrive, IsConfiguredEnabledAndMovedByItsSheet) {
  if (kNode == nullptr) GTEST_SKIP() << "node is not installed";
  if (!std::filesystem::exists(kFolder + "/node_modules/canopen")) {
    GTEST_SKIP() << "canopen is not installed (run `npm ci` in tests/firmware_emu)";
  }
  Encounter meets;
  for (int i = 0; i < 3000 && meets.master->phase() == Phase::kBringUp; ++i) meets.step();
  ASSERT_EQ(meets.master->phase(), Phase::kOperational) << meets.master->status_text();
  EXPECT_EQ(static_cast<DriveState>(meets.state.drive_state()[0]), DriveState::kOperationEnabled);
  const double target = meets.state.position_rad()[0] + 0.1;
  meets.command.position_rad()[0] = target;
  for (int i = 0; i < 200; ++i) meets.step();
  EXPECT_NEAR(meets.state.position_rad()[0], target, 1e-3);
  EXPECT_EQ(meets.state.age_cycles()[0], 0U);
  EXPECT_GE(meets.heartbeats, 2) << "of 50 ms, by 1017";
  EXPECT_EQ(meets.master->phase(), Phase::kOperational) << meets.master->status_text();
  for (int i = 0; i < 100 && !meets.master->shut_down(); ++i) meets.step();
  EXPECT_NE(static_cast<DriveState>(meets.state.drive_state()[0]), DriveState::kOperationEnabled);
}

}  // namespace
}  // namespace tandem::hal::can
