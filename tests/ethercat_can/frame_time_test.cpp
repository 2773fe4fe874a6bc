#include "hal/ethercat-can/frame_time.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace tandem::hal::can {
namespace {

using canopen::Frame;
using Bits = std::vector<int>;

double microseconds(const FrameBits& bits, std::int64_t data_Mbit_s) {
  return static_cast<double>(
             duration_ns(bits, {.nominal = 1'000'000, .data = data_Mbit_s * 1'000'000})) *
         1e-3;
}

Frame frame_of(std::uint32_t id, std::vector<std::uint8_t> bytes, bool fd = false) {
  Frame frame;
  frame.id = id;
  frame.length = canopen::frame_length(bytes.size());
  if (fd) frame.flags = canopen::kFlagFd | canopen::kFlagBrs;
  std::ranges::copy(bytes, frame.data.begin());
  return frame;
}

// --- a second way: the frame as a list of bits ------------------------------------

void append(Bits& bits, unsigned value, int count) {
  for (int i = count - 1; i >= 0; --i) bits.push_back(static_cast<int>(value >> i & 1U));
}

/// Polynomial division of the bits, with `count` zeros behind them.
Bits remainder_of(Bits bits, const Bits& polynomial) {
  const std::size_t count = polynomial.size() - 1;
  const std::size_t length = bits.size();
  bits.resize(length + count, 0);
  for (std::size_t i = 0; i < length; ++i) {
    if (bits[i] == 0) continue;
    for (std::size_t k = 0; k < polynomial.size(); ++k) bits[i + k] ^= polynomial[k];
  }
  return {bits.end() - static_cast<std::ptrdiff_t>(count), bits.end()};
}

/// With a complement behind five alike; the one behind the last bit only when `at_end`.
Bits stuffed(const Bits& bits, bool at_end) {
  Bits out;
  for (std::size_t i = 0; i < bits.size(); ++i) {
    out.push_back(bits[i]);
    if (out.size() < 5 || (i + 1 == bits.size() && !at_end)) continue;
    const auto tail = std::vector<int>(out.end() - 5, out.end());
    if (std::ranges::count(tail, tail[0]) == 5) out.push_back(1 - tail[0]);
  }
  return out;
}

Bits classic_wire(const Frame& frame) {
  Bits bits{0};
  append(bits, frame.id, 11);
  append(bits, 0, 3);
  append(bits, frame.length, 4);
  for (const std::uint8_t byte : frame.payload()) append(bits, byte, 8);
  const Bits polynomial{1, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1};  // 0xC599
  const Bits crc = remainder_of(bits, polynomial);
  bits.insert(bits.end(), crc.begin(), crc.end());
  Bits wire = stuffed(bits, true);
  wire.resize(wire.size() + 1 + 1 + 1 + 7 + 3, 1);
  return wire;
}

FrameBits fd_wire(const Frame& frame) {
  Bits bits{0};
  append(bits, frame.id, 11);
  append(bits, 0b00101, 5);
  const std::size_t arbitration_raw = bits.size();
  append(bits, 0, 1);
  const std::vector<int> lengths{0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
  const auto code = std::ranges::find(lengths, static_cast<int>(frame.length)) - lengths.begin();
  append(bits, static_cast<unsigned>(code), 4);
  for (const std::uint8_t byte : frame.payload()) append(bits, byte, 8);
  // The stuff bit behind BRS, if one is needed, belongs to the data phase.
  const Bits head(bits.begin(), bits.begin() + static_cast<std::ptrdiff_t>(arbitration_raw));
  const std::size_t arbitration = stuffed(head, false).size();
  std::size_t data = stuffed(bits, false).size() - arbitration;
  const int crc = frame.length <= 16 ? 17 : 21;
  for (int i = 0; i < 4 + crc; ++i) data += i % 4 == 0 ? 2 : 1;  // a fixed bit before each four
  return {.nominal = static_cast<int>(arbitration) + 13, .data = static_cast<int>(data)};
}

TEST(FrameTime, WorstClassicFramesAreTheTextbooks) {
  EXPECT_EQ(worst_frame_bits(8, false).nominal, 135);
  EXPECT_EQ(worst_frame_bits(0, false).nominal, 55);
  EXPECT_EQ(worst_frame_bits(8, false).data, 0);
}

TEST(FrameTime, WorstFdFramesAreTheBudgetsOfTheBus) {
  EXPECT_NEAR(microseconds(worst_frame_bits(16, true), 5), 73.0, 0.5);
  EXPECT_NEAR(microseconds(worst_frame_bits(16, true), 8), 58.0, 0.5);
  EXPECT_NEAR(microseconds(worst_frame_bits(64, true), 8), 119.0, 0.5);
}

TEST(FrameTime, FdCrcFieldHasAFixedLength) {
  EXPECT_EQ(wire::fd_crc_field(16), 27);
  EXPECT_EQ(wire::fd_crc_field(20), 32);
}

TEST(FrameTime, AFrameWithoutStuffBitsHasItsNominalLength) {
  // Alternating bits; the CRC by hand of this pattern has no five alike either.
  const Frame frame = frame_of(0x2AA, {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55});
  EXPECT_EQ(exact_frame_bits(frame).nominal, static_cast<int>(classic_wire(frame).size()));
  EXPECT_GE(exact_frame_bits(frame).nominal, 111);
  EXPECT_LE(exact_frame_bits(frame).nominal, 113);
}

TEST(FrameTime, SyncIsStuffedBitByBit) {
  const Frame sync = frame_of(0x080, {});
  EXPECT_EQ(exact_frame_bits(sync).nominal, static_cast<int>(classic_wire(sync).size()));
  EXPECT_GT(exact_frame_bits(sync).nominal, 47);
  EXPECT_LE(exact_frame_bits(sync).nominal, 55);
}

TEST(FrameTime, ExactLengthsAgreeWithTheFrameLaidOutBitByBit) {
  std::mt19937 random(7);
  int longest = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const bool fd = trial % 2 == 1;
    std::vector<std::uint8_t> bytes(random() % (fd ? 65 : 9));
    // Long runs, so that there is much to stuff.
    for (std::uint8_t& byte : bytes) {
      const unsigned kind = random() % 4;
      byte = static_cast<std::uint8_t>(kind == 0 ? 0 : kind == 1 ? 0xFF : random());
    }
    const Frame frame = frame_of(random() & 0x7FF, bytes, fd);
    const FrameBits exact = exact_frame_bits(frame);
    const FrameBits worst = worst_frame_bits(frame.length, fd);
    if (fd) {
      EXPECT_EQ(exact, fd_wire(frame)) << "trial " << trial;
    } else {
      EXPECT_EQ(exact.nominal, static_cast<int>(classic_wire(frame).size())) << "trial " << trial;
      longest = std::max(longest, exact.nominal);
    }
    EXPECT_LE(exact.nominal, worst.nominal);
    EXPECT_LE(exact.nominal + exact.data, worst.nominal + worst.data);
  }
  EXPECT_GT(longest, 120) << "the trials hardly stuffed anything";
}

TEST(FrameTime, AnFdFrameWithoutSwitchIsAllAtTheNominalRate) {
  Frame frame = frame_of(0x18A, std::vector<std::uint8_t>(32, 0x5A), true);
  const FrameBits switched = exact_frame_bits(frame);
  frame.flags = canopen::kFlagFd;
  const FrameBits plain = exact_frame_bits(frame);
  EXPECT_EQ(plain.data, 0);
  EXPECT_NEAR(plain.nominal, switched.nominal + switched.data, 1);  // BRS itself is another bit
  EXPECT_EQ(worst_frame_bits(32, true, false).data, 0);
}

TEST(FrameTime, DurationsAreRoundedUp) {
  EXPECT_EQ(duration_ns({.nominal = 135, .data = 0}, {.nominal = 1'000'000, .data = 1}), 135'000);
  EXPECT_EQ(duration_ns({.nominal = 34, .data = 193}, {.nominal = 1'000'000, .data = 8'000'000}),
            34'000 + 24'125);
  EXPECT_EQ(duration_ns({.nominal = 1, .data = 0}, {.nominal = 300'000, .data = 1}), 3'334);
}

}  // namespace
}  // namespace tandem::hal::can
