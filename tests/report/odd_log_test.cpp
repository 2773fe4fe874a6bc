// Logs that are whole and yet cannot be a run's: refused, and by what is wrong with them. Each is a
// good one (a seed of the fuzzers) with some bytes otherwise.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>

#include "report/run_data.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::report {
namespace {

struct OddLog : testing::Test {
  [[nodiscard]] std::string read(const std::string& from = {}, const std::string& to = {}) const {
    std::ifstream in(TANDEM_SOURCE_DIR "/tests/fuzz/seeds/mcap/plain", std::ios::binary);
    std::ostringstream all;
    all << in.rdbuf();
    std::string bytes = all.str();
    if (!from.empty()) {
      const std::size_t at = bytes.find(from);
      EXPECT_NE(at, std::string::npos) << from;
      bytes.replace(at, from.size(), to);
    }
    const std::string file = folder / "log.mcap";
    std::ofstream(file, std::ios::binary) << bytes;
    const auto run = read_run(file);
    return run ? "read" : run.error().to_string();
  }
  log::ScratchFolder folder;
};

TEST_F(OddLog, IsGoodBeforeAnythingIsChanged) { EXPECT_EQ(read(), "read"); }

// A crash or a hang was among the facts alone: no line in the figures, and the last posture was
// "end". The seed's result says `ended`, which a run's does after these alone.
TEST_F(OddLog, OfALoopThatCrashedHasAFaultAtItsEnd) {
  ASSERT_EQ(read(), "read");
  const auto run = read_run(folder / "log.mcap");
  ASSERT_TRUE(run);
  ASSERT_FALSE(run->faults.empty());
  const RunFault& fault = run->faults.back();
  EXPECT_EQ(fault.text, "done");
  EXPECT_TRUE(fault.stops);
  EXPECT_EQ(fault.time_s, run->last_s);
  EXPECT_NE(run->stop(), nullptr);
}

// Each read beyond the columns that were there.
TEST_F(OddLog, LacksJointsInItsCommand) {
  EXPECT_NE(read("float64[2] position_rad\nint8[2] mode", "float64[1] position_rad\nint8[2] mode")
                .find("position_rad of /tandem/command has only 1 elements"),
            std::string::npos);
}

TEST_F(OddLog, HasAShortTruth) {
  EXPECT_NE(read("float64[6] base_velocity", "float64[5] base_velocity")
                .find("base_velocity of /tandem/truth has only 5 elements"),
            std::string::npos);
}

// Its rows were cropped from a later one to an earlier one.
TEST_F(OddLog, HasTimesThatGoBack) {
  std::string second(8, '\0'), late(8, '\0');
  second[0] = '\x40', second[1] = '\x42', second[2] = '\x0f';  // 1,000,000 ns, little-endian
  late[4] = '\x01';                                            // 4.3 s
  EXPECT_NE(read(std::string("\1\0\1\0\0\0", 6) + second, std::string("\1\0\1\0\0\0", 6) + late)
                .find("the messages of /tandem/state are not in the order of their times"),
            std::string::npos);
}

}  // namespace
}  // namespace tandem::report
