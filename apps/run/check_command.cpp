// `tandem check`: all that can be said of a robot or an experiment before it moves.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "apps/can/bus_table.hpp"
#include "apps/control/fault_table.hpp"
#include "apps/control/remote_gate.hpp"
#include "apps/robot/loop_facts.hpp"
#include "apps/robot/scale_facts.hpp"
#include "apps/robot/wrong_kind.hpp"
#include "apps/run/commands.hpp"
#include "apps/run/connection.hpp"
#include "apps/run/controller_trial.hpp"
#include "apps/run/event_run.hpp"
#include "apps/run/input_topics.hpp"
#include "apps/run/scenario_warnings.hpp"
#include "apps/text/console.hpp"
#include "base/counted.hpp"
#include "base/quoting.hpp"
#include "hal/ethercat-can/bus_load.hpp"
#include "hal/ethercat-can/drive_use.hpp"
#include "hal/sim/engine_loader.hpp"
#include "runtime/run/run_log.hpp"

namespace tandem::apps {
namespace {

const char* backend_text(runtime::BackendKind backend) {
  switch (backend) {
    case runtime::BackendKind::kSim: break;
    case runtime::BackendKind::kWire:
      return "wire: drive master here, boards on their CAN and EtherCAT interfaces";
    case runtime::BackendKind::kDds: return "dds: the robot of another process (tandem serve)";
  }
  return "sim: drive master, frames, boards' firmware and plant in this process";
}

void add_robot_facts(const hal::RobotConfig& robot, Facts& facts) {
  facts.add("robot", fmt::format("{} ({})", robot.name, robot.file));
  facts.add("description", robot.model.urdf);
  facts.add("base", robot.model.floating_base ? "floating" : "fixed");
  facts.add("joints",
            fmt::format("{} on {}", robot.joints.size(), counted(robot.boards.size(), "board")));
  facts.add("sensors", std::to_string(robot.sensors.size()));
  for (const hal::BusConfig& bus : robot.buses) {
    std::size_t nodes = 0;
    for (const hal::BoardConfig& board : robot.boards) nodes += board.bus == bus.name ? 1 : 0;
    for (const hal::SensorConfig& sensor : robot.sensors) nodes += sensor.bus == bus.name ? 1 : 0;
    facts.add("bus " + bus.name,
              fmt::format("{}, {}", counted(nodes, "node"), hal::can::wire_name(bus.kind, bus.fd)));
  }
  for (const hal::can::DriveFact& fact : hal::can::drive_facts(robot)) {
    facts.add("drive", fact.what + ": " + fact.how);
  }
  add_scale_facts(robot, facts);
}

void add_kernel_facts(const model::KernelLibrary& kernels, const std::string& robot, Facts& facts) {
  if (kernels.get() != nullptr) {
    facts.add("kernels", fmt::format("{} ({})", kernels.path(), kernels->variant));
  } else {
    facts.add("kernels", "none yet: `tandem run` builds them, and so does");
    facts.add("", "tandem model build " + shell_word(robot));
  }
}

/// Who moves the bodies, how, and in which steps.
void add_simulation_facts(const runtime::Experiment& e, Facts& facts) {
  if (e.hal.backend == runtime::BackendKind::kSim && e.sim.engine != sim::kOwnEngine) {
    facts.add("engine", sim::engine_text(e.sim.engine));
  }
  facts.add("integrator", runtime::integrator_text(e));
}

/// How many joints move the link: they alone feel a wrench at it.
std::size_t joints_before(const model::Tree& tree, const std::string& link) {
  const int index = tree.link_index(link);
  return index < 0 ? 0 : tree.path_to(tree.links[static_cast<std::size_t>(index)].body).size();
}

/// What [estimation] adds.
void add_estimation_facts(const runtime::Experiment& e, Facts& facts) {
  const estimation::EstimationConfig& config = e.estimation;
  if (config.base) facts.add("estimates", "the floating base");
  if (config.observer) facts.add("estimates", "external torques of the joints");
  if (config.collision) {
    facts.add("estimates", fmt::format("collisions, by {}; reaction: {}",
                                       counted(config.collision->thresholds.size(), "threshold"),
                                       reaction_text(config.collision->reaction)));
  }
  for (const estimation::WrenchConfig& wrench : config.wrenches) {
    const auto site = std::ranges::find(e.robot.model.sites, wrench.site, &hal::SiteConfig::name);
    const std::size_t joints = e.description == nullptr || site == e.robot.model.sites.end()
                                   ? 6
                                   : joints_before(e.description->tree, site->link);
    facts.add(
        "estimates",
        "the wrench at " + wrench.site +
            (joints >= 6 ? ""
                         : fmt::format(": {} see at most {} of its 6 numbers, and the least wrench "
                                       "that explains those is shown",
                                       counted(joints, "joint"), joints)));
  }
}

/// "link_damping_Nms_rad = 0 Nms/rad, live: damps …" of each; a list is one line where its elements
/// are alike.
void add_parameter_facts(runtime::ControllerHost& host, const std::string& controller,
                         Facts& facts) {
  for (const auto& one : host.owned()) {
    if (one == nullptr || one->name != controller) continue;
    const auto& rows = one->io->parameters.rows();
    std::string told;  // a list that has its line
    for (const ParameterRow& row : rows) {
      if (!row.list.empty() && row.list == told) continue;
      const std::string value = row.text();
      const bool alike = std::ranges::all_of(rows, [&](const ParameterRow& other) {
        return other.list != row.list || other.text() == value;
      });
      if (!row.list.empty() && alike) told = row.list;
      facts.add("", fmt::format("{} = {}{}{}: {}", row.list.empty() || !alike ? row.name : row.list,
                                value.empty() ? "-" : value,
                                row.facts.unit.empty() ? "" : " " + row.facts.unit,
                                row.facts.live ? ", live" : "", row.facts.doc));
    }
  }
}

/// What a run would do.
void print_plan(const WiredComposition& c, std::FILE* out) {
  const runtime::Experiment& e = c.experiment;
  const double period_s = static_cast<double>(e.loop.period_ns) * 1e-9;
  Facts facts;
  add_robot_facts(e.robot, facts);
  add_kernel_facts(c.kernels, e.robot.file, facts);
  add_loop_facts(e.robot, c.loops, facts);
  facts.add("backend", backend_text(e.hal.backend));
  facts.add("start", e.posture.empty() ? "every joint at 0" : "posture " + e.posture);
  for (const ControllerNote& note : c.notes) {
    facts.add("controller " + note.name, note.doc + (note.active ? "" : " Inactive at first."));
    if (c.controllers != nullptr) add_parameter_facts(*c.controllers, note.name, facts);
  }
  if (c.controllers == nullptr) {
    facts.add("", "their parameters and claims are checked when there are kernels");
  }
  const std::string length =
      e.endless() ? "after bring-up " + length_text(e)
                  : counted(e.cycles(), "cycle") + ", " + length_text(e) + " after bring-up";
  facts.add("loop", fmt::format("{:.3g} kHz, {}", 1e-3 / period_s, length));
  add_simulation_facts(e, facts);
  if (e.hal.backend == runtime::BackendKind::kSim && e.plant != nullptr)
    for (const std::string& one : e.plant->differences) facts.add("plant is other in", one);
  for (const std::string& one : e.happens) facts.add("what happens", one);
  facts.add("seed", std::to_string(e.seed));
  add_estimation_facts(e, facts);
  if (e.teleoperation) {
    facts.add("link to the robot", remote::tc_command(e.teleoperation->link.up, "INTERFACE"));
    facts.add("link back", remote::tc_command(e.teleoperation->link.down, "INTERFACE"));
  }
  facts.add("log", e.log.folder + "/");
  fmt::print(out, "{} is right. It would run:\n", e.file);
  facts.print(out);
}

void print_robot(const robot::RobotFiles& robot, const model::KernelLibrary& kernels,
                 const robot::ClosureStudy& loops, bool warned, std::FILE* out) {
  Facts facts;
  add_robot_facts(robot.config, facts);
  add_kernel_facts(kernels, robot.config.file, facts);
  add_loop_facts(robot.config, loops, facts);
  if (robot.config.model.repair_inertia) {
    const auto repaired = std::ranges::count(robot.warnings, model::kRepaired, &Error::hint);
    facts.add("inertias", fmt::format("{} repaired", repaired));
  }
  fmt::print(out, "{} {}.\n", robot.config.file,
             warned ? "can be used; look at the warnings" : "is right");
  facts.print(out);
}

/// The loop's period that `--bus` counts with for a robot's own file, which has none.
constexpr std::int64_t kBusPeriod_ns = 1'000'000;

/// What is set of a robot's own file: "robot.gains…" as of an experiment, or "gains…".
std::vector<TomlSetting> of_robot(const CheckOptions& options) {
  std::vector<TomlSetting> others = options.settings;
  std::vector<TomlSetting> settings = take_below("robot", others);
  settings.insert(settings.end(), others.begin(), others.end());
  return settings;
}

/// What `--bus` shows, before anything is refused.
Diagnostics check_buses(const CheckOptions& options, bool robot_only, std::FILE* out, Json& json) {
  if (!robot_only) {
    const auto experiment = runtime::read_experiment(options.file, options.settings);
    if (!experiment) return {};  // composing reports it
    return show_buses(experiment->robot, experiment->loop.period_ns, out, json);
  }
  const auto robot = robot::read_robot(options.file, false, of_robot(options));
  if (!robot) return {};
  return show_buses(robot->config, kBusPeriod_ns, out, json);
}

Diagnostics check_robot(const CheckOptions& options, std::FILE* out, Diagnostics& warnings,
                        Json& json) {
  const auto robot = robot::read_robot(options.file, options.repair, of_robot(options));
  if (!robot) return robot.error();
  const robot::Findings found =
      robot::check(*robot, robot::use_alone(robot->config, options.bus ? kBusPeriod_ns : 0));
  warnings = robot->warnings;
  warnings.insert(warnings.end(), found.warnings.begin(), found.warnings.end());
  print_warnings(warnings);
  add_loop_json(robot->config, found.loops, json);
  add_scale_json(robot->config, json);
  if (!found.errors.empty()) return found.errors;
  const auto kernels = robot::supply_kernels(*robot, {}, robot::MissingKernels::kTolerate);
  if (!kernels) return {kernels.error()};
  print_robot(*robot, *kernels, found.loops, !warnings.empty(), out);
  json["kernels"] = kernels->path();
  return {};
}

/// Controllers that a prediction cannot continue: a run by itself is right.
void warn_of_archives(const WiredComposition& c, Diagnostics& warnings) {
  for (const ControllerNote& note : c.notes) {
    if (!note.lacks_archive) continue;
    warnings.push_back({.message = "has members but no archive(): predictions and snapshots leave "
                                   "out what it remembers, and may be wrong",
                        .hint = "give its class an archive(); an empty one says that nothing "
                                "changes after configure() (docs/controllers.md#writing-one)",
                        .file = c.experiment.file,
                        .key = "controller." + note.name});
  }
}

/// Inputs whose topics a run would refuse to read.
Status check_topics(const WiredComposition& c) {
  if (c.controllers == nullptr) return {};
  std::vector<std::shared_ptr<runtime::InputPort>> fed;
  for (const auto& one : c.controllers->owned()) {
    if (one == nullptr) continue;
    for (const auto& port : one->inputs) {
      if (port->source().feeder == runtime::InputFeeder::kTopic) fed.push_back(port);
    }
  }
  const auto nobody = [] { return std::string(); };
  return topics_may_feed(fed, c.experiment.dds.enabled, remote_gate(c.experiment.remote, nobody));
}

Diagnostics check_experiment(const CheckOptions& options, std::FILE* out, Diagnostics& warnings,
                             Json& json) {
  const auto composition = runtime::composed<WiredComposition>(
      options.file, {.settings = options.settings}, {.missing = robot::MissingKernels::kTolerate});
  if (!composition) return composition.error();
  warnings = (*composition)->experiment.description->warnings;
  warnings.insert(warnings.end(), (*composition)->warnings.begin(), (*composition)->warnings.end());
  warn_of_archives(**composition, warnings);
  add_scenario_warnings((*composition)->experiment, warnings);
  print_warnings(warnings);
  if (const Status fed = check_topics(**composition); !fed) return {fed.error()};
  if (Diagnostics events = check_events((*composition)->experiment); !events.empty()) return events;
  RunOptions as_run;
  as_run.experiment = options.file;
  as_run.settings = options.settings;
  const TryController trial = try_in_other_process(as_run);
  if (Diagnostics events = ask_ahead(**composition, trial); !events.empty()) return events;
  const runtime::Experiment& e = (*composition)->experiment;
  add_loop_json(e.robot, (*composition)->loops, json);
  add_scale_json(e.robot, json);
  print_plan(**composition, out);
  json.update(figures_json(&e));
  json["kernels"] = (*composition)->kernels.path();
  return {};
}

}  // namespace

Exit check_command(const CheckOptions& options) {
  std::FILE* out = human_output(options.json);
  const bool robot_only = robot::is_robot(options.file);
  Json json{{"ok", true}, {"errors", Json::array()}};
  Diagnostics errors, warnings;
  const auto wrong = options.repair
                         ? wrong_kind(options.file, Takes::kRobot, "tandem check --repair")
                         : wrong_kind(options.file, Takes::kEither, "tandem check");
  if (wrong) errors.push_back(*wrong);
  if (errors.empty() && options.bus) errors = check_buses(options, robot_only, out, json["buses"]);
  if (errors.empty()) {
    errors = robot_only ? check_robot(options, out, warnings, json)
                        : check_experiment(options, out, warnings, json);
  }
  print_errors(errors);
  json["ok"] = errors.empty();
  json["errors"] = errors_json(errors);
  json["warnings"] = errors_json(warnings);
  return end_with_json(options.json, json, errors.empty() ? Exit::kDone : Exit::kUsage);
}

}  // namespace tandem::apps
