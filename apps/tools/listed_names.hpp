// Names of a list on the command line: by comma, and the option may be repeated.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

namespace tandem::apps {

/// What was given, split at commas. What is one of `known` as it stands is not: a name with a comma
/// is given by itself.
[[nodiscard]] inline std::vector<std::string> listed_names(const std::vector<std::string>& given,
                                                           const std::vector<std::string>& known) {
  std::vector<std::string> names;
  for (const std::string& one : given) {
    if (std::ranges::find(known, one) != known.end() || one.find_first_not_of(',') == one.npos) {
      names.push_back(one);
      continue;
    }
    for (std::size_t from = 0; from < one.size();) {
      const std::size_t comma = std::min(one.find(',', from), one.size());
      if (comma > from) names.push_back(one.substr(from, comma - from));
      from = comma + 1;
    }
  }
  return names;
}

}  // namespace tandem::apps
