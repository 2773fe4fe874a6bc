#include "hal/ethercat-can/frame_record.hpp"

#include <array>
#include <fstream>
#include <regex>

#include "canopen/messages.hpp"
#include "hal/ethercat-can/loopback.hpp"
#include "rt/scoped_realtime.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::hal::can {
namespace {

using canopen::Frame;
using canopen::make_frame;

std::vector<std::string> lines_of(const std::string& path) {
  std::ifstream in(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

// Two of these lines are what candump of can-utils 2020.11 wrote for the same frames.
TEST(FrameRecord, WritesCandumpsLines) {
  const std::array<std::uint8_t, 8> request{0x40, 0x18, 0x10, 0x01};
  EXPECT_EQ(candump_line(1'795'239'876'522'644'123, "can0", make_frame(0x60A, request)),
            "(1795239876.522644) can0 60A#4018100100000000");
  EXPECT_EQ(candump_line(1'795'239'876'510'108'000, "can0", Frame{.id = 0x80}),
            "(1795239876.510108) can0 080#");
  EXPECT_EQ(candump_line(1'000, "vcan1",
                         make_frame(0x18A, std::array<std::uint8_t, 9>{0x11, 0x22, 0xAB})),
            "(0.000001) vcan1 18A##11122AB000000000000000000");
  EXPECT_EQ(candump_line(0, "can4", Frame{.id = 7, .length = 1, .flags = canopen::kFlagFd}),
            "(0.000000) can4 007##000");
  EXPECT_EQ(candump_line(0, "can0", canopen::make_guard_request(0x20)), "(0.000000) can0 720#R1");
  EXPECT_EQ(candump_line(0, "can0", Frame{.id = 0x181, .flags = canopen::kFlagRtr}),
            "(0.000000) can0 181#R");
}

class FrameRecordFile : public testing::Test {
 protected:
  const tandem::test::ScratchFolder folder_;
  const std::string path_ = folder_ / "frames.log";
};

TEST_F(FrameRecordFile, HasWhatIsSentAndReceivedInOrder) {
  LoopbackBus wire;
  auto record = FrameRecord::open(path_);
  ASSERT_TRUE(record);
  Bus& bus = (*record)->watch(wire.master(), "can3");
  {
    const rt::ScopedRealtime in_cycle;
    EXPECT_EQ(bus.send(std::array{Frame{.id = 0x80}, Frame{.id = 0x20A}}), 2U);
    wire.boards().send(std::array{Frame{.id = 0x18A}});
    std::array<Frame, 4> in;
    EXPECT_EQ(bus.receive(in), 1U);
    EXPECT_EQ(bus.receive(in), 0U);
  }
  const FrameRecord::Result result = (*record)->close();
  EXPECT_EQ(result.frames, 3U);
  EXPECT_EQ(result.lost, 0U);
  EXPECT_EQ(result.error, "");
  const auto lines = lines_of(path_);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_TRUE(std::regex_match(lines[0], std::regex(R"(\(1\d{9}\.\d{6}\) can3 080#)"))) << lines[0];
  EXPECT_TRUE(lines[1].ends_with(" can3 20A#"));
  EXPECT_TRUE(lines[2].ends_with(" can3 18A#"));
}

TEST_F(FrameRecordFile, LeavesOutWhatTheBusRefusedAndCountsWhatItLost) {
  LoopbackBus wire(3);
  auto record = FrameRecord::open(path_, 2);
  ASSERT_TRUE(record);
  Bus& bus = (*record)->watch(wire.master(), "can0");
  const std::vector<Frame> many(5, Frame{.id = 0x80});
  EXPECT_EQ(bus.send(many), 3U);
  const FrameRecord::Result result = (*record)->close();
  EXPECT_EQ(result.frames + result.lost, 3U);
  EXPECT_EQ(lines_of(path_).size(), result.frames);
}

TEST(FrameRecord, SaysThatAFileCannotBeMade) {
  const auto record = FrameRecord::open("/proc/tandem/frames.log");
  ASSERT_FALSE(record);
  EXPECT_EQ(record.error().file, "/proc/tandem/frames.log");
  EXPECT_FALSE(record.error().hint.empty());
}

}  // namespace
}  // namespace tandem::hal::can
