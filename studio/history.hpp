// The numbers of the last cycles, at three grains: each cycle, and the least and largest of 16 and
// of 256. A spike of one cycle is seen at every grain.
// Layer: studio.  Thread: one at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tandem::studio {

inline constexpr std::size_t kLevels = 3;
/// Cycles of one row, by level.
inline constexpr std::array<std::uint64_t, kLevels> kLevelCycles{1, 16, 256};

/// Part of the history, as it is handed out: `rows` rows of `cycles` cycles each.
struct Window {
  std::size_t level = 0;
  std::uint64_t first_cycle = 0;  ///< of the first row
  std::uint64_t cycles = 1;       ///< of a row: the level's, or a multiple
  std::size_t rows = 0;           ///< 0: nothing is kept of that time
  /// Numbers of a signal: one a row where a row is one cycle, else least and largest.
  [[nodiscard]] std::size_t numbers() const { return cycles == 1 ? rows : 2 * rows; }
};

/// A fixed amount of memory for each level, whose oldest rows make room for new ones. NaN is no
/// value: a gap, or a signal that was not there.
class History {
 public:
  /// Allocates everything, and touches it.
  /// @param level_bytes  of each level; at least two rows are kept whatever it says
  /// @param signals      numbers of a row
  History(std::size_t level_bytes, std::size_t signals);

  /// More signals from now on: the newest rows stay, in the same amount of memory.
  /// @pre signals is not less than before
  void widen(std::size_t signals);
  [[nodiscard]] std::size_t signals() const { return signals_; }

  /// The numbers of one cycle. One that is not after the newest replaces what lies from it on: of
  /// the coarser rows that it divides, what lay before it stays where a finer row still has it.
  /// @param row  signals() numbers
  void add(std::uint64_t cycle, std::span<const float> row);

  [[nodiscard]] bool empty() const { return added_ == 0; }
  [[nodiscard]] std::uint64_t newest() const { return newest_; }
  /// How many cycles each level can hold.
  [[nodiscard]] std::array<std::uint64_t, kLevels> capacity_cycles() const;

  /// What to hand out of the cycles from `from` to `to`: the finest level that goes back so far and
  /// has no more than 4 * points rows there. Where that has less than `points`, or no level so few,
  /// rows of the one before are merged, to 2 * points at most.
  [[nodiscard]] Window plan(std::uint64_t from, std::uint64_t to, std::size_t points) const;
  /// The numbers of one signal. @param out  window.numbers()
  void read(const Window& window, std::size_t signal, std::span<float> out) const;

 private:
  static constexpr std::uint64_t kNone = ~std::uint64_t{0};
  struct Level {
    std::size_t rows = 0;
    std::vector<float> numbers;        // by row: of each signal; above level 0 least, then largest
    std::vector<std::uint64_t> holds;  // by row: which multiple of the level's cycles; kNone: none
    std::uint64_t first = 0;           // cycle that it begins with
  };

  void lay_out();
  void forget_from(std::uint64_t cycle);
  void gather(std::size_t level, std::uint64_t number);
  [[nodiscard]] std::uint64_t oldest(std::size_t level) const;
  [[nodiscard]] std::size_t width(std::size_t level) const {
    return level == 0 ? signals_ : 2 * signals_;
  }
  [[nodiscard]] const float* row_of(std::size_t level, std::uint64_t number) const;

  std::size_t level_floats_;
  std::size_t signals_;
  std::array<Level, kLevels> levels_;
  std::uint64_t newest_ = 0;
  std::uint64_t added_ = 0;
};

/// The less and the larger of two of which one may be NaN.
[[nodiscard]] constexpr float least(float a, float b) { return b < a || a != a ? b : a; }
[[nodiscard]] constexpr float largest(float a, float b) { return b > a || a != a ? b : a; }

}  // namespace tandem::studio
