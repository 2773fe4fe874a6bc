// From a log's columns to a grid without what lies. A sample that cannot be used is a NaN, so that
// no other bookkeeping is needed: filters carry it on.
#include "identification/recording.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

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
constexpr std::size_t kBridge = 5;  // samples that a straight line replaces

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
    const log::Topic* found = file.find(topic);
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
  log::Table table_;
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

void bridge(Signal& signal) {
  std::size_t i = 0;
  while (i < signal.size() && std::isnan(signal[i])) ++i;
  while (i < signal.size()) {
    while (i < signal.size() && !std::isnan(signal[i])) ++i;
    const std::size_t hole = i;
    while (i < signal.size() && std::isnan(signal[i])) ++i;
    if (i == signal.size() || i - hole > kBridge) continue;
    const double before = signal[hole - 1];
    const double slope = (signal[i] - before) / static_cast<double>(i - hole + 1);
    for (std::size_t k = hole; k < i; ++k)
      signal[k] = before + slope * static_cast<double>(k - hole + 1);
  }
}

/// A stretch of samples.
struct Stretch {
  std::size_t begin, end;
};

/// Stretches of at least `least` samples in which `signal` has one and the same value.
std::vector<Stretch> constant_stretches(const Signal& signal, std::size_t least) {
  std::vector<Stretch> found;
  for (std::size_t i = 0; i < signal.size();) {
    std::size_t k = i + 1;
    while (k < signal.size() && signal[k] == signal[i]) ++k;
    if (k - i >= least && !std::isnan(signal[i])) found.push_back({i, k});
    i = k;
  }
  return found;
}

/// How far a signal goes within a stretch; NaN when it has no value there.
double travel(const Signal& signal, Stretch stretch) {
  double low = kMissing, high = kMissing;
  for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
    if (std::isnan(signal[i])) continue;
    low = std::isnan(low) ? signal[i] : std::min(low, signal[i]);
    high = std::isnan(high) ? signal[i] : std::max(high, signal[i]);
  }
  return high - low;
}

void erase(Signal& signal, Stretch stretch) {
  std::fill(signal.begin() + static_cast<std::ptrdiff_t>(stretch.begin),
            signal.begin() + static_cast<std::ptrdiff_t>(stretch.end), kMissing);
}

/// One remark for all the stretches of a signal.
void remark(Recording& recording, const std::string& what, const std::vector<Stretch>& stretches) {
  if (stretches.empty()) return;
  std::size_t samples = 0;
  for (const Stretch& one : stretches) samples += one.end - one.begin;
  const LeftOut left{what, static_cast<double>(samples) * recording.period_s,
                     recording.time_s[stretches[0].begin], recording.time_s[stretches[0].end - 1]};
  recording.remarks.push_back(
      fmt::format("{}: {:.3f} s excluded, the first from {:.3f} to {:.3f} s", what, left.sum_s,
                  left.first_begin_s, left.first_end_s));
  recording.left_out.push_back(left);
}

/// The smallest step of a signal: of its encoder or its wire.
double quantum_of(const Signal& signal) {
  double quantum = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < signal.size(); ++i) {
    const double step = std::abs(signal[i] - signal[i - 1]);
    if (step > 0.0) quantum = std::min(quantum, step);
  }
  return quantum;
}

/// Whether a signal goes on somewhere else after it stood still: a small one that is rounded stands
/// still by itself, and goes on by one step.
bool jumps(const Signal& signal, Stretch stretch) {
  const double quantum = quantum_of(signal);
  if (stretch.end == signal.size()) {
    return stretch.end - stretch.begin > signal.size() / 10 &&
           travel(signal, {0, signal.size()}) > 20.0 * quantum;
  }
  return std::abs(signal[stretch.end] - signal[stretch.begin]) > 5.0 * quantum;
}

/// Signals that a fault may freeze: what must move when the joint does, and by how much.
constexpr double kFrozen_s = 0.2;
constexpr double kMoves_rad = 0.02;

/// Whether a position lies that stands still, from itself alone: a joint has inertia, so it comes
/// to rest little by little and leaves it so. A frozen encoder stops in one sample at full speed,
/// or is somewhere else in one sample.
bool stops_or_leaves_at_once(const Recording& recording, const Signal& position, Stretch one) {
  constexpr double kNear_s = 0.02, kSlow_rad_s = 0.05;
  const double least = std::max(5.0 * quantum_of(position), kSlow_rad_s * recording.period_s);
  const auto near =
      static_cast<std::size_t>(std::max(3.0, std::ceil(kNear_s / recording.period_s)));
  if (one.begin > near) {
    const double step = position[one.begin] - position[one.begin - 1];
    const double way = position[one.begin] - position[one.begin - near];
    // A joint that brakes evenly goes a fifth of the mean or less in the last of five samples.
    const bool at_once = std::abs(step) * static_cast<double>(near) > 0.6 * std::abs(way);
    if (at_once && std::abs(way) > least * static_cast<double>(near)) return true;
  }
  if (one.end + 2 < position.size()) {
    const double leap = std::abs(position[one.end] - position[one.end - 1]);
    const double next = std::abs(position[one.end + 2] - position[one.end]);
    if (leap > least && leap > 1.5 * next) return true;
  }
  return false;
}

/// What [sim] says in the experiment that a log carries.
struct SimFacts {
  std::int64_t substep_ns = 250'000;
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

}  // namespace

void bridge_holes(Recording& recording) {
  for (std::vector<Signal>* signals :
       {&recording.position_rad, &recording.torque_Nm, &recording.motor_position_rad,
        &recording.current_A, &recording.reference_rad, &recording.sensor}) {
    for (Signal& signal : *signals) bridge(signal);
  }
}

void exclude_frozen(Recording& recording, const hal::RobotConfig& robot) {
  const auto least = static_cast<std::size_t>(std::ceil(kFrozen_s / recording.period_s));
  std::vector<std::vector<Stretch>> frozen_positions(robot.joints.size());
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    Signal& position = recording.position_rad[j];
    std::vector<Stretch> torque;
    for (const Stretch& one : constant_stretches(position, least)) {
      const bool led = travel(recording.reference_rad[j], one) > kMoves_rad;
      const bool driven = travel(recording.motor_position_rad[j], one) > kMoves_rad;
      if (led || driven || stops_or_leaves_at_once(recording, position, one))
        frozen_positions[j].push_back(one);
    }
    for (const Stretch& one : constant_stretches(recording.torque_Nm[j], least)) {
      if (travel(position, one) > 5.0 * kMoves_rad && jumps(recording.torque_Nm[j], one))
        torque.push_back(one);
    }
    for (const Stretch& one : frozen_positions[j]) erase(position, one);
    for (const Stretch& one : torque) erase(recording.torque_Nm[j], one);
    const std::string joint = "joint '" + robot.joints[j].name + "': its ";
    remark(recording, joint + "position stands still while the joint is moved",
           frozen_positions[j]);
    remark(recording, joint + "torque stands still while the joint moves", torque);
  }
  std::size_t channel = 0;
  for (const hal::SensorConfig& sensor : robot.sensors) {
    const std::size_t first = channel;
    channel += sensor.channels();
    std::vector<Stretch> frozen;
    for (const Stretch& one : constant_stretches(recording.sensor[first], least)) {
      bool same = true, moves = false;
      for (std::size_t c = first; c < channel; ++c)
        same = same && travel(recording.sensor[c], one) == 0.0;
      for (const Signal& position : recording.position_rad)
        moves = moves || travel(position, one) > 5.0 * kMoves_rad;
      if (same && moves) frozen.push_back(one);
    }
    for (const Stretch& one : frozen)
      for (std::size_t c = first; c < channel; ++c) erase(recording.sensor[c], one);
    remark(recording, "sensor '" + sensor.name + "' stands still while the robot moves", frozen);
  }
}

void exclude_clipped(Recording& recording, const hal::RobotConfig& robot) {
  const auto least = static_cast<std::size_t>(std::ceil(0.03 / recording.period_s));
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    Signal& torque = recording.torque_Nm[j];
    const double quantum = quantum_of(torque);
    double low = 0.0, high = 0.0;
    for (const double one : torque) {
      if (std::isnan(one)) continue;
      low = std::min(low, one);
      high = std::max(high, one);
    }
    // A smooth extremum that is rounded: within half of its plateau's length it is three steps
    // lower. What is cut off by h is 3 h lower. Where one stretch is cut off, all at this value
    // are.
    bool cut[] = {false, false};
    std::vector<Stretch> plateaus;
    for (const Stretch& one : constant_stretches(torque, least)) {
      const double value = torque[one.begin];
      if (value != low && value != high) continue;
      const std::size_t half = (one.end - one.begin) / 2;
      const double before = travel(torque, {one.begin - std::min(one.begin, half), one.begin + 1});
      const double after = travel(torque, {one.end - 1, std::min(one.end + half, torque.size())});
      double rise = std::min(before, after);
      if (one.begin == 0) rise = after;
      if (one.end == torque.size()) rise = before;
      const bool at_limit = std::abs(value) >= 0.99 * robot.joints[j].max_torque_Nm;
      cut[value == high] |= at_limit || rise > 10.0 * quantum;
      plateaus.push_back(one);
    }
    std::vector<Stretch> clipped;
    for (const Stretch& one : plateaus)
      if (cut[torque[one.begin] == high]) clipped.push_back(one);
    for (const Stretch& one : clipped) erase(torque, one);
    remark(recording, "joint '" + robot.joints[j].name + "': its torque is cut off at a limit",
           clipped);
  }
}

void undo_holds(Signal& signal) {
  constexpr std::size_t kLongest = 20;
  std::size_t every = 1, phase = 0;
  for (std::size_t e = 2; e <= kLongest; ++e) {
    std::vector<std::size_t> changes(e, 0);
    std::size_t total = 0;
    for (std::size_t i = 1; i < signal.size(); ++i) {
      if (!(signal[i] != signal[i - 1]) || std::isnan(signal[i]) || std::isnan(signal[i - 1]))
        continue;
      ++changes[i % e];
      ++total;
    }
    const auto most = std::ranges::max_element(changes);
    if (total < 20 || static_cast<double>(*most) < 0.98 * static_cast<double>(total)) continue;
    every = e;
    phase = static_cast<std::size_t>(most - changes.begin());
  }
  if (every == 1) return;
  for (std::size_t at = phase; at + every < signal.size(); at += every) {
    const double from = signal[at], to = signal[at + every];
    for (std::size_t k = 1; k < every; ++k)
      signal[at + k] = from + (to - from) * static_cast<double>(k) / static_cast<double>(every);
  }
}

Result<Recording> read_recording(const std::string& path, const hal::RobotConfig& robot) {
  auto file = log::LogFile::open(path);
  if (!file) return std::unexpected(file.error());
  if (const auto topic = file->require(kState); !topic) return std::unexpected(topic.error());
  const log::RunInfo& info = file->info();
  std::vector<std::string> joints, sensors, logged_sensors;
  for (const hal::JointConfig& joint : robot.joints) joints.push_back(joint.name);
  for (const hal::SensorConfig& sensor : robot.sensors) sensors.push_back(sensor.name);
  std::vector<std::size_t> first_channel;
  std::size_t channels = 0;
  for (const log::SensorInfo& sensor : info.sensors) {
    logged_sensors.push_back(sensor.name);
    first_channel.push_back(channels);
    channels += sensor.channels;
  }
  const auto joint_order = order_of(path, "joint", joints, info.joints);
  if (!joint_order) return std::unexpected(joint_order.error());
  const auto sensor_order = order_of(path, "sensor", sensors, logged_sensors);
  if (!sensor_order) return std::unexpected(sensor_order.error());
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    if (info.sensors[(*sensor_order)[s]].channels == robot.sensors[s].channels()) continue;
    return bad_log(
        path, "this log is of another robot: its sensor '" + sensors[s] + "' has other channels",
        "give --robot the robot that made it");
  }

  const std::size_t n = joints.size();
  auto state = Columns::read(*file, kState,
                             {{"position_rad", n},
                              {"torque_nm", n},
                              {"motor_position_rad", n},
                              {"current_a", n},
                              {"age_cycles", n},
                              {"sensor", channels},
                              {"sensor_age_cycles", sensors.size()}});
  if (!state) return std::unexpected(state.error());
  for (const char* field : {"position_rad", "torque_nm"}) {
    if (state->has(field)) continue;
    return bad_log(path, std::string("the log lacks ") + field + " of its joints",
                   "identification needs position and torque of every joint");
  }
  if (const Status s = check_time(path, state->time_s()); !s) return std::unexpected(s.error());
  auto events = file->events();
  const log::RunWindow window = log::run_window(events ? *events : std::vector<log::EventText>{},
                                                log::settle_time_s(info.configuration));
  const double end_s = std::min(window.end_s, window.fault_s - 0.02);
  const auto grid = make_grid(path, state->time_s(), window.begin_s, end_s,
                              static_cast<double>(info.period_ns) * 1e-9);
  if (!grid) return std::unexpected(grid.error());

  Recording recording;
  recording.path = path;
  recording.period_s = grid->period_s;
  recording.time_s = grid->time_s;
  const SimFacts sim = sim_facts(info.configuration);
  recording.hangs = sim.hangs;
  if (info.hal == "sim" && !robot.boards.empty()) {
    const std::int64_t hold_ns = robot.boards.front().control_period_ns;
    recording.voltage_hold_s = 0.5e-9 * static_cast<double>(hold_ns + sim.substep_ns);
  }
  recording.voltage_hold_known = info.hal == "sim";
  if (file->truncated()) {
    recording.remarks.push_back(
        fmt::format("the log is cut after {} bytes: its run was killed, or the copy is not whole; "
                    "what can be read ends at {:.3f} s",
                    file->bytes(), recording.time_s.back()));
  }
  if (window.fault_s < 1e299) {
    recording.remarks.push_back(
        fmt::format("the run met a fault at {:.3f} s: what follows is not used", window.fault_s));
  }
  const auto joint_signal = [&](const char* field, std::size_t joint) {
    const std::size_t j = (*joint_order)[joint];
    return on_grid(*grid, state->time_s(), [&](std::size_t row) {
      const double age = state->at("age_cycles", j, row);
      return age > 0.0 ? kMissing : state->at(field, j, row);
    });
  };
  for (std::size_t j = 0; j < n; ++j) {
    recording.position_rad.push_back(joint_signal("position_rad", j));
    recording.torque_Nm.push_back(joint_signal("torque_nm", j));
    recording.motor_position_rad.push_back(joint_signal("motor_position_rad", j));
    recording.current_A.push_back(joint_signal("current_a", j));
  }
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    const std::size_t from = (*sensor_order)[s];
    for (std::size_t c = 0; c < robot.sensors[s].channels(); ++c) {
      recording.sensor.push_back(on_grid(*grid, state->time_s(), [&](std::size_t row) {
        const double age = state->at("sensor_age_cycles", from, row);
        return age > 0.0 ? kMissing : state->at("sensor", first_channel[from] + c, row);
      }));
    }
  }
  recording.reference_rad.assign(n, Signal(recording.rows(), kMissing));
  if (file->find(kCommand) != nullptr) {
    auto command = Columns::read(*file, kCommand, {{"position_rad", n}, {"mode", n}});
    if (!command) return std::unexpected(command.error());
    const std::vector<double>& times = command->time_s();
    const bool matches = times.size() >= grid->first + 1 && std::ranges::is_sorted(times);
    for (std::size_t j = 0; matches && j < n; ++j) {
      const std::size_t from = (*joint_order)[j];
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
  }
  std::size_t missing = 0, longest = 0;
  for (std::size_t k = 0, run = 0; k < recording.rows(); ++k) {
    const bool valid = std::ranges::all_of(recording.position_rad,
                                           [k](const Signal& s) { return !std::isnan(s[k]); });
    run = valid ? 0 : run + 1;
    missing += valid ? 0 : 1;
    longest = std::max(longest, run);
  }
  if (missing > 0) {
    recording.remarks.push_back(fmt::format(
        "{} of {} samples are missing, old or no numbers; the longest hole has {}; holes of up to "
        "{} are bridged, the others excluded",
        missing, recording.rows(), longest, kBridge));
  }
  if (const Status s = check_torques(recording, robot); !s) return std::unexpected(s.error());
  bridge_holes(recording);
  exclude_frozen(recording, robot);
  exclude_clipped(recording, robot);
  for (Signal& current : recording.current_A) undo_holds(current);
  if (const Status s = check_positions(recording, robot); !s) return std::unexpected(s.error());
  return recording;
}

}  // namespace tandem::identification
