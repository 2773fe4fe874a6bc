// Parameters to the wire's integers and back.
#include "canopen/drive_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "canopen/bytes.hpp"

namespace tandem::canopen {
namespace {

constexpr double kRadPerRev = 2.0 * std::numbers::pi;

/// Whether an integer is at an end that stands for "no limit". Such are 32 bits wide.
bool unlimited(const DriveObject& object, double raw) noexcept {
  if (object.unit != WireUnit::kCounts && object.unit != WireUnit::kMille) return false;
  constexpr double kLowest = std::numeric_limits<std::int32_t>::min();
  constexpr double kHighest = std::numeric_limits<std::int32_t>::max();
  if (object.type == DataType::kInteger32) return raw == kLowest || raw == kHighest;
  return object.type == DataType::kUnsigned32 && raw == std::numeric_limits<std::uint32_t>::max();
}

}  // namespace

DriveParameters DriveParameters::unsaid() noexcept {
  DriveParameters none;
  for (const DriveObject& object : kDriveObjects) object.of(none) = std::nan("");
  return none;
}

void DriveParameters::take(const DriveParameters& other) noexcept {
  for (const DriveObject& object : kDriveObjects) {
    if (!std::isnan(object.of(other))) object.of(*this) = object.of(other);
  }
}

std::array<std::uint8_t, 4> DriveObject::encode(
    const DriveParameters& parameters) const noexcept TANDEM_RT {
  double value = of(parameters);
  switch (unit) {
    case WireUnit::kPlain: break;
    case WireUnit::kCounts: value *= parameters.link_counts_per_rev / kRadPerRev; break;
    case WireUnit::kMille: value = 1000.0 * value / parameters.rated_torque_Nm; break;
    case WireUnit::kThousandth: value *= 1000.0; break;
    case WireUnit::kTenth: value /= 0.1; break;
  }
  if (value < range.min) value = range.min;
  std::array<std::uint8_t, 4> bytes{};
  switch (type) {
    case DataType::kUnsigned8: put(bytes.data(), clamp_round<std::uint8_t>(value)); break;
    case DataType::kUnsigned16: put(bytes.data(), clamp_round<std::uint16_t>(value)); break;
    case DataType::kInteger16: put(bytes.data(), clamp_round<std::int16_t>(value)); break;
    case DataType::kUnsigned32: put(bytes.data(), clamp_round<std::uint32_t>(value)); break;
    case DataType::kInteger32: put(bytes.data(), clamp_round<std::int32_t>(value)); break;
    default: put(bytes.data(), static_cast<float>(value));
  }
  return bytes;
}

void DriveObject::decode(const std::uint8_t* bytes,
                         DriveParameters& parameters) const noexcept TANDEM_RT {
  const double raw = as_double(type, bytes);
  double& value = of(parameters);
  value = raw;
  if (unlimited(*this, raw)) {
    value = std::copysign(std::numeric_limits<double>::infinity(), raw);
    return;
  }
  switch (unit) {
    case WireUnit::kPlain: break;
    case WireUnit::kCounts: value *= kRadPerRev / parameters.link_counts_per_rev; break;
    case WireUnit::kMille: value = raw * 1.0e-3 * parameters.rated_torque_Nm; break;
    case WireUnit::kThousandth: value *= 1.0e-3; break;
    case WireUnit::kTenth: value *= 0.1; break;
  }
}

}  // namespace tandem::canopen
