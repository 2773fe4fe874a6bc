#include "firmware_emu/pid.hpp"

#include <gtest/gtest.h>

namespace tandem::firmware {
namespace {

constexpr double kPidStep_s = 1.0e-3;

TEST(Pid, AnswersAStepAsItsClosedFormSays) {
  const Pid::Config config{.kp = 3.0, .ki = 20.0, .kd = 0.5};
  Pid pid;
  for (int k = 0; k < 1000; ++k) {
    const double output = pid.apply(config, 0.7, -2.0);
    EXPECT_NEAR(output, 3.0 * 0.7 + 20.0 * 0.7 * k * kPidStep_s - 0.5 * 2.0, 1.0e-12) << k;
    pid.integrate(config, 0.7, kPidStep_s, Saturation::kNone);
  }
}

TEST(Pid, AnswersARampAsItsClosedFormSays) {
  const Pid::Config config{.kp = 2.0, .ki = 5.0};
  Pid pid;
  for (int k = 0; k < 500; ++k) {  // the sum of the first k ramp values is k (k - 1) / 2
    const double error = 0.01 * k;
    EXPECT_NEAR(pid.apply(config, error, 0.0),
                2.0 * error + 5.0 * kPidStep_s * 0.01 * k * (k - 1) / 2.0, 1.0e-12);
    pid.integrate(config, error, kPidStep_s, Saturation::kNone);
  }
}

TEST(Pid, KeepsItsTermsForTelemetry) {
  const Pid::Config config{.kp = 2.0, .ki = 10.0, .kd = 0.1};
  Pid pid;
  pid.apply(config, 1.0, 3.0);
  pid.integrate(config, 1.0, kPidStep_s, Saturation::kNone);
  EXPECT_DOUBLE_EQ(pid.state.p, 2.0);
  EXPECT_DOUBLE_EQ(pid.state.i, 0.01);
  EXPECT_DOUBLE_EQ(pid.state.d, 0.3);
}

TEST(Pid, DoesNotWindUpAgainstItsOwnLimit) {
  const Pid::Config config{.kp = 1.0, .ki = 100.0, .output_limit = 2.0};
  Pid pid;
  for (int k = 0; k < 10000; ++k) {
    EXPECT_LE(pid.apply(config, 1.5, 0.0), 2.0);
    pid.integrate(config, 1.5, kPidStep_s, Saturation::kNone);
  }
  EXPECT_LE(pid.state.i, 0.5 + 100.0 * 1.5 * kPidStep_s);  // one step beyond what reached the limit
  EXPECT_LT(pid.apply(config, -1.5, 0.0), 0.0);            // comes off the limit at once
}

TEST(Pid, DoesNotWindUpAgainstADownstreamLimitButUnwindsFromIt) {
  const Pid::Config config{.kp = 1.0, .ki = 10.0};
  Pid pid;
  pid.state.i = 1.0;
  pid.apply(config, 1.0, 0.0);
  pid.integrate(config, 1.0, kPidStep_s, Saturation::kHigh);
  EXPECT_DOUBLE_EQ(pid.state.i, 1.0);
  pid.integrate(config, -1.0, kPidStep_s, Saturation::kHigh);
  EXPECT_DOUBLE_EQ(pid.state.i, 0.99);
  pid.integrate(config, -1.0, kPidStep_s, Saturation::kLow);
  EXPECT_DOUBLE_EQ(pid.state.i, 0.99);
  pid.integrate(config, 1.0, kPidStep_s, Saturation::kLow);
  EXPECT_DOUBLE_EQ(pid.state.i, 1.0);
}

TEST(Pid, IsSeededToTheOutputThatIsAsked) {
  const Pid::Config config{.kp = 2.0, .ki = 10.0, .kd = 0.1, .output_limit = 8.0};
  Pid pid;
  pid.apply(config, 1.0, 3.0);
  EXPECT_DOUBLE_EQ(pid.seed(config, -5.0), -5.0);
  EXPECT_DOUBLE_EQ(pid.apply(config, 1.0, 3.0), -5.0);
  EXPECT_LE(pid.seed(config, 100.0), 8.0);
}

TEST(Pid, HasNoIntegralToSeedWithoutKi) {
  const Pid::Config config{.kp = 2.0};
  Pid pid;
  pid.apply(config, 1.0, 0.0);
  EXPECT_DOUBLE_EQ(pid.seed(config, 10.0), 2.0);
  EXPECT_DOUBLE_EQ(pid.state.i, 0.0);
}

}  // namespace
}  // namespace tandem::firmware
