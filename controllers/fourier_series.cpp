#include "controllers/fourier_series.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "base/counted.hpp"

namespace tandem {
namespace {

constexpr int kChecked = 500;  // instants of a period
constexpr std::size_t kMostHarmonics = 100;
constexpr double kRest_rad_s = 1e-4;  // a speed that is none

}  // namespace

void FourierSeries::configure(ControllerSetup& setup, const std::vector<std::size_t>& joints,
                              bool joints_known) {
  TomlTable& parameters = setup.parameters;
  period_s_ = setup.parameter("period_s",
                              {.unit = "s", .min = 0, .above_min = true, .doc = "of the series"});
  periods_ = setup.parameter(
      "periods",
      {.min = 1, .max = 1e6, .whole = true, .otherwise = 1, .doc = "how often it is played"});
  std::vector<TomlTable> tables = parameters.tables("harmonic");
  if (tables.empty() || tables.size() > kMostHarmonics) {
    parameters.error(
        tables.empty() ? "" : "harmonic",
        tables.empty() ? "there is no harmonic"
                       : "has " + std::to_string(tables.size()) + " tables",
        "add 1 to 100 [[controller.parameters.harmonic]] with cos_rad and sin_rad, the "
        "fundamental first; `tandem excite` writes such");
    harmonics_.clear();
    return;
  }
  bool whole = joints_known && period_s_ > 0.0;
  for (TomlTable& table : tables) {
    Harmonic harmonic{table.numbers("cos_rad", 0), table.numbers("sin_rad", 0)};
    for (const char* key : {"cos_rad", "sin_rad"}) {
      const std::size_t count = key[0] == 'c' ? harmonic.cos_rad.size() : harmonic.sin_rad.size();
      if (joints_known && !table.has_errors(key) && table.has(key) && count != joints.size()) {
        table.error(key,
                    "has " + counted(count, "number") + " for " + counted(joints.size(), "joint"),
                    "give one for each of `joints`");
      }
      whole = whole && count == joints.size();
    }
    harmonic.cos_rad.resize(joints.size(), 0.0);
    harmonic.sin_rad.resize(joints.size(), 0.0);
    table.finish();
    harmonics_.push_back(std::move(harmonic));
  }
  start_rad_.assign(joints.size(), 0.0);
  if (whole) check(setup, tables.front(), joints);
}

void FourierSeries::check(ControllerSetup& setup, TomlTable& first,
                          const std::vector<std::size_t>& joints) const {
  const bool known = !setup.start_position_rad.empty();
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const hal::DrivenJoint& joint = setup.robot.joints[joints[j]];
    const double start = known ? setup.start_position_rad[joints[j]] : 0.0;
    double low = 0.0, high = 0.0, fastest = 0.0;
    for (int i = 0; i < kChecked; ++i) {
      const Point now = at(period_s_ * i / kChecked, j);
      low = std::min(low, now.position);
      high = std::max(high, now.position);
      fastest = std::max(fastest, std::abs(now.velocity));
    }
    const double speed = at(0.0, j).velocity;
    char text[160];
    if (std::abs(speed) > kRest_rad_s) {
      std::snprintf(text, sizeof text, "joint '%s' does not start at rest, but with %.3g rad/s",
                    joint.name.c_str(), speed);
      first.error("sin_rad", text, "the sum over all harmonics k of k * sin_rad has to be 0");
      return;
    }
    if (fastest > joint.max_velocity_rad_s) {
      std::snprintf(text, sizeof text, "joint '%s' would need %.3g rad/s, its limit is %.3g",
                    joint.name.c_str(), fastest, joint.max_velocity_rad_s);
      first.error("cos_rad", text, "make period_s longer, or the coefficients smaller");
      return;
    }
    if (known && (start + low < joint.min_position_rad || start + high > joint.max_position_rad)) {
      std::snprintf(text, sizeof text,
                    "joint '%s' goes from %.4g to %.4g, its limits are %.4g and %.4g",
                    joint.name.c_str(), start + low, start + high, joint.min_position_rad,
                    joint.max_position_rad);
      first.error("cos_rad", text, "make its coefficients smaller, or choose another posture");
      return;
    }
  }
}

void FourierSeries::start(const std::vector<std::size_t>& joints,
                          const hal::StateImage& state) noexcept TANDEM_RT {
  for (std::size_t j = 0; j < joints.size(); ++j) start_rad_[j] = state.position_rad()[joints[j]];
}

FourierSeries::Point FourierSeries::at(double t_s, std::size_t joint) const noexcept TANDEM_RT {
  Point point{0.0, 0.0};
  const double w = 2.0 * std::numbers::pi / period_s_;
  for (std::size_t k = 0; k < harmonics_.size(); ++k) {
    const double kw = w * static_cast<double>(k + 1);
    const double c = std::cos(kw * t_s);
    const double s = std::sin(kw * t_s);
    const double a = harmonics_[k].cos_rad[joint];
    const double b = harmonics_[k].sin_rad[joint];
    point.position += a * (c - 1.0) + b * s;
    point.velocity += kw * (b * c - a * s);
  }
  return point;
}

void FourierSeries::play(double t_s, const std::vector<std::size_t>& joints,
                         hal::CommandImage& command) const noexcept TANDEM_RT {
  const bool over = t_s >= end_s();
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const Point now = over ? Point{0.0, 0.0} : at(t_s, j);
    command.position_rad()[joints[j]] = start_rad_[j] + now.position;
    command.velocity_rad_s()[joints[j]] = now.velocity;
  }
}

}  // namespace tandem
