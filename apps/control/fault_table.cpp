#include "apps/control/fault_table.hpp"

#include <fmt/core.h>

namespace tandem::apps {

const char* reaction_text(hal::StopCategory category) {
  switch (category) {
    case hal::StopCategory::kCategory0: return "torque off";
    case hal::StopCategory::kCategory1: return "stop, torque off";
    case hal::StopCategory::kCategory2: return "safe posture, stop, torque off";
    case hal::StopCategory::kHold: return "every joint held";
    case hal::StopCategory::kWarn: return "reported";
  }
  return "?";
}

std::string category_words(std::string category) {
  if (!category.empty() && category.back() >= '0' && category.back() <= '9')
    category.insert(category.size() - 1, " ");
  return category;
}

void figures(Figures& f, const runtime::FaultReport& fault) {
  f("time_s", fault.time_s);
  f("cycle", fault.cycle);
  f("joint", "or the sensor, or the controller; empty: the robot as a whole", fault.joint);
  f("board", "empty: none", fault.board);
  f("controller", "whose call, command or claim it was; empty: nobody's", fault.controller);
  f("cause", fault.text);
  f("category", "`category0`, `category1`, `category2`, `hold`, `warn`",
    hal::to_string(fault.category));
  f("reaction", "the category in words", reaction_text(fault.category));
  f("latched", fault.latched);
  f("cleared_s", "null while it is latched", known(!fault.latched, fault.cleared_s));
}

std::vector<std::string> latched_texts(const std::vector<runtime::FaultReport>& faults) {
  std::vector<std::string> texts;
  for (const runtime::FaultReport& fault : faults) {
    if (!fault.latched) continue;
    texts.push_back(fmt::format("{:.3f} s: {}{}{}", fault.time_s, fault.joint,
                                fault.joint.empty() ? "" : ": ", fault.text));
  }
  return texts;
}

void print_faults(const Json& faults, std::FILE* out) {
  if (faults.empty()) return;
  // Within 100 columns: the category is that of the reaction, and in the JSON.
  // What was struck may also be a sensor or a controller.
  Table table({"fault at", "where", "board", "cause", "reaction", "state"});
  table.align_left();
  for (const Json& fault : faults) {
    const bool latched = fault.value("latched", true);
    table.add({fmt::format("{:.3f} s", fault.value("time_s", 0.0)), fault.value("joint", ""),
               fault.value("board", ""), fault.value("cause", ""), fault.value("reaction", ""),
               latched ? std::string("latched")
                       : fmt::format("cleared at {:.3f} s", fault["cleared_s"].get<double>())});
  }
  table.print(out);
}

}  // namespace tandem::apps
