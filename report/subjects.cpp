// Chooses the joints and sensors to show, from [report] or by the robot and its motion.
#include "report/subjects.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "report/posture.hpp"

namespace tandem::report {
namespace {

std::size_t at_index(int number) { return static_cast<std::size_t>(number); }

/// The joints of the tree from the root to the link of the first foot's site.
std::vector<int> first_leg(const RunData& run) {
  std::vector<int> joints;
  if (run.robot.contact.feet.empty()) return joints;
  for (const hal::SiteConfig& site : run.robot.model.sites) {
    const int link = run.tree.link_index(site.link);
    if (site.name != run.robot.contact.feet.front().site || link < 0) continue;
    for (int body = run.tree.links[at_index(link)].body; body > 0;
         body = run.tree.joints[at_index(body) - 1].parent) {
      joints.insert(joints.begin(), body - 1);
    }
  }
  return joints;
}

/// Joints (image) of the first leg that turn about the robot's lateral axis.
std::vector<int> pitch_joints(const RunData& run) {
  PostureSample zero{"", 0.0, {}, std::vector<double>(run.robot.joints.size(), 0.0)};
  const auto bodies = body_placements(run.tree, run.robot, zero);
  std::vector<int> found;
  for (const int joint : first_leg(run)) {
    const model::Joint& j = run.tree.joints[at_index(joint)];
    const int index = run.robot.joint_index(j.name);
    if (index >= 0 && std::abs((bodies[at_index(joint) + 1].R * j.axis).y()) > 0.9) {
      found.push_back(index);
    }
  }
  return found;
}

/// How far a joint moved at most [rad, m].
double moved(const RunData& run, int joint) {
  const auto [low, high] = std::ranges::minmax_element(run.position_rad[at_index(joint)]);
  return *high - *low;
}

/// Joints by how far they moved, the widest first.
std::vector<int> widest_joints(const RunData& run) {
  std::vector<double> range;
  for (std::size_t j = 0; j < run.position_rad.size(); ++j)
    range.push_back(moved(run, static_cast<int>(j)));
  std::vector<int> order(range.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::ranges::greater{},
                           [&](int j) { return range[at_index(j)]; });
  return order;
}

/// The joints that move most instead of those that stand while these move.
void prefer_moving(const RunData& run, Subjects& subjects) {
  constexpr double kStands = 0.01;  // [rad, m]
  const std::vector<int> widest = widest_joints(run);
  const auto stands = [&](int joint) {
    const double range = moved(run, joint);
    return range < kStands && 10.0 * range < moved(run, widest.front());
  };
  if (!stands(subjects.position_of) || moved(run, widest.front()) < kStands) return;
  subjects.position_of = widest.front();
  if (stands(subjects.torque_of))
    subjects.torque_of = widest[std::min<std::size_t>(1, widest.size() - 1)];
}

/// Whether a sensor measures what a foot carries; on a robot without feet, whether it is six-axis.
bool on_a_leg(const RunData& run, const hal::SensorConfig& sensor) {
  if (sensor.type != hal::SensorType::kForceTorque) return false;
  if (!legged(run)) return true;
  const std::vector<bool> beyond = links_beyond(run, sensor.joint);
  return std::ranges::any_of(run.robot.contact.feet, [&](const hal::Foot& foot) {
    return std::ranges::any_of(run.robot.model.sites, [&](const hal::SiteConfig& site) {
      const int link = run.tree.link_index(site.link);
      return site.name == foot.site && link >= 0 && beyond[at_index(link)];
    });
  });
}

}  // namespace

std::vector<bool> links_beyond(const RunData& run, const std::string& joint) {
  std::vector<bool> beyond(run.tree.links.size(), false);
  const int first = run.tree.child_link_index(joint);
  for (std::size_t i = at_index(std::max(first, 0)); first >= 0 && i < beyond.size(); ++i) {
    const int parent = run.tree.links[i].parent;
    beyond[i] = i == at_index(first) || (parent >= 0 && beyond[at_index(parent)]);
  }
  return beyond;
}

Subjects subjects_of(const RunData& run) {
  Subjects subjects;
  std::vector<int> joints = pitch_joints(run);
  if (joints.size() < 2) joints = widest_joints(run);
  subjects.position_of = run.robot.joint_index(run.position_of);
  subjects.torque_of = run.robot.joint_index(run.torque_of);
  if (subjects.position_of < 0) subjects.position_of = joints.front();
  if (subjects.torque_of < 0)
    subjects.torque_of = joints[std::min<std::size_t>(1, joints.size() - 1)];
  prefer_moving(run, subjects);
  for (std::size_t i = 0; i < run.robot.sensors.size(); ++i) {
    const hal::SensorConfig& sensor = run.robot.sensors[i];
    const bool first = sensor.name == run.foot;
    if (!first && !on_a_leg(run, sensor)) continue;
    subjects.foot_sensors.insert(
        first ? subjects.foot_sensors.begin() : subjects.foot_sensors.end(), static_cast<int>(i));
  }
  return subjects;
}

}  // namespace tandem::report
