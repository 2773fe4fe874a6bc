// Robots with any number of legs of any joints: a box of 10 kg, its legs around it.
// Layer: tests.  Thread: any.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "hal/sim/setup.hpp"
#include "model/interpreted_kernels.hpp"
#include "model/urdf.hpp"

namespace tandem::test {

/// One joint of a leg and the link behind it.
struct LegJoint {
  char axis;            ///< 'x', 'y' or 'z'
  double length_m;      ///< of the link, downwards
  double position_rad;  ///< in the posture "stand"
};

struct Walker {
  std::string name;
  int legs = 2;
  std::vector<LegJoint> leg;
  std::vector<std::array<double, 3>> points_m;  ///< of every foot
  std::size_t equations = 0;                    ///< that a stance must solve
  double radius_m = 0.25;                       ///< the legs' distance from the base's middle
};

inline void add_walker_link(std::string& urdf, const std::string& name, double length_m) {
  const std::string middle = std::to_string(-0.5 * length_m);
  urdf += "<link name='" + name + "'><inertial><origin xyz='0 0 " + middle +
          "'/><mass value='1'/><inertia ixx='0.02' iyy='0.02' izz='0.01' ixy='0' ixz='0' "
          "iyz='0'/></inertial></link>\n";
}

inline std::string walker_urdf(const Walker& walker) {
  std::string urdf =
      "<robot name='walker'>\n<link name='base'><inertial><mass value='10'/><inertia ixx='0.3' "
      "iyy='0.3' izz='0.3' ixy='0' ixz='0' iyz='0'/></inertial></link>\n";
  for (int leg = 0; leg < walker.legs; ++leg) {
    // Two legs stand left and right, four at the corners, one in the middle.
    const double turn = 2.0 * std::numbers::pi * (leg + 0.5) / walker.legs;
    const double radius = walker.legs == 1 ? 0.0 : walker.radius_m;
    std::string at = std::to_string(radius * std::cos(turn)) + " " +
                     std::to_string(radius * std::sin(turn)) + " 0";
    std::string parent = "base";
    for (std::size_t j = 0; j < walker.leg.size(); ++j) {
      const LegJoint& joint = walker.leg[j];
      const std::string name = "leg" + std::to_string(leg) + "_" + std::to_string(j);
      add_walker_link(urdf, name + "_link", joint.length_m);
      const std::string axis = joint.axis == 'x' ? "1 0 0" : joint.axis == 'y' ? "0 1 0" : "0 0 1";
      urdf += "<joint name='" + name + "' type='revolute'><parent link='" + parent +
              "'/><child link='" + name + "_link'/><origin xyz='" + at + "'/><axis xyz='" + axis +
              "'/><limit lower='-3' upper='3' effort='500' velocity='20'/></joint>\n";
      parent = name + "_link";
      at = "0 0 " + std::to_string(-joint.length_m);
    }
  }
  return urdf + "</robot>\n";
}

inline hal::RobotConfig walker_robot(const Walker& walker) {
  hal::RobotConfig robot;
  robot.file = "walker/robot.toml";
  robot.name = "walker";
  robot.model.floating_base = true;
  robot.actuators.push_back({.name = "motor", .inertia_kg_m2 = 0.2});
  robot.actuators[0].order = 2;
  robot.gains.emplace_back().name = "leg";
  robot.gains[0].position.gains = {1000.0, 0.0, 50.0};
  hal::PostureConfig stand{{"stand", 0.8, {}}};
  const std::size_t last = walker.leg.size() - 1;
  for (int leg = 0; leg < walker.legs; ++leg) {
    const std::string prefix = "leg" + std::to_string(leg) + "_";
    for (std::size_t j = 0; j <= last; ++j) {
      hal::JointConfig& joint = robot.joints.emplace_back();
      joint.name = prefix + std::to_string(j);
      joint.actuator = "motor";
      joint.gains = "leg";
      joint.min_position_rad = -3.0;
      joint.max_position_rad = 3.0;
      joint.max_velocity_rad_s = 20.0;
      joint.max_torque_Nm = 500.0;
      stand.position_rad.push_back(walker.leg[j].position_rad);
    }
    const std::string foot = "foot" + std::to_string(leg);
    const std::string link = prefix + std::to_string(last) + "_link";
    robot.model.sites.push_back({{.name = foot,
                                  .link = link,
                                  .xyz_m = {0, 0, -walker.leg[last].length_m},
                                  .wrench = true}});
    robot.contact.feet.push_back({foot, walker.points_m});
  }
  robot.postures.push_back(stand);
  return robot;
}

/// A walker with its kernels.
struct WalkerRobot {
  explicit WalkerRobot(const Walker& walker)
      : robot(walker_robot(walker)),
        kernels(model::make_mechanism(
                    model::parse_urdf(walker_urdf(walker), "walker.urdf", {.floating_base = true})
                        .value()
                        .tree,
                    sim::model_spec(robot))
                    .value(),
                robot.name) {}
  hal::RobotConfig robot;
  model::InterpretedKernels kernels;
};

}  // namespace tandem::test
