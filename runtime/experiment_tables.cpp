// Table by table, each with its ranges and defaults.
#include "runtime/experiment_tables.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>

#include "base/file_name.hpp"
#include "rt/clock_control.hpp"

namespace tandem::runtime {
namespace {

using Names = std::vector<std::string>;

template <class Enum>
Enum read_choice(TomlTable& table, const char* key, const Names& names, Enum value) {
  const std::string& name = names[static_cast<std::size_t>(value)];
  const auto found = std::ranges::find(names, table.choice_or(key, name, names));
  return static_cast<Enum>(found - names.begin());
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
    if (const std::string problem = listed_name_problem(name);
        !plugin.empty() && !problem.empty()) {
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

}  // namespace

Experiment read_tables(const TomlDocument& document, TomlTable& root) {
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

}  // namespace tandem::runtime
