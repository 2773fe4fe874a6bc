// Frames and datagrams against literal bytes, and everything that is none.
#include "ethercat/datagram.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

namespace tandem::ethercat {
namespace {

constexpr MacAddress kSource{0x00, 0x11, 0x22, 0x33, 0x44, 0x55};

/// "FF 01 …" as bytes.
std::vector<std::uint8_t> hex(const std::string& text) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t at = 0; at < text.size(); at += 3) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(at, 2), nullptr, 16)));
  }
  return bytes;
}

std::vector<std::uint8_t> padded(std::vector<std::uint8_t> bytes) {
  if (bytes.size() < kMinFrameBytes) bytes.resize(kMinFrameBytes, 0);
  return bytes;
}

const std::string kEthernet = "FF FF FF FF FF FF 00 11 22 33 44 55 88 A4 ";

struct Written {
  std::vector<std::uint8_t> buffer = std::vector<std::uint8_t>(kMaxFrameBytes, 0xEE);
  FrameWriter writer;
  Written() { writer.begin(buffer, kSource); }
  std::vector<std::uint8_t> finish() {
    const std::size_t size = writer.finish();
    return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size)};
  }
};

TEST(Datagram, OneThatCountsTheSlavesHasTheseBytes) {
  Written frame;
  ASSERT_EQ(frame.writer.add(Command::kBrd, 0x80, register_address(0, 0x0000), 1).size(), 1u);
  EXPECT_EQ(frame.finish(),
            padded(hex(kEthernet + "0D 10 07 80 00 00 00 00 01 00 00 00 00 00 00")));
}

TEST(Datagram, TwoInAFrameAreJoinedByTheFirstOnesMoreBit) {
  Written frame;
  const auto state = frame.writer.add(Command::kFpwr, 0x01, register_address(0x1001, 0x0120), 2);
  ASSERT_EQ(state.size(), 2u);
  state[0] = 0x11;
  ASSERT_EQ(frame.writer.add(Command::kLrw, 0x02, 0x00010200, 3).size(), 3u);
  EXPECT_EQ(frame.finish(),
            padded(hex(kEthernet + "1D 10 "
                                   "05 01 01 10 20 01 02 80 00 00 11 00 00 00 "
                                   "0C 02 00 02 01 00 03 00 00 00 00 00 00 00 00")));
}

TEST(Datagram, EveryCommandIsWrittenAndReadBackAsItsNumber) {
  for (int number = 0; number < kCommands; ++number) {
    const auto command = static_cast<Command>(number);
    Written frame;
    ASSERT_EQ(frame.writer.add(command, 7, 0x01300002, 4).size(), 4u);
    auto bytes = frame.finish();
    EXPECT_EQ(bytes[kFrameHeaderBytes], number);
    FrameReader reader(bytes);
    Datagram datagram;
    ASSERT_TRUE(reader.next(datagram));
    EXPECT_EQ(datagram.command(), command);
    EXPECT_EQ(datagram.slave(), 2);
    EXPECT_EQ(datagram.offset(), 0x0130);
    EXPECT_EQ(is_logical(command), number >= 10 && number <= 12);
    EXPECT_FALSE(reader.next(datagram));
    EXPECT_EQ(reader.error(), LineError::kNone);
  }
  EXPECT_STREQ(to_string(Command::kArmw), "ARMW");
  EXPECT_STREQ(to_string(static_cast<Command>(15)), "?");
}

TEST(Datagram, FieldsOfAnAnswerAreRead) {
  auto bytes = padded(hex(kEthernet + "10 10 04 2A 02 10 30 01 04 40 20 01 08 00 1B 00 03 00"));
  FrameReader reader(bytes);
  Datagram datagram;
  ASSERT_TRUE(reader.next(datagram));
  EXPECT_EQ(datagram.command(), Command::kFprd);
  EXPECT_EQ(datagram.index(), 0x2A);
  EXPECT_EQ(datagram.address(), 0x01301002u);
  EXPECT_TRUE(datagram.circulating());
  EXPECT_FALSE(datagram.more());
  EXPECT_EQ(datagram.interrupt(), 0x0120);
  EXPECT_EQ(std::vector(datagram.data().begin(), datagram.data().end()), hex("08 00 1B 00"));
  EXPECT_EQ(datagram.working_counter(), 3);
}

TEST(Datagram, ASlaveChangesItInPlace) {
  auto bytes = padded(hex(kEthernet + "0D 10 01 00 FF FF 30 01 01 00 00 00 00 FF FF"));
  FrameReader reader(bytes);
  Datagram datagram;
  ASSERT_TRUE(reader.next(datagram));
  datagram.set_slave(static_cast<std::uint16_t>(datagram.slave() + 1));
  datagram.add_working_counter(1);  // wraps around
  datagram.data()[0] = 0x08;
  datagram.add_interrupt(0x0004);
  EXPECT_EQ(bytes, padded(hex(kEthernet + "0D 10 01 00 00 00 30 01 01 00 04 00 08 00 00")));
}

TEST(Datagram, PositionsCountDownFromZero) {
  EXPECT_EQ(at_position(0), 0x0000);
  EXPECT_EQ(at_position(1), 0xFFFF);
  EXPECT_EQ(at_position(29), 0xFFE3);
}

TEST(Datagram, WhatDoesNotFitIsNotAppended) {
  Written frame;
  EXPECT_TRUE(frame.writer.add(Command::kLrw, 0, 0, kMaxDatagramData + 1).empty());
  EXPECT_TRUE(frame.writer.empty());
  EXPECT_EQ(frame.writer.add(Command::kLrw, 0, 0, kMaxDatagramData).size(), 1486u);
  EXPECT_FALSE(frame.writer.fits(0));
  EXPECT_TRUE(frame.writer.add(Command::kNop, 0, 0, 1).empty());
  auto bytes = frame.finish();
  EXPECT_EQ(bytes.size(), 1514u);
  EXPECT_EQ(check_frame(bytes), LineError::kNone);
}

TEST(Datagram, WhatIsNoFrameIsRefusedWithItsReason) {
  const auto error = [](std::vector<std::uint8_t> bytes) { return check_frame(bytes); };
  const std::string brd = "07 80 00 00 00 00 01 00 00 00 00 00 00";
  EXPECT_EQ(error(padded(hex(kEthernet + "0D 10 " + brd))), LineError::kNone);
  EXPECT_EQ(error({}), LineError::kTooShort);
  EXPECT_EQ(error(hex(kEthernet + "0D")), LineError::kTooShort);
  EXPECT_EQ(error(std::vector<std::uint8_t>(1515, 0)), LineError::kTooLong);
  EXPECT_EQ(error(std::vector<std::uint8_t>(60, 0)), LineError::kNotEtherCat);
  EXPECT_EQ(error(padded(hex(kEthernet + "0D 40 " + brd))), LineError::kNotCommands);
  EXPECT_EQ(error(padded(hex(kEthernet + "0B 10 " + brd))), LineError::kLength);
  EXPECT_EQ(error(padded(hex(kEthernet + "2D 10 " + brd))), LineError::kLength);
  EXPECT_EQ(error(padded(hex(kEthernet + "0D 10 0F" + brd.substr(2)))), LineError::kCommand);
  EXPECT_EQ(error(padded(hex(kEthernet + "0C 10 " + brd))), LineError::kTruncated);
  EXPECT_EQ(error(padded(hex(kEthernet + "0E 10 " + brd))), LineError::kTrailing);
  const std::string announces = "07 80 00 00 00 00 01 80 00 00 00 00 00";
  EXPECT_EQ(error(padded(hex(kEthernet + "0D 10 " + announces))), LineError::kMissing);
  EXPECT_EQ(error(padded(hex(kEthernet + "14 10 " + announces))), LineError::kTruncated);
}

TEST(Datagram, AFrameCutAnywhereIsRefused) {
  Written frame;
  ASSERT_FALSE(frame.writer.add(Command::kFprd, 1, 0, 40).empty());
  ASSERT_FALSE(frame.writer.add(Command::kLrw, 2, 0, 60).empty());
  const auto whole = frame.finish();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    std::vector<std::uint8_t> cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_NE(check_frame(cut), LineError::kNone) << size;
  }
}

}  // namespace
}  // namespace tandem::ethercat
