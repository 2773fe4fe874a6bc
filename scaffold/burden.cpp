// The largest torque of gravity on each joint against its drive. Masses look like grams when most
// of them are denser than any metal, and a thousandth of them is no burden.
#include "scaffold/steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/counted.hpp"
#include "hal/config/strength.hpp"
#include "model/density.hpp"

namespace tandem::scaffold {
namespace {

constexpr double kDensestMetal_kg_m3 = 2.3e4;
constexpr double kGrams = 1e3;
constexpr double kFarTooMuch = 10.0;  // times what a drive gives: no mere lack of strength

/// Whether links that are denser than any metal have most of the mass.
bool is_too_dense(const NewRobot& robot) {
  double dense_kg = 0.0, all_kg = 0.0;
  for (const model::Link& link : robot.tree.links) {
    if (link.body == 0 && !robot.tree.floating_base) continue;
    all_kg += link.inertia.mass_kg;
    if (model::density_of_ball(link.inertia) > kDensestMetal_kg_m3)
      dense_kg += link.inertia.mass_kg;
  }
  return dense_kg > 0.5 * all_kg;
}

}  // namespace

std::optional<Burden> overburdened(const NewRobot& robot, const std::vector<JointLoad>& loads) {
  struct Weak {
    int joint = -1;
    double needs = 0.0, has = 0.0;
    [[nodiscard]] double times() const { return needs / has; }
  };
  std::vector<Weak> weak;
  for (const hal::JointConfig& joint : robot.config.joints) {
    const int j = robot.tree.joint_index(joint.name);
    const JointLoad& load = loads[static_cast<std::size_t>(j)];
    const double needs = load.fall_Nm_rad > 0.0 ? load.stand_Nm : load.gravity_Nm;
    const double has = hal::lasting_strength_of(joint, robot.config.actuator_of(joint));
    if (needs > has) weak.push_back({j, needs, has});
  }
  if (weak.empty()) return std::nullopt;
  const Weak& worst = *std::ranges::max_element(weak, {}, &Weak::times);
  const model::Joint& joint = robot.tree.joints[worst.joint];
  const char* unit = joint.type == model::JointType::kPrismatic ? "N" : "Nm";
  Burden found;
  found.grams = worst.times() > kFarTooMuch && worst.times() < kGrams && is_too_dense(robot);
  found.told.message = fmt::format(
      "the drives cannot carry the robot everywhere: gravity takes up to {:.3g} {} of joint '{}', "
      "which gives {:.3g} {} for long{}",
      worst.needs, unit, joint.name, worst.has, unit,
      weak.size() == 1 ? "" : fmt::format(", and so with {} more", weak.size() - 1));
  found.told.hint =
      "correct masses (kg) or <limit effort> (Nm, or N) in the URDF and make the robot anew; or "
      "give stronger drives in robot.toml; or keep to postures in which they carry it";
  if (found.grams) {
    found.told.message += fmt::format(
        ". Its {:.5g} kg look like grams: most links are denser than any metal, and a thousandth "
        "would be no burden",
        robot.mass_kg);
    found.told.hint =
        "divide each <mass>, and each <inertia> that was computed from it, by 1000 in the URDF, "
        "and make the robot anew; if they are kilograms, correct <limit effort> and the inertias";
  }
  found.told.file = robot.tree.file;
  found.told.line = joint.line;
  return found;
}

}  // namespace tandem::scaffold
