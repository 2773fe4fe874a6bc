// Both processes on the wall clock: SYNC paces the boards, whose own clocks go on without it.
#include <gtest/gtest.h>
#include <linux/can/error.h>

#include <algorithm>
#include <atomic>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/hil/relay.hpp"
#include "tests/hil/witness.hpp"

namespace tandem::test {
namespace {

/// The double pendulum at 100 Hz, patient enough for a machine that does other things as well.
class RealTime : public OwnFolder {
 protected:
  static constexpr double kPeriodS = 0.01;
  static constexpr std::size_t kBringUpSyncs = 20;  // more of them without an answer: bring-up

  void SetUp() override {
    const std::filesystem::path source = TANDEM_SOURCE_DIR "/config/double_pendulum";
    std::filesystem::copy_file(source / "double_pendulum.urdf", folder_ / "double_pendulum.urdf");
    write_robot(text_of(source / "robot.toml"));
    write("hold.toml", text_of(source / "hold.toml"), "seed = 1",
          "seed = 1\nperiod_ns = 10_000_000");
  }
  void write_robot(const std::string& text) const {
    write("robot.toml", text, "slow_pdo_every = 4",
          "slow_pdo_every = 4\nheartbeat_ms = 1000\ncommand_timeout_cycles = 1000");
  }
  /// Every `from` becomes `to`.
  void write(const std::string& name, std::string text, const std::string& from,
             const std::string& to) const {
    std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << name << " has no '" << from << "'";
    for (; at != std::string::npos; at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
    std::ofstream(folder_ / name) << text;
  }
  [[nodiscard]] std::vector<std::string> run_words(const std::string& duration_s) const {
    return tandem({"run", file("hold.toml"), "--hal", "can", "--on-fault", "end", "--no-log",
                   "--no-socket", "--duration", duration_s, "--json", file("run.json")});
  }
  [[nodiscard]] std::vector<std::string> emulate_words() const {
    return tandem({"emulate", file("hold.toml"), "--no-socket", "--json", file("emulate.json")});
  }
  /// A run of a second, on a wire that passes one frame after the other.
  void expect_a_run_over_a_wire(const hal::can::BitRates& rates);
  [[nodiscard]] std::string file(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] nlohmann::json json(const std::string& name) const {
    return nlohmann::json::parse(text_of(folder_ / name));
  }
};

TEST_F(RealTime, SyncFollowsTheWallClockAndEveryNodeAnswers) {
  Candump candump("can0", folder_ / "candump.log");
  Process robot(emulate_words(), folder_ / "emulate.txt");
  ASSERT_TRUE(robot.says("Ctrl-C ends it")) << robot.output();
  for (int time = 0; time < 2; ++time) {  // the second finds the robot as the first one left it
    Process master(run_words("1"), folder_ / "run.txt");
    EXPECT_EQ(master.wait(), 0) << master.output();
    EXPECT_NE(master.output().find("over CAN, in real time"), std::string::npos);
    EXPECT_GT(json("run.json")["cycles"].get<int>(), 0)
        << "100, less those that this machine slept through";
  }
  EXPECT_EQ(robot.interrupt(), 0) << robot.output();
  const nlohmann::json emulated = json("emulate.json");
  EXPECT_GT(emulated["steps_without_sync"].get<int>(), 0) << "between the runs";
  EXPECT_EQ(emulated["frames_lost"], 0);

  std::vector<double> syncs;
  std::size_t asked = 0, answered = 0, since = 0;
  for (const LoggedFrame& frame : candump.stop()) {
    if (frame.id() == "080") {
      syncs.push_back(frame.time_s);
      ++since;
    } else if (frame.id() == "181") {
      if (since <= kBringUpSyncs) asked += since;
      if (since <= kBringUpSyncs && since > 0) ++answered;
      since = 0;
    }
  }
  ASSERT_GT(syncs.size(), 200U);
  EXPECT_GT(answered, 200U);
  EXPECT_GT(static_cast<double>(answered), 0.6 * static_cast<double>(asked)) << asked;

  // Between the runs there is time for many cycles, so the whole says nothing of the pace.
  std::vector<double> periods_s;
  for (std::size_t i = 1; i < syncs.size(); ++i) periods_s.push_back(syncs[i] - syncs[i - 1]);
  std::ranges::nth_element(periods_s, periods_s.begin() + std::ssize(periods_s) / 2);
  EXPECT_GT(periods_s[periods_s.size() / 2], 0.9 * kPeriodS);
  for (std::size_t i = 100; i < syncs.size(); ++i) {  // late ones and no burst that makes up for it
    ASSERT_GT(syncs[i] - syncs[i - 100], 0.5 * 100.0 * kPeriodS) << "SYNC " << i;
  }
}

void RealTime::expect_a_run_over_a_wire(const hal::can::BitRates& rates) {
  const Relay wire("can0", "can1", rates);
  std::vector<std::string> words = emulate_words();
  words.insert(words.end(), {"--interface", "can0=can1"});
  Process robot(words, folder_ / "emulate.txt");
  ASSERT_TRUE(robot.says("Ctrl-C ends it")) << robot.output();
  // A machine that stops for more than 0.1 s loses a run's feedback rightly; a wait that ends too
  // early loses every run's.
  constexpr int kRuns = 3;
  for (int run = 1; run <= kRuns; ++run) {
    Process master(run_words("1"), folder_ / "run.txt");
    const int status = master.wait();
    if (status != 0 && run < kRuns) continue;
    EXPECT_EQ(status, 0) << master.output();
    EXPECT_GT(json("run.json")["cycles"].get<int>(), 0) << master.output();
    break;
  }
  EXPECT_EQ(robot.interrupt(), 0) << robot.output();
  EXPECT_GT(wire.passed(), 100U);
}

TEST_F(RealTime, RunsOverAWireThatPassesOneFrameAtATime) {
  expect_a_run_over_a_wire({.nominal = 1'000'000, .data = 8'000'000});
}

// A board's sample takes two frames there; the second had always been taken for late.
TEST_F(RealTime, RunsOverAClassicWireThatPassesOneFrameAtATime) {
  std::string robot = text_of(TANDEM_SOURCE_DIR "/config/double_pendulum_classic/robot.toml");
  const std::string urdf = "../double_pendulum/double_pendulum.urdf";
  write_robot(robot.replace(robot.find(urdf), urdf.size(), "double_pendulum.urdf"));
  expect_a_run_over_a_wire({.nominal = 1'000'000, .data = 1'000'000});
}

// It had been let in, had reset the nodes, and had taken the torque from the running robot.
TEST_F(RealTime, ASecondMasterIsNotLetIn) {
  Process robot(emulate_words(), folder_ / "emulate.txt");
  ASSERT_TRUE(robot.says("Ctrl-C ends it")) << robot.output();
  Process master(run_words("20"), folder_ / "run.txt");
  EXPECT_TRUE(master.says(" 10 %")) << master.output();
  Process second(run_words("1"), folder_ / "second.txt");
  EXPECT_EQ(second.wait(), 2);
  EXPECT_NE(second.output().find("can0 has its master already: process "), std::string::npos)
      << second.output();
  EXPECT_EQ(master.interrupt(), 130) << master.output();

  std::atomic<bool> over{false};
  std::thread foreign([&over] {  // of another computer: no lock shows it
    const RawCan other("can0");
    while (!over) {
      other.write(0x080, {});
      ::usleep(10'000);
    }
  });
  Process third(run_words("1"), folder_ / "third.txt");
  EXPECT_EQ(third.wait(), 2);
  EXPECT_NE(third.output().find("another master is at work on can0: it sends SYNC (080)"),
            std::string::npos)
      << third.output();
  over = true;
  foreign.join();
  EXPECT_EQ(robot.interrupt(), 0) << robot.output();
}

// The boards were safe by their own time-out, the process hung for ever and nobody was told.
TEST_F(RealTime, ALoopThatHangsIsEndedAndEveryNodeIsStopped) {
  write("hold.toml", text_of(folder_ / "hold.toml"), "plugin = \"hold\"",
        "plugin = \"" TANDEM_BINARY_DIR "/tests/test_plugins/hangs.so\"");
  Candump candump("can0", folder_ / "candump.log");
  Process robot(emulate_words(), folder_ / "emulate.txt");
  ASSERT_TRUE(robot.says("Ctrl-C ends it")) << robot.output();
  Process master(run_words("100"), folder_ / "run.txt");
  EXPECT_EQ(master.wait(), 1);
  for (const char* text :
       {"fault: the loop hangs: no cycle for 0.5 s, it is in the controller "
        "'hangs'. The emergency stop is latched; NMT stop is sent on can0; ",
        "fault: the loop hung in the controller 'hangs' and did not come back"}) {
    EXPECT_NE(master.output().find(text), std::string::npos) << text << "\nin: " << master.output();
  }
  EXPECT_EQ(robot.interrupt(), 0) << robot.output();
  double stopped_s = 0.0, last_sync_s = 0.0;
  for (const LoggedFrame& frame : candump.stop()) {
    if (frame.text == "can0 000#0200") stopped_s = frame.time_s;
    if (frame.id() == "080") last_sync_s = frame.time_s;
  }
  EXPECT_GT(stopped_s, last_sync_s) << "and no SYNC comes any more";
}

TEST_F(RealTime, TellsOfAnIllBusAndEndsWhenItsInterfaceIsTakenDown) {
  Process robot(emulate_words(), folder_ / "emulate.txt");
  ASSERT_TRUE(robot.says("Ctrl-C ends it")) << robot.output();
  Process master(run_words("10"), folder_ / "run.txt");
  EXPECT_TRUE(master.says(" 10 %")) << master.output();
  const RawCan controller("can0");
  controller.write(CAN_ERR_FLAG | CAN_ERR_CRTL, {0, CAN_ERR_CRTL_TX_PASSIVE, 0, 0, 0, 0, 0, 0});
  EXPECT_TRUE(master.says("note: CAN interface can0 is error-passive")) << "and the run goes on";
  controller.write(CAN_ERR_FLAG | CAN_ERR_CRTL, {0, CAN_ERR_CRTL_ACTIVE, 0, 0, 0, 0, 0, 0});
  EXPECT_TRUE(master.says("note: interface can0 is well again"));
  shell("ip link set can0 down");
  EXPECT_EQ(master.wait(), 1);
  shell("ip link set can0 up");
  EXPECT_NE(master.output().find("can0 is down"), std::string::npos) << master.output();

  Process again(run_words("0.5"), folder_ / "again.txt");  // the same robot, without a restart
  EXPECT_EQ(again.wait(), 0) << again.output();
  EXPECT_EQ(robot.interrupt(), 0) << robot.output();
  EXPECT_EQ(json("emulate.json")["buses"][0]["recoveries"], 1);
  EXPECT_EQ(json("emulate.json")["buses"][0]["status"], "");
}

}  // namespace
}  // namespace tandem::test
