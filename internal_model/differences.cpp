#include "internal_model/differences.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::internal_model {

void Difference::take(double difference) noexcept {
  max = std::max(max, std::abs(difference));
  square_sum += difference * difference;
}

void Differences::compare(const hal::StateImage& first, const hal::StateImage& second) noexcept {
  ++compared_;
  if (std::ranges::equal(first.bytes(), second.bytes())) return;
  if (unequal_++ == 0) first_unequal_ = static_cast<std::int64_t>(first.cycle()[0]);
}

void Differences::take(const hal::StateImage& first, const hal::StateImage& second) noexcept {
  ++cycles_;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    joints_[j].position_rad.take(first.position_rad()[j] - second.position_rad()[j]);
    joints_[j].velocity_rad_s.take(first.velocity_rad_s()[j] - second.velocity_rad_s()[j]);
    joints_[j].torque_Nm.take(first.torque_Nm()[j] - second.torque_Nm()[j]);
  }
  for (std::size_t c = 0; c < channels_.size(); ++c)
    channels_[c].take(first.sensor()[c] - second.sensor()[c]);
}

double Differences::rms(const Difference& one) const noexcept {
  return std::sqrt(one.square_sum / static_cast<double>(std::max<std::uint64_t>(cycles_, 1)));
}

}  // namespace tandem::internal_model
