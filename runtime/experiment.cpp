#include "runtime/experiment.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <ranges>

#include "base/nearest.hpp"
#include "robot/posture.hpp"
#include "runtime/estimation_options.hpp"
#include "runtime/event_rows.hpp"
#include "runtime/experiment_tables.hpp"
#include "runtime/plant_options.hpp"
#include "runtime/robot_layout.hpp"

namespace tandem::runtime {
namespace {

template <class T>
void check_reference(TomlTable& table, const char* key, const std::string& name,
                     const std::vector<T>& items, const std::string& kind) {
  std::vector<std::string> known;
  for (const T& item : items) known.push_back(item.name);
  if (name.empty() || std::ranges::find(known, name) != known.end()) return;
  table.error(key, "the robot has no " + kind + " '" + name + "'", suggest(name, known));
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
  for (const auto& [key, joint] : {std::pair{"position_of", e.report.position_of},
                                   std::pair{"torque_of", e.report.torque_of}}) {
    if (joint.empty() || e.robot.joint_index(joint) >= 0) continue;
    const Error none = e.robot.no_joint(joint);
    report.error(key, none.message, none.hint);
  }
  check_reference(report, "foot", e.report.foot, e.robot.sensors, "sensor");
  if (e.sim.hoist_lift_m > 0.0 && !e.robot.model.floating_base) {
    root.table("sim").table("hoist").error("lift_m", "a fixed base cannot be lifted",
                                           "leave it out");
  }
  if (root.has("estimation")) e.estimation = read_estimation(root.table("estimation"), e.robot);
  apply_order(e, e.robot, root.table_or_empty("sim"));
  if (!e.sim.noise) remove_noise(e.robot);
  e.plant = read_plant_changes(root.table_or_empty("sim"), e.robot, e.description.get(), e.files);
  read_events(root, e);
}

/// The second robot: its files, against the first.
void add_parallel(Experiment& e, TomlTable& root, const std::vector<TomlSetting>& settings,
                  Diagnostics& errors) {
  if (!e.parallel) return;
  ParallelOptions& parallel = *e.parallel;
  TomlTable table = root.table("parallel");
  std::error_code ignored;
  if (table.has("robot") && !std::filesystem::is_regular_file(parallel.robot_file, ignored)) {
    table.error("robot", "there is no file " + parallel.robot_file,
                "give the path of a robot's TOML, from the experiment's folder");
    return;
  }
  const bool same = parallel.robot_file == e.robot_file;
  auto read = robot::read_complete_robot(parallel.robot_file, false,
                                         same ? settings : std::vector<TomlSetting>());
  if (!read) {
    errors.insert(errors.end(), read.error().begin(), read.error().end());
    return;
  }
  for (auto& one : read->files) e.files.push_back(std::move(one));
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

std::shared_ptr<const model::Tree> Experiment::tree() const {
  return description == nullptr
             ? nullptr
             : std::shared_ptr<const model::Tree>(description, &description->tree);
}

std::uint64_t Experiment::cycles() const {
  if (endless()) return 0;
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
  if (plant != nullptr) limits.terrain = plant->robot.contact.terrain;
  limits.standing_m = limits.highest_m = start->base_height_m - limits.ground_m;
  if (description == nullptr) return limits;
  if (const auto touching = robot::standing(robot, *start, description->tree)) {
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
          .tree = tree(),
          .changes = plant};
}

std::expected<Experiment, Diagnostics> read_experiment(const std::string& file,
                                                       std::vector<TomlSetting> settings) {
  const std::vector<TomlSetting> of_robot = take_below("robot", settings);
  const auto document = TomlDocument::load(file, hal::kRobotOfXml, settings);
  if (!document) return std::unexpected(Diagnostics{document.error()});
  TomlTable root = document->root();
  if (root.has("experiment") && !root.has("robot")) {
    return std::unexpected(Diagnostics{{.message = "is a study, and no experiment",
                                        .hint = "`tandem sweep` it, or `tandem search` in it",
                                        .file = file,
                                        .key = {}}});
  }
  Experiment e = read_tables(*document, root);
  e.files = {{file, document->text()}};
  Diagnostics robot_errors;
  if (!e.robot_file.empty()) {
    if (auto robot = robot::read_complete_robot(e.robot_file, false, of_robot)) {
      e.robot = std::move(robot->config);
      for (auto& one : robot->files) e.files.push_back(std::move(one));
      e.description = std::make_shared<const model::UrdfModel>(std::move(robot->description));
      combine(e, root);
      add_parallel(e, root, of_robot, robot_errors);
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
  Experiment e = read_tables(*document, root);
  e.files = {{file, document->text()}};
  e.robot = robot;
  combine(e, root);
  Diagnostics errors = document->diagnostics();
  sort_by_line(errors);
  if (!errors.empty()) return std::unexpected(std::move(errors));
  return e;
}

}  // namespace tandem::runtime
