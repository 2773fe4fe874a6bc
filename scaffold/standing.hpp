// How a robot on feet stands: inverse kinematics on its own model.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <vector>

#include "base/result.hpp"
#include "scaffold/feet.hpp"
#include "scaffold/posed.hpp"
#include "scaffold/posture.hpp"

namespace tandem::scaffold {

/// A robot on its feet: soles level and where they are, the centre of mass over
/// their ankles, or over the sole's middle half when those are beside it.
class StandingPosture {
 public:
  /// @param start  what is no leg stays as it is here; legs begin here
  StandingPosture(const model::Tree& tree, const std::vector<FoundFoot>& feet,
                  const Eigen::Vector3d& ahead, Eigen::VectorXd start);

  /// Finds a posture with bent knees: 0.94 of the greatest height over the
  /// ground, or up to 0.98 where limits leave no more. Where legs have too few joints to shift the
  /// centre of mass over level soles, it may be up to 20 mm beside where it should be.
  /// Errors: no posture was found in which all feet reach the ground.
  [[nodiscard]] Status find();

  [[nodiscard]] const Eigen::VectorXd& q() const { return q_; }
  /// Height of the root's origin over the ground.
  [[nodiscard]] double height_m() const { return height_m_; }
  [[nodiscard]] double greatest_height_m() const { return greatest_m_; }
  /// How far the centre of mass is from where it should be, along the ground.
  [[nodiscard]] double beside_m() const;

  /// Takes the feet as they are now, in the posture found, for those that stay where they are:
  /// after settle_balls() the simulated contact is a point of the shank, which turns with it.
  void stay_on(const std::vector<FoundFoot>& settled);

  /// The posture `down_m` lower, from `q`, whose joints that are not in a leg stay.
  /// Errors: the legs cannot do it.
  [[nodiscard]] Result<Eigen::VectorXd> lowered(const Eigen::VectorXd& q, double down_m) const;

  /// The joints that bend the first leg, hip and knee; empty when it has no knee.
  [[nodiscard]] std::vector<int> hip_and_knee() const;
  /// Whether the joint is between the root and a foot.
  [[nodiscard]] bool in_leg(int joint) const { return in_leg_[joint]; }

 private:
  struct Knee {
    int hip = -1, knee = -1, ankle = -1;  ///< joints; -1: none
    bool front = true;
  };
  [[nodiscard]] Knee knee_of(const FoundFoot& foot) const;
  [[nodiscard]] bool levels_line(const FoundFoot& foot, const Posed& neutral) const;
  [[nodiscard]] int conditions(std::size_t foot) const;
  [[nodiscard]] Eigen::Vector3d best_load(const FoundFoot& foot, const Posed& neutral) const;
  [[nodiscard]] Eigen::VectorXd bent(const std::vector<double>& sides) const;
  [[nodiscard]] std::vector<std::vector<double>> patterns() const;
  [[nodiscard]] bool solve(double height_m, Eigen::VectorXd& q) const;
  [[nodiscard]] Eigen::VectorXd leg_step(Eigen::MatrixXd J, const Eigen::VectorXd& r,
                                         double damping, const Eigen::VectorXd& q) const;
  [[nodiscard]] double residual(const Posed& posed, double height_m, Eigen::VectorXd& r,
                                Eigen::MatrixXd* J) const;
  [[nodiscard]] bool settle(Eigen::VectorXd q);
  [[nodiscard]] bool lacks_joints() const;
  [[nodiscard]] bool search();

  const model::Tree& tree_;
  std::vector<FoundFoot> feet_;
  Eigen::Matrix3d level_;  ///< of a sole: x ahead, z up
  Bounds bounds_;
  std::vector<bool> in_leg_;
  std::vector<bool> lines_;  ///< feet that touch in a line, which their legs can keep level
  std::vector<Eigen::Vector3d> homes_;  ///< of the feet in the neutral posture
  Eigen::Vector3d middle_home_ = Eigen::Vector3d::Zero();
  Eigen::VectorXd neutral_, q_;
  double height_m_ = 0.0;
  double greatest_m_ = 0.0;
  bool loose_ = false;  ///< the centre of mass need not be over the feet exactly
};

}  // namespace tandem::scaffold
