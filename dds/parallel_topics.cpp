// parallel/joint_states and parallel/difference: a second robot that gets the same commands.
#include <memory>
#include <string>
#include <vector>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"
#include "hal/parallel_source.hpp"

namespace tandem::dds {
namespace {

std::vector<std::string> names_of_joints(const hal::RobotConfig& robot) {
  std::vector<std::string> names;
  for (const hal::JointConfig& joint : robot.joints) names.push_back(joint.name);
  return names;
}

/// The newest cycle of the second robot when a sample is due: it may be some cycles older than the
/// first's, and its stamp says so. A difference is the first robot's value less the second's.
class ParallelTopics final : public TopicGroup {
 public:
  ParallelTopics(OutputMaker& maker, const RunDescription& run);
  void show(hal::ParallelSource* second) override { source_ = second; }
  void publish(const CycleSample& sample) override;

 private:
  hal::ParallelSource* source_ = nullptr;
  TextList joints_;
  std::string no_frame_;
  Output<sensor_msgs::JointState> joint_states_, difference_;
};

ParallelTopics::ParallelTopics(OutputMaker& maker, const RunDescription& run)
    : joints_(names_of_joints(run.robot)),
      joint_states_(
          maker.periodic<sensor_msgs::JointState>(Topic::kParallel, "parallel/joint_states")),
      difference_(
          maker.periodic<sensor_msgs::JointState>(Topic::kParallel, "parallel/difference")) {}

void ParallelTopics::publish(const CycleSample& sample) {
  if (!sample.is_due(Topic::kParallel) || source_ == nullptr) return;
  if (!joint_states_.wanted() && !difference_.wanted()) return;
  const hal::ParallelView* view = source_->newest();
  if (view == nullptr) return;
  sensor_msgs::JointState message{};
  const std::int64_t older_ns = sample.time.time_ns - view->state.time_ns()[0];
  message.header = {ros_time(sample.stamp_ns - older_ns), refer(no_frame_)};
  refer(message.name, joints_.get());
  refer(message.position, view->state.position_rad());
  refer(message.velocity, view->state.velocity_rad_s());
  refer(message.effort, view->state.torque_Nm());
  if (joint_states_.wanted()) joint_states_.write(message);
  refer(message.position, std::span<const double>(view->position_rad));
  refer(message.velocity, std::span<const double>(view->velocity_rad_s));
  refer(message.effort, std::span<const double>(view->torque_Nm));
  if (difference_.wanted()) difference_.write(message);
}

}  // namespace

std::unique_ptr<TopicGroup> parallel_topics(OutputMaker& maker, const RunDescription& run) {
  return std::make_unique<ParallelTopics>(maker, run);
}

}  // namespace tandem::dds
