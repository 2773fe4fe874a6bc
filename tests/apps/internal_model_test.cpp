// [parallel] and `tandem predict` of the binary: figures, and one clear error for each wrong input.
#include "apps/run/prediction.hpp"
#include "tests/apps/bad_input.hpp"
#include "tests/apps/running.hpp"

namespace tandem::apps {
namespace {

class Parallel : public BadInput {
 protected:
  /// hold.toml with more tables behind it.
  void add(const std::string& tables) const {
    write_text(folder_ / "hold.toml", read_text(folder_ / "hold.toml") + "\n" + tables);
  }
};

TEST_F(Parallel, OfAnExactTwinIsTheSameToTheLastBit) {
  write_text(folder_ / "trajectory.toml",
             read_text(folder_ / "trajectory.toml") + "\n[parallel]\n");
  const Outcome outcome = tandem("run trajectory.toml --duration 0.5 --json run.json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto parallel = json("run.json")["parallel"];
  EXPECT_EQ(parallel["unequal"], 0);
  EXPECT_TRUE(parallel["first_unequal"].is_null());
  EXPECT_GT(parallel["compared"].get<int>(), 500);
  EXPECT_EQ(parallel["missed"], 0);
  EXPECT_TRUE(parallel["fault"].is_null());
  EXPECT_EQ(parallel["joints"]["joint2"]["torque_Nm"]["max"], 0.0);
  EXPECT_NE(outcome.out.find("the same bits in all "), std::string::npos) << outcome.out;
}

TEST_F(Parallel, OfOtherGainsDiffersInTableLogAndReport) {
  write_text(folder_ / "other.toml", read_text(folder_ / "robot.toml"));
  edit("other.toml", "position = { kp = 6.0", "position = { kp = 3.0");
  write_text(folder_ / "trajectory.toml",
             read_text(folder_ / "trajectory.toml") + "\n[parallel]\nrobot = \"other.toml\"\n");
  const Outcome outcome =
      tandem("run trajectory.toml --duration 0.5 --json run.json --log logs --report");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto parallel = json("run.json")["parallel"];
  EXPECT_GT(parallel["unequal"].get<int>(), 100);
  EXPECT_GT(parallel["joints"]["joint1"]["position_rad"]["max"].get<double>(), 0.0);
  EXPECT_NE(outcome.out.find("parallel: first minus second"), std::string::npos) << outcome.out;
  for (const char* figure : {"position_difference.png", "torque_difference.png"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_ / "logs/double_pendulum-trajectory-001" / figure))
        << figure << outcome.err;
  }
  const Outcome info = tandem("log info logs/double_pendulum-trajectory-001.mcap");
  EXPECT_NE(info.out.find("/tandem/parallel/state"), std::string::npos) << info.out;
}

/// COMAN, whose base floats: how far the two bases are apart is known, and nothing for a twin.
TEST_F(Parallel, OfAFloatingBaseComparesTheBases) {
  const Outcome twin =
      tandem("run " + shell_word(TANDEM_SOURCE_DIR "/config/coman/squat_twin.toml") +
             " --duration 0.5 --no-log --json "
             "run.json");
  ASSERT_EQ(twin.status, 0) << twin.err;
  EXPECT_EQ(json("run.json")["parallel"]["base"]["position_m"]["max"], 0.0);
  EXPECT_EQ(json("run.json")["parallel"]["base"]["angle_rad"]["max"], 0.0);
  const std::string config = TANDEM_SOURCE_DIR "/config/coman/";
  std::string soft = read_text(config + "robot.toml");
  soft.replace(soft.find("coman.urdf"), 10, config + "coman.urdf");
  write_text(folder_ / "soft.toml", soft);
  edit("soft.toml", "spring_Nm_rad = 395.46", "spring_Nm_rad = 300.0");
  std::string squat = read_text(config + "squat_twin.toml");
  squat.replace(squat.find("\"robot.toml\""), 12, "\"" + config + "robot.toml\"");
  const std::size_t at = squat.find("[parallel]") + 10;
  write_text(folder_ / "squat.toml",
             squat.substr(0, at) + "\nrobot = \"soft.toml\"\n" + squat.substr(at));
  const Outcome softer = tandem("run squat.toml --duration 1 --no-log --json run.json");
  ASSERT_EQ(softer.status, 0) << softer.err;
  EXPECT_GT(json("run.json")["parallel"]["base"]["position_m"]["max"].get<double>(), 1e-6);
  EXPECT_NE(softer.out.find("  turned"), std::string::npos) << softer.out;
}

TEST_F(Parallel, WithAHeavierLinkNeedsKernelsOfItsOwn) {
  add("[parallel.link.link2]\nmass_kg = 3.5\n");
  expect_refused({"parallel", "the parallel robot has no kernels", "leave --no-build out"},
                 "run hold.toml --duration 0.05 --no-build");
}

TEST_F(Parallel, OfAnotherLayoutIsRefusedByName) {
  write_text(folder_ / "other.toml", read_text(folder_ / "robot.toml"));
  std::string text = read_text(folder_ / "other.toml");
  for (std::size_t at = text.find("joint2"); at != std::string::npos;
       at = text.find("joint2", at)) {
    text.replace(at, 6, "jointX");
  }
  std::string urdf = read_text(folder_ / "double_pendulum.urdf");
  for (std::size_t at = urdf.find("joint2"); at != std::string::npos;
       at = urdf.find("joint2", at)) {
    urdf.replace(at, 6, "jointX");
  }
  write_text(folder_ / "other.urdf", urdf);
  write_text(folder_ / "other.toml", text);
  edit("other.toml", "double_pendulum.urdf", "other.urdf");
  add("[parallel]\nrobot = \"other.toml\"\n");
  expect_refused({"hold.toml:", "parallel.robot", "another layout", "'joint2'", "'jointX'"});
}

TEST_F(Parallel, OfAFileThatIsNotThereIsRefusedWhereItIsNamed) {
  add("[parallel]\nrobot = \"nosuch.toml\"\n");
  expect_refused({"hold.toml:", "parallel.robot", "there is no file", "nosuch.toml"});
}

TEST_F(Parallel, WithWrongKeysIsRefused) {
  add("[parallel]\nrobt = \"robot.toml\"\n");
  expect_refused({"hold.toml:", "robt", "robot"});
}

TEST_F(Parallel, WithALinkThatIsNotThereIsRefusedWhereItIsNamed) {
  add("[parallel.link.link9]\nmass_kg = 1.0\n");
  expect_refused({"hold.toml:", "parallel.link.link9", "no link 'link9'"});
}

TEST_F(Parallel, WithARobotThatIsNotThereIsRefused) {
  add("[parallel]\nrobot = \"nowhere.toml\"\n");
  expect_refused({"nowhere.toml"});
}

class Predict : public Running {};

TEST_F(Predict, SaysWhatTheRunWillDo) {
  begin("");
  const Outcome outcome = to_run("predict --horizon 0.5 --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto answer = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(answer["cycles"], 500);
  EXPECT_EQ(answer["every_cycles"], 5);
  EXPECT_EQ(answer["end"], "horizon");
  EXPECT_EQ(answer["joints"]["joint1"]["position_rad"].size(), 101U) << "the last cycle too";
  EXPECT_TRUE(answer["base"].is_null());
  EXPECT_TRUE(answer["faults"].empty());
  EXPECT_TRUE(answer["unarchived_controllers"].empty());
  const Outcome table = to_run("predict --horizon 0.2 --every 10");
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_NE(table.out.find("x real time"), std::string::npos) << table.out;
  for (const char* wrong : {"0", "-1", "11", "1e300"}) {
    const Outcome refused = to_run(std::string("predict --horizon ") + wrong);
    EXPECT_EQ(refused.status, 2) << wrong;
    EXPECT_EQ(error_lines(refused.err), 1) << refused.err;
  }
  EXPECT_EQ(end(), 0);
}

TEST_F(Predict, SaysWhichFaultsWillCome) {
  begin("");
  ASSERT_EQ(to_run("clock rate 0.01").status, 0);
  const auto clock = nlohmann::json::parse(to_run("clock show --json -").out);
  const double soon_s = clock["time_s"].get<double>() + 3.0;
  ASSERT_EQ(to_run("inject kind=board_kill board=board_1 at_s=" + std::to_string(soon_s)).status,
            0);
  const Outcome table = to_run("predict --horizon 9");
  ASSERT_EQ(table.status, 0) << table.err;
  const auto answer = nlohmann::json::parse(to_run("predict --horizon 9 --json -").out);
  ASSERT_FALSE(answer["faults"].empty());
  for (const auto& fault : answer["faults"])
    EXPECT_NE(table.out.find(" s: " + fault["joint"].get<std::string>() + ": " +
                             fault["cause"].get<std::string>()),
              std::string::npos)
        << table.out;
  EXPECT_EQ(end(), 0);
}

/// A copy of it begins anew: `hangs` counts its cycles, and has no archive().
TEST_F(Predict, NamesAControllerThatItCannotCopy) {
  edit("hold.toml", "plugin = \"hold\"",
       "plugin = \"" TANDEM_BINARY_DIR
       "/tests/test_plugins/hangs.so\"\nname = \"counts\"\n"
       "[controller.parameters]\nafter_cycles = 1_000_000_000");
  const Outcome checked = tandem("check hold.toml");
  EXPECT_EQ(checked.status, 0) << checked.err;
  EXPECT_NE(checked.err.find("controller.counts: has members but no archive()"), std::string::npos)
      << checked.err;
  begin("");
  const Outcome table = to_run("predict --horizon 0.1");
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_NE(table.err.find("the controller 'counts' has no archive()"), std::string::npos)
      << table.err;
  const Outcome answer = to_run("predict --horizon 0.1 --json -");
  EXPECT_EQ(nlohmann::json::parse(answer.out)["unarchived_controllers"],
            nlohmann::json::array({"counts"}));
  EXPECT_EQ(end(), 0);
}

/// However far apart the rows are, "then" is the horizon's end; and an answer has its size.
TEST_F(Predict, AnswersWithTheLastCycleAndNoMoreRowsThanAClientReads) {
  begin("");
  const Outcome far = to_run("predict --horizon 0.5 --every 1000000 --json -");
  ASSERT_EQ(far.status, 0) << far.err;
  EXPECT_EQ(nlohmann::json::parse(far.out)["joints"]["joint1"]["position_rad"].size(), 2U);
  const Outcome all = to_run("predict --horizon 6 --every 1 --json -");
  ASSERT_EQ(all.status, 0) << all.err;
  EXPECT_EQ(nlohmann::json::parse(all.out)["joints"]["joint1"]["position_rad"].size(), 6000U);
  const Outcome many = to_run("predict --horizon 9 --every 1");
  EXPECT_EQ(many.status, 2) << many.out;
  EXPECT_NE(many.err.find("every_cycles from 2 on"), std::string::npos) << many.err;
  EXPECT_EQ(end(), 0);
}

/// The copy has the link, the twin and the robot of the run.
TEST_F(Predict, OfAnOperatorsRunIsWhatItsLoopWillSee) {
  edit("hold.toml", "[[controller]]",
       "[teleoperation.up]\ndelay_s = 0.1\njitter_s = 0.01\n[teleoperation.down]\n"
       "delay_s = 0.1\nloss = 0.1\n[[controller]]");
  begin("");
  const Outcome outcome = to_run("predict --horizon 0.5 --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto answer = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(answer["end"], "horizon");
  EXPECT_EQ(answer["cycles"], 500);
  EXPECT_TRUE(answer["faults"].empty());
  EXPECT_EQ(end(), 0);
}

TEST_F(Predict, OfARunThatIsPausedSaysSo) {
  begin("");
  EXPECT_EQ(to_run("clock pause").status, 0);
  const Outcome refused = to_run("predict");
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("tandem clock resume"), std::string::npos) << refused.err;
  EXPECT_EQ(to_run("clock resume").status, 0);
  EXPECT_EQ(to_run("predict").status, 0) << "it is not kept from the next one";
  EXPECT_EQ(end(), 0);
}

/// A robot on a wire, without [parallel].
TEST(PredictCommand, OfARunWithoutAModelSaysWhatIsMissing) {
  ControlRegistry registry;
  const hal::RobotConfig robot;
  add_predict(registry, nullptr, robot);
  const Json answer = registry.answer(R"({"do": "predict"})");
  EXPECT_EQ(answer["ok"], false);
  EXPECT_EQ(answer["error"], "this run has no model of its robot to predict with");
  EXPECT_NE(answer["hint"].get<std::string>().find("add [parallel]"), std::string::npos) << answer;
}

/// By a clock of the test's own. The questions themselves are out of range, so that none is worked
/// at.
TEST(PredictCommand, IsRefusedToPeersThatAskAgainAndAgain) {
  ControlRegistry registry;
  const hal::RobotConfig robot;
  internal_model::PredictionService service(1'000'000);
  std::int64_t now_ns = 5'000'000'000;
  add_predict(registry, &service, robot, [&] { return now_ns; });
  const auto ask = [&] {
    return registry.answer(R"({"do": "predict", "horizon_s": 100})")["error"].get<std::string>();
  };
  const std::string too_many = "predict: more than 10 were asked for in a second";
  for (int i = 0; i < 10; ++i) EXPECT_NE(ask().find("a horizon of 100 s"), std::string::npos) << i;
  EXPECT_EQ(ask(), too_many);
  now_ns += 99'999'999;
  EXPECT_EQ(ask(), too_many) << "those that are refused do not count";
  now_ns += 1;
  EXPECT_NE(ask(), too_many) << "one more each tenth of a second";
  EXPECT_EQ(ask(), too_many);
  now_ns += 60'000'000'000;
  for (int i = 0; i < 10; ++i) EXPECT_NE(ask(), too_many) << "a long silence saves up no more";
  EXPECT_EQ(ask(), too_many);
}

TEST_F(Predict, WithoutARunIsAnError) {
  const Outcome refused = to_run("predict");
  EXPECT_EQ(refused.status, 2);
  EXPECT_EQ(error_lines(refused.err), 1) << refused.err;
}

}  // namespace
}  // namespace tandem::apps
