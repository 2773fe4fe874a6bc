// A controller that runs beside the active one without commanding: what it shows, and what ends it.
// Linked with the real-time trap.
#include <cmath>
#include <numbers>

#include "tests/rt/fake_clock.hpp"
#include "tests/runtime/shadow_run.hpp"

namespace tandem::runtime {
namespace {

TEST(ControllerShadow, ShowsWhatItWantsLessWhatIsCommanded) {
  ShadowRun run;
  run.other->torque_Nm = -2.0;
  run.begin_shadow();
  EXPECT_EQ(run.other->starts, 1);
  EXPECT_EQ(run.other->updates, 1);
  EXPECT_EQ(run.other->seen_rad, 0.1) << "it is seeded with what is commanded";
  EXPECT_EQ(run.apart(CommandReference::kPosition), 0.3 - 0.1);
  EXPECT_EQ(run.apart(CommandReference::kVelocity), 0.0);
  EXPECT_EQ(run.apart(CommandReference::kTorque), -2.0);
  EXPECT_TRUE(std::isnan(run.apart(CommandReference::kCurrent))) << "no mode of it uses that";
  EXPECT_EQ(run.reference(0), 0.1);
  run.other->from_rad = -0.15;
  run.steps(1);
  run.other->from_rad = 0.1;
  run.steps(5);
  const ShadowStatus shadow = run.shadow();
  EXPECT_EQ(shadow.joints[0].now[0], 0.0);
  EXPECT_DOUBLE_EQ(shadow.joints[0].most[0], 0.25);
  EXPECT_DOUBLE_EQ(shadow.joints[0].step[0], 0.45);
  EXPECT_EQ(shadow.joints[0].owner, 0);
  EXPECT_EQ(shadow.look.calls, 7U);
  EXPECT_TRUE(run.services().controllers()[1].shadow);
  EXPECT_FALSE(run.services().controllers()[1].active);
  const auto signals = run.services().signals();
  EXPECT_EQ(signals.at(1).block->look().values, std::vector{0.25}) << "signals are as ever";
}

TEST(ControllerShadow, ChangesNoBitOfTheRun) {
  ShadowRun with, without;
  with.other->tunes = true;
  ASSERT_TRUE(with.services().begin_shadow("other", kNow));
  for (ShadowRun* run : {&with, &without}) run->led->rate_rad = 1e-4;
  EXPECT_EQ(bytes_of(with, 50), bytes_of(without, 50));
  with.other->answer = Code::kFault;
  EXPECT_EQ(bytes_of(with, 50), bytes_of(without, 50));
  EXPECT_FALSE(with.shadow().runs);
  EXPECT_EQ(with.host->gains().gains(0, hal::PidLoop::kPosition).kp, 200.0);
  EXPECT_EQ(with.host->gains().revision(), 0U);
}

struct Trouble {
  const char* name;
  void (*cause)(Candidate&);
  const char* words;
};
class ShadowTrouble : public testing::TestWithParam<Trouble> {};
INSTANTIATE_TEST_SUITE_P(
    Kinds, ShadowTrouble,
    testing::Values(Trouble{"Nan", [](Candidate& c) { c.torque_Nm = kUnknown; },
                            "shadow ended: a reference is not finite: shoulder"},
                    Trouble{"Code", [](Candidate& c) { c.answer = Code::kDiverged; },
                            "shadow ended: its update() answered an error: Diverged"},
                    Trouble{"Stray", [](Candidate& c) { c.strays = true; },
                            "shadow ended: it wrote what it has not claimed: wrist"},
                    Trouble{"Done", [](Candidate& c) { c.answer = Code::kStopped; },
                            "shadow ended: its task is done"}),
    [](const auto& one) { return std::string(one.param.name); });

TEST_P(ShadowTrouble, ConcernsTheShadowAlone) {
  ShadowRun run;
  run.begin_shadow();
  GetParam().cause(*run.other);
  run.steps(10);
  EXPECT_FALSE(run.shadow().runs);
  EXPECT_EQ(run.words(), GetParam().words);
  EXPECT_EQ(run.other->updates, 2) << "the one that did it was the last";
  EXPECT_EQ(run.other->stops, 1);
  EXPECT_EQ(run.texts().size(), 1U) << "it is said once";
  EXPECT_EQ(run.cycle->phase(), RunPhase::kRunning);
  EXPECT_TRUE(run.cycle->faults().empty());
}

TEST(ControllerShadow, RefusesWhatIsActiveAShadowAlreadyOrNone) {
  ShadowRun run;
  const auto text = [](const Result<RequestResult>& answer) { return JointRun::text(answer); };
  EXPECT_NE(text(run.services().begin_shadow("led", kNow)).find("is active"), std::string::npos);
  EXPECT_NE(text(run.services().begin_shadow("ohter", kNow)).find("did you mean 'other'?"),
            std::string::npos);
  run.begin_shadow();
  EXPECT_NE(text(run.services().begin_shadow("other", kNow)).find("is a shadow already"),
            std::string::npos);
  ASSERT_TRUE(run.services().end_shadow("other", kNow));
  run.steps(1);
  EXPECT_FALSE(run.shadow().runs);
  EXPECT_EQ(run.other->stops, 1);
  const auto again = run.while_cycling([&] { return run.services().end_shadow("other"); });
  EXPECT_NE(text(again).find("the controller 'other' is no shadow"), std::string::npos);
  const auto waits = run.while_cycling(
      [&] { return run.services().switch_when({"led"}, {"other"}, 0.01, 100 * kCycle_ns); });
  EXPECT_NE(text(waits).find("the controller 'other' is no shadow"), std::string::npos);
}

TEST(ControllerShadow, EndsWithTheControllers) {
  ShadowRun run({.after_stop = AfterStop::kWait});
  run.begin_shadow();
  run.cycle->inbox().emergency_stop(hal::StopCategory::kCategory1);
  run.steps(3);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kFaulted);
  EXPECT_FALSE(run.shadow().runs);
  EXPECT_EQ(run.words(), "shadow ended: the controllers were stopped");
  const auto asked = run.while_cycling([&] { return run.services().begin_shadow("other"); });
  ASSERT_FALSE(asked);
}

TEST(ControllerShadow, UnloadingEndsIt) {
  ShadowRun run;
  run.begin_shadow();
  ASSERT_TRUE(run.while_cycling([&] { return run.services().unload("other"); }));
  run.steps(5);
  EXPECT_TRUE(run.services().shadows().empty());
}

// In real time.

struct TimedShadow : ShadowRun {
  TimedShadow()
      : ShadowRun({.loop = {.pacing = rt::Pacing::kWallClock,
                            .on_overrun = rt::OverrunPolicy::kStop,
                            .stop_late = 1,
                            .stop_window = 10}},
                  hal::ControlMode::kPosition, &time()) {
    led->clock = other->clock = &time();
    led->takes_ns = 300'000;
    other->takes_ns = 200'000;
    begin_shadow();
    steps(10);
  }
  static rt::FakeClock& time() {
    static rt::FakeClock clock;
    return clock;
  }
};

TEST(ShadowTime, ThatIsTooLongEndsItAndIsNoFaultOfTheRun) {
  TimedShadow run;
  EXPECT_TRUE(run.shadow().runs);
  run.other->takes_ns = 800'000;
  run.steps(2);
  EXPECT_EQ(run.words(), "shadow ended: it needs more time than the cycle leaves");
  EXPECT_EQ(run.cycle->loop().overruns, 1U);
  run.steps(20);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kRunning);
  EXPECT_TRUE(run.cycle->faults().empty());
  const auto controllers = run.services().controllers();
  EXPECT_EQ(controllers[0].overruns, 0U);
  EXPECT_EQ(controllers[1].overruns, 1U) << "it is its own";
}

TEST(ShadowTime, ThatTheActiveOneTakesLeavesItsCallOut) {
  TimedShadow run;
  const int updates = run.other->updates;
  run.led->takes_ns = 850'000;
  run.steps(2);
  EXPECT_EQ(run.other->updates, updates);
  run.led->takes_ns = 300'000;
  run.steps(1);
  EXPECT_EQ(run.other->updates, updates + 1);
  EXPECT_EQ(run.shadow().look.missed, 2U);
  run.led->takes_ns = 850'000;
  run.steps(3);
  EXPECT_FALSE(run.shadow().runs) << "three in a row";
  EXPECT_EQ(run.cycle->loop().overruns, 0U);
}

TEST(ShadowTime, DoesNotExcuseTheActiveOne) {
  TimedShadow run;
  run.led->takes_ns = 1'200'000;
  run.steps(2);
  ASSERT_FALSE(run.cycle->faults().empty());
  EXPECT_EQ(run.services().controllers()[0].overruns, 1U);
}

}  // namespace
}  // namespace tandem::runtime
