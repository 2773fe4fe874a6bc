#include "apps/robot/bundled.hpp"

#include <algorithm>
#include <system_error>

#include "base/nearest.hpp"

namespace tandem::apps {

namespace fs = std::filesystem;

std::vector<fs::path> robot_folders() {
  std::error_code problem;
  const fs::path program = fs::read_symlink("/proc/self/exe", problem);
  const fs::path root = program.parent_path().parent_path();
  return {"config", root.parent_path().parent_path() / "config", root / "share/tandem/config"};
}

fs::path bundled_robot(const std::string& name) {
  std::error_code ignored;
  for (const fs::path& folder : robot_folders()) {
    const fs::path file = folder / name / "robot.toml";
    if (fs::is_regular_file(file, ignored)) return fs::absolute(file, ignored);
  }
  return {};
}

Result<fs::path> named_robot(const std::string& name) {
  std::error_code ignored;
  if (fs::is_regular_file(name, ignored)) return fs::path(name);
  const bool plain = !name.empty() && name.find('/') == std::string::npos;
  if (const fs::path file = plain ? bundled_robot(name) : fs::path(); !file.empty()) return file;
  std::vector<std::string> names;
  for (const fs::path& folder : robot_folders()) {
    for (const auto& entry : fs::directory_iterator(folder, ignored)) {
      if (fs::is_regular_file(entry.path() / "robot.toml", ignored))
        names.push_back(entry.path().filename().string());
    }
  }
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  const std::string nearest = suggest(name, names);
  return std::unexpected(
      Error{"there is no bundled robot '" + name + "'",
            (nearest.empty() ? nearest : nearest + "; or ") + "give the path of its robot.toml",
            name,
            0,
            {}});
}

}  // namespace tandem::apps
