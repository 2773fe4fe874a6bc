"""Reads a MoveIt package as ROS 2 does, without it, and prints it as JSON.

YAML is read by PyYAML, as MoveIt's builder and ROS 2's launch do. The launch file runs with stand-ins
for the modules that it imports; the builder's looks for the files that the real one looks for.
"""
import importlib.util
import json
import pathlib
import sys
import types
import xml.etree.ElementTree

import yaml

package = pathlib.Path(sys.argv[1])
nodes, arguments = [], {}


def read(path):
    return yaml.safe_load((package / path).read_text(encoding="utf-8"))


class Builder:
    def __init__(self, robot_name, package_name):
        name = xml.etree.ElementTree.parse(package / "package.xml").findtext("name")
        assert package_name == name, (package_name, name)
        self.package_path, self.planning_pipelines_ = package, None
        self.name = robot_name

    def robot_description(self, file_path):
        self.robot_description = {"robot_description": (package / file_path).read_text(encoding="utf-8")}
        return self

    def robot_description_semantic(self, file_path):
        text = (package / file_path).read_text(encoding="utf-8")
        self.robot_description_semantic = {"robot_description_semantic": text}
        return self

    def trajectory_execution(self, file_path):
        self.trajectory_execution = read(file_path)
        return self

    def planning_pipelines(self, pipelines):
        self.planning_pipelines = {"planning_pipelines": pipelines}
        return self

    def to_moveit_configs(self):
        self.robot_description_kinematics = {"robot_description_kinematics": read("config/kinematics.yaml")}
        self.joint_limits = {"robot_description_planning": read("config/joint_limits.yaml")}
        self.pilz_cartesian_limits = {"robot_description_planning": read("config/pilz_cartesian_limits.yaml")}
        return self

    def to_dict(self):
        return {**self.robot_description, **self.robot_description_semantic, **self.trajectory_execution}


def node(**words):
    nodes.append(words)
    return words


def argument(name, default_value):
    arguments[name] = default_value


def module(name, **members):
    sys.modules[name] = types.ModuleType(name)
    vars(sys.modules[name]).update(members)


module("launch", LaunchDescription=lambda actions: actions)
module("launch.actions", DeclareLaunchArgument=argument)
module("launch.conditions", IfCondition=str)
module("launch.substitutions", LaunchConfiguration=lambda name: "$" + name)
module("launch_ros")
module("launch_ros.actions", Node=node)
module("launch_ros.parameter_descriptions", ParameterValue=lambda value, value_type: value)
module("moveit_configs_utils", MoveItConfigsBuilder=Builder)

sys.dont_write_bytecode = True
spec = importlib.util.spec_from_file_location("started", package / "launch/moveit.launch.py")
started = importlib.util.module_from_spec(spec)
spec.loader.exec_module(started)
started.generate_launch_description()

print(
    json.dumps(
        {
            "kinematics": read("config/kinematics.yaml"),
            "joint_limits": read("config/joint_limits.yaml"),
            "cartesian": read("config/pilz_cartesian_limits.yaml"),
            "controllers": read("config/moveit_controllers.yaml"),
            "initial": read("config/initial_positions.yaml"),
            "rviz": read("config/moveit.rviz"),
            "assistant": read(".setup_assistant"),
            "nodes": nodes,
            "arguments": arguments,
        }
    )
)
