#include "apps/robot/scale_facts.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <vector>

#include "base/counted.hpp"

namespace tandem::apps {
namespace {

/// Who says a number: the robot.toml, or the drive's sheet.
const char* source(bool of_sheet) { return of_sheet ? "sheet" : "robot.toml"; }

bool on_sheet(const hal::RobotConfig& robot, const hal::JointConfig& joint) {
  const hal::BoardConfig* board = robot.board(joint.board);
  return board != nullptr && !board->eds.empty();
}

}  // namespace

static void figures(Figures& f, const hal::JointConfig& joint) {
  const bool own = joint.velocity_units_per_rev > 0.0;
  const double velocity =
      own ? joint.velocity_units_per_rev.value : joint.encoder_counts_per_rev.value;
  const double acceleration = joint.acceleration_units_per_rev;
  f("joint", joint.name);
  f("slides", joint.slides);
  f("encoder_counts_per_rev", "of a slide per 2 pi m", joint.encoder_counts_per_rev.value);
  f("encoder_counts_from", "who says that: `robot.toml`, `sheet`",
    source(joint.encoder_counts_per_rev.of_sheet));
  f("velocity_units_per_rev", velocity);
  f("velocity_units_from", "or `counts`",
    own ? source(joint.velocity_units_per_rev.of_sheet) : "counts");
  f("acceleration_units_per_rev", acceleration > 0.0 ? acceleration : velocity);
  f("rated_torque_Nm", "of a slide in N", joint.rated_torque_Nm.value);
  f("rated_torque_from", source(joint.rated_torque_Nm.of_sheet));
  f("reversed", joint.reversed.value);
  f("zero_counts", joint.zero_counts);
  f("encoder_turn_counts", joint.encoder_turn_counts.value);
}

static std::string scale_text(const hal::JointConfig& joint) {
  const std::string text = fmt::format(
      "{{encoder_counts_per_rev:.10g}} counts per {} ({{encoder_counts_from}}), {}, {}rated "
      "{{rated_torque_Nm:.6g}} {} ({{rated_torque_from}}){}",
      joint.slides ? "2 pi m" : "revolution",
      joint.velocity_units_per_rev > 0.0
          ? "{velocity_units_per_rev:.10g} velocity units at one per second ({velocity_units_from})"
          : "velocities in counts per second",
      joint.acceleration_units_per_rev > 0.0
          ? "{acceleration_units_per_rev:.10g} acceleration units (robot.toml), "
          : "",
      joint.slides ? "N" : "Nm", joint.reversed ? ", reversed" : "");
  return figures_text(text, figures_json(joint)).value_or("");
}

void add_scale_facts(const hal::RobotConfig& robot, Facts& facts) {
  struct Scale {
    std::string text;
    std::string joint;  ///< the first
    std::size_t joints = 1;
  };
  std::vector<Scale> scales;
  for (const hal::JointConfig& joint : robot.joints) {
    if (!on_sheet(robot, joint)) continue;
    std::string text = scale_text(joint);
    const auto same = std::ranges::find(scales, text, &Scale::text);
    if (same == scales.end())
      scales.push_back({.text = std::move(text), .joint = joint.name});
    else
      ++same->joints;
  }
  for (const Scale& scale : scales) {
    const std::string others =
        scale.joints == 1 ? "" : fmt::format(" and {}", counted(scale.joints - 1, "other"));
    facts.add("scale", scale.joint + others + ": " + scale.text);
  }
}

std::vector<Figures::Row> scale_figures() { return Figures::rows_of<hal::JointConfig>(); }

void add_scale_json(const hal::RobotConfig& robot, Json& json) {
  std::vector<hal::JointConfig> joints;
  std::ranges::copy_if(robot.joints, std::back_inserter(joints),
                       [&](const hal::JointConfig& joint) { return on_sheet(robot, joint); });
  if (!joints.empty()) json["scales"] = figures_json(joints);
}

}  // namespace tandem::apps
