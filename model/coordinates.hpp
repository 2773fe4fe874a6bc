// From the coordinates to every joint and back, where joints follow others (URDF: mimic):
// q_tree = G q + g. G has one entry in each row; its base's rows are the identity.
// Layer: model.  Thread: any.
#pragma once

#include <span>
#include <vector>

#include "model/mechanism.hpp"

namespace tandem::model {

/// Every joint's position from the coordinates (kernel_nq), the base's as they are.
template <class S>
[[nodiscard]] std::vector<S> spread_positions(const Mechanism& m, std::span<const S> q) {
  std::vector<S> tree(q.begin(), q.begin() + m.q_index(0));
  for (const JointCoordinate& c : m.coordinate_of)
    tree.push_back(q[m.q_index(c.index)] * S(c.multiplier) + S(c.offset));
  return tree;
}

/// Every joint's rate, or acceleration, from the coordinates' (kernel_nv): G v.
template <class S>
[[nodiscard]] std::vector<S> spread_rates(const Mechanism& m, std::span<const S> v) {
  std::vector<S> tree(v.begin(), v.begin() + m.v_index(0));
  for (const JointCoordinate& c : m.coordinate_of)
    tree.push_back(v[m.v_index(c.index)] * S(c.multiplier));
  return tree;
}

/// A matrix (rows x nv, row-major) for the coordinates (rows x kernel_nv): A G.
template <class S>
[[nodiscard]] std::vector<S> gather_columns(const Mechanism& m, std::span<const S> tree) {
  const int base = m.v_index(0);
  const int rows = static_cast<int>(tree.size()) / m.nv();
  std::vector<S> result(static_cast<std::size_t>(rows * m.kernel_nv()), S(0.0));
  for (int row = 0; row < rows; ++row) {
    const auto from = tree.subspan(static_cast<std::size_t>(row * m.nv()));
    S* to = result.data() + row * m.kernel_nv();
    for (int i = 0; i < base; ++i) to[i] = from[i];
    for (int j = 0; j < m.joint_count(); ++j) {
      const JointCoordinate& c = m.coordinate_of[j];
      to[base + c.index] += from[base + j] * S(c.multiplier);
    }
  }
  return result;
}

/// Generalised forces for the coordinates: G^T tau.
template <class S>
[[nodiscard]] std::vector<S> gather_forces(const Mechanism& m, std::span<const S> tree) {
  return gather_columns<S>(m, tree);  // tau^T G
}

/// A matrix (nv x columns, row-major) for the coordinates (kernel_nv x columns): G^T A.
template <class S>
[[nodiscard]] std::vector<S> gather_rows(const Mechanism& m, std::span<const S> tree) {
  const std::size_t columns = tree.size() / static_cast<std::size_t>(m.nv());
  std::vector<S> result(static_cast<std::size_t>(m.kernel_nv()) * columns, S(0.0));
  const auto add = [&](int from, int to, double factor) {
    for (std::size_t k = 0; k < columns; ++k)
      result[static_cast<std::size_t>(to) * columns + k] +=
          tree[static_cast<std::size_t>(from) * columns + k] * S(factor);
  };
  for (int i = 0; i < m.v_index(0); ++i) add(i, i, 1.0);
  for (int j = 0; j < m.joint_count(); ++j) {
    const JointCoordinate& c = m.coordinate_of[j];
    add(m.v_index(j), m.v_index(c.index), c.multiplier);
  }
  return result;
}

/// Solves A X = B in place for a symmetric positive definite A (row-major, overwritten) and a B of
/// so many columns (row-major), as L^T D L from the last row to the first (Featherstone 2008,
/// section 6.5): coordinates of different limbs do not meet, so that, over expressions, A's zeros
/// stay and cost nothing.
template <class S>
void solve_from_leaves(std::vector<S>& A, std::vector<S>& B, int columns = 1) {
  const int n = static_cast<int>(B.size()) / columns;
  const auto at = [&](int i, int j) -> S& { return A[static_cast<std::size_t>(i * n + j)]; };
  const auto row = [&](int i) { return B.begin() + static_cast<std::ptrdiff_t>(i) * columns; };
  const auto subtract = [&](int i, const S& factor, int k) {
    for (int c = 0; c < columns; ++c) row(i)[c] -= factor * row(k)[c];
  };
  std::vector<S> reciprocal(static_cast<std::size_t>(n));
  for (int k = n - 1; k >= 0; --k) {
    reciprocal[k] = S(1.0) / at(k, k);
    for (int i = k - 1; i >= 0; --i) {
      const S l = at(k, i) * reciprocal[k];
      for (int j = i; j >= 0; --j) at(i, j) -= l * at(k, j);
      subtract(i, l, k);
      at(i, k) = l;
    }
  }
  for (int k = 0; k < n; ++k) {
    for (int c = 0; c < columns; ++c) row(k)[c] *= reciprocal[k];
    for (int i = 0; i < k; ++i) subtract(k, at(i, k), i);
  }
}

}  // namespace tandem::model
