#include "runtime/robot_layout.hpp"

#include <algorithm>
#include <vector>

namespace tandem::runtime {
namespace {

/// The first item that is not the same in both lists: "joint 3 is LKnee in FILE, RKnee in FILE_B".
template <class T>
std::string list_difference(const char* what, const std::vector<T>& a, const std::vector<T>& b,
                            const std::string& file_b, const auto& name) {
  for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
    const std::string here = i < a.size() ? name(a[i]) : "missing";
    const std::string there = i < b.size() ? name(b[i]) : "missing";
    if (here == there) continue;
    return std::string(what) + " " + std::to_string(i + 1) + ", which is " + here +
           " in the first, is " + there + " in " + file_b;
  }
  return {};
}

}  // namespace

std::string layout_difference(const hal::RobotConfig& first, const hal::RobotConfig& second) {
  std::string found =
      list_difference("joint", first.joints, second.joints, second.file,
                      [](const hal::JointConfig& joint) { return "'" + joint.name + "'"; });
  if (!found.empty()) return found;
  found = list_difference(
      "sensor", first.sensors, second.sensors, second.file, [](const hal::SensorConfig& sensor) {
        return "'" + sensor.name + "' with " + std::to_string(sensor.channels()) + " channels";
      });
  if (!found.empty()) return found;
  found = list_difference("closed loop", first.loops, second.loops, second.file,
                          [](const auto& loop) { return "'" + loop.name + "'"; });
  if (!found.empty()) return found;
  found = list_difference("passive joint", first.passive, second.passive, second.file,
                          [](const auto& joint) { return "'" + joint.name + "'"; });
  if (!found.empty()) return found;
  return list_difference("foot", first.contact.feet, second.contact.feet, second.file,
                         [](const hal::Foot& foot) { return "'" + foot.site + "'"; });
}

}  // namespace tandem::runtime
