// Way-points about the posture, reduced joint by joint until no drive is overloaded and nothing
// goes through the floor.
#include "scaffold/steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "scaffold/strength.hpp"

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
constexpr double kMinJerkMost = 5.774;  // largest acceleration over way by time squared
constexpr double kFastestAt = 0.577;    // of the way from the middle: where that is
constexpr double kMostLoad = 0.6;       // of what a drive can give, by gravity and acceleration
constexpr double kMoves_rad = 1e-3;     // less is no move
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

/// What a drive needs while all joints swing by `way` to either side of the posture: at the ends
/// and in the middle gravity alone, and where a swing of minimum jerk accelerates most that, too.
class Swinging {
 public:
  Swinging(const NewRobot& robot, const VectorXd& posture) : robot_(robot), posture_(posture) {
    most_ = load(posture, VectorXd::Zero(posture.size())).cwiseMax(kMostLoad);
    if (robot.tree.floating_base || !stands_on_its_base(robot.tree)) return;
    floor_m_ = std::min(0.0, Posed(robot.tree, posture).lowest_m());
  }

  /// No load above kMostLoad of what a drive can give, unless the posture itself has it; nothing
  /// through the floor. A leg on the ground is not looked at: it carries more than itself.
  [[nodiscard]] bool bears(const VectorXd& way) const {
    for (const double side : {-1.0, -kFastestAt, 0.0, kFastestAt, 1.0}) {
      const VectorXd q = posture_ + side * way;
      const double share = std::abs(side) == kFastestAt ? -side / kFastestAt : 0.0;
      const VectorXd qdd = share * kMinJerkMost * 2.0 / (kStep_s * kStep_s) * way;
      if ((load(q, qdd).array() > most_.array() + 1e-9).any()) return false;
      if (Posed(robot_.tree, q).lowest_m() < floor_m_ - 1e-9) return false;
    }
    return true;
  }

 private:
  /// Shares of what the drives can give; 0 of a leg and of a follower.
  [[nodiscard]] VectorXd load(const VectorXd& q, const VectorXd& qdd) const {
    const Posed posed(robot_.tree, q);
    const VectorXd torque = posed.inertial_load(qdd);
    VectorXd shares = VectorXd::Zero(q.size());
    for (const hal::JointConfig& joint : robot_.config.joints) {
      const int j = robot_.tree.joint_index(joint.name);
      if (in_leg(j)) continue;
      const hal::ActuatorConfig& drive = robot_.config.actuator_of(joint);
      const double all = posed.gravity_load(j) + torque[j] + drive.inertia_kg_m2 * qdd[j];
      shares[j] = std::abs(all) / hal::strength_of(joint, drive);
    }
    return shares;
  }
  [[nodiscard]] bool in_leg(int joint) const {
    return std::ranges::any_of(robot_.feet, [&](const FoundFoot& foot) {
      const std::vector<int> path = robot_.tree.path_to(foot.body);
      return std::ranges::find(path, joint) != path.end();
    });
  }

  const NewRobot& robot_;
  const VectorXd& posture_;
  VectorXd most_;
  double floor_m_ = -std::numeric_limits<double>::infinity();
};

/// Part of `way` to either side that the drives can carry: all of it, or each joint for itself,
/// from the ends of the limbs to the root, what leaves those before it theirs.
VectorXd bearable(const NewRobot& robot, const VectorXd& posture, const VectorXd& way) {
  const Swinging swinging(robot, posture);
  if (swinging.bears(way)) return way;
  VectorXd kept = VectorXd::Zero(way.size());
  for (Eigen::Index j = way.size(); j-- > 0;) {
    for (const double share : {1.0, 0.5, 0.25, 0.125}) {
      VectorXd more = kept;
      more[j] = share * way[j];
      if (!swinging.bears(more)) continue;
      kept = more;
      break;
    }
  }
  return kept;
}

/// The joints that swing less than `wanted`.
std::vector<Move::HeldBack> held_back(const NewRobot& robot, const VectorXd& wanted,
                                      const VectorXd& way) {
  std::vector<Move::HeldBack> found;
  for (Eigen::Index j = 0; j < way.size(); ++j) {
    if (std::abs(way[j]) >= std::abs(wanted[j])) continue;
    found.push_back({robot.tree.joints[j].name, std::abs(way[j])});
  }
  return found;
}

/// The largest share of `down_m` that the limits of the legs leave, with the joints that are in
/// no leg as in `q`. No posture when they cannot even stay as high as they are.
struct Lowered {
  VectorXd q;
  double share = 0.0;
};
std::optional<Lowered> as_low_as_it_goes(const StandingPosture& standing, const VectorXd& q,
                                         double down_m) {
  for (const double share : {1.0, 0.5, 0.25, 0.0}) {
    if (const auto found = standing.lowered(q, share * down_m)) return Lowered{*found, share};
  }
  return {};
}

}  // namespace

Move swing(const NewRobot& robot, const VectorXd& posture) {
  const VectorXd wanted = alternating(amplitudes(robot, posture));
  const VectorXd way = bearable(robot, posture, wanted);
  Move move;
  move.held_back = held_back(robot, wanted, way);
  move.swings = way.cwiseAbs().maxCoeff() > kMoves_rad;
  double time_s = 0.0;
  for (const double side : {1.0, -1.0, 1.0, 0.0}) {
    move.points.push_back(way_point(robot, time_s += kStep_s, posture + side * way));
  }
  return move;
}

Move squat_and_swing(const NewRobot& robot, const StandingPosture& standing) {
  const VectorXd& posture = standing.q();
  VectorXd wanted = kStandingShare * amplitudes(robot, posture);
  for (Eigen::Index j = 0; j < wanted.size(); ++j) {
    if (standing.in_leg(static_cast<int>(j))) wanted[j] = 0.0;
  }
  VectorXd way = bearable(robot, posture, wanted);
  const double down_m = kSquatShare * standing.height_m();
  auto up = as_low_as_it_goes(standing, posture - way, 0.0);
  auto low = as_low_as_it_goes(standing, posture + way, down_m);
  if (!up || !low) {  // no swing that the legs can balance
    way.setZero();
    up = Lowered{posture, 0.0};
    low = as_low_as_it_goes(standing, posture, down_m).value_or(*up);
  }
  Move move;
  move.held_back = held_back(robot, wanted, way);
  move.swings = way.cwiseAbs().maxCoeff() > kMoves_rad;
  move.squat_m = low->share * down_m;
  double time_s = 0.0;
  for (const VectorXd& q : {low->q, up->q, low->q, posture}) {
    move.points.push_back(way_point(robot, time_s += kStep_s, q));
  }
  return move;
}

}  // namespace tandem::scaffold
