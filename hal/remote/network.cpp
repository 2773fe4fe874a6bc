// As net/sched/sch_netem.c has it, with doubles in place of its fixed-point numbers.
#include "hal/remote/network.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "base/split_mix.hpp"

namespace tandem::remote {
namespace {

constexpr double kOrderRate_bit_s = 100e9;  // the rate that keeps the order and costs nothing
constexpr double kMostPareto = 4.0;         // netem's tables end there

double uniform(std::uint64_t& state) noexcept {
  return static_cast<double>(split_mix(state) >> 11) * 0x1p-53;
}

/// The standard normal distribution's quantile (Acklam's rational functions, relative error below
/// 1.2e-9).
double normal_quantile(double u) noexcept {
  constexpr double kA[] = {-3.969683028665376e+01, 2.209460984245205e+02,  -2.759285104469687e+02,
                           1.383577518672690e+02,  -3.066479806614716e+01, 2.506628277459239e+00};
  constexpr double kB[] = {-5.447609879822406e+01, 1.615858368580409e+02, -1.556989798598866e+02,
                           6.680131188771972e+01, -1.328068155288572e+01};
  constexpr double kC[] = {-7.784894002430293e-03, -3.223964580411365e-01, -2.400758277161838e+00,
                           -2.549732539343734e+00, 4.374664141464968e+00,  2.938163982698783e+00};
  constexpr double kD[] = {7.784695709041462e-03, 3.224671290700398e-01, 2.445134137142996e+00,
                           3.754408661907416e+00};
  constexpr double kLow = 0.02425;
  u = std::clamp(u, 1e-12, 1.0 - 1e-12);
  const bool upper = u > 1.0 - kLow;
  if (u < kLow || upper) {
    const double q = std::sqrt(-2.0 * std::log(upper ? 1.0 - u : u));
    const double x = (((((kC[0] * q + kC[1]) * q + kC[2]) * q + kC[3]) * q + kC[4]) * q + kC[5]) /
                     ((((kD[0] * q + kD[1]) * q + kD[2]) * q + kD[3]) * q + 1.0);
    return upper ? -x : x;
  }
  const double q = u - 0.5;
  const double r = q * q;
  return (((((kA[0] * r + kA[1]) * r + kA[2]) * r + kA[3]) * r + kA[4]) * r + kA[5]) * q /
         (((((kB[0] * r + kB[1]) * r + kB[2]) * r + kB[3]) * r + kB[4]) * r + 1.0);
}

double pareto_quantile(double u) noexcept {
  const double x = std::cbrt(1.0 / std::max(1.0 - u, 1e-12));
  return std::min(4.0 / 3.0 * (x - 1.5), kMostPareto);
}

/// In jitters.
double deviation(DelayDistribution distribution, double u) noexcept {
  switch (distribution) {
    case DelayDistribution::kUniform: return 2.0 * u - 1.0;
    case DelayDistribution::kNormal: return normal_quantile(u);
    case DelayDistribution::kPareto: return pareto_quantile(u);
    case DelayDistribution::kParetoNormal:
      return 0.25 * normal_quantile(u) + 0.75 * pareto_quantile(u);
  }
  return 0.0;
}

std::string text(const char* format, double value) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

std::string percent(double share) { return text("%.6g%%", 100.0 * share); }
std::string time_text(double seconds) { return text("%.6gms", 1e3 * seconds); }

}  // namespace

Status check(const NetworkConfig& c) {
  const std::pair<const char*, double> shares[] = {
      {"delay_correlation", c.delay_correlation},
      {"loss", c.loss},
      {"loss_correlation", c.loss_correlation},
      {"p13", c.p13},
      {"p31", c.p31},
      {"p32", c.p32},
      {"p23", c.p23},
      {"p14", c.p14},
      {"to_bad", c.to_bad},
      {"to_good", c.to_good},
      {"loss_in_bad", c.loss_in_bad},
      {"loss_in_good", c.loss_in_good},
      {"duplicate", c.duplicate},
      {"duplicate_correlation", c.duplicate_correlation},
      {"reorder", c.reorder},
      {"reorder_correlation", c.reorder_correlation}};
  for (const auto& [key, share] : shares) {
    if (!(share >= 0.0 && share <= 1.0)) return fail_at(key, "is no share", "give 0 to 1");
  }
  if (c.p13 + c.p14 > 1.0) return fail_at("p14", "with p13 is more than 1", "lower one of them");
  if (c.p31 + c.p32 > 1.0) return fail_at("p32", "with p31 is more than 1", "lower one of them");
  if (!(c.delay_s >= 0.0 && c.delay_s <= 600.0)) {
    return fail_at("delay_s", "is no delay", "give 0 to 600 s");
  }
  if (!(c.jitter_s >= 0.0 && c.jitter_s <= 600.0)) {
    return fail_at("jitter_s", "is no jitter", "give 0 to 600 s");
  }
  if (c.reorder > 0.0 && c.delay_s == 0.0) {
    return fail_at("reorder", "needs a delay: what is reordered is what is not delayed",
                   "give delay_s, or leave it out");
  }
  if (c.gap == 0) return fail_at("gap", "is 0", "give 1 or more");
  if (!(c.rate_bit_s >= 0.0 && c.rate_bit_s <= 1e12)) {
    return fail_at("rate_bit_s", "is no rate", "give up to 1e12; 0: no limit");
  }
  if (c.limit == 0 || c.limit > 1'000'000) {
    return fail_at("limit", "is no number of messages", "give 1 to 1000000");
  }
  return {};
}

double mean_loss(const NetworkConfig& c) {
  switch (c.loss_model) {
    case LossModel::kRandom: return c.loss;
    case LossModel::kGilbertElliott: {
      if (c.to_bad + c.to_good == 0.0) return c.loss_in_good;
      const double bad = c.to_bad / (c.to_bad + c.to_good);
      return bad * c.loss_in_bad + (1.0 - bad) * c.loss_in_good;
    }
    case LossModel::kMarkov: break;
  }
  // Stationary: what enters a state leaves it. With pi1 = 1; a burst that has no way out is for
  // ever.
  if (c.p13 > 0.0 && c.p31 == 0.0) return c.p32 == 0.0 ? 1.0 : c.p23 / (c.p23 + c.p32);
  const double pi4 = c.p14;
  const double pi3 = c.p13 == 0.0 ? 0.0 : c.p13 / c.p31;
  const double pi2 = pi3 == 0.0 || c.p23 == 0.0 ? 0.0 : pi3 * c.p32 / c.p23;
  return (pi3 + pi4) / (1.0 + pi2 + pi3 + pi4);
}

std::string tc_command(const NetworkConfig& c, const std::string& interface) {
  std::string line =
      "tc qdisc add dev " + interface + " root netem limit " + std::to_string(c.limit);
  if (c.delay_s > 0.0 || c.jitter_s > 0.0) {
    line += " delay " + time_text(c.delay_s);
    if (c.jitter_s > 0.0) {
      line += " " + time_text(c.jitter_s);
      if (c.delay_correlation > 0.0) line += " " + percent(c.delay_correlation);
      constexpr const char* kNames[] = {"uniform", "normal", "pareto", "paretonormal"};
      if (c.distribution != DelayDistribution::kUniform) {
        line += std::string(" distribution ") + kNames[static_cast<std::size_t>(c.distribution)];
      }
    }
  }
  switch (c.loss_model) {
    case LossModel::kRandom:
      if (c.loss > 0.0) line += " loss random " + percent(c.loss);
      if (c.loss > 0.0 && c.loss_correlation > 0.0) line += " " + percent(c.loss_correlation);
      break;
    case LossModel::kMarkov:
      line += " loss state " + percent(c.p13) + " " + percent(c.p31) + " " + percent(c.p32) + " " +
              percent(c.p23) + " " + percent(c.p14);
      break;
    case LossModel::kGilbertElliott:
      line += " loss gemodel " + percent(c.to_bad) + " " + percent(c.to_good) + " " +
              percent(c.loss_in_bad) + " " + percent(c.loss_in_good);
      break;
  }
  if (c.duplicate > 0.0) line += " duplicate " + percent(c.duplicate);
  if (c.duplicate > 0.0 && c.duplicate_correlation > 0.0) {
    line += " " + percent(c.duplicate_correlation);
  }
  if (c.reorder > 0.0) {
    line += " reorder " + percent(c.reorder);
    if (c.reorder_correlation > 0.0) line += " " + percent(c.reorder_correlation);
    line += " gap " + std::to_string(c.gap);
  }
  const double rate = c.rate_bit_s > 0.0 ? c.rate_bit_s : c.keeps_order ? kOrderRate_bit_s : 0.0;
  if (rate > 0.0) line += " rate " + text("%.0fbit", rate);
  return line;
}

CorrelatedRandom::CorrelatedRandom(double correlation, std::uint64_t seed) noexcept
    : correlation_(correlation), state_(seed), last_(uniform(state_)) {}

double CorrelatedRandom::next() noexcept TANDEM_RT {
  const double value = uniform(state_);
  if (correlation_ == 0.0) return value;
  last_ = (1.0 - correlation_) * value + correlation_ * last_;
  return last_;
}

Network::Network(const NetworkConfig& config, std::uint64_t seed, std::size_t most_bytes)
    : config_(config),
      delay_(config.delay_correlation, split_mix(seed)),
      loss_(config.loss_correlation, split_mix(seed)),
      duplicate_(config.duplicate_correlation, split_mix(seed)),
      reorder_(config.reorder_correlation, split_mix(seed)),
      random_(split_mix(seed)),
      most_bytes_(most_bytes),
      queue_(config.limit),
      free_(config.limit),
      bytes_(config.limit * most_bytes) {
  for (std::size_t i = 0; i < queue_.size(); ++i) queue_[i].place = static_cast<std::uint32_t>(i);
}

bool Network::is_lost() noexcept TANDEM_RT {
  switch (config_.loss_model) {
    case LossModel::kRandom: return config_.loss > 0.0 && loss_.next() < config_.loss;
    case LossModel::kGilbertElliott: {
      const bool was_bad = state_ == 2;
      if (uniform(random_) < (was_bad ? config_.to_good : config_.to_bad)) {
        state_ = was_bad ? 1 : 2;
      }
      return uniform(random_) < (was_bad ? config_.loss_in_bad : config_.loss_in_good);
    }
    case LossModel::kMarkov: break;
  }
  const double u = uniform(random_);
  switch (state_) {
    case 1:
      if (u < config_.p14) {
        state_ = 4;
      } else if (u < config_.p14 + config_.p13) {
        state_ = 3;
      }
      break;
    case 2: state_ = u < config_.p23 ? 3 : 2; break;
    case 3:
      if (u < config_.p32) {
        state_ = 2;
      } else if (u < config_.p32 + config_.p31) {
        state_ = 1;
      }
      break;
    default: state_ = 1; break;
  }
  return state_ >= 3;
}

std::int64_t Network::delay_ns() noexcept TANDEM_RT {
  double delay_s = config_.delay_s;
  if (config_.jitter_s > 0.0) {
    delay_s += config_.jitter_s * deviation(config_.distribution, delay_.next());
  }
  return static_cast<std::int64_t>(std::floor(std::max(delay_s, 0.0) * 1e9 + 0.5));
}

/// Into the queue, with the time at which it arrives.
bool Network::put(std::int64_t now_ns, std::span<const std::byte> message) noexcept TANDEM_RT {
  if (free_ == 0 || message.size() > most_bytes_) {
    ++counts_.dropped;
    return false;
  }
  std::int64_t arrival = now_ns;
  const bool delayed =
      config_.reorder == 0.0 || counter_ + 1 < config_.gap || reorder_.next() >= config_.reorder;
  if (delayed) {
    ++counter_;
    arrival += delay_ns();
    const double rate = config_.rate_bit_s > 0.0 ? config_.rate_bit_s
                        : config_.keeps_order    ? kOrderRate_bit_s
                                                 : 0.0;
    if (rate > 0.0) {
      if (under_way() > 0) arrival = std::max(arrival, last_arrival_ns_);
      arrival += static_cast<std::int64_t>(8e9 * static_cast<double>(message.size()) / rate);
    }
  } else {
    counter_ = 0;
    ++counts_.reordered;
  }
  last_arrival_ns_ = under_way() > 0 ? std::max(last_arrival_ns_, arrival) : arrival;
  const std::size_t end = under_way();
  Slot& slot = queue_[end];
  slot.arrival_ns = arrival;
  slot.number = number_++;
  slot.bytes = static_cast<std::uint32_t>(message.size());
  if (!message.empty()) {
    std::memcpy(bytes_.data() + slot.place * most_bytes_, message.data(), message.size());
  }
  --free_;
  std::push_heap(queue_.begin(), queue_.begin() + static_cast<std::ptrdiff_t>(end + 1), later);
  return true;
}

bool Network::send(std::int64_t now_ns, std::span<const std::byte> message) noexcept TANDEM_RT {
  ++counts_.sent;
  int copies = 1;
  if (config_.duplicate > 0.0 && duplicate_.next() < config_.duplicate) ++copies;
  if (is_lost()) --copies;
  if (copies == 0 || cut_) {
    ++counts_.lost;
    return false;
  }
  if (copies > 1) ++counts_.duplicated;
  bool any = false;
  for (int i = 0; i < copies; ++i) any = put(now_ns, message) || any;
  return any;
}

std::span<const std::byte> Network::receive(std::int64_t now_ns) noexcept TANDEM_RT {
  const std::size_t count = under_way();
  if (count == 0 || queue_.front().arrival_ns > now_ns) return {};
  std::pop_heap(queue_.begin(), queue_.begin() + static_cast<std::ptrdiff_t>(count), later);
  ++free_;
  ++counts_.delivered;
  const Slot& slot = queue_[count - 1];
  return {bytes_.data() + slot.place * most_bytes_, slot.bytes};
}

void Network::change(double delay_s, double jitter_s, double loss) noexcept TANDEM_RT {
  if (!std::isnan(delay_s)) config_.delay_s = delay_s;
  if (!std::isnan(jitter_s)) config_.jitter_s = jitter_s;
  if (std::isnan(loss)) return;
  config_.loss_model = LossModel::kRandom;
  config_.loss = loss;
}

void Network::archive(Archive& ar) {
  ar(config_.delay_s, config_.jitter_s, config_.loss, config_.loss_model, delay_, loss_, duplicate_,
     reorder_, random_, state_, counter_, cut_, counts_, number_, last_arrival_ns_, queue_, free_,
     bytes_);
}

}  // namespace tandem::remote
