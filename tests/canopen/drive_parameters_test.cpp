// The table of a drive's settings against literal bytes: both ends of the wire share its rows, so
// that a wrong index, width or unit would be wrong at both.
#include "canopen/drive_parameters.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

namespace tandem::canopen {
namespace {

constexpr double kPi = std::numbers::pi;

/// 36000 counts a revolution, 50 Nm rated.
struct Golden {
  int index, sub;
  double value;
  std::vector<std::uint8_t> bytes;  ///< CiA 402's units and CiA 301's order
};

// clang-format off
const std::vector<Golden> kGolden{
    {0x608F, 1, 36000.0, {0xA0, 0x8C, 0x00, 0x00}},  // link_counts_per_rev
    {0x2033, 0, 360000.0, {0x40, 0x7E, 0x05, 0x00}},  // motor_counts_per_rev
    {0x6076, 0, 50.0, {0x50, 0xC3, 0x00, 0x00}},  // rated_torque_Nm
    {0x6072, 0, 100.0, {0xD0, 0x07}},  // max_torque_Nm
    {0x6087, 0, 25.0, {0xF4, 0x01, 0x00, 0x00}},  // torque_slope_Nm_s
    {0x607D, 1, -kPi, {0xB0, 0xB9, 0xFF, 0xFF}},  // min_position_rad
    {0x607D, 2, kPi / 2.0, {0x28, 0x23, 0x00, 0x00}},  // max_position_rad
    {0x2020, 1, 1.5, {0x00, 0x00, 0xC0, 0x3F}},  // position.kp
    {0x2020, 2, 2.0, {0x00, 0x00, 0x00, 0x40}},  // position.ki
    {0x2020, 3, 2.5, {0x00, 0x00, 0x20, 0x40}},  // position.kd
    {0x2020, 4, 3.0, {0x00, 0x00, 0x40, 0x40}},  // position.output_limit
    {0x2021, 1, 3.5, {0x00, 0x00, 0x60, 0x40}},  // velocity.kp
    {0x2021, 2, 4.0, {0x00, 0x00, 0x80, 0x40}},  // velocity.ki
    {0x2021, 3, 4.5, {0x00, 0x00, 0x90, 0x40}},  // velocity.kd
    {0x2021, 4, 5.0, {0x00, 0x00, 0xA0, 0x40}},  // velocity.output_limit
    {0x2022, 1, 5.5, {0x00, 0x00, 0xB0, 0x40}},  // torque.kp
    {0x2022, 2, 6.0, {0x00, 0x00, 0xC0, 0x40}},  // torque.ki
    {0x2022, 3, 6.5, {0x00, 0x00, 0xD0, 0x40}},  // torque.kd
    {0x2022, 4, 7.0, {0x00, 0x00, 0xE0, 0x40}},  // torque.output_limit
    {0x2023, 1, 7.5, {0x00, 0x00, 0xF0, 0x40}},  // current.kp
    {0x2023, 2, 8.0, {0x00, 0x00, 0x00, 0x41}},  // current.ki
    {0x2023, 3, 8.5, {0x00, 0x00, 0x08, 0x41}},  // current.kd
    {0x2023, 4, 9.0, {0x00, 0x00, 0x10, 0x41}},  // current.output_limit
    {0x2024, 1, 9.5, {0x00, 0x00, 0x18, 0x41}},  // torque_to_voltage_V_Nm
    {0x2024, 2, 10.0, {0x00, 0x00, 0x20, 0x41}},  // emf_compensation_Vs_rad
    {0x2025, 0, 1.0, {0x01}},  // motor_feedback
    {0x2026, 1, 10.5, {0x00, 0x00, 0x28, 0x41}},  // resistance_ohm
    {0x2026, 2, 11.0, {0x00, 0x00, 0x30, 0x41}},  // motor_constant_Nm_A
    {0x2026, 3, 11.5, {0x00, 0x00, 0x38, 0x41}},  // spring_Nm_rad
    {0x2010, 0, 12.0, {0x00, 0x00, 0x40, 0x41}},  // stiffness_Nm_rad
    {0x2011, 0, 12.5, {0x00, 0x00, 0x48, 0x41}},  // damping_Nms_rad
    {0x2030, 1, 13.0, {0x00, 0x00, 0x50, 0x41}},  // voltage_limit_V
    {0x2030, 2, 13.5, {0x00, 0x00, 0x58, 0x41}},  // current_limit_A
    {0x2030, 3, 14.0, {0x00, 0x00, 0x60, 0x41}},  // torque_limit_Nm
    {0x2030, 4, 14.5, {0x00, 0x00, 0x68, 0x41}},  // velocity_limit_rad_s
    {0x2031, 1, 15.0, {0x00, 0x00, 0x70, 0x41}},  // continuous_current_A
    {0x2031, 2, 15.5, {0x00, 0x00, 0x78, 0x41}},  // thermal_time_s
    {0x2034, 0, -40.5, {0x6B, 0xFE}},  // temperature_limit_C
    {0x6065, 0, kPi / 18.0, {0xE8, 0x03, 0x00, 0x00}},  // following_window_rad
    {0x6066, 0, 0.25, {0xFA, 0x00}},  // following_timeout_s
    {0x2039, 1, 16.0, {0x00, 0x00, 0x80, 0x41}},  // oscillation_limit_Nm
    {0x2039, 2, 16.5, {0x00, 0x00, 0x84, 0x41}},  // oscillation_time_s
    {0x203B, 1, 17.0, {0x00, 0x00, 0x88, 0x41}},  // excess_share
    {0x203B, 2, 17.5, {0x00, 0x00, 0x8C, 0x41}},  // excess_time_s
    {0x203C, 0, 18.0, {0x00, 0x00, 0x90, 0x41}},  // swing_limit_rad_s
    {0x203A, 1, 1.0, {0x01, 0x00}},  // brake_fitted
    {0x203A, 2, 40.0, {0x28, 0x00}},  // brake_release_ms
    {0x203A, 3, 300.0, {0x2C, 0x01}},  // brake_engage_ms
    {0x2032, 0, 10.0, {0x0A, 0x00}},  // command_timeout_syncs
    {0x2027, 1, 18.5, {0x00, 0x00, 0x94, 0x41}},  // link_velocity_cutoff_Hz
    {0x2027, 2, 19.0, {0x00, 0x00, 0x98, 0x41}},  // motor_velocity_cutoff_Hz
    {0x2027, 3, 19.5, {0x00, 0x00, 0x9C, 0x41}},  // torque_rate_cutoff_Hz
    {0x2028, 0, 20.0, {0x00, 0x00, 0xA0, 0x41}},  // transfer_time_s
    {0x2035, 0, 20.5, {0x00, 0x00, 0xA4, 0x41}},  // undervoltage_V
    {0x2036, 0, 21.0, {0x00, 0x00, 0xA8, 0x41}},  // stop_time_s
    {0x2037, 0, 21.5, {0x00, 0x00, 0xAC, 0x41}},  // position_margin_rad
    {0x2038, 1, 22.0, {0x00, 0x00, 0xB0, 0x41}},  // mismatch_window_rad
    {0x2038, 2, 22.5, {0x00, 0x00, 0xB4, 0x41}},  // mismatch_timeout_s
    {0x6085, 0, 20.0 * kPi, {0x40, 0x7E, 0x05, 0x00}},  // stop_deceleration_rad_s2
};
// clang-format on

TEST(DriveParameters, TravelAsTheStandardAndOurWireSay) {
  ASSERT_EQ(kGolden.size(), kDriveObjects.size());
  DriveParameters parameters;
  for (std::size_t row = 0; row < kGolden.size(); ++row) {
    kDriveObjects[row].of(parameters) = kGolden[row].value;
  }
  EXPECT_EQ(parameters.position.kd, 2.5) << "2020:3";
  EXPECT_EQ(parameters.spring_Nm_rad, 11.5) << "2026:3";
  EXPECT_EQ(parameters.stop_deceleration_rad_s2, 20.0 * kPi) << "6085";
  DriveParameters read;
  for (std::size_t row = 0; row < kGolden.size(); ++row) {
    const DriveObject& object = kDriveObjects[row];
    const Golden& golden = kGolden[row];
    EXPECT_EQ(object.index, golden.index) << row;
    EXPECT_EQ(object.sub, golden.sub) << std::hex << object.index;
    ASSERT_EQ(object.size(), golden.bytes.size()) << std::hex << object.index;
    const auto bytes = object.encode(parameters);
    EXPECT_EQ(std::vector(bytes.begin(), bytes.begin() + object.size()), golden.bytes)
        << std::hex << object.index << ':' << int{object.sub};
    object.decode(bytes.data(), read);
    EXPECT_NEAR(object.of(read), golden.value, 1e-9) << std::hex << object.index;
  }
}

/// Every parameter has one row, and no object two.
TEST(DriveParameters, HaveEachARowOfItsOwn) {
  std::set<int> parameters, objects;
  for (const DriveObject& object : kDriveObjects) {
    parameters.insert(object.parameter);
    objects.insert(object.index << 8 | object.sub);
  }
  EXPECT_EQ(parameters.size(), kDriveObjects.size());
  EXPECT_EQ(objects.size(), kDriveObjects.size());
}

TEST(DriveParameters, AreWithoutLimitAtTheEndsOf32BitsAndNoWhereElse) {
  DriveParameters p{.link_counts_per_rev = 36000.0, .rated_torque_Nm = 50.0};
  DriveParameters read{.link_counts_per_rev = 36000.0, .rated_torque_Nm = 50.0};
  const auto through = [&](std::uint16_t index, std::uint8_t sub) {
    for (const DriveObject& object : kDriveObjects) {
      if (object.index != index || object.sub != sub) continue;
      object.decode(object.encode(p).data(), read);
      return object.of(read);
    }
    return std::nan("");
  };
  EXPECT_EQ(through(0x607D, 1), -INFINITY);
  EXPECT_EQ(through(0x607D, 2), INFINITY);
  EXPECT_EQ(through(0x6087, 0), INFINITY);
  EXPECT_EQ(through(0x6072, 0), 65.535 * 50.0) << "16 bits: the most that it can say";
  p.torque_slope_Nm_s = 0.0;
  EXPECT_EQ(through(0x6087, 0), 0.05) << "at least 1 per mille a second";
}

TEST(DriveParameters, ThatAreNotSaidStayAsTheyAre) {
  DriveParameters said = DriveParameters::unsaid();
  said.position.kp = 7.0;
  DriveParameters own;
  own.take(said);
  EXPECT_EQ(own.position.kp, 7.0);
  EXPECT_EQ(own.thermal_time_s, 30.0);
  EXPECT_EQ(own.following_window_rad, 0.5);
}

}  // namespace
}  // namespace tandem::canopen
