// What the parts of the robot.toml reader share: references, duplicates, node ids.
// Layer: hal, private to robot_config*.cpp.  Thread: non-RT only.
#pragma once

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/nearest.hpp"
#include "base/toml_reader.hpp"
#include "hal/robot_config.hpp"

namespace tandem::hal {

template <class T>
std::vector<std::string> names_of(const std::vector<T>& items) {
  std::vector<std::string> names;
  for (const T& item : items) names.push_back(item.name);
  return names;
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

inline std::array<double, 3> vector3(TomlTable& table, std::string_view key,
                                     std::array<double, 3> value) {
  if (!table.has(key)) return value;
  const std::vector<double> found = table.numbers(key, 3);
  return {found[0], found[1], found[2]};
}

/// Node ids are unique on a bus, boards and sensors together.
struct NodeIds {
  std::set<std::pair<std::string, int>> used;

  int read(TomlTable& table, const std::string& bus) {
    const int id = static_cast<int>(table.integer("node_id", 1, 127));
    if (id != 0 && !bus.empty() && !used.emplace(bus, id).second) {
      table.error("node_id", "node id " + std::to_string(id) + " is taken on bus '" + bus + "'",
                  "every board and sensor of a bus needs an id of its own");
    }
    return id;
  }
};

/// [actuator.NAME] and [gains.NAME].
void read_drive_tables(TomlTable& root, RobotConfig& robot);
/// [joint_defaults] and [[joint]]; after everything that a joint refers to.
void read_joints(TomlTable& root, RobotConfig& robot);

}  // namespace tandem::hal
