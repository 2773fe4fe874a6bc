// The stop of category 2: controllers that can go on to a safe posture do, for a limited time, and
// then the drives are stopped as in category 1.
#include <cmath>
#include <csignal>

#include "tests/runtime/loop_run.hpp"
#include "tests/support/rt_trap.hpp"

namespace tandem::runtime {
namespace {

using hal::StopCategory;

/// `able` has joint 0 and can retreat, `other` has joint 1 and cannot.
struct RetreatRun : ::testing::Test, test::JointRun {
  void begin(bool can = true, AfterReset after_reset = AfterReset::kHold) {
    able = add_sine({0}, "able");
    other = add_sine({1}, "other");
    able->retreats = can;
    JointRun::begin(
        {.after_stop = AfterStop::kWait, .after_reset = after_reset, .retreat_cycles = 200});
    steps(100);
    ASSERT_EQ(cycle->phase(), RunPhase::kRunning);
  }
  void stop(StopCategory category) {
    (void)cycle->inbox().emergency_stop(category);
    steps(1);
  }

  test::Sine *able = nullptr, *other = nullptr;
};

TEST_F(RetreatRun, GoesOnUntilThePostureIsReachedAndStopsThen) {
  begin();
  stop(StopCategory::kCategory2);
  EXPECT_EQ(cycle->phase(), RunPhase::kRetreating);
  EXPECT_EQ(backend.stops, 0U) << "the drives follow";
  EXPECT_EQ(able->retreating, 1);
  EXPECT_EQ(other->stops, 1) << "it cannot: its joint is held";
  const int updates = able->updates;
  const auto way = [&] {
    const double from = cycle->command().position_rad()[1];
    steps(1);
    return cycle->command().position_rad()[1] - from;
  };
  const double first = way();
  steps(148);
  EXPECT_EQ(able->updates, updates + 149);
  EXPECT_GT(first, 1e-4);
  EXPECT_LT(way(), 0.4 * first) << "it brakes";
  EXPECT_EQ(cycle->faults()[0].category, StopCategory::kCategory2);
  able->answer = Code::kStopped;  // it is there
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(backend.latched, StopCategory::kCategory1);
  EXPECT_EQ(able->stops, 1);
}

TEST_F(RetreatRun, EndsWhenItsTimeIsOver) {
  begin();
  stop(StopCategory::kCategory2);
  steps(199);
  EXPECT_EQ(cycle->phase(), RunPhase::kRetreating);
  steps(2);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(backend.latched, StopCategory::kCategory1);
}

TEST_F(RetreatRun, IsCategory1WhereNobodyCan) {
  begin(false);
  stop(StopCategory::kCategory2);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(backend.latched, StopCategory::kCategory1);
}

TEST_F(RetreatRun, YieldsToAHarderStopAtOnceAndToNoSofterOne) {
  begin();
  stop(StopCategory::kCategory2);
  stop(StopCategory::kCategory2);
  EXPECT_EQ(able->retreating, 1) << "once";
  EXPECT_EQ(cycle->phase(), RunPhase::kRetreating);
  stop(StopCategory::kCategory0);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(backend.latched, StopCategory::kCategory0);
}

TEST_F(RetreatRun, ThatGivesUpIsCategory1) {
  begin();
  stop(StopCategory::kCategory2);
  able->answer = Code::kFault;
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(backend.latched, StopCategory::kCategory1);
  EXPECT_EQ(cycle->faults().size(), 2U);
}

TEST_F(RetreatRun, ThatGivesNaNIsCategory1) {
  begin();
  stop(StopCategory::kCategory2);
  able->not_finite = true;
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kFaulted);
  EXPECT_EQ(backend.latched, StopCategory::kCategory1);
  EXPECT_TRUE(std::isfinite(cycle->command().position_rad()[0]));
}

TEST_F(RetreatRun, TakesNoRequestsAndIsResetAsEveryStop) {
  begin();
  stop(StopCategory::kCategory2);
  EXPECT_TRUE(cycle->services().recover("wrist", RunServices::Patience{0}));
  steps(1);
  cycle->inbox().reset_faults();
  steps(1);
  EXPECT_EQ(cycle->phase(), RunPhase::kRetreating) << "no reset before it has stopped";
  able->answer = Code::kStopped;
  steps(1);
  able->answer = Code::kOk;
  cycle->inbox().reset_faults();
  steps(50);
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
  ASSERT_TRUE(cycle->services().go_on(RunServices::Patience{0}));
  const int of_able = able->updates, of_other = other->updates;
  steps(10);
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
  EXPECT_GT(able->updates, of_able);
  EXPECT_GT(other->updates, of_other) << "both were active before the stop";
}

TEST_F(RetreatRun, LetsAllGoOnAfterAResetWithoutAnybody) {
  begin(true, AfterReset::kContinue);
  stop(StopCategory::kCategory2);
  able->answer = Code::kStopped;
  steps(1);
  able->answer = Code::kOk;
  cycle->inbox().reset_faults();
  steps(50);
  ASSERT_EQ(cycle->phase(), RunPhase::kRunning);
  const int of_able = able->updates, of_other = other->updates;
  steps(10);
  EXPECT_GT(able->updates, of_able);
  EXPECT_GT(other->updates, of_other) << "the retreat had stopped it";
}

TEST_F(RetreatRun, GoesOnFromASnapshotAsBefore) {
  begin();
  stop(StopCategory::kCategory2);
  steps(20);
  const auto saved = cycle->save();
  ASSERT_TRUE(saved);
  steps(100);
  const double then = cycle->command().position_rad()[0];
  ASSERT_TRUE(cycle->restore(*saved));
  EXPECT_EQ(cycle->phase(), RunPhase::kRetreating);
  steps(100);
  EXPECT_EQ(cycle->command().position_rad()[0], then);
}

}  // namespace
}  // namespace tandem::runtime
