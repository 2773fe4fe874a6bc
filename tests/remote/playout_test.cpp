// The robot's end of the link: references without steps, whatever arrives.
#include "hal/remote/playout.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "hal/config/capabilities.hpp"
#include "tests/hal/fake_backend.hpp"

namespace tandem::remote {
namespace {

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr std::uint64_t kDelay = 50;
const hal::Robot& robot() {
  static const hal::Robot one = hal::robot_of(hal::test::fake_robot());
  return one;
}

/// A sine on joint 0, which begins at rest.
double angle(std::uint64_t cycle) {
  return 0.2 * (1.0 - std::cos(2e-3 * static_cast<double>(cycle)));
}
double speed(std::uint64_t cycle) { return 0.4 * std::sin(2e-3 * static_cast<double>(cycle)); }
hal::CommandImage command(std::uint64_t cycle) {
  hal::CommandImage one(robot().shape());
  one.cycle()[0] = cycle;
  one.position_rad()[0] = angle(cycle);
  one.velocity_rad_s()[0] = speed(cycle);
  return one;
}

/// References of joint 0, cycle by cycle. @param lost  the command of this cycle
std::vector<double> played(std::uint64_t cycles, const std::function<bool(std::uint64_t)>& lost,
                           Playout& playout,
                           const std::function<std::uint64_t(std::uint64_t)>& way) {
  std::multimap<std::uint64_t, std::uint64_t> under_way;  // arrival -> command
  std::vector<double> references;
  hal::CommandImage out(robot().shape());
  playout.start(0, command(0));
  for (std::uint64_t k = 0; k < cycles; ++k) {
    if (k > 0 && !lost(k)) under_way.emplace(k + way(k), k);
    for (auto it = under_way.begin(); it != under_way.end() && it->first <= k;) {
      playout.take(k, command(it->second));
      it = under_way.erase(it);
    }
    playout.play(k, out);
    references.push_back(out.position_rad()[0]);
  }
  return references;
}

double largest_step(const std::vector<double>& references) {
  double largest = 0.0;
  for (std::size_t i = 1; i < references.size(); ++i) {
    largest = std::max(largest, std::abs(references[i] - references[i - 1]));
  }
  return largest;
}

TEST(Playout, PlaysEachCommandOnceItsDelayIsOver) {
  Playout playout(robot(), kDelay, 250, kPeriod_ns);
  const auto references = played(
      3000, [](auto) { return false; }, playout, [](std::uint64_t k) { return k * 7 % kDelay; });
  for (std::uint64_t k = kDelay; k < 3000; ++k) EXPECT_EQ(references[k], angle(k - kDelay)) << k;
  EXPECT_EQ(playout.starved_cycles(), 0U);
}

TEST(Playout, BridgesWhatIsLost) {
  Playout playout(robot(), kDelay, 250, kPeriod_ns);
  const auto references = played(
      3000, [](std::uint64_t k) { return k * k % 5 < 2 || (k > 1000 && k < 1030); }, playout,
      [](auto) { return std::uint64_t{10}; });
  EXPECT_EQ(playout.starved_cycles(), 0U);
  for (std::uint64_t k = kDelay; k < 3000; ++k) {
    EXPECT_NEAR(references[k], angle(k - kDelay), 1e-4) << k;
  }
  EXPECT_LT(largest_step(references), 1.01 * 0.4e-3);
}

TEST(Playout, BrakesHoldsAndReturnsWithoutAStep) {
  Playout playout(robot(), kDelay, 250, kPeriod_ns);
  const auto lost = [](std::uint64_t k) { return k >= 700 && k < 1700; };
  const auto references = played(4000, lost, playout, [](auto) { return std::uint64_t{10}; });
  EXPECT_EQ(playout.holds(), 1U);
  EXPECT_EQ(playout.starved_cycles(), 1000U);
  // At rest a brake's time after the last command has been played.
  for (std::uint64_t k = 700 + kDelay + 250; k < 1700 + kDelay; ++k) {
    EXPECT_EQ(references[k], references[1700]) << k;
  }
  const double way = references[1700] - angle(699);
  EXPECT_NEAR(way, 0.5 * speed(699) * 0.250, 2e-3) << "half of what it had gone on";
  const double most = robot().joints[0].max_velocity_rad_s;
  EXPECT_LT(largest_step(references), (0.4 + 0.25 * most) * 1e-3 * 1.01);
  for (std::size_t i = 2; i < references.size(); ++i) {  // of velocity
    const double step = references[i] - 2 * references[i - 1] + references[i - 2];
    EXPECT_LT(std::abs(step), 2e-4) << i;
  }
  EXPECT_NEAR(references.back(), angle(3999 - kDelay), 1e-12) << "it is back";
}

TEST(Playout, TakesNothingThatIsTooLateOrFromTheFuture) {
  Playout playout(robot(), kDelay, 250, kPeriod_ns);
  hal::CommandImage out(robot().shape());
  playout.start(0, command(0));
  for (std::uint64_t k = 0; k < 200; ++k) {
    playout.take(k, command(k + 1));
    if (k > kDelay + 1) playout.take(k, command(k - kDelay - 1));
    playout.play(k, out);
  }
  EXPECT_EQ(out.position_rad()[0], 0.0);
  EXPECT_TRUE(playout.starved());
}

}  // namespace
}  // namespace tandem::remote
