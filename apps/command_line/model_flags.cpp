// Flags of `tandem model`.
#include <string>

#include "apps/command_line/command_flags.hpp"

namespace tandem::apps {
namespace {

const char kModelExamples[] = R"(Examples:
  tandem model build config/coman/robot.toml         generates and compiles the robot's kernels
  tandem model info config/coman/robot.toml          joints, mass, operation counts and sizes
  tandem model ros2 config/ur5e/robot.toml           a package of ROS 2 with MoveIt's configuration)";

const char kModelBuildExamples[] = R"(Examples:
  tandem model build config/coman/robot.toml
  tandem model build my_robot/robot.toml -o kernels/    for a computer without a compiler
Without -o the library goes to the cache folder ($XDG_CACHE_HOME/tandem/models, or
~/.cache/tandem/models), where `tandem run` finds it by the robot's name and the hash of its
files. A library that is up to date is not built again.)";

const char kModelInfoExamples[] = R"(Examples:
  tandem model info config/walkman/robot.toml
  tandem model info config/walkman/robot.toml --kernel-variant baseline --json -)";

const char kModelRos2Examples[] = R"(Examples:
  tandem model ros2 config/ur5e/robot.toml               writes ur5e_moveit_config/
  tandem model ros2 my_robot/robot.toml -o ~/ros2_ws/src/my_robot_moveit_config
It needs no ROS 2. Build the package with colcon; `ros2 launch PACKAGE moveit.launch.py` starts MoveIt
beside a run with --dds. Of a robot with several limbs each has a controller of its own, named
LIMB_NAME.)";

}  // namespace

void add_flags(CLI::App& app, ModelOptions& o) {
  app.require_subcommand(1);
  app.footer(kModelExamples);
  CLI::App* build = app.add_subcommand("build", "Generate and compile a robot's kernels");
  build->add_option("robot", o.robot, kRobotHelp)
      ->required()
      ->transform(a_bundled(Bundled::kRobot));
  build->add_option("-o,--output", o.output,
                    "Shared library to write, or a folder for ROBOT-HASH_kernels.so");
  build->add_flag("--force", o.force, "Build even when the library is up to date");
  build->footer(kModelBuildExamples);
  build->callback([&o] { o.action = ModelOptions::Action::kBuild; });
  CLI::App* info = app.add_subcommand("info", "Joints, mass, operation counts and sizes");
  info->add_option("robot", o.robot, kRobotHelp)->required()->transform(a_bundled(Bundled::kRobot));
  info->add_option("--kernel-variant", o.kernel_variant, "baseline, x86-64-v3, …");
  info->add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  info->footer(kModelInfoExamples);
  info->callback([&o] { o.action = ModelOptions::Action::kInfo; });
  CLI::App* ros2 =
      app.add_subcommand("ros2", "Write a package of ROS 2 with MoveIt's configuration of a robot");
  ros2->add_option("robot", o.robot, kRobotHelp)->required()->transform(a_bundled(Bundled::kRobot));
  ros2->add_option("-o,--output", o.output, "Folder to write (default: the package's name)")
      ->check(is_given("name a folder"));
  ros2->add_option("--controller", o.controller,
                   "Controller of the run that serves NAME/follow_joint_trajectory")
      ->capture_default_str()
      ->check(is_given("name a controller"));
  ros2->footer(kModelRos2Examples);
  ros2->callback([&o] { o.action = ModelOptions::Action::kRos2; });
}

}  // namespace tandem::apps
