// A robot that stands on its feet while its base moves: legs by inverse kinematics, balance and
// torques by inverse dynamics.
// Layer: identification.  Thread: non-RT only.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "identification/regressor.hpp"
#include "model/tree.hpp"

namespace tandem::identification {

/// The base relative to its start: displacement in the start's axes [m] and rotation vector [rad].
using BasePose = Eigen::Matrix<double, 6, 1>;

class StandingMotion {
 public:
  /// @param start  position of every coordinate
  StandingMotion(const model::Tree& tree, const hal::RobotConfig& robot, const Regressor& regressor,
                 const Eigen::VectorXd& start);

  /// Coordinates on the way from the base to a foot: they follow from the base's pose.
  [[nodiscard]] const std::vector<Eigen::Index>& leg_coordinates() const { return legs_; }

  /// Moves the leg coordinates of `q` so that the feet stay where they were at the start.
  /// @param q  in: near the solution; out: it. @return false: out of reach
  [[nodiscard]] bool solve_legs(const BasePose& pose, Eigen::VectorXd& q) const;

  /// What the ground has to do for a motion.
  struct Load {
    double margin_m = 0.0;        ///< of the point of zero moment to the edge of the feet's hull
    double slip = 0.0;            ///< horizontal over vertical force
    double least_share = 0.0;     ///< of a foot: its vertical force over that of equal shares
    Eigen::VectorXd foot_torque;  ///< (coordinates): share of the feet's forces in each torque
  };
  /// @param wrench  force and moment that the base's six equations want, base axes and origin
  [[nodiscard]] Load load(const BasePose& pose, const Eigen::VectorXd& q,
                          const Eigen::Matrix<double, 6, 1>& wrench) const;
  /// The soles' lowest point with the base as at the start, above their lowest one there.
  [[nodiscard]] double lowest(const Eigen::VectorXd& q) const;
  /// At rest in the start posture.
  [[nodiscard]] static model::Placement placement(const BasePose& pose);

 private:
  struct Leg {
    int body;                               // of the foot
    std::vector<int> joints;                // from the base to the foot
    model::Placement foot, in_body;         // the sole at the start; the same in its body
    std::vector<Eigen::Vector3d> points_m;  // of the sole
  };
  [[nodiscard]] std::vector<double> spread(const Eigen::VectorXd& q) const;
  [[nodiscard]] bool solve_leg(const Leg& leg, const model::Placement& base,
                               Eigen::VectorXd& q) const;

  const model::Tree* tree_;
  std::vector<Eigen::Index> coordinate_;  // per joint of the tree
  std::vector<Leg> standing_;
  std::vector<Eigen::Index> legs_;
  std::vector<Eigen::Vector2d> hull_;
  double ground_m_ = 0.0;
};

}  // namespace tandem::identification
