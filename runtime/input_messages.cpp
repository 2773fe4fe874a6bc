#include "runtime/input_messages.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>

#include "base/nearest.hpp"

namespace tandem::runtime {
namespace {

using Numbers = std::vector<double>;

constexpr double kPerNs = 1e-9;
constexpr double kMostAhead_s = 3600.0;  // of a goal's beginning: beyond, it has another clock

double seconds(const builtin_interfaces_msg_dds__Duration_& time) {
  return static_cast<double>(time.sec) + kPerNs * static_cast<double>(time.nanosec);
}

/// Tells the numbers of a list. Errors: another count than the input has, or with `more` fewer.
template <class List>
Result<Numbers> numbers_of(const char* name, const List& list, const InputBlock& input, bool more) {
  const std::size_t count = input.components.size();
  if (more ? list._length < count : list._length != count) {
    return fail_at(name, fmt::format("has {} numbers, and the input {}", list._length, count),
                   more ? "the first ones count: send at least as many" : "send one of each");
  }
  return Numbers(list._buffer, list._buffer + count);
}

Result<Numbers> numbers_of(const dds::geometry_msgs::Twist& twist, const InputBlock&) {
  return Numbers{twist.linear.x,  twist.linear.y,  twist.linear.z,
                 twist.angular.x, twist.angular.y, twist.angular.z};
}

Result<Numbers> numbers_of(const dds::geometry_msgs::TwistStamped& stamped,
                           const InputBlock& input) {
  return numbers_of(stamped.twist, input);
}

Result<Numbers> numbers_of(const dds::geometry_msgs::WrenchStamped& stamped, const InputBlock&) {
  const auto& force = stamped.wrench.force;
  const auto& torque = stamped.wrench.torque;
  return Numbers{force.x, force.y, force.z, torque.x, torque.y, torque.z};
}

Result<Numbers> numbers_of(const dds::geometry_msgs::PoseStamped& stamped, const InputBlock&) {
  const auto& at = stamped.pose.position;
  const auto& turned = stamped.pose.orientation;
  return Numbers{at.x, at.y, at.z, turned.x, turned.y, turned.z, turned.w};
}

Result<Numbers> numbers_of(const dds::std_msgs::Float64MultiArray& array, const InputBlock& input) {
  if (array.layout.data_offset != 0) {
    return fail_at("layout.data_offset", "is not 0", "send the numbers alone");
  }
  return numbers_of("data", array.data, input, false);
}

/// A pad has as many axes and buttons as it has: the first ones count.
Result<Numbers> numbers_of(const dds::sensor_msgs::Joy& joy, const InputBlock& input) {
  if (input.kind == InputKind::kButtons) return numbers_of("buttons", joy.buttons, input, true);
  return numbers_of("axes", joy.axes, input, true);
}

/// What a joint is called in an error, however long it is.
std::string shown(const char* name) { return std::string(name, ::strnlen(name, 64)); }

/// Where each joint of the input stands in the message; of a part of them the others nowhere.
using Order = std::vector<std::optional<std::size_t>>;

/// Error: it has others, one twice, or, unless a part will do, not each.
Result<Order> order_of(const dds::trajectory_msgs::JointTrajectory& message,
                       const InputBlock& input, bool part) {
  const std::size_t joints = input.components.size();
  const std::size_t named = message.joint_names._length;
  if (part ? named == 0 || named > joints : named != joints) {
    return fail_at("joint_names",
                   fmt::format("{} joints are not {}the {} of the input", named,
                               part ? "some of " : "", joints),
                   part ? "name those that move" : "name each of them, in any order");
  }
  Order order(joints);
  for (std::size_t i = 0; i < named; ++i) {
    const char* const name = message.joint_names._buffer[i];
    const auto found = std::ranges::find(input.components, name);
    const auto joint = static_cast<std::size_t>(found - input.components.begin());
    if (joint == joints || order[joint]) {
      return fail_at(
          "joint_names",
          part ? "'" + shown(name) + "' is there twice, or is none of the input's"
               : "has a joint twice, or one that the input has not",
          part ? suggest(shown(name), input.components) : "name each of the input's, in any order");
    }
    order[joint] = i;
  }
  return order;
}

/// The way-points, of which there are some.
Result<Numbers> way_points(const dds::trajectory_msgs::JointTrajectory& message,
                           const InputBlock& input, const Order& order) {
  const std::size_t joints = input.components.size(), named = message.joint_names._length;
  const std::size_t points = message.points._length;
  if (points > input.options.most_points) {
    return fail_at("points", fmt::format("{} way-points are too many", points),
                   fmt::format("at most {}: `most_points`", input.options.most_points));
  }
  Numbers sample(input.values(), 0.0);
  const bool moves = message.points._buffer[0].velocities._length > 0;
  sample[0] = static_cast<double>(points);
  sample[1] = moves ? 1.0 : 0.0;
  for (std::size_t p = 0; p < points; ++p) {
    const auto& point = message.points._buffer[p];
    if (point.positions._length != named || point.velocities._length != (moves ? named : 0)) {
      return fail_at("points", fmt::format("way-point {} has not a number of each joint", p + 1),
                     "positions of each joint; velocities of each in all points, or in none");
    }
    const std::size_t at = 2 + p * (1 + 2 * joints);
    sample[at] = seconds(point.time_from_start);
    for (std::size_t j = 0; j < joints; ++j) {
      if (!order[j]) continue;
      sample[at + 1 + j] = point.positions._buffer[*order[j]];
      if (moves) sample[at + 1 + joints + j] = point.velocities._buffer[*order[j]];
    }
  }
  return sample;
}

/// It begins when it arrives, whatever its stamp says. No points: the joints stay.
Result<Numbers> numbers_of(const dds::trajectory_msgs::JointTrajectory& message,
                           const InputBlock& input) {
  if (message.points._length == 0) return Numbers(input.values(), 0.0);
  if (message.points._length > input.options.most_points) return way_points(message, input, {});
  const auto order = order_of(message, input, false);
  if (!order) return std::unexpected(order.error());
  return way_points(message, input, *order);
}

/// A tolerance of a goal: above 0 itself, 0 the default, -1 none.
Result<double> tolerance_of(const char* what, const std::string& name, double value) {
  if (value >= 0.0 || std::abs(value + 1.0) < std::numeric_limits<float>::epsilon()) {
    return value < 0.0 ? -1.0 : value;
  }
  return fail_at(what, fmt::format("{:g} is no tolerance{}", value, name),
                 "above 0; 0: the controller's; -1: none");
}

/// @param first  among a joint's terms
Status add_tolerances(Numbers& sample, const char* what, const InputBlock& input,
                      std::span<const control_msgs_msg_dds__JointTolerance_> given,
                      std::size_t first) {
  for (const auto& one : given) {
    const auto found = std::ranges::find(input.components, one.name);
    if (found == input.components.end()) {
      return fail_at(what, "'" + shown(one.name) + "' is none of the input's joints",
                     suggest(shown(one.name), input.components));
    }
    const auto joint = static_cast<std::size_t>(found - input.components.begin());
    const std::size_t at =
        input.terms_at() + InputBlock::kTerms + joint * InputBlock::kTermsOfJoint + first;
    const auto position = tolerance_of(what, " of " + *found, one.position);
    const auto velocity = tolerance_of(what, " of " + *found, one.velocity);
    const auto acceleration = tolerance_of(what, " of " + *found, one.acceleration);
    for (const auto* each : {&position, &velocity, &acceleration}) {
      if (!*each) return std::unexpected(each->error());
    }
    sample[at] = *position;
    sample[at + 1] = *velocity;  // accelerations are not measured
  }
  return {};
}

/// What a trajectory must not have, and joint_trajectory_controller refuses.
Status check_goal(const control_msgs_action_dds__FollowJointTrajectory_Goal_& goal) {
  const auto& way = goal.trajectory;
  const auto& several = goal.multi_dof_trajectory;
  if (several.joint_names._length + several.points._length + goal.component_path_tolerance._length +
          goal.component_goal_tolerance._length >
      0) {
    return fail_at("multi_dof_trajectory", "joints of several axes are not led",
                   "leave it and the component tolerances empty");
  }
  if (way.points._length == 0) {
    return fail_at("points", "has no way-point", "to stop the joints, cancel the goal");
  }
  const auto& last = way.points._buffer[way.points._length - 1];
  for (const double speed : std::span(last.velocities._buffer, last.velocities._length)) {
    if (std::abs(speed) <= std::numeric_limits<float>::epsilon()) continue;
    return fail_at("points", fmt::format("the last way-point has a velocity of {:g}", speed),
                   "end at rest");
  }
  for (const auto& point : std::span(way.points._buffer, way.points._length)) {
    if (point.effort._length == 0) continue;
    return fail_at("points", "has efforts, which are not followed", "leave them out");
  }
  return {};
}

Status check_frame(const char* frame_id, const InputSource& source) {
  const std::string_view named = frame_id == nullptr ? "" : frame_id;
  if (named == source.frame) return {};
  return fail_at("header.frame_id",
                 fmt::format("'{}' is not the frame '{}'", named.substr(0, 64), source.frame),
                 "nothing is transformed: send it in that frame, or set `frame` of the input");
}

template <class Message, bool has_frame = false>
constexpr InputMessage brings(InputKind kind) {
  const auto sample = [](const void* bytes, const InputBlock& input,
                         const InputSource& source) -> Result<Numbers> {
    const auto& message = *static_cast<const Message*>(bytes);
    if constexpr (has_frame) {
      if (const Status its = check_frame(message.header.frame_id, source); !its)
        return std::unexpected(its.error());
    }
    return numbers_of(message, input);
  };
  return {kind, has_frame, &dds::type<Message>, sample};
}

constexpr InputMessage kMessages[] = {
    brings<dds::geometry_msgs::Twist>(InputKind::kTwist),
    brings<dds::geometry_msgs::TwistStamped, true>(InputKind::kTwist),
    brings<dds::geometry_msgs::WrenchStamped, true>(InputKind::kWrench),
    brings<dds::geometry_msgs::PoseStamped, true>(InputKind::kPose),
    brings<dds::std_msgs::Float64MultiArray>(InputKind::kNumbers),
    brings<dds::sensor_msgs::Joy>(InputKind::kNumbers),
    brings<dds::sensor_msgs::Joy>(InputKind::kButtons),
    brings<dds::trajectory_msgs::JointTrajectory>(InputKind::kTrajectory),
};

}  // namespace

std::span<const InputMessage> input_messages() { return kMessages; }

Result<Numbers> goal_sample(const control_msgs_action_dds__FollowJointTrajectory_Goal_& goal,
                            const InputBlock& input, std::int64_t now_ns) {
  if (const Status right = check_goal(goal); !right) return std::unexpected(right.error());
  const auto order = order_of(goal.trajectory, input, true);
  if (!order) return std::unexpected(order.error());
  auto sample = way_points(goal.trajectory, input, *order);
  if (!sample) return sample;
  double* const terms = sample->data() + input.terms_at();
  const auto& stamp = goal.trajectory.header.stamp;
  if (stamp.sec != 0 || stamp.nanosec != 0) {
    terms[0] = kPerNs * static_cast<double>(std::int64_t{stamp.sec} * 1'000'000'000 +
                                            stamp.nanosec - now_ns);
    const auto& last = goal.trajectory.points._buffer[goal.trajectory.points._length - 1];
    const double end_s = terms[0] + seconds(last.time_from_start);
    const bool ended = end_s < 0.0;
    if (ended || terms[0] > kMostAhead_s) {
      return fail_at("header.stamp",
                     ended ? fmt::format("it ended {:.3f} s ago", -end_s)
                           : fmt::format("it begins in {:.0f} s", terms[0]),
                     "stamp it on the clock of this run (use_sim_time), or with 0: at once");
    }
  }
  const auto time = tolerance_of("goal_time_tolerance", {}, seconds(goal.goal_time_tolerance));
  if (!time) return std::unexpected(time.error());
  terms[1] = *time;
  for (std::size_t j = 0; j < order->size(); ++j) {
    if (!(*order)[j]) terms[InputBlock::kTerms + j * InputBlock::kTermsOfJoint] = 1.0;
  }
  const auto all = [](const auto& list) { return std::span(list._buffer, list._length); };
  const Status path = add_tolerances(*sample, "path_tolerance", input, all(goal.path_tolerance), 1);
  if (!path) return std::unexpected(path.error());
  const Status end = add_tolerances(*sample, "goal_tolerance", input, all(goal.goal_tolerance), 3);
  if (!end) return std::unexpected(end.error());
  return sample;
}

Result<const InputMessage*> message_of(InputKind kind, const InputSource& source) {
  std::vector<std::string> types;
  const auto wrong = [&source](std::string message, std::string hint) {
    Error error = source.where;
    error.message = std::move(message);
    error.hint = std::move(hint);
    return std::unexpected(std::move(error));
  };
  for (const InputMessage& one : kMessages) {
    if (one.kind != kind) continue;
    types.push_back(one.type().ros_name);
    if (!source.type.empty() && source.type != types.back()) continue;
    if (one.has_frame || source.frame.empty()) return &one;
    return wrong("messages of type '" + types.back() + "' name no frame", "leave `frame` out");
  }
  return wrong("messages of type '" + source.type + "' bring no " + std::string(row_of(kind).name),
               suggest(source.type, types));
}

}  // namespace tandem::runtime
