// imu/NAME and wrench/NAME: every sensor of the robot.
// A sensor is published once per sample, with the sample's own time: late ones earlier than the
// cycle.
#include <memory>
#include <string>
#include <vector>

#include "base/file_name.hpp"
#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"

namespace tandem::dds {
namespace {

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

SensorTopics::SensorTopics(OutputMaker& maker, const RunDescription& run)
    : imu_every_(maker.every(Topic::kImu)), wrench_every_(maker.every(Topic::kWrench)) {
  for (std::size_t s = 0; s < run.robot.sensors.size(); ++s) {
    const hal::SensorConfig& sensor = run.robot.sensors[s];
    const std::string name = topic_token(sensor.name);
    if (sensor.type == hal::SensorType::kImu) {
      imus_.push_back(
          {s, sensor.link, maker.periodic<sensor_msgs::Imu>(Topic::kImu, "imu/" + name)});
    } else {
      wrenches_.push_back(
          {s, sensor.link,
           maker.periodic<geometry_msgs::WrenchStamped>(Topic::kWrench, "wrench/" + name)});
    }
  }
}

void SensorTopics::publish(const CycleSample& sample) {
  if (sample.is_due(Topic::kImu)) {
    for (auto& sensor : imus_) publish_imu(sample, sensor);
  }
  if (sample.is_due(Topic::kWrench)) {
    for (auto& sensor : wrenches_) publish_wrench(sample, sensor);
  }
}

bool SensorTopics::taken(const CycleSample& sample, std::size_t sensor, std::uint64_t every,
                         Time& stamp) const {
  const std::uint32_t age = sample.state.sensor_age_cycles()[sensor];
  if (age >= every || age > sample.time.cycle) return false;
  stamp = ros_time(sample.stamp_ns - static_cast<std::int64_t>(age) * sample.time.period_ns);
  return finite(sample.state.sensor_values(sensor));
}

void SensorTopics::publish_imu(const CycleSample& sample, Sensor<sensor_msgs::Imu>& sensor) {
  sensor_msgs::Imu message{};
  if (!sensor.output.wanted()) return;
  if (!taken(sample, sensor.index, imu_every_, message.header.stamp)) return;
  const auto v = sample.state.sensor_values(sensor.index);
  message.header.frame_id = refer(sensor.frame);
  message.orientation = {v[0], v[1], v[2], v[3]};
  const double norm = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + v[3] * v[3]);
  if (norm < 0.5) {  // an IMU that does not know where it is
    message.orientation = {0.0, 0.0, 0.0, 1.0};
    message.orientation_covariance[0] = -1.0;
  }
  message.angular_velocity = {v[4], v[5], v[6]};
  message.linear_acceleration = {v[7], v[8], v[9]};
  sensor.output.write(message);
}

void SensorTopics::publish_wrench(const CycleSample& sample,
                                  Sensor<geometry_msgs::WrenchStamped>& sensor) {
  geometry_msgs::WrenchStamped message{};
  if (!sensor.output.wanted()) return;
  if (!taken(sample, sensor.index, wrench_every_, message.header.stamp)) return;
  const auto v = sample.state.sensor_values(sensor.index);
  message.header.frame_id = refer(sensor.frame);
  message.wrench = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
  sensor.output.write(message);
}

}  // namespace

std::unique_ptr<TopicGroup> sensor_topics(OutputMaker& maker, const RunDescription& run) {
  return std::make_unique<SensorTopics>(maker, run);
}

}  // namespace tandem::dds
