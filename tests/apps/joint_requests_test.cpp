// `tandem joint` and `tandem sensor` against a running `tandem run`.
#include <cmath>

#include "tests/apps/controllers_run.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::apps {
namespace {

TEST_F(Controllers, JointsAreSetWhenNobodyHasThem) {
  begin("");
  expect(refused("joint set joint1 --mode velocity"),
         "joint1: is claimed by the controller 'hold', which sets its mode");
  EXPECT_EQ(to_run("controller stop hold").status, 0);
  const auto still = asked("joint set joint1 --mode velocity");
  EXPECT_EQ(still["mode"], "velocity");
  EXPECT_EQ(still["controller"], "");
  const auto soft =
      asked("joint set joint2 --mode position --interaction compliant --stiffness 2.5");
  EXPECT_EQ(soft["interaction"], "compliant");
  EXPECT_EQ(soft["stiffness_Nm_rad"], 2.5);
  expect(refused("joint set joint2 --stiffness 1e6"),
         "joint2: the stiffness 1e+06 Nm/rad is beyond");
  expect(refused("joint set joint2 --damping -1"), "joint2: the damping -1 Nms/rad is beyond");
  expect(refused("joint set jiont2 --mode idle"), "did you mean 'joint2'?");
  expect(refused("joint set joint2 --mode fast"), "cannot be 'fast'");
  expect(refused("joint set joint2"),
         "nothing is to be set (give mode, interaction, stiffness or damping)");
  expect(to_run("joint list joint1").out, "joint1           -  velocity");
  EXPECT_EQ(end(), 0);
}

TEST_F(Controllers, JointsAreMovedWhenNobodyHasThem) {
  begin("");
  expect(refused("joint move joint1 --to 30deg"), "joint1: is claimed by the controller 'hold'");
  EXPECT_EQ(to_run("controller stop hold").status, 0);
  expect(to_run("joint move joint1 --to 30deg --speed 200deg/s --acceleration 1000deg/s2").out,
         "joint1 moves from ");
  double position_rad = 0.0;
  EXPECT_TRUE(test::eventually([&] {
    position_rad = asked("joint list joint1")["joints"][0]["position_rad"];
    return std::abs(position_rad - 0.5236) < 0.02;
  })) << position_rad;
  EXPECT_EQ(to_run("joint move joint1 --to -1 --speed 0.01").status, 0) << "radians";
  EXPECT_EQ(to_run("joint stop joint1").status, 0);
  position_rad = asked("joint list joint1")["joints"][0]["position_rad"];
  EXPECT_NEAR(position_rad, 0.5236, 0.1) << "it had only just begun";
  expect(to_run("joint list joint1 --drives").out, "winding [degC]");
  expect(refused("joint move joint1 --to 400deg"),
         "joint1: the target 6.98132 rad (400 deg) is beyond");
  expect(refused("joint move joint1 --to 20mm"), "joint1: this joint turns");
  expect(refused("joint move joint1 --to 30deg --speed 1m/s"),
         "--speed: '1m/s' is of another kind");
  for (const char* words : {"--to 30°", "--to deg", "--to +", "--to +-1", "--to ++1",
                            "--to 30deg --speed 20deg", "--to 30deg/s"}) {
    expect(refused(std::string("joint move joint1 ") + words), "is no number with a unit");
  }
  for (const char* number : {"nan", "inf", "-inf", "1e999", "1e999deg"}) {
    expect(refused(std::string("joint move joint1 --to ") + number),
           "--to: '" + std::string(number) + "' is not finite");
  }
  for (const char* flag : {"--to", "--to 1 --speed", "--to 1 --acceleration"}) {
    const std::string name = std::string(flag).substr(std::string(flag).rfind('-') - 1);
    expect(refused(std::string("joint move joint1 ") + flag + " ''"), name + ": is empty");
  }
  EXPECT_EQ(to_run("joint move joint1 --to +0.5").status, 0);
  EXPECT_EQ(end(), 0);
}

/// What interrupts the waiting does not end the motion.
TEST_F(Controllers, JointsThatMoveAreWaitedFor) {
  begin("");
  EXPECT_EQ(to_run("controller stop hold").status, 0);
  const Outcome there = to_run("joint move joint1 --to 20deg --speed 100deg/s --wait");
  EXPECT_EQ(there.status, 0) << there.err;
  expect(there.out, "joint1 has arrived: 0.3");
  const auto slow = asked("joint move joint1 --to 30deg --speed 200deg/s --wait");
  EXPECT_EQ(slow["arrived"], true);
  EXPECT_EQ(slow["moving"], false);
  const std::string away = "joint move joint1 --to -300deg --speed 1deg/s --wait --socket ";
  const Outcome interrupted = tandem(away + socket_, "timeout --foreground -s INT 0.5");
  EXPECT_EQ(interrupted.status, 124);
  expect(interrupted.err,
         "joint1 still moves to -5.236 rad (-300 deg): `tandem joint stop joint1`");
  const auto goes_on = asked("joint list joint1")["joints"][0];
  EXPECT_EQ(goes_on["moving"], true);
  EXPECT_LT(goes_on["position_rad"].get<double>(), 0.52);
  EXPECT_EQ(to_run("joint stop joint1").status, 0);
  EXPECT_TRUE(
      test::eventually([&] { return asked("joint list joint1")["joints"][0]["moving"] == false; }));
  EXPECT_EQ(end(), 0);
}

TEST_F(Controllers, SensorsAndDrivesAreShown) {
  write_text(folder_ / "hold.toml",
             "robot = \"" TANDEM_SOURCE_DIR
             "/config/ur5e/robot.toml\"\nposture = \"ready\"\nduration_s = 5.0\nseed = 1\n"
             "[[controller]]\nplugin = \"hold\"\n");
  begin("--on-fault wait");
  const auto sensors = asked("sensor list")["sensors"];
  ASSERT_EQ(sensors.size(), 1U);
  EXPECT_EQ(sensors[0]["type"], "force_torque");
  EXPECT_EQ(sensors[0]["valid"], true);
  EXPECT_FALSE(sensors[0]["link"].get<std::string>().empty());
  EXPECT_EQ(sensors[0]["force_N"].size(), 3U);
  const std::string name = sensors[0]["sensor"];
  expect(to_run("sensor list").out, name);
  expect(refused("sensor list " + name + "x"), "did you mean '" + name + "'?");
  expect(to_run("joint show elbow_joint").out, "operation enabled");
  expect(to_run("joint reset elbow_joint").out, "elbow_joint: its drive has no fault");
  EXPECT_EQ(to_run("inject kind=encoder_unplug joint=elbow_joint for_s=2").status, 0);
  until(R"("phase": "faulted")");
  const auto drive = asked("joint show elbow_joint");
  EXPECT_EQ(drive["fault"], 0x7300);
  expect(drive["fault_text"], "position sensor (error code 0x7300)");
  Outcome reset;
  EXPECT_TRUE(test::eventually([&] {  // until the cause is gone
    reset = to_run("joint reset elbow_joint");
    return reset.status == 0;
  })) << reset.err;
  expect(reset.out, "elbow_joint: its fault is cleared, its drive stays disabled");
  EXPECT_EQ(asked("joint show elbow_joint")["fault"], 0);
  until(R"("phase": "faulted")");
  expect(refused("joint move elbow_joint --to 10deg"),
         "elbow_joint: nothing is moved while a fault is latched");
  EXPECT_EQ(to_run("fault reset").status, 0);
  EXPECT_EQ(end(), 0);
}

TEST_F(Controllers, GainsAreKeptAndShown) {
  begin("");
  const auto gains = asked("joint gains joint1 position --kp 7.5");
  EXPECT_EQ(gains["gains"]["position"]["kp"], 7.5);
  EXPECT_EQ(gains["gains"]["position"]["ki"], 12.0) << "what is not named stays";
  expect(to_run("joint list joint1 --gains").out, "joint1  position   7.5    12  0.25");
  expect(refused("joint gains joint1 position --kp -1"), "joint1: kp -1 is beyond");
  expect(refused("joint gains joint1 speed --kp 1"), "cannot be 'speed'");
  expect(refused("joint gains joint1 position"), "nothing is to be set (give kp, ki or kd)");
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::apps
