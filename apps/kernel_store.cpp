#include "apps/kernel_store.hpp"

#include <fmt/core.h>

#include <cstdlib>
#include <filesystem>

#include "model/generate.hpp"
#include "model/kernel_build.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

Result<model::KernelLibrary> find(const std::string& robot, const std::string& hash,
                                  const std::string& variant, const std::string& mend) {
  Result<model::KernelLibrary> last = fail("there is no kernel library of '" + robot + "'", mend);
  for (const std::string& folder : model_folders()) {
    const std::string path = model::library_path(folder, robot);
    std::error_code ignored;
    if (!fs::exists(path, ignored)) continue;
    Result<model::KernelLibrary> library = model::load_kernels(path, hash, variant);
    if (library) return library;
    last = std::move(library);
    if (last.error().hint.starts_with("run: tandem model build")) last.error().hint = mend;
  }
  return last;
}

}  // namespace

std::string user_model_folder() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  if (cache != nullptr && *cache == '/') return std::string(cache) + "/tandem/models";
  const char* home = std::getenv("HOME");
  return std::string(home == nullptr ? "/tmp" : home) + "/.cache/tandem/models";
}

std::vector<std::string> model_folders() {
  std::vector<std::string> folders;
  std::error_code problem;
  const fs::path program = fs::read_symlink("/proc/self/exe", problem);
  if (!problem) {
    const fs::path root = program.parent_path().parent_path();
    folders.push_back((root / "lib/models").string());
    folders.push_back((root / "lib/tandem/models").string());
  }
  folders.push_back(user_model_folder());
  return folders;
}

Result<model::KernelLibrary> find_kernels(const RobotFiles& robot, const std::string& variant) {
  return find(robot.config.name, model::description_hash(robot.tree, robot.spec), variant,
              "run: tandem model build " + robot.config.file);
}

Result<model::KernelLibrary> find_kernels(const std::string& robot, const std::string& hash,
                                          const std::string& variant) {
  return find(robot, hash, variant, "make it with `tandem model build`");
}

}  // namespace tandem::apps
