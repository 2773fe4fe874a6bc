// What a URDF's text says before anybody interprets it: names, lines, well-formed numbers.
// Layer: model, private to urdf*.cpp.  Thread: non-RT only.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace tandem::model {

struct OutlineLink {
  std::string name;
  int line = 0;
};

struct OutlineJoint {
  std::string name;
  std::string type;
  std::string parent;  ///< link
  std::string child;   ///< link
  std::string mimic;   ///< joint; empty: independent
  int line = 0;
};

/// A URDF whose every element that matters is present, unique and numeric where it must be.
/// Whether it is a tree is not known yet.
struct Outline {
  std::string robot;
  std::vector<OutlineLink> links;
  std::vector<OutlineJoint> joints;
  std::string text;  ///< the same description with nothing but links' inertials and joints
  Diagnostics errors;
  Diagnostics warnings;

  std::map<std::string, int> link_lines;  ///< of the first link of each name
  std::map<std::string, int> joint_lines;
};

[[nodiscard]] Outline outline_urdf(std::string_view text, const std::string& file);

/// Appends an error for each way in which the joints do not make one tree of all links.
void check_topology(Outline& outline, const std::string& file);

}  // namespace tandem::model
