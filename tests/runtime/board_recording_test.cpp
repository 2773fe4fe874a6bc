// Boards of a bundled robot, recorded in a run and played to others of the same firmware: what was
// recorded is all that they depend on, and they answer with the same bytes. `make firmware` plays
// the same files to the firmware on a microcontroller.
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "firmware_emu/target/recording.hpp"
#include "hal/sim/setup.hpp"
#include "tests/runtime/bundled_run.hpp"

namespace tandem::runtime {
namespace {

namespace recording = firmware::recording;

/// Bytes that are written to memory which it has from the beginning.
struct Written {
  explicit Written(std::size_t most) { bytes.reserve(most); }
  bool raw(const void* from, std::size_t size) noexcept TANDEM_RT {
    if (bytes.capacity() - bytes.size() < size) return full = true, false;
    const auto* first = static_cast<const std::uint8_t*>(from);
    bytes.insert(bytes.end(), first, first + size);
    return true;
  }
  std::vector<std::uint8_t> bytes;
  bool full = false;
};

struct Read {
  bool raw(void* to, std::size_t size) noexcept {
    if (bytes.size() - at < size) return false;
    std::memcpy(to, bytes.data() + at, size);
    at += size;
    return true;
  }
  std::vector<std::uint8_t> bytes;
  std::size_t at = 0;
};

struct Untimed {
  void begin() noexcept { ++steps; }
  void end() noexcept {}
  int steps = 0;
};

/// What every board of a run gets and answers.
class Recorder final : public sim::BoardListener {
 public:
  static constexpr std::size_t kMostBytes = std::size_t{32} << 20;

  Recorder(const hal::RobotConfig& robot, std::uint64_t seed) {
    for (std::size_t b = 0; b < robot.boards.size(); ++b) {
      firmware::BoardSetup setup = sim::board_setup(robot, b, seed);
      boards.push_back({Written(kMostBytes), Written(kMostBytes), {}, setup.name});
      boards.back().waiting.reserve(256);
      EXPECT_TRUE(recording::transfer(boards.back().asked, setup));
    }
  }
  void received(std::size_t board, const canopen::Frame& frame) noexcept TANDEM_RT override {
    std::vector<canopen::Frame>& waiting = boards[board].waiting;
    if (waiting.size() == waiting.capacity()) return void(boards[board].asked.full = true);
    waiting.push_back(frame);
  }
  void stepped(std::size_t board, std::int64_t dt_ns, std::span<const firmware::AxisSense> sense,
               std::span<const canopen::Frame> answers,
               std::span<const firmware::AxisDrive> drives) noexcept TANDEM_RT override {
    One& one = boards[board];
    recording::ask(one.asked, one.waiting, dt_ns, sense);
    recording::answer(one.answered, answers, drives);
    one.waiting.clear();
  }

  struct One {
    Written asked, answered;
    std::vector<canopen::Frame> waiting;  ///< for its next step
    std::string name;
  };
  std::vector<One> boards;
};

class BoardRecording : public testing::TestWithParam<std::string> {};

TEST_P(BoardRecording, PlayedToAnotherBoardIsAnsweredWithTheSameBytes) {
  const char* said = std::getenv("TANDEM_RECORD_BOARDS");
  const std::string folder = said == nullptr ? "" : said;
  const std::string robot = GetParam();
  const char* variant = std::getenv("TANDEM_KERNEL_VARIANT");  // another one has other last bits
  BundledRun run(robot, robot == "coman" ? "squat" : "follow",
                 {.kernel_variant = variant == nullptr ? "" : variant});
  Recorder recorder(run.experiment->robot, run.experiment->sim_robot_config().seed);
  ASSERT_FALSE(recorder.boards.empty());
  run.backend->robot().set_board_listener(&recorder);
  // Without a folder to write to: until the drives have been set up, enabled and moved.
  int enabled = 0;
  for (int i = 0; (i < 2000 || !folder.empty()) && run.cycle->step(); ++i) {
    if (run.backend->robot().all_enabled()) ++enabled;
  }
  EXPECT_GT(enabled, 500);
  run.backend->robot().set_board_listener(nullptr);

  for (const Recorder::One& one : recorder.boards) {
    SCOPED_TRACE(one.name);
    ASSERT_FALSE(one.asked.full || one.answered.full);
    Read asked{one.asked.bytes};
    firmware::BoardSetup setup;
    ASSERT_TRUE(recording::transfer(asked, setup));
    firmware::Board board(setup);
    recording::Player player(board, setup.axes.size());
    Written answered(Recorder::kMostBytes);
    Untimed timed;
    EXPECT_EQ(player.play(asked, answered, timed), recording::Played::kToItsEnd);
    EXPECT_GE(timed.steps, 2000);
    EXPECT_TRUE(answered.bytes == one.answered.bytes);
    if (folder.empty()) continue;
    const std::filesystem::path place = std::filesystem::path(folder) / one.name;
    std::filesystem::create_directories(place);
    for (const auto& [name, bytes] :
         {std::pair{"asked", &one.asked.bytes}, std::pair{"answered-here", &one.answered.bytes}}) {
      std::ofstream file(place / name, std::ios::binary);
      file.write(reinterpret_cast<const char*>(bytes->data()),
                 static_cast<std::streamsize>(bytes->size()));
      ASSERT_TRUE(file.flush());
    }
  }
}

// Each change of a recording is heard: a board that does not listen would pass the test above.
TEST(BoardRecordingChanged, IsAnsweredOtherwise) {
  BundledRun run("double_pendulum", "follow");
  Recorder recorder(run.experiment->robot, run.experiment->sim_robot_config().seed);
  run.backend->robot().set_board_listener(&recorder);
  run.steps(2000);
  const Recorder::One& one = recorder.boards.front();
  Read asked{one.asked.bytes};
  firmware::BoardSetup setup;
  ASSERT_TRUE(recording::transfer(asked, setup));
  const std::size_t begun = asked.at;

  const auto played = [&](Read from, const firmware::BoardSetup& with) {
    firmware::Board board(with);
    recording::Player player(board, with.axes.size());
    Written answered(Recorder::kMostBytes);
    Untimed timed;
    from.at = begun;
    (void)player.play(from, answered, timed);
    return answered.bytes;
  };
  EXPECT_TRUE(played(asked, setup) == one.answered.bytes);
  firmware::BoardSetup noisier = setup;  // other settings are the master's, who writes them
  noisier.axes[0].torque_noise_Nm += 1e-6;
  EXPECT_FALSE(played(asked, noisier) == one.answered.bytes);
  Read turned = asked;
  turned.bytes[turned.bytes.size() - 50] ^= 0x20;  // of the last step's pins
  EXPECT_FALSE(played(turned, setup) == one.answered.bytes);
  Read cut = asked;
  cut.bytes.pop_back();
  firmware::Board board(setup);
  recording::Player player(board, setup.axes.size());
  Written answered(Recorder::kMostBytes);
  Untimed timed;
  cut.at = begun;
  EXPECT_EQ(player.play(cut, answered, timed), recording::Played::kCutOff);
  Read nothing;
  EXPECT_FALSE(recording::transfer(nothing, setup));
}

INSTANTIATE_TEST_SUITE_P(Robots, BoardRecording, testing::Values("coman", "double_pendulum"),
                         [](const auto& one) { return one.param; });

}  // namespace
}  // namespace tandem::runtime
