#include "log/import/sampling.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <utility>

#include "base/bounds.hpp"

namespace tandem::log {
namespace {

constexpr std::size_t kFewRows = 10;  // fewer that are equal say nothing
constexpr std::int64_t kGapSteps = 3;
constexpr std::uint64_t kMostCycles = 1'000'000'000;
constexpr std::int64_t kMostRatio = 50;  // of the log's period to the recording's, either way

std::string in_seconds(std::int64_t ns) {
  std::string text = std::to_string(static_cast<double>(ns) * 1e-9);
  return text + " s";
}

/// What is wrong with a row, with its place.
Error row_error(const ImportedSeries& series, std::size_t row, std::string message,
                std::string hint) {
  Error error{std::move(message), std::move(hint), series.columns.front().file, 0, series.name};
  if (row < series.line.size()) {
    error.line = series.line[row];
  } else {
    error.message = "sample " + std::to_string(row + 1) + ": " + error.message;
  }
  return error;
}

/// What is left out of several series: the number of each row's line or message.
struct LeftOut {
  std::vector<std::uint32_t> duplicates, backwards;
};

/// Rows whose time is after that of every row before them.
Status check_order(ImportedSeries& series, const ImportMap& map, LeftOut& left_out) {
  std::vector<std::size_t> kept;
  for (std::size_t row = 0; row < series.rows(); ++row) {
    const std::int64_t time = series.time_ns[row];
    const std::int64_t last = kept.empty() ? time - 1 : series.time_ns[kept.back()];
    if (time > last) {
      kept.push_back(row);
      continue;
    }
    const bool twice = time == last;
    if (!map.excludes(twice ? Trouble::kDuplicates : Trouble::kBackwards)) {
      return std::unexpected(row_error(
          series, row,
          twice ? "this time was there before" : "time goes back by " + in_seconds(last - time),
          twice ? "leave such rows out by exclude = [\"duplicates\"]"
                : "is it the right time column? exclude = [\"backwards\"] leaves such rows out"));
    }
    const auto from = row < series.message.size() ? series.message[row]
                                                  : static_cast<std::uint32_t>(series.line[row]);
    (twice ? left_out.duplicates : left_out.backwards).push_back(from);
  }
  keep_rows(series, kept);
  return {};
}

std::vector<std::int64_t> sorted_steps(const ImportedSeries& series) {
  std::vector<std::int64_t> steps;
  for (std::size_t row = 1; row < series.rows(); ++row) {
    steps.push_back(series.time_ns[row] - series.time_ns[row - 1]);
  }
  std::ranges::sort(steps);
  return steps;
}

/// Positions that the map says were kept within a turn, as an angle from -pi to pi is, go on: each
/// row is the nearest to the one before. The whole column then stands in the joint's range, where
/// a number of turns brings it there.
void continue_turns(ImportedSeries& series, const ImportMap& map, const hal::RobotConfig& robot) {
  constexpr double kTurn_rad = 2.0 * std::numbers::pi;
  for (ImportedColumn& column : series.columns) {
    const auto of = [&](const SignalMap& one) {
      return one.command == column.target.command && one.field == column.target.field;
    };
    const auto signal = std::ranges::find_if(map.signals, of);
    if (signal == map.signals.end() || !signal->unwrap || column.values.empty()) continue;
    const hal::JointConfig& joint = robot.joints[column.target.index];
    if (joint.slides) continue;
    for (std::size_t row = 1; row < column.values.size(); ++row) {
      const double step = column.values[row] - column.values[row - 1];
      column.values[row] -= kTurn_rad * std::round(step / kTurn_rad);
    }
    const auto [least, most] = std::ranges::minmax(column.values);
    const double lower = joint.min_position_rad, upper = joint.max_position_rad;
    const double turns = std::round((lower + upper - least - most) / 2.0 / kTurn_rad);
    const double shift = kTurn_rad * turns;
    const bool fits = least + shift >= lower && most + shift <= upper;  // not where no limits are
    if (!fits || (least >= lower && most <= upper)) continue;
    for (double& value : column.values) value += shift;
  }
}

void crop(ImportedRecording& recording, const ImportMap& map) {
  std::int64_t start = std::numeric_limits<std::int64_t>::max();
  for (const ImportedSeries& series : recording.series) {
    if (series.rows() > 0) start = std::min(start, series.time_ns.front());
  }
  for (ImportedSeries& series : recording.series) {
    std::vector<std::size_t> kept;
    for (std::size_t row = 0; row < series.rows(); ++row) {
      const std::int64_t since = series.time_ns[row] - start;
      if (since >= map.begin_ns && (map.end_ns == 0 || since <= map.end_ns)) kept.push_back(row);
    }
    keep_rows(series, kept);
  }
}

/// The usual step; 0 of a single sample.
std::int64_t median_step(const std::vector<std::int64_t>& sorted) {
  return sorted.empty() ? 0 : sorted[sorted.size() / 2];
}

std::int64_t max_gap_of(const ImportedSeries& series, const ImportMap& map) {
  if (map.max_gap_ns != 0 && series.has_positions()) return map.max_gap_ns;
  // A column may be slower than the positions, whose gaps the map speaks of.
  const std::int64_t usual = std::max(median_step(sorted_steps(series)), map.period_ns);
  return std::max(map.max_gap_ns, kGapSteps * usual);
}

Status check_gaps(const ImportedSeries& series, const ImportMap& map, Exclusions& excluded) {
  const std::int64_t most = max_gap_of(series, map);
  for (std::size_t row = 1; row < series.rows(); ++row) {
    const std::int64_t step = series.time_ns[row] - series.time_ns[row - 1];
    if (step <= most) continue;
    if (!map.excludes(Trouble::kGaps)) {
      return std::unexpected(row_error(
          series, row,
          "nothing was recorded for " + in_seconds(step) + ", more than " + in_seconds(most),
          "say exclude = [\"gaps\"] and the log lacks these cycles, or raise [time] max_gap_s"));
    }
    ++excluded.gaps;
  }
  return {};
}

Status check_frozen(ImportedSeries& series, const ImportMap& map, Exclusions& excluded) {
  if (map.allow_frozen || series.rows() < kFewRows) return {};
  for (std::size_t c = 0; c < series.columns.size();) {
    const ImportedColumn& column = series.columns[c];
    const bool orientation = std::ranges::any_of(
        series.quaternions, [c](std::size_t first) { return c >= first && c < first + 4; });
    const bool moves = std::ranges::any_of(
        column.values, [&](double one) { return one != column.values.front(); });
    if (moves || column.target.command || orientation) {
      ++c;
      continue;
    }
    const bool may_go = column.target.field != "position_rad" && column.target.field != "sensor";
    if (!map.excludes(Trouble::kFrozen) || !may_go) {
      return std::unexpected(
          Error{"never changes in " + std::to_string(series.rows()) + " samples",
                std::string("is it recorded at all? allow_frozen = true takes it as it is") +
                    (may_go ? ", exclude = [\"frozen\"] leaves it out" : ""),
                column.file, 0, column.name});
    }
    excluded.frozen.push_back(column.name);
    for (std::size_t& first : series.quaternions) first -= first > c ? 1 : 0;
    series.columns.erase(series.columns.begin() + static_cast<std::ptrdiff_t>(c));
  }
  return {};
}

/// A unit of time or a period that is off by orders of magnitude: almost no row would be used, or
/// almost every cycle would be made up. The positions say it: other columns may be slower.
Status check_period(const ImportedSeries& series, const ImportMap& map) {
  if (!series.has_positions()) return {};
  const std::int64_t step = std::max<std::int64_t>(1, median_step(sorted_steps(series)));
  if (map.period_ns / kMostRatio < step && step / kMostRatio < map.period_ns) return {};
  const auto position = std::ranges::find_if(series.columns, &ImportedColumn::is_position);
  return std::unexpected(Error{"a cycle of the log is " + in_seconds(map.period_ns) + ", and '" +
                                   position->name + "' has a sample every " + in_seconds(step),
                               "are [time] unit and period_s right?", map.file, 0,
                               "time.period_s"});
}

/// Positions further outside of a joint's range than it is wide: another unit, or no number of it.
Status check_range(const ImportedSeries& series, const ImportMap& map,
                   const hal::RobotConfig& robot) {
  for (const ImportedColumn& column : series.columns) {
    if (column.target.field != "position_rad") continue;
    const hal::JointConfig& joint = robot.joints[column.target.index];
    const double width = joint.max_position_rad - joint.min_position_rad;
    if (!(width > 0.0)) continue;  // no robot.toml says it
    for (std::size_t row = 0; row < column.values.size(); ++row) {
      const double value = column.values[row];
      if (value >= joint.min_position_rad - width && value <= joint.max_position_rad + width) {
        continue;
      }
      const std::string unit = joint.slides ? " m" : " rad";
      const auto number = [](double one) { return fmt::format("{:.6g}", one); };
      return std::unexpected(row_error(
          series, row,
          column.name + " is " + number(value) + unit + "; '" + joint.name + "' moves from " +
              number(joint.min_position_rad) + " to " + number(joint.max_position_rad) + unit,
          "is its unit right in " + map.file + "? leave a bad row out by begin_s or end_s"));
    }
  }
  return {};
}

/// Torques that no joint has.
Status check_torques(const ImportedSeries& series, const ImportMap& map,
                     const hal::RobotConfig& robot) {
  constexpr double kMost = 100.0;  // times the joint's limit
  for (const ImportedColumn& column : series.columns) {
    if (column.target.command || column.target.field != "torque_nm") continue;
    const hal::JointConfig& joint = robot.joints[column.target.index];
    const double most = kMost * joint.max_torque_Nm;
    for (std::size_t row = 0; row < column.values.size(); ++row) {
      if (!(most > 0.0) || std::abs(column.values[row]) <= most) continue;
      return std::unexpected(row_error(
          series, row,
          fmt::format("{} is {:.4g} {}; '{}' has {:.4g} at most", column.name, column.values[row],
                      joint.slides ? "N" : "Nm", joint.name, joint.max_torque_Nm),
          "is its unit right in " + map.file + "? leave a bad row out by begin_s or end_s"));
    }
  }
  return {};
}

/// A position that goes on a turn further, as an encoder's does whose number is kept within one.
Status check_leaps(const ImportedSeries& series, const ImportMap& map,
                   const hal::RobotConfig& robot) {
  constexpr double kTurn_rad = 2.0 * std::numbers::pi, kNear_rad = 0.5;
  const std::int64_t longest_step_ns = max_gap_of(series, map);
  for (const ImportedColumn& column : series.columns) {
    if (column.target.command || column.target.field != "position_rad") continue;
    const hal::JointConfig& joint = robot.joints[column.target.index];
    if (joint.slides) continue;
    for (std::size_t row = 1; row < column.values.size(); ++row) {
      if (series.time_ns[row] - series.time_ns[row - 1] > longest_step_ns) continue;
      const double leap = std::abs(column.values[row] - column.values[row - 1]);
      if (std::abs(leap - kTurn_rad) >= kNear_rad) continue;
      return std::unexpected(
          row_error(series, row,
                    fmt::format("{} leaps by {:.4g} rad, a turn: '{}' does not", column.name, leap,
                                joint.name),
                    "its number was kept within a turn: say unwrap = true in [position] of " +
                        map.file + ", or leave the row out by begin_s or end_s"));
    }
  }
  return {};
}

const ImportedColumn* column_of(const ImportedSeries& series, const std::string& field,
                                std::size_t joint) {
  const auto found = std::ranges::find_if(series.columns, [&](const ImportedColumn& column) {
    return !column.target.command && column.target.field == field && column.target.index == joint;
  });
  return found == series.columns.end() ? nullptr : &*found;
}

/// A joint's velocities over the rate of its positions, sorted: a number for each tenth of a second
/// in which it goes 5 mrad (or mm) or more. A leap, as when an encoder begins, is in one of them.
std::vector<double> rates_of(const ImportedSeries& series, const ImportedColumn& position,
                             const ImportedColumn& velocity) {
  constexpr std::int64_t kStretch_ns = 100'000'000;
  constexpr double kLeast = 5e-3;
  std::vector<double> rates;
  double way = 0.0, by_velocity = 0.0;
  std::int64_t begin = series.time_ns.front();
  for (std::size_t row = 1; row < series.rows(); ++row) {
    const double step_s = 1e-9 * static_cast<double>(series.time_ns[row] - series.time_ns[row - 1]);
    way += position.values[row] - position.values[row - 1];
    by_velocity += 0.5 * step_s * (velocity.values[row] + velocity.values[row - 1]);
    if (series.time_ns[row] - begin < kStretch_ns) continue;
    if (std::abs(way) >= kLeast) rates.push_back(by_velocity / way);
    way = by_velocity = 0.0;
    begin = series.time_ns[row];
  }
  std::ranges::sort(rates);
  return rates;
}

/// A velocity that is not the rate of its position: one of them has another unit, sign or column.
Status check_rates(const ImportedSeries& series, const ImportMap& map,
                   const hal::RobotConfig& robot) {
  constexpr std::size_t kFewRates = 5;
  for (const std::size_t joint : series.joints) {
    const ImportedColumn* position = column_of(series, "position_rad", joint);
    const ImportedColumn* velocity = column_of(series, "velocity_rad_s", joint);
    if (position == nullptr || velocity == nullptr) continue;
    const std::vector<double> rates = rates_of(series, *position, *velocity);
    const auto near = [&](double one) {  // how many are, within a factor of two
      return std::ranges::count_if(
          rates, [&](double rate) { return rate / one >= 0.5 && rate / one <= 2.0; });
    };
    const auto most = static_cast<std::ptrdiff_t>(rates.size() / 2);
    if (rates.size() < kFewRates || near(1.0) > most) continue;
    const double middle = rates[rates.size() / 2];
    const std::string how = near(middle) > most
                                ? fmt::format("is {:.3g} times the rate of its position", middle)
                                : "is not the rate of its position";
    return std::unexpected(
        Error{fmt::format("the velocity of '{}' (column {}) {} (column {})",
                          robot.joints[joint].name, velocity->name, how, position->name),
              fmt::format("are units, signs and the order of the columns right in {}? Without its "
                          "table of velocities the log has positions alone",
                          map.file),
              velocity->file, 0, velocity->name});
  }
  return {};
}

/// A quaternion and its negative are one rotation: neighbours get the signs that are near.
void unwrap(ImportedSeries& series) {
  for (const std::size_t first : series.quaternions) {
    for (std::size_t row = 1; row < series.rows(); ++row) {
      double product = 0.0;
      for (std::size_t i = first; i < first + 4; ++i) {
        product += series.columns[i].values[row] * series.columns[i].values[row - 1];
      }
      if (product >= 0.0) continue;
      for (std::size_t i = first; i < first + 4; ++i) series.columns[i].values[row] *= -1.0;
    }
  }
}

void store_number(hal::Image& image, std::size_t offset, double value) {
  std::memcpy(image.bytes().data() + offset, &value, sizeof value);
}

double load_number(const hal::Image& image, std::size_t offset) {
  double value = 0.0;
  std::memcpy(&value, image.bytes().data() + offset, sizeof value);
  return value;
}

/// Every real number is NaN, every integer 0.
void blank(hal::Image& image) {
  std::ranges::fill(image.bytes(), std::byte{0});
  for (const hal::Field& field : image.layout().fields()) {
    if (field.type != hal::FieldType::kF64) continue;
    for (std::size_t i = 0; i < field.count; ++i) {
      store_number(image, field.offset + i * sizeof(double),
                   std::numeric_limits<double>::quiet_NaN());
    }
  }
}

}  // namespace

void keep_rows(ImportedSeries& series, const std::vector<std::size_t>& rows) {
  if (rows.size() == series.rows()) return;
  const auto keep = [&rows](auto& values) {
    if (values.empty()) return;
    for (std::size_t i = 0; i < rows.size(); ++i) values[i] = values[rows[i]];
    values.resize(rows.size());
  };
  keep(series.time_ns);
  keep(series.line);
  keep(series.message);
  for (ImportedColumn& column : series.columns) keep(column.values);
}

std::uint64_t distinct(std::vector<std::uint32_t> numbers) {
  std::ranges::sort(numbers);
  return static_cast<std::uint64_t>(std::unique(numbers.begin(), numbers.end()) - numbers.begin());
}

Status clean(ImportedRecording& recording, const ImportMap& map, const hal::RobotConfig& robot) {
  LeftOut left_out;
  for (ImportedSeries& series : recording.series) {
    if (Status s = check_order(series, map, left_out); !s) return s;
  }
  recording.excluded.duplicates = distinct(std::move(left_out.duplicates));
  recording.excluded.backwards = distinct(std::move(left_out.backwards));
  crop(recording, map);
  for (ImportedSeries& series : recording.series) continue_turns(series, map, robot);
  for (const ImportedSeries& series : recording.series) {
    if (series.rows() >= (series.has_positions() ? 2U : 1U)) continue;
    return std::unexpected(
        Error{series.has_positions() ? "has less than two samples that can be used"
                                     : "has no sample that can be used",
              "is [time] begin_s before its end?",
              series.columns.empty() ? "" : series.columns.front().file, 0, series.name});
  }
  if (map.period_ns == 0) {
    const Spacing first = spacings(recording).front();
    return std::unexpected(
        Error{"is missing: how long is a cycle of the log? The recording has a sample every " +
                  in_seconds(first.median_ns) + " (" + in_seconds(first.least_ns) + " to " +
                  in_seconds(first.most_ns) + ")",
              "say [time] period_s", map.file, 0, "time.period_s"});
  }
  for (ImportedSeries& series : recording.series) {
    if (Status s = check_period(series, map); !s) return s;
    if (Status s = check_range(series, map, robot); !s) return s;
    if (Status s = check_gaps(series, map, recording.excluded); !s) return s;
    if (Status s = check_torques(series, map, robot); !s) return s;
    if (Status s = check_leaps(series, map, robot); !s) return s;
    if (Status s = check_rates(series, map, robot); !s) return s;
    if (Status s = check_frozen(series, map, recording.excluded); !s) return s;
    unwrap(series);
  }
  return {};
}

std::vector<Spacing> spacings(const ImportedRecording& recording) {
  std::vector<Spacing> all;
  for (const ImportedSeries& series : recording.series) {
    const std::vector<std::int64_t> steps = sorted_steps(series);
    const std::int64_t median_ns = median_step(steps);
    const double in_time_ns = Spacing::kLateSteps * static_cast<double>(median_ns);
    const auto late = std::ranges::count_if(
        steps, [=](std::int64_t step) { return static_cast<double>(step) > in_time_ns; });
    all.push_back({series.name, series.rows(), median_ns, steps.empty() ? 0 : steps.front(),
                   steps.empty() ? 0 : steps.back(), static_cast<std::size_t>(late)});
  }
  return all;
}

Sampler::Sampler(const ImportedRecording& recording, const ImportMap& map,
                 const hal::RobotConfig& robot)
    : recording_(recording),
      map_(map),
      blank_state_(robot.shape()),
      blank_command_(robot.shape()),
      row_(recording.series.size(), 0) {
  blank(blank_state_);
  blank(blank_command_);
  std::ranges::fill(blank_command_.mode(), map_.command_mode);
  for (const auto& [joint, position_rad] : map_.missing) {
    blank_state_.position_rad()[joint] = position_rad;
    blank_state_.velocity_rad_s()[joint] = 0.0;
  }
  // An IMU that does not know where it is says 0 0 0 0.
  for (const SensorMap& sensor : map_.sensors) {
    if (!sensor.no_orientation) continue;
    std::ranges::fill(blank_state_.sensor_values(sensor.sensor).first(4), 0.0);
  }
  for (const ImportedSeries& series : recording.series) {
    max_gap_ns_.push_back(max_gap_of(series, map));
    std::vector<std::size_t>& offsets = offsets_.emplace_back();
    for (const ImportedColumn& column : series.columns) {
      const hal::Image& image =
          column.target.command ? static_cast<const hal::Image&>(blank_command_) : blank_state_;
      offsets.push_back(image.layout().find(column.target.field)->offset +
                        column.target.index * sizeof(double));
    }
  }
}

Result<Sampler> Sampler::create(const ImportedRecording& recording, const ImportMap& map,
                                const hal::RobotConfig& robot) {
  Sampler made(recording, map, robot);
  std::size_t samples = 0;
  std::int64_t begin = std::numeric_limits<std::int64_t>::min();
  std::int64_t end = std::numeric_limits<std::int64_t>::max();
  for (const ImportedSeries& series : recording.series) {
    if (!series.has_positions()) continue;
    samples = std::max(samples, series.rows());
    begin = std::max(begin, series.time_ns.front());
    end = std::min(end, series.time_ns.back());
  }
  if (begin > end) {
    return fail("the joints' samples have no time in common",
                "record them together, or import some of them only");
  }
  made.begin_ns_ = begin;
  made.cycles_ = static_cast<std::uint64_t>((end - begin) / map.period_ns) + 1;
  const std::uint64_t most = std::min(kMostCycles, samples * bounds::kReplayCycles.most);
  if (made.cycles_ < 2 || made.cycles_ > most) {
    return fail("the recording has " + std::to_string(made.cycles_) + " cycles of " +
                    in_seconds(map.period_ns) + " for " + std::to_string(samples) + " samples",
                "check [time] unit and period_s in " + map.file);
  }
  return made;
}

double Sampler::value_of(const ImportedColumn& column, std::size_t row, double share) const {
  const double here = column.values[row];
  if (row + 1 == column.values.size() || share == 0.0) return here;
  const double next = column.values[row + 1];
  switch (map_.sampling) {
    case Sampling::kLinear: return here + share * (next - here);
    case Sampling::kNearest: return share > 0.5 ? next : here;
    case Sampling::kPrevious: break;
  }
  return here;
}

/// Numbers and ages of one series. @return false: it has a hole here
bool Sampler::fill_series(std::size_t index, std::int64_t now_ns, hal::StateImage& state,
                          hal::CommandImage& command) {
  const ImportedSeries& series = recording_.series[index];
  std::size_t& row = row_[index];
  while (row + 1 < series.rows() && series.time_ns[row + 1] <= now_ns) ++row;
  const std::int64_t since_ns = now_ns - series.time_ns[row];
  if (since_ns < 0) return false;
  const bool last = row + 1 == series.rows();
  const std::int64_t most_ns = max_gap_ns_[index];
  const std::int64_t step_ns = last ? most_ns : series.time_ns[row + 1] - series.time_ns[row];
  const bool hole = since_ns > 0 && (step_ns > most_ns || since_ns > step_ns);
  if (hole && !series.has_positions() && series.sensors.empty()) return false;
  const double share = hole ? 0.0 : static_cast<double>(since_ns) / static_cast<double>(step_ns);
  for (std::size_t c = 0; c < series.columns.size(); ++c) {
    const ImportedColumn& column = series.columns[c];
    hal::Image& image = column.target.command ? static_cast<hal::Image&>(command) : state;
    store_number(image, offsets_[index][c], value_of(column, row, share));
  }
  const bool held = hole || map_.sampling == Sampling::kPrevious;
  const auto age = static_cast<std::uint32_t>(held ? since_ns / map_.period_ns : 0);
  for (const ImportedColumn& column : series.columns) {
    if (column.is_position()) state.age_cycles()[column.target.index] = age;
  }
  for (const std::size_t sensor : series.sensors) state.sensor_age_cycles()[sensor] = age;
  if (share > 0.0) normalise(index, state);
  return !hole;
}

/// What lies between two unit quaternions is shorter than one.
void Sampler::normalise(std::size_t index, hal::StateImage& state) const {
  for (const std::size_t first : recording_.series[index].quaternions) {
    const auto* offsets = &offsets_[index][first];
    double norm = 0.0;
    for (std::size_t i = 0; i < 4; ++i) norm = std::hypot(norm, load_number(state, offsets[i]));
    for (std::size_t i = 0; norm > 0.5 && i < 4; ++i) {
      store_number(state, offsets[i], load_number(state, offsets[i]) / norm);
    }
  }
}

bool Sampler::fill(std::uint64_t cycle, hal::StateImage& state, hal::CommandImage& command) {
  const std::int64_t since_ns = static_cast<std::int64_t>(cycle) * map_.period_ns;
  state.assign(blank_state_);
  command.assign(blank_command_);
  state.cycle()[0] = command.cycle()[0] = cycle;
  state.time_ns()[0] = command.time_ns()[0] = since_ns;
  const auto never = static_cast<std::uint32_t>(std::min<std::uint64_t>(cycle + 1, ~0U));
  std::ranges::fill(state.sensor_age_cycles(), never);
  bool whole = true;
  for (std::size_t s = 0; s < recording_.series.size(); ++s) {
    const bool there = fill_series(s, begin_ns_ + since_ns, state, command);
    if (!there && recording_.series[s].has_positions()) whole = false;
  }
  return whole;
}

}  // namespace tandem::log
