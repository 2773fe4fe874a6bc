// A drive of profile position and velocity alone, emulated behind the master on either wire: its
// joint follows, and every stop brings it to rest.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "canopen/data_sheet.hpp"
#include "tests/sim/swing_loop.hpp"

namespace tandem::sim {
namespace {

using hal::ControlMode;
using hal::StopCategory;
using tandem::test::SwingLoop;

constexpr double kAcceleration_rad_s2 = 20.0;

hal::RobotConfig with(hal::RobotConfig robot, const canopen::DataSheet& sheet) {
  robot.boards[0].eds = sheet.file;
  robot.boards[0].sheet = std::make_shared<const canopen::DataSheet>(sheet);
  hal::JointConfig& joint = robot.joints[0];
  joint.torque_noise_Nm = 0.0;
  joint.max_acceleration_rad_s2 = kAcceleration_rad_s2;
  joint.velocity_units_per_rev = 60.0 * 100.0;  // rpm of a motor with a gear of 100
  joint.acceleration_units_per_rev = 100.0;     // its revolutions per second and second
  return robot;
}

/// config/drives/miniature.eds on classic CAN.
hal::RobotConfig can_robot() {
  auto sheet =
      canopen::load_data_sheet(std::string(TANDEM_SOURCE_DIR) + "/config/drives/miniature.eds");
  EXPECT_TRUE(sheet.has_value()) << sheet.error().to_string();
  return with(tandem::test::classic_swing_robot(), sheet.value_or(canopen::DataSheet{}));
}

/// The same objects of an EtherCAT slave. Own text. source: ETG.2000
hal::RobotConfig line_robot() {
  const auto object = [](const char* index, const char* type, const char* access, const char* map,
                         const char* value = "0") {
    return std::string("<Object><Index>#x") + index + "</Index><Type>" + type +
           "</Type><Info><DefaultValue>" + value + "</DefaultValue></Info><Flags><Access>" +
           access + "</Access><PdoMapping>" + map + "</PdoMapping></Flags></Object>";
  };
  const auto entry = [](const char* index, const char* bits, const char* type) {
    return std::string("<Entry><Index>#x") + index + "</Index><BitLen>" + bits +
           "</BitLen><DataType>" + type + "</DataType></Entry>";
  };
  const std::string text =
      R"(<EtherCATInfo><Vendor><Id>#xFFF1</Id></Vendor><Descriptions><Devices><Device>
<Type ProductCode="#x21" RevisionNo="#x10000">P</Type><Name>Profile</Name>
<Profile><ProfileNo>402</ProfileNo><AddInfo>2</AddInfo><Dictionary><DataTypes /><Objects>)" +
      object("6060", "SINT", "rw", "R") + object("6081", "UDINT", "rw", "") +
      object("6083", "UDINT", "rw", "") + object("6084", "UDINT", "rw", "") +
      object("6502", "UDINT", "ro", "", "#x5") +
      "</Objects></Dictionary></Profile><Sm StartAddress=\"#x1800\">Outputs</Sm>" +
      "<RxPdo Sm=\"2\" Fixed=\"1\"><Index>#x1600</Index>" + entry("6040", "16", "UINT") +
      entry("6060", "8", "SINT") + entry("607A", "32", "DINT") + entry("60FF", "32", "DINT") +
      "</RxPdo><TxPdo Sm=\"3\" Fixed=\"1\"><Index>#x1A00</Index>" + entry("6041", "16", "UINT") +
      entry("6061", "8", "SINT") + entry("6064", "32", "DINT") + entry("606C", "32", "DINT") +
      "</TxPdo><Mailbox><CoE PdoAssign=\"1\"/></Mailbox><Dc><OpMode><Name>DC</Name>" +
      "<AssignActivate>#x300</AssignActivate></OpMode></Dc></Device></Devices></Descriptions>" +
      "</EtherCATInfo>";
  auto sheet = canopen::read_data_sheet(text, "profile.xml");
  EXPECT_TRUE(sheet.has_value()) << sheet.error().to_string();
  return with(tandem::test::line_swing_robot(), sheet.value_or(canopen::DataSheet{}));
}

struct Wire {
  const char* name;
  hal::RobotConfig (*robot)();
};

struct ProfileChain : ::testing::TestWithParam<Wire> {
  void SetUp() override { begin({.posture = "up"}); }
  void begin(SimRobotConfig config) {
    loop = std::make_unique<SwingLoop>(GetParam().robot(), std::move(config));
    loop->bring_up();
    loop->run(1500);  // the spring swings out
    start_rad = loop->state.position_rad()[0];
  }
  void ask(ControlMode mode) { loop->command.mode()[0] = static_cast<std::int8_t>(mode); }
  [[nodiscard]] double at_rad() const { return loop->state.position_rad()[0]; }
  [[nodiscard]] double speed_rad_s() const {
    return loop->sim_robot->plant().joint(0).velocity_rad_s;
  }
  void refer(double position_rad, double velocity_rad_s) {
    loop->command.position_rad()[0] = position_rad;
    loop->command.velocity_rad_s()[0] = velocity_rad_s;
    loop->step();
  }
  /// From rest with half of the acceleration that it may have. @return where the reference is
  double run_up(double speed_rad_s, int cycles) {
    double at = start_rad;
    double speed = 0.0;
    for (int i = 0; i < cycles; ++i) {
      speed = std::max(-speed_rad_s, speed - 0.5 * kAcceleration_rad_s2 * 1e-3);
      at += speed * 1e-3;
      refer(at, speed);
    }
    return at;
  }
  /// @return its fastest during the last 100 of so many cycles
  template <class Step>
  double fastest_after(int cycles, const Step& step) {
    double fastest = 0.0;
    for (int i = 0; i < cycles; ++i) {
      step();
      if (i >= cycles - 100) fastest = std::max(fastest, std::abs(speed_rad_s()));
    }
    return fastest;
  }

  std::unique_ptr<SwingLoop> loop;
  double start_rad = 0.0;
};

TEST_P(ProfileChain, FollowsATrajectory) {
  double worst = 0.0;
  double most = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const double t = 1e-3 * i;
    const double phase = 2.0 * t;
    const double at = start_rad - 0.25 * (1.0 - std::cos(phase));
    refer(at, -0.5 * std::sin(phase));
    worst = std::max(worst, std::abs(at_rad() - at));
    most = std::max(most, std::abs(at_rad() - start_rad));
  }
  EXPECT_GT(most, 0.45);
  // A set-point's handshake (5 ms at 0.5 rad/s) and what the firmware's position loop lags behind.
  EXPECT_LT(worst, 0.03);
  RecordProperty("worst_mrad", static_cast<int>(1e3 * worst));
  EXPECT_EQ(loop->sim_robot->phase(), hal::Phase::kOperational) << loop->sim_robot->status_text();
}

TEST_P(ProfileChain, HoldBringsItToRest) {
  (void)run_up(1.0, 500);
  EXPECT_LT(speed_rad_s(), -0.5);
  loop->sim_robot->stop(StopCategory::kHold);
  EXPECT_LT(fastest_after(1500, [&] { loop->step(); }), 0.02);
}

TEST_P(ProfileChain, QuickStopBringsItToRest) {
  (void)run_up(1.0, 500);
  loop->sim_robot->stop(StopCategory::kCategory1);
  bool was_off = false;
  for (int i = 0; i < 1000; ++i) {
    loop->step();
    const auto drive = static_cast<hal::DriveState>(loop->state.drive_state()[0]);
    was_off = was_off || drive != hal::DriveState::kOperationEnabled;
  }
  EXPECT_TRUE(was_off);
  EXPECT_NE(static_cast<hal::DriveState>(loop->state.drive_state()[0]),
            hal::DriveState::kOperationEnabled);
}

/// A cut cable stands for a dead controller: the drive gets no request to stop.
TEST_P(ProfileChain, ACutCableAndAnEmergencyStopBringItToRest) {
  for (const hal::FaultKind kind : {hal::FaultKind::kBusDown, hal::FaultKind::kEmergencyStop}) {
    for (const ControlMode mode : {ControlMode::kPosition, ControlMode::kVelocity}) {
      ScenarioFault fault{.start_ns = 1'900'000'000};
      fault.kind = kind;
      fault.from = FaultFrom::kEnabled;
      (kind == hal::FaultKind::kBusDown ? fault.bus : fault.board) = 0;
      begin({.posture = "up", .faults = {fault}});
      ask(mode);
      (void)run_up(1.0, 350);
      EXPECT_LT(speed_rad_s(), -0.5) << "before it";
      double furthest_rad = 0.0;
      int off_at = -1;
      for (int i = 0; i < 8000; ++i) {
        refer(std::max(-2.9, loop->command.position_rad()[0] - 1e-3), -1.0);
        const auto joint = loop->sim_robot->plant().joint(0);
        furthest_rad = std::min(furthest_rad, joint.position_rad - start_rad);
        if (off_at < 0 && loop->sim_robot->phase() == hal::Phase::kFault) off_at = i;
      }
      EXPECT_GE(off_at, 0) << static_cast<int>(kind) << static_cast<int>(mode);
      // Driven on it would be 8 rad away, or at the end of its range, 3.5 rad. The heartbeat is
      // missed after 150 ms; then the drive is disabled, and gravity draws the joint to 0.
      EXPECT_GT(furthest_rad, -0.9) << static_cast<int>(kind) << static_cast<int>(mode);
      EXPECT_LT(std::abs(loop->sim_robot->plant().joint(0).position_rad), 0.3);
      EXPECT_LT(std::abs(speed_rad_s()), 0.2) << static_cast<int>(kind) << static_cast<int>(mode);
    }
  }
}

TEST_P(ProfileChain, VelocityIsProfileVelocity) {
  ask(ControlMode::kVelocity);
  for (int i = 0; i < 400; ++i) refer(start_rad, -0.5);
  EXPECT_NEAR(loop->state.velocity_rad_s()[0], -0.5, 0.1);
  EXPECT_EQ(static_cast<ControlMode>(loop->state.mode()[0]), ControlMode::kVelocity);
  for (int i = 0; i < 500; ++i) refer(start_rad, 0.0);
  EXPECT_LT(std::abs(speed_rad_s()), 0.02);
}

INSTANTIATE_TEST_SUITE_P(Wires, ProfileChain,
                         ::testing::Values(Wire{"Can", can_robot}, Wire{"EtherCat", line_robot}),
                         [](const auto& wire) { return wire.param.name; });

}  // namespace
}  // namespace tandem::sim
