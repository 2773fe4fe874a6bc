#include "apps/clients/topic_rate.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace tandem::apps {
namespace {

double ms(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }

}  // namespace

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
  }
  last_cycle_ = cycle;
  ++told_;
}

std::optional<std::uint64_t> TopicRate::lost() const {
  if (!first_cycle_) return std::nullopt;
  if (step_ == 0) return 0;
  const std::uint64_t sent = (*last_cycle_ - *first_cycle_) / step_ + 1;
  return sent > told_ ? sent - told_ : 0;
}

TopicRate::Figures TopicRate::figures() const {
  Figures f;
  if (intervals_ns_.empty()) return f;
  const auto count = static_cast<double>(intervals_ns_.size());
  double sum = 0.0, squares = 0.0;
  for (const std::int64_t ns : intervals_ns_) sum += static_cast<double>(ns) * 1e-9;
  const double mean = sum / count;
  for (const std::int64_t ns : intervals_ns_) {
    const double off = static_cast<double>(ns) * 1e-9 - mean;
    squares += off * off;
  }
  f.rate_Hz = mean > 0.0 ? 1.0 / mean : 0.0;
  f.min_s = static_cast<double>(*std::ranges::min_element(intervals_ns_)) * 1e-9;
  f.max_s = static_cast<double>(*std::ranges::max_element(intervals_ns_)) * 1e-9;
  f.deviation_s = std::sqrt(squares / count);
  return f;
}

std::string TopicRate::line() const {
  if (samples_ < 2) return "waiting for samples";
  const Figures f = figures();
  return fmt::format("{:.2f} Hz   min {:.3f} ms   max {:.3f} ms   std {:.3f} ms   window {}",
                     f.rate_Hz, f.min_s * 1e3, f.max_s * 1e3, f.deviation_s * 1e3,
                     intervals_ns_.size());
}

Json TopicRate::json() const {
  const Figures f = figures();
  const auto missing = lost();
  Json json;
  json["samples"] = samples_;
  json["window"] = intervals_ns_.size();
  json["rate_Hz"] = f.rate_Hz;
  json["min_s"] = f.min_s;
  json["max_s"] = f.max_s;
  json["deviation_s"] = f.deviation_s;
  json["interval_ns"] = percentiles_json(all_);
  json["lost"] = missing ? Json(*missing) : Json(nullptr);
  return json;
}

void TopicRate::add_to(Facts& facts) const {
  const Figures f = figures();
  const rt::Percentiles p = all_.percentiles();
  facts.add("rate",
            fmt::format("{:.2f} Hz, of the last {} intervals", f.rate_Hz, intervals_ns_.size()));
  facts.add("min/max/std", fmt::format("{:.3f} / {:.3f} / {:.3f} ms", f.min_s * 1e3, f.max_s * 1e3,
                                       f.deviation_s * 1e3));
  facts.add("interval p50/p99/p99.9/max",
            fmt::format("{:.3f} / {:.3f} / {:.3f} / {:.3f} ms, of all {}", ms(p.p50), ms(p.p99),
                        ms(p.p999), ms(p.max), all_.count()));
  const auto missing = lost();
  facts.add("lost",
            missing ? fmt::format("{} of {}, by the cycles' numbers", *missing, told_ + *missing)
                    : "unknown: the type has no cycle numbers");
}

}  // namespace tandem::apps
