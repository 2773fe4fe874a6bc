// joint_states and dynamic_joint_states.
// Layer: dds.  Thread: the publisher's.
#pragma once

#include <vector>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"
#include "hal/config/capabilities.hpp"

namespace tandem::dds {

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

}  // namespace tandem::dds
