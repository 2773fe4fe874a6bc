#include "apps/robot/loop_facts.hpp"

#include <fmt/core.h>

namespace tandem::apps {
namespace {

const char* type_text(model::KinematicLoopType type) {
  switch (type) {
    case model::KinematicLoopType::kBall: return "ball";
    case model::KinematicLoopType::kRevolute: return "revolute";
    case model::KinematicLoopType::kRod: break;
  }
  return "rod";
}

}  // namespace

void add_loop_facts(const hal::RobotConfig& robot, const robot::ClosureStudy& study, Facts& facts) {
  for (const model::KinematicLoop& loop : robot.loops) {
    facts.add("loop " + loop.name,
              fmt::format("{}, {} to {}", type_text(loop.type), loop.sites[0], loop.sites[1]));
  }
  for (const robot::ClosureInPosture& one : study.postures) {
    std::string text = fmt::format(
        "{} from a gap of {:.3g} m:", one.closed ? "closes" : "does not close", one.start_gap_m);
    for (std::size_t i = 0; i < one.passive.size(); ++i) {
      text += fmt::format("{} {} {:.4f}", i == 0 ? "" : ",", one.passive[i].first,
                          one.passive[i].second);
    }
    facts.add(one.posture.empty() ? "every joint at 0" : "posture " + one.posture, text);
  }
  if (study.postures.empty()) return;
  facts.add("freedom", fmt::format("{} of {} degrees remain with the loops closed; motors: {}",
                                   study.freedom, study.open_freedom, robot.joints.size()));
}

void add_loop_json(const hal::RobotConfig& robot, const robot::ClosureStudy& study, Json& json) {
  if (robot.loops.empty()) return;
  for (const hal::KinematicLoopConfig& loop : robot.loops) {
    json["loops"].push_back(
        {{"name", loop.name}, {"type", type_text(loop.type)}, {"sites", loop.sites}});
  }
  json["loop_postures"] = Json::array();
  for (const robot::ClosureInPosture& one : study.postures) {
    Json passive = Json::object();
    for (const auto& [joint, position] : one.passive) passive[joint] = position;
    json["loop_postures"].push_back({{"posture", one.posture},
                                     {"closed", one.closed},
                                     {"start_gap_m", one.start_gap_m},
                                     {"passive", passive}});
  }
  json["freedom"] = {{"degrees", study.freedom},
                     {"open_degrees", study.open_freedom},
                     {"motors", robot.joints.size()}};
}

}  // namespace tandem::apps
