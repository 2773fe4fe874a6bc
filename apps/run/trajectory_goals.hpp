// The goals of an action: which there are, how each stands, and which a client wants cancelled, as
// ROS 2's rcl_action keeps them.
// Layer: apps/run.  Thread: one at a time.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace tandem::apps {

using GoalId = std::array<std::uint8_t, 16>;

/// As action_msgs/msg/GoalStatus has it.
enum class GoalStatus : std::int8_t {
  kUnknown = 0,
  kExecuting = 2,
  kCanceling = 3,
  kSucceeded = 4,
  kCanceled = 5,
  kAborted = 6,
};
[[nodiscard]] constexpr bool has_ended(GoalStatus status) {
  return status == GoalStatus::kSucceeded || status == GoalStatus::kCanceled ||
         status == GoalStatus::kAborted;
}

/// As action_msgs/srv/CancelGoal has it.
enum class CancelCode : std::int8_t { kNone = 0, kRejected = 1, kUnknownGoal = 2, kEnded = 3 };

/// As the result of control_msgs/action/FollowJointTrajectory has it.
enum class TrajectoryError : std::int32_t {
  kNone = 0,
  kInvalidGoal = -1,
  kPathTolerance = -4,
  kGoalTolerance = -5,
};

struct TrajectoryGoal {
  GoalId id{};
  std::int64_t stamp_ns = 0;  ///< when it was accepted
  std::int64_t begin_ns = 0;  ///< time 0 of its trajectory, on the same clock
  GoalStatus status = GoalStatus::kExecuting;
  std::uint64_t sample = 0;            ///< number of the sample that leads it, or stops it
  std::optional<std::uint64_t> cycle;  ///< in which that arrived
  TrajectoryError error = TrajectoryError::kNone;
  std::string words;
  std::chrono::steady_clock::time_point ended_at;
};

/// At most one is under way: the newest.
class TrajectoryGoals {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMost = 100;         ///< that have ended: the oldest leaves first
  static constexpr std::chrono::minutes kKept{15};  ///< after its end

  [[nodiscard]] const std::deque<TrajectoryGoal>& all() const { return goals_; }
  /// Null: there is none, or no more.
  [[nodiscard]] const TrajectoryGoal* find(const GoalId& id) const;
  /// The one that is under way; null: none is.
  [[nodiscard]] TrajectoryGoal* active();

  void add(TrajectoryGoal goal, Clock::time_point now);
  void end(TrajectoryGoal& goal, GoalStatus status, TrajectoryError error, std::string words,
           Clock::time_point now);

  /// Whether the one that is under way is meant. All zero: every goal; an id: this one; a stamp:
  /// those accepted until then.
  /// @return kNone also where nothing was to be cancelled
  [[nodiscard]] CancelCode wants_cancelled(const GoalId& id, std::int64_t stamp_ns, bool& active);

 private:
  void forget(Clock::time_point now);
  std::deque<TrajectoryGoal> goals_;  // in the order in which they came
};

}  // namespace tandem::apps
