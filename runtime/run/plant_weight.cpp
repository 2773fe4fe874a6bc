#include "runtime/run/plant_weight.hpp"

#include <cmath>

namespace tandem::runtime {
namespace {

double mass_of(const model::Tree& tree) {
  double sum_kg = 0.0;
  for (const model::Body& body : tree.bodies) sum_kg += body.inertia.mass_kg;
  return sum_kg;
}

double weight_N(const Composition& c, const GroundFigures& over) {
  double mass_kg = c.kernels->mass_kg;
  if (c.sim != nullptr) {
    const auto& plant = c.experiment.plant;
    if (plant != nullptr) mass_kg += mass_of(plant->tree) - mass_of(*c.experiment.tree());
    mass_kg += c.sim->robot().carried_kg(over.from_ns, over.to_ns + c.experiment.loop.period_ns);
  }
  const double* g = c.kernels->gravity_m_s2;
  return mass_kg * std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
}

}  // namespace

std::optional<GroundFigures> ground_of(const Composition& c, const RobotCycle& cycle) {
  std::optional<GroundFigures> ground = cycle.statistics().ground(0.0);
  if (ground) ground->weight_N = weight_N(c, *ground);
  return ground;
}

}  // namespace tandem::runtime
