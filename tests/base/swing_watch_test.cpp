// A mass on a loop, integrated here: which swings are the loop's own.
#include "base/swing_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace tandem {
namespace {

constexpr double kStep_s = 1e-3;

/// 1 kg m2 on a PID loop about 0, and what pushes it.
struct Swing {
  double kp = 0.0, ki = 0.0, kd = 0.0, friction = 0.0;
  double most_Nm = 1e9;  ///< of the loop's torque
  double q = 0.0, v = 0.0, integral = 0.0, t = 0.0;
  SwingWatch watch{};

  /// @return s until it is found, or -1 after `seconds`
  template <class Push>
  double until(double seconds, const Push& push, std::size_t half_swings = 4) {
    for (const double end = t + seconds; t < end; t += kStep_s) {
      integral += -q * kStep_s;
      const double wish = kp * -q + ki * integral - kd * v;
      const double tau = std::clamp(wish, -most_Nm, most_Nm);
      if (watch.update(v, tau, 0.5, half_swings, kStep_s)) return t;
      v += (tau - friction * v + push(t)) * kStep_s;
      q += v * kStep_s;
    }
    return -1.0;
  }
};
constexpr auto kNothing = [](double) { return 0.0; };
double pushed(double t) { return t < 0.1 ? 20.0 : 0.0; }

TEST(SwingWatch, FindsALoopWhoseIntegralFeedsTheSwing) {
  Swing grows{.kp = 100.0, .ki = 200.0, .v = 0.1};
  EXPECT_GT(grows.until(20.0, kNothing), 0.0);
  Swing bounded{.kp = 100.0, .ki = 400.0, .friction = 2.0, .most_Nm = 20.0, .v = 0.4};
  EXPECT_GT(bounded.until(30.0, kNothing), 0.0) << "limited by its torque";
}

TEST(SwingWatch, FindsItTwoPeriodsAfterItHasPassedTheThreshold) {
  for (const double hertz : {0.8, 2.0, 5.0}) {
    SwingWatch watch;
    const double w = 2.0 * std::numbers::pi * hertz;
    double t = 0.0;
    // The torque is a little before the velocity: it feeds the swing.
    while (t < 20.0 && !watch.update(std::sin(w * t), std::sin(w * t + 1.0), 0.25, 4, kStep_s)) {
      t += kStep_s;
    }
    EXPECT_NEAR(t, 2.0 / hertz, 0.3 / hertz) << hertz;
  }
}

TEST(SwingWatch, LeavesALoopAloneThatTakesTheEnergyOut) {
  for (const double kd : {0.2, 1.0, 20.0}) {
    Swing damped{.kp = 100.0, .kd = kd};
    EXPECT_EQ(damped.until(20.0, pushed), -1.0) << "a push; kd = " << kd;
    Swing shaken{.kp = 100.0, .kd = kd};
    const auto shake = [](double t) { return 30.0 * std::sin(6.0 * t); };
    EXPECT_EQ(shaken.until(20.0, shake), -1.0) << "somebody shakes it; kd = " << kd;
  }
}

TEST(SwingWatch, LeavesASpringAloneThatIsLetGo) {
  for (const double friction : {0.2, 1.0}) {
    Swing spring{.kp = 100.0, .friction = friction};
    EXPECT_EQ(spring.until(20.0, pushed), -1.0) << friction;
  }
}

TEST(SwingWatch, LeavesStepsOfTheReferenceAlone) {
  SwingWatch watch;
  double q = 0.0, v = 0.0, error = 0.0;
  for (int k = 0; k < 20'000; ++k) {
    const double reference = k / 400 % 2 == 0 ? 0.5 : -0.5;
    const double tau = std::clamp(400.0 * (reference - q) - 25.0 * v, -60.0, 60.0);
    v += tau * kStep_s;
    q += v * kStep_s;
    const double deviation = k == 0 ? 0.0 : (error - (reference - q)) / kStep_s;
    error = reference - q;
    EXPECT_FALSE(watch.update(deviation, tau, 0.5, 4, kStep_s)) << k;
  }
}

TEST(SwingWatch, ForgetsWhatIsLongAgoAndWatchesNothingWithoutAThreshold) {
  SwingWatch watch;
  const auto half = [&](double side, int ms) {
    bool found = false;
    for (int k = 0; k < ms; ++k) found = watch.update(side, side, 0.25, 4, kStep_s) || found;
    return found;
  };
  for (int n = 0; n < 10; ++n) EXPECT_FALSE(half(n % 2 == 0 ? 1.0 : -1.0, 1100)) << "too slow";
  watch.restart();
  bool found = false;
  for (int n = 0; n < 10; ++n) found = half(n % 2 == 0 ? 1.0 : -1.0, 100) || found;
  EXPECT_TRUE(found);
  SwingWatch none;
  for (int k = 0; k < 5000; ++k) {
    EXPECT_FALSE(none.update(std::sin(0.01 * k), std::sin(0.01 * k), 0.0, 4, kStep_s));
  }
}

}  // namespace
}  // namespace tandem
