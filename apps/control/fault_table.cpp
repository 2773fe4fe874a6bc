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

Json faults_json(const std::vector<runtime::Fault>& faults) {
  Json list = Json::array();
  for (const runtime::Fault& fault : faults) {
    list.push_back({{"time_s", fault.time_s},
                    {"cycle", fault.cycle},
                    {"joint", fault.joint},
                    {"board", fault.board},
                    {"cause", fault.text},
                    {"category", hal::to_string(fault.category)},
                    {"reaction", reaction_text(fault.category)},
                    {"latched", fault.latched},
                    {"cleared_s", fault.latched ? Json(nullptr) : Json(fault.cleared_s)}});
  }
  return list;
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
