#include "scaffold/moveit_text.hpp"

#include <fmt/format.h>

#include <set>

#include "base/quoting.hpp"

namespace tandem::scaffold {
namespace {

/// Packages that the description's meshes are in: package://NAME/…
std::set<std::string> mesh_packages(std::string_view urdf) {
  constexpr std::string_view kScheme = "package://";
  std::set<std::string> packages;
  for (std::size_t at = urdf.find(kScheme); at != std::string_view::npos;
       at = urdf.find(kScheme, at)) {
    at += kScheme.size();
    const std::size_t end = urdf.find_first_of("/\"'<> \t\r\n", at);
    if (end != std::string_view::npos && end > at) packages.emplace(urdf.substr(at, end - at));
  }
  return packages;
}

}  // namespace

std::string package_xml(const std::string& package, const std::string& robot,
                        std::string_view urdf) {
  std::string text = fmt::format(R"(<?xml version="1.0"?>
<package format="3">
  <name>{}</name>
  <version>0.0.1</version>
  <description>MoveIt's configuration of the robot {}, which Tandem runs</description>
  <maintainer email="nobody@example.com">Nobody yet: put your name here</maintainer>
  <license>TODO: that of the robot's description</license>

  <buildtool_depend>ament_cmake</buildtool_depend>

)",
                                 package, xml_text(robot));
  std::set<std::string> needs = mesh_packages(urdf);
  needs.insert({"moveit_configs_utils", "moveit_kinematics", "moveit_planners_ompl",
                "moveit_ros_move_group", "moveit_ros_visualization",
                "moveit_simple_controller_manager", "rviz2", "xacro"});
  for (const std::string& name : needs)
    text += "  <exec_depend>" + xml_text(name) + "</exec_depend>\n";
  return text + R"(
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
)";
}

std::string cmake_text(const std::string& package) {
  return fmt::format(R"(cmake_minimum_required(VERSION 3.22)
project({} LANGUAGES NONE)
find_package(ament_cmake REQUIRED)
install(DIRECTORY config launch DESTINATION share/${{PROJECT_NAME}})
install(FILES .setup_assistant DESTINATION share/${{PROJECT_NAME}})
ament_package()
)",
                     package);
}

std::string setup_assistant(const std::string& package, const std::string& name) {
  return fmt::format(R"(# With this file MoveIt's setup assistant opens the package.
moveit_setup_assistant_config:
  urdf:
    package: {0}
    relative_path: config/{1}.urdf
  srdf:
    relative_path: config/{1}.srdf
  package_settings:
    author_name: Nobody yet
    author_email: nobody@example.com
    generated_timestamp: 0
)",
                     package, name);
}

std::string rviz_text() {
  return R"(Panels:
  - Class: rviz_common/Displays
    Name: Displays
  - Class: rviz_common/Views
    Name: Views
Visualization Manager:
  Displays:
    - Class: rviz_default_plugins/Grid
      Enabled: true
      Name: Grid
      Value: true
    - Class: moveit_rviz_plugin/MotionPlanning
      Enabled: true
      Move Group Namespace: ""
      Name: MotionPlanning
      Planning Scene Topic: monitored_planning_scene
      Robot Description: robot_description
      Value: true
  Enabled: true
  Global Options:
    Fixed Frame: odom
    Frame Rate: 30
  Name: root
  Tools:
    - Class: rviz_default_plugins/Interact
    - Class: rviz_default_plugins/MoveCamera
    - Class: rviz_default_plugins/Select
  Value: true
  Views:
    Current:
      Class: rviz_default_plugins/Orbit
      Distance: 3
      Name: Current View
      Value: Orbit (rviz)
Window Geometry:
  Height: 900
  Width: 1400
)";
}

std::string launch_text(const std::string& package, const std::string& name) {
  return fmt::format(
      R"(# MoveIt beside a run of Tandem, which publishes the joints' states, tf and the description:
#   ros2 launch {0} moveit.launch.py
# In simulated time, whose clock a run publishes. On a robot: use_sim_time:=false
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from moveit_configs_utils import MoveItConfigsBuilder


def generate_launch_description():
    config = (
        MoveItConfigsBuilder("{1}", package_name="{0}")
        .robot_description(file_path="config/{1}.urdf")
        .robot_description_semantic(file_path="config/{1}.srdf")
        .trajectory_execution(file_path="config/moveit_controllers.yaml")
        .planning_pipelines(pipelines=["ompl"])
        .to_moveit_configs()
    )
    time = {{
        "use_sim_time": ParameterValue(
            LaunchConfiguration("use_sim_time"), value_type=bool
        )
    }}
    move_group = Node(
        package="moveit_ros_move_group",
        executable="move_group",
        output="screen",
        parameters=[
            config.to_dict(),
            {{"publish_robot_description_semantic": True}},
            time,
        ],
    )
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        arguments=["-d", str(config.package_path / "config/moveit.rviz")],
        parameters=[
            config.robot_description,
            config.robot_description_semantic,
            config.robot_description_kinematics,
            config.planning_pipelines,
            config.joint_limits,
            time,
        ],
        condition=IfCondition(LaunchConfiguration("rviz")),
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument("use_sim_time", default_value="true"),
            DeclareLaunchArgument("rviz", default_value="true"),
            move_group,
            rviz,
        ]
    )
)",
      package, name);
}

}  // namespace tandem::scaffold
