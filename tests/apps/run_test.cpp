// `tandem run` on the smallest robot: results, logs, and the same bytes at every rate.
#include <unistd.h>

#include <cstdlib>
#include <map>
#include <regex>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class Run : public Program {
 protected:
  [[nodiscard]] nlohmann::json run(const std::string& arguments) const {
    const Outcome outcome = tandem("run " + arguments + " --quiet --json -");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }
};

TEST_F(Run, WarnsOfAFaultOfTheScenarioThatIsDueAfterItsEnd) {
  write_text(folder_ / "late.toml",
             "[[fault]]\nkind = \"push\"\njoint = \"joint2\"\nforce_N = [0.0, 3.0, 0.0]\n"
             "after_enabled_s = 0.1\nfor_s = 0.1\n"
             "[[fault]]\nkind = \"push\"\njoint = \"joint1\"\nforce_N = [0.0, 3.0, 0.0]\n"
             "at_s = 900\n");
  const auto json = run("hold.toml --duration 0.5 --scenario late.toml");
  ASSERT_EQ(json["warnings"].size(), 1U) << json["warnings"];
  const std::string warning = json["warnings"][0];
  EXPECT_NE(warning.find("'push' was never injected: it is due 900.000 s after the first SYNC"),
            std::string::npos)
      << warning;
}

// `[overrun]` was passed over without a word where the simulation keeps real time.
TEST_F(Run, SaysThatOverrunsHaveNoPolicyInSimulatedTime) {
  std::ofstream(folder_ / "hold.toml", std::ios::app) << "\n[overrun]\npolicy = \"stop\"\n";
  const auto said = [&](const std::string& flags) {
    return tandem("run hold.toml --no-log --duration 0.1 " + flags).err;
  };
  EXPECT_NE(said("--realtime").find("note: [overrun] holds for the wall clock"), std::string::npos);
  EXPECT_EQ(said("").find("[overrun]"), std::string::npos) << "no cycle of it can be late";
}

TEST_F(Run, WritesTheDocumentedKeys) {
  const auto json = run("hold.toml --duration 0.5 --seed 7");
  for (const std::string key :
       {"robot", "hal", "seed", "cycles", "period_ns", "sim_seconds", "wall_seconds",
        "realtime_factor", "overruns", "wakeup_ns", "bus_ns", "cycle_ns", "log", "joints", "ground",
        "base", "round_trips", "faults", "kernel_variant"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_EQ(json["robot"], "double_pendulum");
  EXPECT_EQ(json["seed"], 7);
  EXPECT_EQ(json["cycles"], 500);
  EXPECT_EQ(json["period_ns"], 1'000'000);
  EXPECT_DOUBLE_EQ(json["sim_seconds"], 0.5);
  for (const std::string key : {"p50", "p99", "p999", "max"}) {
    EXPECT_TRUE(json["cycle_ns"].contains(key)) << key;
  }
  EXPECT_TRUE(json["wakeup_ns"].is_null()) << "it waits for nothing";
  EXPECT_EQ(json["log"]["dropped"], 0);
  EXPECT_EQ(json["log"]["data_sha256"].get<std::string>().size(), 64U);
  EXPECT_TRUE(std::filesystem::exists(folder_ / json["log"]["path"].get<std::string>()));
  EXPECT_TRUE(json["joints"]["joint1"].contains("rms_tracking_error_rad"));
  EXPECT_TRUE(json["joints"]["joint1"].contains("max_tracking_error_rad"));
  EXPECT_TRUE(json["ground"].is_null());
  EXPECT_TRUE(json["faults"].empty());
}

TEST_F(Run, SaysNullOfWhatItDoesNotKnow) {
  write_text(folder_ / "hold.toml",
             read_text(folder_ / "hold.toml") + "\n[sim]\nground_truth = false\n");
  const auto json = run("hold.toml --duration 0.2 --no-log");
  for (const std::string key : {"wakeup_ns", "bus_ns", "log", "frames", "dds", "ground", "parallel",
                                "base", "estimate", "remote", "teleoperation"}) {
    ASSERT_TRUE(json.contains(key)) << key;
    EXPECT_TRUE(json[key].is_null()) << key << ": " << json[key];
  }
}

/// The error was 0 in torque mode, and whoever checked it was content.
TEST_F(Run, TellsNoTrackingErrorWhereNoPositionIsWanted) {
  edit("hold.toml", "plugin = \"hold\"",
       "plugin = \"gravity_compensation\"\nparameters = { mode = \"torque\" }");
  const auto json = run("hold.toml --duration 0.2");
  for (const std::string joint : {"joint1", "joint2"}) {
    EXPECT_TRUE(json["joints"][joint]["rms_tracking_error_rad"].is_null()) << json["joints"];
    EXPECT_TRUE(json["joints"][joint]["max_tracking_error_rad"].is_null());
    EXPECT_EQ(json["joints"][joint]["limited_cycles"], 0);
  }
}

/// Which machine, when, and which code: not part of what makes two runs the same.
TEST_F(Run, LogsItsHostItsTimeAndTheDigestsOfItsCode) {
  const std::string first = run("hold.toml --duration 0.1")["log"]["path"];
  const std::string second = run("hold.toml --duration 0.1")["log"]["path"];
  const Outcome info = tandem("log info " + first + " --json info.json");
  ASSERT_EQ(info.status, 0) << info.err;
  const auto said = json("info.json")["metadata"];
  char host[256] = {};
  ASSERT_EQ(::gethostname(host, sizeof host - 1), 0);
  EXPECT_EQ(said["host"], host);
  const std::string started = said["started"];
  EXPECT_TRUE(std::regex_match(started, std::regex("20\\d\\d-\\d\\d-\\d\\dT\\d\\d:\\d\\d:\\d\\dZ")))
      << started;
  EXPECT_TRUE(
      std::regex_match(said["time_zone"].get<std::string>(), std::regex("[+-]\\d\\d\\d\\d .+")));
  const std::string line = said["controllers"];  // "hold SHA256 PATH\n"
  const std::string digest = line.substr(5, 64), path = line.substr(70, line.size() - 71);
  EXPECT_EQ(line.substr(0, 5), "hold ");
  const auto by_coreutils = [this](const std::string& file) {
    const std::string command =
        "sha256sum < " + shell_word(file) + " > " + shell_word((folder_ / "digest.txt").string());
    EXPECT_EQ(std::system(command.c_str()), 0);
    return read_text(folder_ / "digest.txt").substr(0, 64);
  };
  EXPECT_EQ(digest, by_coreutils(path));
  EXPECT_EQ(said["kernel_sha256"].get<std::string>().size(), 64U);
  EXPECT_NE(info.out.find(digest), std::string::npos) << info.out;
  EXPECT_NE(info.out.find(started), std::string::npos) << info.out;
  EXPECT_EQ(tandem("log diff " + first + " " + second).status, 0);
}

TEST_F(Run, FollowsATrajectoryOverClassicCan) {
  const auto json =
      run(shell_word(TANDEM_SOURCE_DIR "/config/double_pendulum_classic/trajectory.toml") +
          " --no-log");
  EXPECT_EQ(json["period_ns"], 2'000'000);
  EXPECT_TRUE(json["faults"].empty());
  EXPECT_LT(json["joints"]["joint2"]["max_tracking_error_rad"].get<double>(), 0.02);
}

TEST_F(Run, KeepsClosedLoopsClosedThroughBoardsAndFirmware) {
  for (const std::string experiment :
       {"four_bar/hold", "four_bar/turn", "parallel_ankle/hold", "parallel_ankle/move"}) {
    const auto json =
        run(shell_word(TANDEM_SOURCE_DIR "/config/" + experiment + ".toml") + " --no-log");
    EXPECT_TRUE(json["faults"].empty()) << experiment << json["faults"];
    EXPECT_EQ(json["loops"].size(), experiment.starts_with("four_bar") ? 1U : 2U);
    for (const auto& [name, loop] : json["loops"].items()) {
      EXPECT_LT(loop["max_position_error_m"].get<double>(), 1e-11) << experiment << ' ' << name;
      EXPECT_LT(loop["max_velocity_error_m_s"].get<double>(), 1e-11) << experiment << ' ' << name;
    }
    for (const auto& [name, joint] : json["joints"].items()) {
      EXPECT_LT(joint["max_tracking_error_rad"].get<double>(), 0.05) << experiment << ' ' << name;
    }
  }
}

// The motors carry the foot through the rods: with the right torque it stays where it is.
TEST_F(Run, CompensatesGravityOfJointsWithoutAMotor) {
  for (const std::string robot : {"four_bar", "parallel_ankle"}) {
    write_text(folder_ / "float.toml",
               "robot = \"" TANDEM_SOURCE_DIR "/config/" + robot + "/robot.toml\"\n" +
                   "posture = \"ready\"\nduration_s = 3.0\n[[controller]]\n" +
                   "plugin = \"gravity_compensation\"\n[controller.parameters]\n" +
                   "stiffness_Nm_rad = 0.2\ndamping_Nms_rad = 0.05\nramp_s = 0.01\n");
    const auto json = run("float.toml --no-log");
    EXPECT_TRUE(json["faults"].empty()) << robot << json["faults"];
    for (const auto& [name, joint] : json["joints"].items()) {
      EXPECT_LT(joint["max_tracking_error_rad"].get<double>(), 0.1) << robot << ' ' << name;
    }
  }
}

TEST_F(Run, GivesTheSameDataTwiceAndAtAnotherRate) {
  const auto first = run("trajectory.toml --duration 0.5");
  const auto second = run("trajectory.toml --duration 0.5");
  const auto paced = run("trajectory.toml --duration 0.5 --rate 5");
  EXPECT_NE(first["log"]["path"], second["log"]["path"]);
  EXPECT_EQ(first["log"]["data_sha256"], second["log"]["data_sha256"]);
  EXPECT_EQ(first["log"]["data_sha256"], paced["log"]["data_sha256"]);
  EXPECT_EQ(first["joints"], paced["joints"]);
}

/// It had sunk into ground as soft as a slip of units makes it, with status 0.
TEST_F(Run, OfARobotThatFallsIsNoSuccess) {
  std::filesystem::copy(TANDEM_SOURCE_DIR "/config/anymal_c", folder_ / "anymal");
  edit("anymal/robot.toml", "\nstiffness_N_m = ", "\nstiffness_N_m = 10  # was ");
  edit("anymal/robot.toml", "\ndamping_s_m = ", "\ndamping_s_m = 1  # was ");
  const Outcome outcome = tandem("run anymal/hold.toml --no-log --quiet");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find(" s: the robot sank: a foot is "), std::string::npos) << outcome.err;
}

TEST_F(Run, OfARobotThatStartsFarAboveTheGroundIsRefused) {
  std::filesystem::copy(TANDEM_SOURCE_DIR "/config/anymal_c", folder_ / "anymal");
  edit("anymal/robot.toml", "\nbase_height_m = ", "\nbase_height_m = 597.0  # was ");
  const Outcome outcome = tandem("run anymal/hold.toml --no-log --quiet");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("m above the ground"), std::string::npos) << outcome.err;
}

/// Twenty runs that began at once had left nineteen logs.
TEST_F(Run, EachOfManyThatBeginAtOnceHasALogOfItsOwn) {
  constexpr int kRuns = 8;
  std::vector<std::jthread> runs;
  for (int i = 0; i < kRuns; ++i) {
    runs.emplace_back([this] {
      EXPECT_EQ(tandem("run hold.toml --duration 0.01 --quiet --log many").status, 0);
    });
  }
  runs.clear();
  const auto logs = std::filesystem::directory_iterator(folder_ / "many");
  EXPECT_EQ(std::distance(begin(logs), end(logs)), kRuns);
}

TEST_F(Run, OfAScenarioEndsInItsFaultWhichTheLogTells) {
  std::ofstream(folder_ / "faults.toml")
      << "[[fault]]\nkind = \"encoder_unplug\"\njoint = \"joint2\"\nafter_enabled_s = 1.2\n";
  const Outcome outcome =
      tandem("run hold.toml --duration 1 --quiet --scenario faults.toml --json -");
  EXPECT_EQ(outcome.status, 1);
  const auto json = nlohmann::json::parse(outcome.out, nullptr, false);
  const std::string log = folder_ / json["log"]["path"].get<std::string>();
  const Outcome events = tandem("log csv " + shell_word(log) + " --topic event");
  EXPECT_NE(events.out.find("injected encoder_unplug of joint2"), std::string::npos)
      << events.out << events.err;
}

TEST_F(Run, TablesStandApartAndFaultsBeginAtTheLeft) {
  std::ofstream(folder_ / "faults.toml")
      << "[[fault]]\nkind = \"encoder_unplug\"\njoint = \"joint2\"\nafter_enabled_s = 1.2\n";
  const Outcome outcome = tandem("run hold.toml --duration 1 --scenario faults.toml");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.out.find("\n\n  fault at "), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find(" where   board    cause"), std::string::npos) << outcome.out;
}

TEST_F(Run, CountsTheJointsWhoseCommandsWereLimited) {
  edit("robot.toml", "max_torque_Nm = 2.0", "max_torque_Nm = 2.0\nmax_acceleration_rad_s2 = 1.0");
  const Outcome outcome = tandem("run trajectory.toml --no-log --no-socket");
  EXPECT_NE(outcome.out.find(" cycles, by 'joint_trajectory', 1 more joint; first "),
            std::string::npos)
      << outcome.out;
}

/// Nobody had seen before its end where a run writes.
TEST_F(Run, NamesItsLogInItsFirstLines) {
  const Outcome outcome = tandem("run hold.toml --duration 0.2");
  const std::size_t log = outcome.out.find("log: runs/double_pendulum-hold-001.mcap\n");
  EXPECT_NE(log, std::string::npos) << outcome.out;
  EXPECT_LT(log, outcome.out.find("100 %")) << outcome.out;
}

TEST_F(Run, OfAScenarioWithAMistakeDoesNotBegin) {
  std::ofstream(folder_ / "faults.toml")
      << "[[fault]]\nkind = \"encoder_unplug\"\njoint = \"joint3\"\n";
  const Outcome outcome = tandem("run hold.toml --scenario faults.toml");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("faults.toml:3: fault[0].joint: the robot has no joint 'joint3'"),
            std::string::npos)
      << outcome.err;
}

// The run went on, ended with status 0 and named a log that was not there.
TEST_F(Run, OfALogThatIsDeletedWarnsAtOnceAndIsNoSuccess) {
  for (const char* remove :
       {"rm -r logs", "rm logs/*.mcap", "cp $(ls logs/*.mcap) x && mv x logs/*.mcap"}) {
    const std::string command =
        "( while ! test -s logs/double_pendulum-hold-001.mcap; do sleep 0.02; done; sleep 0.2; " +
        std::string(remove) + " ) & " + shell_word(TANDEM_BINARY_DIR "/bin/tandem") +
        " run hold.toml --duration 3 --rate 2 --no-socket -q --log logs --json "
        "run.json "
        "2>err.txt; s=$?; wait; exit $s";
    const int raw = std::system(
        ("cd " + shell_word(folder_.string()) + " && rm -rf logs || exit 3; " + command).c_str());
    EXPECT_EQ(WEXITSTATUS(raw), 1) << remove;
    const std::string err = read_text(folder_ / "err.txt");
    EXPECT_NE(err.find("001.mcap: nothing is logged any more: its file was deleted during the run"),
              std::string::npos)
        << remove << ": " << err;
    EXPECT_NE(err.find("fault: the log lost "), std::string::npos) << err;
    EXPECT_LT(err.find("warning: "), err.find("fault: ")) << "while it goes on";
  }
}

/// A limit on a file's size, which every user may set, stands for the full disk.
TEST_F(Run, OfALogThatFillsItsDiskGoesOnWithoutIt) {
  const std::string begin = "ulimit -f 500 && ";
  const Outcome outcome = tandem(
      "run hold.toml --duration 3 --rate 4 --no-socket -q --log logs --json run.json", begin);
  EXPECT_EQ(outcome.status, 1) << outcome.err;
  for (const char* text : {"001.mcap: nothing is logged any more: File too large",
                           "fault: the log lost ", "the log is incomplete: File too large"}) {
    EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
  }
  EXPECT_LT(outcome.err.find("warning: "), outcome.err.find("fault: ")) << "while it goes on";
  const auto result = json("run.json");
  EXPECT_EQ(result["cycles"], 3000) << "the robot is controlled to the end";
  EXPECT_EQ(result["log"]["dropped"], 0);
  const Outcome info = tandem("log info logs/double_pendulum-hold-001.mcap");
  EXPECT_EQ(info.status, 0) << info.err;
  EXPECT_NE(info.out.find("/tandem/state"), std::string::npos) << info.out;
}

TEST_F(Run, WithoutALogWritesNone) {
  const auto json = run("hold.toml --duration 0.1 --no-log");
  EXPECT_TRUE(json["log"].is_null());
  EXPECT_FALSE(has_log());
}

TEST_F(Run, WritesATraceOfItsLastCycles) {
  const Outcome outcome =
      tandem("run hold.toml --duration 0.2 --no-log --rate 5 --trace t.json --trace-cycles 50");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("t.json (the last 50 of"), std::string::npos) << outcome.out;
  const auto trace = json("t.json");
  EXPECT_EQ(trace["otherData"]["cycles"], 50);
  EXPECT_EQ(trace["otherData"]["robot"], "double_pendulum");
  int cycles = 0;
  for (const auto& event : trace["traceEvents"]) cycles += event["name"] == "cycle" ? 1 : 0;
  EXPECT_EQ(cycles, 50);
}

TEST_F(Run, RefusesATraceThatCannotBeWrittenBeforeItRuns) {
  const Outcome outcome = tandem("run hold.toml --trace robot.toml/t.json");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("robot.toml/t.json"), std::string::npos) << outcome.err;
  EXPECT_FALSE(has_log());
  EXPECT_EQ(tandem("run hold.toml --trace-cycles 5").status, 2);
}

TEST_F(Run, RefusesToRecordFramesWithoutABus) {
  const Outcome outcome = tandem("run hold.toml --no-log --record-frames frames.log");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("--record-frames"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("--hal can"), std::string::npos) << outcome.err;
}

TEST_F(Run, EndsWithATableAndTheLogsPath) {
  const Outcome outcome = tandem("run hold.toml --duration 0.2");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  for (const std::string text : {"worst joints", "x real time",
                                 "runs/double_pendulum-hold-001.mcap", "0 dropped", "100 %"}) {
    EXPECT_NE(outcome.out.find(text), std::string::npos) << text << "\nin: " << outcome.out;
  }
}

TEST_F(Run, KeepsStandardOutputForTheJsonAlone) {
  const Outcome outcome = tandem("run hold.toml --duration 0.1 --json -");
  EXPECT_TRUE(nlohmann::json::accept(outcome.out)) << outcome.out;
  EXPECT_NE(outcome.err.find("worst joints"), std::string::npos);
}

TEST_F(Run, EveryBundledExperimentRunsAndEveryScenarioActs) {
  const std::map<std::string, std::string> acts{{"board_dies", "its board sends no feedback"},
                                                {"knee_encoder", "contradict each other"},
                                                {"noisy_bus", "cycles without its feedback"}};
  int runs = 0;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(TANDEM_SOURCE_DIR "/config")) {
    const std::filesystem::path& file = entry.path();
    if (file.extension() != ".toml" || file.filename().string().starts_with("robot")) continue;
    if (file.parent_path().filename() == "suite") continue;           // suite_test runs them whole
    if (file.parent_path().filename() == "studies") continue;         // of `sweep` and `search`
    const bool scenario = file.parent_path().filename() == "faults";  // of the squat beside it
    std::string what = shell_word(file.string());
    if (scenario) {
      what = shell_word((file.parent_path().parent_path() / "squat.toml").string()) +
             " --scenario " + what;
    }
    const Outcome outcome =
        tandem("run " + what + " --no-log --quiet --duration " + (scenario ? "6.5" : "0.2"));
    if (scenario) {
      ASSERT_TRUE(acts.contains(file.stem())) << file << ": what does it do?";
      EXPECT_NE(outcome.err.find(acts.at(file.stem())), std::string::npos) << file << "\n"
                                                                           << outcome.err;
    } else {
      EXPECT_EQ(outcome.status, 0) << file << "\n" << outcome.err;
    }
    ++runs;
  }
  EXPECT_GE(runs, 10);
}

}  // namespace
}  // namespace tandem::apps
