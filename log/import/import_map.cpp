// The reader of import maps, table by table. Units become factors here.
#include "log/import/import_map.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "base/counted.hpp"
#include "base/nearest.hpp"
#include "base/toml_reader.hpp"
#include "hal/image.hpp"
#include "log/import/import_units.hpp"

namespace tandem::log {
namespace {

class Reader {
 public:
  Reader(const hal::RobotConfig& robot, bool bag) : robot_(robot), bag_(bag) {}

  ImportMap read(TomlTable root) {
    read_joints(root);
    read_exclusions(root);
    read_time(root);
    if (bag_) read_bag(root);
    if (!bag_) read_csv(root);
    for (const Signal& one : kState) read_signal(root, one, false);
    read_command(root);
    read_sensors(root);
    const bool has_position = bag_ || root.has("position");
    if (!has_position) {
      root.error("position", "no column says where the joints are",
                 "give [position] with columns and unit");
    }
    root.finish();
    return std::move(map_);
  }

 private:
  /// None: an error was said, or it follows another.
  std::optional<std::size_t> joint_of(TomlTable& table, std::string_view key,
                                      const std::string& name) {
    const int index = robot_.joint_index(name);
    if (index >= 0) return static_cast<std::size_t>(index);
    if (robot_.follower(name) != nullptr) return std::nullopt;
    const Error none = robot_.no_joint(name);
    table.error(key, none.message, none.hint);
    return std::nullopt;
  }

  void read_joints(TomlTable& root) {
    std::vector<int> seen(robot_.joints.size(), 0);
    TomlTable missing = root.table_or_empty("missing_joints");
    for (const std::string& name : missing.keys()) {
      const double position = missing.number(name);
      const auto joint = joint_of(missing, name, name);
      if (robot_.follower(name) != nullptr)
        missing.error(name, robot_.no_joint(name).message,
                      "remove it: its leader says where it is");
      if (!joint) continue;
      map_.missing[*joint] = position;
      ++seen[*joint];
    }
    missing.finish();
    const bool listed = root.has("joints");
    if (!listed && !bag_) {
      root.error("joints", "is missing: which joints do the columns belong to?",
                 "list the robot's joints in the order of the columns");
    }
    bool all_known = true;
    for (const std::string& name : root.texts_or("joints", {})) {
      listed_.push_back(joint_of(root, "joints", name));
      all_known = all_known && (listed_.back() || robot_.follower(name) != nullptr);
      if (listed_.back()) ++seen[*listed_.back()];
    }
    for (std::size_t j = 0; !listed && j < seen.size(); ++j) {
      if (seen[j] == 0) listed_.emplace_back(j);
    }
    for (const auto& joint : listed_) {
      if (joint) map_.joints.push_back(*joint);
    }
    if (!all_known || root.has_errors()) return;
    for (std::size_t j = 0; j < seen.size(); ++j) {
      const std::string& name = robot_.joints[j].name;
      if (seen[j] > 1) root.error("joints", "names '" + name + "' twice");
      if (listed && seen[j] == 0) {
        root.error("joints", "lacks the robot's joint '" + name + "'",
                   "add it, or name it in missing_joints");
      }
    }
  }

  void read_exclusions(TomlTable& root) {
    static const std::vector<std::pair<std::string, Trouble>> kKinds{
        {"invalid", Trouble::kInvalid},
        {"ragged", Trouble::kRagged},
        {"duplicates", Trouble::kDuplicates},
        {"backwards", Trouble::kBackwards},
        {"gaps", Trouble::kGaps},
        {"frozen", Trouble::kFrozen}};
    map_.ignore = root.texts_or("ignore", {});
    map_.allow_frozen = root.boolean_or("allow_frozen", false);
    std::vector<std::string> known;
    for (const auto& [name, bit] : kKinds) known.push_back(name);
    for (const std::string& kind : root.texts_or("exclude", {})) {
      const auto* found = std::ranges::find(known, kind) == known.end() ? nullptr : &kind;
      if (found == nullptr) {
        root.error("exclude", "there is no such trouble as '" + kind + "'", suggest(kind, known));
      }
      for (const auto& [name, bit] : kKinds) {
        if (name == kind) map_.exclude |= static_cast<std::uint8_t>(bit);
      }
    }
  }

  static std::int64_t ns(double seconds) { return std::llround(seconds * 1e9); }

  void read_time(TomlTable& root) {
    constexpr Range kPeriods{1e-6, 10.0};
    constexpr Range kTimes{0.0, 1e7};
    TomlTable time = root.table_or_empty("time");
    if (time.has("period_s")) map_.period_ns = ns(time.number("period_s", kPeriods));
    const double period_s = static_cast<double>(map_.period_ns) * 1e-9;
    if (time.has("max_gap_s")) {
      map_.max_gap_ns = ns(time.number("max_gap_s", {std::max(period_s, 1e-6), 1e7}));
    }
    map_.begin_ns = ns(time.number_or("begin_s", 0.0, kTimes));
    if (time.has("end_s")) {
      map_.end_ns =
          ns(time.number("end_s", {static_cast<double>(map_.begin_ns) * 1e-9, 1e7, true}));
    }
    const std::string sampling =
        time.choice_or("sampling", "linear", {"linear", "nearest", "previous"});
    if (sampling == "nearest") map_.sampling = Sampling::kNearest;
    if (sampling == "previous") map_.sampling = Sampling::kPrevious;
    if (!bag_) read_time_column(time);
    if (bag_ && time.has("column")) {
      time.error("column", "is a table's: this recording is a bag, whose samples have their times",
                 "remove it; [bag] stamp says which time is a sample's");
    }
    time.finish();
  }

  void read_time_column(TomlTable& time) {
    map_.by_rows = time.boolean_or("by_rows", false);
    if (map_.by_rows) {
      if (time.has("column")) time.error("column", "by_rows = true: there is no time column");
      if (map_.period_ns == 0) {
        time.error("period_s", "is missing: how long is it from one row to the next?");
      }
      return;
    }
    map_.time_column = time.text("column");
    const std::string unit = time.choice("unit", {"s", "ms", "us", "ns", "iso"});
    map_.time_unit_ns = unit == "s"    ? 1'000'000'000
                        : unit == "ms" ? 1'000'000
                        : unit == "us" ? 1'000
                        : unit == "ns" ? 1
                                       : 0;
  }

  void read_csv(TomlTable& root) {
    TomlTable csv = root.table_or_empty("csv");
    const std::string delimiter =
        csv.choice_or("delimiter", "comma", {"comma", "semicolon", "tab", "blank"});
    map_.csv.delimiter = delimiter == "comma"       ? ','
                         : delimiter == "semicolon" ? ';'
                         : delimiter == "tab"       ? '\t'
                                                    : ' ';
    map_.csv.header = csv.boolean_or("header", true);
    map_.csv.decimal_comma = csv.boolean_or("decimal_comma", false);
    if (map_.csv.decimal_comma && map_.csv.delimiter == ',') {
      csv.error("decimal_comma", "a comma cannot be both the delimiter and the decimal point",
                "say delimiter = \"semicolon\"");
    }
    const std::string comment = csv.text_or("comment", "");
    if (comment.size() > 1) csv.error("comment", "is one character");
    if (comment.size() == 1) map_.csv.comment = comment.front();
    map_.csv.skip_lines = static_cast<int>(csv.integer_or("skip_lines", 0, 0, 1000));
    if (csv.has("sparse")) map_.csv.sparse = csv.boolean_or("sparse", false);
    csv.finish();
  }

  void read_bag(TomlTable& root) {
    TomlTable bag = root.table_or_empty("bag");
    if (bag.is_text("joint_states"))
      map_.joint_topics = {bag.text("joint_states")};
    else
      map_.joint_topics = bag.texts_or("joint_states", {});
    if (bag.has("stamp")) map_.stamp = bag.choice("stamp", {"header", "log"});
    TomlTable names = bag.table_or_empty("names");
    for (const std::string& name : names.keys()) {
      const std::string leads_to = names.text(name);
      const auto joint = joint_of(names, name, leads_to);
      if (robot_.follower(leads_to) != nullptr) map_.ignore.push_back(name);
      if (!joint) continue;
      const bool twice =
          std::ranges::any_of(map_.names, [&](const auto& one) { return one.second == *joint; });
      if (twice) names.error(name, "another name leads to the same joint");
      map_.names[name] = *joint;
    }
    names.finish();
    bag.finish();
  }

  /// "q{1}" is q1, q2, …
  std::vector<std::string> columns_of(TomlTable& table, std::size_t count, const char* of) {
    std::vector<std::string> columns;
    if (table.is_text("columns")) {
      const std::string pattern = table.text("columns");
      const std::size_t open = pattern.find('{'), close = pattern.find('}');
      const bool good = open != std::string::npos && close == open + 2 &&
                        pattern[open + 1] >= '0' && pattern[open + 1] <= '9';
      if (!good) {
        table.error("columns", "'" + pattern + "' is no list and no pattern",
                    "list the columns, or write \"q{1}\" for q1, q2, …");
        return columns;
      }
      const auto first = static_cast<std::size_t>(pattern[open + 1] - '0');
      for (std::size_t i = 0; i < count; ++i) {
        columns.push_back(pattern.substr(0, open) + std::to_string(first + i) +
                          pattern.substr(close + 1));
      }
      return columns;
    }
    columns = table.texts_or("columns", {});
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (std::find(columns.begin(), columns.begin() + static_cast<std::ptrdiff_t>(i),
                    columns[i]) == columns.begin() + static_cast<std::ptrdiff_t>(i)) {
        continue;
      }
      table.error("columns", "names '" + columns[i] + "' twice", "a column is one number's");
    }
    if (columns.size() != count) {
      table.error("columns",
                  "has " + std::to_string(columns.size()) + " columns for " +
                      std::to_string(count) + " " + of,
                  "list one for each, in their order");
    }
    return columns;
  }

  /// A list of one number for all, or of one for each.
  static std::vector<double> per_joint(TomlTable& table, std::string_view key, std::size_t count,
                                       double otherwise) {
    std::vector<double> numbers = table.numbers_or(key, {otherwise});
    if (numbers.size() == 1) numbers.resize(count, numbers.front());
    if (numbers.size() != count) {
      table.error(
          key, "has " + std::to_string(numbers.size()) + " numbers for " + counted(count, "joint"),
          "give one for all, or one for each");
      numbers.resize(count, otherwise);
    }
    return numbers;
  }

  /// The factor of `unit` for a joint; an error when it is of another motion.
  double factor_of(TomlTable& table, const Signal& signal, const std::string& unit,
                   std::size_t joint) {
    for (const Unit& one : signal.units) {
      if (one.name != unit) continue;
      const bool slides = robot_.joints[joint].slides;
      if ((one.of == UnitFor::kTurns && slides) || (one.of == UnitFor::kSlides && !slides)) {
        table.error("unit",
                    "is " + unit + ", but the joint '" + robot_.joints[joint].name + "' " +
                        (slides ? "slides" : "turns"),
                    "give a list, a unit for each joint");
      }
      return one.factor;
    }
    return 1.0;
  }

  static std::vector<std::string> unit_names(const Signal& signal) {
    std::vector<std::string> names;
    for (const Unit& one : signal.units) names.emplace_back(one.name);
    return names;
  }

  std::vector<std::string> units_of(TomlTable& table, const Signal& signal) {
    const std::size_t count = listed_.size();
    const std::vector<std::string> known = unit_names(signal);
    if (bag_ && !table.has("unit")) {  // what sensor_msgs/JointState declares
      std::vector<std::string> units;
      for (const auto& joint : listed_) {
        const bool slides = joint && robot_.joints[*joint].slides;
        const UnitFor of = slides ? UnitFor::kSlides : UnitFor::kTurns;
        const auto unit = std::ranges::find(signal.units, of, &Unit::of);
        units.emplace_back(unit->name);
      }
      return units;
    }
    if (table.has("unit") && !table.is_text("unit")) {
      std::vector<std::string> units = table.texts_or("unit", {});
      if (units.size() != count)
        table.error("unit", "is no text and no list of one for each joint");
      for (const std::string& unit : units) {
        if (std::ranges::find(known, unit) == known.end()) {
          table.error("unit", "unknown unit '" + unit + "'", suggest(unit, known));
        }
      }
      units.resize(count);
      return units;
    }
    return std::vector<std::string>(count, table.choice("unit", known));
  }

  void read_signal(TomlTable& parent, const Signal& signal, bool command) {
    const bool given = parent.has(signal.key);
    if (!given && !(bag_ && signal.in_bag && !command)) return;
    TomlTable table = given ? parent.table(signal.key) : parent.table_or_empty(signal.key);
    SignalMap one{.command = command,
                  .field = signal.field,
                  .key = {},
                  .line = table.line(),
                  .columns = {},
                  .unused = {},
                  .scale = {},
                  .offset = {}};
    one.key = (command ? "command." : "") + std::string(signal.key);
    const std::size_t count = listed_.size();
    if (bag_ && given && !signal.in_bag) {
      parent.error(signal.key, "a bag's joint states have position, velocity and effort only",
                   "remove this table");
    }
    if (!bag_) one.columns = columns_of(table, count, "joints");
    const std::vector<std::string> units = units_of(table, signal);
    if (table.has("counts_per_turn") && table.has("scale")) {
      table.error("scale", "is there beside counts_per_turn", "give one of the two");
    }
    one.scale = per_joint(table, "scale", count, 1.0);
    for (const char* key : {"scale", "counts_per_turn"}) {
      const std::vector<double> numbers = table.numbers_or(key, {});
      if (std::ranges::find(numbers, 0.0) == numbers.end()) continue;
      table.error(key, "is 0: every number would be lost", "give the true one");
    }
    one.offset = per_joint(table, "offset", count, 0.0);
    const bool position = signal.units.data() == std::data(kPositions);
    one.unwrap = position && table.boolean_or("unwrap", false);
    const std::vector<double> counts = per_joint(table, "counts_per_turn", count, 0.0);
    for (std::size_t j = 0; j < count && j < one.scale.size() && j < counts.size(); ++j) {
      if (!listed_[j]) continue;
      const double factor = factor_of(table, signal, units[j], *listed_[j]);
      const bool raw = std::isnan(factor);
      if (raw && !table.has("scale") && counts[j] == 0.0) {
        table.error("scale", "is missing: the unit is raw",
                    "give scale (SI units for one of the recording's) or counts_per_turn");
      }
      if (!raw) one.scale[j] *= factor;
      if (counts[j] != 0.0) one.scale[j] = 360.0 * kDegree / counts[j];
    }
    leave_followers(one);
    table.finish();
    map_.signals.push_back(std::move(one));
  }

  /// What the lists have for joints that follow others is not used.
  void leave_followers(SignalMap& one) const {
    const auto keep = [this](auto& list, auto* others) {
      auto all = std::exchange(list, {});
      for (std::size_t j = 0; j < all.size() && j < listed_.size(); ++j) {
        if (listed_[j]) list.push_back(std::move(all[j]));
        if (!listed_[j] && others != nullptr) others->push_back(std::move(all[j]));
      }
    };
    keep(one.columns, &one.unused);
    keep(one.scale, static_cast<std::vector<double>*>(nullptr));
    keep(one.offset, static_cast<std::vector<double>*>(nullptr));
  }

  void read_command(TomlTable& root) {
    if (!root.has("command")) return;
    TomlTable command = root.table("command");
    if (bag_) {
      root.error("command", "a bag's commands are not read", "remove this table");
      return;
    }
    const std::string mode =
        command.choice("mode", {"position", "velocity", "torque", "current", "open_loop"});
    map_.command_mode = static_cast<std::int8_t>(mode == "position"   ? hal::ControlMode::kPosition
                                                 : mode == "velocity" ? hal::ControlMode::kVelocity
                                                 : mode == "torque"   ? hal::ControlMode::kTorque
                                                 : mode == "current"  ? hal::ControlMode::kCurrent
                                                                     : hal::ControlMode::kOpenLoop);
    for (const Signal& one : kCommand) read_signal(command, one, true);
    command.finish();
  }

  void read_sensors(TomlTable& root) {
    if (!root.has("sensor")) return;
    TomlTable all = root.table("sensor");
    if (!all.holds_tables()) return;
    std::vector<std::string> names;
    for (const hal::SensorConfig& sensor : robot_.sensors) names.push_back(sensor.name);
    for (const std::string& name : all.keys()) {
      const int index = robot_.sensor_index(name);
      if (index < 0) {
        all.error(name, "the robot '" + robot_.name + "' has no sensor '" + name + "'",
                  suggest(name, names));
        (void)all.table(name);
        continue;
      }
      TomlTable table = all.table(name);
      read_sensor(table, static_cast<std::size_t>(index));
      table.finish();
    }
    all.finish();
  }

  void read_sensor(TomlTable& table, std::size_t sensor) {
    SensorMap one{.sensor = sensor,
                  .key = table.path(),
                  .line = table.line(),
                  .columns = {},
                  .scale = {},
                  .topic = {},
                  .frame = {}};
    if (bag_) {
      one.topic = table.text("topic");
      one.frame = table.text_or("frame", "");
    }
    const bool wrench = robot_.sensors[sensor].type == hal::SensorType::kForceTorque;
    if (wrench) read_wrench(table, one);
    if (!wrench) read_imu(table, one);
    map_.sensors.push_back(std::move(one));
  }

  void read_wrench(TomlTable& table, SensorMap& one) {
    // Which side of the sensor acts on which is said nowhere in a file.
    const std::string measures = table.choice("measures", {"child_on_parent", "parent_on_child"});
    const double sign = measures == "parent_on_child" ? -1.0 : 1.0;
    one.scale.assign(6, sign);
    if (bag_) return;
    one.columns = columns_of(table, 6, "channels: force x y z, moment x y z");
    const std::string force = table.choice("force_unit", {"N", "kN"});
    const std::string moment = table.choice("moment_unit", {"Nm", "mNm"});
    for (std::size_t i = 0; i < 3; ++i) one.scale[i] *= force == "kN" ? 1e3 : 1.0;
    for (std::size_t i = 3; i < 6; ++i) one.scale[i] *= moment == "mNm" ? 1e-3 : 1.0;
  }

  void read_imu(TomlTable& table, SensorMap& one) {
    one.scale.assign(10, 1.0);
    if (bag_) return;
    const std::string order = table.choice("orientation", {"xyzw", "wxyz", "none"});
    one.no_orientation = order == "none";
    if (one.no_orientation) {
      one.columns = columns_of(table, 6, "channels: angular velocity, specific force");
    } else {
      one.columns = columns_of(table, 10, "channels: quaternion, angular velocity, specific force");
    }
    if (order == "wxyz" && one.columns.size() == 10) {
      std::rotate(one.columns.begin(), one.columns.begin() + 1, one.columns.begin() + 4);
    }
    const std::string rate = table.choice("rate_unit", {"rad/s", "deg/s"});
    const std::string force = table.choice("force_unit", {"m/s2", "g"});
    for (std::size_t i = 4; i < 7; ++i) one.scale[i] = rate == "deg/s" ? kDegree : 1.0;
    for (std::size_t i = 7; i < 10; ++i) one.scale[i] = force == "g" ? 9.80665 : 1.0;
  }

  const hal::RobotConfig& robot_;
  bool bag_;
  /// The joints that the map's lists are of; none: one that follows another, or an error
  std::vector<std::optional<std::size_t>> listed_;
  ImportMap map_;
};

}  // namespace

std::expected<ImportMap, Diagnostics> parse_import_map(const std::string& text,
                                                       const std::string& file,
                                                       const hal::RobotConfig& robot, bool bag) {
  const auto document = TomlDocument::parse(text, file);
  if (!document) return std::unexpected(Diagnostics{document.error()});
  ImportMap map = Reader(robot, bag).read(document->root());
  if (!document->diagnostics().empty()) return std::unexpected(document->diagnostics());
  map.file = file;
  return map;
}

}  // namespace tandem::log
