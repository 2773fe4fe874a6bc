// What an experiment expects of its run: [[expect]].
// Layer: runtime/condition.  Thread: plain data.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace tandem::runtime {

/// How an expectation is judged.
enum class ExpectationKind : std::uint8_t {
  kAlways,      ///< a condition holds in every cycle of the window
  kNever,       ///< its opposite does
  kEventually,  ///< it holds in one of them
  kBounds,      ///< a number is within the bounds in every cycle
  kRms,         ///< its root mean square is
  kMean,        ///< its mean is
  kFinal,       ///< it is, in the last cycle
  kWork,        ///< what a joint, or all, have done while they drove is, at the end of the window
  kSettles,     ///< it is, from some cycle to the last, and that comes within `in_s`
  kAsIn,        ///< it differs from that of a recorded run by less than `within` in every cycle
};

/// A row of [[expect]], as the file has it.
struct ExpectationSpec {
  ExpectationKind kind = ExpectationKind::kAlways;
  std::string name;
  std::string text;          ///< the condition, the number, or the joint; "*" of kWork: all
  std::string above, below;  ///< "0.4m"; empty: no such bound
  double in_s = 0.0;         ///< kSettles
  std::string log, within;   ///< kAsIn: the recorded run; "1mrad"
  double from_s = 0.0;       ///< the window's begin, since the controllers start, or since `after`
  double to_s = std::numeric_limits<double>::infinity();
  std::string after;      ///< a condition; empty: none
  bool stays_up = false;  ///< the condition is about a floating base
  int line = 0, above_line = 0, below_line = 0, after_line = 0, within_line = 0;  ///< in the file
};

/// Rows of an experiment, at most: each costs some 30 ns a cycle.
inline constexpr std::size_t kMostExpectations = 200;

}  // namespace tandem::runtime
