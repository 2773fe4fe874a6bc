// A PID loop as Config, State and Apply, with conditional anti-windup that reaches downstream.
// Layer: firmware_emu.  Thread: RT only.
#pragma once

#include <algorithm>
#include <cstdint>

#include "base/realtime.hpp"
#include "canopen/drive_parameters.hpp"

namespace tandem::firmware {

/// Which way a value had to be cut off.
enum class Saturation : std::int8_t { kLow = -1, kNone = 0, kHigh = 1 };

/// Cuts `value` to [low, high] and says which way. @pre low <= high
[[nodiscard]] inline Saturation saturate(double& value, double low, double high) noexcept {
  if (value > high) {
    value = high;
    return Saturation::kHigh;
  }
  if (value < low) {
    value = low;
    return Saturation::kLow;
  }
  return Saturation::kNone;
}

/// output = cut(kp e + I + kd e', +-output_limit), then I += ki e dt.
///
/// The integral takes a step after the output is known (forward Euler), so that the caller can
/// first find out whether anything downstream has saturated: a step that would push further
/// into a saturation, the loop's own or one downstream, is left out (conditional integration).
struct Pid {
  using Config = canopen::LoopGains;
  /// The terms of the last apply(), all in the unit of the output.
  struct State {
    double p = 0.0;
    double i = 0.0;
    double d = 0.0;
    double output = 0.0;
    std::int64_t saturation = 0;  ///< Saturation of the own limit (wide: no padding)
  };

  /// @param error_rate  d error / dt, measured by whoever knows it best.
  double apply(const Config& config, double error, double error_rate) noexcept TANDEM_RT {
    state.p = config.kp * error;
    state.d = config.kd * error_rate;
    return add_up(config);
  }

  /// The integral's step over `dt_s`, to be called once after apply().
  void integrate(const Config& config, double error, double dt_s,
                 Saturation downstream) noexcept TANDEM_RT {
    const double step = config.ki * error * dt_s;
    const auto blocks = [step](auto side) {
      return (static_cast<int>(side) > 0 && step > 0.0) ||
             (static_cast<int>(side) < 0 && step < 0.0);
    };
    if (blocks(state.saturation) || blocks(downstream)) return;
    state.i += step;
    limit_integral(config);
  }

  /// Sets the integral so that the last apply() would have given `output`, as far as the limit
  /// allows. A loop without ki has no integral to seed: it would never unwind.
  /// @return the output with the new integral.
  double seed(const Config& config, double output) noexcept TANDEM_RT {
    state.i = config.ki > 0.0 ? output - state.p - state.d : 0.0;
    limit_integral(config);
    return add_up(config);
  }

  void reset() noexcept TANDEM_RT { state = {}; }

  State state;

 private:
  double add_up(const Config& config) noexcept {
    state.output = state.p + state.i + state.d;
    state.saturation = 0;
    if (config.output_limit > 0.0) {
      state.saturation = static_cast<std::int64_t>(
          saturate(state.output, -config.output_limit, config.output_limit));
    }
    return state.output;
  }
  void limit_integral(const Config& config) noexcept {
    if (config.output_limit > 0.0) {
      state.i = std::clamp(state.i, -config.output_limit, config.output_limit);
    }
  }
};

}  // namespace tandem::firmware
