// Limbs of one body that are built alike, as the left and right ones of a humanoid are: found in
// the tree's structure and numbers, not in its names.
// Layer: model.  Thread: non-RT.
#pragma once

#include <vector>

#include "model/tree.hpp"

namespace tandem::model {

/// Two subtrees that start at the same body. Their joints, index in the tree, correspond one by
/// one: `second[k]` is to the second limb what `first[k]` is to the first.
struct LimbPair {
  std::vector<int> first, second;
};

/// Every pair of limbs, each joint in one at most. Two subtrees are alike where every joint of the
/// one has a joint of the other of the same type, with as many joints behind it, and masses that
/// differ by a tenth at most, whatever the directions: mirrored, turned, or moved. Of several that
/// are alike, those that differ least in masses and lengths are a pair.
[[nodiscard]] std::vector<LimbPair> find_limb_pairs(const Tree& tree);

}  // namespace tandem::model
