// Search beside the program, trusted code, version; then the engine's model from the
// robot's description and its soles.
#include "hal/sim/engine_loader.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cstring>
#include <filesystem>

#include "base/nearest.hpp"
#include "base/process.hpp"
#include "base/trusted_code.hpp"
#include "hal/sim/actuator.hpp"
#include "model/placements.hpp"

namespace tandem::sim {
namespace {

namespace fs = std::filesystem;

std::unexpected<Error> refuse(std::string message, std::string hint, std::string key) {
  return std::unexpected(Error{
      .message = std::move(message), .hint = std::move(hint), .file = {}, .key = std::move(key)});
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// The engine's library, or empty.
std::string library_of(const std::string& name) {
  std::error_code ignored;
  const fs::path prefix = fs::path(program_file()).parent_path().parent_path();
  for (const char* folder : {"lib/engines", "lib/tandem/engines"}) {
    const fs::path file = prefix / folder / (name + ".so");
    if (fs::is_regular_file(file, ignored)) return file.string();
  }
  return {};
}

Result<const EnginePlugin*> open(const std::string& name, const std::string& file) {
  const Result<TrustedCode> code = TrustedCode::open(file);
  if (!code) return refuse(code.error().message, code.error().hint, name);
  if (const Status whole = code->check_whole(); !whole) {
    return refuse("cannot be loaded: it " + whole.error().message, whole.error().hint, name);
  }
  const Result<void*> library = code->load(RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (!library) return refuse(library.error().message, library.error().hint, name);
  using Entry = const EnginePlugin* (*)();
  const auto entry = reinterpret_cast<Entry>(dlsym(*library, "tandem_engine_plugin"));
  const EnginePlugin* plugin = entry == nullptr ? nullptr : entry();
  if (plugin == nullptr || plugin->interface != kEngineInterface ||
      std::strcmp(plugin->compiler, __VERSION__) != 0) {
    return refuse(file + " is of another version of Tandem or of another compiler",
                  "build it again, with this program", name);
  }
  return plugin;
}

/// What no engine but our own does, installed or not.
Status check_tree(const std::string& name, const hal::RobotConfig& robot, const model::Tree& tree) {
  if (!robot.loops.empty()) {
    return refuse("the engine '" + name + "' cannot close the loop '" + robot.loops[0].name + "'",
                  "set engine = \"tandem\": only Tandem's own does closed loops", "sim.engine");
  }
  for (const model::Joint& joint : tree.joints) {
    if (!joint.follows()) continue;
    return refuse("the engine '" + name + "' cannot let '" + joint.name + "' follow another joint",
                  "set engine = \"tandem\": only Tandem's own does mimic joints", "sim.engine");
  }
  return {};
}

Result<std::vector<double>> armatures(const EnginePlugin& plugin, const hal::RobotConfig& robot,
                                      const model::Tree& tree) {
  std::vector<double> values(tree.joints.size(), 0.0);
  for (const hal::JointConfig& joint : robot.joints) {
    const int at = tree.joint_index(joint.name);
    if (at < 0) continue;
    const double value = armature(robot.actuator_of(joint));
    if (value > 0.0 && !plugin.armature) {
      return refuse("the engine '" + std::string(plugin.name) + "' cannot turn the rotor of '" +
                        joint.name + "', whose drive is rigid",
                    "give the actuator a spring (order 2), or take an engine that can: mujoco, "
                    "dart, ode, simbody, tandem",
                    "sim.engine");
    }
    values[static_cast<std::size_t>(at)] = value;
  }
  return values;
}

std::vector<EngineModel::Point> sole_points(const hal::RobotConfig& robot,
                                            const model::Tree& tree) {
  std::vector<EngineModel::Point> points;
  for (const hal::Foot& foot : robot.contact.feet) {
    const auto site = std::ranges::find(robot.model.sites, foot.site, &hal::SiteConfig::name);
    const auto& link = tree.links[static_cast<std::size_t>(tree.link_index(site->link))];
    const model::Placement sole = link.in_body * model::placement_of(site->xyz_m, site->rpy_rad);
    for (const auto& [x, y, z] : foot.points_m) {
      points.push_back({link.body, sole.R * Eigen::Vector3d(x, y, z) + sole.p});
    }
  }
  return points;
}

}  // namespace

std::vector<std::string> installed_engines() {
  std::vector<std::string> names = known_engines();
  std::erase_if(names, [](const std::string& name) { return library_of(name).empty(); });
  return names;
}

Result<const EnginePlugin*> load_engine(const std::string& name) {
  const std::vector<std::string> known = known_engines();
  if (name == kOwnEngine || std::ranges::count(known, name) == 0) {
    return refuse("there is no engine '" + name + "' beside Tandem's own", suggest(name, known),
                  "sim.engine");
  }
  const std::string file = library_of(name);
  if (file.empty()) {
    std::vector<std::string> there = installed_engines();
    there.emplace_back(kOwnEngine);
    return refuse("the engine '" + name + "' is not installed",
                  "installed: " + joined(there) + "; apt-get install lib" + name +
                      "-dev, then run CMake again and build the target engines",
                  "sim.engine");
  }
  return open(name, file);
}

std::string engine_version(const std::string& name) {
  if (name == kOwnEngine) return {};
  const Result<const EnginePlugin*> plugin = load_engine(name);
  return plugin ? (*plugin)->version : "";
}

std::string engine_text(const std::string& name) {
  const std::string version = engine_version(name);
  return version.empty() ? "" : name + " " + version;
}

Result<std::unique_ptr<Engine>> make_engine(const std::string& name, const hal::RobotConfig& robot,
                                            const model::Tree& tree, double step_s, bool rk4) {
  if (Status fits = check_tree(name, robot, tree); !fits) return std::unexpected(fits.error());
  const Result<const EnginePlugin*> plugin = load_engine(name);
  if (!plugin) return std::unexpected(plugin.error());
  if (rk4 && !(*plugin)->rk4) {
    return refuse("the engine '" + name + "' has no rk4",
                  "leave it out: its own is " + std::string((*plugin)->integrator),
                  "sim.integrator");
  }
  Result<std::vector<double>> armature = armatures(**plugin, robot, tree);
  if (!armature) return std::unexpected(armature.error());
  const EngineModel model{.tree = tree,
                          .armature_kg_m2 = std::move(*armature),
                          .gravity_m_s2 = robot.model.gravity_m_s2,
                          .points = sole_points(robot, tree),
                          .ground_m = robot.contact.height_m,
                          .friction = robot.contact.static_friction,
                          .step_s = step_s,
                          .rk4 = rk4};
  Result<std::unique_ptr<Engine>> engine = (*plugin)->create(model);
  if (!engine) {
    return refuse("the engine '" + name + "' does not take the robot: " + engine.error().message,
                  engine.error().hint, "sim.engine");
  }
  return engine;
}

}  // namespace tandem::sim
