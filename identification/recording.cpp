// From a log's columns to a grid without what lies. A sample that cannot be used is a NaN, so that
// no other bookkeeping is needed: filters carry it on.
#include "identification/recording.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <ranges>

#include "base/bounds.hpp"
#include "base/counted.hpp"
#include "base/nearest.hpp"
#include "base/toml_reader.hpp"
#include "log/log_file.hpp"
#include "log/run_window.hpp"

namespace tandem::identification {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kState = "/tandem/state";
constexpr const char* kCommand = "/tandem/command";
constexpr double kLongestGap_s = 600.0;

std::unexpected<Error> bad_log(const std::string& path, std::string message, std::string hint) {
  return std::unexpected(Error{std::move(message), std::move(hint), path, 0, {}});
}

/// Where the robot's joint or sensor stands in the log. Errors: they are not the same ones.
template <class Names>
Result<std::vector<std::size_t>> order_of(const std::string& path, const char* what,
                                          const std::vector<std::string>& wanted,
                                          const Names& logged) {
  std::vector<std::size_t> order;
  for (const std::string& name : wanted) {
    const auto found = std::ranges::find(logged, name);
    if (found == logged.end()) {
      return bad_log(path,
                     fmt::format("this log is of another robot: it has no {} '{}'", what, name),
                     fmt::format("give --robot the robot that made it; {}", suggest(name, logged)));
    }
    order.push_back(static_cast<std::size_t>(found - logged.begin()));
  }
  if (logged.size() == wanted.size()) return order;
  for (const std::string& name : logged) {
    if (std::ranges::find(wanted, name) != wanted.end()) continue;
    return bad_log(path,
                   fmt::format("this log is of another robot: --robot has no {} '{}'", what, name),
                   "give --robot the robot that made it");
  }
  return order;
}

/// The columns of one topic by field: what a log lacks is all NaN.
class Columns {
 public:
  static Result<Columns> read(const log::LogFile& file, const std::string& topic,
                              const std::vector<std::pair<std::string, std::size_t>>& fields) {
    const log::LoggedTopic* found = file.find(topic);
    std::vector<log::Column> wanted;
    Columns columns;
    for (const auto& [field, count] : fields) {
      if (found->layout.find(field) == nullptr) continue;
      columns.first_[field] = wanted.size();
      for (std::size_t i = 0; i < count; ++i) wanted.push_back({field, i});
    }
    auto table = file.read(topic, wanted);
    if (!table) return std::unexpected(table.error());
    columns.table_ = std::move(*table);
    return columns;
  }
  [[nodiscard]] const std::vector<double>& time_s() const { return table_.time_s; }
  [[nodiscard]] bool has(const std::string& field) const { return first_.contains(field); }
  [[nodiscard]] double at(const std::string& field, std::size_t index, std::size_t row) const {
    const auto found = first_.find(field);
    return found == first_.end() ? kMissing : table_.columns[found->second + index][row];
  }

 private:
  log::TimeSeries table_;
  std::map<std::string, std::size_t> first_;
};

Status check_time(const std::string& path, const std::vector<double>& time_s) {
  for (std::size_t i = 1; i < time_s.size(); ++i) {
    if (time_s[i] > time_s[i - 1]) continue;
    return bad_log(path,
                   fmt::format("time {} in sample {}: {:.6f} s after {:.6f} s",
                               time_s[i] < time_s[i - 1] ? "goes backwards" : "stands still", i,
                               time_s[i], time_s[i - 1]),
                   "the log is damaged, or two were joined: record it again, or cut it there");
  }
  return {};
}

/// Samples `first` to `last` of the log, and the grid that they go on.
struct Grid {
  std::size_t first = 0;
  std::vector<std::size_t> source;  // per grid time: the sample at or before it
  std::vector<double> time_s;
  double period_s = 0.0;
};

Result<Grid> make_grid(const std::string& path, const std::vector<double>& time_s, double begin_s,
                       double end_s, double period_s) {
  const auto first = std::ranges::lower_bound(time_s, begin_s) - time_s.begin();
  const auto last = std::ranges::upper_bound(time_s, end_s) - time_s.begin();
  if (last - first < 100) {
    return bad_log(
        path,
        fmt::format(
            "too short to identify anything: {} in which controllers ran",
            counted(static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, last - first)), "sample")),
        "`tandem excite` writes an experiment that moves the robot for long enough");
  }
  if (!(period_s > 0.0)) {
    std::vector<double> steps;
    for (auto i = first + 1; i < last; ++i) steps.push_back(time_s[i] - time_s[i - 1]);
    std::ranges::nth_element(steps, steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2));
    period_s = steps[steps.size() / 2];
  }
  Grid grid;
  grid.period_s = period_s;
  grid.first = static_cast<std::size_t>(first);
  const auto most = static_cast<std::size_t>(last - first) * bounds::kPeriodsPerSample.most;
  std::size_t source = grid.first;
  for (std::size_t k = 0;; ++k) {
    const double t = time_s[first] + static_cast<double>(k) * period_s;
    if (t > time_s[last - 1] + 0.01 * period_s) break;
    while (source + 1 < static_cast<std::size_t>(last) && time_s[source + 1] <= t + 0.01 * period_s)
      ++source;
    if (t - time_s[source] > kLongestGap_s) {
      return bad_log(path,
                     fmt::format("nothing was logged from {:.3f} s on for more than {} s",
                                 time_s[source], kLongestGap_s),
                     "cut the log there, and give both parts");
    }
    if (k == most) {
      return bad_log(path,
                     fmt::format("{} samples lie over more than {} periods of {:.6g} s",
                                 last - first, most, period_s),
                     "is its period_ns right? Cut it where nothing was logged");
    }
    grid.source.push_back(source);
    grid.time_s.push_back(t);
  }
  return grid;
}

/// One column on the grid; between samples that are not neighbours there is nothing.
template <class Value>
Signal on_grid(const Grid& grid, const std::vector<double>& time_s, Value value) {
  Signal out(grid.time_s.size(), kMissing);
  for (std::size_t k = 0; k < out.size(); ++k) {
    const std::size_t i = grid.source[k];
    const double since = grid.time_s[k] - time_s[i];
    const double here = value(i);
    if (std::abs(since) <= 0.01 * grid.period_s) {
      out[k] = here;
    } else if (i + 1 < time_s.size() && time_s[i + 1] - time_s[i] < 1.5 * grid.period_s) {
      out[k] = here + (value(i + 1) - here) * since / (time_s[i + 1] - time_s[i]);
    }
    if (!std::isfinite(out[k])) out[k] = kMissing;
  }
  return out;
}

constexpr int kContinuous = 64;  // steps of a hold that stand for an integrator of higher order

/// What [sim] says in the experiment that a log carries.
struct SimFacts {
  std::int64_t substep_ns = 250'000;
  bool leapfrog = true;
  bool hangs = false;
};
SimFacts sim_facts(const log::StringMap& configuration) {
  SimFacts facts;
  for (const auto& [file, text] : configuration) {
    if (!file.ends_with(".toml")) continue;
    const Result<TomlDocument> document = TomlDocument::parse(text, file);
    if (!document || !document->root().has("robot")) continue;
    TomlTable root = document->root();
    TomlTable sim = root.table_or_empty("sim");
    facts.substep_ns = sim.integer_or("substep_ns", facts.substep_ns, 1, 1'000'000'000);
    facts.leapfrog = sim.choice_or("integrator", "leapfrog", {"leapfrog", "rk4"}) == "leapfrog";
    facts.hangs = sim.table_or_empty("hoist").number_or("lift_m", 0.0) > 0.0;
    break;
  }
  return facts;
}

Status check_positions(const Recording& recording, const hal::RobotConfig& robot) {
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    if (!std::ranges::all_of(recording.position_rad[j], [](double v) { return std::isnan(v); }))
      continue;
    const std::string why = recording.remarks.empty() ? "" : " (" + recording.remarks.front() + ")";
    return bad_log(
        recording.path,
        fmt::format("the position of joint '{}' is never valid{}", robot.joints[j].name, why),
        "every joint's position is needed: repair its encoder, and record again");
  }
  return {};
}

Status check_torques(Recording& recording, const hal::RobotConfig& robot) {
  std::string names;
  std::size_t lacking = 0;
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    if (!std::ranges::all_of(recording.torque_Nm[j], [](double v) { return std::isnan(v); }))
      continue;
    ++lacking;
    names += (names.empty() ? "" : ", ") + robot.joints[j].name;
  }
  if (lacking == 0) return {};
  const bool feels = std::ranges::any_of(robot.sensors, [](const hal::SensorConfig& sensor) {
    return sensor.type == hal::SensorType::kForceTorque;
  });
  if (lacking == robot.joints.size() && !feels) {
    return bad_log(recording.path, "the log has no torque of any joint",
                   "masses and friction show in torques: record them, or import them with the "
                   "map's [torque]");
  }
  recording.remarks.push_back("the log has no torque of these joints: " + names);
  return {};
}

/// Where the log has what the robot has.
struct Order {
  std::vector<std::size_t> joints;         // per joint of the robot
  std::vector<std::size_t> sensors;        // per sensor of the robot
  std::vector<std::size_t> first_channel;  // per sensor of the log
  std::size_t channels = 0;                // of the log
};

/// Errors: joints, sensors or channels of another robot.
Result<Order> order_of(const std::string& path, const log::RunInfo& info,
                       const hal::RobotConfig& robot) {
  std::vector<std::string> joints, sensors, logged_sensors;
  for (const hal::JointConfig& joint : robot.joints) joints.push_back(joint.name);
  for (const hal::SensorConfig& sensor : robot.sensors) sensors.push_back(sensor.name);
  Order order;
  for (const log::SensorInfo& sensor : info.sensors) {
    logged_sensors.push_back(sensor.name);
    order.first_channel.push_back(order.channels);
    order.channels += sensor.channels;
  }
  auto joint_order = order_of(path, "joint", joints, info.joints);
  if (!joint_order) return std::unexpected(joint_order.error());
  order.joints = std::move(*joint_order);
  auto sensor_order = order_of(path, "sensor", sensors, logged_sensors);
  if (!sensor_order) return std::unexpected(sensor_order.error());
  order.sensors = std::move(*sensor_order);
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    if (info.sensors[order.sensors[s]].channels == robot.sensors[s].channels()) continue;
    return bad_log(
        path, "this log is of another robot: its sensor '" + sensors[s] + "' has other channels",
        "give --robot the robot that made it");
  }
  return order;
}

/// Errors: no position or torque of joints; time that is none.
Result<Columns> read_state(const std::string& path, const log::LogFile& file, const Order& order) {
  const std::size_t n = order.joints.size();
  auto state = Columns::read(file, kState,
                             {{"position_rad", n},
                              {"torque_nm", n},
                              {"motor_position_rad", n},
                              {"current_a", n},
                              {"age_cycles", n},
                              {"sensor", order.channels},
                              {"sensor_age_cycles", order.sensors.size()}});
  if (!state) return state;
  for (const char* field : {"position_rad", "torque_nm"}) {
    if (state->has(field)) continue;
    return bad_log(path, std::string("the log lacks ") + field + " of its joints",
                   "identification needs position and torque of every joint");
  }
  if (const Status s = check_time(path, state->time_s()); !s) return std::unexpected(s.error());
  return state;
}

/// What of the run's making shows in its signals.
void note_simulation(const log::RunInfo& info, const hal::RobotConfig& robot,
                     Recording& recording) {
  const SimFacts sim = sim_facts(info.configuration);
  recording.hangs = sim.hangs;
  if (robot.boards.empty()) return;
  const auto held_ns = [](const hal::BoardConfig& board) { return board.control_period_ns; };
  const auto [shortest_ns, longest_ns] =
      std::ranges::minmax(robot.boards | std::views::transform(held_ns));
  if (info.hal != "sim") {
    recording.unknown_hold_s = 1e-9 * static_cast<double>(longest_ns);
    return;
  }
  const double period_s = 1e-9 * static_cast<double>(info.period_ns);
  if (shortest_ns != info.period_ns || longest_ns != info.period_ns) {
    recording.unknown_hold_s = std::max(period_s, 1e-9 * static_cast<double>(longest_ns));
    recording.out_of_step = true;
    return;
  }
  recording.voltage_hold_s = period_s;
  const double steps = std::ceil(period_s / (1e-9 * static_cast<double>(sim.substep_ns)) - 1e-9);
  recording.hold_steps =
      sim.leapfrog ? static_cast<int>(std::clamp<double>(steps, 1.0, kContinuous)) : kContinuous;
}

void take_signals(const Columns& state, const Grid& grid, const Order& order,
                  const hal::RobotConfig& robot, Recording& recording) {
  const auto joint_signal = [&](const char* field, std::size_t j) {
    return on_grid(grid, state.time_s(), [&](std::size_t row) {
      const double age = state.at("age_cycles", j, row);
      return age > 0.0 ? kMissing : state.at(field, j, row);
    });
  };
  for (const std::size_t j : order.joints) {
    recording.position_rad.push_back(joint_signal("position_rad", j));
    recording.torque_Nm.push_back(joint_signal("torque_nm", j));
    recording.motor_position_rad.push_back(joint_signal("motor_position_rad", j));
    recording.current_A.push_back(joint_signal("current_a", j));
  }
  for (std::size_t s = 0; s < order.sensors.size(); ++s) {
    const std::size_t from = order.sensors[s];
    for (std::size_t c = 0; c < robot.sensors[s].channels(); ++c) {
      recording.sensor.push_back(on_grid(grid, state.time_s(), [&](std::size_t row) {
        const double age = state.at("sensor_age_cycles", from, row);
        return age > 0.0 ? kMissing : state.at("sensor", order.first_channel[from] + c, row);
      }));
    }
  }
}

/// The commanded positions, where the log has them, of the samples in which they led.
Status take_references(const log::LogFile& file, const Grid& grid, const Order& order,
                       Recording& recording) {
  const std::size_t n = order.joints.size();
  recording.reference_rad.assign(n, Signal(recording.rows(), kMissing));
  if (file.find(kCommand) == nullptr) return {};
  auto command = Columns::read(file, kCommand, {{"position_rad", n}, {"mode", n}});
  if (!command) return std::unexpected(command.error());
  const std::vector<double>& times = command->time_s();
  if (times.size() < grid.first + 1 || !std::ranges::is_sorted(times)) return {};
  for (std::size_t j = 0; j < n; ++j) {
    const std::size_t from = order.joints[j];
    for (std::size_t k = 0, c = 0; k < recording.rows(); ++k) {
      const double t = recording.time_s[k];
      while (c < times.size() && times[c] < t - 0.5 * recording.period_s) ++c;
      if (c == times.size()) break;
      const bool led =
          command->at("mode", from, c) == static_cast<double>(hal::ControlMode::kPosition);
      if (led && std::abs(times[c] - t) < 0.5 * recording.period_s)
        recording.reference_rad[j][k] = command->at("position_rad", from, c);
    }
  }
  return {};
}

void remark_holes(Recording& recording) {
  std::size_t missing = 0, longest = 0;
  for (std::size_t k = 0, run = 0; k < recording.rows(); ++k) {
    const bool valid = std::ranges::all_of(recording.position_rad,
                                           [k](const Signal& s) { return !std::isnan(s[k]); });
    run = valid ? 0 : run + 1;
    missing += valid ? 0 : 1;
    longest = std::max(longest, run);
  }
  if (missing == 0) return;
  recording.remarks.push_back(fmt::format(
      "{} of {} samples are missing, old or no numbers; the longest hole has {}; holes of up to "
      "{} are bridged, the others excluded",
      missing, recording.rows(), longest, kBridge_samples));
}

/// Takes out what lies. Errors: too little is left.
Status exclude(Recording& recording, const hal::RobotConfig& robot) {
  remark_holes(recording);
  if (Status s = check_torques(recording, robot); !s) return s;
  bridge_holes(recording);
  exclude_frozen(recording, robot);
  exclude_clipped(recording, robot);
  for (Signal& current : recording.current_A) undo_holds(current);
  return check_positions(recording, robot);
}

}  // namespace

Result<Recording> read_recording(const std::string& path, const hal::RobotConfig& robot) {
  auto file = log::LogFile::open(path);
  if (!file) return std::unexpected(file.error());
  if (const auto topic = file->require(kState); !topic) return std::unexpected(topic.error());
  if (const Status whole = file->require_samples(); !whole) return std::unexpected(whole.error());
  const log::RunInfo& info = file->info();
  if (info.operators_view) {
    return bad_log(
        path,
        "its state is what a tele-operator saw, predicted or late: nothing in it was measured",
        "identify from the log of the robot's end, `tandem serve`");
  }
  const auto order = order_of(path, info, robot);
  if (!order) return std::unexpected(order.error());
  const auto state = read_state(path, *file, *order);
  if (!state) return std::unexpected(state.error());
  auto events = file->events();
  const log::RunWindow window = log::run_window(events ? *events : std::vector<log::EventText>{},
                                                log::settle_time_s(info.configuration));
  const double end_s = std::min(window.end_s, window.fault_s - 0.02);
  const auto grid = make_grid(path, state->time_s(), window.begin_s, end_s,
                              static_cast<double>(info.period_ns) * 1e-9);
  if (!grid) return std::unexpected(grid.error());

  Recording recording;
  recording.path = path;
  recording.data_sha256 = file->data_sha256();
  recording.period_s = grid->period_s;
  recording.time_s = grid->time_s;
  note_simulation(info, robot, recording);
  for (std::string& one : file->remarks()) recording.remarks.push_back(std::move(one));
  if (file->truncated()) {
    recording.remarks.push_back(
        fmt::format("the log is cut after {} bytes: {}; what can be read ends at {:.3f} s",
                    file->bytes(), file->cut_reason(), recording.time_s.back()));
  }
  if (window.fault_s < 1e299) {
    recording.remarks.push_back(
        fmt::format("the run met a fault at {:.3f} s: what follows is not used", window.fault_s));
  }
  take_signals(*state, *grid, *order, robot, recording);
  if (const Status s = take_references(*file, *grid, *order, recording); !s)
    return std::unexpected(s.error());
  if (const Status s = exclude(recording, robot); !s) return std::unexpected(s.error());
  return recording;
}

}  // namespace tandem::identification
