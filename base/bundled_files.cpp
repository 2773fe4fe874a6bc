#include "base/bundled_files.hpp"

#include <algorithm>
#include <optional>
#include <string_view>
#include <system_error>

#include "base/nearest.hpp"
#include "base/process.hpp"
#include "base/toml_reader.hpp"

namespace tandem {
namespace {

namespace fs = std::filesystem;

constexpr char kRobotFile[] = "robot.toml";

const char* to_words(Bundled kind) {
  switch (kind) {
    case Bundled::kRobot: return "robot";
    case Bundled::kExperiment: return "experiment";
    case Bundled::kRobotOrExperiment: return "robot or experiment";
    case Bundled::kTests: return "experiment or folder of them";
    case Bundled::kStudy: return "study";
    case Bundled::kScenario: return "scenario";
  }
  return "";
}

/// By the first keys of a file: a robot has a [model], an experiment names its robot, a study its
/// experiment. @return empty: none of these
std::optional<Bundled> kind_of(const fs::path& file) {
  const Result<TomlDocument> document = TomlDocument::load(file.string());
  if (!document) return std::nullopt;
  const TomlTable root = document->root();
  if (root.has("model")) return Bundled::kRobot;
  if (root.has("robot")) return Bundled::kExperiment;
  if (root.has("experiment")) return Bundled::kStudy;
  return root.has("fault") ? std::optional(Bundled::kScenario) : std::nullopt;
}

bool takes(Bundled kind, Bundled found) {
  if (kind == Bundled::kTests) return found == Bundled::kExperiment;
  if (kind == Bundled::kRobotOrExperiment)
    return found == Bundled::kRobot || found == Bundled::kExperiment;
  return found == kind;
}

/// The name of a file below config/: without its ending; a robot's folder for its robot.toml.
std::string name_of(const fs::path& relative) {
  if (relative.filename() == kRobotFile) return relative.parent_path().generic_string();
  return fs::path(relative).replace_extension().generic_string();
}

bool is_file(const fs::path& file) {
  std::error_code ignored;
  return fs::is_regular_file(file, ignored);
}

/// What `name` is in `folder`; empty: nothing.
fs::path found_in(const fs::path& folder, const std::string& name, Bundled kind) {
  std::error_code ignored;
  if (kind == Bundled::kTests && fs::is_directory(folder / name, ignored)) return folder / name;
  if (is_file(folder / name / kRobotFile)) return folder / name / kRobotFile;
  if (is_file(folder / (name + ".toml"))) return folder / (name + ".toml");
  return name.ends_with(".toml") && is_file(folder / name) ? folder / name : fs::path();
}

/// Whether it can only be a path: it begins as one, leaves a folder, or is empty.
bool is_path(const std::string& given) {
  const fs::path path(given);
  return given.empty() || path.is_absolute() || path.begin()->string().starts_with('.') ||
         std::ranges::find(path, fs::path("..")) != path.end() || given.ends_with('/');
}

}  // namespace

std::vector<fs::path> bundled_folders() {
  const fs::path root = fs::path(program_file()).parent_path().parent_path();
  std::vector<fs::path> folders{"config", root / "share/tandem/config"};
  if (is_file(root / "CMakeCache.txt"))
    folders.push_back(root.parent_path().parent_path() / "config");
  return folders;
}

std::vector<std::string> bundled_names(Bundled kind) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const fs::path& folder : bundled_folders()) {
    fs::recursive_directory_iterator at(folder, ignored), end;
    for (; at != end; at.increment(ignored)) {
      if (kind == Bundled::kTests && at->path().filename() == "suite") names.push_back("suite");
      if (at->path().extension() != ".toml" || !at->is_regular_file(ignored)) continue;
      const std::optional<Bundled> found = kind_of(at->path());
      if (found && takes(kind, *found))
        names.push_back(name_of(at->path().lexically_relative(folder)));
    }
  }
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

Result<std::string> named_file(const std::string& given, Bundled kind) {
  std::error_code ignored;
  if (is_path(given) || fs::exists(given, ignored)) return given;
  const auto find = [kind](const std::string& name) {
    for (const fs::path& folder : bundled_folders()) {
      if (const fs::path file = found_in(folder, name, kind); !file.empty()) return file;
    }
    return fs::path();
  };
  if (const fs::path file = find(given); !file.empty()) return file.string();
  if (given.ends_with(".toml")) {  // as in the sources' folder, but elsewhere
    constexpr std::string_view kFolder = "config/";
    const std::string name = given.starts_with(kFolder) ? given.substr(kFolder.size()) : "";
    if (name.empty() || find(name).empty()) return given;
    return std::unexpected(Error{
        .message = "there is no such file here",
        .hint = "say the name of the bundled " + std::string(to_words(kind)) + ": " + name_of(name),
        .file = given,
        .key = {}});
  }
  std::vector<std::string> names = bundled_names(kind);
  const std::string robot = given.substr(0, given.find('/') + 1);  // "coman/" of "coman/squats"
  std::vector<std::string> its;
  std::ranges::copy_if(names, std::back_inserter(its),
                       [&](const std::string& name) { return name.starts_with(robot); });
  const std::string nearest = suggest(given, !robot.empty() && !its.empty() ? its : names);
  return fail("there is no bundled " + std::string(to_words(kind)) + " '" + given + "'",
              (nearest.empty() ? nearest : nearest + "; or ") + "give the path of its file");
}

}  // namespace tandem
