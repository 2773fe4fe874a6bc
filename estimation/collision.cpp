#include "estimation/collision.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::estimation {
namespace {

/// What the Gumbel distribution of these blocks' mean and variance exceeds with this probability;
/// not below the largest.
double quantile(std::span<const double> largest, double probability) {
  double mean = 0.0, variance = 0.0, most = 0.0;
  const auto n = static_cast<double>(largest.size());
  for (const double one : largest) {
    mean += one / n;
    most = std::max(most, one);
  }
  for (const double one : largest) variance += (one - mean) * (one - mean) / (n - 1.0);
  const double scale = std::sqrt(6.0 * variance) / std::numbers::pi;
  const double location = mean - std::numbers::egamma * scale;
  return std::max(most, location - scale * std::log(-std::log1p(-probability)));
}

}  // namespace

CollisionWatch::CollisionWatch(std::vector<double> threshold_Nm, std::size_t joints,
                               std::uint32_t quiet)
    : threshold_Nm_(std::move(threshold_Nm)),
      quiet_for_(threshold_Nm_.size()),
      joints_(joints),
      quiet_(quiet) {}

std::optional<CollisionWatch::Found> CollisionWatch::look(
    std::span<const double> external_torque_Nm,
    std::span<std::uint8_t> collided) noexcept TANDEM_RT {
  std::optional<Found> found;
  double worst = 0.0;
  bool base = false;
  for (std::size_t j = 0; j < threshold_Nm_.size(); ++j) {
    const double torque = std::abs(external_torque_Nm[j]);
    const bool beyond = torque > threshold_Nm_[j];
    collided[j] = beyond ? 1 : 0;
    if (!beyond) {
      if (quiet_for_[j] > 0) --quiet_for_[j];
      continue;
    }
    if (quiet_for_[j] == 0 && torque / threshold_Nm_[j] > worst) {
      worst = torque / threshold_Nm_[j];
      found = Found{j, external_torque_Nm[j]};
    }
    quiet_for_[j] = quiet_;
    base = base || j >= joints_;
  }
  if (base)
    std::fill(quiet_for_.begin() + static_cast<std::ptrdiff_t>(joints_), quiet_for_.end(), quiet_);
  return found;
}

double learn_threshold(std::span<const std::vector<double>> largest_Nm, double block_s,
                       double alarms_per_hour) {
  const double in_block = std::min(0.5, alarms_per_hour * block_s / 3600.0);
  std::vector<double> all;
  double threshold = 0.0;
  for (const std::vector<double>& run : largest_Nm) {
    all.insert(all.end(), run.begin(), run.end());
    threshold = std::max(threshold, quantile(run, in_block));
  }
  return std::max(threshold, quantile(all, in_block));
}

}  // namespace tandem::estimation
