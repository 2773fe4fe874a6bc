// The descriptions that the repository holds.
#pragma once

#include <array>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "scaffold/new_robot.hpp"

namespace tandem::scaffold {

struct PublicRobot {
  const char* name;
  const char* urdf;  ///< from the repository's root
  std::size_t feet;
};
inline void PrintTo(const PublicRobot& robot, std::ostream* out) { *out << robot.name; }

inline constexpr std::array<PublicRobot, 11> kPublicRobots{{
    {"double_pendulum", "config/double_pendulum/double_pendulum.urdf", 0},
    {"ur5e", "config/ur5e/ur5e.urdf", 0},
    {"panda", "config/panda/panda.urdf", 0},
    {"anymal_c", "config/anymal_c/anymal_c.urdf", 4},
    {"simple_humanoid", "tests/data/robots/simple_humanoid.urdf", 2},
    {"coman", "config/coman/coman.urdf", 2},
    {"walkman", "config/walkman/walkman.urdf", 2},
    {"icub", "config/icub/icub.urdf", 2},
    {"unitree_h1", "tests/data/robots/unitree_h1.urdf", 2},
    {"unitree_go2", "tests/data/robots/unitree_go2.urdf", 4},
    {"unitree_g1", "tests/data/robots/unitree_g1.urdf", 2},
}};

inline const PublicRobot& public_robot(std::string_view name) {
  for (const PublicRobot& robot : kPublicRobots) {
    if (name == robot.name) return robot;
  }
  throw std::runtime_error("no such robot");
}

inline std::string path_of(const PublicRobot& robot) {
  return std::string(TANDEM_SOURCE_DIR) + "/" + robot.urdf;
}

inline NewRobot made(const PublicRobot& robot) {
  auto found = make_robot({.urdf = path_of(robot), .name = robot.name});
  if (!found) throw std::runtime_error(found.error().front().to_string());
  return std::move(*found);
}

}  // namespace tandem::scaffold
