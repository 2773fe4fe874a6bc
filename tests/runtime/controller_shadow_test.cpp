// A controller that runs beside the active one without commanding: what it shows, what ends it, and
// the switch that waits until both agree. Linked with the real-time trap.
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/rt/fake_clock.hpp"
#include "tests/runtime/switch_run.hpp"

namespace tandem::runtime {
namespace {

using test::FirstOrderRobot;
using test::JointRun;
using test::kNow;
using test::Names;
using test::Sine;

constexpr std::int64_t kCycle_ns = 1'000'000;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Writes places that the test says, and misbehaves on demand.
class Candidate : public Controller {
 public:
  explicit Candidate(hal::ControlMode mode = hal::ControlMode::kPosition) : mode_(mode) {}
  Status configure(ControllerSetup& setup) override {
    setup.claim(0, mode_);
    gains_ = &setup.gains;
    depth_ = setup.signal("depth", "m", "a number");
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage&,
             hal::CommandImage& command) noexcept override {
    ++starts;
    seen_rad = command.position_rad()[0];
  }
  Code update(const hal::CycleTime& time, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    ++updates;
    depth_ = 0.25;
    if (clock != nullptr) clock->now += takes_ns;
    if (tunes) gains_->set_gains(0, hal::PidLoop::kPosition, {7.0, 0.0, 0.0});
    command.position_rad()[0] = from_rad + rate_rad * static_cast<double>(time.cycle);
    command.torque_Nm()[0] = torque_Nm;
    if (strays) command.position_rad()[2] = 1.0;
    return answer;
  }
  void stop() noexcept override { ++stops; }
  void archive(Archive& ar) override { ar(updates); }

  double from_rad = 0.3, rate_rad = 0.0, torque_Nm = 0.0, seen_rad = 0.0;
  Code answer = Code::kOk;
  bool strays = false, tunes = false;
  int starts = 0, updates = 0, stops = 0;
  rt::FakeClock* clock = nullptr;
  std::int64_t takes_ns = 0;

 private:
  hal::ControlMode mode_;
  Signal depth_;
  hal::ParameterImage* gains_ = nullptr;
};

/// "led" keeps joint 0 at 0.1 rad; "other", which is to be its shadow, is loaded beside it.
struct ShadowRun : JointRun {
  explicit ShadowRun(const CycleConfig& config = {},
                     hal::ControlMode mode = hal::ControlMode::kPosition, rt::Clock* its = nullptr)
      : other(std::make_shared<Candidate>(mode)) {
    if (its != nullptr) clock = its;
    led->from_rad = 0.1;
    add("led", led);
    add("other", other, false);
    begin(config);
    until(RunPhase::kRunning);
    steps(20);
  }
  void begin_shadow() {
    ASSERT_TRUE(services().begin_shadow("other", kNow));
    steps(1);
  }
  [[nodiscard]] ShadowStatus shadow() const {
    const auto all = services().shadows();
    EXPECT_EQ(all.size(), 1U);
    return all.empty() ? ShadowStatus{} : all.front();
  }
  [[nodiscard]] std::vector<hal::TextEvent> texts() const {
    std::vector<hal::TextEvent> all;
    std::uint64_t seen = 0;
    (void)services().texts().read(seen, all);
    return all;
  }
  /// What was said last.
  [[nodiscard]] std::string words() const {
    const std::vector<hal::TextEvent> all = texts();
    return all.empty() ? "" : all.back().words();
  }
  [[nodiscard]] double apart(CommandReference reference) const {
    return shadow().joints.at(0).now[static_cast<std::size_t>(reference)];
  }
  std::shared_ptr<Candidate> led = std::make_shared<Candidate>(), other;
};

/// The bytes of state, command and truth over `count` cycles.
std::vector<std::byte> bytes_of(ShadowRun& run, int count) {
  std::vector<std::byte> all;
  for (int i = 0; i < count; ++i) {
    EXPECT_TRUE(run.cycle->step());
    for (const auto& bytes : {run.cycle->state().bytes(), run.cycle->command().bytes(),
                              std::as_const(run.backend.truth).bytes()}) {
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
  }
  return all;
}

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

// Switching.

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
