// Robots on EtherCAT: in process, and master and boards in two processes on a cable of a network of
// the test's own.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <map>
#include <thread>

#include "ethercat/datagram.hpp"
#include "hal/ethercat-can/line/packet_link.hpp"
#include "tests/apps/program.hpp"
#include "tests/ethercat/own_network.hpp"
#include "tests/hil/process.hpp"
#include "tests/support/needs_root.hpp"

namespace tandem::apps {
namespace {

using test::in_own_network;
using test::kNoNetwork;
using test::Process;

class LineRun : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    const std::string fd = "fd = true\nbitrate = 1_000_000\ndata_bitrate = 8_000_000\n";
    edit("robot.toml", fd, "kind = \"ethercat\"\n");
    edit("robot.toml", "interface = \"can0\"", "interface = \"eth1\"");
  }
  [[nodiscard]] std::string file(const std::string& name) const { return folder_ / name; }

  /// Master and boards at both ends of a cable. @return the child's exit status
  /// @param capture  a file for all that tshark sees on the cable; empty: none
  int run_over_cable(const std::string& experiment, const std::vector<std::string>& more,
                     bool lockstep, const std::string& capture = {}) {
    return in_own_network([&] {
      std::unique_ptr<Process> witness;
      if (!capture.empty()) {
        witness = std::make_unique<Process>(
            std::vector<std::string>{"tshark", "-i", test::kMasterEnd, "-w", capture},
            file("tshark.txt"));
        EXPECT_TRUE(witness->says("Capturing")) << witness->output();
      }
      std::vector<std::string> emulate = {
          "emulate",     experiment, "--interface",      "eth1=" + std::string(test::kSlaveEnd),
          "--no-socket", "--json",   file("boards.json")};
      std::vector<std::string> run = {
          "run",         experiment,    "--hal",
          "ethercat",    "--interface", "eth1=" + std::string(test::kMasterEnd),
          "--no-socket", "--json",      file("run.json")};
      run.insert(run.end(), more.begin(), more.end());
      for (auto* words : {&emulate, &run}) {
        if (lockstep) words->push_back("--lockstep");
      }
      Process boards(test::tandem(emulate), file("boards.txt"));
      EXPECT_TRUE(boards.says("Ctrl-C")) << boards.output();
      Process master(test::tandem(run), file("run.txt"));
      EXPECT_EQ(master.wait(), 0) << master.output();
      EXPECT_EQ(boards.interrupt(), 0) << boards.output();
      if (witness != nullptr) {
        EXPECT_EQ(witness->interrupt(), 0) << witness->output();
      }
    });
  }
};

TEST_F(LineRun, ASquatOverACableIsTheInProcessRunBitForBit) {
  const std::string squat = TANDEM_SOURCE_DIR "/config/coman/squat_ethercat.toml";
  const Outcome alone = tandem("run " + shell_word(squat) + " --duration 1 --no-socket -q --log " +
                               shell_word(file("in_process")) + " --json in.json");
  ASSERT_EQ(alone.status, 0) << alone.err;
  EXPECT_EQ(json("in.json")["faults"].size(), 0U);
  const int status =
      run_over_cable(squat, {"--duration", "1", "-q", "--log", file("over_cable")}, true);
  if (status == kNoNetwork) GTEST_SKIP() << test::needs_root("a network of its own");
  ASSERT_EQ(status, 0);
  const std::string log = "/coman-squat_ethercat-001.mcap";
  const Outcome diff = tandem("log diff in_process" + log + " over_cable" + log + " --json -");
  EXPECT_EQ(diff.status, 0) << diff.out;
  EXPECT_EQ(json("run.json")["hal"], "ethercat lockstep");
  const auto cycles = nlohmann::json::parse(diff.out)["topics"]["/tandem/state"]["messages"][0];
  EXPECT_GT(cycles, 1500) << "from power-on to the end";
  EXPECT_EQ(json("boards.json")["steps"], cycles);
}

/// Drives of another maker, by their ESI alone.
TEST_F(LineRun, DrivesOfAnotherMakerMoveTheSameInProcessAndOverACable) {
  const std::string experiment =
      TANDEM_SOURCE_DIR "/config/double_pendulum_ethercat/trajectory.toml";
  const Outcome alone = tandem("run " + shell_word(experiment) + " --duration 2 --no-socket -q " +
                               "--log " + shell_word(file("in_process")) + " --json in.json");
  ASSERT_EQ(alone.status, 0) << alone.err;
  const int status =
      run_over_cable(experiment, {"--duration", "2", "-q", "--log", file("over_cable")}, true);
  if (status == kNoNetwork) GTEST_SKIP() << test::needs_root("a network of its own");
  ASSERT_EQ(status, 0);
  const std::string log = "/double_pendulum-trajectory-001.mcap";
  const Outcome diff = tandem("log diff in_process" + log + " over_cable" + log + " --json -");
  EXPECT_EQ(diff.status, 0) << diff.out;
}

/// Beside a robot at the other end of the cable, its exact twin in the master's process.
TEST_F(LineRun, ATwinOfARobotOverACableIsTheSameToTheLastBit) {
  edit("trajectory.toml", "[[controller]]", "[parallel]\n[[controller]]");
  const int status =
      run_over_cable(file("trajectory.toml"), {"--duration", "1", "-q", "--no-log"}, true);
  if (status == kNoNetwork) GTEST_SKIP() << test::needs_root("a network of its own");
  ASSERT_EQ(status, 0);
  const auto parallel = json("run.json")["parallel"];
  EXPECT_EQ(parallel["unequal"], 0) << "first in cycle " << parallel["first_unequal"];
  EXPECT_GT(parallel["compared"].get<int>(), 1000);
}

/// A master that was there first, on the same end of the cable: a frame every 2 ms.
TEST_F(LineRun, DoesNotTakeSlavesFromAMasterThatIsAtWork) {
  const int status = in_own_network([&] {
    Process boards(test::tandem({"emulate", file("hold.toml"), "--interface",
                                 "eth1=" + std::string(test::kSlaveEnd), "--no-socket"}),
                   file("boards.txt"));
    ASSERT_TRUE(boards.says("Ctrl-C")) << boards.output();
    auto link = hal::ecat::PacketLink::open(test::kMasterEnd);
    ASSERT_TRUE(link.has_value()) << link.error().to_string();
    std::atomic<bool> over = false;
    std::thread foreign([&] {
      std::vector<hal::ecat::FrameBuffer> frames(1);
      while (!over) {
        ethercat::FrameWriter writer;
        writer.begin(frames[0].bytes, {0x01, 0x01, 0x01, 0x01, 0x01, 0x01});  // as SOEM's
        (void)writer.add(ethercat::Command::kBrd, 1, 0x0130'0000, 2);
        frames[0].size = writer.finish();
        (void)(*link)->send(frames);
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    });
    Process master(test::tandem({"run", file("hold.toml"), "--hal", "ethercat", "--interface",
                                 "eth1=" + std::string(test::kMasterEnd), "--no-socket", "--no-log",
                                 "--duration", "1"}),
                   file("run.txt"));
    EXPECT_NE(master.wait(), 0);
    over = true;
    foreign.join();
    EXPECT_NE(master.output().find("another master is at work on ecat_m"), std::string::npos)
        << master.output();
    // Whatever came back is the other one's: the run sent nothing.
    std::vector<hal::ecat::FrameBuffer> back(4096);
    const std::size_t count = (*link)->receive(back);
    EXPECT_GT(count, 0U);
    for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(back[i].bytes[11], 0x01) << i;
    EXPECT_EQ(boards.interrupt(), 0) << boards.output();
  });
  if (status == kNoNetwork) GTEST_SKIP() << test::needs_root("a network of its own");
  EXPECT_EQ(status, 0);
}

/// Joints that know nothing of their place are homed over the cable by the run itself, then move.
TEST_F(LineRun, AHomingOverACableAndTheMotionBehindItAreTheInProcessRunBitForBit) {
  edit("robot.toml", "motor_encoder_counts_per_rev = 65536\n",
       "motor_encoder_counts_per_rev = 65536\n"
       "homing = { method = 24, speed_rad_s = 2.0, acceleration_rad_s2 = 20.0, position_rad = 0.6, "
       "home_switch_rad = [0.6, 0.75], at_start = true }\n");
  edit("hold.toml", "plugin = \"hold\"", "plugin = \"joint_trajectory\"");
  write_text(folder_ / "hold.toml",
             read_text(folder_ / "hold.toml") +
                 "[controller.parameters]\n[[controller.parameters.waypoint]]\n"
                 "time_s = 0.8\nposition_rad = [-0.3, 0.4]\n");
  const Outcome alone = tandem("run hold.toml --duration 3 --no-socket -q --log " +
                               shell_word(file("in_process")) + " --json in.json");
  ASSERT_EQ(alone.status, 0) << alone.err;
  const int status = run_over_cable(file("hold.toml"),
                                    {"--duration", "3", "-q", "--log", file("over_cable")}, true);
  if (status == kNoNetwork) GTEST_SKIP() << test::needs_root("a network of its own");
  ASSERT_EQ(status, 0);
  const std::string log = "/double_pendulum-hold-001.mcap";
  const Outcome diff = tandem("log diff in_process" + log + " over_cable" + log + " --json -");
  EXPECT_EQ(diff.status, 0) << diff.out;
  const std::string csv =
      tandem("log csv over_cable" + log + " --topic state --fields homing,position_rad").out;
  const std::string last = csv.substr(std::min(csv.size(), csv.find("\n4.9,") + 1), 100);
  double time_s = 0.0, first_rad = 0.0, second_rad = 0.0;
  int first = 0, second = 0;
  ASSERT_EQ(std::sscanf(last.c_str(), "%lf,%lf,%lf,%d,%d", &time_s, &first_rad, &second_rad, &first,
                        &second),
            5)
      << last;
  EXPECT_EQ(first, 3);
  EXPECT_EQ(second, 3);
  EXPECT_NEAR(first_rad, -0.3, 0.02);
  EXPECT_NEAR(second_rad, 0.4, 0.02);
}

/// Frames of a whole start and run of 21 slaves, power-on to INIT: every one is one that a
/// stranger's program reads.
TEST_F(LineRun, TsharkReadsEveryFrameOfAStartAndARun) {
  if (std::system("command -v tshark > /dev/null") != 0) {
    GTEST_SKIP() << "tshark is not installed (scripts/packages.txt, section hil)";
  }
  // Reading a capture is for everybody; to capture, tshark calls what may be its group's alone.
  if (std::system("dumpcap --version > /dev/null 2>&1") != 0) {
    GTEST_SKIP() << test::needs_root("dumpcap, which only its group may run");
  }
  const std::string squat = TANDEM_SOURCE_DIR "/config/coman/squat_ethercat.toml";
  const int status =
      run_over_cable(squat, {"--duration", "0.1", "-q", "--no-log"}, true, file("cable.pcapng"));
  if (status == kNoNetwork) GTEST_SKIP() << test::needs_root("a network of its own");
  ASSERT_EQ(status, 0);
  const auto count = [&](const std::string& filter) {
    const std::string command =
        "tshark -r " + shell_word(file("cable.pcapng")) + " -Y " + shell_word(filter) +
        " -T fields -e frame.number 2>/dev/null | wc -l > " + shell_word(file("count"));
    EXPECT_EQ(std::system(command.c_str()), 0);
    return std::stoi(read_text(file("count")));
  };
  const int steps = json("boards.json")["steps"];
  EXPECT_GT(count("ecat"), 3 * steps) << "a cycle's frames and outputs, there and back";
  EXPECT_EQ(count("eth.type == 0x88a4 && !ecat"), 0);
  EXPECT_EQ(count("_ws.malformed"), 0);
  EXPECT_GT(count("ecat_mailbox.coe"), 100) << "SDO in the mailboxes";
}

/// At 500 Hz, patient enough for a machine that does other things as well.
TEST_F(LineRun, InRealTimeTheRobotMovesWithoutAFault) {
  edit("robot.toml", "slow_pdo_every = 4", "heartbeat_ms = 1000\ncommand_timeout_cycles = 1000");
  edit("hold.toml", "seed = 1", "seed = 1\nperiod_ns = 2_000_000");
  const int status = run_over_cable(file("hold.toml"),
                                    {"--duration", "0.3", "--no-log", "--on-fault", "end"}, false);
  if (status == kNoNetwork) GTEST_SKIP() << test::needs_root("a network of its own");
  ASSERT_EQ(status, 0);
  EXPECT_EQ(json("run.json")["faults"].size(), 0U);
  EXPECT_GT(json("run.json")["cycles"], 100);
}

TEST_F(LineRun, AWireThatTheRobotHasNotIsRefused) {
  const Outcome can = tandem("run hold.toml --hal can");
  EXPECT_EQ(can.status, 2);
  EXPECT_NE(can.err.find("the robot has no CAN bus (add --hal ethercat"), std::string::npos)
      << can.err;
  edit("robot.toml", "kind = \"ethercat\"\n", "");
  const Outcome line = tandem("run hold.toml --hal ethercat");
  EXPECT_EQ(line.status, 2);
  EXPECT_NE(line.err.find("the robot has no EtherCAT bus (add --hal can"), std::string::npos)
      << line.err;
}

TEST_F(LineRun, NodesThatAreNotOneBehindTheOtherAreRefused) {
  edit("robot.toml", "bus = \"arm\"\n", "bus = \"arm\"\nnode_id = 3\n");
  const Outcome outcome = tandem("run hold.toml --no-log");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("has no node in place 1 of its line"), std::string::npos)
      << outcome.err;
}

/// Boards that wait for a run, and a cable with nobody at its end.
TEST_F(LineRun, TheDoctorLooksAtTheSlaves) {
  edit("robot.toml", "interface = \"eth1\"",
       "interface = \"" + std::string(test::kMasterEnd) + "\"");
  edit("robot.toml", "slow_pdo_every = 4", "heartbeat_ms = 1000\ncommand_timeout_cycles = 1000");
  edit("hold.toml", "seed = 1", "seed = 1\nperiod_ns = 2_000_000");
  const auto doctor = [&] {
    const Outcome outcome = tandem("doctor robot.toml --json doctor.json");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    std::map<std::string, std::string> found;
    const nlohmann::json all = json("doctor.json");
    for (const auto& one : all["findings"]) found[one["name"]] = one["health"];
    return found;
  };
  const int status = in_own_network([&] {
    EXPECT_EQ(doctor()["ecat_m slaves"], "missing");
    Process boards(
        test::tandem({"emulate", file("hold.toml"), "--interface",
                      std::string(test::kMasterEnd) + "=" + test::kSlaveEnd, "--no-socket"}),
        file("boards.txt"));
    EXPECT_TRUE(boards.says("Ctrl-C")) << boards.output();
    auto found = doctor();
    for (const char* name : {"master", "slaves", "identities"}) {
      EXPECT_EQ(found["ecat_m " + std::string(name)], "ok") << name;
    }
    EXPECT_EQ(found.count("ecat_m states"), 0U) << "all are in INIT";
    Process master(test::tandem({"run", file("hold.toml"), "--hal", "ethercat", "--no-socket",
                                 "--no-log", "--duration", "0.2"}),
                   file("run.txt"));
    EXPECT_EQ(master.wait(), 0) << master.output();
    found = doctor();
    EXPECT_EQ(found["ecat_m identities"], "ok");
    EXPECT_EQ(found.count("ecat_m states"), 0U) << "the run left them in INIT";
    EXPECT_EQ(boards.interrupt(), 0) << boards.output();
  });
  if (status == kNoNetwork) GTEST_SKIP() << test::needs_root("a network of its own");
  EXPECT_EQ(status, 0);
}

/// The joints and everything about them are robot.toml's.
TEST_F(LineRun, ComansLineCarriesTheSameRobot) {
  const auto can = read_text(TANDEM_SOURCE_DIR "/config/coman/robot.toml");
  const auto line = read_text(TANDEM_SOURCE_DIR "/config/coman/robot_ethercat.toml");
  const auto joints = [](const std::string& text) {
    const std::size_t from = text.find("# --- joints");
    return text.substr(from, text.find("# --- sensors") - from);
  };
  const auto head = [](const std::string& text) {
    const std::size_t from = text.find("name = \"coman\"");
    return text.substr(from, text.find("# ---", text.find("[gains.soft_arm]")) - from);
  };
  EXPECT_EQ(joints(can), joints(line));
  EXPECT_EQ(head(can), head(line));
}

}  // namespace
}  // namespace tandem::apps
