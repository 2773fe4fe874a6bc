#include "apps/robot/wrong_kind.hpp"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "base/quoting.hpp"
#include "base/toml_reader.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

enum class Kind { kOther, kFolder, kExperiment, kRobot };

/// A robot has a [model], an experiment names a robot.
Kind kind_of(const std::string& file) {
  std::error_code ignored;
  if (fs::is_directory(file, ignored)) return Kind::kFolder;
  const Result<TomlDocument> document = TomlDocument::load(file);
  if (!document) return Kind::kOther;
  if (document->root().has("model")) return Kind::kRobot;
  return document->root().has("robot") ? Kind::kExperiment : Kind::kOther;
}

/// What of a folder the command takes, with the folder's name as it was given.
std::vector<std::string> files_in(const std::string& folder, Takes takes) {
  std::vector<std::string> files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, ignored)) {
    if (entry.path().extension() != ".toml") continue;
    const std::string file = (fs::path(folder) / entry.path().filename()).string();
    const Kind kind = kind_of(file);
    if ((kind == Kind::kExperiment && takes != Takes::kRobot) ||
        (kind == Kind::kRobot && takes != Takes::kExperiment)) {
      files.push_back(file);
    }
  }
  std::ranges::sort(files);
  return files;
}

std::string to_type(const std::vector<std::string>& files, const std::string& command) {
  std::string text = "type: ";
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (i > 0) text += i + 1 == files.size() ? ", or: " : ", ";
    text += command + " " + shell_word(files[i]);
  }
  return text;
}

const char* needed(Takes takes) {
  switch (takes) {
    case Takes::kExperiment:
      return "an experiment is needed: what a robot shall do, and for how long";
    case Takes::kRobot: return "a robot is needed: its robot.toml";
    case Takes::kEither: return "an experiment or a robot is needed";
  }
  return "";
}

const char* where_to_read(Takes takes) {
  return takes == Takes::kExperiment ? "write one: docs/configuration.md, experiment.toml"
                                     : "write one: docs/configuration.md, robot.toml";
}

/// The robot that an experiment names, when there is one.
std::vector<std::string> robot_of(const std::string& experiment) {
  const Result<TomlDocument> document = TomlDocument::load(experiment);
  const std::string robot = document ? document->root().text_or("robot", {}) : std::string();
  const std::string file = (fs::path(experiment).parent_path() / robot).lexically_normal().string();
  return !robot.empty() && kind_of(file) == Kind::kRobot ? std::vector{file}
                                                         : std::vector<std::string>();
}

}  // namespace

std::optional<Error> wrong_kind(const std::string& file, Takes takes, const std::string& command) {
  const Kind kind = kind_of(file);
  const char* given = nullptr;
  std::vector<std::string> meant;
  if (kind == Kind::kFolder) {
    given = "this is a folder";
    meant = files_in(file, takes);
  } else if (kind == Kind::kRobot && takes == Takes::kExperiment) {
    given = "this is a robot";
    meant = files_in(fs::path(file).parent_path().string(), takes);
  } else if (kind == Kind::kExperiment && takes == Takes::kRobot) {
    given = "this is an experiment";
    meant = robot_of(file);
  }
  if (given == nullptr) return std::nullopt;
  return Error{.message = std::string(given) + ", and " + needed(takes),
               .hint = meant.empty() ? where_to_read(takes) : to_type(meant, command),
               .file = file,
               .key = {}};
}

}  // namespace tandem::apps
