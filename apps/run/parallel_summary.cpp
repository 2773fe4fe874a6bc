#include "apps/run/parallel_summary.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "base/counted.hpp"

namespace tandem::apps {
namespace {

using internal_model::Difference;
using internal_model::Differences;
using internal_model::JointDifference;
using internal_model::ParallelResult;

constexpr double kDegreesApart = 180.0 / std::numbers::pi;
constexpr double kMillimetresApart = 1e3;
constexpr std::size_t kJointsApart = 5;

Json figures_json(const Differences& all, const Difference& one) {
  return {{"rms", all.rms(one)}, {"max", one.max}};
}

void print_joints_apart(const hal::RobotConfig& robot, const Differences& all, std::FILE* out) {
  std::vector<std::size_t> order(all.joints().size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::ranges::greater{},
                           [&](std::size_t j) { return all.joints()[j].torque_Nm.square_sum; });
  order.resize(std::min(kJointsApart, order.size()));
  Table table({"parallel: first minus second", "position rms", "max", "torque rms", "max"});
  for (const std::size_t j : order) {
    const JointDifference& one = all.joints()[j];
    const bool slides = robot.joints[j].slides;
    const double factor = slides ? kMillimetresApart : kDegreesApart;
    const char* unit = slides ? "mm" : "deg";
    const char* effort = slides ? "N" : "Nm";
    table.add({robot.joints[j].name,
               fmt::format("{:.4f} {}", all.rms(one.position_rad) * factor, unit),
               fmt::format("{:.4f} {}", one.position_rad.max * factor, unit),
               fmt::format("{:.3f} {}", all.rms(one.torque_Nm), effort),
               fmt::format("{:.3f} {}", one.torque_Nm.max, effort)});
  }
  fmt::print(out, "\n");
  table.print(out);
}

std::string channel_name(hal::SensorType type, std::size_t channel) {
  constexpr const char* kWrench[] = {"force x [N]",   "force y [N]",   "force z [N]",
                                     "torque x [Nm]", "torque y [Nm]", "torque z [Nm]"};
  constexpr const char* kImu[] = {"orientation x",
                                  "orientation y",
                                  "orientation z",
                                  "orientation w",
                                  "angular velocity x [rad/s]",
                                  "angular velocity y [rad/s]",
                                  "angular velocity z [rad/s]",
                                  "specific force x [m/s2]",
                                  "specific force y [m/s2]",
                                  "specific force z [m/s2]"};
  const bool wrench = type == hal::SensorType::kForceTorque;
  return wrench ? kWrench[channel] : kImu[channel];
}

/// Each sensor's channel that differs most.
void print_sensors_apart(const hal::RobotConfig& robot, const Differences& all, std::FILE* out) {
  Table table({"sensor", "channel", "rms", "max"});
  std::size_t first = 0;
  for (const hal::SensorConfig& sensor : robot.sensors) {
    const auto begin = all.channels().begin() + static_cast<std::ptrdiff_t>(first);
    const auto end = begin + static_cast<std::ptrdiff_t>(sensor.channels());
    first += sensor.channels();
    const auto most = std::ranges::max_element(begin, end, {}, &Difference::square_sum);
    if (most == end || most->max == 0.0) continue;
    table.add({sensor.name, channel_name(sensor.type, static_cast<std::size_t>(most - begin)),
               fmt::format("{:.3g}", all.rms(*most)), fmt::format("{:.3g}", most->max)});
  }
  if (table.rows() == 0) return;
  fmt::print(out, "\n");
  table.print(out);
}

void print_bases_apart(const Differences& all, std::FILE* out) {
  if (all.base_position_m() == nullptr) return;
  const Difference &place = *all.base_position_m(), &angle = *all.base_angle_rad();
  Table table({"base", "rms", "max"});
  table.add({"apart", fmt::format("{:.3f} mm", all.rms(place) * kMillimetresApart),
             fmt::format("{:.3f} mm", place.max * kMillimetresApart)});
  table.add({"turned", fmt::format("{:.4f} deg", all.rms(angle) * kDegreesApart),
             fmt::format("{:.4f} deg", angle.max * kDegreesApart)});
  fmt::print(out, "\n");
  table.print(out);
}

std::string sameness(const Differences& all) {
  if (all.unequal() == 0) {
    return fmt::format("the same bits in all {}", counted(all.compared(), "cycle"));
  }
  return fmt::format("differs in {} of {}, first in cycle {}", all.unequal(),
                     counted(all.compared(), "cycle"), all.first_unequal());
}

}  // namespace

Json parallel_json(const hal::RobotConfig& second, const ParallelResult& result,
                   const Differences& all) {
  Json json{{"robot", second.file},
            {"cycles", result.cycles},
            {"compared", all.compared()},
            {"both_followed", all.cycles()},
            {"unequal", all.unequal()},
            {"first_unequal", all.first_unequal() < 0 ? Json() : Json(all.first_unequal())},
            {"missed", result.missed},
            {"most_behind", result.most_behind},
            {"fault", result.fault.empty() ? Json() : Json(result.fault)},
            {"base", Json()},
            {"joints", Json::object()},
            {"sensors", Json::object()}};
  if (all.base_position_m() != nullptr) {
    json["base"] = {{"position_m", figures_json(all, *all.base_position_m())},
                    {"angle_rad", figures_json(all, *all.base_angle_rad())}};
  }
  for (std::size_t j = 0; j < all.joints().size(); ++j) {
    const JointDifference& one = all.joints()[j];
    json["joints"][second.joints[j].name] = {
        {"position_rad", figures_json(all, one.position_rad)},
        {"velocity_rad_s", figures_json(all, one.velocity_rad_s)},
        {"torque_Nm", figures_json(all, one.torque_Nm)}};
  }
  std::size_t channel = 0;
  for (const hal::SensorConfig& sensor : second.sensors) {
    Json channels = Json::array();
    for (std::size_t i = 0; i < sensor.channels(); ++i) {
      channels.push_back(figures_json(all, all.channels()[channel++]));
    }
    json["sensors"][sensor.name] = std::move(channels);
  }
  return json;
}

void print_parallel(const hal::RobotConfig& second, const ParallelResult& result,
                    const Differences& all, std::FILE* out) {
  if (all.unequal() > 0) {
    print_joints_apart(second, all, out);
    print_sensors_apart(second, all, out);
    print_bases_apart(all, out);
  }
  fmt::print(out, "\n");
  Facts facts;
  facts.add("parallel robot", sameness(all));
  facts.add("behind the first",
            fmt::format("{} at most, {} missed", counted(result.most_behind, "cycle"),
                        counted(result.missed, "command")));
  if (!result.fault.empty()) facts.add("parallel robot's fault", result.fault);
  facts.print(out);
}

}  // namespace tandem::apps
