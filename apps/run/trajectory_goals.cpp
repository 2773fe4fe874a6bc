#include "apps/run/trajectory_goals.hpp"

#include <algorithm>
#include <utility>

namespace tandem::apps {

const TrajectoryGoal* TrajectoryGoals::find(const GoalId& id) const {
  const auto found = std::ranges::find(goals_, id, &TrajectoryGoal::id);
  return found == goals_.end() ? nullptr : &*found;
}

TrajectoryGoal* TrajectoryGoals::active() {
  return goals_.empty() || has_ended(goals_.back().status) ? nullptr : &goals_.back();
}

void TrajectoryGoals::add(TrajectoryGoal goal, Clock::time_point now) {
  forget(now);
  goals_.push_back(std::move(goal));
}

void TrajectoryGoals::end(TrajectoryGoal& goal, GoalStatus status, TrajectoryError error,
                          std::string words, Clock::time_point now) {
  goal.status = status;
  goal.error = error;
  goal.words = std::move(words);
  goal.ended_at = now;
}

CancelCode TrajectoryGoals::wants_cancelled(const GoalId& id, std::int64_t stamp_ns,
                                            bool& active_is) {
  const bool named = id != GoalId{};
  const TrajectoryGoal* const goal = find(id);
  const TrajectoryGoal* const now = active();
  active_is = now != nullptr && ((named && goal == now) || (!named && stamp_ns == 0) ||
                                 (stamp_ns != 0 && now->stamp_ns <= stamp_ns));
  if (active_is || !named) return CancelCode::kNone;
  return goal == nullptr ? CancelCode::kUnknownGoal : CancelCode::kEnded;
}

void TrajectoryGoals::forget(Clock::time_point now) {
  const auto old = [now](const TrajectoryGoal& goal) {
    return has_ended(goal.status) && now - goal.ended_at > kKept;
  };
  std::erase_if(goals_, old);
  while (goals_.size() >= kMost && has_ended(goals_.front().status)) goals_.pop_front();
}

}  // namespace tandem::apps
