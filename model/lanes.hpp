// The operations of two limbs that are built alike, side by side in the two lanes of a vector.
// Layer: model.  Thread: non-RT.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "model/emit.hpp"
#include "model/expression.hpp"
#include "model/mechanism.hpp"

namespace tandem::model {

/// Pairs of a graph's nodes. The vector of a pair holds the node of the first limb in lane 0, and
/// plus or minus that of the second in lane 1: its sign is chosen so that one operation on vectors
/// serves both, as the numbers of mirrored limbs differ in signs.
struct Lanes {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  std::vector<std::uint32_t> second_of;  ///< per node; may be empty: no pairs
  std::vector<std::uint32_t> first_of;   ///< the same
  std::vector<bool> minus;               ///< per node of a first limb
  /// Per node of a second limb: that of the first which it is like. Its partner, but where two
  /// first limbs share what is two nodes of the second limbs.
  std::vector<std::uint32_t> like_of;
  std::vector<bool> swapped;     ///< per node of a second limb: its operands the other way round
  std::uint32_t operations = 0;  ///< on vectors, each of two nodes

  /// The partner of a node of a first limb; kNone: it is none, or has none.
  [[nodiscard]] std::uint32_t second(std::uint32_t first) const {
    return second_of.empty() ? kNone : second_of[first];
  }
  /// What a node of a second limb is like; kNone: it is none, or like none.
  [[nodiscard]] std::uint32_t like(std::uint32_t second) const {
    return like_of.empty() ? kNone : like_of[second];
  }
  /// The partner of a node of a second limb; kNone: it is none, or has none.
  [[nodiscard]] std::uint32_t first(std::uint32_t second) const {
    return first_of.empty() ? kNone : first_of[second];
  }
};

/// Pairs what can be paired of the nodes that the kernel's outputs depend on: inputs, sines and
/// cosines of angles, and operations of which each operand is a pair as well, a constant, the same
/// node of the trunk for both limbs, or what each limb makes of the trunk alone. No pair at all
/// where they are fewer than 5 % of the operations, which does not pay: so a robot without such
/// limbs gets scalar kernels.
///
/// @param wanted  per node of a first limb the one to prefer as its partner, where it is known; may
///                be empty.
[[nodiscard]] Lanes pair_lanes(const Graph& graph, const TracedKernel& kernel, const Mechanism& m,
                               std::span<const std::uint32_t> wanted = {});

}  // namespace tandem::model
