// How an operator leads a joint back that stands outside its limits: tandem joint recover.
#include <functional>

#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime {
namespace {

using test::kNow;

/// The elbow's range ends at 1.5 rad, its velocity at 2 rad/s. A controller has it.
struct JointRecovery : testing::Test, test::JointRun {
  JointRecovery() {
    add_sine({1});
    begin({.after_stop = AfterStop::kWait});
  }
  [[nodiscard]] std::string recover(const std::string& joint) const {
    return text(services().recover(joint, kNow), "asked");
  }
  /// By the loop, to what was asked last.
  [[nodiscard]] double answered() {
    steps(1);
    return reference(1);
  }
  void stop_at(double elbow_rad) {
    steps(100);
    cycle->inbox().emergency_stop(hal::StopCategory::kCategory0);
    steps(5);
    backend.push(1, elbow_rad);
    steps(5);
  }
  void reset() {
    cycle->inbox().reset_faults();
    steps(100);
    ASSERT_EQ(cycle->phase(), RunPhase::kHeld);
  }
};

TEST_F(JointRecovery, LeadsAJointSlowlyToItsLimitWhenItIsAsked) {
  stop_at(1.6);
  EXPECT_EQ(recover("elbow"), "asked");
  EXPECT_EQ(answered(), 1.6) << "a fault is latched: nothing moves";
  reset();
  EXPECT_EQ(reference(1), 1.6);
  EXPECT_NE(recover("elbo").find("did you mean 'elbow'"), std::string::npos);
  EXPECT_EQ(recover("elbow"), "asked");
  double before = answered();
  EXPECT_DOUBLE_EQ(before, 1.5999);
  for (int i = 0; i < 990; ++i) {
    const double now = answered();
    EXPECT_NEAR(before - now, 1e-4, 1e-12);
    before = now;
  }
  steps(100);
  EXPECT_EQ(reference(1), 1.5);
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
}

/// `joint stop` had left it on its way, with "done".
TEST_F(JointRecovery, IsEndedByAStopAndCanBeginAnew) {
  stop_at(1.6);
  reset();
  EXPECT_EQ(recover("elbow"), "asked");
  steps(100);
  EXPECT_TRUE(services().move_joint("elbow", {}, RunServices::Patience{0}).has_value());
  steps(1);
  const double stopped = reference(1);
  EXPECT_GT(stopped, 1.5);
  EXPECT_LT(stopped, 1.6);
  steps(100);
  EXPECT_EQ(reference(1), stopped);
  EXPECT_EQ(recover("elbow"), "asked");
  steps(2000);
  EXPECT_EQ(reference(1), 1.5);
}

/// A start had ended it without a word. Outside, the joint takes 15,000 cycles.
TEST_F(JointRecovery, IsNotEndedByTheStartOfAControllerThatClaimsTheJoint) {
  stop_at(3.0);
  reset();
  EXPECT_EQ(recover("elbow"), "asked");
  const double before = answered();
  const auto start = [this](const std::function<Result<RequestResult>(RunServices&)>& ask) {
    return text(while_cycling([&] { return ask(services()); }), "started");
  };
  const auto all = [&] { return start([](RunServices& services) { return services.go_on(); }); };
  EXPECT_EQ(all(),
            "elbow: is on its way back to its limits, which the controller 'sine' would end (ask "
            "again when it is inside: tandem joint list elbow shows where it is)");
  EXPECT_EQ(start([](RunServices& services) { return services.switch_controllers({}, {"sine"}); }),
            all());
  const auto moved = start(
      [](RunServices& services) { return services.move_joint("elbow", {.target_rad = 0.0}); });
  EXPECT_NE(moved.find("is on its way back to its limits, which this would end"), std::string::npos)
      << moved;
  EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
  EXPECT_LT(answered(), before);
  steps(15'100);
  EXPECT_EQ(reference(1), 1.5);
  EXPECT_EQ(all(), "started");
  EXPECT_EQ(cycle->phase(), RunPhase::kRunning);
}

TEST_F(JointRecovery, ComesBeforeAMotion) {
  stop_at(1.6);
  reset();
  const auto answer =
      while_cycling([&] { return services().move_joint("elbow", {.target_rad = 0.0}); });
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().to_string(),
            "elbow: stands outside its limits (lead it back first: tandem joint recover elbow)");
  EXPECT_EQ(reference(1), 1.6);
}

}  // namespace
}  // namespace tandem::runtime
