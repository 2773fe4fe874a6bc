#include "scaffold/moves.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::scaffold {
namespace {

using Eigen::VectorXd;

constexpr double kStep_s = 2.5;  // between two way-points
constexpr double kSwing_rad = 0.25;
constexpr double kSwing_m = 0.02;
constexpr double kStandingShare = 0.6;  // of the swing, while a robot stands
constexpr double kRoomShare = 0.5;      // of the way to the nearer limit
constexpr double kSpeedShare = 0.25;    // of the largest speed, in the middle of a way
constexpr double kMinJerkPeak = 1.875;  // largest over mean speed
constexpr double kMostLoad = 0.6;       // of an effort, by gravity alone
constexpr double kSquatShare = 0.03;    // of the height

/// How far each joint may go to either side of its posture.
VectorXd amplitudes(const NewRobot& robot, const VectorXd& posture) {
  VectorXd most = VectorXd::Zero(posture.size());
  for (Eigen::Index j = 0; j < posture.size(); ++j) {
    const model::Joint& joint = robot.tree.joints[j];
    if (joint.follows()) continue;
    const JointLimits& limit = robot.limits[j];
    const bool slides = joint.type == model::JointType::kPrismatic;
    const double room = std::min(limit.range.upper - posture[j], posture[j] - limit.range.lower);
    const double fast = limit.velocity * kSpeedShare * kStep_s / kMinJerkPeak / 2.0;
    most[j] = std::min({slides ? kSwing_m : kSwing_rad, kRoomShare * room, fast});
  }
  return most;
}

WayPoint way_point(const NewRobot& robot, double time_s, const VectorXd& q) {
  WayPoint point{time_s, {}};
  for (const hal::JointConfig& joint : robot.config.joints) {
    point.position_rad.push_back(q[robot.tree.joint_index(joint.name)]);
  }
  return point;
}

/// Neighbours go opposite ways.
VectorXd alternating(const VectorXd& amplitude) {
  VectorXd way = amplitude;
  for (Eigen::Index j = 1; j < way.size(); j += 2) way[j] = -way[j];
  return way;
}

/// Of `way` to either side of the posture as much as gravity leaves to every joint that moves: no
/// load above kMostLoad of an effort, unless the posture itself has it.
VectorXd bearable(const NewRobot& robot, const VectorXd& posture, const VectorXd& way) {
  const auto load = [&](const VectorXd& q, int j) {
    return std::abs(Posed(robot.tree, q).gravity_load(j)) / robot.limits[j].effort;
  };
  for (const double share : {1.0, 0.5, 0.25, 0.125}) {
    bool fits = true;
    for (Eigen::Index j = 0; j < way.size(); ++j) {
      if (way[j] == 0.0) continue;
      const int joint = static_cast<int>(j);
      const double most = std::max(kMostLoad, load(posture, joint));
      for (const double side : {share, -share}) {
        fits = fits && load(posture + side * way, joint) <= most;
      }
    }
    if (fits) return share * way;
  }
  return VectorXd::Zero(way.size());
}

/// Limits of the legs may leave less than `down_m`, or nothing but the posture itself.
VectorXd as_low_as_it_goes(const Standing& standing, const VectorXd& q, double down_m) {
  for (const double share : {1.0, 0.5, 0.25, 0.0}) {
    if (const auto found = standing.lowered(q, share * down_m)) return *found;
  }
  return standing.q();
}

}  // namespace

std::vector<WayPoint> swing(const NewRobot& robot, const VectorXd& posture) {
  const VectorXd way = bearable(robot, posture, alternating(amplitudes(robot, posture)));
  std::vector<WayPoint> points;
  double time_s = 0.0;
  for (const double side : {1.0, -1.0, 1.0, 0.0}) {
    points.push_back(way_point(robot, time_s += kStep_s, posture + side * way));
  }
  return points;
}

std::vector<WayPoint> squat_and_swing(const NewRobot& robot, const Standing& standing) {
  const VectorXd& posture = standing.q();
  VectorXd way = kStandingShare * amplitudes(robot, posture);
  for (Eigen::Index j = 0; j < way.size(); ++j) {
    if (standing.in_leg(static_cast<int>(j))) way[j] = 0.0;
  }
  way = bearable(robot, posture, way);
  const double down_m = kSquatShare * standing.height_m();
  std::vector<WayPoint> points;
  double time_s = 0.0;
  for (const auto& [side, down] : {std::pair{1.0, 1.0}, {-1.0, 0.0}, {1.0, 1.0}, {0.0, 0.0}}) {
    points.push_back(way_point(robot, time_s += kStep_s,
                               as_low_as_it_goes(standing, posture + side * way, down * down_m)));
  }
  return points;
}

}  // namespace tandem::scaffold
