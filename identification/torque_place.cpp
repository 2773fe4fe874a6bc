#include "identification/torque_place.hpp"

#include <algorithm>
#include <cmath>

#include "identification/estimate.hpp"
#include "identification/identify.hpp"

namespace tandem::identification {
namespace {

constexpr double kSure = 3.0;    // standard deviations
constexpr double kNone = 0.05;   // of the described rotor: as good as none
constexpr double kLittle = 0.1;  // more than that is not what was found
constexpr double kWrong = -0.5;  // less than that is a torque of the other sign

enum class Found : std::uint8_t { kNothing, kRotor, kNoRotor };

Found look(double described, double estimate, double deviation) {
  const double doubt = kSure * deviation / described, share = estimate / described;
  if (share - doubt > kNone) return Found::kRotor;
  const bool little = share < std::max(kNone, doubt) && share + doubt < kLittle;
  if (little && share > kWrong) return Found::kNoRotor;
  return Found::kNothing;
}

}  // namespace

std::vector<bool> measured_behind_rotors(IdentifiedRobot& robot, const model::Tree& tree,
                                         const Equations& equations) {
  // The hold of a voltage, if there is one, looks like a tenth of a rotor or two: that is doubted
  // of a value, and no reason to doubt this.
  Equations undoubted = equations;
  for (ChannelRows& channel : undoubted.channels) channel.doubt.clear();
  const DataEstimate data =
      estimate_from_data(undoubted, std::vector<bool>(equations.time_s.size(), true),
                         make_prior(robot), structural_base(robot, tree));
  const std::size_t joints = robot.facts.joint.size();
  std::vector<Found> found(joints, Found::kNothing);
  for (std::size_t c = 0; c < joints; ++c) {
    const double described = robot.facts.rotor_kg_m2[c];
    if (!robot.facts.rigid[c] || !(described > 0.0)) continue;
    const Eigen::Index at = robot.regressor.columns() +
                            kJointColumns * static_cast<Eigen::Index>(c) +
                            static_cast<Eigen::Index>(JointColumn::kRotor);
    found[c] = look(described, data.mean[at], std::sqrt(data.link_covariance(at, at)));
  }
  const bool any = std::ranges::find(found, Found::kNoRotor) != found.end();
  const bool agree = std::ranges::find(found, Found::kRotor) == found.end();
  std::vector<bool> behind(joints, false);
  for (std::size_t c = 0; c < joints; ++c) {
    behind[c] = robot.facts.rigid[c] &&
                (found[c] == Found::kNoRotor || (any && agree && found[c] == Found::kNothing));
  }
  return behind;
}

}  // namespace tandem::identification
