// Game pads: what their events make of an input. The device is a pipe: events are the kernel's.
#include "apps/run/game_pad.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <limits>

#include "controllers/controller_io.hpp"

namespace tandem::apps {
namespace {

using runtime::InputFeeder;
using runtime::InputPort;

const Error kWhere{.message = {}, .hint = {}, .file = "pad.toml", .line = 7, .key = {}};

struct Pad : testing::Test {
  void SetUp() override {
    ASSERT_EQ(::pipe2(ends.data(), O_NONBLOCK | O_CLOEXEC), 0);
    io->inputs.declare("twist", InputKind::kTwist, {.max = {0.5}});
    port = make({{"x", "-ABS_Y 0.5"}, {"yaw", "BTN_SOUTH 0.25"}});
    ASSERT_NE(port, nullptr);
  }
  void TearDown() override {
    if (ends[1] >= 0) ::close(ends[1]);
  }
  std::shared_ptr<InputPort> make(std::map<std::string, std::string> mapping) {
    const runtime::InputSource source{.name = "twist",
                                      .feeder = InputFeeder::kGamepad,
                                      .device = "/dev/null",
                                      .mapping = std::move(mapping),
                                      .where = kWhere};
    auto made = InputPort::make(io, io->inputs.all.front(), "jog", robot, 1'000'000, &source);
    if (!made) ADD_FAILURE() << made.error().to_string();
    return made ? *made : nullptr;
  }
  /// As the kernel has them for these two.
  GamePad pad() {
    PadPart axis = parse_pad_part("-ABS_Y 0.5").value();
    axis.min = -32768;
    axis.max = 32767;
    PadPart button = parse_pad_part("BTN_SOUTH 0.25").value();
    button.component = 5;
    return {Descriptor(ends[0]), port, {axis, button}};
  }
  void write(std::initializer_list<input_event> events) const {
    for (const input_event& event : events)
      ASSERT_EQ(::write(ends[1], &event, sizeof event), static_cast<ssize_t>(sizeof event));
  }
  static input_event event(std::uint16_t type, std::uint16_t code, std::int32_t value) {
    input_event made{};
    made.type = type;
    made.code = code;
    made.value = value;
    return made;
  }
  /// What the next cycle holds.
  std::span<const double> take() {
    (void)port->take({.cycle = ++cycle, .time_ns = 0, .period_ns = 1'000'000}, true);
    return port->input().value;
  }
  [[nodiscard]] std::string why_not_open(std::map<std::string, std::string> mapping) {
    const auto opened = GamePad::open(make(std::move(mapping)));
    return opened ? "" : opened.error().to_string();
  }

  std::array<int, 2> ends{-1, -1};
  hal::Robot robot;
  std::shared_ptr<ControllerIo> io = std::make_shared<ControllerIo>();
  std::shared_ptr<InputPort> port;
  std::uint64_t cycle = 0;
};

TEST_F(Pad, AReportIsOneSample) {
  GamePad one = pad();
  write({event(EV_ABS, ABS_Y, -32768), event(EV_KEY, BTN_SOUTH, 1)});
  EXPECT_TRUE(one.read());
  EXPECT_EQ(take()[0], 0.0) << "its report has not ended";
  write({event(EV_SYN, SYN_REPORT, 0)});
  EXPECT_TRUE(one.read());
  EXPECT_DOUBLE_EQ(take()[0], 0.5) << "forward is up, where the axis is negative";
  EXPECT_EQ(port->input().value[5], 0.25);
  write({event(EV_ABS, ABS_Y, 1000), event(EV_ABS, ABS_X, 5), event(EV_KEY, BTN_SOUTH, 0),
         event(EV_SYN, SYN_REPORT, 0)});
  EXPECT_TRUE(one.read());
  EXPECT_EQ(take()[0], 0.0) << "within the dead band";
  EXPECT_EQ(port->input().value[5], 0.0);
}

TEST_F(Pad, AStickThatRestsIsSentAgainAndOneThatIsGoneIsNot) {
  GamePad one = pad();
  write({event(EV_ABS, ABS_Y, 32767), event(EV_SYN, SYN_REPORT, 0)});
  EXPECT_TRUE(one.read());
  EXPECT_DOUBLE_EQ(take()[0], -0.5);
  ::usleep(110'000);
  one.offer_again();
  (void)take();
  EXPECT_EQ(port->input().sequence, 2U);
  ::close(std::exchange(ends[1], -1));
  EXPECT_FALSE(one.read());
}

TEST_F(Pad, AxesGoFromOneEndToTheOtherWithADeadBand) {
  PadPart part = parse_pad_part("ABS_RX").value();
  part.min = 0;
  part.max = 200;
  for (const auto& [raw, value] : {std::pair{0.0, -1.0},
                                   {200.0, 1.0},
                                   {100.0, 0.0},
                                   {110.0, 0.0},
                                   {160.0, 0.5},
                                   {40.0, -0.5},
                                   {1000.0, 1.0}}) {
    part.raw = raw;
    EXPECT_NEAR(part.value(0.2), value, 1e-12) << raw;
  }
}

TEST_F(Pad, WhatCannotBeOpenedSaysSoWithItsPlace) {
  const auto has = [](const std::string& text, const char* word) {
    EXPECT_NE(text.find(word), std::string::npos) << text;
    EXPECT_EQ(text.rfind("pad.toml:7", 0), 0U) << text;
  };
  has(why_not_open({{"x", "ABS_Y 0.5"}}), "/dev/null is no event device");
  has(why_not_open({{"forward", "ABS_Y 0.5"}}), "no component 'forward'");
  has(why_not_open({{"x", "ABS_YY 0.5"}}), "there is no 'ABS_YY'");
  has(why_not_open({{"x", "ABS_Y fast"}}), "and a number");
  has(why_not_open({{"x", "ABS_Y 0.6"}}), "beyond its bounds");
  const runtime::InputSource nowhere{.name = "twist",
                                     .feeder = InputFeeder::kGamepad,
                                     .device = "/dev/input/none",
                                     .mapping = {{"x", "ABS_Y 0.5"}},
                                     .where = kWhere};
  auto made = InputPort::make(io, io->inputs.all.front(), "jog", robot, 1'000'000, &nowhere);
  ASSERT_TRUE(made);
  has(GamePad::open(*made).error().to_string(), "No such file");
}

}  // namespace
}  // namespace tandem::apps
