// joint_states and dynamic_joint_states.
// Names and interfaces are set once; each sample lends DDS values in robot.toml's order.
#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "dds/hardware_interfaces.hpp"
#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"

namespace tandem::dds {
namespace {

/// Every joint has been measured once: its sample is no older than the run.
bool measured(const hal::StateImage& state) {
  const std::uint64_t cycle = state.cycle()[0];
  return std::ranges::all_of(state.age_cycles(), [=](std::uint32_t age) { return age <= cycle; });
}

std::vector<std::string> joint_names(const hal::RobotConfig& robot) {
  std::vector<std::string> names;
  for (const hal::JointConfig& joint : robot.joints) names.push_back(joint.name);
  return names;
}

std::vector<std::string> names_with_followers(const RunDescription& run) {
  std::vector<std::string> names = joint_names(run.robot);
  for (const hal::Follower& one : run.robot.followers) names.push_back(one.name);
  return names;
}

std::vector<std::string> interface_names() {
  std::vector<std::string> names;
  for (const StateInterface& one : kStateInterfaces) names.emplace_back(one.name);
  return names;
}

/// Every joint in the process image's order, link side; in joint_states the joints that follow them
/// (URDF: mimic) stand behind. There is no message before each joint was measured once. Torque,
/// current, voltage and temperature are NaN where the drive does not tell them.
class JointTopics final : public TopicGroup {
 public:
  JointTopics(OutputMaker& maker, const RunDescription& run);
  void publish(const CycleSample& sample) override;

 private:
  [[nodiscard]] const control_msgs::DynamicJointState& dynamic(const CycleSample& sample);
  void fill_states(const hal::StateImage& state);

  std::vector<hal::MotorFeedback> tells_;  // of each joint's drive
  std::vector<hal::Follower> followers_;
  TextList joints_, joints_and_followers_;
  TextList interfaces_;
  std::vector<double> position_, velocity_, effort_;  // of joint_states
  std::vector<double> values_;                        // a joint's interfaces one after another
  std::vector<control_msgs_msg_dds__InterfaceValue_> joint_values_;
  std::string no_frame_;
  Output<sensor_msgs::JointState> joint_states_;
  Output<control_msgs::DynamicJointState> dynamic_joint_states_;
  control_msgs::DynamicJointState dynamic_{};
};

JointTopics::JointTopics(OutputMaker& maker, const RunDescription& run)
    : tells_(hal::motor_feedback(run.robot)),
      followers_(run.robot.followers),
      joints_(joint_names(run.robot)),
      joints_and_followers_(names_with_followers(run)),
      interfaces_(interface_names()),
      values_(run.robot.joints.size() * kStateInterfaces.size()),
      joint_values_(run.robot.joints.size()),
      joint_states_(maker.periodic<sensor_msgs::JointState>(Topic::kJointStates, "joint_states")),
      dynamic_joint_states_(maker.periodic<control_msgs::DynamicJointState>(
          Topic::kDynamicJointStates, "dynamic_joint_states")) {
  for (std::size_t j = 0; j < joint_values_.size(); ++j) {
    refer(joint_values_[j].interface_names, interfaces_.get());
    refer(joint_values_[j].values, std::span<const double>(values_).subspan(
                                       j * kStateInterfaces.size(), kStateInterfaces.size()));
  }
  dynamic_.header.frame_id = refer(no_frame_);
  refer(dynamic_.joint_names, joints_.get());
  refer(dynamic_.interface_values,
        std::span<const control_msgs_msg_dds__InterfaceValue_>(joint_values_));
}

void JointTopics::publish(const CycleSample& sample) {
  if (!measured(sample.state)) return;
  if (sample.is_due(Topic::kJointStates) && joint_states_.wanted()) {
    sensor_msgs::JointState message{};
    message.header = {ros_time(sample.stamp_ns), refer(no_frame_)};
    fill_states(sample.state);
    refer(message.name, joints_and_followers_.get());
    refer(message.position, std::span<const double>(position_));
    refer(message.velocity, std::span<const double>(velocity_));
    refer(message.effort, std::span<const double>(effort_));
    joint_states_.write(message);
  }
  if (sample.is_due(Topic::kDynamicJointStates) && dynamic_joint_states_.wanted()) {
    dynamic_joint_states_.write(dynamic(sample));
  }
}

void JointTopics::fill_states(const hal::StateImage& state) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const auto copy = [](std::vector<double>& to, std::span<const double> from) {
    to.assign(from.begin(), from.end());
  };
  copy(position_, state.position_rad());
  copy(velocity_, state.velocity_rad_s());
  copy(effort_, state.torque_Nm());
  for (std::size_t j = 0; j < tells_.size(); ++j) {
    if (!tells_[j].torque) effort_[j] = kNone;
  }
  for (const hal::Follower& one : followers_) {
    position_.push_back(one.multiplier * position_[one.leader] + one.offset);
    velocity_.push_back(one.multiplier * velocity_[one.leader]);
    effort_.push_back(kNone);
  }
}

const control_msgs::DynamicJointState& JointTopics::dynamic(const CycleSample& sample) {
  dynamic_.header.stamp = ros_time(sample.stamp_ns);
  for (std::size_t i = 0; i < kStateInterfaces.size(); ++i) {
    const auto values = (sample.state.*kStateInterfaces[i].values)();
    const auto told = kStateInterfaces[i].told;
    for (std::size_t j = 0; j < values.size(); ++j) {
      const bool known = told == nullptr || tells_[j].*told;
      values_[j * kStateInterfaces.size() + i] =
          known ? values[j] : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return dynamic_;
}

}  // namespace

std::unique_ptr<TopicGroup> joint_topics(OutputMaker& maker, const RunDescription& run) {
  return std::make_unique<JointTopics>(maker, run);
}

}  // namespace tandem::dds
