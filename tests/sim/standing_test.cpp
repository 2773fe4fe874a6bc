// COMAN on its feet, held by its boards: what must not move does not, what is felt is true.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/sim/held_robot.hpp"
#include "rt/scoped_realtime.hpp"
#include "tests/support/rt_trap.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem::sim {
namespace {

// The robot, which keeps the configuration that the simulation points to.
struct Coman {
  test::TestRobot coman = test::load_test_robot("coman");
};

// It holds the posture "stand".
class Standing : public Coman, public HeldRobot {
 public:
  explicit Standing(const SimRobotConfig& config = {.substep_ns = 250'000, .posture = "stand"})
      : HeldRobot(coman.robot, SimRobot::create(coman.robot, coman.kernels.get(), config).value(),
                  "stand") {}
  void step() {
    const rt::ScopedRealtime in_cycle;
    done = HeldRobot::step();
  }
  void run(double seconds) {
    const auto cycles = static_cast<int>(std::lround(seconds * 1e3));
    for (int i = 0; i < cycles; ++i) step();
    ASSERT_EQ(done, Code::kOk) << robot->status_text();
  }
  void bring_up() {
    for (int i = 0; i < 10'000 && robot->phase() != hal::Phase::kOperational; ++i) step();
    ASSERT_EQ(robot->phase(), hal::Phase::kOperational) << robot->status_text();
    for (int i = 0; i < 10'000 && !robot->plant().released(); ++i) step();
    ASSERT_TRUE(robot->plant().released());
  }
  std::size_t joint(const char* name) const {
    return static_cast<std::size_t>(coman.robot.joint_index(name));
  }
  std::span<const double> sensor(const char* name) const {
    return state.sensor_values(static_cast<std::size_t>(coman.robot.sensor_index(name)));
  }
  // Weight of what hangs below a foot's sensor: its reading with the foot off the ground.
  double below(std::size_t sensor) const {
    const tandem_kernels& k = *coman.kernels;
    std::vector<double> rest(k.nv, 0.0), wrench(6 * k.wrenches, 0.0), out(6 * k.sensors, 0.0);
    k.sensor_wrenches(robot->plant().q(), rest.data(), rest.data(), wrench.data(), out.data());
    return -out[6 * sensor + 2];
  }

  Code done = Code::kOk;
};

double turned_deg(std::span<const double> from, std::span<const double> to) {
  double way2 = 0.0;
  for (std::size_t i = 0; i < 3; ++i) way2 += (to[i] - from[i]) * (to[i] - from[i]);
  return 2.0 * std::sqrt(way2) * 180.0 / std::numbers::pi;
}

TEST(Standing, DoesNotDriftInAMinute) {
  Standing standing;
  standing.bring_up();
  standing.run(30.0);  // the integrals take up the springs' load
  const hal::TruthImage& truth = standing.robot->truth();
  const hal::TruthImage start = truth;
  double way_mm = 0.0, turn_deg = 0.0, foot_mm = 0.0;
  for (int second = 0; second < 60; ++second) {
    standing.run(1.0);
    for (std::size_t i = 0; i < 3; ++i) {
      way_mm =
          std::max(way_mm, 1e3 * std::abs(truth.base_position_m()[i] - start.base_position_m()[i]));
    }
    for (std::size_t i = 0; i < 6; ++i) {
      foot_mm = std::max(foot_mm,
                         1e3 * std::abs(truth.foot_position_m()[i] - start.foot_position_m()[i]));
    }
    turn_deg = std::max(turn_deg, turned_deg(start.base_quaternion(), truth.base_quaternion()));
  }
  EXPECT_LT(way_mm, 0.1);
  EXPECT_LT(foot_mm, 0.002);
  EXPECT_LT(turn_deg, 0.01);
}

TEST(Standing, FeetFeelTheWeight) {
  Standing standing;
  standing.bring_up();
  standing.run(30.0);
  double felt = 0.0, ground = 0.0;
  for (int i = 0; i < 1000; ++i) {
    standing.step();
    felt += (standing.sensor("left_foot")[2] + standing.sensor("right_foot")[2]) / 1000.0;
    const auto force = standing.robot->truth().foot_force_N();
    ground += (force[2] + force[5]) / 1000.0;
  }
  const double weight = standing.coman.kernels->mass_kg * 9.81;
  EXPECT_NEAR(ground, weight, 1e-3 * weight);
  EXPECT_NEAR(felt, weight - standing.below(0) - standing.below(1), 1e-3 * weight);
}

TEST(Standing, EachFootFeelsItsOwnLegAndItsDirections) {
  Standing standing;
  standing.bring_up();
  standing.run(3.0);
  // Leans to its left: both ankles and hips roll, so that the left foot carries more.
  for (const char* name : {"LAnkLat", "RAnkLat", "LHipLat", "RHipLat"}) {
    const bool ankle = std::string_view(name).find("Ank") != std::string_view::npos;
    const std::size_t j = standing.joint(name);
    for (int i = 0; i < 500; ++i) {
      standing.command.position_rad()[j] += (ankle ? 0.05 : -0.05) / 500.0;
      standing.step();
    }
  }
  standing.run(10.0);
  const double weight = standing.coman.kernels->mass_kg * 9.81;
  const auto force = standing.robot->truth().foot_force_N();
  ASSERT_GT(std::abs(force[2] - force[5]), 0.1 * weight);  // well apart
  const auto left = standing.sensor("left_foot"), right = standing.sensor("right_foot");
  const auto size = [](std::span<const double> f) { return std::hypot(f[0], f[1], f[2]); };
  EXPECT_NEAR(left[2] + standing.below(0), force[2], 2e-2 * weight);
  EXPECT_NEAR(right[2] + standing.below(1), force[5], 2e-2 * weight);
  EXPECT_NEAR(size(left) - size(right),
              std::hypot(force[0], force[1], force[2]) - std::hypot(force[3], force[4], force[5]),
              2e-2 * weight);
}

TEST(Standing, SnapshotGivesTheSameBytesAgain) {
  Standing standing;
  const auto all = [&] {
    Archive ar;
    EXPECT_TRUE(standing.robot->archive(ar));
    ar(standing.state, standing.time);
    return std::vector<std::byte>(ar.bytes().begin(), ar.bytes().end());
  };
  for (const double seconds : {0.05, 0.3, 2.0}) {  // boot, configuration, on its feet
    const auto until = static_cast<std::uint64_t>(seconds * 1e3);
    while (standing.time.cycle < until) standing.step();
    const std::vector<std::byte> saved = all();
    const auto on = [&] {
      for (int i = 0; i < 500; ++i) standing.step();
      return all();
    };
    const std::vector<std::byte> first = on();
    Archive restore(saved);
    ASSERT_TRUE(standing.robot->archive(restore));
    restore(standing.state, standing.time);
    ASSERT_TRUE(restore.ok() && restore.at_end());
    EXPECT_EQ(on(), first) << "from " << seconds << " s";
  }
}

TEST(Standing, IntegratorsAgree) {
  Standing coarse,
      fine({.integrator = Integrator::kRungeKutta4, .substep_ns = 125'000, .posture = "stand"});
  for (Standing* one : {&coarse, &fine}) {
    one->bring_up();
    one->run(2.0);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(coarse.robot->truth().base_position_m()[i],
                fine.robot->truth().base_position_m()[i], 1e-4);
  }
}

}  // namespace
}  // namespace tandem::sim
