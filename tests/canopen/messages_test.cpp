#include "canopen/messages.hpp"

#include "tests/canopen/wire.hpp"

namespace tandem::canopen {
namespace {

TEST(Nmt, StartOfEveryNodeIsTheStandardsBytes) {
  EXPECT_EQ(make_nmt(NmtCommand::kStart, 0), wire(0x000, {0x01, 0x00}));
  EXPECT_EQ(make_nmt(NmtCommand::kStop, 5), wire(0x000, {0x02, 0x05}));
  EXPECT_EQ(make_nmt(NmtCommand::kEnterPreOperational, 127), wire(0x000, {0x80, 0x7F}));
  EXPECT_EQ(make_nmt(NmtCommand::kResetNode, 1), wire(0x000, {0x81, 0x01}));
  EXPECT_EQ(make_nmt(NmtCommand::kResetCommunication, 1), wire(0x000, {0x82, 0x01}));
}

TEST(Nmt, IsParsedFromTheStandardsBytes) {
  const auto message = parse_nmt(wire(0x000, {0x81, 0x07}));
  ASSERT_TRUE(message);
  EXPECT_EQ(message->command, NmtCommand::kResetNode);
  EXPECT_EQ(message->node, 7);
}

TEST(Nmt, RefusesUnknownCommandsAndLengths) {
  EXPECT_FALSE(parse_nmt(wire(0x000, {0x03, 0x07})));
  EXPECT_FALSE(parse_nmt(wire(0x000, {0x01})));
  EXPECT_FALSE(parse_nmt(wire(0x001, {0x01, 0x07})));
}

TEST(Sync, HasNoData) { EXPECT_EQ(make_sync(), wire(0x080, {})); }

TEST(Heartbeat, CarriesTheState) {
  EXPECT_EQ(make_heartbeat(4, NmtState::kBootUp), wire(0x704, {0x00}));
  EXPECT_EQ(make_heartbeat(4, NmtState::kOperational), wire(0x704, {0x05}));
  EXPECT_EQ(make_heartbeat(127, NmtState::kPreOperational), wire(0x77F, {0x7F}));
  const auto message = parse_heartbeat(wire(0x70A, {0x04}));
  ASSERT_TRUE(message);
  EXPECT_EQ(message->node, 10);
  EXPECT_EQ(message->state, NmtState::kStopped);
}

TEST(Time, IsMillisecondsOfTheDayAndDays) {
  EXPECT_EQ(make_time(0), wire(0x100, {0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(make_time(258'999'999), wire(0x100, {0x02, 0x01, 0, 0, 0, 0}));
  const std::int64_t day_ns = 86'400'000'000'000;
  EXPECT_EQ(make_time(3 * day_ns - 1'000'000), wire(0x100, {0xFF, 0x5B, 0x26, 0x05, 2, 0}));
}

TEST(Heartbeat, NeedsANodeIdAndOneByte) {
  EXPECT_FALSE(parse_heartbeat(wire(0x700, {0x05})));
  EXPECT_FALSE(parse_heartbeat(wire(0x780, {0x05})));
  EXPECT_FALSE(parse_heartbeat(wire(0x705, {0x05, 0x00})));
}

TEST(Emergency, IsTheStandardsBytesBothWays) {
  const Frame frame = wire(0x083, {0x11, 0x86, 0x21, 0x01, 0x00, 0x00, 0x00, 0x00});
  EXPECT_EQ(make_emergency({.node = 3,
                            .code = ErrorCode::kFollowingError,
                            .error_register = 0x21,
                            .manufacturer = {1}}),
            frame);
  const auto message = parse_emergency(frame);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->node, 3);
  EXPECT_EQ(message->code, ErrorCode::kFollowingError);
  EXPECT_EQ(message->error_register, 0x21);
  EXPECT_EQ(message->manufacturer[0], 1);
}

TEST(Emergency, IsNotASync) {
  EXPECT_FALSE(parse_emergency(wire(0x080, {0, 0, 0, 0, 0, 0, 0, 0})));
  EXPECT_FALSE(parse_emergency(wire(0x081, {0, 0, 0})));
}

TEST(ErrorWords, TellACodeOrItsClass) {
  EXPECT_EQ(error_words(0x8611), "following error");
  EXPECT_EQ(error_words(0x3210), "DC link over-voltage");
  EXPECT_EQ(error_words(0x2213), "current inside the device") << "one that is not listed";
  EXPECT_EQ(error_words(0x7306), "sensor");
  EXPECT_EQ(error_words(0xFF37), "the maker's own error: its manual tells");
  EXPECT_EQ(error_words(0x0001), "unknown error");
}

}  // namespace
}  // namespace tandem::canopen
