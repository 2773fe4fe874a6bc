// The switch that waits until a shadow and the command agree.
#include <cmath>

#include "tests/runtime/shadow_run.hpp"

namespace tandem::runtime {
namespace {

TEST(ShadowSwitch, OfEqualOnesHappensAtOnceAndTheShadowGoesOn) {
  ShadowRun run;
  run.other->from_rad = 0.1;
  run.begin_shadow();
  ASSERT_TRUE(run.services().switch_when({"led"}, {"other"}, 1e-9, 100 * kCycle_ns, kNow));
  run.steps(1);
  const SwitchLook look = run.services().last_switch();
  EXPECT_EQ(look.state, SwitchState::kDone);
  EXPECT_EQ(look.cycle, look.asked);
  EXPECT_EQ(run.other->starts, 1) << "it goes on, and does not start anew";
  EXPECT_EQ(run.other->updates, 2);
  EXPECT_EQ(run.led->stops, 1);
  EXPECT_EQ(run.reference(0), 0.1);
  EXPECT_FALSE(run.services().controllers()[0].active);
  EXPECT_TRUE(run.services().controllers()[1].active);
  EXPECT_FALSE(run.services().controllers()[1].shadow);
  run.steps(200);
  EXPECT_EQ(run.reference(0), 0.1);
}

TEST(ShadowSwitch, WaitsForTheFirstCycleInWhichTheyAgree) {
  ShadowRun run;
  // 0.001 rad a cycle from 0.05 rad below: within 0.0105 rad after 40 of them.
  run.begin_shadow();
  const std::uint64_t now = run.cycle->next_cycle();
  run.other->rate_rad = 0.001;
  run.other->from_rad = 0.05 - 0.001 * static_cast<double>(now);
  ASSERT_TRUE(run.services().switch_when({"led"}, {"other"}, 0.0105, 1000 * kCycle_ns, kNow));
  run.steps(40);  // the last of them is apart by 0.011
  EXPECT_EQ(run.services().last_switch().state, SwitchState::kWaits);
  EXPECT_NEAR(run.apart(CommandReference::kPosition), -0.011, 1e-12);
  run.steps(1);  // by 0.010
  EXPECT_EQ(run.services().last_switch().state, SwitchState::kWaits);
  EXPECT_TRUE(run.services().controllers()[0].active);
  run.steps(1);
  EXPECT_EQ(run.services().last_switch().state, SwitchState::kDone);
  EXPECT_TRUE(run.services().controllers()[1].active);
  EXPECT_NEAR(run.reference(0), 0.1, 1e-3) << "without a step";
}

TEST(ShadowSwitch, TellsThatTheyDidNotAgreeInTime) {
  ShadowRun run;
  run.begin_shadow();
  ASSERT_TRUE(run.services().switch_when({"led"}, {"other"}, 0.19, 50 * kCycle_ns, kNow));
  run.steps(50);
  EXPECT_EQ(run.services().last_switch().state, SwitchState::kWaits);
  run.steps(1);
  const SwitchLook look = run.services().last_switch();
  EXPECT_EQ(look.state, SwitchState::kTimeOut);
  EXPECT_DOUBLE_EQ(look.difference, 0.2);
  EXPECT_EQ(look.joint, 0);
  run.steps(100);
  EXPECT_TRUE(run.services().controllers()[0].active);
  EXPECT_TRUE(run.shadow().runs);
}

TEST(ShadowSwitch, NeedsTheSameMode) {
  ShadowRun run({}, hal::ControlMode::kTorque);
  run.begin_shadow();
  ASSERT_TRUE(run.services().switch_when({"led"}, {"other"}, 1e6, 10 * kCycle_ns, kNow));
  run.steps(12);
  EXPECT_EQ(run.services().last_switch().state, SwitchState::kTimeOut);
  EXPECT_TRUE(std::isnan(run.services().last_switch().difference));
}

TEST(ShadowSwitch, IsGivenUpWithItsShadow) {
  ShadowRun run;
  run.begin_shadow();
  ASSERT_TRUE(run.services().switch_when({"led"}, {"other"}, 0.01, 1000 * kCycle_ns, kNow));
  run.steps(1);
  const auto second = run.while_cycling(
      [&] { return run.services().switch_when({"led"}, {"other"}, 1.0, 1000 * kCycle_ns); });
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("another switch waits"), std::string::npos);
  run.other->answer = Code::kFault;
  run.steps(1);
  EXPECT_EQ(run.services().last_switch().state, SwitchState::kGivenUp);
}

TEST(ShadowSwitch, IsCancelledOnRequest) {
  ShadowRun run;
  run.begin_shadow();
  ASSERT_TRUE(run.services().switch_when({"led"}, {"other"}, 0.01, 1000 * kCycle_ns, kNow));
  run.steps(1);
  EXPECT_EQ(run.services().last_switch().state, SwitchState::kWaits);
  ASSERT_TRUE(run.while_cycling([&] { return run.services().cancel_switch(); }));
  EXPECT_EQ(run.services().last_switch().state, SwitchState::kGivenUp);
  EXPECT_TRUE(run.shadow().runs);
  const auto none = run.while_cycling([&] { return run.services().cancel_switch(); });
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("no switch waits"), std::string::npos);
}

TEST(ShadowSwitch, IsGivenUpWithWhatItWasToStop) {
  ShadowRun run;
  run.begin_shadow();
  ASSERT_TRUE(run.services().switch_when({"led"}, {"other"}, 0.01, 1000 * kCycle_ns, kNow));
  run.steps(1);
  ASSERT_TRUE(run.services().switch_controllers({"led"}, {}, kNow));
  run.steps(2);
  EXPECT_EQ(run.services().last_switch().state, SwitchState::kGivenUp);
}

// Nobody waits for the answer: the loop refuses it in its next cycle.
TEST(ShadowSwitch, IsToldWhereItIsRefusedLater) {
  ShadowRun run;
  ASSERT_TRUE(run.services().switch_when({"led"}, {"other"}, 0.01, 1000 * kCycle_ns, kNow));
  const std::uint64_t seen = run.services().texts().count();
  run.steps(1);
  EXPECT_EQ(run.services().texts().count(), seen + 1);
}

TEST(ShadowSwitch, PlaysAgainToTheSameBits) {
  ShadowRun run;
  run.begin_shadow();
  const std::uint64_t now = run.cycle->next_cycle();
  run.other->rate_rad = 0.001;
  run.other->from_rad = 0.05 - 0.001 * static_cast<double>(now);
  ASSERT_TRUE(run.services().switch_when({"led"}, {"other"}, 0.01, 1000 * kCycle_ns, kNow));
  run.steps(10);
  const auto snapshot = run.cycle->save();
  ASSERT_TRUE(snapshot);
  const auto first = bytes_of(run, 100);
  const SwitchLook done = run.services().last_switch();
  EXPECT_EQ(done.state, SwitchState::kDone);
  const int updates = run.other->updates;
  ASSERT_TRUE(run.cycle->restore(*snapshot));
  EXPECT_TRUE(run.shadow().runs);
  EXPECT_EQ(run.services().last_switch().state, SwitchState::kWaits);
  const auto again = run.cycle->save();
  ASSERT_TRUE(again);
  EXPECT_EQ(*again, *snapshot);
  EXPECT_EQ(bytes_of(run, 100), first);
  EXPECT_EQ(run.services().last_switch().cycle, done.cycle);
  EXPECT_EQ(run.other->updates, updates);
}

}  // namespace
}  // namespace tandem::runtime
