#include "hal/sim/make_plant.hpp"

#include <memory>
#include <numeric>
#include <utility>

#include "base/nearest.hpp"
#include "hal/sim/setup.hpp"
#include "hal/sim/stability.hpp"

namespace tandem::sim {
namespace {

/// @param described  as the kernels have it
Result<PlantConfig> plant_config(const hal::RobotConfig& described, const tandem_kernels* kernels,
                                 const SimRobotConfig& config) {
  const PlantChanges* changes = config.changes.get();
  const hal::RobotConfig& robot = changes != nullptr ? changes->robot : described;
  PlantConfig plant;
  plant.kernels = kernels;
  plant.engine = config.engine;
  plant.contact = robot.contact;
  plant.integrator = config.integrator;
  plant.substep_ns = config.substep_ns;
  plant.held = config.hold;
  plant.release_ns = config.release_ns;
  plant.lift_m = config.lift_m;
  plant.rate_limit = config.rate_limit;
  const hal::PostureConfig* posture = robot.posture(config.posture);
  if (posture == nullptr && !config.posture.empty()) {
    std::vector<std::string> known;
    for (const hal::PostureConfig& one : robot.postures) known.push_back(one.name);
    return std::unexpected(Error{.message = "the robot has no such posture",
                                 .hint = suggest(config.posture, known),
                                 .file = robot.file,
                                 .key = "posture." + config.posture});
  }
  if (posture != nullptr) plant.base_height_m = posture->base_height_m;
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    const hal::JointConfig& joint = robot.joints[j];
    const double position = posture != nullptr ? posture->position_rad[j] : 0.0;
    const hal::ActuatorConfig& actuator = robot.actuator_of(joint);
    plant.joints.push_back(
        {joint.name, actuator, position, 0.0, joint.brake,
         armature(actuator) - armature(described.actuator_of(described.joints[j]))});
  }
  plant.passive = robot.passive;
  plant.loops = robot.loop_specs();
  if (config.tree != nullptr) {
    plant.ranges = mechanical_ranges(robot, *config.tree);
    plant.robot = &robot;
    plant.tree = config.tree.get();
  }
  const bool patches = !robot.contact.patches.empty();
  if (config.engine != kOwnEngine && (patches || !robot.contact.terrain.level())) {
    return fail_at(
        patches ? "sim.patch" : "sim.ground",
        "the ground of the engine '" + config.engine + "' is one plane that stands still",
        "leave it out, or set engine = \"tandem\"");
  }
  if (changes == nullptr) return plant;
  plant.actual = &changes->tree;
  for (const ScenarioFault& payload : changes->carried) {
    if (config.engine != kOwnEngine) {
      return fail_at(
          "sim.payload",
          "comes or goes, and the bodies of the engine '" + config.engine + "' keep their mass",
          "leave out from_s and until_s, or set engine = \"tandem\"");
    }
    if (payload.start_ns == 0) plant.carried.push_back(load_of(payload));
  }
  return plant;
}

/// The key of [contact] without whose value the sub-step would be stable, or empty.
std::string stiffest_of_ground(const PlantConfig& config, const Plant& plant, double step_s) {
  for (const auto& [key, value] :
       {std::pair{"stiffness_N_m", &hal::ContactConfig::stiffness_N_m},
        std::pair{"damping_s_m", &hal::ContactConfig::damping_s_m},
        std::pair{"tangential_stiffness_N_m", &hal::ContactConfig::tangential_stiffness_N_m},
        std::pair{"tangential_damping_Ns_m", &hal::ContactConfig::tangential_damping_Ns_m}}) {
    PlantConfig without = config;
    without.contact.*value = 0.0;
    if (step_s <= longest_step(without, plant).seconds) return key;
  }
  return {};
}

constexpr std::int64_t kShortestStep_ns = 1'000;

/// "at most 450927 ns in this posture: 250000 ns divides the period and every control period".
std::string shorter(const hal::RobotConfig& robot, std::int64_t period_ns, std::int64_t most_ns) {
  const std::string most = "at most " + std::to_string(most_ns) + " ns in this posture";
  std::int64_t common_ns = period_ns;
  for (const hal::BoardConfig& board : robot.boards)
    common_ns = std::gcd(common_ns, board.control_period_ns);
  if (most_ns < kShortestStep_ns) return most;
  const std::int64_t most_parts = common_ns / kShortestStep_ns;
  std::int64_t parts = (common_ns + most_ns - 1) / most_ns;
  while (parts < most_parts && common_ns % parts != 0) ++parts;
  if (parts > most_parts || common_ns % parts != 0) return most;
  return most + ": " + std::to_string(common_ns / parts) +
         " ns divides the period and every control period";
}

// A step that cannot be stable would show as a drive's fault, far from its cause.
Status check_step(const hal::RobotConfig& robot, const PlantConfig& config, const Plant& plant,
                  std::int64_t period_ns) {
  PlantConfig tested = config;
  if (config.engine != kOwnEngine) tested.contact = {};  // its ground is the engine's own
  const StepLimit limit = longest_step(tested, plant);
  const double step_s = static_cast<double>(config.substep_ns) * 1e-9;
  if (step_s <= limit.seconds) return {};
  const auto most_ns = static_cast<std::int64_t>(limit.seconds * 1e9);
  const std::string at_most = shorter(robot, period_ns, most_ns);
  if (const std::string key = stiffest_of_ground(config, plant, step_s); !key.empty()) {
    return std::unexpected(
        Error{.message = "makes a sub-step of " + std::to_string(config.substep_ns) +
                         " ns unstable at " + limit.place,
              .hint = "lower it, or sim.substep_ns to " + at_most,
              .file = robot.file,
              .line = robot.contact.lines.contains(key) ? robot.contact.lines.at(key) : 0,
              .key = "contact." + key});
  }
  return std::unexpected(
      Error{.message = std::to_string(config.substep_ns) + " ns is unstable at " + limit.place,
            .hint = most_ns >= kShortestStep_ns
                        ? at_most
                        : "no sub-step is short enough: are its inertia, stiffness, damping and "
                          "inductance right?",
            .file = {},
            .key = "sim.substep_ns"});
}

// Where robot.toml has the loop that an error is about.
Error placed(Error error, const hal::RobotConfig& robot) {
  for (const hal::KinematicLoopConfig& loop : robot.loops) {
    if (error.key != "loop." + loop.name) continue;
    error.file = robot.file;
    error.line = loop.line;
  }
  return error;
}

// A sub-step that is short enough for the described robot is not what is wrong.
Error blamed(Error error, const hal::RobotConfig& robot, const tandem_kernels* kernels,
             const PlantConfig& plant, const Plant& body, SimRobotConfig config) {
  const std::shared_ptr<const PlantChanges> changes = std::exchange(config.changes, nullptr);
  if (changes == nullptr || changes->differences.empty()) return error;
  const Result<PlantConfig> described = plant_config(robot, kernels, config);
  const Result<Plant> as_described =
      described ? Plant::create(*described) : std::unexpected(described.error());
  if (!as_described || !check_step(robot, *described, *as_described, config.period_ns))
    return error;
  const std::string step = std::to_string(config.substep_ns) + " ns";
  const std::string& first = changes->differences.front();
  return {.message = "makes a sub-step of " + step + " unstable at " +
                     longest_step(plant, body).place + ": the plant is other in " + first,
          .hint = "check its numbers; as the robot's files have it, " + step + " is short enough",
          .file = {},
          .key = "sim." + first.substr(0, first.find(' '))};
}

}  // namespace

Result<Plant> make_plant(const hal::RobotConfig& robot, const tandem_kernels* kernels,
                         const SimRobotConfig& config) {
  const Result<PlantConfig> plant = plant_config(robot, kernels, config);
  if (!plant) return std::unexpected(plant.error());
  Result<Plant> body = Plant::create(*plant);
  if (!body) return std::unexpected(placed(body.error(), robot));
  if (const Status status = check_step(robot, *plant, *body, config.period_ns); !status) {
    return std::unexpected(blamed(status.error(), robot, kernels, *plant, *body, config));
  }
  return body;
}

}  // namespace tandem::sim
