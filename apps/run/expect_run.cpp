#include "apps/run/expect_run.hpp"

#include <chrono>
#include <vector>

#include "apps/control/run_figures.hpp"

namespace tandem::apps {
namespace {

constexpr auto kPatience = std::chrono::milliseconds(200);  // for a cycle

Result<Json> show(runtime::RobotCycle& cycle, runtime::Expectations* expectations) {
  Json answer{{"expectations", Json::array()}};
  if (expectations == nullptr) return answer;
  std::vector<runtime::ExpectationResult> results;
  const bool stood =
      cycle.inbox().clock().while_standing([&] { results = expectations->so_far(); });
  if (!stood) {
    auto looked = expectations->look(kPatience);
    if (!looked) return fail("no cycle came within 0.2 s", "ask again");
    results = std::move(*looked);
  }
  answer["expectations"] = figures_json(results);
  return answer;
}

}  // namespace

void add_expectations(ControlRegistry& registry, runtime::RobotCycle& cycle,
                      runtime::Expectations* expectations) {
  registry.add("expect.show",
               [&cycle, expectations](const Json&) { return show(cycle, expectations); });
}

}  // namespace tandem::apps
