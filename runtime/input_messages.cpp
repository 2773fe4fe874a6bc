#include "runtime/input_messages.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string_view>

#include "base/nearest.hpp"

namespace tandem::runtime {
namespace {

using Numbers = std::vector<double>;

constexpr double kPerNs = 1e-9;

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

/// Where the joints of the input stand in the message. Error: it has others, or lacks one.
Result<std::vector<std::size_t>> order_of(const dds::trajectory_msgs::JointTrajectory& message,
                                          const InputBlock& input) {
  const std::size_t joints = input.components.size();
  if (message.joint_names._length != joints) {
    return fail_at(
        "joint_names",
        fmt::format("{} joints are not the {} of the input", message.joint_names._length, joints),
        "name each of them, in any order");
  }
  std::vector<std::size_t> order(joints, joints);
  for (std::size_t i = 0; i < joints; ++i) {
    const auto found = std::ranges::find(input.components, message.joint_names._buffer[i]);
    const auto joint = static_cast<std::size_t>(found - input.components.begin());
    if (joint == joints || order[joint] != joints) {
      return fail_at("joint_names", "has a joint twice, or one that the input has not",
                     "name each of the input's, in any order");
    }
    order[joint] = i;
  }
  return order;
}

/// It begins when it arrives, whatever its stamp says. No points: the joints stay.
Result<Numbers> numbers_of(const dds::trajectory_msgs::JointTrajectory& message,
                           const InputBlock& input) {
  const std::size_t joints = input.components.size();
  Numbers sample(input.values(), 0.0);
  const std::size_t points = message.points._length;
  if (points == 0) return sample;
  if (points > input.options.most_points) {
    return fail_at("points", fmt::format("{} way-points are too many", points),
                   fmt::format("at most {}", input.options.most_points));
  }
  const auto order = order_of(message, input);
  if (!order) return std::unexpected(order.error());
  const bool moves = message.points._buffer[0].velocities._length > 0;
  sample[0] = static_cast<double>(points);
  sample[1] = moves ? 1.0 : 0.0;
  for (std::size_t p = 0; p < points; ++p) {
    const auto& point = message.points._buffer[p];
    if (point.positions._length != joints || point.velocities._length != (moves ? joints : 0)) {
      return fail_at("points", fmt::format("way-point {} has not a number of each joint", p + 1),
                     "positions of each joint; velocities of each in all points, or in none");
    }
    const std::size_t at = 2 + p * (1 + 2 * joints);
    const auto& after = point.time_from_start;
    sample[at] = static_cast<double>(after.sec) + kPerNs * static_cast<double>(after.nanosec);
    for (std::size_t j = 0; j < joints; ++j) {
      sample[at + 1 + j] = point.positions._buffer[(*order)[j]];
      if (moves) sample[at + 1 + joints + j] = point.velocities._buffer[(*order)[j]];
    }
  }
  return sample;
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
