// Which rows of a matrix are independent of each other.
// Layer: controllers.  Thread: non-RT only.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

namespace tandem {

/// Rows that are linearly independent and span what all do, in ascending order. Those of a lower
/// priority number are taken first; among equals always the one that stands out most from the
/// taken ones (Gram and Schmidt with pivoting).
///
/// @param priorities  one per row; empty: all alike
[[nodiscard]] inline std::vector<Eigen::Index> independent_rows(Eigen::MatrixXd rows,
                                                                std::vector<int> priorities) {
  constexpr double kDependent = 1e-4;  // of the longest row: what is left is rounding, or nearly
  priorities.resize(static_cast<std::size_t>(rows.rows()), 0);
  std::vector<Eigen::Index> taken;
  if (rows.size() == 0) return taken;
  const double least = kDependent * rows.rowwise().norm().maxCoeff();
  std::vector<int> levels = priorities;
  std::ranges::sort(levels);
  for (std::size_t i = 0; i < levels.size(); ++i) {
    Eigen::Index best = -1;
    double length = least;
    for (Eigen::Index row = 0; row < rows.rows(); ++row) {
      if (priorities[static_cast<std::size_t>(row)] != levels[i]) continue;
      if (rows.row(row).norm() <= length) continue;
      best = row;
      length = rows.row(row).norm();
    }
    if (best < 0) continue;  // the rest of this level depends on what is taken
    taken.push_back(best);
    const Eigen::RowVectorXd along = rows.row(best) / length;
    rows -= (rows * along.transpose()) * along;
    rows.row(best).setZero();
  }
  std::ranges::sort(taken);
  return taken;
}

}  // namespace tandem
