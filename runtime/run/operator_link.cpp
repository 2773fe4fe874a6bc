#include "runtime/run/operator_link.hpp"

#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "controllers/plugin_loader.hpp"
#include "hal/config/capabilities.hpp"
#include "hal/remote/live_link.hpp"
#include "hal/remote/tele_backend.hpp"
#include "runtime/local_controllers.hpp"

namespace tandem::runtime {

std::string plugin_path(const Experiment& e, const std::string& plugin) {
  if (!plugin.contains('/')) return plugin;
  // Absolute, so that "./x.so" beside a file of the working directory does not become a name.
  const std::filesystem::path folder = std::filesystem::absolute(e.document.folder());
  return (folder / plugin).lexically_normal().string();
}

std::expected<std::unique_ptr<LocalControllers>, Diagnostics> robot_side_of(const Composition& c,
                                                                            Diagnostics* warnings) {
  const Experiment& e = c.experiment;
  if (e.teleoperation->robot_controllers.empty()) return nullptr;
  Diagnostics errors;
  auto side = std::make_unique<LocalControllers>(e.robot, c.kernels.get(), e.loop.period_ns);
  for (const ControllerSpec& spec : e.teleoperation->robot_controllers) {
    auto loaded = load_controller(plugin_path(e, spec.plugin), controller_folders());
    Status added = loaded ? side->add(spec.name, std::move(*loaded), spec.parameters)
                          : Status(std::unexpected(loaded.error()));
    const std::string unseen = added ? side->unseen() : "";
    if (added && (warnings == nullptr || unseen.empty())) continue;
    Error told = added ? Error{.message = "its " + unseen + " are in no log, report or topic",
                               .hint = "run the controller at one end, without a link, to see them",
                               .file = {},
                               .key = {}}
                       : added.error();
    told.file = e.file;
    told.line = spec.parameters.line();
    told.key = "teleoperation.robot_controller." + spec.name;
    (added ? *warnings : errors).push_back(std::move(told));
  }
  for (const Error& error : e.document.diagnostics()) errors.push_back(error);
  if (!errors.empty()) return std::unexpected(std::move(errors));
  return side;
}

namespace {

/// A joint that controllers of both ends claim.
Diagnostics shared_joint(const Composition& c, const LocalControllers* side) {
  if (side == nullptr || c.controllers == nullptr) return {};
  const Experiment& e = c.experiment;
  const auto joint = side->shared_joint(*c.controllers);
  if (!joint) return {};
  return {{.message = "the joint '" + e.robot.joints[*joint].name +
                      "' is claimed at both ends of the link",
           .hint = "let the operator's controllers or the robot's have it",
           .file = e.file,
           .key = "teleoperation.robot_controller"}};
}

/// A simulated robot that follows each command at once, with its own controllers.
std::expected<remote::OperatorEnd::End, Diagnostics> twin_of(const Composition& c,
                                                             Diagnostics* warnings) {
  const Experiment& e = c.experiment;
  auto side = robot_side_of(c, warnings);
  if (!side) return std::unexpected(side.error());
  sim::SimRobotConfig sim = e.sim_robot_config();
  sim.seed = e.seed + 1;  // noise of its own
  sim.changes = nullptr;  // it predicts by what is known
  auto made = sim::SimRobot::create(e.robot, c.kernels.get(), sim);
  if (!made) return std::unexpected(Diagnostics{made.error()});
  return remote::OperatorEnd::End{std::move(*made), std::move(*side)};
}

}  // namespace

std::expected<std::unique_ptr<remote::OperatorEnd>, Diagnostics> link_to(
    const Composition& c, std::unique_ptr<hal::Backend> robot, Diagnostics* warnings) {
  const Experiment& e = c.experiment;
  remote::TeleConfig config = e.teleoperation->link;
  config.seed = e.seed;
  auto side = robot_side_of(c, warnings);
  if (!side) return std::unexpected(side.error());
  if (auto shared = shared_joint(c, side->get()); !shared.empty()) return std::unexpected(shared);
  remote::OperatorEnd::End twin;
  if (config.predict) {
    auto made = twin_of(c, nullptr);
    if (!made) return std::unexpected(made.error());
    twin = std::move(*made);
  }
  return std::make_unique<remote::TeleBackend>(
      hal::robot_of(e.robot), remote::OperatorEnd::End{std::move(robot), std::move(*side)},
      std::move(twin), config, e.loop.period_ns);
}

Diagnostics put_link_between(Composition& c) {
  if (!c.experiment.teleoperation) return {};
  auto link = link_to(c, std::move(c.backend), &c.warnings);
  if (!link) return link.error();
  c.tele = link->get();
  c.backend = std::move(*link);
  return {};
}

namespace {

/// Where the robot stands when that is not where the experiment begins.
void warn_elsewhere(Composition& c, remote::RemoteBackend& robot) {
  constexpr double kElsewhere_rad = 0.05;  // or m: more than a robot sags under its weight
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  const Experiment& e = c.experiment;
  const hal::PostureConfig* posture = e.robot.posture(e.posture);
  hal::StateImage state(e.robot.shape());
  if (posture == nullptr || !robot.first_state(state)) return;
  std::size_t most = 0;
  const auto away = [&](std::size_t joint) {
    return std::abs(state.position_rad()[joint] - posture->position_rad[joint]);
  };
  for (std::size_t j = 1; j < e.robot.joints.size(); ++j) {
    if (away(j) > away(most)) most = j;
  }
  if (away(most) <= kElsewhere_rad) return;
  const hal::JointConfig& joint = e.robot.joints[most];
  c.warnings.push_back(
      {.message = fmt::format("the robot does not stand in the posture '{}': {} is {} away, and "
                              "more may be. The controllers will lead it from where it is",
                              e.posture, joint.name,
                              joint.slides ? fmt::format("{:.3f} m", away(most))
                                           : fmt::format("{:.1f} deg", away(most) * kDegrees)),
       .hint = "take it there first (tandem joint move at the server), or see that its way is free",
       .file = e.file,
       .key = "posture"});
}

}  // namespace

Diagnostics operate_live(Composition& c, std::unique_ptr<remote::RemoteBackend> robot) {
  const Experiment& e = c.experiment;
  warn_elsewhere(c, *robot);
  remote::TeleConfig config = e.teleoperation->link;
  config.seed = e.seed;
  const auto delay_ns = static_cast<std::int64_t>(1e9 * config.down.delay_s);
  if (e.teleoperation->real) config.up = config.down = {};
  remote::OperatorEnd::End twin;
  if (config.predict) {
    auto made = twin_of(c, nullptr);  // the server warns
    if (!made) return made.error();
    if (auto shared = shared_joint(c, static_cast<const LocalControllers*>(made->side.get()));
        !shared.empty()) {
      return shared;
    }
    twin = std::move(*made);
  }
  auto link = std::make_unique<remote::LiveLink>(
      hal::robot_of(e.robot), std::move(robot), std::move(twin), config,
      e.teleoperation->real ? 0 : delay_ns, playout_cycles(*e.teleoperation, e.loop.period_ns),
      e.loop.period_ns);
  c.tele = link.get();
  c.backend = std::move(link);
  return {};
}

}  // namespace tandem::runtime
