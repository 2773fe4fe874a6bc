// Whole runs over the kernel's CAN, in lockstep: the bits of the run in process.
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/hil/process.hpp"

namespace tandem {
namespace {

using test::Process;
using test::tandem;

/// Logs are large and written in the guest's memory; of a failure the differences are enough.
struct MemoryFolder {
  MemoryFolder() { std::filesystem::create_directories(path); }
  ~MemoryFolder() { std::filesystem::remove_all(path); }
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "lockstep";
};

class Lockstep : public test::OwnFolder {
 protected:
  [[nodiscard]] std::string file(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] nlohmann::json json(const std::string& name) const {
    return nlohmann::json::parse(test::text_of(file(name)));
  }
  [[nodiscard]] static std::string experiment(const std::string& name) {
    return TANDEM_SOURCE_DIR "/config/" + name;
  }
  [[nodiscard]] std::vector<std::string> emulate_words(const std::string& experiment) const {
    return tandem(
        {"emulate", experiment, "--lockstep", "--no-socket", "--json", file("robot.json")});
  }
  void run_in_process(const std::string& experiment, const std::vector<std::string>& more = {}) {
    auto words = tandem({"run", experiment, "--quiet", "--no-socket", "--log", in_process_});
    words.insert(words.end(), more.begin(), more.end());
    Process alone(words, file("in_process.txt"));
    ASSERT_EQ(alone.wait(), 0) << alone.output();
  }
  /// That all but the plant's truth is the same in both logs, and no frame was lost.
  void expect_same_bits(const std::string& log, std::uint64_t cycles_at_least) {
    Process diff(
        tandem({"log", "diff", in_process_ + log, over_can_ + log, "--json", file("diff.json")}),
        file("diff.txt"));
    EXPECT_EQ(diff.wait(), 0) << diff.output();
    const auto topics = json("diff.json")["topics"];
    for (const auto& topic : topics.items()) {
      EXPECT_TRUE(topic.value()["equal"]) << topic.key() << "\n" << diff.output();
    }
    for (const char* name : {"/tandem/state", "/tandem/command", "/tandem/event"}) {
      ASSERT_TRUE(topics.contains(name)) << diff.output();
      EXPECT_GT(topics[name]["messages"][0].get<int>(), 0) << name;
    }
    const std::uint64_t cycles = topics["/tandem/state"]["messages"][0];
    EXPECT_GT(cycles, cycles_at_least) << "from power-on to the end";
    const auto emulated = json("robot.json");
    EXPECT_EQ(emulated["steps"], cycles);
    EXPECT_EQ(emulated["frames_lost"], 0);
    EXPECT_EQ(emulated["silent_steps"], 0) << "each had its SYNC";
    std::printf("%s: %llu cycles, %llu frames to the boards, %llu back\n", log.c_str(),
                static_cast<unsigned long long>(cycles),
                emulated["frames_in"].get<unsigned long long>(),
                emulated["frames_out"].get<unsigned long long>());
  }

  const MemoryFolder memory_;
  const std::string in_process_ = memory_.path / "in_process";
  const std::string over_can_ = memory_.path / "over_can";
};

class HilLockstep : public Lockstep, public testing::WithParamInterface<const char*> {};

/// Seconds of a humanoid's run: `usual`, or TANDEM_HIL_SECONDS, as in make test-all.
std::string seconds_or(const char* usual) {
  const char* wanted = std::getenv("TANDEM_HIL_SECONDS");
  return wanted == nullptr ? usual : wanted;
}

/// COMAN goes down, WALK-MAN begins to. The whole experiment is 30 s.
TEST_P(HilLockstep, ASquatOverCanIsTheInProcessRunBitForBit) {
  const std::string squat = experiment(GetParam()) + "/squat.toml";
  const std::string seconds = seconds_or(std::string(GetParam()) == "coman" ? "5" : "2");
  ASSERT_NO_FATAL_FAILURE(run_in_process(squat, {"--duration", seconds}));

  Process robot(emulate_words(squat), file("robot.txt"));
  ASSERT_TRUE(robot.says("Ctrl-C")) << robot.output();
  Process master(tandem({"run", squat, "--hal", "can", "--lockstep", "--no-socket", "--duration",
                         seconds, "--log", over_can_, "--json", file("run.json")}),
                 file("run.txt"));
  ASSERT_EQ(master.wait(), 0) << master.output();
  ASSERT_EQ(robot.interrupt(), 0) << robot.output();
  EXPECT_EQ(json("run.json")["hal"], "can lockstep");
  expect_same_bits(std::string("/") + GetParam() + "-squat-001.mcap", std::stoull(seconds) * 1000);
}

INSTANTIATE_TEST_SUITE_P(Robots, HilLockstep, testing::Values("coman", "walkman"),
                         [](const auto& robot) { return std::string(robot.param); });

using HilTwin = Lockstep;

/// Beside a robot on the wire, its exact twin in the master's process; and the robot's base, which
/// its sensors alone tell, is estimated as in process.
TEST_F(HilTwin, OfARobotOnCanIsTheSameToTheLastBitAndSoIsTheEstimate) {
  const std::string twin = file("twin.toml");
  std::string text = test::text_of(experiment("coman/squat_twin.toml"));
  text.replace(text.find("robot.toml"), 10, experiment("coman/robot.toml"));
  std::ofstream(twin) << text << "\n[estimation.base]\n[estimation.observer]\n";
  const std::string seconds = seconds_or("1");
  ASSERT_NO_FATAL_FAILURE(run_in_process(twin, {"--duration", seconds}));

  Process robot(emulate_words(twin), file("robot.txt"));
  ASSERT_TRUE(robot.says("Ctrl-C")) << robot.output();
  Process master(tandem({"run", twin, "--hal", "can", "--lockstep", "--no-socket", "--log",
                         over_can_, "--duration", seconds, "--json", file("run.json")}),
                 file("run.txt"));
  ASSERT_EQ(master.wait(), 0) << master.output();
  ASSERT_EQ(robot.interrupt(), 0) << robot.output();
  const auto parallel = json("run.json")["parallel"];
  EXPECT_EQ(parallel["unequal"], 0) << "first in cycle " << parallel["first_unequal"];
  EXPECT_GT(parallel["compared"].get<std::uint64_t>(), std::stoull(seconds) * 1000);
  EXPECT_EQ(parallel["missed"], 0);
  expect_same_bits("/coman-twin-001.mcap", std::stoull(seconds) * 1000);
  EXPECT_TRUE(json("diff.json")["topics"].contains("/tandem/estimate"));
}

class HilDrives : public Lockstep, public testing::WithParamInterface<const char*> {};

/// Boards that stand in for other makers' drives, by their data sheets.
TEST_P(HilDrives, ATrajectoryOverCanIsTheInProcessRunBitForBit) {
  const std::string trajectory = experiment(GetParam()) + "/trajectory.toml";
  ASSERT_NO_FATAL_FAILURE(run_in_process(trajectory, {"--duration", "1"}));
  Process robot(emulate_words(trajectory), file("robot.txt"));
  ASSERT_TRUE(robot.says("Ctrl-C")) << robot.output();
  Process master(tandem({"run", trajectory, "--hal", "can", "--lockstep", "--no-socket",
                         "--duration", "1", "--log", over_can_}),
                 file("run.txt"));
  ASSERT_EQ(master.wait(), 0) << master.output();
  ASSERT_EQ(robot.interrupt(), 0) << robot.output();
  const std::string name = std::string(GetParam()).substr(0, std::string(GetParam()).rfind('_'));
  expect_same_bits("/" + name + "-trajectory-001.mcap", 500);
}

INSTANTIATE_TEST_SUITE_P(Robots, HilDrives,
                         testing::Values("panda_classic", "double_pendulum_interpolated"),
                         [](const auto& robot) { return std::string(robot.param); });

using HilServe = Lockstep;

/// Three processes: boards and plant, the loop on CAN, and over DDS the controllers.
TEST_F(HilServe, ARobotOnCanDrivenOverDdsIsTheInProcessRunBitForBit) {
  const std::string trajectory = experiment("double_pendulum_classic/trajectory.toml");
  const std::string domain = "77";  // of this test: the network is no other's
  ASSERT_NO_FATAL_FAILURE(run_in_process(trajectory, {"--duration", "0.5"}));

  Process robot(emulate_words(trajectory), file("robot.txt"));
  ASSERT_TRUE(robot.says("Ctrl-C")) << robot.output();
  Process server(tandem({"serve", trajectory, "--hal", "can", "--lockstep", "--once", "--domain",
                         domain, "--log", over_can_, "--json", file("serve.json")}),
                 file("serve.txt"));
  ASSERT_TRUE(server.says("served in DDS domain " + domain)) << server.output();
  Process owner(tandem({"run", trajectory, "--hal", "dds", "--lockstep", "--no-log", "--no-socket",
                        "--domain", domain, "--duration", "0.5"}),
                file("owner.txt"));
  ASSERT_EQ(owner.wait(), 0) << owner.output() << server.output();
  ASSERT_EQ(server.wait(), 0) << server.output();
  ASSERT_EQ(robot.interrupt(), 0) << robot.output();
  const auto served = json("serve.json");
  EXPECT_EQ(served["hal"], "can lockstep");
  EXPECT_EQ(served["remote"]["losses"], 0);
  EXPECT_GT(served["remote"]["commands"]["taken"].get<int>(), 500)
      << "bring-up and half a second at 500 Hz";
  expect_same_bits("/double_pendulum-trajectory-001.mcap", 1000);
}

class HilHoming : public Lockstep {
 protected:
  /// The double pendulum, whose joints have to be homed: by a switch's edge, from the left.
  void SetUp() override {
    const std::string from = experiment("double_pendulum_classic/");
    std::string robot = test::text_of(from + "robot.toml");
    const auto put = [&](const std::string& old, const std::string& now) {
      ASSERT_NE(robot.find(old), std::string::npos) << old;
      robot.replace(robot.find(old), old.size(), now);
    };
    put("../double_pendulum/", experiment("double_pendulum/"));
    put("motor_encoder_counts_per_rev = 65536\n",
        "motor_encoder_counts_per_rev = 65536\n"
        "homing = { method = 24, speed_rad_s = 2.0, acceleration_rad_s2 = 20.0, position_rad = "
        "0.2, "
        "home_switch_rad = [0.6, 0.75], at_start = true }\n");
    std::ofstream(folder_ / "robot.toml") << robot;
    std::ofstream(folder_ / "trajectory.toml") << test::text_of(from + "trajectory.toml");
  }
};

/// Joints that know nothing of their place are homed over the wire by the run itself, then move.
TEST_F(HilHoming, OverCanAndTheMotionBehindItAreTheInProcessRunBitForBit) {
  const std::string trajectory = file("trajectory.toml");
  ASSERT_NO_FATAL_FAILURE(run_in_process(trajectory, {"--duration", "3"}));
  Process robot(emulate_words(trajectory), file("robot.txt"));
  ASSERT_TRUE(robot.says("Ctrl-C")) << robot.output();
  Process master(tandem({"run", trajectory, "--hal", "can", "--lockstep", "--no-socket",
                         "--duration", "3", "--log", over_can_, "--json", file("run.json")}),
                 file("run.txt"));
  ASSERT_EQ(master.wait(), 0) << master.output();
  ASSERT_EQ(robot.interrupt(), 0) << robot.output();
  const std::string log = "/double_pendulum-trajectory-001.mcap";
  expect_same_bits(log, 2000);
  EXPECT_EQ(json("run.json")["faults"].size(), 0U);
  Process states(tandem({"log", "csv", over_can_ + log, "--topic", "state", "--fields", "homing",
                         "-o", file("homing.csv")}),
                 file("csv.txt"));
  ASSERT_EQ(states.wait(), 0) << states.output();
  const std::string csv = test::text_of(file("homing.csv"));
  EXPECT_NE(csv.find(",1,1\n"), std::string::npos) << "neither was homed at first";
  EXPECT_NE(csv.find(",2,1\n"), std::string::npos) << "one after the other";
  EXPECT_TRUE(csv.ends_with(",3,3\n")) << csv.substr(csv.size() - 100);
}

}  // namespace
}  // namespace tandem
