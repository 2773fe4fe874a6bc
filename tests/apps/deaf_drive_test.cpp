// Runs of a robot with drives of another maker, which lose their commands and do not notice.
#include "tests/apps/running.hpp"

namespace tandem::apps {
namespace {

constexpr const char* kLost =
    "[[fault]]\nkind = \"frame_drop\"\nbus = \"arm\"\ncob_id = 0x201\nafter_enabled_s = ";
constexpr const char* kDisobeys =
    "its drive does not obey the stop, and may still be enabled: cut its power (emergency stop, "
    "STO)";

class Commands : public Running {
 protected:
  /// The double pendulum with those drives: they watch neither commands nor heartbeats.
  void SetUp() override {
    Running::SetUp();
    const std::string config = TANDEM_SOURCE_DIR "/config/";
    write_text(folder_ / "robot.toml",
               read_text(config + "double_pendulum_interpolated/robot.toml"));
    edit("robot.toml", "\"../double_pendulum/", "\"" + config + "double_pendulum/");
    for (int drives = 0; drives < 2; ++drives) {
      edit("robot.toml", "\"../drives/", "\"" + config + "drives/");
    }
    write_text(folder_ / "trajectory.toml",
               read_text(config + "double_pendulum_interpolated/trajectory.toml"));
    edit("hold.toml", "seed = 1", "seed = 1\nperiod_ns = 2_000_000");
  }
  /// A run whose joint1 hears no command from then on. @return its faults: joint and cause
  [[nodiscard]] std::vector<std::string> faults_of_run(const std::string& after_s,
                                                       const std::string& more = {}) const {
    write_text(folder_ / "lost.toml", kLost + after_s + "\n" + more);
    const Outcome outcome =
        tandem("run trajectory.toml --no-log -q --scenario lost.toml --json run.json");
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    std::vector<std::string> faults;
    const auto written = json("run.json");
    for (const auto& fault : written["fault_log"]) {
      faults.push_back(fault["joint"].get<std::string>() + ": " +
                       fault["cause"].get<std::string>());
      EXPECT_EQ(fault["latched"], true);
    }
    return faults;
  }
};

TEST_F(Commands, ThatADriveDoesNotHearAreAFaultOfItsJoint) {
  EXPECT_EQ(faults_of_run("1.6"),
            (std::vector<std::string>{
                "joint1: it does not follow its command: is the joint blocked, does its drive get "
                "its commands?",
                std::string("joint1: ") + kDisobeys}));
}

TEST_F(Commands, ThatADriveDoesNotHearAreTheStopsToo) {
  const auto faults = faults_of_run(
      "1.0", "[[fault]]\nkind = \"encoder_unplug\"\njoint = \"joint2\"\nafter_enabled_s = 1.1\n");
  ASSERT_EQ(faults.size(), 2U);
  EXPECT_TRUE(faults[0].starts_with("joint2: ")) << faults[0];
  EXPECT_EQ(faults[1], std::string("joint1: ") + kDisobeys);
}

TEST_F(Commands, ThatADriveDoesNotHearAtTheEndAreTold) {
  EXPECT_EQ(faults_of_run("4.9"), std::vector<std::string>{std::string("joint1: ") + kDisobeys});
}

TEST_F(Commands, ThatADriveDoesNotHearInARunThatWaitsStayLatched) {
  write_text(folder_ / "lost.toml", std::string(kLost) + "0.5\n");
  start("--rate 20 --duration 2000 --on-fault wait --scenario lost.toml");
  until(R"("phase": "running")");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_EQ(to_run("estop").status, 0) << "the loop has sent it";
  std::string shown;
  for (int i = 0; i < 200 && shown.find(kDisobeys) == std::string::npos; ++i) {
    shown = to_run("fault show --json -").out;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_NE(shown.find(kDisobeys), std::string::npos) << shown;
  EXPECT_NE(to_run("fault show").out.find("joint1  drive_1  its drive does not obey the stop"),
            std::string::npos);
  const Outcome reset = to_run("fault reset");
  EXPECT_EQ(reset.status, 1) << reset.out;
  EXPECT_EQ(end(), 1);
}

/// The sheet has neither.
TEST_F(Commands, AndWhatADriveDoesNotTellIsNotKnown) {
  begin("");
  const auto shown = nlohmann::json::parse(to_run("joint show joint1 --json -").out);
  for (const char* key : {"current_A", "voltage_V", "temperature_C"}) {
    EXPECT_TRUE(shown[key].is_null()) << key;
  }
  const std::string text = to_run("joint show joint1").out;
  EXPECT_NE(text.find("current         not known\n"), std::string::npos) << text;
  EXPECT_NE(to_run("joint list --drives").out.find("not known"), std::string::npos);
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::apps
