// A 6-D spring and damper at 40 Hz, critically damped, with the initial load as feed-forward; its
// share fades to 0 along a minimum-jerk profile.
#include "hal/sim/hoist.hpp"

#include <algorithm>
#include <numbers>

#include "hal/sim/rotation.hpp"

namespace tandem::sim {
namespace {

constexpr double kFrequency_rad_s = 2.0 * std::numbers::pi * 40.0;

}  // namespace

void Hoist::hold(double mass_kg, double inertia_kg_m2, const double* pose,
                 const double* load) noexcept {
  std::copy_n(pose, 7, pose_.begin());
  std::copy_n(load, 6, load_.begin());
  const std::array<double, 2> inertia{mass_kg, inertia_kg_m2};
  for (std::size_t i = 0; i < 2; ++i) {
    stiffness_[i] = inertia[i] * kFrequency_rad_s * kFrequency_rad_s;
    damping_[i] = 2.0 * inertia[i] * kFrequency_rad_s;
  }
  share_ = 1.0;
  releasing_ = 0;
}

void Hoist::release(std::int64_t duration_ns) noexcept TANDEM_RT {
  if (releasing_ != 0) return;
  releasing_ = 1;
  elapsed_ns_ = 0;
  duration_ns_ = duration_ns;
  if (duration_ns_ <= 0) share_ = 0.0;
}

void Hoist::advance(std::int64_t step_ns) noexcept TANDEM_RT {
  if (releasing_ == 0 || share_ == 0.0) return;
  elapsed_ns_ = std::min(elapsed_ns_ + step_ns, duration_ns_);
  const double s = static_cast<double>(elapsed_ns_) / static_cast<double>(duration_ns_);
  share_ = elapsed_ns_ == duration_ns_ ? 0.0 : 1.0 - s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
}

void Hoist::add_wrench(const double* q, const double* v, double* wrench) const noexcept TANDEM_RT {
  if (!(share_ > 0.0)) return;
  const Mat3 R = rotation_of(q + 3);
  const double offset_W[3] = {q[0] - pose_[0], q[1] - pose_[1], q[2] - pose_[2]};
  const Vec3 offset = rotate_back(R.data(), offset_W);
  // Rotation from where it was held to where it is, as twice the quaternion's vector part.
  const double held[4] = {-pose_[3], -pose_[4], -pose_[5], pose_[6]};
  const std::array<double, 4> turn = quaternion_product(held, q + 3);
  const double sign = turn[3] < 0.0 ? -2.0 : 2.0;
  for (std::size_t i = 0; i < 3; ++i) {
    wrench[i] += share_ * (load_[i] - stiffness_[0] * offset[i] - damping_[0] * v[i]);
    wrench[3 + i] +=
        share_ * (load_[3 + i] - stiffness_[1] * sign * turn[i] - damping_[1] * v[3 + i]);
  }
}

}  // namespace tandem::sim
