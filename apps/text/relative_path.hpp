// How an experiment that is written names another file.
// Layer: apps/text.  Thread: main.
#pragma once

#include <filesystem>
#include <string>

namespace tandem::apps {

/// `file` as the experiment at `experiment` has to say it: relative to its folder where it can.
[[nodiscard]] inline std::string relative_path(const std::string& experiment,
                                               const std::string& file) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::absolute(experiment).parent_path().lexically_normal();
  const fs::path whole = fs::absolute(file).lexically_normal();
  const fs::path relative = whole.lexically_relative(folder);
  return relative.empty() ? whole.string() : relative.string();
}

}  // namespace tandem::apps
