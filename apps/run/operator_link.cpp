#include "apps/run/operator_link.hpp"

#include <filesystem>

#include "controllers/plugin_loader.hpp"
#include "hal/config/capabilities.hpp"
#include "runtime/local_controllers.hpp"

namespace tandem::apps {

std::string plugin_path(const runtime::Experiment& e, const std::string& plugin) {
  if (!plugin.contains('/')) return plugin;
  // Absolute, so that "./x.so" beside a file of the working directory does not become a name.
  const std::filesystem::path folder = std::filesystem::absolute(e.document.folder());
  return (folder / plugin).lexically_normal().string();
}

namespace {

/// The controllers at the robot's end; null: there are none. Errors are added.
std::unique_ptr<runtime::LocalControllers> robot_side_of(Composition& c, Diagnostics& errors) {
  const runtime::Experiment& e = c.experiment;
  if (e.teleoperation->robot_controllers.empty()) return nullptr;
  auto side =
      std::make_unique<runtime::LocalControllers>(e.robot, c.kernels.get(), e.loop.period_ns);
  for (const runtime::ControllerSpec& spec : e.teleoperation->robot_controllers) {
    auto loaded = load_controller(plugin_path(e, spec.plugin), controller_folders());
    Status added = loaded ? side->add(spec.name, std::move(*loaded), spec.parameters)
                          : Status(std::unexpected(loaded.error()));
    if (added) continue;
    Error error = added.error();
    error.file = e.file;
    error.line = spec.parameters.line();
    error.key = "teleoperation.robot_controller." + spec.name;
    errors.push_back(std::move(error));
  }
  for (const Error& error : e.document.diagnostics()) errors.push_back(error);
  if (c.controllers == nullptr) return side;
  if (const auto joint = side->shared_joint(*c.controllers)) {
    errors.push_back({.message = "the joint '" + e.robot.joints[*joint].name +
                                 "' is claimed at both ends of the link",
                      .hint = "let the operator's controllers or the robot's have it",
                      .file = e.file,
                      .key = "teleoperation.robot_controller"});
  }
  return side;
}

}  // namespace

Diagnostics put_link_between(Composition& c) {
  const runtime::Experiment& e = c.experiment;
  if (!e.teleoperation) return {};
  remote::TeleConfig config = e.teleoperation->link;
  config.seed = e.seed;
  Diagnostics errors;
  remote::TeleBackend::End robot{std::move(c.backend), robot_side_of(c, errors)};
  remote::TeleBackend::End twin;
  if (!errors.empty()) return errors;
  if (config.predict) {
    sim::SimRobotConfig sim = e.sim_robot_config();
    sim.seed = e.seed + 1;  // noise of its own
    auto made = sim::SimRobot::create(e.robot, c.kernels.get(), sim);
    if (!made) return {made.error()};
    twin = {std::move(*made), robot_side_of(c, errors)};
  }
  auto link = std::make_unique<remote::TeleBackend>(hal::robot_of(e.robot), std::move(robot),
                                                    std::move(twin), config, e.loop.period_ns);
  c.tele = link.get();
  c.backend = std::move(link);
  return {};
}

}  // namespace tandem::apps
