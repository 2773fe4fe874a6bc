// A bundled robot's log as another project's ROS 2 decoder reads it.
#include <set>

#include "tests/apps/program.hpp"
#include "tests/support/node.hpp"

namespace tandem::apps {
namespace {

const std::string kFolder = TANDEM_SOURCE_DIR "/tests/log";

class DecodedLog : public Program {
 protected:
  void SetUp() override {
    if (tandem::test::kNode == nullptr) GTEST_SKIP() << "node is not installed";
    if (!std::filesystem::exists(kFolder + "/node_modules/@foxglove/rosmsg2-serialization")) {
      GTEST_SKIP()
          << "@foxglove/rosmsg2-serialization is not installed (run `npm ci` in tests/log)";
    }
    Program::SetUp();
  }

  /// Every message of every channel of the experiment's log, beside `tandem log csv`.
  /// @param viewed  the topics for ROS viewers
  void expect_decoded(const std::string& experiment, std::set<std::string> viewed) const {
    const Outcome run = tandem("run " + shell_word(TANDEM_SOURCE_DIR "/config/" + experiment) +
                               " --duration 0.3 --json - --quiet");
    ASSERT_EQ(run.status, 0) << run.err;
    const std::string log = nlohmann::json::parse(run.out)["log"]["path"];
    const auto info = nlohmann::json::parse(tandem("log info " + log + " --json -").out);
    std::string command = shell_word(tandem::test::kNode) + " " +
                          shell_word(kFolder + "/decode_log.mjs") + " " + log + " 10";
    for (const auto& [topic, about] : info["topics"].items()) {
      if (!topic.starts_with("/tandem/")) {
        EXPECT_EQ(viewed.erase(topic), 1u) << topic;
        continue;  // of lists and texts: no tables
      }
      const std::string table = std::filesystem::path(topic).filename().string() + ".csv";
      const Outcome csv =
          tandem("log csv " + log + " --every 10 --topic " + topic + " -o " + table);
      ASSERT_EQ(csv.status, 0) << csv.err;
      command += " " + topic + "=" + table;
    }
    EXPECT_TRUE(viewed.empty()) << "there is no " << *viewed.begin();
    command = "cd " + shell_word(folder_.string()) + " && " + command + " > decoded.txt 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << read_text(folder_ / "decoded.txt");
  }
};

TEST_F(DecodedLog, OfAHumanoidHasEveryNumberOfTheTable) {
  expect_decoded("coman/squat.toml", {"/joint_states", "/tf", "/tf_static", "/robot_description"});
}

TEST_F(DecodedLog, OfClosedLoopsHasEveryNumberOfTheTable) {
  expect_decoded("parallel_ankle/move.toml",
                 {"/joint_states", "/tf", "/tf_static", "/robot_description"});
}

}  // namespace
}  // namespace tandem::apps
