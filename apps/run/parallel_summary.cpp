#include "apps/run/parallel_summary.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

namespace tandem::apps {
namespace {

using internal_model::Differences;
using internal_model::JointDifference;
using internal_model::SignalDifference;

constexpr double kDegreesApart = 180.0 / std::numbers::pi;
constexpr double kMillimetresApart = 1e3;
constexpr std::size_t kJointsApart = 5;

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
    const auto most = std::ranges::max_element(begin, end, {}, &SignalDifference::square_sum);
    if (most == end || most->max == 0.0) continue;
    table.add({sensor.name, channel_name(sensor.type, static_cast<std::size_t>(most - begin)),
               fmt::format("{:.3g}", all.rms(*most)), fmt::format("{:.3g}", most->max)});
  }
  if (table.rows() == 0) return;
  fmt::print(out, "\n");
  table.print(out);
}

void print_bases_apart(const Json& base, std::FILE* out) {
  if (base.is_null()) return;
  const auto text = [&base](const char* figure) {
    return figures_text(figure, base).value_or("-");
  };
  Table table({"base", "rms", "max"});
  table.add({"apart", text("{position_m.rms:.3f mm}"), text("{position_m.max:.3f mm}")});
  table.add({"turned", text("{angle_rad.rms:.4f deg}"), text("{angle_rad.max:.4f deg}")});
  fmt::print(out, "\n");
  table.print(out);
}

struct Apart {
  double rms = 0.0, max = 0.0;
};
struct JointApart {
  Apart position_rad, velocity_rad_s, torque_Nm;
};
struct BaseApart {
  Apart position_m, angle_rad;
};

Apart apart(const Differences& all, const SignalDifference& one) { return {all.rms(one), one.max}; }

std::optional<BaseApart> base_apart(const Differences& all) {
  if (all.base_position_m() == nullptr) return std::nullopt;
  return BaseApart{apart(all, *all.base_position_m()), apart(all, *all.base_angle_rad())};
}

Named<JointApart> joints_apart(const ParallelSummary& s) {
  Named<JointApart> joints;
  for (const JointDifference& one : s.all->joints()) {
    joints.emplace_back(
        s.second->joints[joints.size()].name,
        JointApart{apart(*s.all, one.position_rad), apart(*s.all, one.velocity_rad_s),
                   apart(*s.all, one.torque_Nm)});
  }
  return joints;
}

Named<std::vector<Apart>> sensors_apart(const ParallelSummary& s) {
  Named<std::vector<Apart>> sensors;
  std::size_t channel = 0;
  for (const hal::SensorConfig& sensor : s.second->sensors) {
    std::vector<Apart> channels;
    for (std::size_t i = 0; i < sensor.channels(); ++i)
      channels.push_back(apart(*s.all, s.all->channels()[channel++]));
    sensors.emplace_back(sensor.name, std::move(channels));
  }
  return sensors;
}

}  // namespace

static void figures(Figures& f, const Apart& one) {
  f("rms", "of first minus second", one.rms);
  f("max", one.max);
}

static void figures(Figures& f, const JointApart& joint) {
  f("position_rad", joint.position_rad);
  f("velocity_rad_s", joint.velocity_rad_s);
  f("torque_Nm", joint.torque_Nm);
}

static void figures(Figures& f, const BaseApart& base) {
  f("position_m", "how far the two are apart", base.position_m);
  f("angle_rad", "by which they are turned", base.angle_rad);
}

void figures(Figures& f, const ParallelSummary& s) {
  f("robot", "its file", [&] { return s.second->file; });
  f("cycles", "that it made", [&] { return s.result->cycles; });
  f("compared", [&] { return s.all->compared(); });
  f("both_followed", "cycles in which both followed their command, of which the figures are",
    [&] { return s.all->cycles(); });
  f("unequal", "of those compared: any field of the state differs",
    [&] { return s.all->unequal(); });
  f("first_unequal", "number of the first such cycle",
    [&] { return known(s.all->first_unequal() >= 0, s.all->first_unequal()); });
  f("missed", "commands that it never got", [&] { return s.result->missed; });
  f("most_behind", "cycles", [&] { return s.result->most_behind; });
  f("fault", [&] { return known(!s.result->fault.empty(), s.result->fault); });
  f("base", "null where one of the two truths is not known, or nothing floats",
    [&] { return base_apart(*s.all); });
  f("joints", [&] { return joints_apart(s); });
  f("sensors", "each channel", [&] { return sensors_apart(s); });
}

void print_parallel(const ParallelSummary& summary, std::FILE* out) {
  const Differences& all = *summary.all;
  const Json json = figures_json(summary);
  if (all.unequal() > 0) {
    print_joints_apart(*summary.second, all, out);
    print_sensors_apart(*summary.second, all, out);
    print_bases_apart(json["base"], out);
  }
  fmt::print(out, "\n");
  Facts facts;
  add_figures(facts, json, "parallel robot",
              all.unequal() == 0
                  ? "the same bits in all {compared|cycle}"
                  : "differs in {unequal} of {compared|cycle}, first in cycle {first_unequal}");
  add_figures(facts, json, "behind the first",
              "{most_behind|cycle} at most, {missed|command} missed");
  add_figures(facts, json, "parallel robot's fault", "{fault}");
  facts.print(out);
}

}  // namespace tandem::apps
