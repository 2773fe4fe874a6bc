// What a URDF's text says before anybody interprets it: names, lines, well-formed numbers.
// Layer: model, private to urdf*.cpp.  Thread: non-RT only.
#pragma once

#include <array>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "model/right_angles.hpp"
#include "model/urdf.hpp"
#include "model/urdf_extras.hpp"

namespace tandem::model {

struct OutlineLink {
  std::string name;
  int line = 0;
  double mass_kg = 0.0;  ///< 0 without <inertial>
  /// ixx ixy ixz iyy iyz izz, along the inertial's own axes.
  std::array<double, 6> moments_kg_m2{};
};

inline constexpr double kNoLimit = std::numeric_limits<double>::quiet_NaN();

struct OutlineJoint {
  std::string name;
  std::string type;
  std::string parent;  ///< link
  std::string child;   ///< link
  std::string mimic;   ///< joint; empty: independent
  double mimic_multiplier = 1.0;
  double mimic_offset = 0.0;
  int line = 0;
  bool locked = false;  ///< planar or floating, and fixed by UrdfOptions::lock
  // kNoLimit where the text gives none, or one that makes no sense; then the note says why.
  double lower = kNoLimit;
  double upper = kNoLimit;
  double velocity = kNoLimit;
  double effort = kNoLimit;
  std::string limits_note;
  JointExtras extras;
};

/// A URDF whose every element that matters is present, unique and numeric where it must be.
/// Whether it is a tree is not known yet. Where a part is wrong, `text` has something possible
/// instead, so that what is wrong elsewhere can be found too.
struct Outline {
  std::string robot;
  std::vector<OutlineLink> links;
  std::vector<OutlineJoint> joints;
  std::string text;  ///< the same description with nothing but links' inertials and joints
  Diagnostics errors;
  bool incomplete = false;  ///< errors are such that nothing more can be said of the description
  Diagnostics warnings;
  RightAngles right_angles;  ///< of joints and inertials

  std::map<std::string, int> link_lines;  ///< of the first link of each name
  std::map<std::string, int> joint_lines;

  /// The joint of type floating from the root to the base, of which check_topology() leaves
  /// nothing but this, nor of the root. Empty: none.
  std::string floating_joint;
  int floating_line = 0;
};

/// @param options  of which the right angles and locks count: right angles of few digits are
///                 written exactly in the answer's text, and a planar joint may be locked at 0
[[nodiscard]] Outline outline_urdf(std::string_view text, const std::string& file,
                                   const UrdfOptions& options);

/// Appends an error for each way in which the joints do not make one tree of all links (`outline`
/// is incomplete then), and takes a massless root out that nothing but a floating joint leaves.
void check_topology(Outline& outline, const std::string& file);

/// Masses and inertias that a body can have, but that this robot's links hardly do. One warning for
/// each kind, with the first link and the number of the others: no mass between two joints that
/// move; a radius of gyration beyond the link; a link far denser than lead.
/// @pre the tree's links have their shapes
void warn_of_odd_masses(const Tree& tree, const Outline& outline, Diagnostics& warnings);

}  // namespace tandem::model
