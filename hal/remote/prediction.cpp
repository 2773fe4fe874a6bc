#include "hal/remote/prediction.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::remote {

TwinCorrection::TwinCorrection(std::size_t joints, std::uint64_t past_commands,
                               std::int64_t correction_ns, std::int64_t period_ns)
    : joints_(joints),
      past_commands_(past_commands),
      correction_ns_(correction_ns),
      period_ns_(period_ns),
      kept_(past_commands),
      past_(past_commands * 3 * joints),
      correction_(3 * joints) {}

void TwinCorrection::start() noexcept TANDEM_RT {
  std::ranges::fill(kept_, std::uint64_t{0});
  std::ranges::fill(correction_, 0.0);
}

void TwinCorrection::assume(const hal::StateImage& robot,
                            const hal::StateImage& twin) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < joints_; ++j) {
    correction_[j] = robot.position_rad()[j] - twin.position_rad()[j];
    correction_[2 * joints_ + j] = robot.torque_Nm()[j] - twin.torque_Nm()[j];
  }
}

void TwinCorrection::keep(std::uint64_t number, const hal::StateImage& twin) noexcept TANDEM_RT {
  kept_[number % past_commands_] = number + 1;
  double* to = past(number);
  std::ranges::copy(twin.position_rad(), to);
  std::ranges::copy(twin.velocity_rad_s(), to + joints_);
  std::ranges::copy(twin.torque_Nm(), to + 2 * joints_);
}

void TwinCorrection::correct(const hal::StateImage& arrived, std::uint64_t number,
                             std::uint64_t passed) noexcept TANDEM_RT {
  const std::uint64_t same = number + 1;  // the twin was read after that command
  if (kept_[same % past_commands_] != same + 1) return;
  ++compared_;
  const double passed_ns = static_cast<double>(passed) * static_cast<double>(period_ns_);
  const double share =
      1.0 - std::exp(-passed_ns / static_cast<double>(std::max<std::int64_t>(1, correction_ns_)));
  const double* then = past(same);
  const std::span<const double> values[] = {arrived.position_rad(), arrived.velocity_rad_s(),
                                            arrived.torque_Nm()};
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t j = 0; j < joints_; ++j) {
      double& correction = correction_[k * joints_ + j];
      const double error = values[k][j] - then[k * joints_ + j] - correction;
      if (k == 0) worst_rad_ = std::max(worst_rad_, std::abs(error));
      correction += share * error;
    }
  }
}

void TwinCorrection::show(const hal::StateImage& arrived,
                          hal::StateImage& state) const noexcept TANDEM_RT {
  for (std::size_t j = 0; j < joints_; ++j) {
    state.position_rad()[j] += correction_[j];
    state.velocity_rad_s()[j] += correction_[joints_ + j];
    state.torque_Nm()[j] += correction_[2 * joints_ + j];
  }
  std::ranges::copy(arrived.fault(), state.fault().begin());
  std::ranges::copy(arrived.statusword(), state.statusword().begin());
  std::ranges::copy(arrived.drive_state(), state.drive_state().begin());
  std::ranges::copy(arrived.homing(), state.homing().begin());
}

}  // namespace tandem::remote
