// Which outputs of a kernel are stored at once: neighbours in memory. A mass matrix is bound by its
// stores, not by its arithmetic.
// Layer: model.  Thread: non-RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

namespace tandem::model {

/// One store of `count` (1, 2 or 4) outputs, from the `first` on.
struct OutputStore {
  std::uint32_t first = 0;
  std::uint32_t count = 1;
  std::size_t time = 0;  ///< when the last of them is known
};

/// Every output of `known` (output -> when it is known) in one store, with neighbours that are
/// known at about the same time.
///
/// @param array_of  per output: its array, which no store leaves
/// @param longest   times that one may wait for another; 0: each is stored alone
[[nodiscard]] std::vector<OutputStore> stores_of(std::map<std::uint32_t, std::size_t> known,
                                                 std::span<const std::uint32_t> array_of,
                                                 std::size_t longest);

/// Stores of one constant to all `wanted` outputs: as few as can be, the last of a run may overlap
/// the one before.
[[nodiscard]] std::vector<OutputStore> stores_of_runs(const std::vector<bool>& wanted,
                                                      std::span<const std::uint32_t> array_of);

}  // namespace tandem::model
