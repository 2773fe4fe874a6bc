// Those of an answer's list that a command names.
// Layer: apps/clients.  Thread: main.
#pragma once

#include <fmt/core.h>

#include <algorithm>
#include <string>
#include <vector>

#include "apps/text/console.hpp"
#include "base/nearest.hpp"

namespace tandem::apps {

/// The objects of `list` whose `key` ("joint", "sensor") is in `wanted`, in its order; all when it
/// is empty. Errors: a name that the robot lacks, with the nearest.
[[nodiscard]] inline Result<Json> named(const Json& list, const char* key,
                                        const std::vector<std::string>& wanted) {
  if (wanted.empty()) return list;
  std::vector<std::string> names;
  for (const Json& one : list) names.push_back(one.value(key, ""));
  Json some = Json::array();
  for (const std::string& name : wanted) {
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) {
      return fail(fmt::format("the robot has no {} '{}'", key, name), suggest(name, names));
    }
    some.push_back(list[static_cast<std::size_t>(found - names.begin())]);
  }
  return some;
}

}  // namespace tandem::apps
