// Rebuilds robot and experiment from the texts inside the log, so that a log needs no other file.
#include "report/run_data.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/toml_reader.hpp"
#include "hal/config/ground_keys.hpp"
#include "log/run_window.hpp"
#include "model/urdf.hpp"
#include "report/figure.hpp"
#include "report/run_events.hpp"

namespace tandem::report {
namespace {

const char kState[] = "/tandem/state";
const char kCommand[] = "/tandem/command";
const char kTruth[] = "/tandem/truth";
const char kEstimate[] = "/tandem/estimate";
const char kParallelState[] = "/tandem/parallel/state";
const char kParallelTruth[] = "/tandem/parallel/truth";

std::unexpected<Error> log_error(const RunData& run, std::string message, std::string hint) {
  return std::unexpected(Error{std::move(message), std::move(hint), run.path, 0, {}});
}

/// The robot's and the experiment's files, from the texts that the log carries. The first robot is
/// the run's.
Status read_configuration(RunData& run) {
  bool found = false;
  for (const auto& [file, text] : run.info.configuration) {
    if (!file.ends_with(".toml")) continue;
    const Result<TomlDocument> document = TomlDocument::parse(text, file);
    if (!document) return std::unexpected(document.error());
    TomlTable root = document->root();
    if (root.has("model")) {
      if (found) continue;
      auto robot = hal::parse_robot_config(text, file);
      if (!robot) return std::unexpected(robot.error().front());
      run.robot = std::move(*robot);
      found = true;
    } else if (root.has("robot")) {  // the experiment; a scenario has none
      TomlTable report = root.table_or_empty("report");
      run.position_of = report.text_or("position_of", {});
      run.torque_of = report.text_or("torque_of", {});
      run.foot = report.text_or("foot", {});
      for (TomlTable& one : root.table_or_empty("estimation").tables("wrench"))
        run.wrenches.push_back(one.text_or("site", {}));
      run.settle_s = log::settle_time_s(root);
    }
  }
  if (found) {
    if (Status s = hal::read_ground(run.info.ground, run.path, run.robot.contact); !s)
      run.remarks.push_back("the ground is drawn level: " + s.error().to_string());
    return {};
  }
  return log_error(run, "this log does not carry its robot's configuration",
                   run.remarks.empty() ? "report needs a log that `tandem run` has written"
                                       : run.remarks.back());
}

Status read_description(RunData& run) {
  const hal::ModelConfig& m = run.robot.model;
  const std::string text = log::value_of(run.info.configuration, m.urdf);
  if (text.empty()) {
    return log_error(run, "this log does not carry the description " + m.urdf,
                     "report needs a log that `tandem run` has written");
  }
  model::UrdfOptions options{.floating_base = m.floating_base,
                             .mimic_independent = m.mimic_independent,
                             .lock = m.lock,
                             .repair_inertia = m.repair_inertia,
                             .exact_right_angles = m.exact_right_angles,
                             .overrides_file = run.robot.file};
  for (const hal::LinkConfig& link : m.links) {
    options.links.push_back(
        {link.name, link.mass_kg, link.com_m, link.inertia_kg_m2, link.line, link.file, link.key});
  }
  auto description = model::parse_urdf(text, m.urdf, options);
  if (!description) return std::unexpected(description.error().front());
  run.tree = std::move(description->tree);
  return {};
}

/// A field and how many elements the robot's own files give it.
using Wanted = std::pair<const char*, std::size_t>;

/// All elements of some fields as columns to ask for: the reader refuses a log that has fewer.
std::vector<log::Column> columns_of(std::initializer_list<Wanted> fields) {
  std::vector<log::Column> columns;
  for (const auto& [name, count] : fields) {
    for (std::size_t i = 0; i < count; ++i) columns.push_back({name, i});
  }
  return columns;
}

/// Some columns of a topic. Errors: LogFile::read()'s; times that go back.
Result<log::TimeSeries> read_columns(const log::LogFile& file, const std::string& topic,
                                     std::initializer_list<Wanted> fields) {
  auto table = file.read(topic, columns_of(fields));
  if (!table || std::ranges::is_sorted(table->time_s)) return table;
  return std::unexpected(Error{"the messages of " + topic + " are not in the order of their times",
                               "the file is damaged; record the run again",
                               file.path(),
                               0,
                               {}});
}

/// Moves `count` columns from `from` on.
Columns take(log::TimeSeries& table, std::size_t from, std::size_t count) {
  const auto begin = table.columns.begin() + static_cast<std::ptrdiff_t>(from);
  return {std::make_move_iterator(begin),
          std::make_move_iterator(begin + static_cast<std::ptrdiff_t>(count))};
}

/// Drops the rows of `table` outside [begin_s, end_s].
void crop(log::TimeSeries& table, double begin_s, double end_s) {
  const auto first = std::ranges::lower_bound(table.time_s, begin_s) - table.time_s.begin();
  const auto last = std::ranges::upper_bound(table.time_s, end_s) - table.time_s.begin();
  const auto cut = [first, last](std::vector<double>& values) {
    values.assign(values.begin() + first, values.begin() + last);
  };
  cut(table.time_s);
  for (std::vector<double>& column : table.columns) cut(column);
}

/// How long the plots go on after a stop: a quarter of the time before it, but not for ever.
double after_stop_s(double before_s) { return std::clamp(0.25 * before_s, 0.1, 1.0); }

Result<log::TimeSeries> state_columns(const log::LogFile& file, const char* topic,
                                      const RunData& run) {
  const std::size_t n = run.robot.joints.size();
  const std::size_t channels = run.first_channel(run.robot.sensors.size());
  const log::LoggedTopic* const state = file.find(topic);  // a recording of others has no faults
  const bool faults = state != nullptr && state->layout.find("fault") != nullptr;
  return read_columns(file, topic,
                      {{"position_rad", n},
                       {"velocity_rad_s", n},
                       {"torque_nm", n},
                       {"sensor", channels},
                       {"fault", faults ? n : 0}});
}

/// What was measured in the window.
Status read_rows(log::TimeSeries& table, const log::RunWindow& window, RunData& run) {
  const std::size_t n = run.robot.joints.size();
  const std::size_t channels = run.first_channel(run.robot.sensors.size());
  crop(table, window.begin_s, window.end_s);
  if (table.time_s.size() < 2) {
    return log_error(run, "this log has no cycle after the drives' bring-up", {});
  }
  run.time_s = table.time_s;
  run.position_rad = take(table, 0, n);
  run.velocity_rad_s = take(table, n, n);
  run.torque_Nm = take(table, 2 * n, n);
  run.sensor = take(table, 3 * n, channels);
  run.drive_fault = take(table, 3 * n + channels, table.columns.size() - 3 * n - channels);
  return {};
}

/// Begins with the bring-up's end when the run ended before its controllers started.
Status read_state(const log::LogFile& file, log::RunWindow& window, RunData& run) {
  auto table = state_columns(file, kState, run);
  if (!table) return std::unexpected(table.error());
  if (!table->time_s.empty()) {
    run.first_s = table->time_s.front();
    run.last_s = table->time_s.back();
    for (const std::size_t begin : stretches(table->time_s))
      if (begin > 0) run.gaps_s.emplace_back(table->time_s[begin - 1], table->time_s[begin]);
  }
  run.start_known = window.bring_up_s > -1e299;
  const double end_s = table->time_s.empty() ? 0.0 : std::min(window.end_s, run.last_s);
  run.controllers_ran = std::min(end_s, window.stop_s) > window.begin_s;
  if (!run.controllers_ran) window.begin_s = window.bring_up_s;
  const double ran_s = window.stop_s - std::max(window.begin_s, 0.0);
  window.end_s = std::min(window.end_s, window.stop_s + after_stop_s(ran_s));
  window.end_s = std::max(window.end_s, window.begin_s);
  return read_rows(*table, window, run);
}

/// References of the joints that the command puts under position control, by the state's times. Of
/// others those that a controller writes: what nobody writes is what is measured.
Status read_command(const log::LogFile& file, RunData& run) {
  const std::size_t n = run.robot.joints.size();
  const double gap = std::numeric_limits<double>::quiet_NaN();
  run.reference_rad.assign(n, std::vector<double>(run.rows(), gap));
  // A recording of another program may have no references.
  if (run.info.hal == "import" && file.find(kCommand) == nullptr) return {};
  auto table = read_columns(file, kCommand, {{"position_rad", n}, {"mode", n}});
  if (!table) return std::unexpected(table.error());
  constexpr auto kPosition = static_cast<double>(hal::ControlMode::kPosition);
  std::size_t c = 0;
  for (std::size_t row = 0; row < run.rows(); ++row) {
    while (c < table->time_s.size() && table->time_s[c] < run.time_s[row]) ++c;
    if (c == table->time_s.size()) break;
    if (table->time_s[c] != run.time_s[row]) continue;
    for (std::size_t j = 0; j < n; ++j) {
      const double reference = table->columns[j][c];
      const bool follows = table->columns[n + j][c] == kPosition;
      if (follows || reference != run.position_rad[j][row]) run.reference_rad[j][row] = reference;
    }
  }
  return {};
}

/// A table of truth or estimate at the times of the run's rows, up to its last one: the log of a
/// killed run may end between a state and its truth. A log may have every n-th cycle of it alone:
/// between two samples that are 20 ms apart at most numbers change evenly. Without rows where they
/// are further apart.
log::TimeSeries at_rows(const RunData& run, const log::TimeSeries& table) {
  constexpr double kLongest_s = 0.0201;
  constexpr std::size_t kQuaternion = 3;
  log::TimeSeries out;
  out.columns.resize(table.columns.size());
  std::size_t next = 0;
  for (const double t : run.time_s) {
    while (next < table.time_s.size() && table.time_s[next] < t) ++next;
    if (next == table.time_s.size()) break;
    const bool there = table.time_s[next] == t;
    const double before_s = next == 0 ? -1e300 : table.time_s[next - 1];
    const double step_s = table.time_s[next] - before_s;
    if (!there && step_s > kLongest_s) return {};
    out.time_s.push_back(t);
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      const std::vector<double>& column = table.columns[c];
      out.columns[c].push_back(
          there ? column[next]
                : std::lerp(column[next - 1], column[next], (t - before_s) / step_s));
    }
    if (there) continue;
    double square = 0.0;
    for (std::size_t i = 0; i < 4; ++i) square += std::pow(out.columns[kQuaternion + i].back(), 2);
    for (std::size_t i = 0; i < 4; ++i) out.columns[kQuaternion + i].back() /= std::sqrt(square);
  }
  if (out.time_s.size() < 2) return {};
  return out;
}

void resize_rows(RunData& run, std::size_t rows) {
  run.time_s.resize(rows);
  for (Columns* columns :
       {&run.position_rad, &run.velocity_rad_s, &run.torque_Nm, &run.reference_rad, &run.sensor,
        &run.drive_fault, &run.base, &run.foot_position_m, &run.foot_force_N, &run.foot_moment_Nm,
        &run.loop_error, &run.passive_rad}) {
    for (std::vector<double>& column : *columns) column.resize(rows);
  }
}

Status read_truth(const log::LogFile& file, const char* topic, RunData& run) {
  if (file.find(topic) == nullptr) return {};
  const std::size_t feet = 3 * run.robot.contact.feet.size();
  const std::size_t loops = run.robot.loops.size();
  const std::size_t passive = run.robot.passive.size();
  const std::initializer_list<Wanted> fields{{"base_position_m", 3},
                                             {"base_quaternion", 4},
                                             {"base_velocity", 6},
                                             {"foot_position_m", feet},
                                             {"foot_force_n", feet},
                                             {"foot_moment_nm", feet},
                                             {"loop_position_error_m", loops},
                                             {"loop_velocity_error_m_s", loops},
                                             {"passive_position_rad", passive}};
  const hal::Layout& logged = file.find(topic)->layout;
  for (const auto& [name, count] : fields) {
    if (count > 0 && logged.find(name) == nullptr) return {};  // [log] left it out: no truth
  }
  auto table = read_columns(file, topic, fields);
  if (!table) return std::unexpected(table.error());
  *table = at_rows(run, *table);
  const std::size_t rows = table->time_s.size();
  if (rows == 0) return {};
  run.base = take(*table, 0, 13);
  run.foot_position_m = take(*table, 13, feet);
  run.foot_force_N = take(*table, 13 + feet, feet);
  run.foot_moment_Nm = take(*table, 13 + 2 * feet, feet);
  run.loop_error = take(*table, 13 + 3 * feet, 2 * loops);
  run.passive_rad = take(*table, 13 + 3 * feet + 2 * loops, passive);
  resize_rows(run, rows);
  return {};
}

/// The run's own estimate, where nobody simulated it. It has to have started before the first row.
Status read_estimate(const log::LogFile& file, RunData& run) {
  const auto* topic = file.find(kEstimate);
  if (run.motion_known() || topic == nullptr || !run.robot.model.floating_base) return {};
  const std::size_t feet = 3 * run.robot.contact.feet.size();
  auto table = read_columns(file, kEstimate,
                            {{"base_position_m", 3},
                             {"base_quaternion", 4},
                             {"base_velocity", 6},
                             {"foot_force_n", feet},
                             {"foot_moment_nm", feet},
                             {"base_valid", 1}});
  if (!table) return {};  // an observer alone: no base
  *table = at_rows(run, *table);
  const std::size_t rows = table->time_s.size();
  if (rows == 0 || table->columns.back().front() != 1.0) return {};
  run.base = take(*table, 0, 13);
  run.foot_force_N = take(*table, 13, feet);
  run.foot_moment_Nm = take(*table, 13 + feet, feet);
  run.estimated = true;
  resize_rows(run, rows);
  return {};
}

}  // namespace

Result<std::optional<RunData>> read_parallel(const RunData& run) {
  const Result<log::LogFile> file = log::LogFile::open(run.path);
  if (!file) return std::unexpected(file.error());
  if (file->find(kParallelState) == nullptr) return std::nullopt;
  RunData second = run;
  second.faults.clear();
  second.marks.clear();  // they are the first one's
  for (Columns* truth : {&second.base, &second.foot_position_m, &second.foot_force_N,
                         &second.foot_moment_Nm, &second.loop_error, &second.passive_rad}) {
    truth->clear();
  }
  for (const auto& [name, text] : run.info.configuration) {
    if (!name.ends_with(".toml") || name == run.robot.file) continue;
    auto other = hal::parse_robot_config(text, name);
    if (!other) continue;  // the experiment
    second.robot = std::move(*other);
    if (const Status s = read_description(second); !s) return std::unexpected(s.error());
  }
  log::RunWindow window;
  window.begin_s = run.time_s.front() - log::kHalfNanosecond;
  window.end_s = run.time_s.back() + log::kHalfNanosecond;
  auto table = state_columns(*file, kParallelState, second);
  if (!table) return std::unexpected(table.error());
  if (const Status s = read_rows(*table, window, second); !s) return std::unexpected(s.error());
  if (const Status s = read_command(*file, second); !s) return std::unexpected(s.error());
  if (const Status s = read_truth(*file, kParallelTruth, second); !s) {
    return std::unexpected(s.error());
  }
  return second;
}

Result<RunData> read_run(const std::string& path, const ErrorText& error_text) {
  const Result<log::LogFile> file = log::LogFile::open(path);
  if (!file) return std::unexpected(file.error());
  RunData run;
  run.path = path;
  run.info = file->info();
  run.result = file->shown_result();
  if (file->truncated()) run.cut_reason = file->cut_reason();
  run.remarks = file->remarks();
  run.data_sha256 = file->data_sha256();
  if (const Status s = read_configuration(run); !s) return std::unexpected(s.error());
  if (const Status s = read_description(run); !s) return std::unexpected(s.error());
  const auto events = file->events();
  if (!events) return std::unexpected(events.error());
  run.faults = faults_of(*events, run.info.joints, error_text);
  run.parameters = parameters_of(*events, run.info.parameters);
  run.marks = marks_of(*events);
  log::RunWindow window = log::run_window(*events, run.settle_s);
  if (const Status s = read_state(*file, window, run); !s) return std::unexpected(s.error());
  // Only a crash or a hang of the loop is in the result; it had no time to be an event.
  if (std::string how = log::value_of(run.result, "ended"); !how.empty())
    run.faults.push_back({run.last_s, {}, std::move(how)});
  if (const Status s = read_command(*file, run); !s) return std::unexpected(s.error());
  if (const Status s = read_truth(*file, kTruth, run); !s) return std::unexpected(s.error());
  if (const Status s = read_estimate(*file, run); !s) return std::unexpected(s.error());
  run.step_s = std::max(1e-9, usual_step(run.time_s));
  return run;
}

}  // namespace tandem::report
