#include "identification/torque_place.hpp"

#include "identification/estimate.hpp"
#include "identification/identify.hpp"

namespace tandem::identification {
namespace {

constexpr double kHeld = 1e8;    // times the prior: a rotor that the data cannot move
constexpr double kClear = 20.0;  // of the negative logarithm of the likelihood
constexpr double kNone = 0.05;   // of the described rotors

/// How badly the data are met when every rotor has this share of its description.
double cost_with(double share, const DataEstimate& data, Prior prior,
                 const IdentifiedRobot& robot) {
  const Eigen::Index links = robot.regressor.columns();
  for (std::size_t c = 0; c < robot.facts.joint.size(); ++c) {
    if (!robot.facts.rigid[c]) continue;
    const Eigen::Index at = links + kJointColumns * static_cast<Eigen::Index>(c) +
                            static_cast<Eigen::Index>(JointColumn::kRotor);
    prior.mean[at] = share * robot.facts.rotor_kg_m2[c];
    prior.metric(at, at) *= kHeld;
  }
  const Eigen::VectorXd x = possible_parameters(data, prior, links);
  return x.dot(0.5 * (data.information * x) - data.target);
}

}  // namespace

bool measured_behind_rotors(IdentifiedRobot& robot, const model::Tree& tree,
                            const Equations& equations) {
  const std::vector<bool> all(equations.time_s.size(), true);
  const Prior prior = make_prior(robot);
  const DataEstimate data = estimate_from_data(equations, all, prior, structural_base(robot, tree));
  const double none = cost_with(0.0, data, prior, robot);
  const double half = cost_with(0.5, data, prior, robot);
  const double whole = cost_with(1.0, data, prior, robot);
  // The least of the parabola through them.
  const double slope = 4.0 * half - 3.0 * none - whole;
  const double bend = 2.0 * (whole + none - 2.0 * half);
  return whole - none > kClear && bend > 0.0 && -slope < 2.0 * bend * kNone;
}

}  // namespace tandem::identification
