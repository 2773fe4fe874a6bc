// tandem controller: what it asks a running run, and its answer.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "apps/clients/commands.hpp"
#include "apps/clients/control_client.hpp"
#include "apps/text/console.hpp"
#include "base/open_file.hpp"
#include "base/toml_reader.hpp"

namespace tandem::apps {
namespace {

void print_list(const Json& controllers) {
  Table table({"controller", "state", "joints", "plugin"});
  table.align_left();
  for (const Json& one : controllers) {
    const bool active = one.value("active", false);
    const char* state = !active ? "inactive" : one.value("finished", false) ? "done" : "active";
    std::vector<std::string> joints;
    for (const Json& claim : one["claims"]) joints.push_back(claim.value("joint", ""));
    const std::size_t count = joints.size();
    if (count > 4) joints.resize(3);
    std::string text = fmt::format("{}", fmt::join(joints, ", "));
    if (count > joints.size()) text += fmt::format(" and {} more", count - joints.size());
    table.add({one.value("name", ""), state, text,
               std::filesystem::path(one.value("plugin", "")).filename().string()});
  }
  table.print(stdout);
}

/// "done in cycle 1200; active: squat"; "selected in cycle 1200: squat; not started yet: …".
void print_done(const Json& answer) {
  const std::vector<std::string> active =
      answer.value("active", Json::array()).get<std::vector<std::string>>();
  const std::string names =
      active.empty() ? "none" : shown(fmt::format("{}", fmt::join(active, ", ")), 2'000);
  const std::string note = shown(answer.value("note", ""), 2'000);
  if (answer.value("done", false) && !note.empty()) {
    fmt::print("selected in cycle {}: {}; {}\n", answer.value("cycle", 0), names, note);
  } else if (answer.value("done", false)) {
    fmt::print("done in cycle {}; active: {}\n", answer.value("cycle", 0), names);
  } else {
    fmt::print("{}; active so far: {}\n", note, names);
  }
}

/// Where the first table of a TOML file begins, behind which no line belongs to its top level; its
/// end, when it has none or is no TOML (the run then says where it is wrong).
std::size_t end_of_top_level(const std::string& text, const std::string& file) {
  const auto document = TomlDocument::parse(text, file);
  if (!document) return text.size();
  std::size_t end = text.size();
  for (const std::string& key : document->root().keys()) {
    std::size_t begin = 0;
    for (int line = document->root().line(key); line > 1; --line)
      begin = text.find('\n', begin) + 1;
    const std::size_t first = text.find_first_not_of(" \t", begin);
    if (text[first] == '[') end = std::min(end, begin);  // and not KEY = VALUE
  }
  return end;
}

/// The file with what --set adds to it, below its own keys: the lines of errors in those stay.
Result<std::string> parameters_of(const ControllerOptions& options) {
  std::string text;
  if (!options.parameters.empty()) {
    Result<std::string> read = read_file(options.parameters, "name a .toml file", kMostTomlBytes);
    if (!read) return read;
    text = std::move(*read) + '\n';
  }
  std::string added;
  for (const std::string& line : options.set) added += line + '\n';
  return text.insert(end_of_top_level(text, options.parameters), added);
}

Result<Json> load_question(const ControllerOptions& options) {
  const Result<std::string> parameters = parameters_of(options);
  if (!parameters) return std::unexpected(parameters.error());
  const bool path = options.plugin.find('/') != std::string::npos;
  Json question{
      {"do", "controller.load"},
      {"plugin", path ? std::filesystem::absolute(options.plugin).string() : options.plugin}};
  if (!options.name.empty()) question["name"] = options.name;
  if (!parameters->empty()) question["parameters"] = *parameters;
  if (!options.parameters.empty()) question["parameters_file"] = options.parameters;
  return question;
}

Result<Json> question_of(const ControllerOptions& options) {
  switch (options.action) {
    case ControllerOptions::Action::kList: return Json{{"do", "controller.list"}};
    case ControllerOptions::Action::kLoad: return load_question(options);
    case ControllerOptions::Action::kUnload:
      return Json{{"do", "controller.unload"}, {"name", options.name}};
    case ControllerOptions::Action::kStart:
      if (options.start.empty()) return Json{{"do", "controller.start"}};
      break;
    case ControllerOptions::Action::kSwitch: break;
  }
  return Json{{"do", "controller.switch"}, {"stop", options.stop}, {"start", options.start}};
}

}  // namespace

Exit controller_command(const ControllerOptions& options) {
  const auto run = ControlClient::open(options.target, "run");
  if (!run) return refuse(run.error());
  const Result<Json> question = question_of(options);
  if (!question) return refuse(question.error());
  Result<Json> answer = (*run)->ask(*question);
  if (answer && options.start_it) {
    answer = (*run)->ask({{"do", "controller.start"}, {"name", answer->value("name", "")}});
  }
  if (!answer) return refuse(answer.error());
  if (options.json != "-") {
    if (options.action == ControllerOptions::Action::kList) {
      print_list((*answer)["controllers"]);
    } else {
      print_done(*answer);
    }
  }
  if (Status written = write_json(options.json, *answer); !written) return refuse(written.error());
  return Exit::kDone;
}

}  // namespace tandem::apps
