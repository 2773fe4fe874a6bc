// `tandem log replay` from the outside: a run and its replay have the same references; what was
// imported is played, too; reports lay both over each other.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <regex>

#include "log/log_file.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

constexpr double kLead_s = 3.5;  // to the first place, and to the first speed

class LogReplay : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    const Outcome run = tandem("run trajectory.toml --duration 2 --quiet --log logs");
    ASSERT_EQ(run.status, 0) << run.err;
  }
  /// Writes the experiment `replay.toml` of a log, and runs it. @return the log of this run
  std::string play(const std::string& log, const std::string& more = {}) const {
    const Outcome made = tandem("log replay " + log +
                                " --robot robot.toml --out replay.toml --json replay.json " + more);
    EXPECT_EQ(made.status, 0) << made.err;
    const Outcome run = tandem("run replay.toml --quiet --log again --json run.json");
    EXPECT_EQ(run.status, 0) << run.err;
    return json("run.json")["log"]["path"];
  }
  /// References of both joints.
  [[nodiscard]] log::TimeSeries columns(const std::string& log, const std::string& topic) const {
    const auto file = log::LogFile::open(folder_ / log);
    EXPECT_TRUE(file) << log;
    if (!file) return {};
    auto table = file->read(topic, {{"position_rad", 0}, {"position_rad", 1}});
    EXPECT_TRUE(table);
    return table ? *table : log::TimeSeries{};
  }
  /// How far `replay` is from `recorded` at most, both as long as the recording's motion.
  [[nodiscard]] double apart(const log::TimeSeries& recorded, const log::TimeSeries& replay) const {
    const auto played = json("replay.json");
    const double from_s = 1e-9 * played["from_ns"].get<double>();
    const double to_s = 1e-9 * played["to_ns"].get<double>();
    const double start_s = start_of(replay);
    EXPECT_NEAR(played["lead_in_s"].get<double>(), kLead_s, 1e-12);
    double most = 0.0;
    std::size_t compared = 0;
    for (std::size_t i = 0; i < recorded.time_s.size(); ++i) {
      const double time_s = recorded.time_s[i];
      if (time_s < from_s - 1e-9 || time_s > to_s + 1e-9) continue;
      const auto row =
          std::ranges::lower_bound(replay.time_s, time_s - from_s + start_s + kLead_s - 1e-9) -
          replay.time_s.begin();
      if (static_cast<std::size_t>(row) >= replay.time_s.size()) break;
      for (std::size_t j = 0; j < 2; ++j) {
        most = std::max(most, std::abs(recorded.columns[j][i] -
                                       replay.columns[j][static_cast<std::size_t>(row)]));
      }
      ++compared;
    }
    EXPECT_GT(compared, 100U);
    return most;
  }
  /// When the controllers started: the duration before the end.
  [[nodiscard]] double start_of(const log::TimeSeries&) const {
    const auto file =
        log::LogFile::open(folder_ / json("run.json")["log"]["path"].get<std::string>());
    const auto events = file->events();
    for (const log::EventText& one : *events) {
      if (one.event.kind == log::EventKind::kBringUpDone) {
        return 1e-9 * static_cast<double>(one.event.time_ns) + settle_s_;
      }
    }
    ADD_FAILURE() << "no bring-up";
    return 0.0;
  }
  const std::string recording_ = "logs/double_pendulum-trajectory-001.mcap";
  double settle_s_ = 1.0;  // by default, of the hoist
};

TEST_F(LogReplay, GivesTheRecordingsReferencesAgain) {
  const std::string run = play(recording_);
  // The same doubles in the same cycles: no tolerance.
  EXPECT_EQ(apart(columns(recording_, "/tandem/command"), columns(run, "/tandem/command")), 0.0);
  // The robot began elsewhere and rested before, so its springs and loops are in another state:
  // measured, both follow the references by a milliradian.
  EXPECT_LT(apart(columns(recording_, "/tandem/state"), columns(run, "/tandem/state")), 2e-3);
  const Outcome report = tandem("report " + recording_ + " " + run + " -o both");
  ASSERT_EQ(report.status, 0) << report.err;
  const std::string page = read_text(folder_ / "both/report.html");
  EXPECT_NE(page.find("3.500 s earlier, so that the replay lies over its recording"),
            std::string::npos)
      << page.substr(0, 3000);
  EXPECT_NE(page.find("Only what is played is drawn of B."), std::string::npos);
  EXPECT_FALSE(std::regex_search(page, std::regex("<text>-[0-9.]+ s</text>")))
      << "a posture before the recording's first time";
  EXPECT_NE(page.find("Replay B"), std::string::npos);
  EXPECT_NE(page.find("0.0000 deg"), std::string::npos) << "of the references";
  const Outcome turned = tandem("report " + run + " " + recording_ + " -o turned");
  ASSERT_EQ(turned.status, 0) << turned.err;
  EXPECT_NE(read_text(folder_ / "turned/report.html")
                .find("3.500 s later, so that the replay lies over its recording"),
            std::string::npos);
}

// From far away the approach takes longer than the experiment says: the report looks for the
// motion.
TEST_F(LogReplay, IsFoundWhereItsApproachTookLonger) {
  const Outcome made =
      tandem("log replay " + recording_ + " --robot robot.toml --out far.toml --from 2.2 --to 3");
  ASSERT_EQ(made.status, 0) << made.err;
  edit("far.toml", "approach_s = 3", "approach_s = 0.01");
  ASSERT_EQ(tandem("run far.toml --quiet --log again --json run.json").status, 0);
  const std::string run = json("run.json")["log"]["path"];
  const log::TimeSeries recorded = columns(recording_, "/tandem/command");
  const log::TimeSeries played = columns(run, "/tandem/command");
  const auto row = std::ranges::lower_bound(recorded.time_s, 2.5 - 1e-9) - recorded.time_s.begin();
  const auto at = static_cast<std::size_t>(row);
  std::size_t same = 0;  // the cycle with the same references
  while (same < played.time_s.size() && (played.columns[0][same] != recorded.columns[0][at] ||
                                         played.columns[1][same] != recorded.columns[1][at])) {
    ++same;
  }
  ASSERT_LT(same, played.time_s.size());
  const double later_s = played.time_s[same] - recorded.time_s[at];
  EXPECT_GT(std::abs(later_s - (start_of(played) + 0.51 - 2.2)), 0.05) << "it did take longer";
  ASSERT_EQ(tandem("report " + recording_ + " " + run + " -o both").status, 0);
  char moved[64];
  std::snprintf(moved, sizeof moved, "B is drawn %.3f s %s, so that the replay", std::abs(later_s),
                later_s > 0.0 ? "earlier" : "later");
  EXPECT_NE(read_text(folder_ / "both/report.html").find(moved), std::string::npos) << moved;
}

TEST_F(LogReplay, PlaysWhatWasMeasuredAndWhatWasImported) {
  const std::string run = play(recording_, "--source state");
  EXPECT_EQ(apart(columns(recording_, "/tandem/state"), columns(run, "/tandem/command")), 0.0);
  ASSERT_EQ(tandem("log csv " + recording_ + " --fields position_rad -o run.csv").status, 0);
  write_text(folder_ / "map.toml", R"(joints = ["joint1", "joint2"]
allow_frozen = true
[time]
column = "time_s"
unit = "s"
period_s = 0.004
begin_s = 1.5
[position]
columns = "position_rad.joint{1}"
unit = "rad"
)");
  ASSERT_EQ(tandem("log import run.csv --robot robot.toml --map map.toml -o in.mcap").status, 0);
  const std::string imported = play("in.mcap");
  EXPECT_EQ(json("replay.json")["source"], "state");
  // Every fourth cycle is a sample of the import.
  EXPECT_LT(apart(columns("in.mcap", "/tandem/state"), columns(imported, "/tandem/command")),
            1e-15);
  const Outcome report = tandem("report in.mcap " + imported + " -o both");
  ASSERT_EQ(report.status, 0) << report.err;
  EXPECT_NE(read_text(folder_ / "both/report.html").find("so that the replay lies over"),
            std::string::npos);
}

// What takes twice as long is twice as slow, in the cycle and in the measured motion.
TEST_F(LogReplay, PlaysAtHalfTheSpeed) {
  const std::string run = play(recording_, "--speed 0.5");
  EXPECT_EQ(json("replay.json")["speed"].get<double>(), 0.5);
  const log::TimeSeries recorded = columns(recording_, "/tandem/command");
  const log::TimeSeries played = columns(run, "/tandem/command");
  const double from_s = 1e-9 * json("replay.json")["from_ns"].get<double>();
  const double to_s = 1e-9 * json("replay.json")["to_ns"].get<double>();
  const double begin_s = start_of(played) + kLead_s;
  double most = 0.0;
  std::size_t compared = 0;
  for (std::size_t i = 0; i < recorded.time_s.size(); ++i) {
    if (recorded.time_s[i] < from_s - 1e-9 || recorded.time_s[i] > to_s + 1e-9) continue;
    const double time_s = begin_s + 2.0 * (recorded.time_s[i] - from_s);
    const auto row = std::ranges::lower_bound(played.time_s, time_s - 1e-9) - played.time_s.begin();
    if (static_cast<std::size_t>(row) >= played.time_s.size()) break;
    for (std::size_t j = 0; j < 2; ++j) {
      most = std::max(most, std::abs(recorded.columns[j][i] -
                                     played.columns[j][static_cast<std::size_t>(row)]));
    }
    ++compared;
  }
  EXPECT_GT(compared, 1000U);
  EXPECT_EQ(most, 0.0) << "every second cycle has the recording's own numbers";
  const Outcome report = tandem("report " + recording_ + " " + run + " -o both");
  ASSERT_EQ(report.status, 0) << report.err;
  const std::string page = read_text(folder_ / "both/report.html");
  char moved[128];
  const double later_s = from_s - 0.5 * begin_s;
  std::snprintf(moved, sizeof moved,
                "The times of B are multiplied by 0.5. B is drawn %.3f s %s, so that the replay",
                std::abs(later_s), later_s > 0.0 ? "later" : "earlier");
  EXPECT_NE(page.find(moved), std::string::npos) << moved << "\n" << page.substr(0, 3000);
  EXPECT_NE(page.find("Replay B"), std::string::npos);
  EXPECT_NE(page.find("0.0000 deg"), std::string::npos) << "of the references";
  ASSERT_EQ(tandem("report " + run + " " + recording_ + " -o turned").status, 0);
  const std::string turned = read_text(folder_ / "turned/report.html");
  EXPECT_NE(turned.find("The times of B are multiplied by 2."), std::string::npos);
  EXPECT_NE(turned.find("0.0000 deg"), std::string::npos);
}

// Between the recording's samples the run's references lie on its cubics.
TEST_F(LogReplay, IsFoundAtASpeedThatMeetsNoSample) {
  const std::string run = play(recording_, "--speed 0.77");
  ASSERT_EQ(tandem("report " + recording_ + " " + run + " -o both").status, 0);
  const std::string page = read_text(folder_ / "both/report.html");
  EXPECT_NE(page.find("The times of B are multiplied by 0.77. B is drawn "), std::string::npos);
  EXPECT_NE(page.find("Replay B"), std::string::npos);
}

// A replay was simulated by another integrator, with noise, without the damping of the links.
TEST_F(LogReplay, IsSimulatedAsTheRecordingWas) {
  edit("trajectory.toml", "seed = 1",
       "seed = 1\nperiod_ns = 2_000_000\nkernel_variant = \"baseline\"");
  edit("trajectory.toml", "[controller.parameters]",
       "[controller.parameters]\nlink_damping_Nms_rad = 0.05");
  std::ofstream(folder_ / "trajectory.toml", std::ios::app)
      << "\n[sim]\nengine = \"tandem\"\nintegrator = \"rk4\"\nsubstep_ns = 125_000\nnoise = false\n"
         "hoist.release_s = 0.5\n[hal]\ndelay_cycles = 2\nlockstep = false\n"
         "[faults]\nfall = \"allow\"\nretreat_s = 2\n[clock]\nrate = 0\n";
  const Outcome recorded = tandem("run trajectory.toml --duration 2 --seed 7 -q --log other");
  ASSERT_EQ(recorded.status, 0) << recorded.err;
  const std::string log = "other/double_pendulum-trajectory-001.mcap";
  const std::string run = play(log);
  const nlohmann::json carried{
      "seed",           "period_ns",           "sim.engine",     "sim.hoist.release_s",
      "sim.integrator", "sim.noise",           "sim.substep_ns", "hal.delay_cycles",
      "faults.fall",    "link_damping_Nms_rad"};
  EXPECT_EQ(json("replay.json")["carried"], carried);
  const std::string text = read_text(folder_ / "replay.toml");
  for (const char* line :
       {"period_ns = 2000000\nseed = 7\n",
        "[sim]\nengine = \"tandem\"\nhoist.release_s = 0.5\nintegrator = \"rk4\"\nnoise = false\n"
        "substep_ns = 125000\n",
        "[hal]\ndelay_cycles = 2\n", "[faults]\nfall = \"allow\"\n",
        "\nlink_damping_Nms_rad = 0.05\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << "in: " << text;
  for (const char* other : {"retreat_s", "lockstep", "clock", "variant"})
    EXPECT_EQ(text.find(other), std::string::npos) << other;
  ASSERT_EQ(tandem("report " + log + " " + run + " -o both").status, 0);
  const std::string page = read_text(folder_ / "both/report.html");
  EXPECT_NE(page.find("0.0000 deg"), std::string::npos) << "of the references";
  ASSERT_EQ(
      tandem("log replay " + log + " --robot robot.toml --out one.toml --joints joint2").status, 0);
  EXPECT_NE(read_text(folder_ / "one.toml").find("\nlink_damping_Nms_rad = 0.05\n"),
            std::string::npos);
  // A replay of the replay, too.
  ASSERT_EQ(tandem("log replay " + run + " --robot robot.toml --out two.toml").status, 0);
  EXPECT_NE(read_text(folder_ / "two.toml").find("[hal]\ndelay_cycles = 2\n"), std::string::npos);
  EXPECT_NE(read_text(folder_ / "two.toml").find("\nlink_damping_Nms_rad = 0.05\n"),
            std::string::npos);
  // By joint.
  edit("replay.toml", "link_damping_Nms_rad = 0.05", "link_damping_Nms_rad = [0.05, 0.025]");
  ASSERT_EQ(tandem("run replay.toml -q --log by_joint").status, 0);
  ASSERT_EQ(tandem("log replay by_joint/double_pendulum-replay-001.mcap --robot robot.toml --out "
                   "three.toml")
                .status,
            0);
  EXPECT_NE(read_text(folder_ / "three.toml")
                .find("\nlink_damping_Nms_rad = { \"joint1\" = 0.05, \"joint2\" = 0.025 }\n"),
            std::string::npos);
}

TEST_F(LogReplay, RefusesWithStatus2AndWritesNothing) {
  const std::string to = " --robot robot.toml --out replay.toml";
  const auto refused = [&](const std::string& arguments, const std::string& why) {
    const Outcome said = tandem("log replay " + arguments);
    EXPECT_EQ(said.status, 2) << arguments;
    EXPECT_NE(said.err.find(why), std::string::npos) << said.err;
    EXPECT_EQ(std::ranges::count(said.err, '\n'), 1) << said.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "replay.toml"));
  };
  refused("none.mcap" + to, "none.mcap");
  refused(recording_ + to + " --from 90", "there is nothing from 90.000 s");
  refused(recording_ + to + " --from 90", "correct --from and --to");
  refused(recording_ + to + " --from 3 --to 3.0001", "has fewer than two samples from 3.000 s");
  refused(recording_ + to + " --joints elbow", "the robot has no joint 'elbow'");
  refused(recording_ + to + " --joints joint1,joint1", "joint 'joint1' stands twice");
  refused(recording_ + to + " --speed 10", "joint 'joint");
  refused(recording_ + to + " --speed 10",
          "(play it slower (--speed), leave it out of --joints, play another stretch with --from "
          "and --to, or");
  refused(recording_ + to + " --speed 2 --torque", "--torque plays the torques of a slower motion");
  refused(recording_ + to + " --posture high", "the robot has no posture 'high'");
  refused(recording_ + " --robot " + shell_word(TANDEM_SOURCE_DIR "/config/ur5e/robot.toml") +
              " --out replay.toml",
          "is a recording of another robot");
  const std::string before = read_text(folder_ / "robot.toml");
  EXPECT_EQ(tandem("log replay " + recording_ + " --robot robot.toml --out robot.toml").status, 2);
  EXPECT_EQ(read_text(folder_ / "robot.toml"), before);
  const std::string cut = "cut.mcap";
  std::filesystem::copy_file(folder_ / recording_, folder_ / cut);
  std::filesystem::resize_file(folder_ / cut, std::filesystem::file_size(folder_ / cut) * 3 / 4);
  refused(cut + to, "the log is cut");
  // `tandem check` looks into the log, too: one that has been replaced, a limit that is lower now.
  ASSERT_EQ(tandem("log replay " + recording_ + to).status, 0);
  ASSERT_EQ(tandem("check replay.toml").status, 0);
  edit("replay.toml", "approach_s", "to_s = 90.0\napproach_s");
  const Outcome checked = tandem("check replay.toml");
  EXPECT_EQ(checked.status, 2);
  EXPECT_NE(checked.err.find("there is nothing from"), std::string::npos) << checked.err;
}

}  // namespace
}  // namespace tandem::apps
