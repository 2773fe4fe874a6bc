#include "apps/tools/right_angles.hpp"

#include <fmt/format.h>

#include "model/generate.hpp"

namespace tandem::apps {

namespace {

/// 1.57: perhaps meant as a right angle, and too far from it to be taken for one.
void add_perhaps(const model::RightAngles& found, Facts& facts, Json& json) {
  if (found.perhaps == 0) return;
  json["perhaps_right_angles"] = {{"count", found.perhaps},
                                  {"worst_rad", found.perhaps_worst_rad},
                                  {"first", found.perhaps_first}};
  facts.add("angles", fmt::format("{} in rpy, the first of {}, {} up to {:.1g} rad off a right "
                                  "angle: taken as written",
                                  found.perhaps, found.perhaps_first,
                                  found.perhaps == 1 ? "is" : "are", found.perhaps_worst_rad));
  facts.add("", "if right ones are meant, write them with all their digits");
}

}  // namespace

Status add_right_angles(const robot::RobotFiles& robot, Facts& facts, Json& json) {
  add_perhaps(robot.right_angles, facts, json);
  if (robot.right_angles.count == 0) return {};
  hal::RobotConfig other = robot.config;
  other.model.exact_right_angles = !robot.config.model.exact_right_angles;
  const auto turned = robot::with_description(std::move(other), robot.files);
  if (!turned) return std::unexpected(turned.error().front());
  const bool exact = robot.config.model.exact_right_angles;
  const robot::RobotFiles& exactly = exact ? robot : *turned;
  const robot::RobotFiles& written = exact ? *turned : robot;
  const model::Displacement moved = model::largest_displacement(written.tree, exactly.tree);
  const auto count = [](const robot::RobotFiles& files) {
    return model::count_kernel(model::Kernel::kForwardDynamics, files.tree, files.spec);
  };
  const Result<model::OperationCount> before = count(written);
  const Result<model::OperationCount> after = count(exactly);
  if (!before) return std::unexpected(before.error());
  if (!after) return std::unexpected(after.error());
  json["right_angles"] = {{"count", robot.right_angles.count},
                          {"worst_rad", robot.right_angles.worst_rad},
                          {"exact", exact},
                          {"operations_as_written", before->add + before->mul},
                          {"operations_exact", after->add + after->mul},
                          {"link", moved.link},
                          {"displacement_m", moved.distance_m}};
  const bool saves = after->add + after->mul < before->add + before->mul;
  if (!exact && !saves) return {};
  facts.add("right angles",
            fmt::format("{} are written with few digits, at most {:.1g} rad off; {}",
                        robot.right_angles.count, robot.right_angles.worst_rad,
                        exact ? "taken as exact" : "taken as written"));
  facts.add("", fmt::format("exact ones take {} operations in the dynamics instead of {}; {}",
                            after->add + after->mul, before->add + before->mul,
                            moved.link.empty() ? "no link moves"
                                               : fmt::format("{} moves by at most {:.2g} mm",
                                                             moved.link, 1e3 * moved.distance_m)));
  if (!exact) facts.add("", "right_angles = \"exact\" in [model] takes them");
  return {};
}

}  // namespace tandem::apps
