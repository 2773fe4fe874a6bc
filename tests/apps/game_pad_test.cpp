// Game pads: what their events make of an input, and what becomes of one that is pulled out. The
// device is a pipe. Nothing here has seen a real one: this shows what the reader does with what
// linux/input.h and the kernel's documentation say of event devices.
#include "apps/run/game_pad.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <limits>
#include <random>
#include <thread>

#include "controllers/controller_io.hpp"
#include "tests/apps/fake_event_device.hpp"
#include "tests/runtime/loop_run.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::apps {
namespace {

using runtime::InputFeeder;
using runtime::InputPort;

input_event event(std::uint16_t type, std::uint16_t code, std::int32_t value) {
  input_event made{};
  made.type = type;
  made.code = code;
  made.value = value;
  return made;
}

/// As the kernel has a stick at rest and a button, of many devices.
FakeEventDevice plugged_in() {
  input_absinfo stick{};
  stick.minimum = -32768;
  stick.maximum = 32767;
  return {.axes = {{ABS_Y, stick}}, .buttons = {BTN_SOUTH}, .down = {}};
}

const Error kWhere{.message = {}, .hint = {}, .file = "pad.toml", .line = 7, .key = {}};

struct Pad : testing::Test {
  void SetUp() override {
    FakeEventDevice::now() = plugged_in();
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
  /// What the next cycle holds.
  std::span<const double> take() {
    hal::Outside outside;
    (void)port->take({.cycle = ++cycle, .time_ns = 0, .period_ns = 1'000'000}, true, outside);
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

/// The kernel's queue overflowed: what is behind SYN_DROPPED is older than what the device says.
TEST_F(Pad, AfterDroppedEventsItIsAsTheDeviceSays) {
  GamePad one = pad();
  FakeEventDevice::now().axes[ABS_Y].value = 32767;
  write({event(EV_ABS, ABS_Y, -32768), event(EV_KEY, BTN_SOUTH, 1), event(EV_SYN, SYN_REPORT, 0),
         event(EV_SYN, SYN_DROPPED, 0), event(EV_ABS, ABS_Y, -20000), event(EV_KEY, BTN_SOUTH, 1)});
  EXPECT_TRUE(one.read());
  EXPECT_DOUBLE_EQ(take()[0], 0.5);
  write({event(EV_SYN, SYN_REPORT, 0)});
  EXPECT_TRUE(one.read());
  EXPECT_DOUBLE_EQ(take()[0], -0.5);
  EXPECT_EQ(port->input().value[5], 0.0) << "it was released meanwhile";
  write({event(EV_ABS, ABS_Y, -32768), event(EV_SYN, SYN_REPORT, 0)});
  EXPECT_TRUE(one.read());
  EXPECT_DOUBLE_EQ(take()[0], 0.5) << "and goes on";
  FakeEventDevice::now().knows_state = false;
  write({event(EV_SYN, SYN_DROPPED, 0), event(EV_SYN, SYN_REPORT, 0)});
  EXPECT_FALSE(one.read()) << "how it stands is not known any more";
  EXPECT_EQ(one.descriptor(), -1);
}

TEST_F(Pad, NoStreamOfEventsIsBeyondTheBounds) {
  GamePad one = pad();
  std::mt19937 random(7);
  const auto any = [&random](std::int64_t most) {
    return std::uniform_int_distribution<std::int64_t>(0, most)(random);
  };
  for (int i = 0; i < 20'000; ++i) {
    write({event(static_cast<std::uint16_t>(any(4)),
                 static_cast<std::uint16_t>(any(1) == 0 ? any(3) : any(KEY_MAX)),
                 static_cast<std::int32_t>(any(0xFFFFFFFF)))});
    if (i % 10 != 0) continue;
    ASSERT_TRUE(one.read());
    ASSERT_LE(std::abs(take()[0]), 0.5);
    ASSERT_LE(std::abs(port->input().value[5]), 0.25);
  }
  EXPECT_EQ(port->look().counts.refused, 0U);
  EXPECT_GT(port->input().sequence, 100U);
}

/// A loop, and a pad that it reads by the file's name: a named pipe.
struct PadOfARun : testing::Test, runtime::test::JointRun {
  class Driven : public Controller {
   public:
    Status configure(ControllerSetup& setup) override {
      input = setup.input("twist", InputKind::kTwist,
                          {.max = {0.5}, .timeout_s = 0.02, .otherwise = {0, 0, 0, 0, 0, 0.125}});
      return {};
    }
    void start(const hal::CycleTime&, const hal::StateImage&,
               hal::CommandImage&) noexcept override {}
    Code update(const hal::CycleTime&, const hal::StateImage&,
                hal::CommandImage&) noexcept override {
      return Code::kOk;
    }
    void archive(Archive&) override {}
    Input input;
  };

  void SetUp() override {
    FakeEventDevice::now() = plugged_in();
    plug_in();
    const runtime::InputSource source{.name = "twist",
                                      .feeder = InputFeeder::kGamepad,
                                      .device = device,
                                      .mapping = {{"x", "-ABS_Y 0.5"}, {"yaw", "BTN_SOUTH 0.25"}},
                                      .where = kWhere};
    auto made = std::make_shared<Driven>();
    driven = made.get();
    ASSERT_TRUE(host->add("one", std::move(made), runtime::test::parameters(), true,
                          std::span(&source, 1)));
    begin();
    (void)until(runtime::RunPhase::kRunning);
  }
  void TearDown() override { pull_out(); }
  void plug_in() {
    ASSERT_EQ(::mkfifo(device.c_str(), 0600), 0);
    end = ::open(device.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    ASSERT_GE(end, 0);
  }
  void pull_out() {
    (void)::unlink(device.c_str());
    if (end >= 0) ::close(std::exchange(end, -1));
  }
  void open_pads() {
    auto opened = GamePads::open(services());
    ASSERT_TRUE(opened) << opened.error().to_string();
    pads = std::move(*opened);
  }
  [[nodiscard]] std::string why_not() {
    const auto opened = GamePads::open(services());
    return opened ? "" : opened.error().to_string();
  }
  void push(std::int32_t stick) const {
    const std::array events{event(EV_ABS, ABS_Y, stick), event(EV_SYN, SYN_REPORT, 0)};
    ASSERT_EQ(::write(end, events.data(), sizeof events), static_cast<ssize_t>(sizeof events));
  }
  template <class There>
  bool until_there(const There& there) {
    for (int i = 0; i < 5000; ++i) {
      steps(1);
      if (there()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }
  [[nodiscard]] const Input& input() const { return driven->input; }
  [[nodiscard]] std::string why() { return services().inputs().front().look.why; }
  bool is_held() {
    return until_there([&] { return !input().fresh(); }) && input()[5] == 0.125;
  }

  tandem::test::ScratchFolder folder;
  std::string device = folder / "event-joystick";
  int end = -1;
  Driven* driven = nullptr;
  std::unique_ptr<GamePads> pads;
};

TEST_F(PadOfARun, IsReadAsItStandsWhenItIsOpened) {
  FakeEventDevice::now().axes[ABS_Y].value = -32768;
  FakeEventDevice::now().down = {BTN_SOUTH};
  open_pads();
  EXPECT_TRUE(until_there([&] { return input().fresh(); })) << why();
  EXPECT_DOUBLE_EQ(input()[0], 0.5);
  EXPECT_EQ(input()[5], 0.25) << "a button that was down before";
}

TEST_F(PadOfARun, ThatIsPulledOutFallsSilentAndGoesOnWhenItIsBack) {
  open_pads();
  push(-32768);
  EXPECT_TRUE(until_there([&] { return input()[0] == 0.5; })) << why();
  // By ENODEV, which is what the kernel says, and by the end of the file.
  FakeEventDevice::now().pulled_out = true;
  push(-32768);
  EXPECT_TRUE(until_there([&] { return why().contains("the game pad is gone"); })) << why();
  pull_out();
  EXPECT_TRUE(is_held());
  EXPECT_TRUE(until_there([&] { return why().contains("No such file"); })) << why();
  FakeEventDevice::now() = plugged_in();
  plug_in();
  EXPECT_TRUE(until_there([&] { return input().fresh(); })) << why();
  EXPECT_EQ(input()[0], 0.0) << "it is at rest, and its old state is forgotten";
  push(32767);
  EXPECT_TRUE(until_there([&] { return input()[0] == -0.5; }));
  pull_out();
  EXPECT_TRUE(is_held());
}

TEST_F(PadOfARun, AnotherDeviceInItsPlaceIsNotTaken) {
  open_pads();
  EXPECT_TRUE(until_there([&] { return input().fresh(); })) << why();
  pull_out();
  EXPECT_TRUE(is_held());
  FakeEventDevice::now().axes.clear();
  plug_in();
  EXPECT_TRUE(until_there([&] { return why().contains("has no -ABS_Y 0.5"); })) << why();
  EXPECT_FALSE(input().fresh());
}

TEST_F(PadOfARun, AWrongDeviceIsAnErrorAtTheStart) {
  const auto has = [this](const char* words) {
    const std::string text = why_not();
    EXPECT_NE(text.find(words), std::string::npos) << text;
    EXPECT_EQ(text.rfind("pad.toml:7", 0), 0U) << text;
    FakeEventDevice::now() = plugged_in();
  };
  FakeEventDevice::now().knows_capabilities = false;
  has("is no event device");
  FakeEventDevice::now().axes.clear();
  has("has no -ABS_Y 0.5");
  FakeEventDevice::now().buttons = {BTN_EAST};
  has("has no BTN_SOUTH 0.25");
  FakeEventDevice::now().axes[ABS_Y].maximum = -32768;
  has("has no range of -ABS_Y");
  FakeEventDevice::now().knows_state = false;
  has("has no range of -ABS_Y");
  EXPECT_EQ(why_not(), "");
}

}  // namespace
}  // namespace tandem::apps
