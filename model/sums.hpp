// The order in which the terms of sums are added: as they become known. Layer: model.  Thread:
// non-RT.
#pragma once

#include <span>
#include <vector>

#include "model/expression.hpp"
#include "model/lanes.hpp"

namespace tandem::model {

/// A kernel in another graph, and the nodes of a first limb that were pairs with one of the second.
struct OrderedSums {
  std::vector<Expr> outputs;
  std::vector<std::uint32_t> second_of;  ///< per node; Lanes::kNone: it is none of them
};

/// The same values in another graph, where each sum of several terms adds first what is known
/// first, so that what everything else waits for is waited for once. When a term is known follows
/// from the latencies of an x86-64 CPU with fused multiply-add, all operations side by side. At
/// most as many operations; last bits differ. Sums that are alike in two limbs get the same order.
///
/// @param to  empty; receives the nodes that the results depend on.
[[nodiscard]] OrderedSums ordered_sums(const Graph& from, std::span<const Expr> outputs,
                                       const Lanes& lanes, Graph& to);

}  // namespace tandem::model
