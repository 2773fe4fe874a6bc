#include "canopen/bytes.hpp"

#include <array>
#include <cmath>

#include "canopen/frame.hpp"
#include "canopen/objects.hpp"

namespace tandem::canopen {
namespace {

template <class T>
std::vector<int> bytes_of(T value) {
  std::array<std::uint8_t, sizeof(T)> out{};
  put(out.data(), value);
  return {out.begin(), out.end()};
}

TEST(Bytes, AreLittleEndian) {
  EXPECT_EQ(bytes_of<std::uint16_t>(0x1234), (std::vector<int>{0x34, 0x12}));
  EXPECT_EQ(bytes_of<std::int16_t>(-2), (std::vector<int>{0xFE, 0xFF}));
  EXPECT_EQ(bytes_of<std::uint32_t>(0x12345678), (std::vector<int>{0x78, 0x56, 0x34, 0x12}));
  EXPECT_EQ(bytes_of<std::int8_t>(-128), (std::vector<int>{0x80}));
}

TEST(Bytes, Real32IsIeee754) {
  EXPECT_EQ(bytes_of(1.0f), (std::vector<int>{0x00, 0x00, 0x80, 0x3F}));
  EXPECT_EQ(bytes_of(-118.625f), (std::vector<int>{0x00, 0x40, 0xED, 0xC2}));
  const std::uint8_t wire[] = {0x00, 0x40, 0xED, 0xC2};
  EXPECT_EQ(get<float>(wire), -118.625f);
}

TEST(Bytes, ReadSignsFromTheWire) {
  const std::uint8_t wire[] = {0xFE, 0xFF, 0xFF, 0xFF};
  EXPECT_EQ(get<std::int8_t>(wire), -2);
  EXPECT_EQ(get<std::int16_t>(wire), -2);
  EXPECT_EQ(get<std::int32_t>(wire), -2);
  EXPECT_EQ(get<std::uint32_t>(wire), 0xFFFFFFFEu);
}

TEST(ClampRound, RoundsToNearestAndNeverWraps) {
  EXPECT_EQ(clamp_round<std::int16_t>(2.5), 3);
  EXPECT_EQ(clamp_round<std::int16_t>(-2.5), -3);
  EXPECT_EQ(clamp_round<std::int16_t>(2.4999), 2);
  EXPECT_EQ(clamp_round<std::int16_t>(-2.4999), -2);
  EXPECT_EQ(clamp_round<std::int16_t>(32767.4), 32767);
  EXPECT_EQ(clamp_round<std::int16_t>(32768.0), 32767);
  EXPECT_EQ(clamp_round<std::int16_t>(-40000.0), -32768);
  EXPECT_EQ(clamp_round<std::int32_t>(1e300), 2147483647);
  EXPECT_EQ(clamp_round<std::int32_t>(-INFINITY), -2147483647 - 1);
  EXPECT_EQ(clamp_round<std::uint16_t>(-1.0), 0);
  EXPECT_EQ(clamp_round<std::uint32_t>(4294967294.6), 4294967295u);
  EXPECT_EQ(clamp_round<std::int16_t>(NAN), 0);
}

TEST(FrameLength, TakesTheStepsOfCanFd) {
  EXPECT_EQ(frame_length(0), 0);
  EXPECT_EQ(frame_length(8), 8);
  EXPECT_EQ(frame_length(9), 12);
  EXPECT_EQ(frame_length(13), 16);
  EXPECT_EQ(frame_length(25), 32);
  EXPECT_EQ(frame_length(33), 48);
  EXPECT_EQ(frame_length(49), 64);
  EXPECT_EQ(frame_length(64), 64);
}

TEST(Objects, CobIdsAreThoseOfThePredefinedConnectionSet) {
  EXPECT_EQ(cob::tpdo(1, 5), 0x185u);
  EXPECT_EQ(cob::tpdo(4, 127), 0x4FFu);
  EXPECT_EQ(cob::rpdo(1, 5), 0x205u);
  EXPECT_EQ(cob::rpdo(4, 1), 0x501u);
}

TEST(Objects, ASecondAxisIs800Higher) {
  EXPECT_EQ(of_axis(object::kControlword, 1), 0x6840);
  EXPECT_EQ(of_axis(object::kStiffness, 3), 0x3810);
}

TEST(FrameSink, RefusesAndCountsWhenFull) {
  std::array<Frame, 1> storage{};
  FrameSink sink(storage);
  EXPECT_TRUE(sink.push({.id = 1}));
  EXPECT_FALSE(sink.push({.id = 2}));
  EXPECT_EQ(sink.frames().size(), 1u);
  EXPECT_EQ(sink.dropped(), 1u);
}

}  // namespace
}  // namespace tandem::canopen
