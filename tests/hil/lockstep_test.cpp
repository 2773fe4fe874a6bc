// Whole squats over the kernel's CAN, in lockstep: the bits of the run in process.
#include <nlohmann/json.hpp>

#include "tests/hil/process.hpp"

namespace tandem {
namespace {

using test::Process;
using test::tandem;

class HilLockstep : public test::OwnFolder, public testing::WithParamInterface<const char*> {
 protected:
  [[nodiscard]] std::string file(const std::string& name) const { return folder_ / name; }
};

/// Logs are large and written in the guest's memory; of a failure the differences are enough.
struct MemoryFolder {
  MemoryFolder() { std::filesystem::create_directories(path); }
  ~MemoryFolder() { std::filesystem::remove_all(path); }
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "lockstep";
};

TEST_P(HilLockstep, ASquatOverCanIsTheInProcessRunBitForBit) {
  const MemoryFolder memory;
  const std::string experiment =
      std::string(TANDEM_SOURCE_DIR "/config/") + GetParam() + "/squat.toml";
  const std::string in_process = memory.path / "in_process";
  const std::string over_can = memory.path / "over_can";
  Process alone(tandem({"run", experiment, "--quiet", "--no-socket", "--log", in_process}),
                file("in_process.txt"));
  ASSERT_EQ(alone.wait(), 0) << alone.output();

  Process robot(tandem({"emulate", experiment, "--lockstep", "--no-socket", "--json",
                        file("robot.json")}),
                file("robot.txt"));
  ASSERT_TRUE(robot.says("Ctrl-C")) << robot.output();
  Process master(tandem({"run", experiment, "--hal", "can", "--lockstep", "--no-socket", "--log",
                         over_can, "--json", file("run.json")}),
                 file("run.txt"));
  ASSERT_EQ(master.wait(), 0) << master.output();
  ASSERT_EQ(robot.interrupt(), 0) << robot.output();

  const std::string log = std::string("/") + GetParam() + "-squat-001.mcap";
  Process diff(tandem({"log", "diff", in_process + log, over_can + log, "--json",
                       file("diff.json")}),
               file("diff.txt"));
  EXPECT_EQ(diff.wait(), 0) << diff.output();
  const auto same = nlohmann::json::parse(test::text_of(file("diff.json")));
  const auto run = nlohmann::json::parse(test::text_of(file("run.json")));
  const std::uint64_t cycles = same["topics"]["/tandem/state"]["messages"][0];
  EXPECT_GT(cycles, 30'000U) << "from power-on to the end";
  EXPECT_EQ(run["hal"], "can lockstep");
  const auto emulated = nlohmann::json::parse(test::text_of(file("robot.json")));
  EXPECT_EQ(emulated["steps"], cycles);
  EXPECT_EQ(emulated["frames_lost"], 0);
  std::printf("%s: %llu cycles, %llu frames to the boards, %llu back\n", GetParam(),
              static_cast<unsigned long long>(cycles),
              emulated["frames_in"].get<unsigned long long>(),
              emulated["frames_out"].get<unsigned long long>());
}

INSTANTIATE_TEST_SUITE_P(Robots, HilLockstep, testing::Values("coman", "walkman"),
                         [](const auto& robot) { return std::string(robot.param); });

}  // namespace
}  // namespace tandem
