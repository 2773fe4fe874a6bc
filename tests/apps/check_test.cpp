// `tandem check`: every error of every file, and nothing moves.
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class Check : public Program {};

TEST_F(Check, TellsWhatARunWouldDoAndLeavesNothingBehind) {
  const Outcome outcome = tandem("check hold.toml");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  for (const std::string text : {"double_pendulum", "controller hold", "5000 cycles"}) {
    EXPECT_NE(outcome.out.find(text), std::string::npos) << text << "\nin: " << outcome.out;
  }
  EXPECT_FALSE(has_log());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "runs"));
}

TEST_F(Check, ReadsARobotByItself) {
  const Outcome outcome = tandem("check robot.toml");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("2 on 1 boards"), std::string::npos) << outcome.out;
}

TEST_F(Check, GivesEveryErrorAsJsonWithFileLineKeyAndHint) {
  edit("robot.toml", "kp = 6.0", "kp = -6.0");
  edit("robot.toml", "gear_ratio", "gear_ration");
  const Outcome outcome = tandem("check hold.toml --json -");
  EXPECT_EQ(outcome.status, 2);
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["ok"], false);
  ASSERT_EQ(json["errors"].size(), 3U) << outcome.out;  // missing, unknown, wrong sign
  for (const auto& error : json["errors"]) {
    EXPECT_NE(error["file"].get<std::string>().find("robot.toml"), std::string::npos);
    EXPECT_GT(error["line"], 0);
    EXPECT_NE(error["key"], "");
    EXPECT_NE(error["message"], "");
    EXPECT_TRUE(error.contains("hint"));
  }
}

TEST_F(Check, ShowsTheLoadOfEveryBus) {
  const Outcome outcome = tandem("check --bus hold.toml --json -");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("slow commands, if all changed"), std::string::npos) << outcome.err;
  const auto bus = nlohmann::json::parse(outcome.out)["buses"][0];
  EXPECT_EQ(bus["bus"], "arm");
  EXPECT_EQ(bus["ok"], true);
  EXPECT_EQ(bus["rows"][0]["what"], "SYNC");
  EXPECT_EQ(bus["rows"][0]["time_us"], 55.0);
}

TEST_F(Check, RefusesWhatARealBusCannotCarryAndSoDoesRun) {
  edit("robot.toml", "data_bitrate = 8_000_000", "max_load = 0.1");
  for (const std::string command : {"check hold.toml", "check --bus robot.toml", "run hold.toml"}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 2) << command;
    EXPECT_NE(outcome.err.find("cannot carry its mean load"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("any of these fits: period_ns ="), std::string::npos) << outcome.err;
  }
  EXPECT_FALSE(has_log());
}

TEST_F(Check, SaysOkAsJson) {
  const Outcome outcome = tandem("check hold.toml --json -");
  EXPECT_EQ(outcome.status, 0);
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["ok"], true);
  EXPECT_EQ(json["errors"], nlohmann::json::array());
  EXPECT_NE(json["kernels"], "");
  EXPECT_NE(outcome.err.find("double_pendulum"), std::string::npos) << "text for people";
}

TEST_F(Check, FindsAPluginBesideTheExperimentFromAnyFolder) {
  std::filesystem::copy_file(TANDEM_BINARY_DIR "/lib/controllers/hold.so", folder_ / "mine.so");
  edit("hold.toml", "\"hold\"", "\"./mine.so\"");
  EXPECT_EQ(tandem("check hold.toml").status, 0) << read_text(folder_ / "err.txt");
  std::filesystem::create_directory(folder_ / "my_robot");
  for (const char* file : {"double_pendulum.urdf", "robot.toml", "hold.toml", "mine.so"}) {
    std::filesystem::rename(folder_ / file, folder_ / "my_robot" / file);
  }
  EXPECT_EQ(tandem("check my_robot/hold.toml").status, 0) << read_text(folder_ / "err.txt");
}

TEST_F(Check, HoldsOfWhatTheDemoNamesNext) {
  std::istringstream makefile(read_text(TANDEM_SOURCE_DIR "/Makefile"));
  const std::string start = "\t@echo \"  build/release/bin/tandem ";
  int named = 0;
  for (std::string line; std::getline(makefile, line);) {
    if (!line.starts_with(start)) continue;
    std::istringstream words(line.substr(start.size()));
    std::string command;
    std::string file;
    words >> command >> file;
    ++named;
    file = TANDEM_SOURCE_DIR "/" + file;
    EXPECT_TRUE(std::filesystem::exists(file)) << file;
    if (command != "run") continue;
    EXPECT_EQ(tandem("check " + file).status, 0) << read_text(folder_ / "err.txt");
  }
  EXPECT_EQ(named, 3);
}

}  // namespace
}  // namespace tandem::apps
