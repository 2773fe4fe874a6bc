// [[passive]] and [[loop]]: joints without a motor, and what closes loops of the tree.
#include <cmath>

#include "hal/config/robot_config_read.hpp"

namespace tandem::hal {
namespace {

void read_passive(TomlTable table, RobotConfig& robot) {
  PassiveConfig passive;
  passive.line = table.line();
  read_whole(table, keys::kPassive, passive);
  check_unique(table, robot.passive, passive.name, "passive joint");
  if (robot.joint_index(passive.name) >= 0) {
    table.error("name", "the joint '" + passive.name + "' has a motor: it is a [[joint]] too",
                "remove one of the two");
  }
  check_not_locked(table, "name", passive.name, robot);
  robot.passive.push_back(passive);
}

void read_axis(TomlTable& table, KinematicLoopConfig& loop) {
  const std::vector<double> axis = table.numbers_or("axis", {0.0, 0.0, 1.0}, kAnyNumber, 3);
  const double length = std::hypot(axis[0], axis[1], axis[2]);
  if (!table.has("axis")) {
    table.error("axis", "a revolute loop needs its axis",
                "give it in the sites' frames: [0, 1, 0]");
  } else if (!(length > 0.0)) {
    table.error("axis", "has no length", "give a direction, as [0, 1, 0]");
  } else {
    for (std::size_t i = 0; i < 3; ++i) loop.axis[i] = axis[i] / length;
  }
}

void read_loop(TomlTable table, RobotConfig& robot) {
  KinematicLoopConfig loop;
  loop.line = table.line();
  read_keys(table, keys::kLoop, loop);
  check_own_name(table, loop.name);
  check_unique(table, robot.loops, loop.name, "loop");
  const std::vector<std::string> sites = table.texts_or("sites", {});
  if (table.has_errors("sites")) {
    // what it holds is no list of texts
  } else if (sites.size() == 2) {
    loop.sites = {sites[0], sites[1]};
    for (const std::string& site : sites) {
      check_reference(table, "sites", site, robot.model.sites, "[[site]]");
      for (const Foot& foot : robot.contact.feet) {
        if (foot.site != site) continue;
        table.error("sites", "the site '" + site + "' is a foot's",
                    "give the loop a [[site]] of its own");
      }
    }
    if (sites[0] == sites[1]) {
      table.error("sites", "a loop closes between two sites, not one", "name two");
    }
  } else {
    table.error("sites", "must name two [[site]]s, and names " + std::to_string(sites.size()),
                "sites = [\"one\", \"other\"]");
  }
  if (loop.type == model::KinematicLoopType::kRevolute) read_axis(table, loop);
  if (loop.type == model::KinematicLoopType::kRod)
    loop.length_m = table.number("length_m", {1e-4, 100.0});
  if (!table.has("type") ||
      table.has_errors("type")) {  // either key may belong to the one that is meant
    (void)table.numbers_or("axis", {});
    (void)table.number_or("length_m", 0.0);
  }
  table.finish();
  robot.loops.push_back(loop);
}

}  // namespace

void read_loops(TomlTable& root, RobotConfig& robot) {
  for (TomlTable& passive : root.tables("passive")) read_passive(passive, robot);
  for (TomlTable& loop : root.tables("loop")) read_loop(loop, robot);
}

}  // namespace tandem::hal
