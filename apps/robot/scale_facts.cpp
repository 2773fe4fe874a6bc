#include "apps/robot/scale_facts.hpp"

#include <fmt/core.h>

#include <algorithm>
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

std::string scale_text(const hal::JointConfig& joint) {
  const std::string velocity = joint.velocity_units_per_rev > 0.0
                                   ? fmt::format("{:.10g} velocity units at one per second ({})",
                                                 joint.velocity_units_per_rev.value,
                                                 source(joint.velocity_units_per_rev.of_sheet))
                                   : std::string("velocities in counts per second");
  const std::string acceleration = joint.acceleration_units_per_rev > 0.0
                                       ? fmt::format("{:.10g} acceleration units (robot.toml), ",
                                                     joint.acceleration_units_per_rev)
                                       : std::string();
  return fmt::format("{:.10g} counts per {} ({}), {}, {}rated {:.6g} {} ({}){}",
                     joint.encoder_counts_per_rev.value, joint.slides ? "2 pi m" : "revolution",
                     source(joint.encoder_counts_per_rev.of_sheet), velocity, acceleration,
                     joint.rated_torque_Nm.value, joint.slides ? "N" : "Nm",
                     source(joint.rated_torque_Nm.of_sheet), joint.reversed ? ", reversed" : "");
}

}  // namespace

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
    if (same != scales.end()) {
      ++same->joints;
    } else {
      scales.push_back({.text = std::move(text), .joint = joint.name});
    }
  }
  for (const Scale& scale : scales) {
    const std::string others =
        scale.joints == 1 ? "" : fmt::format(" and {}", counted(scale.joints - 1, "other"));
    facts.add("scale", scale.joint + others + ": " + scale.text);
  }
}

void add_scale_json(const hal::RobotConfig& robot, Json& json) {
  Json scales = Json::array();
  for (const hal::JointConfig& joint : robot.joints) {
    if (!on_sheet(robot, joint)) continue;
    const double counts = joint.encoder_counts_per_rev;
    const bool own_velocity = joint.velocity_units_per_rev > 0.0;
    const double velocity = own_velocity ? joint.velocity_units_per_rev.value : counts;
    scales.push_back(
        {{"joint", joint.name},
         {"slides", joint.slides},
         {"encoder_counts_per_rev", counts},
         {"encoder_counts_from", source(joint.encoder_counts_per_rev.of_sheet)},
         {"velocity_units_per_rev", velocity},
         {"velocity_units_from",
          own_velocity ? source(joint.velocity_units_per_rev.of_sheet) : "counts"},
         {"acceleration_units_per_rev",
          joint.acceleration_units_per_rev > 0.0 ? joint.acceleration_units_per_rev : velocity},
         {"rated_torque_Nm", joint.rated_torque_Nm.value},
         {"rated_torque_from", source(joint.rated_torque_Nm.of_sheet)},
         {"reversed", joint.reversed.value},
         {"zero_counts", joint.zero_counts},
         {"encoder_turn_counts", joint.encoder_turn_counts.value}});
  }
  if (!scales.empty()) json["scales"] = std::move(scales);
}

}  // namespace tandem::apps
