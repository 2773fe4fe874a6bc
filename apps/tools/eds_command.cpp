// `tandem eds`: writes the data sheets of a robot's nodes.
#include <fmt/format.h>

#include <filesystem>

#include "apps/robot/wrong_kind.hpp"
#include "apps/text/console.hpp"
#include "apps/text/draft.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/eds_files.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {
namespace {

Diagnostics write_sheets(const EdsOptions& options, std::vector<EdsFile>& files) {
  if (auto wrong = wrong_kind(options.robot, Takes::kRobot, "tandem eds")) {
    return {std::move(*wrong)};
  }
  const auto robot = robot::read_robot(options.robot);
  if (!robot) return robot.error();
  auto made = make_eds_files(robot->config);
  if (!made) {
    made.error().file = options.robot;
    return {made.error()};
  }
  files = std::move(*made);
  Result<Draft> draft = Draft::folder(options.output);
  if (!draft) return {draft.error()};
  for (const EdsFile& file : files) {
    const Status written = write_file(std::filesystem::path(draft->path()) / file.name, file.text);
    if (!written) return {draft->placed(written.error())};
  }
  if (const Status placed = draft->place(); !placed) return {placed.error()};
  return {};
}

}  // namespace

Exit eds_command(const EdsOptions& options) {
  if (options.action == EdsOptions::Action::kShow) return eds_show(options);
  std::vector<EdsFile> files;
  Diagnostics errors = write_sheets(options, files);
  Json json = Json::array();
  Facts facts;
  for (const EdsFile& file : files) {
    const std::string path = (std::filesystem::path(options.output) / file.name).string();
    facts.add(path, fmt::format("{} objects, for {}", file.objects, fmt::join(file.nodes, ", ")));
    json.push_back({{"file", path}, {"objects", file.objects}, {"nodes", file.nodes}});
  }
  if (errors.empty()) {
    if (files.empty()) facts.add("nothing written", "every board has its maker's sheet (`eds`)");
    facts.print(human_output(options.json));
    if (const Status written = write_json(options.json, json); !written) {
      errors.push_back(written.error());
    }
  }
  print_errors(errors);
  return errors.empty() ? Exit::kDone : Exit::kUsage;
}

}  // namespace tandem::apps
