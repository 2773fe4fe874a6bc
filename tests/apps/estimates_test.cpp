// What is estimated in a run, by the binary: thresholds from its logs, and its report.
#include "tests/apps/bad_input.hpp"

namespace tandem::apps {
namespace {

class Thresholds : public Program {
 protected:
  /// An experiment NAME.toml of the trajectory, with an observer or without.
  void experiment(const std::string& name, bool observer = true) const {
    const std::string plain = read_text(folder_ / "trajectory.toml");
    write_text(folder_ / (name + ".toml"), plain + (observer ? "\n[estimation.observer]\n" : "\n"));
  }
  /// Runs it. @return the log
  [[nodiscard]] std::string run(const std::string& name, const std::string& flags = {}) const {
    const Outcome outcome =
        tandem("run " + name + ".toml --duration 9 --quiet --json " + name + ".json " + flags);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return json(name + ".json")["log"]["path"];
  }
  void expect_refused(const std::vector<std::string>& texts, const std::string& arguments) const {
    const Outcome outcome = tandem(arguments);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    for (const std::string& text : texts) {
      EXPECT_NE(outcome.err.find(text), std::string::npos) << text << "\nin: " << outcome.err;
    }
  }
};

TEST_F(Thresholds, OfThreeRunsHoldInAFourthAndFindItsPushes) {
  edit("robot.toml", "min_position_rad = -6.3\n",
       "min_position_rad = -6.3\ntorque_noise_Nm = 0.01\n");
  experiment("swing");
  std::string logs;
  for (const char* seed : {"1", "2", "3"})
    logs += " " + run("swing", std::string("--seed ") + seed);
  const std::string free = run("swing", "--seed 4");
  write_text(folder_ / "pushes.toml",
             "[[fault]]\nkind = \"push\"\njoint = \"joint2\"\nforce_N = [0.0, 3.0, 0.0]\n"
             "point_m = [0.0, 0.0, 0.1]\nafter_enabled_s = 3.0\nfor_s = 0.2\n"
             "[[fault]]\nkind = \"push\"\njoint = \"joint2\"\nforce_N = [0.0, 3.0, 0.0]\n"
             "point_m = [0.0, 0.0, 0.1]\nafter_enabled_s = 6.0\nfor_s = 0.2\n");
  const std::string pushed = run("swing", "--seed 5 --scenario pushes.toml");
  const Outcome outcome = tandem("log thresholds" + logs + " --json learned.json --against " +
                                 free + " " + pushed + " -o alarms");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("[estimation.collision.threshold_Nm]\n\"joint1\" = "),
            std::string::npos)
      << outcome.out;
  EXPECT_EQ(outcome.out.find("Runs differ"), std::string::npos) << "three are enough";
  const auto learned = json("learned.json");
  EXPECT_GT(learned["threshold_Nm"]["joint2"].get<double>(), 0.0);
  EXPECT_GT(learned["against"]["free_s"].get<double>(), 10.0) << "until the first push";
  for (const auto& one : learned["against"]["factors"]) {
    if (one["factor"].get<double>() < 0.99) continue;
    EXPECT_EQ(one["alarms"], 0) << one;
    const auto& times = one["pushed"].begin().value();
    EXPECT_EQ(times["pushes"], 2);
    EXPECT_EQ(times["found"], 2) << times;
    EXPECT_LT(times["worst_ms"].get<double>(), 200.0);
  }
  for (const char* file : {"report.html", "alarms_median.png", "alarms_worst.png"})
    EXPECT_TRUE(std::filesystem::exists(folder_ / "alarms" / file)) << file;
  // What was learned is what an experiment takes.
  const std::string tables = outcome.out.substr(0, outcome.out.find("\n\n"));
  write_text(folder_ / "watched.toml", read_text(folder_ / "swing.toml") +
                                           "[estimation.collision]\nreaction = \"hold\"\n" +
                                           tables + "\n");
  EXPECT_EQ(tandem("run watched.toml --duration 5 --no-log --quiet").status, 0);
  EXPECT_EQ(tandem("run watched.toml --duration 5 --no-log --quiet --scenario pushes.toml").status,
            1);
}

// The first push stopped the run; the second, of a robot that stood still or hung from its joints,
// counted as missed.
TEST_F(Thresholds, CountThePushesOfARunUntilItStops) {
  edit("robot.toml", "min_position_rad = -6.3\n",
       "min_position_rad = -6.3\ntorque_noise_Nm = 0.01\n");
  experiment("swing");
  const std::string free = run("swing");
  write_text(folder_ / "stops.toml",
             read_text(folder_ / "swing.toml") +
                 "[estimation.collision]\nreaction = \"hold\"\n"
                 "[estimation.collision.threshold_Nm]\n\"joint1\" = 0.5\n\"joint2\" = 0.3\n");
  std::string pushes;
  for (const char* after_s : {"3.0", "6.0"}) {
    pushes += std::string("[[fault]]\nkind = \"push\"\njoint = \"joint2\"\n") +
              "force_N = [0.0, 3.0, 0.0]\npoint_m = [0.0, 0.0, 0.1]\nfor_s = 0.2\n" +
              "after_enabled_s = " + after_s + "\n";
  }
  write_text(folder_ / "pushes.toml", pushes);
  EXPECT_EQ(
      tandem("run stops.toml --duration 9 --quiet --scenario pushes.toml --json stops.json").status,
      1);
  const std::string stopped = json("stops.json")["log"]["path"];
  const Outcome outcome =
      tandem("log thresholds " + free + " --json learned.json --against " + stopped);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto learned = json("learned.json");
  for (const auto& one : learned["against"]["factors"])
    EXPECT_EQ(one["pushed"].begin().value()["pushes"], 1) << one;
}

// Without noise every seed makes the same run: three of them were taken for three runs.
TEST_F(Thresholds, OfOneRunTwiceAreRefused) {
  experiment("swing");
  const std::string log = run("swing");
  const Outcome outcome = tandem("log thresholds " + log + " " + log);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("has the same data as " + log), std::string::npos) << outcome.err;
}

// Its report had shown the run until the first collision, and a second more.
TEST_F(Thresholds, PassedWithAWarningHideNothingOfTheRun) {
  experiment("swing");
  write_text(folder_ / "warned.toml",
             read_text(folder_ / "swing.toml") +
                 "[estimation.collision]\nreaction = \"warn\"\n"
                 "[estimation.collision.threshold_Nm]\n\"joint1\" = 0.001\n\"joint2\" = 0.001\n");
  EXPECT_EQ(tandem("run warned.toml --duration 3 --quiet --log . --report").status, 1);
  const std::string page = read_text(folder_ / "double_pendulum-warned-001/report.html");
  EXPECT_NE(page.find("<dt>controllers ran</dt><dd>3.000 s</dd>"), std::string::npos)
      << page.substr(page.find("<h2>Run</h2>"));
  EXPECT_NE(page.find("Nm, reported, at "), std::string::npos);
}

TEST_F(Thresholds, OfOneRunSayThatRunsDiffer) {
  experiment("swing");
  const Outcome outcome = tandem("log thresholds " + run("swing"));
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("give 3 or more"), std::string::npos) << outcome.out;
}

TEST_F(Thresholds, OfALogThatCannotTeachAreRefused) {
  experiment("swing");
  experiment("plain", false);
  const std::string log = run("swing"), without = run("plain");
  expect_refused({"this log has no external torques", "[estimation.observer]"},
                 "log thresholds " + without);
  expect_refused({"less than 8 s of external torques", "--from"},
                 "log thresholds " + log + " --from 5");
  expect_refused({"--against"}, "log thresholds " + log + " -o alarms");
  expect_refused({"no log has a push to draw", "[[fault]]"},
                 "log thresholds " + log + " --against " + log + " -o alarms");
}

/// Runs of 9 s that are pushed, or not.
class ThresholdsOfLogs : public Thresholds {
 protected:
  void SetUp() override {
    Thresholds::SetUp();
    edit("robot.toml", "min_position_rad = -6.3\n",
         "min_position_rad = -6.3\ntorque_noise_Nm = 0.01\n");
    experiment("swing");
    write_text(folder_ / "push.toml",
               "[[fault]]\nkind = \"push\"\njoint = \"joint2\"\nforce_N = [0.0, 3.0, 0.0]\n"
               "point_m = [0.0, 0.0, 0.1]\nafter_enabled_s = 3.0\nfor_s = 0.2\n");
  }
  [[nodiscard]] std::string pushed(const std::string& seed, const std::string& folder) const {
    return run("swing", "--scenario push.toml --seed " + seed + " --log " + folder);
  }
};

// Anybody's report.html in the folder was replaced.
TEST_F(ThresholdsOfLogs, KeepAPageThatIsNotTheirs) {
  const std::string command =
      "log thresholds " + run("swing") + " --against " + pushed("2", "b") + " -o alarms";
  std::filesystem::create_directory(folder_ / "alarms");
  write_text(folder_ / "alarms/report.html", "<html>mine</html>\n");
  expect_refused({"alarms/report.html", "it is no page of `tandem log thresholds`"}, command);
  EXPECT_EQ(read_text(folder_ / "alarms/report.html"), "<html>mine</html>\n");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "alarms/alarms_median.png"));
  std::filesystem::remove(folder_ / "alarms/report.html");
  for (int i = 0; i < 2; ++i) {  // its own is replaced
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
  }
}

// The second overwrote the first in the JSON.
TEST_F(ThresholdsOfLogs, TellLogsOfOneNameApart) {
  const std::string a = pushed("2", "A"), b = pushed("3", "B");
  const Outcome outcome =
      tandem("log thresholds " + run("swing") + " --against " + a + " " + b + " --json t.json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto pushes = json("t.json")["against"]["factors"][0]["pushed"];
  EXPECT_EQ(pushes.size(), 2U) << pushes;
  for (const std::string& log : {a, b}) {
    EXPECT_TRUE(pushes.contains(log)) << log << " in " << pushes;
    EXPECT_NE(outcome.out.find(log + ": median"), std::string::npos) << outcome.out;
  }
}

// Thresholds were learned from logs that have nothing in common.
TEST_F(ThresholdsOfLogs, OfTwoBandwidthsAreRefused) {
  const std::string first = run("swing");
  write_text(folder_ / "fast.toml", read_text(folder_ / "swing.toml") + "bandwidth_Hz = 30.0\n");
  const std::string fast = run("fast", "--seed 2");
  const std::vector<std::string> texts{first, fast, "bandwidth_Hz", "30 Hz", "15 Hz", "record"};
  expect_refused(texts, "log thresholds " + first + " " + fast);
  expect_refused(texts, "log thresholds " + first + " --against " + fast);
  write_text(folder_ / "same.toml", read_text(folder_ / "swing.toml") + "bandwidth_Hz = 15\n");
  const Outcome same = tandem("log thresholds " + first + " " + run("same", "--seed 2"));
  EXPECT_EQ(same.status, 0) << "what is not written is 15 Hz: " << same.err;
}

TEST_F(ThresholdsOfLogs, OfTwoDescriptionsAreRefused) {
  const std::string first = run("swing");
  edit("double_pendulum.urdf", "0.26703", "0.26803");
  const std::string heavy = run("swing", "--seed 2");
  expect_refused({first, heavy, "different descriptions", "double_pendulum", "record"},
                 "log thresholds " + first + " " + heavy);
}

/// COMAN squats; its log has no truth, so that the base is the estimate's or unknown.
class EstimatedReport : public Program {
 protected:
  [[nodiscard]] Outcome report(const std::string& name, const std::string& tables) const {
    const std::string config = TANDEM_SOURCE_DIR "/config/coman/";
    std::string text = read_text(config + "squat.toml");
    text.replace(text.find("robot.toml"), 10, config + "robot_hands.toml");
    write_text(folder_ / (name + ".toml"), text + "\n[sim]\nground_truth = false\n" + tables);
    return tandem("run " + name + ".toml --duration 2 --log logs --report --json " + name +
                  ".json");
  }
  [[nodiscard]] std::filesystem::path folder(const std::string& name) const {
    return folder_ / "logs" / ("coman_hands-" + name + "-001");
  }
  [[nodiscard]] std::string page(const std::string& name) const {
    return read_text(folder(name) / "report.html");
  }
};

TEST_F(EstimatedReport, TakesTheBaseFromTheEstimateWhereTheLogHasNoTruth) {
  const Outcome with = report("with", "[estimation.base]\n");
  ASSERT_EQ(with.status, 0) << with.err;
  EXPECT_NE(page("with").find("and by inverse dynamics"), std::string::npos);
  const auto frames = [this](const std::string& log) -> int {
    const Outcome info = tandem("log info logs/coman_hands-" + log + "-001.mcap --json -");
    return nlohmann::json::parse(info.out)["topics"]["/tf"]["messages"];
  };
  const int links_and_base = frames("with");
  const Outcome without = report("without", "");
  ASSERT_EQ(without.status, 0) << without.err;
  EXPECT_EQ(page("without").find("and by inverse dynamics"), std::string::npos);
  EXPECT_NE((without.out + without.err).find("the log lacks the base's motion"), std::string::npos)
      << without.out << without.err;
  EXPECT_GT(links_and_base, 3 * frames("without") / 2) << "which has the links alone";
}

TEST_F(EstimatedReport, DrawsTheWrenchAtEachDeclaredPlace) {
  const Outcome with = report("with",
                              "[estimation.base]\n[estimation.observer]\n"
                              "[[estimation.wrench]]\nsite = \"l_hand\"\n");
  ASSERT_EQ(with.status, 0) << with.err;
  for (const std::string what : {"force", "moment"}) {
    EXPECT_NE(page("with").find("l_hand: " + what + " on the robot"), std::string::npos);
    EXPECT_TRUE(std::filesystem::exists(folder("with") / ("external_" + what + "_l_hand.png")));
  }
  EXPECT_NE((with.out + with.err).find("wrench at l_hand"), std::string::npos) << with.err;
  const auto estimate = json("with.json")["estimate"];
  const auto wrench = estimate["wrenches"]["l_hand"];
  EXPECT_GT(wrench["max_force_N"].get<double>(), 0.0);
  EXPECT_GT(wrench["max_moment_Nm"].get<double>(), 0.0);
  EXPECT_GT(wrench["max_moment_s"].get<double>(), 0.0);
  EXPECT_GT(estimate["unexplained_torque_Nm"].get<double>(), 0.0);
  EXPECT_NE((with.out + with.err).find("external wrench on base"), std::string::npos) << with.out;
  const auto on_base = estimate["external_base_wrench"];
  for (const char* key : {"max_force_N", "max_force_s", "max_moment_Nm", "max_moment_s"})
    EXPECT_GT(on_base[key].get<double>(), 0.0) << key;
  const Outcome rows = tandem(
      "log csv logs/coman_hands-with-001.mcap --topic /tandem/estimate "
      "--fields external_force_n,external_moment_nm,unexplained_torque_nm");
  EXPECT_EQ(rows.status, 0) << rows.err;
  EXPECT_NE(rows.out.find("unexplained_torque_nm"), std::string::npos);
}

TEST_F(EstimatedReport, RefusesARobotWhoseFeetHaveNoSensors) {
  const std::string config = TANDEM_SOURCE_DIR "/config/anymal_c/";
  std::string text = read_text(config + "squat.toml");
  text.replace(text.find("robot.toml"), 10, config + "robot.toml");
  write_text(folder_ / "squat.toml", text + "\n[estimation.base]\n");
  const Outcome refused = tandem("run squat.toml --duration 1 --no-log");
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("estimation.base"), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("has no force/torque sensor"), std::string::npos) << refused.err;
  EXPECT_EQ(error_lines(refused.err), 1) << refused.err;
}

TEST_F(EstimatedReport, RefusesThatRobotBeforeItsKernelsAreCompiled) {
  const std::string config = TANDEM_SOURCE_DIR "/config/anymal_c/";
  for (const auto& entry : std::filesystem::directory_iterator(config))
    std::filesystem::copy(entry, folder_ / entry.path().filename(),
                          std::filesystem::copy_options::overwrite_existing);
  std::string robot = read_text(folder_ / "robot.toml");
  robot.replace(robot.find("name = \"anymal_c\""), 17, "name = \"other\"");
  write_text(folder_ / "robot.toml", robot);
  write_text(folder_ / "squat.toml", read_text(folder_ / "squat.toml") + "\n[estimation.base]\n");
  const Outcome refused = tandem("run squat.toml --duration 1 --no-log",
                                 "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache"));
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("has no force/torque sensor"), std::string::npos) << refused.err;
  EXPECT_EQ(refused.err.find("compiling"), std::string::npos) << refused.err;
  const Outcome checked =
      tandem("check squat.toml", "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache"));
  EXPECT_EQ(checked.status, 2) << "it was right until the kernels were there";
  const std::string text = read_text(folder_ / "squat.toml");
  const auto line = std::count(text.begin(), text.end(), '\n');
  EXPECT_NE(checked.err.find("squat.toml:" + std::to_string(line) + ": estimation.base"),
            std::string::npos)
      << checked.err;
}

TEST_F(EstimatedReport, RefusesPassiveJointsBeforeKernelsAreCompiled) {
  const std::string config = TANDEM_SOURCE_DIR "/config/four_bar/";
  for (const auto& entry : std::filesystem::directory_iterator(config))
    std::filesystem::copy(entry, folder_ / entry.path().filename(),
                          std::filesystem::copy_options::overwrite_existing);
  std::string robot = read_text(folder_ / "robot.toml");
  robot.replace(robot.find("name = \"four_bar\""), 17, "name = \"another\"");
  write_text(folder_ / "robot.toml", robot);
  write_text(folder_ / "hold.toml", read_text(folder_ / "hold.toml") + "\n[estimation.observer]\n");
  for (const std::string command : {"check hold.toml", "run hold.toml --no-log"}) {
    const Outcome refused =
        tandem(command, "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache"));
    EXPECT_EQ(refused.status, 2) << command;
    EXPECT_NE(refused.err.find("is passive"), std::string::npos) << refused.err;
    EXPECT_EQ(refused.err.find("compiling"), std::string::npos) << refused.err;
  }
}

}  // namespace
}  // namespace tandem::apps
