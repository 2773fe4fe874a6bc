#include "report/log_head.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

namespace tandem::report {
namespace {

/// "a, b, c and 4 more".
std::string listed(const std::vector<std::string>& all) {
  constexpr std::size_t kSaid = 5;
  const std::size_t said = std::min(kSaid, all.size());
  std::string text =
      fmt::format("{}", fmt::join(all.begin(), all.begin() + static_cast<long>(said), ", "));
  if (all.size() > said) text += fmt::format(" and {} more", all.size() - said);
  return text;
}

/// The experiment's file: the first that names a robot.
std::string experiment_of(const RunData& run) {
  for (const auto& [file, text] : run.info.configuration) {
    const bool names_robot = text.starts_with("robot =") || text.find("\nrobot =") != text.npos;
    if (file.ends_with(".toml") && names_robot) return std::filesystem::path(file).filename();
  }
  return {};
}

/// Lines "NAME VALUE" as a map.
std::map<std::string, std::string> by_name(const std::vector<std::string>& lines,
                                           std::string_view between) {
  std::map<std::string, std::string> all;
  for (const std::string& line : lines) {
    const std::size_t end = std::min(line.find(between), line.size());
    all[line.substr(0, end)] = line.substr(std::min(end + between.size(), line.size()));
  }
  return all;
}

/// "NAME SHA256 PATH" without the path: the same library elsewhere is no other.
std::map<std::string, std::string> libraries(const RunData& run) {
  auto all = by_name(run.info.controllers, " ");
  for (auto& [name, rest] : all) rest = rest.substr(0, rest.find(' '));
  return all;
}

/// Files by name without their folder, since a copy of a robot stands in another one.
std::map<std::string, std::string> files(const RunData& run) {
  std::map<std::string, std::string> all;
  for (const auto& [file, text] : run.info.configuration)
    all[std::filesystem::path(file).filename()] += text;
  return all;
}

/// Names whose values are not the same, or that one of both lacks.
std::vector<std::string> differing(const std::map<std::string, std::string>& a,
                                   const std::map<std::string, std::string>& b) {
  std::vector<std::string> names;
  for (const auto& [name, value] : b) {
    const auto same = a.find(name);
    if (same == a.end() || same->second != value) names.push_back(name);
  }
  for (const auto& [name, value] : a)
    if (!b.contains(name)) names.push_back(name + " (not there)");
  return names;
}

/// How the run is set up otherwise.
std::string differences(const RunData& run, const RunData& first) {
  std::vector<std::string> parts;
  const auto add = [&parts](const char* what, const std::vector<std::string>& names) {
    if (!names.empty()) parts.push_back(fmt::format("{}: {}", what, listed(names)));
  };
  add("files", differing(files(first), files(run)));
  const auto parameters = by_name(run.info.parameters, " = ");
  std::vector<std::string> changed;
  for (const std::string& name : differing(by_name(first.info.parameters, " = "), parameters)) {
    const auto now = parameters.find(name);
    changed.push_back(now == parameters.end() ? name : fmt::format("{} = {}", name, now->second));
  }
  add("parameters", changed);
  add("code of controllers", differing(libraries(first), libraries(run)));
  if (run.info.plant != first.info.plant) parts.emplace_back("the simulated robot");
  if (run.info.kernel_sha256 != first.info.kernel_sha256) parts.emplace_back("the model's kernels");
  return parts.empty() ? "nothing of files, parameters and code"
                       : fmt::format("{}", fmt::join(parts, "; "));
}

}  // namespace

Facts head_facts(const RunData& run, const RunData& first) {
  return {{"log", run.path},
          {"experiment", experiment_of(run)},
          {"started", run.info.started},
          {"controllers ran", fmt::format("{:.3f} s", run.ran_s())},
          {"backend", run.info.hal},
          {"seed", std::to_string(run.info.seed)},
          {"tandem", run.info.version},
          {"machine", run.info.host},
          {"other than A", &run == &first ? "" : differences(run, first)}};
}

}  // namespace tandem::report
