// Messages of ROS 2 that bring samples of controllers' inputs.
// Layer: runtime.  Thread: any, non-RT.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "controllers/inputs.hpp"
#include "dds/types.hpp"
#include "runtime/input_source.hpp"

namespace tandem::runtime {

/// A type of message, and the kind of input whose samples it brings.
struct InputMessage {
  InputKind kind;
  bool has_frame;  ///< its numbers stand in the frame that its header names
  const dds::Type& (*type)();
  /// The numbers of an input in `message`, one of that type; its bounds are InputPort::check()'s.
  /// Errors: another number of them than the input has; joints that it has not; another frame than
  /// InputSource::frame.
  Result<std::vector<double>> (*sample)(const void* message, const InputBlock& input,
                                        const InputSource& source);
};

/// Every type; of a kind the usual one first. A new one is a row.
[[nodiscard]] std::span<const InputMessage> input_messages();

/// A goal of the action control_msgs/action/FollowJointTrajectory as a sample of an input that has
/// terms. A stamp that is not 0 is the trajectory's beginning, on the clock of `now_ns`.
/// Errors: what joint_trajectory_controller refuses as well (no joint, no way-point, a joint that
/// the input lacks, an end in the past, a speed at the end, efforts), and what it overlooks: a
/// tolerance of another joint or below 0 that is not -1, joints of several axes, a joint twice.
[[nodiscard]] Result<std::vector<double>> goal_sample(
    const control_msgs_action_dds__FollowJointTrajectory_Goal_& goal, const InputBlock& input,
    std::int64_t now_ns);

/// That of the type which the source names, else the first of the kind.
/// Errors, at the source's place: no such type of this kind (the nearest is suggested); a frame of
/// a message that names none.
[[nodiscard]] Result<const InputMessage*> message_of(InputKind kind, const InputSource& source);

}  // namespace tandem::runtime
