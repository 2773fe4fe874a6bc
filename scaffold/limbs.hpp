// A robot's limbs: what gets a bus of its own, and the names that people would give.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <string>
#include <vector>

#include "scaffold/feet.hpp"

namespace tandem::scaffold {

struct Limb {
  std::string name;         ///< "left_leg", "torso", "arm"; unique
  std::vector<int> joints;  ///< in the tree, the root's side first
  int foot = -1;            ///< in `feet`; -1: none
};

/// Splits the tree at its root, and where two heavy branches part (a torso under its arms). A
/// hand stays with its arm. Names the feet after their limbs.
[[nodiscard]] std::vector<Limb> split_limbs(const model::Tree& tree, std::vector<FoundFoot>& feet,
                                            const Posed& neutral, const Eigen::Vector3d& ahead);

}  // namespace tandem::scaffold
