// Rows of all files together: one series with a column for each number that the map uses.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "base/nearest.hpp"
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

  Result<Recording> read() {
    for (const ImportFile& file : files_) {
      auto rows = CsvRows::open(file.text, file.path, map_.csv);
      if (!rows) return std::unexpected(rows.error());
      rows_.push_back(std::move(*rows));
    }
    if (Status placed = place_columns(); !placed) return std::unexpected(placed.error());
    if (Status done = check_unused(); !done) return std::unexpected(done.error());
    if (Status done = read_rows(); !done) return std::unexpected(done.error());
    recording_.series.push_back(std::move(series_));
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
        if (all || std::ranges::find(map_.ignore, name) != map_.ignore.end()) continue;
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
      if (!*there) return {};
      const std::int64_t number = row_++;
      const auto odd = [&] {
        for (std::size_t f = 0; f < rows_.size(); ++f) {
          if (ragged(f)) return f;
        }
        return rows_.size();
      }();
      if (odd < rows_.size()) {
        if (!map_.excludes(Trouble::kRagged)) {
          return std::unexpected(at(odd,
                                    "has " + std::to_string(rows_[odd].cells().size()) +
                                        " cells, the others have " +
                                        std::to_string(rows_[odd].names().size()),
                                    "mend the file, or say exclude = [\"ragged\"]"));
        }
        ++recording_.excluded.ragged;
        continue;
      }
      if (Status read = read_row(number); !read) return read;
    }
  }

  Result<std::int64_t> time_of(std::int64_t number) const {
    if (!time_) return number * map_.period_ns;
    const auto time = rows_[time_->file].time_ns(time_->column, map_.time_unit_ns);
    if (time) return *time;
    return std::unexpected(at(time_->file, "this time is no number",
                              "mend the file, or leave such rows out by exclude = [\"invalid\"]",
                              *map_.time_column));
  }

  Status read_row(std::int64_t number) {
    const auto time = time_of(number);
    if (!time && map_.excludes(Trouble::kInvalid)) {
      ++recording_.excluded.invalid;
      return {};
    }
    if (!time) return std::unexpected(time.error());
    values_.clear();
    bool valid = true;
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
      if (!std::isfinite(scaled) && !map_.excludes(Trouble::kInvalid)) {
        return std::unexpected(at(place.file, "this cell is empty or not finite",
                                  "mend the file, or leave such rows out by exclude = "
                                  "[\"invalid\"]",
                                  name));
      }
      valid = valid && std::isfinite(scaled);
      values_.push_back(scaled);
    }
    if (!valid) {
      ++recording_.excluded.invalid;
      return {};
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
  Series series_;
  Recording recording_;
};

}  // namespace

Result<Recording> read_csv_recording(std::span<const ImportFile> files, const ImportMap& map,
                                     const hal::RobotConfig& robot) {
  return CsvSource(files, map, robot).read();
}

}  // namespace tandem::log
