#include "runtime/experiment.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <ranges>

#include "base/file_name.hpp"
#include "base/nearest.hpp"
#include "rt/clock_control.hpp"
#include "runtime/estimation_options.hpp"
#include "runtime/robot_layout.hpp"
#include "runtime/standing_height.hpp"

namespace tandem::runtime {
namespace {

using Names = std::vector<std::string>;

template <class Enum>
Enum read_choice(TomlTable& table, const char* key, const Names& names, Enum value) {
  const std::string& name = names[static_cast<std::size_t>(value)];
  const auto found = std::ranges::find(names, table.choice_or(key, name, names));
  return static_cast<Enum>(found - names.begin());
}

template <class T>
void check_reference(TomlTable& table, const char* key, const std::string& name,
                     const std::vector<T>& items, const std::string& kind) {
  Names known;
  for (const T& item : items) known.push_back(item.name);
  if (name.empty() || std::ranges::find(known, name) != known.end()) return;
  table.error(key, "the robot has no " + kind + " '" + name + "'", suggest(name, known));
}

/// @param sim  says how long the hoist needs, which is the default of settle_s
HalOptions read_hal(TomlTable table, const SimOptions& sim) {
  HalOptions hal;
  const std::string backend = table.choice_or("backend", "sim", {"sim", "can", "ethercat", "dds"});
  if (backend == "dds") hal.backend = BackendKind::kDds;
  if (backend == "can" || backend == "ethercat") {
    hal.backend = BackendKind::kWire;
    hal.wire = backend;
  }
  hal.lockstep = table.boolean_or("lockstep", hal.lockstep);
  hal.delay_cycles = static_cast<std::uint32_t>(table.integer_or("delay_cycles", 0, 0, 1000));
  hal.answer_window = table.number_or("answer_window", hal.answer_window, {0.05, 0.95});
  hal.settle_s = table.number_or("settle_s", sim.hoist ? sim.hoist_release_s : 0.0, {0.0, 600.0});
  table.finish();
  return hal;
}

SimOptions read_sim(TomlTable table) {
  SimOptions sim;
  sim.engine = table.choice_or("engine", sim.engine, sim::known_engines());
  sim.integrator = read_choice(table, "integrator", {"semi_implicit", "rk4"}, sim.integrator);
  sim.substep_ns = table.integer_or("substep_ns", sim.substep_ns, 1'000, 100'000'000);
  sim.order = static_cast<int>(table.integer_or("order", -1, 0, 3));
  sim.noise = table.boolean_or("noise", sim.noise);
  sim.ground_truth = table.boolean_or("ground_truth", sim.ground_truth);
  sim.bus_timing = table.boolean_or("bus_timing", sim.bus_timing);
  sim.bus_latency_ns = table.integer_or("bus_latency_ns", sim.bus_latency_ns, 0, 10'000'000);
  TomlTable hoist = table.table_or_empty("hoist");
  sim.hoist = hoist.boolean_or("enabled", sim.hoist);
  sim.hoist_release_s = hoist.number_or("release_s", sim.hoist_release_s, {0.0, 60.0});
  sim.hoist_lift_m = hoist.number_or("lift_m", sim.hoist_lift_m, {0.0, 10.0});
  if (sim.hoist_lift_m > 0.0 && !sim.hoist)
    hoist.error("lift_m", "without a hoist nothing lifts the base", "leave out enabled = false");
  hoist.finish();
  table.finish();
  return sim;
}

void read_overrun(TomlTable table, rt::LoopConfig& loop) {
  loop.on_overrun = read_choice(table, "policy", {"skip", "hold", "stop"}, loop.on_overrun);
  loop.stop_late = static_cast<int>(table.integer_or("n", loop.stop_late, 1, 64));
  loop.stop_window = static_cast<int>(table.integer_or("m", loop.stop_window, 1, 64));
  if (loop.stop_late > loop.stop_window) {
    table.error("n", "is more than m", "the policy stops after n late cycles of the last m");
  }
  table.finish();
}

void read_clock(TomlTable table, rt::LoopConfig& loop) {
  loop.rate = table.number_or("rate", loop.rate, {0.0, rt::kFastest});
  if (const Status right = rt::check_rate(loop.rate); !right) {
    table.error("rate", right.error().message, right.error().hint);
  }
  loop.start_paused = table.boolean_or("start_paused", loop.start_paused);
  table.finish();
}

rt::ThreadConfig read_realtime(TomlTable& root) {
  rt::ThreadConfig thread;
  if (!root.has("realtime")) {
    thread.policy = rt::SchedulingPolicy::kOther;
    thread.lock_memory = false;
    return thread;
  }
  TomlTable table = root.table("realtime");
  thread.policy = read_choice(table, "policy", {"other", "fifo", "rr"}, thread.policy);
  thread.priority = static_cast<int>(table.integer_or("priority", thread.priority, 1, 99));
  thread.cpu = static_cast<int>(table.integer_or("cpu", thread.cpu, 0, 1023));
  thread.lock_memory = table.boolean_or("lock_memory", thread.lock_memory);
  table.finish();
  return thread;
}

void read_faults(TomlTable table, Experiment& e) {
  if (table.has("after_stop")) {
    const bool ends = table.choice("after_stop", {"end", "wait"}) == "end";
    e.after_stop = ends ? AfterStop::kEnd : AfterStop::kWait;
  }
  e.after_reset = read_choice(table, "after_reset", {"hold", "continue"}, e.after_reset);
  e.on_stray = read_choice(table, "stray_writes",
                           {"category0", "category1", "category2", "hold", "warn"}, e.on_stray);
  e.retreat_s = table.number_or("retreat_s", e.retreat_s, {0.1, 60.0});
  if (table.has("fall")) e.falls_are_faults = table.choice("fall", {"stop", "allow"}) == "stop";
  if (table.has("watchdog_s")) e.watchdog_s = table.number("watchdog_s", {0.05, 3600.0});
  table.finish();
}

RemoteOptions read_remote(TomlTable table) {
  RemoteOptions remote;
  if (table.has("command")) {
    remote.command =
        read_choice(table, "command", {"off", "local", "network"}, RemoteCommand::kOff);
  }
  if (table.has("trust")) {
    remote.trust = read_choice(table, "trust", {"admitted", "domain"}, RemoteTrust::kAdmitted);
  }
  remote.load = table.boolean_or("load", remote.load);
  remote.lockstep = table.boolean_or("lockstep", remote.lockstep);
  remote.lease_timeout_s = table.number_or("lease_timeout_s", remote.lease_timeout_s, {0.05, 60.0});
  remote.lockstep_timeout_s =
      table.number_or("lockstep_timeout_s", remote.lockstep_timeout_s, {0.05, 3600.0});
  remote.max_age_cycles = static_cast<std::uint64_t>(table.integer_or(
      "max_age_cycles", static_cast<std::int64_t>(remote.max_age_cycles), 1, 100'000));
  const std::string on_lost =
      table.choice_or("on_lost", "hold", {"hold", "category1", "category0"});
  if (on_lost == "category1") remote.on_lost = hal::StopCategory::kCategory1;
  if (on_lost == "category0") remote.on_lost = hal::StopCategory::kCategory0;
  table.finish();
  return remote;
}

/// @param remote  its table
void check_remote(Experiment& e, TomlTable remote) {
  const bool secured = e.dds.security.on();
  if (!e.remote.trust && secured) e.remote.trust = RemoteTrust::kDomain;
  if (e.remote.command == RemoteCommand::kNetwork && !e.remote.trust) {
    remote.error("command", "\"network\", but nothing says whose commands these would be",
                 "give [dds.security] keys; or trust = \"domain\" for everybody who reaches the "
                 "domain, \"admitted\" for participants admitted on this machine");
  }
  if (e.remote.command != RemoteCommand::kLocal || e.dds.loopback_only()) return;
  remote.error("command", "\"local\", but [dds] reaches beyond this machine",
               "set interfaces = [\"lo\"] in [dds], or command = \"network\" to let every machine "
               "there command the robot");
}

LogOptions read_log(TomlTable table) {
  LogOptions log;
  log.folder = table.text_or("folder", log.folder);
  log.compression = read_choice(table, "compression", {"none", "lz4", "zstd"}, log.compression);
  table.finish();
  return log;
}

void read_controllers(TomlTable& root, std::vector<ControllerSpec>& controllers) {
  for (TomlTable& table : root.tables("controller")) {
    const std::string plugin = table.text("plugin");
    const std::string name = table.text_or("name", std::filesystem::path(plugin).stem().string());
    for (const ControllerSpec& other : controllers) {
      if (name.empty() || other.name != name) continue;
      table.error("name", "two controllers are called '" + name + "'", "rename one of them");
    }
    if (const std::string problem = shown_name_problem(name); !plugin.empty() && !problem.empty()) {
      table.error("name", "the controller's name " + problem, "give it another name");
    }
    const bool active = table.boolean_or("active", true);
    controllers.push_back({plugin, name, active, table.table_or_empty("parameters")});
    table.finish();
  }
  if (controllers.empty() && !root.has("controller")) {
    root.error("controller", "there is no controller",
               "add [[controller]] with plugin = \"hold\", for one");
  }
}

ReportOptions read_report(TomlTable table) {
  ReportOptions report;
  report.position_of = table.text_or("position_of", {});
  report.torque_of = table.text_or("torque_of", {});
  report.foot = table.text_or("foot", {});
  table.finish();
  return report;
}

/// @param folder  of the experiment
ParallelOptions read_parallel(TomlTable table, const std::string& file, const std::string& folder,
                              const std::string& own_robot) {
  ParallelOptions parallel;
  const std::filesystem::path robot = table.text_or("robot", {});
  parallel.robot_file = robot.empty()
                            ? own_robot
                            : (std::filesystem::path(folder) / robot).lexically_normal().string();
  TomlTable links = table.table_or_empty("link");
  parallel.robot.model.links = hal::read_links(links);
  for (hal::LinkConfig& link : parallel.robot.model.links) {
    link.file = file;
    link.key = links.path() + "." + link.name;
  }
  table.finish();
  return parallel;
}

const Names kSections{"robot",     "duration_s", "seed",       "posture",       "kernel_variant",
                      "period_ns", "sim",        "hal",        "overrun",       "clock",
                      "realtime",  "faults",     "remote",     "log",           "report",
                      "dds",       "controller", "estimation", "teleoperation", "parallel"};

/// What of the experiment can be read without its robot.
Experiment read(const TomlDocument& document, TomlTable& root) {
  Experiment e{};
  e.document = document;
  e.file = document.file();
  const bool right = root.holds_only(kSections);
  const std::filesystem::path robot = root.text("robot");
  if (!robot.empty()) {
    e.robot_file = (std::filesystem::path(document.folder()) / robot).lexically_normal().string();
  }
  e.duration_s = root.number("duration_s", {0.0, 1e6, true});
  e.seed = static_cast<std::uint64_t>(
      root.integer_or("seed", 1, 0, std::numeric_limits<std::int64_t>::max()));
  e.posture = root.text_or("posture", {});
  e.kernel_variant = root.text_or("kernel_variant", {});
  e.loop.period_ns = root.integer_or("period_ns", e.loop.period_ns, 10'000, 1'000'000'000);
  e.sim = read_sim(root.table_or_empty("sim"));
  e.hal = read_hal(root.table_or_empty("hal"), e.sim);
  read_overrun(root.table_or_empty("overrun"), e.loop);
  read_clock(root.table_or_empty("clock"), e.loop);
  e.thread = read_realtime(root);
  read_faults(root.table_or_empty("faults"), e);
  e.remote = read_remote(root.table_or_empty("remote"));
  e.teleoperation = read_teleoperation(root);
  e.log = read_log(root.table_or_empty("log"));
  e.report = read_report(root.table_or_empty("report"));
  if (root.has("parallel")) {
    e.parallel = read_parallel(root.table("parallel"), e.file, document.folder(), e.robot_file);
  }
  if (root.has("dds")) e.dds = dds::read_config(root.table("dds"), document.folder());
  check_remote(e, root.table_or_empty("remote"));
  if (right) read_controllers(root, e.controllers);  // else they may be in a table of another name
  return e;
}

std::string ns(std::int64_t value) { return std::to_string(value) + " ns"; }

/// The master's heartbeat goes out once a cycle at most; after three periods of it boards stop.
void check_heartbeats(const Experiment& e, TomlTable& root) {
  const std::int64_t period = e.loop.period_ns;
  const auto look = [&](const std::string& who, const std::string& on, int heartbeat_ms) {
    const hal::BusConfig* bus = e.robot.bus(on);
    const bool on_can = bus != nullptr && bus->kind == hal::BusKind::kCan;
    const std::int64_t least_ms = (period + 1'999'999) / 2'000'000;
    if (!on_can || heartbeat_ms >= least_ms) return true;
    root.error("period_ns",
               ns(period) + " is more than two heartbeats of " + who + " (heartbeat_ms = " +
                   std::to_string(heartbeat_ms) + "): it would count the master as lost",
               "set its heartbeat_ms to " + std::to_string(least_ms) + " or more in " +
                   e.robot.file + ", or shorten the period");
    return false;
  };
  for (const hal::BoardConfig& board : e.robot.boards) {
    if (!look("board '" + board.name + "'", board.bus, board.heartbeat_ms)) return;
  }
  for (const hal::SensorConfig& sensor : e.robot.sensors) {
    if (!look("sensor '" + sensor.name + "'", sensor.bus, sensor.heartbeat_ms)) return;
  }
}

/// One message: for the first board whose period does not fit, and how many others there are.
void check_periods(const Experiment& e, TomlTable& root) {
  const std::int64_t period = e.loop.period_ns;
  const std::int64_t step = e.sim.substep_ns;
  TomlTable sim = root.table_or_empty("sim");
  const auto name = [](auto& boards) {
    const std::ptrdiff_t others = std::ranges::distance(boards) - 1;
    return "'" + boards.front().name + "'" +
           (others == 0 ? "" : " and of " + std::to_string(others) + " more");
  };
  auto apart = e.robot.boards | std::views::filter([&](const hal::BoardConfig& board) {
                 const std::int64_t control = board.control_period_ns;
                 return period % control != 0 && control % period != 0;
               });
  if (!apart.empty()) {
    root.error("period_ns",
               ns(period) + " and the control period of board " + name(apart) + ", " +
                   ns(apart.front().control_period_ns) + ", do not divide each other",
               "make one a multiple of the other");
    return;
  }
  if (period % step != 0) {
    sim.error("substep_ns", ns(step) + " does not divide the period of " + ns(period),
              "choose a divisor of period_ns");
    return;
  }
  auto undivided = e.robot.boards | std::views::filter([&](const hal::BoardConfig& board) {
                     return board.control_period_ns % step != 0;
                   });
  if (!undivided.empty()) {
    sim.error("substep_ns",
              ns(step) + " does not divide the control period of board " + name(undivided) + ", " +
                  ns(undivided.front().control_period_ns),
              "choose a common divisor of both");
  }
}

void apply_order(const Experiment& e, hal::RobotConfig& robot, TomlTable sim) {
  if (e.sim.order < 0) return;
  for (hal::ActuatorConfig& actuator : robot.actuators) {
    actuator.order = e.sim.order;
    const std::string problem = hal::actuator_problem(actuator);
    if (problem.empty()) continue;
    sim.error("order",
              "the actuator '" + actuator.name + "' cannot be of order " +
                  std::to_string(e.sim.order) + ": " + problem,
              "complete it in " + robot.file + ", or leave the order to it");
  }
}

void remove_noise(hal::RobotConfig& robot) {
  for (hal::SensorConfig& sensor : robot.sensors) sensor.noise.clear();
  for (hal::JointConfig& joint : robot.joints) joint.torque_noise_Nm = 0.0;
}

/// Everything that needs both files.
void combine(Experiment& e, TomlTable& root) {
  check_periods(e, root);
  check_heartbeats(e, root);
  check_reference(root, "posture", e.posture, e.robot.postures, "posture");
  if (e.posture.empty() && e.robot.model.floating_base && !root.has("posture")) {
    root.error("posture", "a robot with a floating base needs a posture to start from",
               "name a [posture.NAME] of the robot");
  }
  if (e.robot.joints.empty()) {
    root.error("robot", "the robot has no [[joint]], so there is nothing to control",
               "add joints, boards and a bus to " + e.robot.file);
  }
  TomlTable report = root.table_or_empty("report");
  check_reference(report, "position_of", e.report.position_of, e.robot.joints, "joint");
  check_reference(report, "torque_of", e.report.torque_of, e.robot.joints, "joint");
  check_reference(report, "foot", e.report.foot, e.robot.sensors, "sensor");
  if (e.sim.hoist_lift_m > 0.0 && !e.robot.model.floating_base) {
    root.table("sim").table("hoist").error("lift_m", "a fixed base cannot be lifted",
                                           "leave it out");
  }
  if (root.has("estimation")) e.estimation = read_estimation(root.table("estimation"), e.robot);
  apply_order(e, e.robot, root.table_or_empty("sim"));
  if (!e.sim.noise) remove_noise(e.robot);
}

/// The second robot: its files, against the first.
void add_parallel(Experiment& e, TomlTable& root, Diagnostics& errors) {
  if (!e.parallel) return;
  ParallelOptions& parallel = *e.parallel;
  TomlTable table = root.table("parallel");
  std::error_code ignored;
  if (table.has("robot") && !std::filesystem::is_regular_file(parallel.robot_file, ignored)) {
    table.error("robot", "there is no file " + parallel.robot_file,
                "give the path of a robot's TOML, from the experiment's folder");
    return;
  }
  auto read = read_robot(parallel.robot_file);
  if (!read) {
    errors.insert(errors.end(), read.error().begin(), read.error().end());
    return;
  }
  std::vector<hal::LinkConfig> links = std::move(parallel.robot.model.links);
  parallel.robot = std::move(read->config);
  std::vector<hal::LinkConfig>& described = parallel.robot.model.links;
  for (hal::LinkConfig& link : links) {
    std::erase_if(described, [&](const hal::LinkConfig& one) { return one.name == link.name; });
    described.push_back(std::move(link));
  }
  if (const std::string other = layout_difference(e.robot, parallel.robot); !other.empty()) {
    table.error("robot", "the parallel robot has another layout: " + other,
                "it gets the commands of the first: give both the same joints, sensors and feet, "
                "in the same order");
    return;
  }
  check_reference(root, "posture", e.posture, parallel.robot.postures,
                  "posture in " + parallel.robot_file);
  apply_order(e, parallel.robot, root.table_or_empty("sim"));
  if (!e.sim.noise) remove_noise(parallel.robot);
}

}  // namespace

std::uint64_t Experiment::cycles() const {
  return static_cast<std::uint64_t>(
      std::llround(duration_s * 1e9 / static_cast<double>(loop.period_ns)));
}

std::uint64_t Experiment::settle_cycles() const {
  return static_cast<std::uint64_t>(
      std::ceil(hal.settle_s * 1e9 / static_cast<double>(loop.period_ns)));
}

FallLimits Experiment::fall_limits() const {
  const hal::PostureConfig* start = robot.posture(posture);
  FallLimits limits;
  if (start == nullptr || !robot.model.floating_base || robot.contact.feet.empty()) return limits;
  limits.watched = falls_are_faults;
  limits.ground_m = robot.contact.height_m;
  limits.standing_m = limits.highest_m = start->base_height_m - limits.ground_m;
  if (tree == nullptr) return limits;
  if (const auto touching = standing(robot, *start, *tree)) {
    limits.standing_m = touching->base_height_m - limits.ground_m;
    limits.highest_m = std::max(limits.highest_m, limits.standing_m);
  }
  return limits;
}

sim::SimRobotConfig Experiment::sim_robot_config() const {
  return {.period_ns = loop.period_ns,
          .engine = sim.engine,
          .integrator = sim.integrator,
          .substep_ns = sim.substep_ns,
          .posture = posture,
          .hold = sim.hoist,
          .release_ns = std::llround(sim.hoist_release_s * 1e9),
          .lift_m = sim.hoist_lift_m,
          .seed = seed,
          .truth = sim.ground_truth,
          .bus_timing = sim.bus_timing,
          .bus_latency_ns = sim.bus_latency_ns,
          .answer_window_ns = std::llround(hal.answer_window * static_cast<double>(loop.period_ns)),
          .tree = tree};
}

std::expected<Experiment, Diagnostics> read_experiment(const std::string& file) {
  const auto document = TomlDocument::load(file);
  if (!document) return std::unexpected(Diagnostics{document.error()});
  TomlTable root = document->root();
  Experiment e = read(*document, root);
  Diagnostics robot_errors;
  if (!e.robot_file.empty()) {
    if (auto robot = read_robot(e.robot_file)) {
      e.robot = std::move(robot->config);
      e.warnings = std::move(robot->description.warnings);
      e.tree = std::make_shared<const model::Tree>(std::move(robot->description.tree));
      combine(e, root);
      add_parallel(e, root, robot_errors);
    } else {
      robot_errors = robot.error();
      Error& first = robot_errors.front();
      if (first.file == e.robot_file && first.line == 0 && first.key.empty()) {  // not even read
        first.hint += "; it is the robot of " + file + ":" + std::to_string(root.line("robot"));
      }
    }
  }
  Diagnostics errors = document->diagnostics();
  sort_by_line(errors);
  errors.insert(errors.end(), robot_errors.begin(), robot_errors.end());
  if (!errors.empty()) return std::unexpected(errors);
  return e;
}

std::expected<Experiment, Diagnostics> parse_experiment(std::string_view text,
                                                        const std::string& file,
                                                        const hal::RobotConfig& robot) {
  const auto document = TomlDocument::parse(text, file);
  if (!document) return std::unexpected(Diagnostics{document.error()});
  TomlTable root = document->root();
  Experiment e = read(*document, root);
  e.robot = robot;
  combine(e, root);
  Diagnostics errors = document->diagnostics();
  sort_by_line(errors);
  if (!errors.empty()) return std::unexpected(std::move(errors));
  return e;
}

}  // namespace tandem::runtime
