#include "studio/history.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace tandem::studio {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

}  // namespace

History::History(std::size_t level_bytes, std::size_t signals)
    : level_floats_(level_bytes / sizeof(float)), signals_(signals) {
  lay_out();
}

void History::lay_out() {
  for (std::size_t l = 0; l < kLevels; ++l) {
    Level& level = levels_[l];
    level.rows = std::max<std::size_t>(2, level_floats_ / std::max<std::size_t>(1, width(l)));
    level.numbers.assign(level.rows * width(l), kNothing);
    level.holds.assign(level.rows, kNone);
  }
}

/// Time went back: what was from there on is no past of what comes.
void History::forget_from(std::uint64_t cycle) {
  for (std::size_t l = 0; l < kLevels; ++l) {
    Level& level = levels_[l];
    level.first = std::min(oldest(l), cycle);  // what made room for newer rows is gone
    for (std::uint64_t& number : level.holds) {
      if (number != kNone && number >= cycle / kLevelCycles[l]) number = kNone;
    }
    if (l > 0 && cycle % kLevelCycles[l] != 0) gather(l, cycle / kLevelCycles[l]);
  }
}

/// Makes a row of the rows of the level below.
void History::gather(std::size_t l, std::uint64_t number) {
  Level& level = levels_[l];
  const std::uint64_t parts = kLevelCycles[l] / kLevelCycles[l - 1];
  float* const low = &level.numbers[number % level.rows * width(l)];
  float* const high = low + signals_;
  bool begun = false;
  for (std::uint64_t part = number * parts; part < (number + 1) * parts; ++part) {
    const float* const its_low = row_of(l - 1, part);
    if (its_low == nullptr) continue;
    const float* const its_high = l == 1 ? its_low : its_low + signals_;
    for (std::size_t s = 0; s < signals_; ++s) {
      low[s] = begun ? least(low[s], its_low[s]) : its_low[s];
      high[s] = begun ? largest(high[s], its_high[s]) : its_high[s];
    }
    begun = true;
  }
  if (begun) level.holds[number % level.rows] = number;
}

void History::widen(std::size_t signals) {
  if (signals <= signals_) return;
  for (std::size_t l = 0; l < kLevels; ++l) {
    // One level at a time, so that no more than one is there twice.
    Level& level = levels_[l];
    const std::size_t parts = l == 0 ? 1 : 2;
    Level wide;
    wide.first = level.first;
    wide.rows = std::max<std::size_t>(2, level_floats_ / (parts * signals));
    wide.numbers.assign(wide.rows * parts * signals, kNothing);
    wide.holds.assign(wide.rows, kNone);
    for (std::size_t r = 0; r < level.rows; ++r) {
      const std::uint64_t number = level.holds[r];
      if (number == kNone || number + wide.rows <= newest_ / kLevelCycles[l]) continue;
      wide.holds[number % wide.rows] = number;
      for (std::size_t part = 0; part < parts; ++part) {
        std::copy_n(&level.numbers[(r * parts + part) * signals_], signals_,
                    &wide.numbers[((number % wide.rows) * parts + part) * signals]);
      }
    }
    level = std::move(wide);
  }
  signals_ = signals;
}

void History::add(std::uint64_t cycle, std::span<const float> row) {
  if (added_ != 0 && cycle <= newest_) forget_from(cycle);
  for (Level& level : levels_) {
    if (added_ == 0) level.first = cycle;
  }
  ++added_;
  newest_ = cycle;
  for (std::size_t l = 0; l < kLevels; ++l) {
    Level& level = levels_[l];
    const std::uint64_t number = cycle / kLevelCycles[l];
    const std::size_t at = number % level.rows;
    float* const low = &level.numbers[at * width(l)];
    const bool begins = std::exchange(level.holds[at], number) != number;
    if (l == 0 || begins) std::copy_n(row.begin(), signals_, low);
    if (l == 0) continue;
    float* const high = low + signals_;
    if (begins) {
      std::copy_n(row.begin(), signals_, high);
      continue;
    }
    for (std::size_t s = 0; s < signals_; ++s) low[s] = least(low[s], row[s]);
    for (std::size_t s = 0; s < signals_; ++s) high[s] = largest(high[s], row[s]);
  }
}

std::array<std::uint64_t, kLevels> History::capacity_cycles() const {
  std::array<std::uint64_t, kLevels> cycles{};
  for (std::size_t l = 0; l < kLevels; ++l) cycles[l] = levels_[l].rows * kLevelCycles[l];
  return cycles;
}

/// The first cycle of the oldest row that a level may hold.
std::uint64_t History::oldest(std::size_t level) const {
  const std::uint64_t last = newest_ / kLevelCycles[level];
  const std::uint64_t rows = levels_[level].rows;
  const std::uint64_t number = last + 1 > rows ? last + 1 - rows : 0;
  return std::max(levels_[level].first, number * kLevelCycles[level]);
}

const float* History::row_of(std::size_t level, std::uint64_t number) const {
  const Level& its = levels_[level];
  const std::size_t at = number % its.rows;
  return its.holds[at] == number ? &its.numbers[at * width(level)] : nullptr;
}

Window History::plan(std::uint64_t from, std::uint64_t to, std::size_t points) const {
  Window window;
  if (empty() || from > to || from > newest_) return window;
  std::uint64_t kept = oldest(0);
  for (std::size_t l = 1; l < kLevels; ++l) kept = std::min(kept, oldest(l));
  if (to < kept) return window;
  from = std::max(from, kept);
  to = std::min(to, newest_);
  points = std::max<std::size_t>(1, points);
  Window finer;  // of the level before, which has too many rows
  for (std::size_t l = 0; l < kLevels; ++l) {
    if (oldest(l) > from && l + 1 < kLevels) continue;
    const std::uint64_t span = kLevelCycles[l];
    window = {.level = l,
              .first_cycle = from / span * span,
              .cycles = span,
              .rows = static_cast<std::size_t>(to / span - from / span + 1)};
    if (window.rows <= 4 * points) break;
    finer = window;
  }
  const bool too_many = window.rows > 4 * points;
  if (!too_many && (finer.rows == 0 || window.rows >= points)) return window;
  if (!too_many) window = finer;  // else fewer rows than asked for
  const std::size_t merged = (window.rows + 2 * points - 1) / (2 * points);
  window.cycles *= merged;
  window.rows = (window.rows + merged - 1) / merged;
  return window;
}

void History::read(const Window& window, std::size_t signal, std::span<float> out) const {
  const std::uint64_t span = kLevelCycles[window.level];
  const std::uint64_t merged = window.cycles / span;
  const std::uint64_t last = newest_ / span;
  std::uint64_t number = window.first_cycle / span;
  std::size_t at = 0;
  for (std::size_t r = 0; r < window.rows; ++r) {
    float low = kNothing, high = kNothing;
    for (std::uint64_t k = 0; k < merged; ++k, ++number) {
      const float* row = number > last ? nullptr : row_of(window.level, number);
      if (row == nullptr) continue;
      low = least(low, row[signal]);
      high = largest(high, row[window.level == 0 ? signal : signals_ + signal]);
    }
    out[at++] = low;
    if (window.cycles != 1) out[at++] = high;
  }
}

}  // namespace tandem::studio
