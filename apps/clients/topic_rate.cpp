#include "apps/clients/topic_rate.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tandem::apps {
void TopicRate::arrived(std::int64_t time_ns, std::optional<std::uint64_t> cycle) {
  if (samples_++ > 0) {
    intervals_ns_.push_back(time_ns - last_ns_);
    if (intervals_ns_.size() > window_) intervals_ns_.pop_front();
    all_.record(time_ns - last_ns_);
  }
  last_ns_ = time_ns;
  if (!cycle) return;
  if (!last_cycle_ || *cycle <= *last_cycle_) {  // the first, or of another run
    first_cycle_ = cycle;
    told_ = 0;
  } else {
    const std::uint64_t step = *cycle - *last_cycle_;
    step_ = step_ == 0 ? step : std::min(step_, step);
    common_ = std::gcd(common_, step);
  }
  last_cycle_ = cycle;
  ++told_;
}

std::optional<std::uint64_t> TopicRate::lost() const {
  if (!first_cycle_ || common_ != step_) return std::nullopt;
  if (step_ == 0) return 0;
  const std::uint64_t sent = (*last_cycle_ - *first_cycle_) / step_ + 1;
  return sent > told_ ? sent - told_ : 0;
}

RateFigures TopicRate::figures() const {
  RateFigures f{
      .samples = samples_, .window = intervals_ns_.size(), .interval = all_, .lost = lost()};
  if (intervals_ns_.empty()) return f;
  const auto count = static_cast<double>(intervals_ns_.size());
  double sum = 0.0, squares = 0.0;
  for (const std::int64_t ns : intervals_ns_) sum += static_cast<double>(ns) * 1e-9;
  const double mean = sum / count;
  for (const std::int64_t ns : intervals_ns_) {
    const double off = static_cast<double>(ns) * 1e-9 - mean;
    squares += off * off;
  }
  f.rate_Hz = 1.0 / mean;
  f.min_s = static_cast<double>(*std::ranges::min_element(intervals_ns_)) * 1e-9;
  f.max_s = static_cast<double>(*std::ranges::max_element(intervals_ns_)) * 1e-9;
  f.deviation_s = std::sqrt(squares / count);
  return f;
}

void figures(Figures& f, const RateFigures& rate) {
  f("samples", "received", rate.samples);
  f("window", "number of newest intervals used for the next four", rate.window);
  f("rate_Hz", "1 / mean interval; null, as the next three: no interval", rate.rate_Hz);
  f("min_s", rate.min_s);
  f("max_s", rate.max_s);
  f("deviation_s", "standard deviation", rate.deviation_s);
  f("interval_ns", "of all intervals", rate.interval);
  f("lost", "by the cycles' numbers; null: the type has none, or they are not evenly apart",
    rate.lost);
}

Json TopicRate::json() const { return figures_json(figures()); }

std::string TopicRate::line() const {
  return figures_text(
             "{rate_Hz:.2f Hz}   min {min_s:.3f ms}   max {max_s:.3f ms}   std {deviation_s:.3f ms}"
             "   window {window}",
             json())
      .value_or("waiting for samples");
}

void TopicRate::add_to(Facts& facts) const {
  add_figures(facts, json(),
              {{"samples", "{samples}"},
               {"rate", "{rate_Hz:.2f Hz}, of the last {window} intervals"},
               {"min/max/std", "{min_s:.3f} / {max_s:.3f} / {deviation_s:.3f ms}"},
               {"interval p50/p99/p99.9/max",
                fmt::format("{{interval_ns:.3f ms}}, of all {}", all_.count())}});
  const auto missing = lost();
  facts.add("lost",
            missing ? fmt::format("{} of {}, by the cycles' numbers", *missing, told_ + *missing)
            : first_cycle_ ? "unknown: the topic has some cycles only, not evenly apart"
                           : "unknown: the type has no cycle numbers");
}

}  // namespace tandem::apps
