// imu/NAME and wrench/NAME: every sensor of the robot.
// Layer: dds.  Thread: the publisher's.
#pragma once

#include <string>
#include <vector>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"

namespace tandem::dds {

/// A sample goes out once, with the stamp at which it was taken: a sensor that is silent has none.
class SensorTopics final : public TopicGroup {
 public:
  SensorTopics(OutputMaker& maker, const RunDescription& run);
  void publish(const CycleSample& sample) override;

 private:
  template <class Message>
  struct Sensor {
    std::size_t index;  // in the image
    std::string frame;
    Output<Message> output;
  };
  /// When the sensor's sample of this cycle was taken, as a header's stamp; false: there is none
  /// since the topic's last.
  [[nodiscard]] bool taken(const CycleSample& sample, std::size_t sensor, std::uint64_t every,
                           Time& stamp) const;
  void publish_imu(const CycleSample& sample, Sensor<sensor_msgs::Imu>& sensor);
  void publish_wrench(const CycleSample& sample, Sensor<geometry_msgs::WrenchStamped>& sensor);

  std::uint64_t imu_every_, wrench_every_;
  std::vector<Sensor<sensor_msgs::Imu>> imus_;
  std::vector<Sensor<geometry_msgs::WrenchStamped>> wrenches_;
};

}  // namespace tandem::dds
