// tandem/state, command, statistics, faults and robot: the whole truth, in types of our own.
// Layer: dds.  Thread: the publisher's.
#pragma once

#include <string>
#include <vector>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"

namespace tandem::dds {

class ImageTopics final : public TopicGroup {
 public:
  ImageTopics(OutputMaker& maker, const RunDescription& run);
  void begin(std::int64_t stamp_ns) override;
  void publish(const CycleSample& sample) override;
  void publish_faults(const std::vector<FaultEntry>& faults, std::uint64_t lost) override;

 private:
  void publish_state(const CycleSample& sample);
  void publish_command(const CycleSample& sample);
  void publish_statistics(const CycleSample& sample);

  std::uint64_t run_;
  std::string robot_, version_, hal_, hash_;
  std::int64_t period_ns_;
  TextList joints_, sensors_;
  std::vector<std::uint32_t> channels_;
  Output<tandem_msgs::State> state_;
  Output<tandem_msgs::Command> command_;
  Output<tandem_msgs::LoopStatistics> statistics_;
  Output<tandem_msgs::Robot> description_;
  Output<tandem_msgs::Faults> faults_;
};

}  // namespace tandem::dds
