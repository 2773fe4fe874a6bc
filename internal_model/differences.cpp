#include "internal_model/differences.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::internal_model {

void SignalDifference::take(double difference) noexcept {
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

void Differences::take_base(std::span<const double, 7> first,
                            std::span<const double, 7> second) noexcept {
  bases_ = true;
  base_position_m_.take(
      std::hypot(first[0] - second[0], first[1] - second[1], first[2] - second[2]));
  const double* a = &first[3];
  const double* b = &second[3];
  // The vector part of a's conjugate times b: exactly 0 for equal ones.
  const double x = a[3] * b[0] - a[0] * b[3] - (a[1] * b[2] - a[2] * b[1]);
  const double y = a[3] * b[1] - a[1] * b[3] - (a[2] * b[0] - a[0] * b[2]);
  const double z = a[3] * b[2] - a[2] * b[3] - (a[0] * b[1] - a[1] * b[0]);
  const double w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  base_angle_rad_.take(2.0 * std::atan2(std::hypot(x, y, z), std::abs(w)));
}

double Differences::rms(const SignalDifference& one) const noexcept {
  return std::sqrt(one.square_sum / static_cast<double>(std::max<std::uint64_t>(cycles_, 1)));
}

}  // namespace tandem::internal_model
