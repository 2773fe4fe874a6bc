// `tandem joint home` against a running `tandem run`, whose controller waits for it.
#include "tests/apps/running.hpp"

namespace tandem::apps {
namespace {

constexpr char kHomingLost[] = "method = 23, home_switch_rad = [50.0, 51.0]";

class HomedJoints : public Running {
 protected:
  /// joint1 is homed where it stands; joint2's home switch is where the joint never comes.
  void SetUp() override {
    Running::SetUp();
    const std::string homing =
        "homing = { method = 35, speed_rad_s = 0.5, acceleration_rad_s2 = 1.0, position_rad = 0.5 "
        "}\n";
    const std::string robot = read_text(folder_ / "robot.toml");
    const std::size_t from = robot.find("[[joint]]"), to = robot.find("[posture.ready]");
    std::string joint = robot.substr(from, to - from);
    const std::string both = "names = [\"joint1\", \"joint2\"]\n";
    joint.replace(joint.find(both), both.size(), "name = \"joint1\"\n" + homing);
    std::string other = joint;
    other.replace(other.find("joint1"), 6, "joint2");
    other.replace(other.find("method = 35"), 11, kHomingLost);
    other.replace(other.find("speed_rad_s = 0.5"), 17, "speed_rad_s = 5.0");
    other.replace(other.find("acceleration_rad_s2 = 1.0"), 25, "acceleration_rad_s2 = 50.0");
    other.replace(other.find("position_rad = 0.5"), 18, "required = false");
    write_text(folder_ / "robot.toml", robot.substr(0, from) + joint + other + robot.substr(to));
  }
  void expect(const Outcome& outcome, int status, const std::string& part) const {
    EXPECT_EQ(outcome.status, status) << outcome.out << outcome.err;
    EXPECT_NE((outcome.out + outcome.err).find(part), std::string::npos)
        << outcome.out << outcome.err;
  }
};

TEST_F(HomedJoints, AreHomedOnRequestAndItsControllersStartThen) {
  start("--rate 20 --duration 2000 --on-fault wait");
  until(R"("phase": "held")");
  expect(to_run("joint list joint1"), 0, "operation enabled, not homed");
  expect(to_run("joint move joint1 --to 0"), 2,
         "joint1: has to be homed first: its position is not known (tandem joint home joint1)");
  expect(to_run("controller start"), 2, "tandem joint home joint1");
  expect(to_run("joint home jiont1"), 2, "did you mean 'joint1'?");
  const Outcome failed = to_run("joint home joint2");
  expect(failed, 1,
         "joint2: the homing (method 23) failed: the drive reports a homing error (statusword bit "
         "13)");
  expect(failed, 1, "give homing.method a number that the drive has");
  expect(to_run("joint show joint2"), 0, "not homed: the drive reports a homing error");
  expect(to_run("joint home joint1"), 0, "joint1 is homed: it is at 0.");
  const auto shown = nlohmann::json::parse(to_run("joint show joint1 --json -").out);
  EXPECT_EQ(shown["homing"], "homed");
  EXPECT_EQ(shown["homing_error"], "");
  EXPECT_NEAR(shown["position_rad"].get<double>(), 0.5, 0.02);
  expect(to_run("controller start"), 0, "hold");
  until(R"("phase": "running")");
  expect(to_run("joint home joint1"), 2, "is claimed by the controller 'hold'");
  EXPECT_EQ(end(), 0);
}

TEST_F(HomedJoints, AreNotHomedOverALink) {
  const std::string plain = read_text(folder_ / "hold.toml");
  const std::size_t at = plain.find("[[controller]]");
  write_text(folder_ / "operated.toml",
             plain.substr(0, at) + "[teleoperation]\n" + "[teleoperation.up]\ndelay_s = 0.1\n" +
                 "[teleoperation.down]\ndelay_s = 0.1\n" + plain.substr(at));
  expect(tandem("run operated.toml --duration 1"), 2,
         "nothing is homed over the link, and joint1 has `homing`");
}

TEST_F(HomedJoints, ARunThatDoesNotWaitSaysWhichWasNotHomed) {
  const Outcome ran = tandem("run hold.toml --duration 1 --rate 2 --no-log");  // seen while held
  expect(ran, 1, "held until these are homed: joint1 (tandem joint home NAME");
  expect(ran, 1, "fault: 1.");
  expect(ran, 1, "joint1: it was not homed, for which the controllers waited");
  expect(ran, 1, "hint: with `--on-fault wait` a run stays after a stop");
}

TEST_F(HomedJoints, ARunHomesThoseThatAreDeclaredSo) {
  edit("robot.toml", "position_rad = 0.5 }", "position_rad = 0.5, at_start = true }");
  const Outcome ran = tandem("run hold.toml --duration 1 --no-log --json run.json");
  EXPECT_EQ(ran.status, 0) << ran.err;
  EXPECT_EQ(json("run.json")["fault_log"].size(), 0U);
}

TEST_F(HomedJoints, ARunThatCannotHomeOneEndsAtOnceAndSaysWhy) {
  edit("robot.toml", "method = 35, speed_rad_s = 0.5, acceleration_rad_s2 = 1.0",
       kHomingLost + std::string(", speed_rad_s = 5.0, acceleration_rad_s2 = 50.0"));
  edit("robot.toml", "position_rad = 0.5 }", "position_rad = 0.5, at_start = true }");
  const Outcome ran = tandem("run hold.toml --duration 50 --no-log --json run.json");
  expect(ran, 1, "its homing (method 23) failed: the drive reports a homing error");
  const auto faults = json("run.json")["fault_log"];
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0]["joint"], "joint1");
  EXPECT_LT(faults[0]["time_s"].get<double>(), 5.0) << "not when the run's time is over";
  EXPECT_NE(faults[0]["cause"].get<std::string>().find("give homing.method a number"),
            std::string::npos);
  std::istringstream lines(ran.out);  // the table of faults
  for (std::string line; std::getline(lines, line);) {
    const auto columns = std::ranges::count_if(line, [](char c) { return (c & 0xC0) != 0x80; });
    EXPECT_LE(columns, 100) << line;
  }
}

/// What would move too fast, not at all, or to a place that the joint has not.
TEST_F(HomedJoints, AreCheckedBeforeAnythingMoves) {
  const std::string whole = read_text(folder_ / "robot.toml");
  const auto check = [&](const std::string& from, const std::string& to, const std::string& part) {
    write_text(folder_ / "robot.toml", whole);
    edit("robot.toml", from, to);
    expect(tandem("check robot.toml"), 2, "joint.joint1.homing." + part);
  };
  check("speed_rad_s = 0.5", "speed_rad_s = 60.0",
        "speed_rad_s: 60 is more than the joint's max_velocity_rad_s");
  check("speed_rad_s = 0.5", "speed_rad_s = 1e-9", "speed_rad_s: 1e-09 would be");
  check("speed_rad_s = 0.5", "speed_rad_s = 0.5, zero_speed_rad_s = 0.6", "zero_speed_rad_s: is");
  check("acceleration_rad_s2 = 1.0", "acceleration_rad_s2 = 1e12", "acceleration_rad_s2: 1e+12");
  check("position_rad = 0.5", "position_rad = 100.0", "position_rad: 100 is far outside");
  check("position_rad = 0.5", "position_rad = 1e9", "position_rad: 1e+09 is far outside");
  check("method = 35", "method = 15", "method: our own boards have no homing method 15");
}

TEST_F(HomedJoints, OneThatEndsOutsideOfItsLimitsIsLedInside) {
  edit("robot.toml", "position_rad = 0.5 }", "position_rad = -6.35 }");
  start("--rate 20 --duration 2000 --on-fault wait");
  until(R"("phase": "held")");
  expect(to_run("joint home joint1"), 0, "joint1 is homed");
  const auto shown = nlohmann::json::parse(to_run("joint show joint1 --json -").out);
  EXPECT_EQ(shown["moving"], false);
  EXPECT_GE(shown["commanded_position_rad"].get<double>(), shown["min_position_rad"].get<double>());
  expect(to_run("joint move joint1 --to -6.2 --wait"), 0, "joint1");
  EXPECT_EQ(end(), 0);
}

TEST_F(HomedJoints, ARunThatEndsWhileOneIsBeingHomedSaysSo) {
  edit("robot.toml", "method = 35", "method = 17");
  edit("robot.toml", "position_rad = 0.5 }", "position_rad = 0.5, at_start = true }");
  expect(tandem("run hold.toml --duration 0.2 --no-log"), 1, "joint1: it was not homed");
}

TEST_F(HomedJoints, AreCheckedByName) {
  edit("robot.toml", "method = 35", "method = 0");
  expect(tandem("check robot.toml"), 2, "0 is no homing");
  edit("robot.toml", "method = 0", "metohd = 35");
  expect(tandem("check robot.toml"), 2, "metohd");
}

}  // namespace
}  // namespace tandem::apps
