// Image shape, passive joints and postures of a robot, looked up by name outside the cycle.
#include "hal/robot.hpp"

#include <algorithm>

namespace tandem::hal {
namespace {

template <class T>
int place_of(const std::vector<T>& items, std::string_view name) {
  const auto found = std::ranges::find(items, name, &T::name);
  return found == items.end() ? -1 : static_cast<int>(found - items.begin());
}

}  // namespace

ImageShape Robot::shape() const {
  ImageShape shape{.joints = joints.size(), .sensor_channels = {}};
  for (const Sensor& sensor : sensors) shape.sensor_channels.push_back(sensor.channels());
  return shape;
}

int Robot::joint_index(std::string_view name_in) const { return place_of(joints, name_in); }
int Robot::sensor_index(std::string_view name_in) const { return place_of(sensors, name_in); }
bool Robot::is_passive(std::string_view name_in) const { return place_of(passive, name_in) >= 0; }

std::vector<std::string> Robot::passive_names() const {
  std::vector<std::string> names;
  for (const PassiveJoint& joint : passive) names.push_back(joint.name);
  return names;
}

const Posture* Robot::posture(std::string_view name_in) const {
  const int at = place_of(postures, name_in);
  return at < 0 ? nullptr : &postures[static_cast<std::size_t>(at)];
}

}  // namespace tandem::hal
