// What recorded_motion plays of a log, and which logs it refuses before anything moves.
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <numbers>

#include "log/log_file.hpp"
#include "log/recorder.hpp"
#include "tests/controllers/harness.hpp"
#include "tests/hal/fake_backend.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kCycles = 1001;  // of 1 ms, unless it says other
constexpr double kLead_s = 3.0 + 0.5;

/// What joint `j` is commanded after t [s]. It rests at both ends.
double wanted(std::size_t j, double t) {
  const double x = 0.5 - 0.5 * std::cos(std::numbers::pi * t);
  return (0.2 + 0.1 * static_cast<double>(j)) * x * x - 0.3;
}
double speed(std::size_t j, double t) { return (wanted(j, t + 1e-6) - wanted(j, t - 1e-6)) / 2e-6; }

struct Cycle {
  hal::StateImage& state;
  hal::CommandImage& command;
  std::int64_t& time_ns;
  bool skip = false;
};
using Spoil = std::function<void(int cycle, Cycle&)>;

class RecordedMotion : public testing::Test {
 protected:
  /// Writes a log of the fake robot in which the state is 1 mrad behind the command.
  std::string record(const Spoil& spoil = {}, std::int64_t period_ns = 1'000'000,
                     int cycles = kCycles, bool commands = true) {
    const std::string path = folder_ / ("run" + std::to_string(count_++) + ".mcap");
    log::RunInfo info{.robot = "fake", .hal = hal_, .joints = joints_, .period_ns = period_ns};
    auto recorder = log::Recorder::open(path, info, {});
    EXPECT_TRUE(recorder);
    const hal::Robot robot = hal::robot_of(hal::test::fake_robot());
    hal::StateImage state(robot.shape());
    hal::CommandImage command(robot.shape());
    const auto states =
        (*recorder)->add_channel("/tandem/state", "tandem/msg/State", state.layout());
    const auto sent = commands ? (*recorder)->add_channel("/tandem/command", "tandem/msg/Command",
                                                          command.layout())
                               : states;
    (*recorder)->start();
    for (const log::Event& event : events_) (*recorder)->push(event);
    for (int i = 0; i < cycles; ++i) {
      std::int64_t time_ns = i * period_ns;
      const double t = static_cast<double>(time_ns) * 1e-9;
      for (std::size_t j = 0; j < 3; ++j) {
        command.position_rad()[j] = wanted(j, t);
        command.velocity_rad_s()[j] = speed(j, t);
        command.torque_Nm()[j] = 2.0 + static_cast<double>(j) + t;
        command.mode()[j] = static_cast<std::int8_t>(hal::ControlMode::kPosition);
        command.interaction()[j] = 0;
        state.position_rad()[j] = wanted(j, t) - 1e-3;
        state.velocity_rad_s()[j] = speed(j, t);
        state.torque_Nm()[j] = 1.0;
        state.age_cycles()[j] = 0;
      }
      Cycle cycle{state, command, time_ns};
      if (spoil) spoil(i, cycle);
      if (cycle.skip) continue;
      (*recorder)->wait_for_space(3);
      (*recorder)->push(states, time_ns, state.bytes());
      if (commands) (*recorder)->push(sent, time_ns, command.bytes());
    }
    EXPECT_EQ((*recorder)->close().error, "");
    return path;
  }

  /// "" or what is said of a log that is played with `more`, without the folder.
  std::string problem(const std::string& path, const std::string& more = {}) {
    std::string text =
        test::Harness(hal::test::fake_robot(), "recorded_motion", "log = '" + path + "'\n" + more)
            .problem();
    const auto at = text.find(path);
    if (at != std::string::npos) text.replace(at, path.size(), "LOG");
    return text;
  }

  test::ScratchFolder folder_;
  std::vector<std::string> joints_{"shoulder", "elbow", "wrist"};
  std::string hal_ = "import";
  std::vector<log::Event> events_;
  int count_ = 0;
};

TEST_F(RecordedMotion, LeadsToTheFirstPlacePlaysTheCommandsAndHolds) {
  test::Harness run(hal::test::fake_robot(), "recorded_motion", "log = '" + record() + "'\n");
  ASSERT_EQ(run.problem(), "");
  ASSERT_EQ(run.setup.claims().size(), 3U);
  run.state.position_rad()[1] = 0.9;
  run.start();
  double last = 0.9;
  for (int i = 0; i < 3500; ++i) {
    ASSERT_EQ(run.step(), Code::kOk);
    const double now = run.command.position_rad()[1];
    ASSERT_LE(std::abs(now - last), 0.5 * 2.0 * 1e-3 + 1e-12) << "half of its speed, at " << i;
    last = now;
  }
  EXPECT_EQ(run.command.position_rad()[1], wanted(1, 0.0));
  for (int i = 0; i < kCycles; ++i) {  // the same cycles, so the same numbers
    ASSERT_EQ(run.step(), Code::kOk);
    const double t = static_cast<double>(i * 1'000'000) * 1e-9;
    for (std::size_t j = 0; j < 3; ++j) {
      ASSERT_EQ(run.command.position_rad()[j], wanted(j, t)) << i;
      ASSERT_EQ(run.command.velocity_rad_s()[j], speed(j, t)) << i;
      ASSERT_EQ(run.command.torque_Nm()[j], 0.0) << i;
    }
  }
  ASSERT_EQ(run.run(2.0), Code::kOk);
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_EQ(run.command.position_rad()[j], wanted(j, 1.0));
    EXPECT_EQ(run.command.velocity_rad_s()[j], 0.0);
  }
}

TEST_F(RecordedMotion, TakesLongerFromFarAway) {
  test::Harness run(hal::test::fake_robot(), "recorded_motion",
                    "log = '" + record() + "'\napproach_s = 0.2\nstop_at_end = true\n");
  ASSERT_EQ(run.problem(), "");
  run.state.position_rad()[0] = 1.5;
  run.start();
  double last = 1.5;
  Code code = Code::kOk;
  int cycles = 0;
  while (code == Code::kOk) {
    code = run.step();
    ++cycles;
    ASSERT_LE(std::abs(run.command.position_rad()[0] - last), 1.0001e-3);
    last = run.command.position_rad()[0];
  }
  EXPECT_EQ(code, Code::kStopped);
  EXPECT_EQ(cycles, 3375 + 500 + kCycles + 500) << "1.8 rad with 1 rad/s at most";
}

TEST_F(RecordedMotion, PlaysWhatWasMeasuredWithoutCommands) {
  const std::string path = record({}, 1'000'000, kCycles, false);
  for (const char* source : {"", "source = 'state'\n"}) {
    test::Harness run(hal::test::fake_robot(), "recorded_motion",
                      "log = '" + path + "'\ntorque = true\n" + source);
    ASSERT_EQ(run.problem(), "");
    run.start();
    ASSERT_EQ(run.run(kLead_s + 0.501), Code::kOk);
    EXPECT_EQ(run.command.position_rad()[2], wanted(2, 0.5) - 1e-3);
    EXPECT_EQ(run.command.torque_Nm()[2], 1.0);
  }
  EXPECT_EQ(problem(path, "source = 'command'\n"),
            "experiment.toml:1: log: LOG: the recording has no commands (play what was measured: "
            "source = \"state\")");
}

TEST_F(RecordedMotion, BrakesTheSwingOfLinksOnRequest) {
  const std::string path = record();
  const std::string play = "log = '" + path + "'\ntorque = true\n";
  for (const bool each : {false, true}) {
    for (const double after_s : {0.001, kLead_s + 0.5, 6.0}) {  // on its way, playing, at the end
      test::Harness without(hal::test::fake_robot(), "recorded_motion", play);
      test::Harness run(hal::test::fake_robot(), "recorded_motion",
                        play + "link_damping_Nms_rad = " + (each ? "{ wrist = 4 }\n" : "4.0\n"));
      ASSERT_EQ(run.problem(), "");
      without.start();
      ASSERT_EQ(without.run(after_s), Code::kOk);
      run.start();
      for (std::size_t j = 0; j < 3; ++j)
        run.state.velocity_rad_s()[j] = without.command.velocity_rad_s()[j] + 0.5;
      ASSERT_EQ(run.run(after_s), Code::kOk);
      for (std::size_t j = 0; j < 3; ++j) {
        const double damped_Nm = each && j != 2 ? 0.0 : 2.0;
        EXPECT_NEAR(run.command.torque_Nm()[j], without.command.torque_Nm()[j] - damped_Nm, 1e-9)
            << j << " after " << after_s;
      }
    }
  }
  EXPECT_NE(problem(path, "link_damping_Nms_rad = { wirst = 4 }\n").find("wrist"),
            std::string::npos);
  EXPECT_NE(problem(path, "link_damping_Nms_rad = -1\n"), "");
}

TEST_F(RecordedMotion, PutsOtherPeriodsOnTheRunsCycles) {
  const std::string path = record({}, 8'000'000, 126);
  test::Harness run(hal::test::fake_robot(), "recorded_motion",
                    "log = '" + path + "'\ntorque = true\n");
  ASSERT_EQ(run.problem(), "");
  run.start();
  ASSERT_EQ(run.run(kLead_s), Code::kOk);
  for (int i = 0; i < 1001; ++i) {
    ASSERT_EQ(run.step(), Code::kOk);
    const double t = i * 1e-3;
    // Between samples 8 ms apart a cubic, whose slopes at them are off by h^2 / 6 times the third
    // derivative, which is 19 at most; and of the velocity a line.
    ASSERT_NEAR(run.command.position_rad()[2], wanted(2, t), i % 8 == 0 ? 1e-15 : 2e-5) << i;
    ASSERT_NEAR(run.command.velocity_rad_s()[2], speed(2, t), 1.5e-4) << i;  // h^2 / 8 times 19
    ASSERT_NEAR(run.command.torque_Nm()[2], 4.0 + t, 1e-12) << i;
  }
}

TEST_F(RecordedMotion, PlaysSlowerAndFasterThanItWasRecorded) {
  const std::string path = record();
  for (const double times : {0.5, 1.25, 0.37}) {
    test::Harness run(hal::test::fake_robot(), "recorded_motion",
                      "log = '" + path + "'\nspeed = " + std::to_string(times) + "\n");
    ASSERT_EQ(run.problem(), "") << times;
    run.start();
    ASSERT_EQ(run.run(kLead_s), Code::kOk);
    double last = wanted(1, 0.0);
    int cycles = 0;
    for (double t = 0.0; t <= 1.0; t = ++cycles * 1e-3 * times) {
      ASSERT_EQ(run.step(), Code::kOk);
      const double now = run.command.position_rad()[1];
      ASSERT_NEAR(now, wanted(1, t), 1e-6) << times << " " << t;
      ASSERT_NEAR(run.command.velocity_rad_s()[1], times * speed(1, t), 1e-5) << times << " " << t;
      // The velocity is that of the positions played: their difference, half a cycle before.
      if (cycles > 0) {
        ASSERT_NEAR((now - last) * 1e3, times * speed(1, t - 0.5e-3 * times), 1e-3) << times;
      }
      last = now;
    }
    EXPECT_EQ(cycles, static_cast<int>(std::floor(1.0 / (1e-3 * times) + 1e-6)) + 1);
    ASSERT_EQ(run.run(1.0), Code::kOk);
    EXPECT_NEAR(run.command.position_rad()[1], wanted(1, 1.0), 1e-5) << times;
    EXPECT_EQ(run.command.velocity_rad_s()[1], 0.0);
  }
}

TEST_F(RecordedMotion, RefusesASpeedThatAJointHasNot) {
  const std::string path = record();
  EXPECT_EQ(problem(path, "speed = 4.0\n"),
            "experiment.toml:1: log: LOG: joint 'elbow' would move with 2.0103 rad/s at 0.524 s "
            "of the recording, its limits are -2 and 2 (play it slower (speed), leave it out of "
            "`joints`, play another stretch with from_s and to_s, or correct the limits of "
            "robot.toml)");
  for (const char* outside : {"0.0", "-1.0", "0.009", "10.1", "nan", "'fast'"}) {
    EXPECT_NE(problem(path, std::string("speed = ") + outside + "\n"), "") << outside;
  }
  EXPECT_NE(problem(path, "speed = 1.1\ntorque = true\n")
                .find("torque: the recorded torques are those of a slower motion"),
            std::string::npos)
      << problem(path, "speed = 1.1\ntorque = true\n");
  EXPECT_EQ(problem(path, "speed = 0.9\ntorque = true\n"), "");
}

TEST_F(RecordedMotion, RunsUpToARecordingThatBeginsAndEndsInMotion) {
  const std::string path = record();
  test::Harness run(hal::test::fake_robot(), "recorded_motion",
                    "log = '" + path + "'\nfrom_s = 0.4\nto_s = 0.6\n");
  ASSERT_EQ(run.problem(), "");
  run.start();
  double last = 0.0, last_speed = 0.0;
  for (int i = 0; i < 5000; ++i) {
    ASSERT_EQ(run.step(), Code::kOk);
    const double now = (run.command.position_rad()[1] - last) * 1e3;
    last = run.command.position_rad()[1];
    if (i == 3500) {
      EXPECT_NEAR(last, wanted(1, 0.4), 1e-15);
    }
    if (i > 1) {
      ASSERT_NEAR(now, last_speed, 0.02) << i;
    }
    last_speed = i == 0 ? 0.0 : now;
  }
  EXPECT_NEAR(last_speed, 0.0, 1e-12);
}

TEST_F(RecordedMotion, ContinuesFromItsArchive) {
  test::Harness run(hal::test::fake_robot(), "recorded_motion", "log = '" + record() + "'\n");
  run.start();
  ASSERT_EQ(run.run(3.7), Code::kOk);
  Archive saved;
  run.controller().archive(saved);
  const hal::CycleTime time = run.time;
  ASSERT_EQ(run.step(), Code::kOk);
  const double next = run.command.position_rad()[1];
  run.state.position_rad()[1] = 1.0;
  run.start();
  Archive restored(saved.bytes());
  run.controller().archive(restored);
  run.time = time;
  ASSERT_EQ(run.step(), Code::kOk);
  EXPECT_EQ(run.command.position_rad()[1], next);
}

TEST_F(RecordedMotion, RefusesLogsThatLackSomething) {
  EXPECT_EQ(problem(folder_ / "none.mcap").find("experiment.toml:1: log: LOG: cannot"), 0U)
      << problem(folder_ / "none.mcap");
  EXPECT_EQ(problem(record({}, 1'000'000, 0)),
            "experiment.toml:1: log: LOG: has 0 messages of /tandem/command: there is no motion to "
            "play (give the log of a longer run)");
  EXPECT_EQ(problem(record([](int i, Cycle& c) { c.skip = i > 300 && i < 330; })),
            "experiment.toml:1: log: LOG: joint 'shoulder' has a gap: nothing of it was recorded "
            "after this time at 0.300 s (play another stretch: from_s and to_s)");
  const std::string old = record([](int i, Cycle& c) {
    c.state.age_cycles()[1] = i > 300 && i < 330 ? static_cast<std::uint32_t>(i - 300) : 0;
  });
  EXPECT_EQ(problem(old, "joints = ['shoulder', 'elbow']\nsource = 'state'\n"),
            "experiment.toml:1: log: LOG: joint 'elbow' has a gap: nothing of it was recorded "
            "after this time at 0.300 s (play another stretch: from_s and to_s)");
  EXPECT_EQ(problem(old, "joints = ['shoulder']\nsource = 'state'\n"), "");
  EXPECT_EQ(problem(record([](int i, Cycle& c) {
                      if (i == 123) c.state.position_rad()[2] = kNaN;
                    }),
                    "source = 'state'\n"),
            "experiment.toml:1: log: LOG: joint 'wrist' has no position at 0.123 s (leave it out "
            "of `joints`, or play another stretch: from_s and to_s)");
  EXPECT_EQ(problem(record([](int i, Cycle& c) {
                      if (i == 123) c.command.torque_Nm()[2] = kNaN;
                    }),
                    "torque = true\n"),
            "experiment.toml:1: log: LOG: joint 'wrist' has no torque at 0.123 s (play it without: "
            "torque = false)");
  EXPECT_EQ(problem(record([](int i, Cycle& c) {
              if (i >= 500) c.time_ns -= 200'000'000;
            })),
            "experiment.toml:1: log: LOG: time goes backwards: 0.300 s after 0.499 s (the log is "
            "damaged, or two were joined: record it again)");
}

// Nearly all of it would be made up.
TEST_F(RecordedMotion, RefusesFarMoreCyclesThanSamples) {
  const std::string few = record({}, 20'000'000, 3);
  EXPECT_EQ(problem(few, "speed = 0.02\n"), "");
  EXPECT_EQ(problem(few, "speed = 0.01\n"),
            "experiment.toml:1: log: LOG: the recording has 3 samples for 4001 cycles of the run "
            "(play a recording with more samples, or a shorter stretch: from_s and to_s)");
}

TEST_F(RecordedMotion, PlaysARunFromTheStartOfItsControllersAndNotPastAFault) {
  hal_ = "sim";
  EXPECT_EQ(problem(record()),
            "experiment.toml:1: log: LOG: its controllers never ran (give the log of a run that "
            "began)");
  events_ = {{.cycle = 100, .time_ns = 100'000'000, .kind = log::EventKind::kBringUpDone}};
  test::Harness run(hal::test::fake_robot(), "recorded_motion", "log = '" + record() + "'\n");
  ASSERT_EQ(run.problem(), "");
  run.start();
  ASSERT_EQ(run.run(kLead_s + 0.001), Code::kOk);
  EXPECT_EQ(run.command.position_rad()[0], wanted(0, 0.1));
  events_.push_back({.cycle = 700, .time_ns = 700'000'000, .kind = log::EventKind::kFault});
  const std::string path = record();
  EXPECT_EQ(problem(path),
            "experiment.toml:1: log: LOG: its run met a fault at 0.700 s (play what was before: "
            "to_s)");
  EXPECT_EQ(problem(path, "to_s = 0.6\n"), "");
  events_.back().reported = 1;  // such as a collision that only warns
  EXPECT_EQ(problem(record()), "");
}

TEST_F(RecordedMotion, RefusesCommandsThatLedNoPosition) {
  EXPECT_EQ(problem(record([](int i, Cycle& c) {
              if (i == 50)
                c.command.mode()[1] = static_cast<std::int8_t>(hal::ControlMode::kTorque);
            })),
            "experiment.toml:1: log: LOG: joint 'elbow' was not led by position, but in mode "
            "torque at 0.050 s (play what was measured: source = \"state\")");
  EXPECT_EQ(problem(record([](int i, Cycle& c) {
              if (i == 50) c.command.interaction()[1] = 1;
            })),
            "experiment.toml:1: log: LOG: joint 'elbow' was compliant: its reference is not where "
            "it went at 0.050 s (play what was measured: source = \"state\")");
}

TEST_F(RecordedMotion, RefusesWhatItsRobotCannotDo) {
  EXPECT_EQ(
      problem(record([](int, Cycle& c) { c.command.position_rad()[0] += 1.7; })),
      "experiment.toml:1: log: LOG: joint 'shoulder' would be at 1.50002 rad at 0.636 s of the "
      "recording, its limits are -1.5 and 1.5 (leave it out of `joints`, play another "
      "stretch with from_s and to_s, or correct the limits of robot.toml)");
  EXPECT_EQ(
      problem(record([](int i, Cycle& c) {
        if (i >= 500) c.command.position_rad()[0] += 0.0021;
      })).substr(0, 86),
      "experiment.toml:1: log: LOG: joint 'shoulder' would move with 2.41367 rad/s at 0.500 s");
  EXPECT_NE(
      problem(record([](int, Cycle& c) { c.command.torque_Nm()[1] = 21.0; }), "torque = true\n")
          .find("joint 'elbow' would get 21 Nm 0.500 s before the recording, on the way to its "
                "first speed"),
      std::string::npos);
  // "at 1.499 s of the recording", which ends at 1.0
  EXPECT_NE(problem(record([](int i, Cycle& c) {
              c.command.position_rad()[0] = 1.498 + std::min(0.0, 1.5e-3 * (i - kCycles));
            })).find(" s after the recording, on the way to rest, its limits"),
            std::string::npos);
  joints_ = {"shoulder", "elbow", "hand"};
  const std::string other = record();
  EXPECT_EQ(problem(other),
            "experiment.toml:1: log: LOG: is a recording of another robot: this one has no joint "
            "'hand' (name those that both have in `joints`)");
  EXPECT_EQ(problem(other, "joints = ['shoulder', 'elbow']\n"), "");
  EXPECT_NE(problem(other, "joints = ['wrist']\n").find("the recording has no joint 'wrist'"),
            std::string::npos);
  EXPECT_NE(problem(other, "joints = ['hand']\n").find("the robot has no joint 'hand'"),
            std::string::npos);
}

TEST_F(RecordedMotion, RefusesALogThatIsCutOrAnother) {
  const std::string whole = record();
  const std::string cut = folder_ / "cut.mcap";
  std::filesystem::copy_file(whole, cut);
  std::filesystem::resize_file(cut, std::filesystem::file_size(whole) * 9 / 10);
  const std::string said = problem(cut);
  EXPECT_NE(said.find("the log is cut: its run was killed, or the copy is not whole"),
            std::string::npos)
      << said;
  EXPECT_EQ(problem(cut, "to_s = 0.2\n"), "");
  EXPECT_EQ(problem(whole, "data_sha256 = 'abc'\n"),
            "experiment.toml:1: log: LOG: is another recording than the one that data_sha256 names "
            "(write the experiment again with `tandem log replay`, or remove data_sha256)");
  EXPECT_EQ(problem(whole, "data_sha256 = '" + log::LogFile::open(whole)->data_sha256() + "'\n"),
            "");
  EXPECT_EQ(problem(whole, "to_s = 3\n"),
            "experiment.toml:1: log: LOG: there is nothing from 0.000 s to 3.000 s (the log goes "
            "from 0.000 s to 1.000 s: correct from_s and to_s)");
}

}  // namespace
}  // namespace tandem
