// Rows of all files together: one series with a column for each number that the map uses.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <optional>
#include <utility>

#include "base/counted.hpp"
#include "base/nearest.hpp"
#include "base/quoting.hpp"
#include "log/import/csv_rows.hpp"
#include "log/import/sources.hpp"

namespace tandem::log {
namespace {

/// Where a column of a series comes from.
struct CsvPlace {
  std::size_t file = 0, column = 0;
  double scale = 1.0, offset = 0.0;
};

class CsvSource {
 public:
  CsvSource(std::span<const ImportFile> files, const ImportMap& map, const hal::RobotConfig& robot)
      : files_(files), map_(map), robot_(robot) {}

  Result<ImportedRecording> read() {
    for (const ImportFile& file : files_) {
      auto rows = CsvRows::open(file.text, file.path, map_.csv);
      if (!rows) return std::unexpected(rows.error());
      rows_.push_back(std::move(*rows));
    }
    if (Status placed = place_columns(); !placed) return std::unexpected(placed.error());
    if (Status done = check_unused(); !done) return std::unexpected(done.error());
    sparse_ = map_.csv.sparse ? *map_.csv.sparse : is_sparse();
    if (Status done = read_rows(); !done) return std::unexpected(done.error());
    if (!sparse_) {
      recording_.series.push_back(std::move(series_));
    } else if (Status parted = part_columns(); !parted) {
      return std::unexpected(parted.error());
    }
    return std::move(recording_);
  }

 private:
  std::string full_name(std::size_t file, const std::string& column) const {
    if (files_.size() == 1) return column;
    return std::filesystem::path(files_[file].path).stem().string() + "." + column;
  }

  /// Errors: no file has it; it is somebody else's already.
  Result<CsvPlace> find(const std::string& name, int line, const std::string& key) {
    std::vector<std::string> names;
    for (std::size_t f = 0; f < rows_.size(); ++f) {
      for (std::size_t c = 0; c < rows_[f].names().size(); ++c) {
        names.push_back(full_name(f, rows_[f].names()[c]));
        if (names.back() != name) continue;
        if (std::ranges::find(used_, name) != used_.end()) {
          return std::unexpected(Error{"the column '" + name + "' is used twice",
                                       "a column is one number's: leave one of the two out",
                                       map_.file, line, key});
        }
        used_.push_back(name);
        return CsvPlace{.file = f, .column = c};
      }
    }
    const std::string other = other_delimiter();
    return std::unexpected(Error{"the recording has no column '" + name + "'",
                                 other.empty() ? suggest(name, names) : other, map_.file, line,
                                 key});
  }

  /// When a header is one column only and has another delimiter in it: what to write; else empty.
  [[nodiscard]] std::string other_delimiter() const {
    for (const CsvRows& rows : rows_) {
      if (rows.names().size() != 1) continue;
      const std::string& header = rows.names().front();
      for (const auto& [sign, word] :
           {std::pair{';', "semicolon"}, {'\t', "tab"}, {',', "comma"}}) {
        if (header.find(sign) == std::string::npos) continue;
        return "its header is one column, '" + header + "': say delimiter = \"" + word +
               "\" in [csv] of the map";
      }
    }
    return {};
  }

  Status add(const std::string& name, int line, const std::string& key, Target target, double scale,
             double offset) {
    auto place = find(name, line, key);
    if (!place) return std::unexpected(place.error());
    place->scale = scale;
    place->offset = offset;
    places_.push_back(*place);
    series_.columns.push_back({name, files_[place->file].path, std::move(target), {}});
    return {};
  }

  Status place_columns() {
    series_.name = "rows";
    series_.joints = map_.joints;
    if (map_.time_column) {
      const auto place = find(*map_.time_column, 0, "time.column");
      if (!place) return std::unexpected(place.error());
      time_ = *place;
    }
    for (const SignalMap& signal : map_.signals) {
      for (std::size_t j = 0; j < signal.columns.size(); ++j) {
        Status added =
            add(signal.columns[j], signal.line, signal.key + ".columns",
                {signal.command, signal.field, map_.joints[j]}, signal.scale[j], signal.offset[j]);
        if (!added) return added;
      }
      for (const std::string& name : signal.unused) {
        const auto place = find(name, signal.line, signal.key + ".columns");
        if (!place) return std::unexpected(place.error());
        recording_.excluded.ignored.push_back(name);
      }
    }
    for (const SensorMap& sensor : map_.sensors) {
      if (Status added = place_sensor(sensor); !added) return added;
    }
    return {};
  }

  Status place_sensor(const SensorMap& sensor) {
    std::size_t first = 0;
    for (std::size_t s = 0; s < sensor.sensor; ++s) first += robot_.sensors[s].channels();
    series_.sensors.push_back(sensor.sensor);
    const std::size_t skipped = sensor.no_orientation ? 4 : 0;
    const bool imu = robot_.sensors[sensor.sensor].type == hal::SensorType::kImu;
    if (imu && !sensor.no_orientation) {
      series_.quaternions.push_back(series_.columns.size());
    }
    for (std::size_t c = 0; c < sensor.columns.size(); ++c) {
      const std::size_t channel = skipped + c;
      Status added = add(sensor.columns[c], sensor.line, sensor.key + ".columns",
                         {false, "sensor", first + channel}, sensor.scale[channel], 0.0);
      if (!added) return added;
    }
    return {};
  }

  /// Every column is used, or ignored with intent.
  Status check_unused() {
    const bool all = std::ranges::find(map_.ignore, "*") != map_.ignore.end();
    std::vector<std::string> unused;
    for (std::size_t f = 0; f < rows_.size(); ++f) {
      for (const std::string& column : rows_[f].names()) {
        const std::string name = full_name(f, column);
        if (std::ranges::find(used_, name) != used_.end()) continue;
        recording_.excluded.ignored.push_back(name);
        const bool follows = robot_.follower(column) != nullptr;
        if (all || follows || std::ranges::find(map_.ignore, name) != map_.ignore.end()) continue;
        unused.push_back(name);
      }
    }
    for (const std::string& name : map_.ignore) {
      const auto& known = recording_.excluded.ignored;
      if (name == "*" || std::ranges::find(known, name) != known.end()) continue;
      return std::unexpected(Error{"no column '" + name + "' is left to be ignored",
                                   suggest(name, known), map_.file, 0, "ignore"});
    }
    if (unused.empty()) return {};
    std::string names;
    for (const std::string& name : unused) names += (names.empty() ? "'" : ", '") + name + "'";
    return std::unexpected(Error{"the map does not say what these columns are: " + names,
                                 "use them, or name them in `ignore` (\"*\": all others)",
                                 files_[0].path,
                                 0,
                                 {}});
  }

  Error at(std::size_t file, std::string message, std::string hint, std::string key = {}) const {
    return {std::move(message), std::move(hint), files_[file].path, rows_[file].line(),
            std::move(key)};
  }

  /// One row of every file; false at the end of all.
  Result<bool> next_rows() {
    std::size_t there = 0;
    for (CsvRows& rows : rows_) there += rows.next() ? 1 : 0;
    if (there == 0) return false;
    if (there == rows_.size()) return true;
    return std::unexpected(at(0, "the files have different numbers of rows",
                              "files side by side have a row for each sample"));
  }

  bool ragged(std::size_t file) const {
    return rows_[file].cells().size() != rows_[file].names().size();
  }

  Status read_rows() {
    for (;;) {
      const Result<bool> there = next_rows();
      if (!there) return std::unexpected(there.error());
      if (!*there) break;
      const std::int64_t number = row_++;
      const auto odd = [&] {
        for (std::size_t f = 0; f < rows_.size(); ++f) {
          if (ragged(f)) return f;
        }
        return rows_.size();
      }();
      if (odd < rows_.size()) {
        Status left =
            leave_out(Trouble::kRagged, recording_.excluded.ragged,
                      at(odd,
                         "has " + counted(rows_[odd].cells().size(), "cell") +
                             ", the others have " + std::to_string(rows_[odd].names().size()),
                         map_.excludes(Trouble::kRagged)
                             ? "no row has as many: are delimiter and header of [csv] right?"
                             : "mend the file, or say exclude = [\"ragged\"]"));
        if (!left) return left;
        continue;
      }
      if (Status read = read_row(number); !read) return read;
    }
    if (series_.rows() == 0 && lost_) return std::unexpected(*lost_);
    return {};
  }

  /// A row that the map wants left out; of the first one it is remembered what is wrong with it,
  /// and what to do when none remains.
  Status leave_out(Trouble trouble, std::uint64_t& count, Error error) {
    if (!map_.excludes(trouble)) return std::unexpected(std::move(error));
    ++count;
    if (!lost_) lost_ = std::move(error);
    return {};
  }

  Result<std::int64_t> time_of(std::int64_t number) const {
    if (!time_) return number * map_.period_ns;
    const CsvRows& rows = rows_[time_->file];
    if (const auto time = rows.time_ns(time_->column, map_.time_unit_ns)) return *time;
    const std::string_view cell = rows.cells()[time_->column];
    if (is_ambiguous_date(cell)) {
      return std::unexpected(
          at(time_->file,
             "'" + shown(cell) + "' is no date that everybody reads alike: which is the day?",
             "write the year first; where the day is first: sed -E "
             "'s#([0-9]+)/([0-9]+)/([0-9]{4})#\\1.\\2.\\3#' FILE > NEW; where the month is: sed -E "
             "'s#([0-9]+)/([0-9]+)/([0-9]{4})#\\2.\\1.\\3#' FILE > NEW",
             *map_.time_column));
    }
    const bool dates = map_.time_unit_ns == 0;
    const bool date = !dates && rows.time_ns(time_->column, 0).has_value();
    const std::string_view text = rows.cells()[time_->column];
    if (const auto known = date ? std::nullopt : refused_time(text))
      return std::unexpected(at(time_->file, known->message, known->hint, *map_.time_column));
    return std::unexpected(
        at(time_->file,
           dates  ? "this time is no date of ISO 8601, such as 2026-11-26T22:02:12.5Z"
           : date ? "this time is a date"
                  : "this time is no number",
           date          ? "say unit = \"iso\" in [time] of the map"
           : has_times() ? "mend the file, or leave such rows out by exclude = [\"invalid\"]"
                         : "no row has one: are column and unit of [time] right?",
           *map_.time_column));
  }

  /// Whether a row has a time that is read: else leaving rows out leaves none. Where they are left
  /// out, it is asked of none.
  bool has_times() const {
    if (map_.excludes(Trouble::kInvalid)) return false;
    CsvRows rows = rows_[time_->file];
    for (bool there = true; there; there = rows.next()) {
      const bool whole = time_->column < rows.cells().size();
      if (whole && rows.time_ns(time_->column, map_.time_unit_ns)) return true;
    }
    return series_.rows() > 0;
  }

  /// Most rows lack a cell that is used: each column has its own times, as a plotter's export has.
  bool is_sparse() const {
    std::vector<CsvRows> rows = rows_;
    std::size_t all = 0, lack = 0;
    for (;; ++all) {
      for (CsvRows& one : rows) {
        if (!one.next()) return 2 * lack > all;
      }
      lack += std::ranges::any_of(places_, [&](const CsvPlace& place) {
        const CsvRows& of = rows[place.file];
        return place.column < of.cells().size() && of.empty(place.column);
      });
    }
  }

  /// A series for the columns that have the same rows.
  Status part_columns() {
    recording_.notes.emplace_back(
        "an empty cell is no sample of its column: each column has its own times");
    const auto there = [&](std::size_t column, std::size_t row) {
      return std::isfinite(series_.columns[column].values[row]);
    };
    std::vector<std::size_t> left(series_.columns.size());
    std::iota(left.begin(), left.end(), std::size_t{0});
    while (!left.empty()) {
      std::vector<std::size_t> rows, together, others;
      for (std::size_t row = 0; row < series_.rows(); ++row) {
        if (there(left.front(), row)) rows.push_back(row);
      }
      for (const std::size_t column : left) {
        bool same = true;
        for (std::size_t row = 0; same && row < series_.rows(); ++row)
          same = there(column, row) == there(left.front(), row);
        (same ? together : others).push_back(column);
      }
      if (Status added = add_part(together, rows); !added) return added;
      left = std::move(others);
    }
    return {};
  }

  Status add_part(const std::vector<std::size_t>& columns, const std::vector<std::size_t>& rows) {
    const std::string first = series_.columns[columns.front()].name;
    if (rows.empty())
      return std::unexpected(Error{"has no number", "is it the right column? Leave it out",
                                   series_.columns[columns.front()].file, 0, first});
    ImportedSeries part;
    part.name = "column " + first;
    if (columns.size() > 1) part.name += " and " + counted(columns.size() - 1, "other");
    part.time_ns = series_.time_ns;
    part.line = series_.line;
    for (const std::size_t column : columns) {
      const Target& target = series_.columns[column].target;
      if (std::ranges::find(series_.quaternions, column) != series_.quaternions.end())
        part.quaternions.push_back(part.columns.size());
      if (target.field == "sensor") {
        add_once(part.sensors, sensor_of(target.index));
      } else {
        add_once(part.joints, target.index);
      }
      part.columns.push_back(std::move(series_.columns[column]));
    }
    for (const std::size_t quaternion : series_.quaternions) {
      const auto of = [&](std::size_t column) {
        return column >= quaternion && column < quaternion + 4;
      };
      const auto count = std::ranges::count_if(columns, of);
      if (count == 0 || count == 4) continue;
      return std::unexpected(Error{"the four columns of an orientation have different rows",
                                   "give each row all four", part.columns.front().file, 0, first});
    }
    keep_rows(part, rows);
    recording_.series.push_back(std::move(part));
    return {};
  }

  static void add_once(std::vector<std::size_t>& list, std::size_t one) {
    if (std::ranges::find(list, one) == list.end()) list.push_back(one);
  }

  /// The sensor that an element of the image's channels is of.
  std::size_t sensor_of(std::size_t channel) const {
    std::size_t sensor = 0;
    for (std::size_t first = 0; channel >= first + robot_.sensors[sensor].channels(); ++sensor)
      first += robot_.sensors[sensor].channels();
    return sensor;
  }

  Error no_number(std::size_t file, const std::string& column) const {
    return at(
        file, "this cell is empty or not finite",
        map_.excludes(Trouble::kInvalid)
            ? "no row is without such a cell: is it the right column?"
            : "mend the file, or leave such rows out by exclude = [\"invalid\"]; where columns "
              "have their own times, say sparse = true in [csv] of the map",
        column);
  }

  Status read_row(std::int64_t number) {
    const auto time = time_of(number);
    if (!time) return leave_out(Trouble::kInvalid, recording_.excluded.invalid, time.error());
    values_.clear();
    std::optional<Error> wrong;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const CsvPlace& place = places_[i];
      const auto value = rows_[place.file].number(place.column);
      const std::string& name = series_.columns[i].name;
      if (!value) {
        return std::unexpected(
            at(place.file,
               "'" + std::string(rows_[place.file].cells()[place.column]) + "' is no number",
               "check [csv] delimiter, header and decimal_comma", name));
      }
      const double scaled = place.scale * *value + place.offset;
      const bool hole = sparse_ && rows_[place.file].empty(place.column);
      if (!std::isfinite(scaled) && !hole && !wrong) wrong = no_number(place.file, name);
      values_.push_back(scaled);
    }
    if (wrong) {
      Status left = leave_out(Trouble::kInvalid, recording_.excluded.invalid, std::move(*wrong));
      if (!left || !sparse_) return left;
    }
    series_.time_ns.push_back(*time);
    series_.line.push_back(rows_[0].line());
    for (std::size_t i = 0; i < values_.size(); ++i) {
      series_.columns[i].values.push_back(values_[i]);
    }
    return {};
  }

  std::span<const ImportFile> files_;
  const ImportMap& map_;
  const hal::RobotConfig& robot_;
  std::vector<CsvRows> rows_;
  std::optional<CsvPlace> time_;
  std::vector<CsvPlace> places_;  // of the series' columns
  std::vector<std::string> used_;
  std::vector<double> values_;  // of one row
  std::int64_t row_ = 0;
  std::optional<Error> lost_;  // what is wrong with the first row that was left out
  bool sparse_ = false;
  ImportedSeries series_;  // of all columns
  ImportedRecording recording_;
};

}  // namespace

Result<ImportedRecording> read_csv_recording(std::span<const ImportFile> files,
                                             const ImportMap& map, const hal::RobotConfig& robot) {
  return CsvSource(files, map, robot).read();
}

}  // namespace tandem::log
