#include "log/event.hpp"

#include <bit>
#include <cmath>
#include <string>
#include <string_view>

#include "base/realtime.hpp"
#include "hal/fault_kind.hpp"

namespace tandem::log {
namespace {

const EventNames kNames{
    .joints = {"hip", "knee"}, .boards = {"legs"}, .sensors = {"foot", "imu"}, .buses = {"can0"}};

TEST(Event, SaysWhatHappenedInOneLine) {
  Event event{.code = 0x7310, .joint = 1, .kind = EventKind::kFault};
  EXPECT_EQ(describe(event, kNames), "fault of knee (0x7310)");
  event = {.code = static_cast<std::uint32_t>(Code::kDiverged), .kind = EventKind::kFault};
  EXPECT_EQ(describe(event, kNames), "fault: Diverged");
  event = {.code = 11, .joint = 0, .kind = EventKind::kFeedbackLost};
  EXPECT_EQ(describe(event, kNames), "fault: no feedback of hip for 11 cycles");
  event = {.code = 1, .kind = EventKind::kFell};
  EXPECT_EQ(describe(event, kNames), "fault: the robot fell: its base is tilted");
  event.code = 5;
  EXPECT_EQ(describe(event, kNames), "fault: the robot fell: a foot is below the ground");
  event.code = 6;
  EXPECT_EQ(describe(event, kNames), "fault: the robot fell") << "of a newer program";
  event = {.code = 1, .kind = EventKind::kEmergencyStop};
  EXPECT_EQ(describe(event, kNames), "emergency stop by a signal");
  event.code = 2;
  EXPECT_EQ(describe(event, kNames), "emergency stop on request");
  event.code = 3;
  EXPECT_EQ(describe(event, kNames), "emergency stop by the watchdog");
  event = {.code = 1, .kind = EventKind::kLinkLost};
  EXPECT_EQ(describe(event, kNames), "link lost: the robot follows no command");
  event.code = 2;
  EXPECT_EQ(describe(event, kNames), "link lost: no state comes");
  event = {.code = 108, .joint = 1, .kind = EventKind::kHot, .reported = 1};
  EXPECT_EQ(describe(event, kNames), "hot winding of knee, reported");
  event = {.kind = EventKind::kControllerReloaded};
  EXPECT_EQ(describe(event, kNames), "controller reloaded");
  event.code = 3;
  EXPECT_EQ(describe(event, kNames), "controller reloaded: it starts afresh");
  event = {.code = 1, .joint = 0, .kind = EventKind::kHomingFailed};
  EXPECT_EQ(describe(event, kNames),
            "homing failed of hip: the drive reports a homing error (statusword bit 13)");
  event = {.code = static_cast<std::uint32_t>(Code::kOutOfRange),
           .joint = 1,
           .kind = EventKind::kLimited};
  EXPECT_EQ(describe(event, kNames), "command limited of knee: it was out of range");
  event.code = static_cast<std::uint32_t>(Code::kOk);
  EXPECT_EQ(describe(event, kNames),
            "command limited of knee: it is followed as fast as the joint's limits allow");
  event = {.code = 3, .kind = EventKind::kOverrun};
  EXPECT_EQ(describe(event, kNames), "overrun: 3 cycles skipped");
  EventNames names = kNames;
  names.controller = [](std::size_t id) { return id == 4 ? "squat" : "?"; };
  event.controller = 5;
  EXPECT_EQ(describe(event, names), "overrun: 3 cycles skipped, controller 'squat'");
  EXPECT_EQ(describe(event, kNames), "overrun: 3 cycles skipped") << "nobody knows its name";
  event = {.kind = EventKind::kBringUpDone};
  EXPECT_EQ(describe(event, kNames), "bring-up done");
  event = {.code = static_cast<std::uint32_t>(hal::FaultKind::kEncoderFreeze),
           .joint = 1,
           .kind = EventKind::kInjected};
  EXPECT_EQ(describe(event, kNames), "injected encoder_freeze of knee");
  event.code = static_cast<std::uint32_t>(hal::FaultKind::kPush);
  event.kind = EventKind::kEnded;
  EXPECT_EQ(describe(event, kNames), "ended push of knee");
  // It had named the first joint of the board.
  event = {.code = static_cast<std::uint32_t>(hal::FaultKind::kBoardKill),
           .kind = EventKind::kInjected,
           .target = hal::FaultTarget::kBoard};
  EXPECT_EQ(describe(event, kNames), "injected board_kill of board legs");
  EXPECT_EQ(describe(event, {.joints = kNames.joints}), "injected board_kill");
  // Sensors and buses had no names.
  event.target = hal::FaultTarget::kSensor;
  event.value = 1.0F;
  EXPECT_EQ(describe(event, kNames), "injected board_kill of sensor imu");
  event.code = static_cast<std::uint32_t>(hal::FaultKind::kBusDown);
  event.target = hal::FaultTarget::kBus;
  EXPECT_EQ(describe(event, kNames), "injected bus_down") << "there is no second bus";
  event.value = 0.0F;
  EXPECT_EQ(describe(event, kNames), "injected bus_down of bus can0");
  event.code = static_cast<std::uint32_t>(hal::FaultKind::kFrameDrop);
  event.target = hal::FaultTarget::kNone;
  EXPECT_EQ(describe(event, kNames), "injected frame_drop");
  // It had been "sensor lost (0x000B)", whichever it was.
  event = {.code = 11, .kind = EventKind::kSensorLost, .value = 1.0F};
  EXPECT_EQ(describe(event, kNames), "sensor lost: imu for 11 cycles");
  // A payload was "injected payload of knee", and its drop nothing.
  event = {.code = 2, .joint = 1, .kind = EventKind::kPickedUp};
  EXPECT_EQ(describe(event, kNames), "payload picked up") << "nobody knows what it is";
  names.payload = [](std::uint32_t n) {
    return n == 2 ? std::string("a, box, 1.6 kg on foot") : std::string("2 kg on foot");
  };
  EXPECT_EQ(describe(event, names), "payload picked up: a, box, 1.6 kg on foot");
  event.kind = EventKind::kDropped;
  EXPECT_EQ(describe(event, names), "payload dropped: a, box");
  event.code = 3;
  EXPECT_EQ(describe(event, names), "payload dropped: 2 kg on foot");
  event = {.joint = 1, .kind = EventKind::kMotionRequested, .value = -0.5F};
  EXPECT_EQ(describe(event, kNames), "motion requested of knee: to -0.5 rad (-28.65 deg)");
  event.code = 1;  // it slides
  EXPECT_EQ(describe(event, kNames), "motion requested of knee: to -0.5 m");
  event = {.joint = 0, .kind = EventKind::kMotionStopped};
  EXPECT_EQ(describe(event, kNames), "motion stopped of hip");
  event = {.joint = 0, .kind = EventKind::kRecoveryRequested};
  EXPECT_EQ(describe(event, kNames), "recovery requested of hip");
  EXPECT_FALSE(is_fault(event.kind));
  event = {.code = 1500, .joint = 1, .kind = EventKind::kCollision};
  EXPECT_EQ(describe(event, kNames), "fault: collision of knee: an external torque of 1.5 Nm");
  EXPECT_TRUE(is_stop(event));
  event.code = 4;  // of a wrist
  EXPECT_EQ(describe(event, kNames), "fault: collision of knee: an external torque of 0.004 Nm");
  event.code = 1500;
  event.reported = 1;
  EXPECT_EQ(describe(event, kNames),
            "fault: collision of knee: an external torque of 1.5 Nm, reported");
  EXPECT_TRUE(is_fault(event.kind));
  EXPECT_FALSE(is_stop(event));
}

TEST(Event, OfAParameterIsReadBackBitForBit) {
  const auto text_of = [](std::string_view name, double value) {
    ParameterSet set{.value = value};
    set.letters = static_cast<std::uint32_t>(name.copy(set.name.data(), set.name.size()));
    return describe({.kind = EventKind::kParameterSet}, kNames) + describe(set);
  };
  EXPECT_EQ(text_of("squat.kp", 12.5), "parameter set: squat.kp = 12.5");
  for (const double value : {0.1, 0.1 + 0.2, -0.0, 5e-324, 1.7976931348623157e308, 40.0}) {
    const auto back = parameter_of(text_of("my = one.kp", value));
    ASSERT_TRUE(back);
    EXPECT_EQ(back->name, "my = one.kp");
    EXPECT_EQ(std::bit_cast<std::uint64_t>(back->value), std::bit_cast<std::uint64_t>(value));
  }
  EXPECT_EQ(parameter_of(text_of(std::string(300, 'x'), 1.0))->name, std::string(200, 'x'));
  for (const char* other : {"", "gains set of hip", "parameter set", "parameter set: x = "}) {
    EXPECT_FALSE(parameter_of(other)) << other;
  }
}

// "wob.shape = 1" said which one of its words only to who reads the controller.
TEST(Event, OfAChoiceHasItsWord) {
  ParameterSet set{.value = 1.0, .letters = 9, .word_letters = 6, .name = {}, .word = {}};
  std::string_view("wob.shape").copy(set.name.data(), set.name.size());
  std::string_view("square").copy(set.word.data(), set.word.size());
  const std::string text = describe({.kind = EventKind::kParameterSet}, kNames) + describe(set);
  EXPECT_EQ(text, "parameter set: wob.shape = square");
  const auto back = parameter_of(text);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->name, "wob.shape");
  EXPECT_EQ(back->word, "square");
  EXPECT_TRUE(std::isnan(back->value));
}

TEST(Event, OfACommandHasItsFieldValueAndLimit) {
  using hal::CommandField;
  using hal::LimitKind;
  Event event{.joint = 1, .kind = EventKind::kLimited};
  const auto text = [&](const hal::LimitMet& met) { return describe(event, kNames, met); };
  EXPECT_EQ(text({.value = 4.0, .limit = 3.125, .kind = LimitKind::kRange}),
            "command limited of knee: the position reference 4 rad is beyond the limit 3.125 rad");
  EXPECT_EQ(text({.value = -80.0,
                  .limit = 2000.0,
                  .field = CommandField::kTorque,
                  .kind = LimitKind::kTooFast,
                  .derivative = 1,
                  .slides = 1}),
            "command limited of knee: the torque -80 N asks for more than 2000 N/s: it is followed "
            "as fast as the joint's limits allow");
  EXPECT_EQ(text({.value = 1.0,
                  .limit = 30.0,
                  .field = CommandField::kVelocity,
                  .kind = LimitKind::kTooFast,
                  .derivative = 2}),
            "command limited of knee: the velocity reference 1 rad/s asks for more than 30 rad/s3: "
            "it is followed as fast as the joint's limits allow");
  event.kind = EventKind::kFault;
  event.code = static_cast<std::uint32_t>(Code::kNotFinite);
  EXPECT_EQ(text({.value = std::nan(""), .kind = LimitKind::kNotFinite}),
            "fault of knee: the position reference nan is not finite");
  EXPECT_EQ(text({.value = 37.0, .field = CommandField::kMode, .kind = LimitKind::kNotFinite}),
            "fault of knee: the mode 37 does not exist");
}

TEST(Event, IsEncodedAsPlainCdr) {
  const Event event{.cycle = 2, .time_ns = 3, .code = 4, .joint = -1, .kind = EventKind::kFault};
  Bytes body;
  encode_event(event, "ab", body);
  const unsigned char expected[] = {2, 0, 0, 0, 0, 0, 0, 0, 3,    0,    0,    0,
                                    0, 0, 0, 0, 4, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF,
                                    3, 0, 0, 0, 3, 0, 0, 0, 'a',  'b',  0};
  ASSERT_EQ(body.size(), sizeof expected);
  for (std::size_t i = 0; i < body.size(); ++i) {
    EXPECT_EQ(static_cast<unsigned char>(body[i]), expected[i]) << i;
  }
  const auto back = decode_event(body);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->event.joint, -1);
  EXPECT_EQ(back->event.kind, EventKind::kFault);
  EXPECT_EQ(back->text, "ab");
  EXPECT_TRUE(is_stop(back->event)) << "an older log has zeros there";
  encode_event({.kind = EventKind::kCollision, .reported = 1}, "ab", body = {});
  EXPECT_EQ(decode_event(body)->event.reported, 1);
}

TEST(Event, RefusesACutMessage) {
  Bytes body;
  encode_event({}, "text", body);
  for (std::size_t size = 0; size < body.size(); ++size) {
    EXPECT_FALSE(decode_event(std::span(body).first(size))) << size;
  }
  encode_event({}, "", body = {});
  body.resize(body.size() - 1);
  body[28] = std::byte{0};
  EXPECT_FALSE(decode_event(body)) << "a text of no bytes lacks the zero at its end";
}

}  // namespace
}  // namespace tandem::log
