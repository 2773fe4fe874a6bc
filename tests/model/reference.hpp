// The robots with figures of other programs: their trees, mechanisms and states.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "model/dynamics.hpp"
#include "model/urdf.hpp"

namespace tandem::model {

using Array = std::vector<double>;
using Arrays = std::vector<Array>;

struct ReferenceRobot {
  const char* name;
  const char* urdf;  // from the repository's root
  bool floating;
};
inline void PrintTo(const ReferenceRobot& robot, std::ostream* out) { *out << robot.name; }

inline constexpr std::array<ReferenceRobot, 8> kReferenceRobots{{
    {"double_pendulum", "config/double_pendulum/double_pendulum.urdf", false},
    {"ur5e", "config/ur5e/ur5e.urdf", false},
    {"panda", "config/panda/panda.urdf", false},
    {"anymal_c", "config/anymal_c/anymal_c.urdf", true},
    {"simple_humanoid", "tests/data/robots/simple_humanoid.urdf", true},
    {"coman", "config/coman/coman.urdf", true},
    {"walkman", "config/walkman/walkman.urdf", true},
    {"icub", "config/icub/icub.urdf", true},
}};
inline const ReferenceRobot& reference_robot(const std::string& name) {
  for (const ReferenceRobot& robot : kReferenceRobots)
    if (robot.name == name) return robot;
  throw std::runtime_error("no reference robot " + name);
}

inline nlohmann::json read_reference(const std::string& name) {
  return nlohmann::json::parse(
      std::ifstream(TANDEM_SOURCE_DIR "/tests/data/reference/" + name + ".json"));
}

// Every number of a nested array, row by row.
inline Array flat(const nlohmann::json& json) {
  if (!json.is_array()) return {json.get<double>()};
  Array result;
  for (const nlohmann::json& part : json) {
    const Array numbers = flat(part);
    result.insert(result.end(), numbers.begin(), numbers.end());
  }
  return result;
}
inline Array full_from_lower(const nlohmann::json& rows) {
  const std::size_t n = rows.size();
  Array M(n * n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j <= i; ++j) M[i * n + j] = M[j * n + i] = rows[i][j].get<double>();
  return M;
}

inline Tree reference_tree(const ReferenceRobot& robot) {
  auto model = read_urdf(std::string(TANDEM_SOURCE_DIR "/") + robot.urdf,
                         {.floating_base = robot.floating, .mimic_independent = true});
  if (!model) throw std::runtime_error(model.error().front().to_string());
  return std::move(model->tree);
}
// The reference's frames as sites where wrenches may act; on COMAN two sensors besides, of the UR5e
// derivatives.
inline ModelSpec reference_spec(const ReferenceRobot& robot) {
  ModelSpec spec;
  spec.robot = robot.name;
  spec.floating_base = robot.floating;
  spec.derivatives = spec.robot == "ur5e";
  const nlohmann::json reference = read_reference(robot.name);
  for (const nlohmann::json& frame : reference["frames"])
    spec.sites.push_back({frame, frame, {}, {}, true});
  if (spec.robot == "coman")
    spec.sensors = {{"left_foot", "LAnkSag", "l_leg_ft"},
                    {"left_forearm", "LForearmPlate", "l_arm_ft"}};
  return spec;
}
inline Mechanism reference_mechanism(const ReferenceRobot& robot) {
  Result<Mechanism> mechanism = make_mechanism(reference_tree(robot), reference_spec(robot));
  if (!mechanism) throw std::runtime_error(mechanism.error().to_string());
  return *std::move(mechanism);
}

/// Largest difference over the largest entry of `expected`.
inline double relative_error(const Array& actual, const Array& expected) {
  if (actual.size() != expected.size()) return std::numeric_limits<double>::infinity();
  double difference = 0.0;
  double largest = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (!std::isfinite(actual[i])) return std::numeric_limits<double>::infinity();
    difference = std::max(difference, std::abs(actual[i] - expected[i]));
    largest = std::max(largest, std::abs(expected[i]));
  }
  return largest > 0.0 ? difference / largest : difference;
}

/// A kernel run on arrays, by whatever means.
using Runner = std::function<Arrays(Kernel, const Arrays& inputs)>;

/// Calls `check(quantity, actual, expected)` for every quantity of every state of the robot.
template <class Check>
void against_reference(const ReferenceRobot& robot, const Mechanism& m, const Runner& run,
                       const Check& check) {
  const Array none(static_cast<std::size_t>(6 * m.wrenches), 0.0);
  const nlohmann::json reference = read_reference(robot.name);
  for (const nlohmann::json& state : reference["states"]) {
    const auto of = [&](const char* key) { return flat(state[key]); };
    const Array q = of("q");
    const Array v = of("v");
    const Array a = of("a");
    check("fd", run(Kernel::kForwardDynamics, {q, v, of("tau"), none})[0], of("fd_ddq_exact"));
    check("id", run(Kernel::kInverseDynamics, {q, v, a, none})[0], of("id_tau"));
    check("M", run(Kernel::kMassMatrix, {q})[0], full_from_lower(state["M_lower"]));
    check("bias", run(Kernel::kBias, {q, v})[0], of("nle"));
    const Arrays com = run(Kernel::kCenterOfMass, {q, v});
    check("com", com[0], of("com"));
    check("com velocity", com[1], of("vcom"));
    check("com Jacobian", com[2], of("J_com"));
    check("momentum", run(Kernel::kCentroidalMomentum, {q, v})[0], of("centroidal_momentum"));
    check("energy", run(Kernel::kEnergy, {q, v})[0],
          {state["kinetic_energy"], state["potential_energy"]});
    const Arrays motion = run(Kernel::kSiteMotion, {q, v, a});
    const Array jacobians = run(Kernel::kSiteJacobians, {q})[0];
    for (std::size_t s = 0; s < m.sites.size(); ++s) {
      const nlohmann::json& frame = state["frames"][s];
      const auto part = [](const Array& all, std::size_t first, std::size_t size) {
        const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
        return Array(begin, begin + static_cast<std::ptrdiff_t>(size));
      };
      const std::size_t size = static_cast<std::size_t>(6 * m.nv());
      check("rotation", part(motion[0], 12 * s, 9), flat(frame["rotation"]));
      check("position", part(motion[0], 12 * s + 9, 3), flat(frame["position"]));
      check("twist", part(motion[1], 6 * s, 6), flat(frame["velocity_local_world_aligned"]));
      check("acceleration", part(motion[2], 6 * s, 6),
            flat(frame["classical_acceleration_local_world_aligned"]));
      check("Jacobian", part(jacobians, size * s, size), flat(frame["J_local_world_aligned"]));
    }
  }
}

}  // namespace tandem::model
