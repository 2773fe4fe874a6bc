// parallel/joint_states and parallel/difference: a second robot that gets the same commands.
// Layer: dds.  Thread: the publisher's.
#pragma once

#include <string>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"
#include "hal/parallel_source.hpp"

namespace tandem::dds {

/// The newest cycle of the second robot when a sample is due: it may be some cycles older than the
/// first's, and its stamp says so. A difference is the first robot's value less the second's.
class ParallelTopics final : public TopicGroup {
 public:
  ParallelTopics(OutputMaker& maker, const RunDescription& run);
  /// Where it comes from; null: nowhere. Before the first cycle.
  void show(hal::ParallelSource* source) { source_ = source; }
  void publish(const CycleSample& sample) override;

 private:
  hal::ParallelSource* source_ = nullptr;
  TextList joints_;
  std::string no_frame_;
  Output<sensor_msgs::JointState> joint_states_, difference_;
};

}  // namespace tandem::dds
