// The ROS 2 action control_msgs/action/FollowJointTrajectory of a controller's trajectory input, as
// joint_trajectory_controller serves it: docs/ros2.md.
// Layer: apps/run.  Thread: opened and closed by main; requests on the server's thread, and one of
// its own looks how a goal stands.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "apps/run/input_lease.hpp"
#include "apps/run/trajectory_goals.hpp"
#include "base/result.hpp"
#include "controllers/trajectory_outcome.hpp"
#include "dds/endpoint.hpp"
#include "dds/service_server.hpp"
#include "hal/signal_block.hpp"

namespace tandem::apps {

/// A goal is a sample of the input like a topic's, and how it ends the controller's signals say.
/// What is refused is counted, and the last reason shown, as for a sample.
class TrajectoryAction {
 public:
  /// Errors: what DDS refuses; the controller does not tell how a trajectory ends.
  [[nodiscard]] static Result<std::unique_ptr<TrajectoryAction>> open(
      std::shared_ptr<runtime::InputPort> port, const FeedParts& parts,
      std::shared_ptr<InputLease> lease);
  /// A goal that is under way is aborted, and said to be.
  ~TrajectoryAction();
  TrajectoryAction(const TrajectoryAction&) = delete;
  TrajectoryAction& operator=(const TrajectoryAction&) = delete;

 private:
  using Feedback = dds::control_msgs::FollowJointTrajectory_FeedbackMessage;
  using SendRequest = dds::control_msgs::FollowJointTrajectory_SendGoal_Request;
  using SendResponse = dds::control_msgs::FollowJointTrajectory_SendGoal_Response;
  using ResultRequest = dds::control_msgs::FollowJointTrajectory_GetResult_Request;
  using ResultResponse = dds::control_msgs::FollowJointTrajectory_GetResult_Response;
  using CancelRequest = dds::action_msgs::CancelGoal_Request;
  using CancelResponse = dds::action_msgs::CancelGoal_Response;
  using StatusArray = dds::action_msgs::GoalStatusArray;

  TrajectoryAction(std::shared_ptr<runtime::InputPort> port, const FeedParts& parts,
                   std::shared_ptr<InputLease> lease);
  Status make(const std::string& name);
  [[nodiscard]] std::int64_t now_ns() const;
  [[nodiscard]] Status find_signals();

  // The server's thread.
  [[nodiscard]] dds::ServiceWork<SendResponse> read(const SendRequest& request,
                                                    const dds::Asker& asker);
  [[nodiscard]] dds::ServiceWork<ResultResponse> read(const ResultRequest& request);
  [[nodiscard]] dds::ServiceWork<CancelResponse> read(const CancelRequest& request,
                                                      const dds::Asker& asker);
  [[nodiscard]] Status accept(const SendRequest& request, const dds::Asker& asker,
                              std::int64_t now);
  void stop(TrajectoryGoal& goal);

  void watch();
  /// Whether the goal goes on.
  bool look_at(TrajectoryGoal& goal);
  void judge(TrajectoryGoal& goal);
  [[nodiscard]] std::string words_of(TrajectoryOutcome outcome) const;
  void end(TrajectoryGoal& goal, GoalStatus status, TrajectoryError error, std::string words);
  void say_status();
  void say_feedback(const TrajectoryGoal& goal);

  std::shared_ptr<runtime::InputPort> port_;
  FeedParts parts_;
  std::shared_ptr<InputLease> lease_;

  std::mutex mutex_;  // of all below
  std::condition_variable more_;
  bool ending_ = false;
  TrajectoryGoals goals_;
  std::uint64_t loads_ = 0;  // of the controllers, when `signals_` was found
  std::shared_ptr<const hal::SignalBlock> signals_;
  struct Told {
    double cycle = -1.0, outcome = 0.0, joint = 0.0, error = 0.0, tolerance = 0.0,
           of_velocity = 0.0, time_s = 0.0;
    std::uint64_t at_cycle = 0;
  };
  [[nodiscard]] Told told() const;
  std::unique_ptr<dds::Writer<Feedback>> feedback_;
  std::unique_ptr<dds::Writer<StatusArray>> status_;

  std::unique_ptr<dds::ServiceServer> server_;  // after what its thread uses
  std::thread watcher_;
};

}  // namespace tandem::apps
