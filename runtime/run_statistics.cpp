#include "runtime/run_statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/fall_watch.hpp"

namespace tandem::runtime {
namespace {

/// W's z axis in the frame of a body, whose quaternion is x y z w.
std::array<double, 3> upwards(std::span<const double> q) {
  return {2.0 * (q[0] * q[2] - q[3] * q[1]), 2.0 * (q[1] * q[2] + q[3] * q[0]),
          1.0 - 2.0 * (q[0] * q[0] + q[1] * q[1])};
}

}  // namespace

RunStatistics::RunStatistics(std::size_t joints, std::size_t feet, std::size_t loops,
                             std::size_t wrenches)
    : errors_(joints),
      limited_(joints),
      feet_(feet),
      loops_(loops),
      external_Nm_(joints),
      wrenches_(wrenches) {}

void RunStatistics::take(const hal::StateImage& state, const hal::CommandImage& command,
                         const hal::TruthImage* truth, std::span<const hal::LimitCounters> limits,
                         const hal::EstimateImage* estimate) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < limits.size(); ++j) {
    const hal::LimitCounters& now = limits[j];
    const std::uint64_t count = std::uint64_t{now.not_finite} + now.out_of_range + now.too_fast;
    if (cycles_ > 0 && count != limited_[j].count) ++limited_[j].cycles;
    limited_[j].count = count;
  }
  ++cycles_;
  const auto wanted = command.position_rad();
  const auto measured = state.position_rad();
  for (std::size_t j = 0; j < errors_.size(); ++j) {
    const double error = wanted[j] - measured[j];
    if (std::isnan(error)) continue;  // nobody wants it anywhere, or knows where it is
    errors_[j].square_sum += error * error;
    errors_[j].max = std::max(errors_[j].max, std::abs(error));
    ++errors_[j].count;
  }
  take_work(state);
  for (std::size_t l = 0; l < loops_.size(); ++l) {
    ClosureFigures& one = loops_[l];
    one.max_position_error_m =
        std::max(one.max_position_error_m, truth->loop_position_error_m()[l]);
    one.max_velocity_error_m_s =
        std::max(one.max_velocity_error_m_s, truth->loop_velocity_error_m_s()[l]);
  }
  if (truth != nullptr && truth->hoist_share()[0] <= 0.0) take_ground(*truth);
  if (estimate != nullptr) take_estimate(*estimate, truth);
}

void RunStatistics::take_estimate(const hal::EstimateImage& estimate,
                                  const hal::TruthImage* truth) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < estimate.joints(); ++j) {
    external_Nm_[j] = std::max(external_Nm_[j], std::abs(estimate.external_torque_Nm()[j]));
  }
  const std::int64_t now_ns = estimate.time_ns()[0];
  const auto take_wrench = [now_ns](WrenchFigures& to, const double* force, const double* moment) {
    to.force_N.take(std::hypot(force[0], force[1], force[2]), now_ns);
    to.moment_Nm.take(std::hypot(moment[0], moment[1], moment[2]), now_ns);
  };
  for (std::size_t i = 0; i < wrenches_.size(); ++i) {
    take_wrench(wrenches_[i], &estimate.external_force_N()[3 * i],
                &estimate.external_moment_Nm()[3 * i]);
  }
  if (const auto on_base = estimate.external_base_wrench(); !on_base.empty())
    take_wrench(base_wrench_, on_base.data(), on_base.data() + 3);
  if (!wrenches_.empty()) unexplained_Nm_.take(estimate.unexplained_torque_Nm()[0], now_ns);
  if (!estimate.has_base()) return;
  ++base_cycles_;
  if (truth == nullptr || truth->hoist_share()[0] > 0.0) return;
  ++compared_;
  const std::array<double, 3> here = upwards(estimate.base_quaternion());
  const std::array<double, 3> there = upwards(truth->base_quaternion());
  double square = 0.0;  // of the chord between the two, whose angle is small
  for (std::size_t i = 0; i < 3; ++i) square += (here[i] - there[i]) * (here[i] - there[i]);
  const double angle = 2.0 * std::asin(std::min(1.0, 0.5 * std::sqrt(square)));
  tilt_error_rad_ = std::max(tilt_error_rad_, angle);
  height_error_m_ = std::max(height_error_m_,
                             std::abs(estimate.base_position_m()[2] - truth->base_position_m()[2]));
}

void RunStatistics::take_work(const hal::StateImage& state) noexcept TANDEM_RT {
  double driving_W = 0.0, braking_W = 0.0;
  bool told = false;
  for (std::size_t j = 0; j < errors_.size(); ++j) {
    const double power_W = state.torque_Nm()[j] * state.velocity_rad_s()[j];
    if (std::isnan(power_W)) continue;  // its drive does not tell
    told = true;
    (power_W > 0.0 ? driving_W : braking_W) += std::abs(power_W);
  }
  if (!told) return;
  ++powered_;
  driving_W_ += driving_W;
  braking_W_ += braking_W;
  max_power_W_ = std::max(max_power_W_, driving_W - braking_W);
}

void RunStatistics::take_ground(const hal::TruthImage& truth) noexcept TANDEM_RT {
  for (std::size_t f = 0; f < feet_.size(); ++f) {
    const double* at = &truth.foot_position_m()[3 * f];
    const double force_N = truth.foot_force_N()[3 * f + 2];
    FootSlip& foot = feet_[f];
    force_sum_N_ += force_N;
    if (force_N > 0.0 && foot.touching == 0) {
      foot.anchor_x = at[0];
      foot.anchor_y = at[1];
    }
    foot.touching = force_N > 0.0 ? 1 : 0;
    if (foot.touching == 0) continue;
    slip_m_ = std::max(slip_m_, std::hypot(at[0] - foot.anchor_x, at[1] - foot.anchor_y));
  }
  free_to_ns_ = truth.time_ns()[0];
  if (free_cycles_++ == 0) free_from_ns_ = free_to_ns_;
}

void RunStatistics::take_base(const hal::TruthImage* truth) noexcept TANDEM_RT {
  if (cycles_ == 0 || truth == nullptr || truth->hoist_share()[0] > 0.0) return;
  const double height_m = truth->base_position_m()[2];
  BaseFigures& base = base_;
  base.min_height_m = base_free_ == 0 ? height_m : std::min(base.min_height_m, height_m);
  base.max_height_m = base_free_ == 0 ? height_m : std::max(base.max_height_m, height_m);
  base.final_tilt_rad = tilt_of(truth->base_quaternion());
  base.max_tilt_rad = std::max(base.max_tilt_rad, base.final_tilt_rad);
  base_free_ = 1;
}

std::vector<TrackingError> RunStatistics::tracking() const {
  std::vector<TrackingError> out;
  for (const Error& one : errors_) {
    const double count = static_cast<double>(std::max<std::uint64_t>(one.count, 1));
    out.push_back({std::sqrt(one.square_sum / count), one.max, one.count});
  }
  return out;
}

std::vector<std::uint64_t> RunStatistics::limited_cycles() const {
  std::vector<std::uint64_t> cycles;
  for (const Limited& one : limited_) cycles.push_back(one.cycles);
  return cycles;
}

std::optional<WorkFigures> RunStatistics::work(double period_s) const {
  if (powered_ == 0) return std::nullopt;
  return WorkFigures{driving_W_ * period_s, braking_W_ * period_s, max_power_W_};
}

std::optional<GroundFigures> RunStatistics::ground(double weight_N) const {
  if (free_cycles_ == 0 || feet_.empty()) return std::nullopt;
  return GroundFigures{weight_N, force_sum_N_ / static_cast<double>(free_cycles_), slip_m_,
                       free_from_ns_, free_to_ns_};
}

std::optional<BaseFigures> RunStatistics::base() const {
  if (base_free_ == 0 || feet_.empty()) return std::nullopt;
  return base_;
}

EstimateFigures RunStatistics::estimate() const {
  return {base_cycles_, compared_,    tilt_error_rad_, height_error_m_,
          external_Nm_, base_wrench_, wrenches_,       unexplained_Nm_};
}

void RunStatistics::archive(Archive& ar) {
  ar(errors_, limited_, cycles_, driving_W_, braking_W_, max_power_W_, powered_, feet_, loops_,
     base_cycles_, compared_, tilt_error_rad_, height_error_m_, external_Nm_, base_wrench_,
     wrenches_, unexplained_Nm_, free_cycles_, force_sum_N_, slip_m_, free_from_ns_, free_to_ns_,
     base_, base_free_, texts_.said, texts_.left_out);
}

}  // namespace tandem::runtime
