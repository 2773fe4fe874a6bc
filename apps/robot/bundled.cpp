#include "apps/robot/bundled.hpp"

#include <system_error>

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

}  // namespace tandem::apps
