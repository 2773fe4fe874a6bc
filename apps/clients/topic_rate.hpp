// How often and how evenly samples arrive: what `tandem topic hz` shows.
// Layer: apps/clients.  Thread: main.
#pragma once

#include <cmath>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "apps/text/figures.hpp"
#include "rt/histogram.hpp"

namespace tandem::apps {

/// Not a number: there was no interval yet.
struct RateFigures {
  std::uint64_t samples = 0;
  std::size_t window = 0;                                             ///< newest intervals
  double rate_Hz = NAN, min_s = NAN, max_s = NAN, deviation_s = NAN;  ///< of these
  rt::Histogram interval;                                             ///< of all
  std::optional<std::uint64_t> lost;  ///< nothing: no cycle numbers, or uneven ones
};
void figures(Figures& f, const RateFigures& rate);

/// Arrivals of one topic's samples.
class TopicRate {
 public:
  /// @param window  the newest intervals that rate, min, max and deviation are of; at least 1
  explicit TopicRate(std::size_t window) : window_(window) {}

  /// @param cycle  of the loop, where the sample has it
  void arrived(std::int64_t time_ns, std::optional<std::uint64_t> cycle);

  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  /// Samples that were sent but did not come, by the cycles' numbers; empty where there are
  /// none, and where their distances have no common step: then nobody can tell what was sent.
  [[nodiscard]] std::optional<std::uint64_t> lost() const;

  /// "99.98 Hz, min 9.1 ms, …"
  [[nodiscard]] std::string line() const;
  /// docs/json.md
  [[nodiscard]] Json json() const;
  void add_to(Facts& facts) const;

 private:
  [[nodiscard]] RateFigures figures() const;

  std::size_t window_;
  std::uint64_t samples_ = 0;
  std::int64_t last_ns_ = 0;
  std::deque<std::int64_t> intervals_ns_;
  rt::Histogram all_;  // intervals
  std::optional<std::uint64_t> first_cycle_, last_cycle_;
  std::uint64_t step_ = 0;    // the smallest between two cycles
  std::uint64_t common_ = 0;  // of which every step between two cycles is a multiple
  std::uint64_t told_ = 0;    // samples with a cycle, since the numbers began anew
};

}  // namespace tandem::apps
