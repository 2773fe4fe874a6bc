#include "runtime/run/composition.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>

#include "base/process.hpp"
#include "base/quoting.hpp"
#include "controllers/hosted_call.hpp"
#include "controllers/plugin_loader.hpp"
#include "hal/config/capabilities.hpp"
#include "hal/sim/engine_loader.hpp"
#include "hal/sim/payload.hpp"
#include "hal/sim/scenario.hpp"
#include "runtime/run/conditions.hpp"
#include "runtime/run/late_plans.hpp"
#include "runtime/run/operator_link.hpp"
#include "runtime/run/retreats.hpp"

namespace tandem::runtime {
namespace {

/// Errors of several stages, so that one reading finds as many as it can.
class Collector {
 public:
  void add(Error error, const std::string& file, int line) {
    if (error.file.empty()) {
      error.file = file;
      error.line = line;
    }
    errors_.push_back(std::move(error));
  }
  void add(const Diagnostics& errors) {
    errors_.insert(errors_.end(), errors.begin(), errors.end());
  }
  [[nodiscard]] bool empty() const { return errors_.empty(); }
  [[nodiscard]] std::unexpected<Diagnostics> give() { return std::unexpected(std::move(errors_)); }

 private:
  Diagnostics errors_;
};

void add_controllers(Composition& c, Collector& errors) {
  for (const ControllerSpec& spec : c.experiment.controllers) {
    Result<LoadedController> loaded = load_plugin(c.experiment, spec);
    const int line = spec.parameters.line();
    const std::string key = "controller." + spec.name;
    if (!loaded) {  // of a library; the line that names it is in the experiment
      Error error = loaded.error();
      if (!error.file.empty()) error.message = error.file + ": " + error.message;
      error.file.clear();
      error.key = key;
      errors.add(std::move(error), c.experiment.file, line);
      continue;
    }
    const std::string doc = loaded->plugin().doc;
    const bool retreats = (*loaded)->can_retreat();
    const bool lacks_archive = loaded->plugin().lacks_archive;
    if (c.controllers != nullptr) {  // without kernels: only that it can be loaded
      const Status added = c.controllers->add(spec.name, std::move(*loaded), spec.parameters,
                                              spec.active, spec.inputs);
      if (!added) {
        TomlTable parameters = spec.parameters;
        if (parameters.has_errors()) continue;  // what it makes of what is not there follows on
        Error error = added.error();
        error.key = key + (error.key.empty() ? "" : ": " + error.key);
        errors.add(std::move(error), c.experiment.file, line);
        continue;
      }
    }
    c.notes.push_back({spec.name, doc, spec.active, retreats, lacks_archive});
  }
  errors.add(c.experiment.document.diagnostics());
}

/// Refuses [estimation], with the line of its table.
void refuse_estimation(const Experiment& e, const Error& error, Collector& errors) {
  TomlTable root = e.document.root();
  const std::string table = "estimation";
  const bool of_part = error.key.starts_with(table + ".");
  const std::string part = of_part ? error.key.substr(table.size() + 1) : "";
  const std::string name = part.substr(0, part.find('.'));
  errors.add(error, e.file,
             name.empty() ? root.line(table) : root.table_or_empty(table).line(name));
}

/// What the experiment wants estimated, shown to the controllers that are added after it.
void add_estimator(Composition& c, Collector& errors) {
  const Experiment& e = c.experiment;
  if (!e.estimation.any()) return;
  auto made = estimation::Estimator::make(hal::robot_of(e.robot), c.kernels.get(), e.estimation,
                                          e.loop.period_ns);
  if (!made) return refuse_estimation(e, made.error(), errors);
  c.estimator = std::move(*made);
  c.controllers->show_estimate(&c.estimator->image());
}

/// The robot's kernels, and the host of controllers. They are built after all that can be checked
/// without them, for it takes a while.
std::vector<std::string> links_of(const Experiment& e) {
  std::vector<std::string> names;
  if (const auto tree = e.tree()) {
    for (const model::Link& link : tree->links) names.push_back(link.name);
  }
  return names;
}

/// @return false: there are errors, and no more to find
bool add_kernels(Composition& c, const robot::RobotFiles& robot, bool serves,
                 const KernelSupply& supply, Collector& errors) {
  const Experiment& e = c.experiment;
  const bool builds = supply.missing != robot::MissingKernels::kRefuse;
  auto kernels = robot::supply_kernels(
      robot, e.kernel_variant,
      builds ? robot::MissingKernels::kTolerate : robot::MissingKernels::kRefuse);
  if (kernels && kernels->get() == nullptr && supply.missing != robot::MissingKernels::kTolerate) {
    if (!serves) add_controllers(c, errors);
    const Status needs = estimation::Estimator::check(hal::robot_of(e.robot), e.estimation);
    if (!needs) refuse_estimation(e, needs.error(), errors);
    if (!errors.empty()) return false;
    c.notes.clear();
    kernels = robot::supply_kernels(robot, e.kernel_variant, supply.missing, supply.build);
  }
  if (!kernels) {
    errors.add(kernels.error(), e.robot.file, 0);
    return true;
  }
  c.kernels = std::move(*kernels);
  if (c.kernels.get() == nullptr) {
    const Status needs = estimation::Estimator::check(hal::robot_of(e.robot), e.estimation);
    if (!needs) refuse_estimation(e, needs.error(), errors);
    return true;
  }
  c.controllers = std::make_unique<ControllerHost>(e.robot, c.kernels.get(), e.loop.period_ns);
  c.controllers->start_from(start_of(e));
  c.controllers->draw_in(links_of(e));
  c.controllers->read_from(e.document);
  add_estimator(c, errors);
  if (e.hal.backend == BackendKind::kSim || e.parallel) {
    c.predictor = std::make_unique<internal_model::PredictionService>(e.loop.period_ns);
  }
  c.controllers->predict_by(c.predictor.get());
  return true;
}

/// What to serve: an experiment, or a robot in the first of its postures.
std::expected<Experiment, Diagnostics> read_served(const std::string& file,
                                                   std::vector<TomlSetting> settings) {
  if (!robot::is_robot(file)) return read_experiment(file, std::move(settings));
  auto robot = robot::read_complete_robot(file, false, take_below("robot", settings));
  if (!robot) return std::unexpected(robot.error());
  std::string text = "robot = \"robot.toml\"\nduration_s = 1.0\n";  // is not followed
  if (!robot->config.postures.empty()) {
    text += "posture = \"" + robot->config.postures.front().name + "\"\n";
  }
  text += "[[controller]]\nplugin = \"hold\"\n";
  auto experiment = parse_experiment(text, file, robot->config);
  if (experiment) {
    experiment->robot_file = file;
    experiment->files = std::move(robot->files);
    experiment->description =
        std::make_shared<const model::UrdfModel>(std::move(robot->description));
  }
  return experiment;
}

/// Without controllers and without an end; DDS is what it is for.
void serve_only(Experiment& e, bool lockstep) {
  e.controllers.clear();
  e.duration_s = kEndless_s;
  e.hal.delay_cycles = 0;  // the owner's is in its commands
  e.dds.enabled = true;
  e.remote.command = e.remote.command.value_or(RemoteAccess::kLocal);
  e.remote.lockstep = e.remote.lockstep || lockstep;
}

/// What stays at this end of a link, while its owner is at the other.
void add_robot_side(Composition& c, OwnerController& owner, Collector& errors) {
  auto side = robot_side_of(c, &c.warnings);
  if (!side) return errors.add(side.error());
  c.robot_side = std::move(*side);
  owner.beside(c.robot_side.get());
}

/// The controller that an owner in another process is.
void add_owner(Composition& c, Collector& errors) {
  const Experiment& e = c.experiment;
  const auto command = e.remote.command.value_or(RemoteAccess::kOff);
  const bool may = command != RemoteAccess::kOff && e.dds.enabled;
  if (!may || c.controllers == nullptr || e.hal.backend == BackendKind::kDds) return;
  auto owner = std::make_shared<OwnerController>();
  c.owner_slot = c.controllers->size();
  const auto nothing = TomlDocument::parse("", e.file);
  const Status added = c.controllers->add(kOwnerController, owner, nothing->root(), false);
  if (!added) return errors.add(added.error(), e.file, 0);
  if (e.teleoperation && e.controllers.empty()) add_robot_side(c, *owner, errors);
  c.owner = std::move(owner);
}

}  // namespace

std::vector<double> start_of(const Experiment& e) {
  if (e.hal.backend == BackendKind::kDds) return {};  // wherever its owner left it
  if (const hal::PostureConfig* posture = e.robot.posture(e.posture)) return posture->position_rad;
  if (e.hal.backend == BackendKind::kWire) return {};
  return std::vector<double>(e.robot.joints.size(), 0.0);
}

Result<LoadedController> load_plugin(const Experiment& e, const ControllerSpec& spec) {
  return bounded_call(spec.name, ControllerHost::kStartTime,
                      [plugin = plugin_path(e, spec.plugin)] {
                        return load_controller(plugin, controller_folders());
                      });
}

namespace {

/// What the caller wants of the experiment.
Diagnostics override_experiment(Experiment& e, const Overrides& overrides) {
  const std::string& hal = overrides.hal;
  if (hal == "can" || hal == "ethercat") {
    e.hal.backend = BackendKind::kWire;
    e.hal.wire = hal;
  } else if (hal == "sim" || hal == "dds") {
    e.hal.backend = hal == "sim" ? BackendKind::kSim : BackendKind::kDds;
    e.hal.wire.clear();
  } else if (!hal.empty()) {
    return {fail("hal: '" + hal + "'", "one of sim, can, ethercat, dds").error()};
  }
  const std::string& on_fault = overrides.on_fault;
  if (!on_fault.empty() && on_fault != "end" && on_fault != "wait")
    return {fail("on_fault: '" + on_fault + "'", "one of end, wait").error()};
  if (on_fault == "end") e.after_stop = AfterStop::kEnd;
  if (on_fault == "wait") e.after_stop = AfterStop::kWait;
  const double duration_s = overrides.duration_s.value_or(kEndless_s);
  if (!(duration_s > 0.0 && (duration_s <= 1e6 || duration_s == kEndless_s))) {
    return {fail(fmt::format("duration_s: {}", duration_s), "above 0, to 1e6, or infinity: no end")
                .error()};
  }
  e.seed = overrides.seed.value_or(e.seed);
  e.duration_s = overrides.duration_s.value_or(e.duration_s);
  if (!overrides.kernel_variant.empty()) e.kernel_variant = overrides.kernel_variant;
  e.hal.lockstep = e.hal.lockstep || overrides.lockstep;
  e.dds.enabled = overrides.dds.value_or(e.dds.enabled);
  const bool in_domain = e.dds.enabled || e.hal.backend == BackendKind::kDds || overrides.serves;
  if (overrides.domain) {
    e.dds.domain = *overrides.domain;
  } else if (in_domain && !e.dds.domain_given) {
    const Result<int> domain = dds::environment_domain();
    if (!domain) return {domain.error()};
    e.dds.domain = *domain;
  }
  e.hal.delay_cycles = overrides.delay_cycles.value_or(e.hal.delay_cycles);
  if (overrides.change) overrides.change(e);
  return {};
}

/// Why [teleoperation] cannot be done: empty if it can, or is not wanted.
Diagnostics unfit_for_link(const Experiment& e, const Overrides& overrides) {
  if (!e.teleoperation) return {};
  if (e.hal.backend == BackendKind::kWire && !overrides.serves) {
    return {{.message = "the link lies between two processes",
             .hint = "run with --hal dds, and serve the robot: tandem serve " + shell_word(e.file) +
                     " --hal " + e.hal.wire,
             .file = e.file,
             .key = "teleoperation"}};
  }
  const auto homed = std::ranges::find_if(
      e.robot.joints, [](const hal::JointConfig& joint) { return joint.homing.has_value(); });
  if (homed != e.robot.joints.end()) {
    return {{.message = "nothing is homed over the link, and " + homed->name + " has `homing`",
             .hint = "leave out [teleoperation], or give the joint an absolute encoder",
             .file = e.file,
             .key = "teleoperation"}};
  }
  if (overrides.serves && (overrides.lockstep || e.remote.lockstep)) {
    return {{.message = "in lockstep the link is at the operator's end",
             .hint = "leave --lockstep out, or serve the robot by an experiment without this table",
             .file = e.file,
             .key = "teleoperation"}};
  }
  return {};
}

/// Errors of flags for a bus or a server: they would change nothing, and look as if they did.
Diagnostics without_effect(const Experiment& e, const Overrides& overrides) {
  const bool simulated = e.hal.backend == BackendKind::kSim;
  if (overrides.lockstep && simulated && !overrides.serves) {
    return {fail("--lockstep: a robot in this process has no other to wait for",
                 "add --hal can or --hal dds, or leave --lockstep out")
                .error()};
  }
  if (!overrides.interfaces.empty() && e.hal.backend != BackendKind::kWire) {
    return {fail(simulated ? "--interface: a robot in this process has no bus"
                           : "--interface: the bus is the server's",
                 simulated ? "add --hal can or --hal ethercat, or leave --interface out"
                           : "give --interface to `tandem serve`")
                .error()};
  }
  return {};
}

/// Why it cannot be run, whatever the robot.
Diagnostics unfit(const Experiment& e, const Overrides& overrides) {
  if (!e.endless() && e.cycles() == 0) {
    return {{.message = fmt::format("{} s are less than half a cycle of the loop", e.duration_s),
             .hint = fmt::format("run for {} s or longer",
                                 static_cast<double>(e.loop.period_ns) * 1e-9),
             .file = e.file,
             .key = "duration_s"}};
  }
  const auto has = [&](hal::BusKind kind) {
    return std::ranges::find(e.robot.buses, kind, &hal::BusConfig::kind) != e.robot.buses.end();
  };
  const hal::BusKind asked =
      e.hal.wire == "ethercat" ? hal::BusKind::kEthercat : hal::BusKind::kCan;
  if (e.hal.backend == BackendKind::kWire && !has(asked)) {
    const std::string wire = e.hal.wire == "ethercat" ? "EtherCAT" : "CAN";
    const char* other = e.hal.wire == "ethercat" ? "can" : "ethercat";
    return {{.message = "the robot has no " + wire + " bus",
             .hint = fmt::format("add --hal {}, or write the kind of its [[bus]] in {}", other,
                                 e.robot.file),
             .file = e.file,
             .key = "hal.backend"}};
  }
  const bool is_remote = e.hal.backend == BackendKind::kDds;
  if (overrides.serves && is_remote) {
    return {{.message = "a robot of another process cannot be served once more",
             .hint = "add --hal sim or --hal can",
             .file = e.file,
             .key = "hal.backend"}};
  }
  if (overrides.debug && (e.hal.backend != BackendKind::kSim || overrides.serves)) {
    return {{.message = "--debug waives the limits of time that keep a robot safe: it is for a "
                        "simulation in this process, and " +
                        std::string(is_remote ? "this robot is another process'"
                                              : "this robot is on a bus"),
             .hint = "add --hal sim, or leave --debug out",
             .file = e.file,
             .key = "hal.backend"}};
  }
  if (overrides.domain && !is_remote && !overrides.serves && !e.dds.enabled) {
    return {{.message = "--domain: nothing of this run is in a DDS domain",
             .hint = "add --dds, or leave it out",
             .file = {},
             .key = {}}};
  }
  if (Diagnostics link = unfit_for_link(e, overrides); !link.empty()) return link;
  if (Diagnostics events = unfit_for_events(e, overrides.serves); !events.empty()) return events;
  if (!overrides.scenario.empty() && e.hal.backend != BackendKind::kSim) {
    return {{.message = "faults are injected on the other end of the wire",
             .hint = is_remote ? "give --scenario to `tandem serve`"
                               : "give --scenario to `tandem emulate`",
             .file = overrides.scenario,
             .key = {}}};
  }
  return {};
}

/// What only one end of the link does.
void keep_to_own_end(Experiment& e, const Overrides& overrides) {
  if (overrides.serves) serve_only(e, overrides.lockstep);
  if (e.hal.backend != BackendKind::kDds) return;
  e.dds.enabled = false;  // the robot is the server's to show
  e.hal.settle_s = 0.0;   // bring-up and settling are the server's
}

/// An error of the simulation, with the place of its key.
Error in_its_file(Error error, const Experiment& e) {
  if (!error.file.empty()) return error;
  constexpr std::string_view kOurs = "sim.";  // keys of the experiment
  const bool of_experiment = error.key.starts_with(kOurs);
  error.file = e.robot.file;
  if (of_experiment) {
    const Error there =
        e.document.root().table_or_empty("sim").error_at(error.key.substr(kOurs.size()), {}, {});
    error.file = there.file;
    error.line = there.line;
  }
  return error;
}

/// What is wrong, or odd, with the robot where it starts.
void check_robot(Composition& c, const robot::RobotFiles& robot, bool from_log, Collector& errors) {
  const Experiment& e = c.experiment;
  const bool simulated = e.hal.backend == BackendKind::kSim && !from_log;
  robot::Findings found = robot::check(robot, {.plant = simulated,
                                               .drives = e.hal.backend != BackendKind::kDds,
                                               .postures = {e.posture},
                                               .period_ns = e.loop.period_ns,
                                               .simulation = e.sim_robot_config()});
  for (Error& error : found.errors) errors.add(in_its_file(std::move(error), e), {}, 0);
  for (Error& warning : found.warnings) c.warnings.push_back(in_its_file(std::move(warning), e));
  c.loops = std::move(found.loops);
}

/// The second robot of [parallel], and its kernels. Scenarios are the first robot's.
Diagnostics add_parallel(Composition& c, const KernelSupply& supply) {
  Experiment& e = c.experiment;
  if (!e.parallel || c.kernels.get() == nullptr) return {};
  const auto robot = robot::with_description(std::move(e.parallel->robot), e.files);
  if (!robot) return robot.error();
  e.parallel->robot = robot->config;
  auto kernels = robot::supply_kernels(*robot, e.kernel_variant, supply.missing, supply.build);
  if (!kernels) {
    return {{.message = "the parallel robot has no kernels: " + kernels.error().message,
             .hint = "leave --no-build out: the run builds them",
             .file = kernels.error().file.empty() ? e.parallel->robot.file : kernels.error().file,
             .key = "parallel"}};
  }
  c.parallel_kernels = std::move(*kernels);
  if (c.parallel_kernels.get() == nullptr) return {};
  sim::SimRobotConfig sim = e.sim_robot_config();
  sim.tree = std::make_shared<const model::Tree>(robot->tree);
  sim.truth = true;
  sim.changes = nullptr;  // they are the first one's
  c.simulation = sim;
  auto second = sim::SimRobot::create(e.parallel->robot, c.parallel_kernels.get(), sim);
  if (!second) {
    Error error = second.error();
    error.file = e.parallel->robot.file;
    return {error};
  }
  c.parallel = std::move(*second);
  return {};
}

/// The robot in simulation.
Diagnostics add_simulation(Composition& c, const Overrides& overrides) {
  const std::string& scenario = overrides.scenario;
  const Experiment& e = c.experiment;
  sim::SimRobotConfig sim = e.sim_robot_config();
  sim.faults = e.faults;
  if (!scenario.empty()) {
    auto faults = sim::read_scenario(scenario, e.robot, e.loop.period_ns, e.tree().get());
    if (!faults) return faults.error();
    sim.faults.insert(sim.faults.end(), faults->begin(), faults->end());
    for (const sim::ScenarioFault& fault : *faults) {
      if (fault.kind != hal::FaultKind::kPayload || e.tree() == nullptr) continue;
      if (std::string heavy = sim::too_heavy(fault, *e.tree()); !heavy.empty())
        c.warnings.push_back({heavy, "give its mass in kg", scenario, 0, "fault"});
    }
  }
  auto backend = sim::SimRobot::create(e.robot, c.kernels.get(), sim);
  if (!backend) return {in_its_file(backend.error(), e)};
  if (!e.parallel) c.simulation = sim;
  c.sim = backend->get();
  c.master = &c.sim->master();
  c.backend = std::move(*backend);
  if (overrides.serves) return {};  // the link is before this process
  return put_link_between(c);
}

}  // namespace

Diagnostics compose(Composition& c, const std::string& file, const Overrides& overrides,
                    KernelSupply kernels) {
  if (overrides.no_build && kernels.missing == robot::MissingKernels::kBuild) {
    kernels.missing = robot::MissingKernels::kRefuse;
  }
  auto experiment = overrides.serves ? read_served(file, overrides.settings)
                                     : read_experiment(file, overrides.settings);
  if (!experiment) return experiment.error();
  Experiment& e = c.experiment;
  e = std::move(*experiment);
  for (const TomlSetting& one : overrides.settings) e.settings.push_back(one.said);
  if (auto unknown = override_experiment(e, overrides); !unknown.empty()) return unknown;
  if (auto reasons = unfit(e, overrides); !reasons.empty()) return reasons;
  if (overrides.debug) waive_time_limits();
  keep_to_own_end(e, overrides);
  if (Status done = hal::replace_interfaces(e.robot, overrides.interfaces); !done) {
    return {done.error()};
  }
  if (auto flags = without_effect(e, overrides); !flags.empty()) return flags;
  const auto robot = robot::join(e.robot, *e.description, e.files);
  if (!robot) return robot.error();
  Collector errors;
  check_robot(c, *robot, overrides.from_log, errors);
  if (!add_kernels(c, *robot, overrides.serves, kernels, errors)) return errors.give().error();
  if (!overrides.serves) add_controllers(c, errors);
  add_owner(c, errors);
  if (!errors.empty()) {
    return errors.give().error();
  }
  if (e.plant != nullptr) std::ranges::copy(e.plant->warnings, std::back_inserter(c.warnings));
  for (Error& warning : missing_retreats(c)) c.warnings.push_back(std::move(warning));
  std::ranges::move(empty_plans(c), std::back_inserter(c.warnings));
  if (c.controllers != nullptr && !overrides.duration_s && !overrides.serves) {
    std::ranges::move(late_plans(c), std::back_inserter(c.warnings));
  }
  if (overrides.from_log) return {};
  if (auto failed = add_parallel(c, kernels); !failed.empty()) return failed;
  const bool simulated = e.hal.backend == BackendKind::kSim;
  if (simulated && c.kernels.get() != nullptr) {
    if (auto failed = add_simulation(c, overrides); !failed.empty()) return failed;
  }
  return overrides.serves ? Diagnostics() : look_up_conditions(c);
}

const hal::TruthImage* truth_of(const Composition& c) {
  return c.sim != nullptr && c.experiment.sim.ground_truth ? &c.sim->truth() : nullptr;
}

CycleConfig cycle_config(Composition& c, const Overrides& overrides) {
  return cycle_config(c, overrides, c.backend->pace());
}

CycleConfig cycle_config(Composition& c, const Overrides& overrides, hal::Pace pace) {
  Experiment& e = c.experiment;
  const bool simulated = pace == hal::Pace::kSimulatedClock;
  e.loop.rate = overrides.rate.value_or(simulated ? e.loop.rate : 0.0);
  e.loop.start_paused = simulated && (overrides.start_paused || e.loop.start_paused);
  e.loop.pacing = simulated                       ? rt::Pacing::kSimulated
                  : pace == hal::Pace::kWallClock ? rt::Pacing::kWallClock
                                                  : rt::Pacing::kExternal;
  CycleConfig config;
  config.loop = e.loop;
  config.running_cycles = e.cycles();
  config.settle_cycles = e.settle_cycles();
  config.delay_cycles = e.hal.delay_cycles;
  const bool on_wall_clock = pace == hal::Pace::kWallClock && c.remote == nullptr;
  if (overrides.serves || on_wall_clock) config.after_stop = AfterStop::kWait;
  config.after_stop = e.after_stop.value_or(config.after_stop);
  if (c.remote != nullptr) config.bring_up_cycles = ~std::uint64_t{0};  // the server's is limited
  config.trace_cycles = overrides.trace_cycles;
  config.after_reset = e.after_reset;
  config.on_stray = e.on_stray;
  config.retreat_cycles =
      static_cast<std::uint64_t>(e.retreat_s * 1e9 / static_cast<double>(e.loop.period_ns));
  constexpr std::int64_t kShutDown_ns = 2'000'000'000;  // drives that come to rest slowly
  config.shut_down_cycles = std::max(config.shut_down_cycles,
                                     static_cast<std::uint64_t>(kShutDown_ns / e.loop.period_ns));
  config.fall = e.fall_limits();
  return config;
}

}  // namespace tandem::runtime
