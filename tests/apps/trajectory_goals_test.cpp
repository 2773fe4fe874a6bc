#include "apps/run/trajectory_goals.hpp"

#include <gtest/gtest.h>

namespace tandem::apps {
namespace {

using Clock = TrajectoryGoals::Clock;
const Clock::time_point kNow{};

TrajectoryGoal goal_of(std::uint8_t number) {
  TrajectoryGoal goal;
  goal.id[0] = number;
  goal.stamp_ns = number * 1000;
  return goal;
}

struct Goals : testing::Test {
  void end(Clock::time_point now = kNow) {
    goals.end(*goals.active(), GoalStatus::kSucceeded, TrajectoryError::kNone, "", now);
  }
  CancelCode cancel(std::uint8_t number, std::int64_t stamp_ns) {
    GoalId id{};
    id[0] = number;
    return goals.wants_cancelled(id, stamp_ns, meant);
  }
  TrajectoryGoals goals;
  bool meant = false;
};

TEST_F(Goals, KeepResultsForATime) {
  EXPECT_EQ(goals.active(), nullptr);
  goals.add(goal_of(1), kNow);
  ASSERT_NE(goals.active(), nullptr);
  EXPECT_EQ(goals.active()->status, GoalStatus::kExecuting);
  end();
  EXPECT_EQ(goals.active(), nullptr);
  goals.add(goal_of(2), kNow + TrajectoryGoals::kKept);
  EXPECT_NE(goals.find(goal_of(1).id), nullptr);
  end(kNow + TrajectoryGoals::kKept);
  goals.add(goal_of(3), kNow + TrajectoryGoals::kKept + std::chrono::seconds(1));
  EXPECT_EQ(goals.find(goal_of(1).id), nullptr);
  EXPECT_NE(goals.find(goal_of(2).id), nullptr);
}

TEST_F(Goals, KeepNoMoreThanSoMany) {
  for (std::uint8_t i = 1; i <= 200; ++i) {
    goals.add(goal_of(i), kNow);
    if (i < 200) end();
  }
  EXPECT_EQ(goals.all().size(), TrajectoryGoals::kMost);
  EXPECT_EQ(goals.find(goal_of(100).id), nullptr);
  EXPECT_NE(goals.find(goal_of(101).id), nullptr);
}

/// The policy of action_msgs/srv/CancelGoal.
TEST_F(Goals, AreCancelledByNameByTimeOrAll) {
  EXPECT_EQ(cancel(0, 0), CancelCode::kNone);
  EXPECT_FALSE(meant);
  EXPECT_EQ(cancel(7, 0), CancelCode::kUnknownGoal);
  goals.add(goal_of(1), kNow);
  end();
  goals.add(goal_of(2), kNow);
  EXPECT_EQ(cancel(1, 0), CancelCode::kEnded);
  EXPECT_FALSE(meant);
  EXPECT_EQ(cancel(2, 0), CancelCode::kNone);
  EXPECT_TRUE(meant);
  EXPECT_EQ(cancel(0, 0), CancelCode::kNone);
  EXPECT_TRUE(meant);
  EXPECT_EQ(cancel(0, 1999), CancelCode::kNone);
  EXPECT_FALSE(meant) << "it was accepted later";
  EXPECT_EQ(cancel(0, 2000), CancelCode::kNone);
  EXPECT_TRUE(meant);
  EXPECT_EQ(cancel(1, 2000), CancelCode::kNone) << "the one named, and those until then";
  EXPECT_TRUE(meant);
}

}  // namespace
}  // namespace tandem::apps
