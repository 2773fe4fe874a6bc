// The signals of an import map, and the units that each may have.
// Layer: log/import.  Thread: any.
#pragma once

#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <string_view>

namespace tandem::log {

inline constexpr double kDegree = std::numbers::pi / 180.0;

/// Joints that a unit is for, by how they move.
enum class UnitFor : std::uint8_t { kAny, kTurns, kSlides };

struct Unit {
  std::string_view name;
  double factor;  ///< to SI; NaN: `scale` says it
  UnitFor of = UnitFor::kAny;
};

inline constexpr double kAsked = std::numeric_limits<double>::quiet_NaN();
inline constexpr Unit kPositions[] = {{"rad", 1.0, UnitFor::kTurns},
                                      {"deg", kDegree, UnitFor::kTurns},
                                      {"turn", 360.0 * kDegree, UnitFor::kTurns},
                                      {"m", 1.0, UnitFor::kSlides},
                                      {"mm", 1e-3, UnitFor::kSlides},
                                      {"raw", kAsked}};
inline constexpr Unit kVelocities[] = {
    {"rad/s", 1.0, UnitFor::kTurns},         {"deg/s", kDegree, UnitFor::kTurns},
    {"rpm", 6.0 * kDegree, UnitFor::kTurns}, {"m/s", 1.0, UnitFor::kSlides},
    {"mm/s", 1e-3, UnitFor::kSlides},        {"raw", kAsked}};
inline constexpr Unit kAccelerations[] = {{"rad/s2", 1.0, UnitFor::kTurns},
                                          {"deg/s2", kDegree, UnitFor::kTurns},
                                          {"m/s2", 1.0, UnitFor::kSlides},
                                          {"raw", kAsked}};
inline constexpr Unit kTorques[] = {{"Nm", 1.0, UnitFor::kTurns},
                                    {"mNm", 1e-3, UnitFor::kTurns},
                                    {"N", 1.0, UnitFor::kSlides},
                                    {"raw", kAsked}};
inline constexpr Unit kCurrents[] = {{"A", 1.0}, {"mA", 1e-3}, {"raw", kAsked}};
inline constexpr Unit kVoltages[] = {{"V", 1.0}, {"mV", 1e-3}, {"raw", kAsked}};
inline constexpr Unit kTemperatures[] = {{"C", 1.0}, {"raw", kAsked}};

struct Signal {
  std::string_view key;
  const char* field;
  std::span<const Unit> units;
  bool in_bag = false;
};
inline constexpr Signal kState[] = {{"position", "position_rad", kPositions, true},
                                    {"velocity", "velocity_rad_s", kVelocities, true},
                                    {"acceleration", "acceleration_rad_s2", kAccelerations},
                                    {"torque", "torque_nm", kTorques, true},
                                    {"motor_position", "motor_position_rad", kPositions},
                                    {"motor_velocity", "motor_velocity_rad_s", kVelocities},
                                    {"current", "current_a", kCurrents},
                                    {"voltage", "voltage_v", kVoltages},
                                    {"temperature", "temperature_c", kTemperatures}};
inline constexpr Signal kCommand[] = {{"position", "position_rad", kPositions},
                                      {"velocity", "velocity_rad_s", kVelocities},
                                      {"torque", "torque_nm", kTorques},
                                      {"current", "current_a", kCurrents},
                                      {"voltage", "voltage_v", kVoltages}};

}  // namespace tandem::log
