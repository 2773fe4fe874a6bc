// A look at a line that moves nothing: who answers, and how well the clocks follow each other.
// Layer: hal/ethercat-can/line.  Thread: main; not RT.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "ethercat/sii.hpp"
#include "hal/ethercat-can/line/link.hpp"

namespace tandem::hal::ecat {

/// One slave as it was found.
struct SurveyedSlave {
  bool identified = false;           ///< its SII could be read
  ethercat::sii::Identity identity;  ///< serial number left out
  bool settings_right = true;        ///< its SII's check sum is that of its settings
  bool has_clock = false;
  // Measurements of a clock that follows the reference, over the measured cycles:
  std::uint64_t samples = 0;
  std::uint32_t delay_ns = 0;      ///< of a frame from the reference, one way
  std::int64_t difference_ns = 0;  ///< the largest, without its sign
  double jitter_ns = 0.0;          ///< standard deviation of the difference
};

struct LineSurvey {
  std::uint64_t strangers = 0;        ///< frames of another master; then nothing else was looked at
  std::size_t found = 0;              ///< slaves that answer
  std::uint8_t states = 0;            ///< AL states of all, ORed
  std::vector<SurveyedSlave> slaves;  ///< in the line's order, at most kMostSurveyed
  std::size_t reference = 0;          ///< whose clock the others follow; slaves.size(): none
  std::uint64_t asked = 0;            ///< datagrams that were to be answered
  std::uint64_t repeated = 0;         ///< of them sent again, because no answer came in 5 ms
};

inline constexpr std::size_t kMostSurveyed = 126;

struct SurveyTiming {
  std::int64_t listen_ns = 100'000'000;
  std::int64_t period_ns = 1'000'000;      ///< between two samples
  std::int64_t settle_ns = 5'000'000'000;  ///< that the clocks may take to come near
  int cycles = 200;                        ///< that are measured
};

/// Blocks until a frame has come or the time is over. @return now, monotonic [ns]
using SurveyWait = std::function<std::int64_t(std::int64_t at_most_ns)>;

/// Listens first; sends only when no frame passes. No slave changes its state: memory and clocks
/// are read as well in INIT. The clocks are only set when all slaves are in INIT, where no SYNC0
/// depends on them; else there are no samples. The reference is the first slave with a clock.
[[nodiscard]] LineSurvey survey_line(DataLink& link, const SurveyTiming& timing,
                                     const SurveyWait& wait);

}  // namespace tandem::hal::ecat
