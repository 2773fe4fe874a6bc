// What the parts of the robot.toml reader share: references, duplicates, defaults, node ids.
// Layer: hal, private to robot_config*.cpp.  Thread: non-RT only.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/file_name.hpp"
#include "base/nearest.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/config/robot_keys.hpp"

namespace tandem::hal {

template <class T>
std::vector<std::string> names_of(const std::vector<T>& items) {
  std::vector<std::string> names;
  for (const T& item : items) names.push_back(item.name);
  return names;
}

/// Reports a `name` that robot.toml itself gives and that cannot stand in files and messages.
inline void check_own_name(TomlTable& table, const std::string& name) {
  const std::string problem = name.empty() ? "" : file_name_problem(name);
  if (problem.empty()) return;  // an empty one has been said
  table.error("name", "'" + name + "' " + problem + ", but it becomes part of file names",
              "use letters, digits, _, - and ., at most " + std::to_string(kLongestFileName));
}

/// "0x00000192"
inline std::string hex(std::uint32_t value) {
  std::array<char, 16> text{};
  (void)std::snprintf(text.data(), text.size(), "0x%08X", value);
  return text.data();
}

/// The bus of a board or sensor. @param bus  whose table holds this one; empty: `bus` names it
inline std::string read_bus_name(TomlTable& table, const std::string& bus) {
  if (bus.empty()) return table.text("bus");
  if (table.has("bus")) {
    (void)table.text_or("bus", {});
    table.error("bus", "this stands in the table of bus '" + bus + "' already", "remove this key");
  }
  return bus;
}

/// Reports a `name` that an earlier item of `items` has.
template <class T>
void check_unique(TomlTable& table, const std::vector<T>& items, const std::string& name,
                  const std::string& kind) {
  if (name.empty()) return;
  for (const T& item : items) {
    if (item.name == name) {
      table.error("name", "the " + kind + " '" + name + "' is described twice",
                  "remove or rename one of them");
      return;
    }
  }
}

/// Reports a value of `key` that names nothing in `items`.
template <class T>
void check_reference(TomlTable& table, std::string_view key, const std::string& name,
                     const std::vector<T>& items, const std::string& kind) {
  const std::vector<std::string> known = names_of(items);
  if (name.empty() || std::ranges::find(known, name) != known.end()) return;
  table.error(key, "there is no " + kind + " '" + name + "'", suggest(name, known));
}

/// Reports a [[joint]] or [[passive]] that [model.lock] fixes.
inline void check_not_locked(TomlTable& table, std::string_view key, const std::string& joint,
                             const RobotConfig& robot) {
  if (!robot.model.lock_lines.contains(joint)) return;
  table.error(key, "the joint '" + joint + "' is locked in [model.lock]",
              "remove it here, or the lock");
}

/// Reads [KIND_defaults] once by itself, so that each of its keys is checked whoever uses it.
/// @param read  what reads the keys that may stand there
template <class Read>
TomlTable read_defaults(TomlTable& root, std::string_view key, const Read& read) {
  TomlTable defaults = root.table_or_empty(key);
  defaults.make_partial();
  (void)read(defaults);
  defaults.finish();
  return defaults;
}

/// Node ids are unique on a bus, boards and sensors together. Without a `node_id` it is one more
/// than that of the node before it on its bus.
class NodeIds {
 public:
  int read(TomlTable& table, const std::string& bus) {
    int& last = last_[bus];
    const int id = static_cast<int>(table.integer_or("node_id", last + 1, 1, kMasterNodeId - 1));
    if (id >= kMasterNodeId) {
      table.error("node_id", "no node id is left after 126 on bus '" + bus + "'",
                  "set node_id, here or of the node before");
    } else if (!bus.empty() && !used_.emplace(bus, id).second) {
      table.error("node_id", "node id " + std::to_string(id) + " is taken on bus '" + bus + "'",
                  "every board and sensor of a bus needs an id of its own");
    }
    last = id;
    return id;
  }

 private:
  std::map<std::string, int, std::less<>> last_;
  std::set<std::pair<std::string, int>> used_;
};

/// A board's table and the joints that it lists, axis by axis.
struct BoardTable {
  TomlTable table;
  std::string board;
  std::vector<std::string> joints;
};

/// The axis of a board that moves a joint, where the board lists its joints.
struct AxisAssignment {
  std::string joint;
  std::string board;
  int axis = 0;
};

/// [actuator.NAME], [gains.NAME] and their defaults.
void read_drive_tables(TomlTable& root, RobotConfig& robot);
/// A table of a bus' `sensors`, to be read after every board.
struct SensorTable {
  TomlTable table;
  std::string bus;
};
/// [[bus]] with its boards, then [[board]]; and their defaults.
/// @param sensors  out: those that stand in a bus
[[nodiscard]] std::vector<BoardTable> read_buses(TomlTable& root, NodeIds& ids, RobotConfig& robot,
                                                 std::vector<SensorTable>& sensors);
/// The joints that boards list, in that order.
[[nodiscard]] std::vector<AxisAssignment> axes_listed_by(std::span<const BoardTable> boards);
/// The units of a drive of another make: the joint's table's, else those of its sheet. Reports what
/// neither says, and keys that are not for our own boards.
void complete_units(TomlTable& table, const RobotConfig& robot, JointConfig& joint);
/// [joint_defaults] and [[joint]]; after everything that a joint refers to. Those that a board
/// lists come first, in that order.
void read_joints(TomlTable& root, std::span<const AxisAssignment> listed, RobotConfig& robot,
                 std::vector<JointReference>& loose);
/// A board's axes are numbered from 0 without a gap, there is at least one, and every joint that
/// it lists is there.
void check_boards(std::span<BoardTable> boards, const RobotConfig& robot,
                  std::vector<JointReference>& loose);
/// [[passive]] and [[loop]]; after the joints, the sites and the contact.
void read_loops(TomlTable& root, RobotConfig& robot);

}  // namespace tandem::hal
