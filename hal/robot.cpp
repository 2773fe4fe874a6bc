// Image shape, passive joints and postures of a robot, looked up by name outside the cycle.
#include "hal/robot.hpp"

#include <algorithm>

#include "base/nearest.hpp"

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

Error no_joint(std::string_view name, std::span<const std::string> joints,
               std::span<const Follower> followers) {
  Error error{.message = {}, .hint = {}, .file = {}, .line = 0, .key = std::string(name)};
  const auto found = std::ranges::find(followers, name, &Follower::name);
  if (found == followers.end() || found->leader >= joints.size()) {
    error.message = "the robot has no joint '" + error.key + "'";
    error.hint = suggest(name, joints);
    return error;
  }
  const std::string& leader = joints[found->leader];
  error.message = "the joint '" + error.key + "' follows '" + leader + "' (mimic)";
  error.hint = "command '" + leader + "'";
  return error;
}

Error Robot::no_joint(std::string_view name_in) const {
  std::vector<std::string> names;
  for (const DrivenJoint& joint : joints) names.push_back(joint.name);
  return hal::no_joint(name_in, names, followers);
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
