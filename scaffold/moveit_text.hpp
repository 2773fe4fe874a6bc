// The texts of a MoveIt package that say little of its robot: what builds, starts and shows it.
// Layer: scaffold, private to moveit*.cpp.  Thread: any, non-RT.
#pragma once

#include <string>
#include <string_view>

namespace tandem::scaffold {

/// package.xml. The packages in which the description's meshes are (package://NAME/…) are among
/// those that it needs.
[[nodiscard]] std::string package_xml(const std::string& package, const std::string& robot,
                                      std::string_view urdf);
/// CMakeLists.txt, which installs.
[[nodiscard]] std::string cmake_text(const std::string& package);
/// .setup_assistant: where URDF and SRDF are.
/// @param name  of the two files
[[nodiscard]] std::string setup_assistant(const std::string& package, const std::string& name);
/// moveit.rviz: RViz with the panel that plans.
[[nodiscard]] std::string rviz_text();
/// moveit.launch.py: move_group and RViz.
/// @param name  of URDF and SRDF
[[nodiscard]] std::string launch_text(const std::string& package, const std::string& name);

}  // namespace tandem::scaffold
