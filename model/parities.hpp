// Linear equations over {0, 1}, by elimination. Layer: model.  Thread: non-RT.
#pragma once

#include <bit>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace tandem::model {

/// A system of linear equations over {0, 1}: each row is a sum of variables that is 0, or 1 where
/// its first bit is set.
class Parities {
 public:
  using Row = std::vector<std::uint64_t>;

  static void add(Row& row, const Row& other) {
    if (row.size() < other.size()) row.resize(other.size());
    for (std::size_t k = 0; k < other.size(); ++k) row[k] ^= other[k];
  }
  static Row variable(std::uint32_t number) {
    Row row(number / 64 + 1);
    row[number / 64] = std::uint64_t{1} << number % 64;
    return row;
  }
  [[nodiscard]] std::uint32_t new_variable() { return ++variables_; }
  /// The constant 1.
  static Row one() { return {1}; }

  /// @return false: it contradicts the others, and is left out
  bool require_zero(Row row) {
    while (const std::uint32_t last = last_variable(row)) {
      const auto known = rows_.find(last);
      if (known == rows_.end()) {
        rows_.emplace(last, std::move(row));
        return true;
      }
      add(row, known->second);
    }
    return row.empty() || (row[0] & 1) == 0;
  }
  /// Variables that no equation determines are 0.
  void solve() {
    value_.assign(variables_ + 1, false);
    value_[0] = true;
    for (const auto& [last, row] : rows_) {  // each has smaller variables beside its own
      value_[last] = false;
      value_[last] = sum(row);
    }
  }
  [[nodiscard]] bool sum(const Row& row) const {
    bool result = false;
    for (std::size_t k = 0; k < row.size(); ++k)
      for (std::uint64_t bits = row[k]; bits != 0; bits &= bits - 1)
        result ^= value_[64 * k + static_cast<std::size_t>(std::countr_zero(bits))];
    return result;
  }

 private:
  /// 0: it has none.
  static std::uint32_t last_variable(const Row& row) {
    for (std::size_t k = row.size(); k-- > 0;) {
      const std::uint64_t bits = k == 0 ? row[0] & ~std::uint64_t{1} : row[k];
      if (bits != 0) return static_cast<std::uint32_t>(64 * k + 63 - std::countl_zero(bits));
    }
    return 0;
  }

  std::map<std::uint32_t, Row> rows_;  // by their last variable
  std::vector<bool> value_;
  std::uint32_t variables_ = 0;
};

}  // namespace tandem::model
