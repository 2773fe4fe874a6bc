// What others see of a run over CAN: the same frames as our own record, and CANopen.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/hil/witness.hpp"

namespace tandem::test {
namespace {

/// The double pendulum on can0: on CAN FD one board of two axes, on classic CAN two of one.
class Witness : public OwnFolder, public testing::WithParamInterface<bool> {
 protected:
  static bool fd() { return GetParam(); }

  void SetUp() override {
    for (const char* tool : {"candump", "tshark", "stdbuf"}) {
      if (std::system(("command -v " + std::string(tool) + " > /dev/null").c_str()) != 0) {
        GTEST_SKIP() << tool << " is not installed (scripts/packages.txt, section test)";
      }
    }
    const std::filesystem::path source = TANDEM_SOURCE_DIR "/config/double_pendulum";
    for (const char* name : {"double_pendulum.urdf", "robot.toml", "trajectory.toml"}) {
      std::filesystem::copy_file(source / name, folder_ / name);
    }
    if (fd()) return;
    replace("robot.toml", "fd = true\n", "fd = false\n");
    replace("robot.toml", "data_bitrate = 8_000_000\n", "");
    replace("robot.toml", "joints = [\"joint1\", \"joint2\"]", "joints = [\"joint1\"]");
    replace("robot.toml", "[[joint]]",
            "[[board]]\nname = \"board_2\"\nbus = \"arm\"\njoints = [\"joint2\"]\n\n[[joint]]");
    replace("trajectory.toml", "seed = 1", "seed = 1\nperiod_ns = 4_000_000");
  }

  void replace(const std::string& name, const std::string& from, const std::string& to) const {
    std::string text = text_of(folder_ / name);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << name << " has no '" << from << "'";
    std::ofstream(folder_ / name) << text.replace(at, from.size(), to);
  }

  /// Runs it for a while beside its emulated robot.
  void run(const std::vector<std::string>& more) {
    std::vector<std::string> emulate{"emulate", experiment_, "--no-socket"};
    std::vector<std::string> run{
        "run",         experiment_,  "--hal", "can",    "--no-log",
        "--no-socket", "--duration", "0.5",   "--json", (folder_ / "run.json").string()};
    for (const std::string& word : more) {
      if (word == "--lockstep") emulate.push_back(word);
      run.push_back(word);
    }
    Process robot(tandem(emulate), folder_ / "emulate.txt");
    ASSERT_TRUE(robot.says("Ctrl-C ends it")) << robot.output();
    Process master(tandem(run), folder_ / "run.txt");
    EXPECT_EQ(master.wait(), 0) << master.output();
    EXPECT_EQ(robot.interrupt(), 0) << robot.output();
    json_ = nlohmann::json::parse(text_of(folder_ / "run.json"));
  }

  std::string experiment_ = folder_ / "trajectory.toml";
  nlohmann::json json_;
};

TEST_P(Witness, CandumpSeesTheFramesOfOurOwnRecord) {
  const auto ours = folder_ / "ours.log";
  Candump candump("can0", folder_ / "candump.log");
  run({"--lockstep", "--record-frames", ours.string()});
  const std::vector<LoggedFrame> seen = candump.stop();
  const std::vector<LoggedFrame> recorded = read_frames(ours);
  EXPECT_EQ(json_["frames"]["frames"], seen.size());
  EXPECT_EQ(json_["frames"]["lost"], 0);
  const auto is_fd = [](const LoggedFrame& frame) { return frame.text.contains("##"); };
  EXPECT_EQ(std::ranges::any_of(seen, is_fd), fd());
  for (const bool of_master : {true, false}) {
    const std::vector<std::string> a = texts(recorded, of_master);
    const std::vector<std::string> b = texts(seen, of_master);
    EXPECT_GT(a.size(), 500U);
    EXPECT_EQ(a.size(), b.size());
    const auto [at, other] = std::ranges::mismatch(a, b);
    EXPECT_TRUE(at == a.end() && other == b.end())
        << (of_master ? "the master's" : "the nodes'") << " frames differ from number "
        << at - a.begin() << " on";
  }
}

TEST_P(Witness, TsharkReadsEveryFrameAsCanopen) {
  const auto log = folder_ / "candump.log";
  Candump candump("can0", log);
  run({"--lockstep"});
  const std::size_t frames = candump.stop().size();
  std::map<std::string, int> kinds;
  EXPECT_EQ(tshark_complaints(log, kinds), "");
  for (const char* kind :
       {"SYNC", "TIME STAMP", "PDO1 (rx)", "PDO1 (tx)", "PDO2 (rx)", "PDO2 (tx)",
        "NMT: Start remote node", "NMT Error Control: Boot-up", "NMT Error Control: Operational",
        "Default-SDO (rx): Initiate download request",
        "Default-SDO (tx): Initiate download response", "Default-SDO (rx): Initiate upload request",
        "Default-SDO (tx): Initiate upload response"}) {
    EXPECT_GT(kinds[kind], 0) << kind;
  }
  EXPECT_GT(frames, 1000U);
}

INSTANTIATE_TEST_SUITE_P(Wire, Witness, testing::Values(true, false),
                         [](const auto& wire) { return wire.param ? "Fd" : "Classic"; });

class WitnessItself : public OwnFolder {};

TEST_F(WitnessItself, ComplainsOfAFrameThatIsNoCanopen) {
  const auto log = folder_ / "bad.log";
  std::ofstream(log) << "(1000.000000) can0 60A#4018\n";
  std::map<std::string, int> kinds;
  EXPECT_NE(tshark_complaints(log, kinds), "") << "or its silence about a run means nothing";
}

}  // namespace
}  // namespace tandem::test
