// A site's numbers become the link's, so that the plant knows links alone.
#include "hal/sim/payload.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>

#include "base/nearest.hpp"
#include "model/placements.hpp"
#include "model/urdf.hpp"

namespace tandem::sim {
namespace {

template <class Items>
std::vector<std::string> names_of(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) names.push_back(item.name);
  return names;
}

}  // namespace

std::string words_of(const ScenarioFault& payload, const model::Tree& tree) {
  char mass[32];
  std::snprintf(mass, sizeof mass, "%.6g kg", payload.value);
  const auto link = static_cast<std::size_t>(payload.link);
  return mass + (link < tree.links.size() ? " on " + tree.links[link].name : "");
}

std::string too_heavy(const ScenarioFault& payload, const model::Tree& tree) {
  double robot_kg = 0.0;
  for (const model::Link& link : tree.links) robot_kg += link.inertia.mass_kg;
  if (payload.value <= robot_kg) return {};
  char mass[32];
  std::snprintf(mass, sizeof mass, "%.4g kg", robot_kg);
  return words_of(payload, tree) + " is heavier than the whole robot, " + mass;
}

Load load_of(const ScenarioFault& payload) noexcept TANDEM_RT {
  const auto& [xx, xy, xz, yy, yz, zz] = payload.inertia_kg_m2;
  Load load{static_cast<std::size_t>(payload.link), {}};
  load.in_link.mass_kg = payload.value;
  load.in_link.com_m = Eigen::Vector3d(payload.point_m.data());
  load.in_link.about_com_kg_m2 << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return load;
}

std::optional<model::Placement> read_place(TomlTable& table, const hal::RobotConfig& robot,
                                           const model::Tree* tree, const std::string& not_there,
                                           ScenarioFault& fault) {
  if (tree == nullptr) {
    table.error("", "nothing says what links the robot has", "run it with its description");
    return {};
  }
  const bool by_site = table.has("site");
  model::Placement frame;
  if (by_site) {
    const std::int32_t at = index_in(table, "site", names_of(robot.model.sites));
    if (table.has("link")) {
      (void)table.text("link");
      table.error("site", "this is at one place, and `link` names another", "keep one of both");
    }
    if (at < 0) return {};
    const hal::SiteConfig& site = robot.model.sites[static_cast<std::size_t>(at)];
    frame = model::placement_of(site.xyz_m, site.rpy_rad);
    fault.link = tree->link_index(site.link);
  } else {
    fault.link = index_in(table, "link", names_of(tree->links));
  }
  if (fault.link < 0) return {};
  const int body = tree->links[static_cast<std::size_t>(fault.link)].body;
  if (body == 0 && !tree->floating_base) {
    table.error(by_site ? "site" : "link", "it is fixed to the world: " + not_there,
                "name what moves");
    return {};
  }
  if (body > 0)
    fault.joint = robot.joint_index(tree->joints[static_cast<std::size_t>(body - 1)].name);
  return frame;
}

std::int32_t index_in(TomlTable& table, const char* key, const std::vector<std::string>& known) {
  const std::string name = table.text(key);
  const auto found = std::ranges::find(known, name);
  if (found != known.end()) return static_cast<std::int32_t>(found - known.begin());
  if (!name.empty()) {
    table.error(key, "the robot has no " + std::string(key) + " '" + name + "'",
                suggest(name, known));
  }
  return -1;
}

void read_payload(TomlTable& table, const hal::RobotConfig& robot, const model::Tree* tree,
                  ScenarioFault& payload) {
  payload.kind = hal::FaultKind::kPayload;
  const std::optional<model::Placement> frame =
      read_place(table, robot, tree, "it carries nothing", payload);
  payload.value = table.number("mass_kg", {0.0, 1e5, true});
  const auto com_m = table.numbers_or("com_m", {0.0, 0.0, 0.0}, {-100.0, 100.0}, 3);
  const auto moments = table.numbers_or("inertia_kg_m2", std::vector<double>(6), {-1e6, 1e6}, 6);
  if (!frame || com_m.size() != 3 || moments.size() != 6) return;
  std::ranges::copy(com_m, payload.point_m.begin());
  std::ranges::copy(moments, payload.inertia_kg_m2.begin());
  const model::Inertia given = load_of(payload).in_link;
  if (const std::string problem = model::inertia_problem(given);
      table.has("inertia_kg_m2") && !table.has_errors() && !problem.empty()) {
    table.error("inertia_kg_m2", problem,
                "[ixx, ixy, ixz, iyy, iyz, izz] about the center of mass; without it, the payload "
                "is a point");
  }
  const model::Inertia in_link = *frame * given;
  const Eigen::Matrix3d& I = in_link.about_com_kg_m2;
  payload.inertia_kg_m2 = {I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)};
  std::copy_n(in_link.com_m.data(), 3, payload.point_m.begin());
}

}  // namespace tandem::sim
