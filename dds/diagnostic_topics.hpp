// diagnostics: how run, loop, boards, joints and sensors are, in words.
// Layer: dds.  Thread: the publisher's.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"
#include "hal/config/capabilities.hpp"

namespace tandem::dds {

/// diagnostic_msgs/DiagnosticStatus' levels.
enum class Level : std::uint8_t { kOk = 0, kWarn = 1, kError = 2, kStale = 3 };

/// One status before it becomes a message.
struct HealthStatus {
  Level level = Level::kOk;
  std::string name, message, hardware_id;
  std::vector<std::pair<std::string, std::string>> values;
};

class DiagnosticTopics final : public TopicGroup {
 public:
  DiagnosticTopics(OutputMaker& maker, const RunDescription& run);
  void publish(const CycleSample& sample) override;

  /// Everything that a message says: the run, the loop, then each board, joint and sensor.
  [[nodiscard]] std::vector<HealthStatus> statuses(const CycleSample& sample);

 private:
  [[nodiscard]] HealthStatus run(const CycleSample& sample) const;
  [[nodiscard]] HealthStatus loop(const CycleSample& sample);
  [[nodiscard]] HealthStatus joint(const CycleSample& sample, std::size_t index) const;
  [[nodiscard]] HealthStatus sensor(const CycleSample& sample, std::size_t index) const;

  const hal::RobotConfig& robot_;
  std::string hal_, no_frame_;
  std::vector<hal::MotorFeedback> tells_;  // of each joint's drive
  std::uint64_t told_overruns_ = 0, told_dropped_ = 0;
  Output<diagnostic_msgs::DiagnosticArray> output_;
};

}  // namespace tandem::dds
