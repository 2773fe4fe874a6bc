#include "robot/kernel_store.hpp"

#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "base/file_name.hpp"
#include "base/process.hpp"
#include "base/quoting.hpp"
#include "model/generate.hpp"
#include "model/kernel_build.hpp"

namespace tandem::robot {
namespace {

namespace fs = std::filesystem;

/// In one folder: ROBOT-HASH_kernels.so, else ROBOT_kernels.so.
std::vector<std::string> candidates(const std::string& folder, const std::string& robot,
                                    const std::string& hash) {
  return {model::library_path(folder, robot + "-" + hash.substr(0, kHashDigits)),
          model::library_path(folder, robot)};
}

Result<model::KernelLibrary> find(const std::string& robot, const std::string& hash,
                                  const std::string& variant, const std::string& mend) {
  if (const std::string problem = file_name_problem(robot); !problem.empty()) {
    return fail("the robot's name '" + robot + "' " + problem, "give it another name");
  }
  Result<model::KernelLibrary> last =
      fail("there is no kernel library of '" + robot + "' as its files describe it", mend);
  bool meant = false;  // the last was made from these files: why it is refused says most
  for (const std::string& folder : model_folders()) {
    const std::vector<std::string> paths = candidates(folder, robot, hash);
    for (const std::string& path : paths) {
      std::error_code ignored;
      if (!fs::exists(path, ignored)) continue;
      Result<model::KernelLibrary> library = model::load_kernels(path, hash, variant);
      if (library) return library;
      if (meant) continue;
      meant = path == paths.front();
      last = std::move(library);
      if (last.error().hint.starts_with("run: tandem model build")) last.error().hint = mend;
    }
  }
  return last;
}

}  // namespace

Result<std::string> user_model_folder() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  if (cache != nullptr && *cache == '/') return std::string(cache) + "/tandem/models";
  const char* home = std::getenv("HOME");
  if (home != nullptr && *home == '/') return std::string(home) + "/.cache/tandem/models";
  // A folder that everybody may write to is no place for code that is loaded.
  return fail("there is no folder for kernel libraries: neither HOME nor XDG_CACHE_HOME is set",
              "set one of them to an absolute path");
}

Result<std::string> library_in(const std::string& folder, const std::string& robot,
                               const std::string& hash) {
  if (const std::string problem = file_name_problem(robot); !problem.empty()) {
    return fail("the robot's name '" + robot + "' " + problem, "give it another name");
  }
  return candidates(folder, robot, hash).front();
}

Result<std::string> user_library(const std::string& robot, const std::string& hash) {
  const Result<std::string> folder = user_model_folder();
  if (!folder) return std::unexpected(folder.error());
  return library_in(*folder, robot, hash);
}

std::vector<std::string> model_folders() {
  std::vector<std::string> folders;
  if (const char* set = std::getenv("TANDEM_MODELS")) {
    std::istringstream list(set);
    for (std::string folder; std::getline(list, folder, ':');)
      if (!folder.empty()) folders.push_back(folder);
  }
  const fs::path program = program_file();
  if (!program.empty()) {
    const fs::path root = program.parent_path().parent_path();
    folders.push_back((root / "lib/models").string());
    folders.push_back((root / "lib/tandem/models").string());
  }
  if (const Result<std::string> own = user_model_folder()) folders.push_back(*own);
  return folders;
}

Result<model::KernelLibrary> find_kernels(const RobotFiles& robot, const std::string& variant) {
  return find(robot.config.name, model::description_hash(robot.tree, robot.spec), variant,
              "run: tandem model build " + shell_word(robot.config.file));
}

Result<model::KernelLibrary> find_kernels(const std::string& robot, const std::string& hash,
                                          const std::string& variant) {
  return find(robot, hash, variant, "make it with `tandem model build`");
}

}  // namespace tandem::robot
