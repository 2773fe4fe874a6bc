// Table by table, each with its ranges and defaults.
#include "runtime/experiment_tables.hpp"

#include <algorithm>
#include <filesystem>
#include <map>

#include "base/file_name.hpp"
#include "base/nearest.hpp"
#include "base/quoting.hpp"
#include "hal/estimate.hpp"
#include "hal/truth.hpp"
#include "rt/clock_control.hpp"
#include "runtime/event_rows.hpp"
#include "runtime/expectation_rows.hpp"
#include "runtime/plant_options.hpp"

namespace tandem::runtime {
namespace {

/// The row of a duration that may be "endless".
constexpr Key<Experiment> or_endless(Key<Experiment> row) {
  row.read = [](TomlTable& table, const KeyFacts& key, Experiment& e) {
    if (!table.is_text(key.name)) return read_key(table, key, e.duration_s);
    e.duration_s = kEndless_s;
    const std::string word = table.text(key.name);
    if (word == "endless") return;
    table.error(key.name, "'" + word + "' is neither a number of seconds nor \"endless\"",
                "write duration_s = 10.0, or \"endless\" for a run until it is stopped");
  };
  return row;
}

// A key a line.
// clang-format off
constexpr Key<Experiment> kRoot[] = {
  required(key<&Experiment::robot_file>("robot", "path of the robot.toml")),
  or_endless(required(key<&Experiment::duration_s>("duration_s", {0.0, 1e6, true}, "running time of the controllers, after the drives' bring-up; `\"endless\"`: until the run is stopped, or its controllers are done. `--duration` overrides it").within("> 0 to 1000000, or `\"endless\"`"))),
  key<&Experiment::seed>("seed", {0.0, 9.3e18}, "of every random generator. `--seed` overrides it"),
  key<&Experiment::posture>("posture", "where the simulated robot starts; required for a floating base").by_default("every joint at 0").within("a `[posture]` of the robot"),
  key<&Experiment::kernel_variant>("kernel_variant", "of the dynamics' library. `--kernel-variant` overrides it").by_default("the best that the CPU supports"),
};
constexpr Key<rt::CyclicLoopConfig> kPeriod[] = {
  key<&rt::CyclicLoopConfig::period_ns>("period_ns", {10'000, 1e9}, "of the loop; it and each board's `control_period_ns` divide one another, and drives of other makers can be set to it ([drives.md](drives.md#what-the-master-does-with-a-sheet))"),
};
constexpr Key<ControllerSpec> kController[] = {
  required(key<&ControllerSpec::plugin>("plugin", "a bundled controller (`\"hold\"`, `\"squat\"`, …), or the path of a shared library, with a `/`: `\"./my.so\"` is beside this file")),
  key<&ControllerSpec::name>("name", "unique; 1 to 64 letters, digits and `_`, no digit first: it names topics").by_default("the plugin's"),
  key<&ControllerSpec::active>("active", "`false`: it is loaded and checked, and waits for `tandem controller start`. Only active ones may not claim the same joint"),
  by_hand<ControllerSpec>("parameters", "–", "table", "the controller's own: [controllers.md](controllers.md); an unknown key is an error"),
  by_hand<ControllerSpec>("inputs", "–", "tables", "`inputs.NAME`: who feeds an input of the controller; without one `tandem input` does"),
};
constexpr Key<HalOptions> kHal[] = {
  key<&HalOptions::lockstep>("lockstep", "`\"can\"`: wait for an emulated robot's answers without a time limit, at any speed; `\"dds\"`: the same for a server in lockstep"),
  key<&HalOptions::delay_cycles>("delay_cycles", {0, 1000}, "the references reach the limits this many cycles later; until the first every joint is held. `--delay-cycles` overrides it; `tandem serve` has none"),
  key<&HalOptions::answer_window>("answer_window", {0.05, 0.95}, "`\"can\"` in real time, and `sim.bus_timing`: share of the period in which answers are awaited"),
  key<&HalOptions::settle_s>("settle_s", {0.0, 600.0}, "every joint is held in place from the moment all drives are enabled until the controllers start").by_default("`hoist.release_s`, 0 without a hoist"),
  by_hand<HalOptions>("backend", "`\"sim\"`", "`\"sim\"`, `\"can\"`, `\"ethercat\"`, `\"dds\"`", "the robot in this process, boards on their buses (`\"can\"` and `\"ethercat\"` mean the same; refused for a robot without such a bus), or a robot of another process ([remote.md](remote.md)). `--hal` overrides it"),
};
constexpr Key<SimOptions> kSim[] = {
  choice<&SimOptions::engine>("engine", sim::kEngineChoices, "who moves the bodies and carries the soles: [simulation.md](simulation.md#engines-of-others). Others have to be installed, and may refuse the robot by name"),
  choice<&SimOptions::integrator>("integrator", "leapfrog|rk4", "of the plant; of another engine its usual one, or its own `rk4` if it has one"),
  key<&SimOptions::substep_ns>("substep_ns", {1e3, 1e8}, "step of the integrator; divides the period and every control period"),
  key<&SimOptions::order>("order", {0, 3}, "of every actuator; a change between {0, 1} and {2, 3} needs kernels made for it: a rigid joint carries its rotor").by_default("as robot.toml says"),
  key<&SimOptions::noise>("noise", "`false`: no sensor has noise"),
  key<&SimOptions::ground_truth>("ground_truth", "log the plant's true state beside the measured one"),
  key<&SimOptions::bus_timing>("bus_timing", "frames take their time on a real bus, by identifier and bit rate ([wire.md](wire.md#bus-timing)); `false`: they arrive at once"),
  key<&SimOptions::bus_latency_ns>("bus_latency_ns", {0, 1e7}, "with `bus_timing`: delay in every node's driver or firmware, before a frame takes part in the arbitration"),
};
constexpr Key<SimOptions> kHoist[] = {
  key<&SimOptions::hoist>("enabled", "base and joints are held until every drive is enabled"),
  key<&SimOptions::hoist_release_s>("release_s", {0.0, 60.0}, "the hoist's force fades to zero over this time: a robot that stands is loaded gently, one that hangs drops"),
  key<&SimOptions::hoist_lift_m>("lift_m", {0.0, 10.0}, "more than 0, of a floating base: it hangs so much higher than its posture says, and is never lowered; on a real robot: the hoist stays ([identification.md](identification.md))"),
};
constexpr Key<rt::CyclicLoopConfig> kOverrun[] = {
  choice<&rt::CyclicLoopConfig::on_overrun>("policy", "skip|hold|stop", "after a late cycle: continue at the next grid point; repeat the last command once; stop after `n` late cycles of the last `m`"),
  key<&rt::CyclicLoopConfig::stop_late>("n", {1, 64}, "n ≤ m"),
  key<&rt::CyclicLoopConfig::stop_window>("m", {1, 64}, "cycles"),
};
constexpr Key<rt::CyclicLoopConfig> kClock[] = {
  key<&rt::CyclicLoopConfig::rate>("rate", {0.0, rt::kFastest}, "simulated seconds per wall second; 0 is as fast as possible. `--rate` and `--realtime` override it, `tandem clock rate` changes it").within("0, or 0.01 to 1000"),
  key<&rt::CyclicLoopConfig::start_paused>("start_paused", "pause before the first cycle until `tandem clock step` or `resume`, as `--start-paused` does"),
};
constexpr Key<rt::ThreadConfig> kRealtime[] = {
  choice<&rt::ThreadConfig::policy>("policy", "other|fifo|rr", "scheduling policy"),
  key<&rt::ThreadConfig::priority>("priority", {1, 99}, "of `\"fifo\"` and `\"rr\"`"),
  key<&rt::ThreadConfig::cpu>("cpu", {0, 1023}, "the only CPU to run on").by_default("any"),
  key<&rt::ThreadConfig::lock_memory>("lock_memory", "lock all memory"),
};
constexpr Key<Experiment> kFaults[] = {
  choice<&Experiment::after_stop>("after_stop", "end|wait", "after a stop of category 0 or 1: end the run with exit status 1, or wait for `tandem fault reset`; `run --on-fault` overrides it: [safety.md](safety.md)").by_default("`\"wait\"` with boards on a bus in real time, `\"end\"` in simulation, with `--realtime`, too"),
  choice<&Experiment::after_reset>("after_reset", "hold|continue", "after `tandem fault reset`: hold every joint until `tandem controller start`, or let the controllers continue: [safety.md](safety.md#the-reset)"),
  choice<&Experiment::on_stray>("stray_writes", "category0|category1|category2|hold|warn", "reaction to a controller that writes to a joint, or a mode, that it has not claimed; the write is reverted in the same cycle and reported once ([controllers.md](controllers.md#claims))"),
  key<&Experiment::retreat_s>("retreat_s", {0.1, 60.0}, "the longest time of a retreat, in a stop of category 2; then the drives stop ([safety.md](safety.md#category-2-a-safe-posture-first))"),
  choice<&Experiment::falls_are_faults>("fall", "allow|stop", "a fall of a simulated robot is a fault of category 1, or allowed ([safety.md](safety.md#a-fall))"),
  key<&Experiment::watchdog_s>("watchdog_s", {0.05, 3600.0}, "a loop that does not finish a cycle for this time hangs: emergency stop, and the end of the process ([safety.md](safety.md#a-loop-that-hangs))").by_default("0.5 on the wall clock, 5 in simulated time"),
};
constexpr Key<RemoteOptions> kRemote[] = {
  choice<&RemoteOptions::command>("command", "off|local|network", "`\"off\"`: others may look and stop the robot, no more; `\"local\"`: change as well, which needs `dds.interfaces = [\"lo\"]`; `\"network\"`: from wherever `[dds]` reaches").by_default("`\"off\"`"),
  choice<&RemoteOptions::trust>("trust", "admitted|domain", "whose changes are accepted: those of participants that this user or root has admitted over the control socket, or everybody's in the domain. `\"network\"` without `[dds.security]` has no default: [security.md](security.md)").by_default("`\"domain\"` with `[dds.security]`, else `\"admitted\"`"),
  key<&RemoteOptions::load>("load", "controllers may be loaded over DDS as well, by the names of this process' own, never by path"),
  key<&RemoteOptions::lockstep>("lockstep", "each cycle waits for its owner's command; simulated time only. `tandem serve --lockstep`"),
  key<&RemoteOptions::lease_timeout_s>("lease_timeout_s", {0.05, 60.0}, "an owner that is silent for this time has lost the robot"),
  key<&RemoteOptions::lockstep_timeout_s>("lockstep_timeout_s", {0.05, 3600.0}, "in lockstep: longest time that a cycle waits for the command of a live owner"),
  key<&RemoteOptions::max_age_cycles>("max_age_cycles", {1, 1e5}, "in real time: a command that answers an older cycle is rejected, and an owner without a younger one has lost the robot. With `[teleoperation]` at least the way there and back, play-out and `lease_timeout_s`"),
  // A robot that is held goes on: nothing is stopped.
  choice<&RemoteOptions::on_lost>("on_lost", "category0|category1|||hold", "reaction to a lost owner: every joint brakes, stays where it comes to rest, and the next owner may come; or the stop of that category, latched"),
};
constexpr Key<LogConfig> kLog[] = {
  key<&LogConfig::folder>("folder", "relative to the folder in which the command was started; `--log` overrides it"),
  choice<&LogConfig::compression>("compression", "none|lz4|zstd", "of the MCAP file's chunks"),
  key<&LogConfig::state_every>("state_every", {0, 1e6}, "`/tandem/state` has the cycles whose number is a multiple; 0: no such topic ([log.md](log.md#what-is-kept))"),
  key<&LogConfig::command_every>("command_every", {0, 1e6}, "the same of `/tandem/command`"),
  key<&LogConfig::truth_every>("truth_every", {0, 1e6}, "the same of `/tandem/truth`"),
  key<&LogConfig::estimate_every>("estimate_every", {0, 1e6}, "the same of `/tandem/estimate`"),
  key<&LogConfig::without>("without", "fields that are left out, as topic and field: `[\"state.acceleration_rad_s2\"]`. `tandem log info FILE --topic state` lists them").by_default("none").within("list of texts"),
  key<&LogConfig::viewers>("viewers", "`false`: nothing for ROS viewers: no `/joint_states`, `/tf`, `/tf_static`, `/robot_description`"),
  key<&LogConfig::file_MB>("file_MB", {4, 1e6}, "when the messages of a file need about so much, the next file begins ([log.md](log.md#several-files))").by_default("one file"),
  key<&LogConfig::file_s>("file_s", {1, 1e7}, "when a file has about so much log time, the next file begins").by_default("one file"),
  key<&LogConfig::total_MB>("total_MB", {8, 1e7}, "of all files: the oldest are removed, but for those of a fault. At least twice `file_MB`").by_default("no limit"),
  key<&LogConfig::total_s>("total_s", {2, 1e9}, "a file whose end is so much log time ago is removed, but for those of a fault. At least twice `file_s`, and `keep_before_fault_s`").by_default("no limit"),
  key<&LogConfig::keep_before_fault_s>("keep_before_fault_s", {0, 86400}, "log time before a fault that stops the robot, whose files `total_MB`, `total_s` and `keep_free_MB` never remove; 0: they do"),
  key<&LogConfig::keep_free_MB>("keep_free_MB", {1, 1e9}, "before the disk has less: with `total_MB` or `total_s` the oldest files are removed, else logging ends with a warning").by_default("no limit"),
  key<&LogConfig::keep_free_share>("keep_free_share", {0.001, 0.95}, "the same as a share of the disk: 0.05 is a twentieth. The larger of both counts").by_default("no limit"),
  choice<&LogConfig::budget>("budget", "run|experiment", "whose files count and go: this run's, or also those of all runs before of this robot and experiment in the folder, so that a service that was started again keeps to the same limits"),
};
constexpr Key<ReportConfig> kReport[] = {
  key<&ReportConfig::position_of>("position_of", "joint: position with reference").by_default("[chosen by the report](log.md#the-report)"),
  key<&ReportConfig::torque_of>("torque_of", "joint: torque beside inverse dynamics").by_default("chosen by the report"),
  key<&ReportConfig::foot>("foot", "force/torque sensor: vertical force").by_default("chosen by the report"),
};
constexpr Key<ParallelOptions> kParallel[] = {
  key<&ParallelOptions::robot_file>("robot", "its robot.toml: the same joints, sensors, feet, closed loops and passive joints in the same order; all else may differ. `[sim]`, `posture` and `seed` are for both, but `sim.link`, `sim.joint` and `sim.payload`").by_default("the experiment's"),
  by_hand<ParallelOptions>("link", "–", "table", "`link.NAME`: as [`[model.link.NAME]`](#modellinkname-mass-and-inertia-instead-of-the-urdfs), in place of its robot.toml's"),
};
// clang-format on

/// @param sim  says how long the hoist needs, which is the default of settle_s
HalOptions read_hal(TomlTable table, const SimOptions& sim) {
  HalOptions hal{.settle_s = sim.hoist ? sim.hoist_release_s : 0.0};
  const std::string backend = table.choice_or("backend", "sim", {"sim", "can", "ethercat", "dds"});
  if (backend == "dds") hal.backend = BackendKind::kDds;
  if (backend == "can" || backend == "ethercat") {
    hal.backend = BackendKind::kWire;
    hal.wire = backend;
  }
  read_whole(table, kHal, hal);
  return hal;
}

SimOptions read_sim(TomlTable table) {
  SimOptions sim;
  constexpr char kFormer[] = "semi_implicit";
  if (table.is_text("integrator") && table.text_or("integrator", {}) == kFormer) {
    table.error("integrator", "'" + std::string(kFormer) + "' is not one of the choices",
                "leave it out: the leapfrog has replaced it, in the same sub-steps");
  }
  read_keys(table, kSim, sim);
  TomlTable hoist = table.table_or_empty("hoist");
  read_keys(hoist, kHoist, sim);
  if (sim.hoist_lift_m > 0.0 && !sim.hoist)
    hoist.error("lift_m", "without a hoist nothing lifts the base", "leave out enabled = false");
  hoist.finish();
  leave_plant_changes(table);
  table.finish();
  return sim;
}

void read_overrun(TomlTable table, rt::CyclicLoopConfig& loop) {
  read_whole(table, kOverrun, loop);
  if (loop.stop_late > loop.stop_window) {
    table.error("n", "is more than m", "the policy stops after n late cycles of the last m");
  }
}

void read_clock(TomlTable table, rt::CyclicLoopConfig& loop) {
  read_whole(table, kClock, loop);
  if (const Status right = rt::check_rate(loop.rate); !right) {
    table.error("rate", right.error().message, right.error().hint);
  }
}

rt::ThreadConfig read_realtime(TomlTable& root) {
  rt::ThreadConfig thread;
  if (root.has("realtime")) {
    read_whole(root.table("realtime"), kRealtime, thread);
  } else {
    thread.policy = rt::SchedulingPolicy::kOther;
    thread.lock_memory = false;
  }
  return thread;
}

/// @param remote  its table
void check_remote(Experiment& e, TomlTable remote) {
  const bool secured = e.dds.security.on();
  if (!e.remote.trust && secured) e.remote.trust = RemoteTrust::kDomain;
  if (e.remote.command == RemoteAccess::kNetwork && !e.remote.trust) {
    remote.error("command", "\"network\", but nothing says whose commands these would be",
                 "give [dds.security] keys; or trust = \"domain\" for everybody who reaches the "
                 "domain, \"admitted\" for participants admitted on this machine");
  }
  if (e.remote.command != RemoteAccess::kLocal || e.dds.loopback_only()) return;
  remote.error("command", "\"local\", but [dds] reaches beyond this machine",
               "set interfaces = [\"lo\"] in [dds], or command = \"network\" to let every machine "
               "there command the robot");
}

/// What is wrong with an entry of `without`, and what to do; nothing: it names a field.
std::optional<std::pair<std::string, std::string>> unknown_field(const std::string& entry) {
  const hal::StateImage state({});
  const hal::CommandImage command({});
  const hal::TruthImage truth(0, 0);
  const hal::EstimateImage estimate({});
  const std::map<std::string, const hal::Layout*> topics{{"state", &state.layout()},
                                                         {"command", &command.layout()},
                                                         {"truth", &truth.layout()},
                                                         {"estimate", &estimate.layout()}};
  const std::size_t dot = std::min(entry.find('.'), entry.size());
  const std::string topic = entry.substr(0, dot),
                    name = entry.substr(std::min(dot + 1, entry.size()));
  const auto found = topics.find(topic);
  if (found == topics.end()) {
    return std::pair(
        "'" + entry + "' begins with no topic of images",
        suggest(topic, std::vector<std::string>{"state", "command", "truth", "estimate"}));
  }
  if (name == "cycle" || name == "time_ns")
    return std::pair("'" + entry + "' cannot be left out", "it tells a message's cycle");
  if (found->second->find(name) != nullptr) return std::nullopt;
  std::vector<std::string> names;
  for (const hal::Field& field : found->second->fields()) names.push_back(field.name);
  return std::pair("the topic '" + topic + "' has no field '" + name + "'", suggest(name, names));
}

LogConfig read_log(TomlTable table) {
  LogConfig log;
  read_keys(table, kLog, log);
  for (const std::string& entry : log.without) {
    if (const auto wrong = unknown_field(entry))
      table.error("without", wrong->first, wrong->second);
  }
  const bool several = table.has("file_MB") || table.has("file_s");
  if (table.has("total_MB") && log.total_MB < 2.0 * log.file_MB) {
    table.error("total_MB", "is less than two files of file_MB",
                "the file that is being written and one before it stay");
  } else if (table.has("total_MB") && !table.has("file_MB")) {
    table.error("total_MB", "without file_MB there is one file, which cannot be shortened",
                "set file_MB, at most half of it");
  }
  if (table.has("total_s") && log.total_s < 2.0 * log.file_s) {
    table.error("total_s", "is less than two files of file_s",
                "the file that is being written and one before it stay");
  } else if (table.has("total_s") && !several) {
    table.error("total_s", "without file_s or file_MB there is one file, which cannot be shortened",
                "set file_s, at most half of it");
  } else if (table.has("total_s") && log.total_s < log.keep_before_fault_s) {
    table.error("total_s", "is less than keep_before_fault_s",
                "when a fault comes, what was before it has to be there still");
  }
  if (log.budget == LogBudget::kExperiment && !table.has("total_MB") && !table.has("total_s")) {
    table.error("budget", "without total_MB and total_s nothing is removed",
                "set one of them, or leave budget out");
  }
  table.finish();
  return log;
}

void read_controllers(TomlTable& root, std::vector<ControllerSpec>& controllers) {
  for (TomlTable& table : root.tables("controller", "plugin")) {
    ControllerSpec one{
        .plugin = {}, .name = {}, .active = true, .parameters = table.table_or_empty("parameters")};
    read_keys(table, kController, one);
    one.inputs = read_input_sources(table);
    if (!table.has("name")) one.name = std::filesystem::path(one.plugin).stem().string();
    const std::string& name = one.name;
    for (const ControllerSpec& other : controllers) {
      if (name.empty() || other.name != name) continue;
      table.error("name", "two controllers are called '" + name + "'", "rename one of them");
    }
    if (const std::string problem = topic_name_problem(name);
        !one.plugin.empty() && !problem.empty()) {
      table.error("name", "the controller's name '" + shown(name) + "' " + problem,
                  topic_name_hint(name));
    }
    table.finish();
    controllers.push_back(std::move(one));
  }
  if (controllers.empty() && !root.has("controller")) {
    root.error("controller", "there is no controller",
               "add [[controller]] with plugin = \"hold\", for one");
  }
}

/// @param folder  of the experiment
ParallelOptions read_parallel(TomlTable table, const std::string& file, const std::string& folder,
                              const std::string& own_robot) {
  ParallelOptions parallel;
  read_keys(table, kParallel, parallel);
  std::string& robot = parallel.robot_file;
  robot = robot.empty() ? own_robot
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

const std::vector<std::string> kSections{
    "robot",         "duration_s", "seed",    "posture", "kernel_variant", "period_ns",
    "sim",           "hal",        "overrun", "clock",   "realtime",       "faults",
    "remote",        "log",        "report",  "dds",     "controller",     "estimation",
    "teleoperation", "parallel",   "expect",  "fault",   "push",           "event"};

}  // namespace

Experiment read_tables(const TomlDocument& document, TomlTable& root) {
  Experiment e{};
  e.document = document;
  e.file = document.file();
  const bool right = root.holds_only(kSections);
  read_keys(root, kRoot, e);
  read_keys(root, kPeriod, e.loop);
  if (!e.robot_file.empty()) {
    const std::filesystem::path folder = document.folder();
    e.robot_file = (folder / e.robot_file).lexically_normal().string();
  }
  e.sim = read_sim(root.table_or_empty("sim"));
  e.hal = read_hal(root.table_or_empty("hal"), e.sim);
  read_overrun(root.table_or_empty("overrun"), e.loop);
  read_clock(root.table_or_empty("clock"), e.loop);
  e.thread = read_realtime(root);
  read_whole(root.table_or_empty("faults"), kFaults, e);
  read_whole(root.table_or_empty("remote"), kRemote, e.remote);
  e.teleoperation = read_teleoperation(root);
  e.log = read_log(root.table_or_empty("log"));
  read_whole(root.table_or_empty("report"), kReport, e.report);
  if (root.has("parallel")) {
    e.parallel = read_parallel(root.table("parallel"), e.file, document.folder(), e.robot_file);
  }
  if (root.has("dds")) e.dds = dds::read_config(root.table("dds"), document.folder());
  check_remote(e, root.table_or_empty("remote"));
  e.expectations = read_expectations(root);
  if (right) read_controllers(root, e.controllers);  // else they may be in a table of another name
  return e;
}

void describe_experiment(KeyPage& page) {
  page.add("experiment.toml", kRoot);
  page.add("experiment.toml", kPeriod);
  const TomlTable none = TomlDocument::parse({}, {})->root();
  page.add("[[controller]]", kController, {}, {{}, {}, true, none});
  describe_inputs(page);
  page.add("[hal]", kHal);
  page.add("[sim]", kSim);
  page.add("[sim]", kHoist, "hoist.");
  describe_plant_changes(page);
  page.add("[overrun]", kOverrun);
  page.add("[clock]", kClock);
  page.add("[faults]", kFaults);
  page.add("[remote]", kRemote);
  page.add("[realtime]", kRealtime);
  page.add("[log]", kLog);
  page.add("[report]", kReport);
  page.add("[parallel]", kParallel);
  describe_expectations(page);
  describe_events(page);
}

}  // namespace tandem::runtime
