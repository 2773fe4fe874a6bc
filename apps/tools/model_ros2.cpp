// `tandem model ros2`: a robot's package for ROS 2 and MoveIt.
#include <fmt/format.h>

#include <filesystem>

#include "apps/text/console.hpp"
#include "apps/text/draft.hpp"
#include "apps/tools/commands.hpp"
#include "base/counted.hpp"
#include "base/file_name.hpp"
#include "base/quoting.hpp"
#include "robot/robot_files.hpp"
#include "scaffold/moveit.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

Status write_draft(const scaffold::MoveItPackage& package, const std::string& folder) {
  Result<Draft> draft = Draft::folder(folder);
  if (!draft) return std::unexpected(draft.error());
  for (const auto& [name, text] : package.files) {
    const fs::path file = fs::path(draft->path()) / name;
    std::error_code problem;
    fs::create_directories(file.parent_path(), problem);  // write_file() says what is wrong
    if (Status written = write_file(file, text); !written)
      return std::unexpected(draft->placed(written.error()));
  }
  return draft->place();
}

void print_package(const scaffold::MoveItPackage& package, const ModelOptions& options,
                   const std::string& folder) {
  Facts facts;
  facts.add("package", fmt::format("{}: {} in {}", package.name,
                                   counted(package.files.size(), "file"), folder));
  for (std::size_t g = 0; g < package.groups.size(); ++g) {
    const scaffold::MoveItGroup& group = package.groups[g];
    facts.add("group " + group.name,
              group.base_link.empty()
                  ? counted(group.joints.size(), "joint")
                  : fmt::format("{}, {} to {}", counted(group.joints.size(), "joint"),
                                group.base_link, group.tip_link));
    facts.add("", fmt::format("moved by {}/follow_joint_trajectory",
                              scaffold::moveit_controller(package.groups, g, options.controller)));
  }
  facts.print(stdout);
  fmt::print(
      "\nNext, where ROS 2 is (a run with --dds beside it):\n"
      "  colcon build --packages-select {0}\n  ros2 launch {0} moveit.launch.py\n",
      package.name);
}

}  // namespace

Status write_ros2_package(const robot::RobotFiles& robot, const ModelOptions& options) {
  if (const std::string problem = topic_name_problem(options.controller); !problem.empty()) {
    return std::unexpected(Error{"the controller's name '" + options.controller + "' " + problem,
                                 "use letters, digits and _, no digit first",
                                 {},
                                 0,
                                 "--controller"});
  }
  auto package = scaffold::make_moveit_package(robot.config, robot.tree,
                                               robot::text_in(robot.files, robot.config.model.urdf),
                                               options.controller);
  if (!package) {
    Error error = package.error();
    error.file = options.robot;
    return std::unexpected(std::move(error));
  }
  const std::string folder = options.output.empty() ? package->name : options.output;
  std::error_code ignored;
  if (fs::exists(fs::symlink_status(folder, ignored))) {
    return std::unexpected(
        Error{"this exists already", "remove it, or give another folder with -o", folder, 0, {}});
  }
  if (Status written = write_draft(*package, folder); !written) return written;
  print_warnings(package->warnings);
  print_package(*package, options, folder);
  return {};
}

}  // namespace tandem::apps
