// tandem predict: what a running robot will do, by its model, as a table.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "apps/clients/asked.hpp"
#include "apps/text/figures.hpp"

namespace tandem::apps {
namespace {

constexpr double kDegreesOfOne = 180.0 / std::numbers::pi;
constexpr std::size_t kMovedShown = 8;

struct MovedJoint {
  std::string joint;
  bool slides = false;
  double now = 0.0, end = 0.0, low = 0.0, high = 0.0, torque = 0.0;
};

std::vector<MovedJoint> moved_joints(const Json& joints) {
  std::vector<MovedJoint> rows;
  for (const auto& [name, one] : joints.items()) {
    const auto position = one["position_rad"].get<std::vector<double>>();
    const auto torque = one["torque_Nm"].get<std::vector<double>>();
    if (position.empty()) continue;
    const auto [low, high] = std::ranges::minmax(position);
    MovedJoint row{name, one.value("slides", false), position.front(), position.back(), low, high,
                   0.0};
    for (const double value : torque) row.torque = std::max(row.torque, std::abs(value));
    rows.push_back(row);
  }
  std::ranges::stable_sort(rows, std::ranges::greater{},
                           [](const MovedJoint& row) { return row.high - row.low; });
  return rows;
}

void print_prediction(const Json& answer) {
  std::vector<MovedJoint> rows = moved_joints(answer["joints"]);
  const std::size_t all = rows.size();
  rows.resize(std::min(kMovedShown, all));
  Table table({"moves most", "now", "then", "lowest", "highest", "largest torque"});
  for (const MovedJoint& row : rows) {
    const double factor = row.slides ? 1e3 : kDegreesOfOne;
    const auto position = [&](double value) {
      return fmt::format("{:.2f} {}", value * factor, row.slides ? "mm" : "deg");
    };
    table.add({row.joint, position(row.now), position(row.end), position(row.low),
               position(row.high), fmt::format("{:.2f} {}", row.torque, row.slides ? "N" : "Nm")});
  }
  table.print(stdout);
  fmt::print("\n");
  const double cpu_s = answer.value("cpu_s", 0.0);
  const auto period_s = static_cast<double>(answer.value("period_ns", std::int64_t{0})) * 1e-9;
  const double ahead_s = static_cast<double>(answer.value("cycles", std::uint64_t{0})) * period_s;
  Facts facts;
  add_figures(facts, answer, "from", "{from_s:.3f s}");
  const std::string end = answer.value("end", "?");
  facts.add("ahead", fmt::format("{:.3f} s, {}", ahead_s,
                                 end == "horizon"    ? "as far as was asked for"
                                 : end == "run over" ? "then the run is over"
                                                     : "then it diverges"));
  facts.add("computed in", fmt::format("{:.1f} ms of one core: {:.0f} x real time", cpu_s * 1e3,
                                       cpu_s > 0.0 ? ahead_s / cpu_s : 0.0));
  add_figures(facts, answer, "cost the loop", "{loop_ns:.1f us}, {loop_bytes:.1f kB} written down");
  const Json& base = answer["base"];
  if (base.is_object() && !base["position_m"].empty()) {
    facts.add("base height",
              fmt::format("{:.4f} m, then {:.4f} m", base["position_m"].front()[2].get<double>(),
                          base["position_m"].back()[2].get<double>()));
  }
  facts.add("faults to come", std::to_string(answer["faults"].size()));
  facts.print(stdout);
  for (const Json& fault : answer["faults"]) {
    fmt::print("fault: {}\n",
               shown(figures_text(fault["joint"] == "" ? "{time_s:.3f s}: {cause}"
                                                       : "{time_s:.3f s}: {joint}: {cause}",
                                  fault)
                         .value_or(""),
                     2'000));
  }
}

}  // namespace

Result<Exit> tell_prediction(Asked& asked) {
  if (asked.prints()) print_prediction(asked.answer);
  for (const Json& name : asked.answer.value("unarchived_controllers", Json::array())) {
    print_warnings({{.message = fmt::format("the controller '{}' has no archive(): its copy began "
                                            "anew, and what it would do may be something else",
                                            name.get<std::string>()),
                     .hint = "give its class an archive() (docs/controllers.md#writing-one)",
                     .file = {},
                     .key = {}}});
  }
  return Exit::kDone;
}

}  // namespace tandem::apps
