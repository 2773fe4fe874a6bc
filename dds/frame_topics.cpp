// tf, tf_static, odom and robot_description: where the robot's links are.
// Transforms from the joints' measured positions; the base's from the run's estimate, or without
// one from the simulation's truth.
#include "dds/frame_topics.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"

namespace tandem::dds {
namespace {

model::Placement inverse(const model::Placement& a_b) {
  return {a_b.R.transpose(), -(a_b.R.transpose() * a_b.p)};
}

/// Position, quaternion, velocity.
struct Base {
  std::span<const double> p, q, v;
};

template <class I>
std::optional<Base> finite_base(const I& image) {
  const Base base{image.base_position_m(), image.base_quaternion(), image.base_velocity()};
  if (!finite(base.p) || !finite(base.q) || !finite(base.v)) return std::nullopt;
  return base;
}

/// The estimate where there is one, as on a robot that nobody simulates. Nothing until it starts.
std::optional<Base> base_of(const CycleSample& sample) {
  if (sample.estimate != nullptr && sample.estimate->estimates_base()) {
    return sample.estimate->has_base() ? finite_base(*sample.estimate) : std::nullopt;
  }
  return sample.truth == nullptr ? std::nullopt : finite_base(*sample.truth);
}

geometry_msgs_msg_dds__Transform_ transform(const model::Placement& at) {
  const Eigen::Quaterniond q(at.R);
  return {{at.p.x(), at.p.y(), at.p.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

}  // namespace

FrameTree frame_tree(const model::Tree& tree, const hal::RobotConfig& robot) {
  FrameTree frames;
  for (const model::Link& link : tree.links) {
    if (link.parent < 0) continue;
    const model::Link& parent = tree.links[static_cast<std::size_t>(link.parent)];
    const model::Placement from_parent = inverse(parent.in_body);
    if (link.moving < 0) {
      frames.fixed.push_back({parent.name, link.name, from_parent * link.in_body});
      continue;
    }
    const model::Joint& joint = tree.joints[static_cast<std::size_t>(link.moving)];
    const model::Joint& leader =
        joint.follows() ? tree.joints[static_cast<std::size_t>(joint.leader)] : joint;
    const auto configured = std::ranges::find(robot.joints, leader.name, &hal::JointConfig::name);
    if (configured == robot.joints.end()) continue;  // passive: nobody measures where it stands
    frames.moving.push_back({parent.name, link.name, from_parent * joint.in_parent, joint.type,
                             joint.axis,
                             static_cast<std::size_t>(configured - robot.joints.begin()),
                             joint.multiplier, joint.offset});
  }
  return frames;
}

model::Placement placement(const FrameEdge& edge, double position) {
  position = edge.multiplier * position + edge.offset;
  if (edge.type == model::JointType::kPrismatic) {
    return edge.at_zero * model::Placement{Eigen::Matrix3d::Identity(), edge.axis * position};
  }
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(position, edge.axis).toRotationMatrix();
  return edge.at_zero * model::Placement{turned, Eigen::Vector3d::Zero()};
}

namespace {

/// A floating base stands in the frame "odom", where the simulation's truth has it; nobody knows
/// where that of a real robot stands. A fixed base is where "odom" is.
class FrameTopics final : public TopicGroup {
 public:
  FrameTopics(OutputMaker& maker, const RunDescription& run);
  void begin(std::int64_t stamp_ns) override;
  void publish(const CycleSample& sample) override;

 private:
  using Stamped = geometry_msgs_msg_dds__TransformStamped_;
  void publish_moving(const CycleSample& sample);
  void publish_odometry(const CycleSample& sample);

  FrameTree frames_;
  std::string urdf_, odom_, base_;
  bool base_known_, base_fixed_;
  std::vector<Stamped> transforms_;
  Output<tf2_msgs::TFMessage> tf_, tf_static_;
  Output<nav_msgs::Odometry> odometry_;
  Output<std_msgs::String> description_;
};

FrameTopics::FrameTopics(OutputMaker& maker, const RunDescription& run)
    : frames_(frame_tree(run.tree, run.robot)),
      urdf_(run.urdf),
      odom_("odom"),
      base_(run.tree.links.front().name),
      base_known_(
          run.tree.floating_base &&
          (run.truth != nullptr || (run.estimate != nullptr && run.estimate->estimates_base()))),
      base_fixed_(!run.tree.floating_base),
      tf_(maker.periodic<tf2_msgs::TFMessage>(Topic::kTf, "tf")),
      tf_static_(maker.latched<tf2_msgs::TFMessage>("tf_static")),
      description_(maker.latched<std_msgs::String>("robot_description")) {
  if (base_known_) odometry_ = maker.periodic<nav_msgs::Odometry>(Topic::kOdom, "odom");
  transforms_.reserve(std::max(frames_.moving.size(), frames_.fixed.size()) + 1);
}

void FrameTopics::begin(std::int64_t stamp_ns) {
  description_.write({refer(urdf_)});
  transforms_.clear();
  if (base_fixed_) {
    transforms_.push_back({{ros_time(stamp_ns), refer(odom_)}, refer(base_), transform({})});
  }
  for (const FrameEdge& edge : frames_.fixed) {
    transforms_.push_back(
        {{ros_time(stamp_ns), refer(edge.parent)}, refer(edge.child), transform(edge.at_zero)});
  }
  tf2_msgs::TFMessage message{};
  refer(message.transforms, std::span<const Stamped>(transforms_));
  tf_static_.write(message);
}

void FrameTopics::publish(const CycleSample& sample) {
  if (sample.is_due(Topic::kTf) && tf_.wanted()) publish_moving(sample);
  if (sample.is_due(Topic::kOdom) && odometry_.wanted()) publish_odometry(sample);
}

void FrameTopics::publish_moving(const CycleSample& sample) {
  const Time stamp = ros_time(sample.stamp_ns);
  transforms_.clear();
  if (const auto base = base_of(sample); base_known_ && base) {
    const auto& [p, q, v] = *base;
    transforms_.push_back(
        {{stamp, refer(odom_)}, refer(base_), {{p[0], p[1], p[2]}, {q[0], q[1], q[2], q[3]}}});
  }
  const auto positions = sample.state.position_rad();
  for (const FrameEdge& edge : frames_.moving) {
    const double position = positions[edge.joint];
    if (!std::isfinite(position)) continue;
    transforms_.push_back(
        {{stamp, refer(edge.parent)}, refer(edge.child), transform(placement(edge, position))});
  }
  tf2_msgs::TFMessage message{};
  refer(message.transforms, std::span<const Stamped>(transforms_));
  tf_.write(message);
}

void FrameTopics::publish_odometry(const CycleSample& sample) {
  const auto base = base_of(sample);
  if (!base) return;
  const auto& [p, q, v] = *base;
  nav_msgs::Odometry message{};
  message.header = {ros_time(sample.stamp_ns), refer(odom_)};
  message.child_frame_id = refer(base_);
  message.pose.pose = {{p[0], p[1], p[2]}, {q[0], q[1], q[2], q[3]}};
  message.twist.twist = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
  odometry_.write(message);
}

}  // namespace

std::unique_ptr<TopicGroup> frame_topics(OutputMaker& maker, const RunDescription& run) {
  return std::make_unique<FrameTopics>(maker, run);
}

}  // namespace tandem::dds
