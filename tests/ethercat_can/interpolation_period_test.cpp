// The cycle as a drive's 60C2 can say it, and what is refused.
#include <gtest/gtest.h>

#include <optional>
#include <utility>

#include "hal/ethercat-can/interpolation_period.hpp"
#include "sheet_rig.hpp"

namespace tandem::hal::can {
namespace {

using namespace test;

std::optional<std::pair<int, int>> said(std::int64_t period_ns,
                                        const InterpolationLimits& limits = {}) {
  const auto period = interpolation_period(period_ns, limits);
  if (!period) return {};
  return std::pair<int, int>{period->units, period->power};
}

using Said = std::pair<int, int>;

TEST(InterpolationPeriod, IsInMillisecondsOrTheNearestUnitThatFitsAByte) {
  EXPECT_EQ(said(1'000'000), Said(1, -3));
  EXPECT_EQ(said(255'000'000), Said(255, -3));
  EXPECT_EQ(said(2'500'000), Said(25, -4));
  EXPECT_EQ(said(125'000), Said(125, -6));
  EXPECT_EQ(said(12'500), Said(125, -7));
  EXPECT_EQ(said(300'000'000), Said(30, -2));
  EXPECT_EQ(said(1'000'000'000), Said(100, -2));
  EXPECT_EQ(said(62'500), std::nullopt);
  EXPECT_EQ(said(256'000'000), std::nullopt);
  EXPECT_EQ(said(12'345'678), std::nullopt);
}

TEST(InterpolationPeriod, IsWithinTheSheetsLimits) {
  const InterpolationLimits coarse{.most_units = 100, .least_power = -3, .most_power = -2};
  EXPECT_EQ(said(500'000, coarse), std::nullopt);
  EXPECT_EQ(said(100'000'000, coarse), Said(100, -3));
  EXPECT_EQ(said(120'000'000, coarse), Said(12, -2));
  Sheet s = servo();
  for (SheetEntry& entry : s.sheet.entries) {
    if (entry.index == 0x60C2 && entry.sub == 2) entry.low = -6;
    if (entry.index == 0x60C2 && entry.sub == 2) entry.high = 300;
  }
  const InterpolationLimits limits = InterpolationLimits::of(s.sheet, 0);
  EXPECT_EQ(limits.least_units, 1);
  EXPECT_EQ(limits.most_units, 255);
  EXPECT_EQ(limits.least_power, -6);
  EXPECT_EQ(limits.most_power, 63) << "what a byte with a sign and CiA 402 have";
  EXPECT_EQ(said(12'500, limits), std::nullopt);
}

TEST(InterpolationPeriod, ThatADriveCannotBeToldIsRefusedWithTheNearestOnes) {
  const SheetRig rig(servo());
  EXPECT_TRUE(check_interpolation(rig.robot, 1'000'000).empty());
  const Diagnostics errors = check_interpolation(rig.robot, 62'500);
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_EQ(errors[0].line, rig.robot.boards[0].line);
  EXPECT_NE(errors[0].message.find("the drive of joint '" + rig.robot.joints[0].name +
                                   "' cannot be told a cycle of 62500 ns: 60C2 in drive.eds is 1 "
                                   "to 255 times 10^-128 to 10^63 s"),
            std::string::npos)
      << errors[0].message;
  EXPECT_EQ(errors[0].hint, "set period_ns of the experiment to 50000 or 100000")
      << "both divide the board's control period";
  const Diagnostics apart = check_interpolation(rig.robot, 1'062'500);
  ASSERT_EQ(apart.size(), 1U);
  EXPECT_EQ(apart[0].hint, "set period_ns of the experiment to 1000000 or 2000000");
  EXPECT_TRUE(check_interpolation(classic_config(), 62'500).empty()) << "our own boards";
  EXPECT_TRUE(check_interpolation(SheetRig(servo().remove(0x60C2)).robot, 62'500).empty())
      << "nothing is told";
}

TEST(InterpolationPeriod, IsWrittenBeforeTheDriveIsEnabled) {
  Sheet s = servo();
  for (SheetEntry& entry : s.sheet.entries) {
    if (entry.index == 0x60C2 && entry.sub == 2) entry.high = -4;
  }
  SheetRig rig(s);
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(rig.drive.value(0x60C2, 1), 10) << "1 ms is 10 * 10^-4 s where -3 is not taken";
  EXPECT_EQ(static_cast<std::int8_t>(rig.drive.value(0x60C2, 2)), -4);
}

}  // namespace
}  // namespace tandem::hal::can
