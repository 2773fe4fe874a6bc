// How a search goes about: which points it looks at, by what it found at those before.
// Layer: apps/search.  Thread: main.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace tandem::apps {

/// What is searched: the unit cube, a side for each key that varies.
struct SearchSpace {
  Eigen::Index keys = 0;
  Eigen::Index along = 0;  ///< of a phase sweep
  std::size_t runs = 0;    ///< that there may be
  std::uint64_t seed = 1;
};

/// Values of points, the least of which is looked for; NaN: one has none. Fewer values than points:
/// the search ends.
using Evaluate = std::function<std::vector<double>(const std::vector<Eigen::VectorXd>&)>;

struct SearchMethod {
  std::string_view name, words;
  void (*search)(const SearchSpace& space, const Evaluate& evaluate);
};
/// The first is the default.
[[nodiscard]] std::span<const SearchMethod> search_methods();

}  // namespace tandem::apps
