// Collisions in runs of bundled robots: thresholds from free motion, then pushes of many sizes.
// TANDEM_COLLISION_SEEDS=20 plays more of each, and prints docs/estimation.md's table.
#include <cstdlib>
#include <map>
#include <random>

#include "hal/config/robot_config.hpp"
#include "tests/runtime/estimated_run.hpp"

namespace tandem::runtime {
namespace {

using estimation::EstimationConfig;

struct Subject {
  const char* robot;
  const char* experiment;
  double free_s, from_s;  // of free motion; settling of the filters is left out
  std::vector<std::pair<const char*, std::array<double, 3>>> places;  // joint and point of its link
};

const Subject& subject(const std::string& name) {
  static const std::map<std::string, Subject> all{
      {"panda",
       {"panda",
        "trajectory",
        9.5,
        0.3,
        {{"panda_joint2", {0.0, -0.2, 0.0}}, {"panda_joint4", {}}, {"panda_joint6", {}}}}},
      {"ur5e",
       {"ur5e",
        "trajectory",
        7.5,
        0.3,
        {{"shoulder_lift_joint", {-0.2, 0.0, 0.0}}, {"elbow_joint", {}}, {"wrist_1_joint", {}}}}},
      {"coman",
       {"coman",
        "squat",
        24.0,
        1.0,
        {{"LElbj", {}}, {"LShLat", {0.0, 0.0, -0.1}}, {"LHipYaw", {0.0, 0.0, -0.1}}}}},
  };
  return all.at(name);
}

EstimationConfig observer_of(const std::string& robot) {
  EstimationConfig config = for_legs();
  if (robot != "coman") config.base.reset();
  return config;
}

// The largest external torque of each joint in blocks of free motion.
std::vector<std::vector<double>> blocks_of(const Subject& s, std::uint64_t seed, int block) {
  EstimatedRun run(s.robot, s.experiment, {.seed = seed, .estimation = observer_of(s.robot)});
  run.run_to(RunPhase::kRunning);
  const std::size_t n = run.experiment->robot.joints.size();
  std::vector<std::vector<double>> largest(n);
  const double begin = run.time_s();
  while (run.time_s() < begin + s.from_s) run.cycle->step();
  while (run.time_s() < begin + s.free_s) {
    std::vector<double> most(n);
    for (int i = 0; i < block && run.cycle->step(); ++i)
      for (std::size_t j = 0; j < n; ++j)
        most[j] = std::max(most[j], std::abs(run.estimate().external_torque_Nm()[j]));
    for (std::size_t j = 0; j < n; ++j) largest[j].push_back(most[j]);
  }
  EXPECT_TRUE(run.cycle->faults().empty());
  return largest;
}

constexpr int kBlock = 500;  // cycles

std::vector<double> thresholds_of(const std::vector<std::vector<double>>& largest,
                                  double alarms_per_hour) {
  std::vector<double> thresholds;
  for (const auto& joint : largest)
    thresholds.push_back(estimation::learn_threshold(
        joint, 1e-3 * kBlock, alarms_per_hour / static_cast<double>(largest.size())));
  return thresholds;
}

// A push at the hand, seen by the observer, against the Jacobian of the hand's own site.
TEST(Push, IsTheTransposedJacobianTimesItsForce) {
  EstimatedRun run("panda", "hold",
                   {.noise = false,
                    .estimation = observer_of("panda"),
                    .change = [](Experiment& e) { e.duration_s = 5.0; }});
  const std::array<double, 3> force_N{12.0, -20.0, 15.0};
  const auto push =
      push_on(run.experiment->robot, "panda_joint7", force_N, 2.0, 2.0, {0, 0, 0.107});
  ASSERT_EQ(run.backend->robot().inject(push), Code::kOk);
  run.run_to(RunPhase::kRunning);
  while (run.backend->robot().faults()[0].active == 0 && run.cycle->step()) {
  }
  for (int i = 0; i < 300; ++i) run.cycle->step();
  const tandem_kernels& k = *run.kernels;
  std::vector<double> J(6 * k.nv * k.sites), expected(k.nv), found(k.nv);
  constexpr int kCycles = 1500;  // the drives' torques are coarse: single values differ by 0.3 Nm
  for (int i = 0; i < kCycles; ++i) {
    run.cycle->step();
    k.site_jacobians(run.truth().position_rad().data(), J.data());
    for (std::size_t j = 0; j < k.nv; ++j) {
      found[j] += run.estimate().external_torque_Nm()[j] / kCycles;
      for (std::size_t axis = 0; axis < 3; ++axis)
        expected[j] += J[axis * k.nv + j] * force_N[axis] / kCycles;
    }
  }
  for (std::size_t j = 0; j < k.nv; ++j) EXPECT_NEAR(found[j], expected[j], 0.05) << j;
}

class Collision : public testing::TestWithParam<const char*> {};

// Of `force_N` at a place, in a seeded direction and at a seeded time. Answers the cycles to
// detection for each of several rates; -1: not within 200.
std::vector<int> detect(const Subject& s, std::size_t place, double force_N, std::uint64_t seed,
                        const std::vector<std::vector<double>>& thresholds) {
  std::mt19937_64 random(seed * 977 + place);
  std::normal_distribution<double> gauss;
  Eigen::Vector3d way(gauss(random), gauss(random), gauss(random));
  way *= force_N / way.norm();
  const double at_s = 2.0 + 3.0 * std::uniform_real_distribution<double>()(random);
  const auto& [joint, point] = s.places[place];
  auto config = observer_of(s.robot);
  EstimatedRun run(s.robot, s.experiment, {.seed = seed + 100, .estimation = config});
  sim::Fault push =
      push_on(run.experiment->robot, joint, {way.x(), way.y(), way.z()}, at_s, 0.2, point);
  EXPECT_EQ(run.backend->robot().inject(push), Code::kOk);
  int struck = -1;
  std::vector<int> found(thresholds.size(), -1);
  for (int i = 0; struck < 0 || i < struck + 200; ++i) {
    if (!run.cycle->step()) break;
    if (struck < 0 && run.backend->robot().faults()[0].active != 0) struck = i;
    if (struck < 0) continue;
    for (std::size_t t = 0; t < thresholds.size(); ++t)
      for (std::size_t j = 0; found[t] < 0 && j < thresholds[t].size(); ++j)
        if (std::abs(run.estimate().external_torque_Nm()[j]) > thresholds[t][j])
          found[t] = i - struck + 1;
  }
  return found;
}

TEST_P(Collision, IsFoundSoonAndNotWithoutOne) {
  Subject s = subject(GetParam());
  const char* text = std::getenv("TANDEM_COLLISION_SEEDS");
  if (text == nullptr) s.free_s = std::min(s.free_s, 9.5);
  const int seeds = text == nullptr ? 1 : std::atoi(text);
  const auto largest = blocks_of(s, 1, kBlock);
  const std::vector<double> rates =
      text == nullptr ? std::vector{1.0} : std::vector{0.01, 1.0, 60.0};
  std::vector<std::vector<double>> thresholds;
  for (const double rate : rates) thresholds.push_back(thresholds_of(largest, rate));
  const auto [least, most] = std::ranges::minmax(thresholds[rates.size() == 1 ? 0 : 1]);
  std::printf("%s: thresholds at 1 alarm an hour %.2f to %.2f Nm\n", s.robot, least, most);
  // Another seed's free motion stays below them.
  const auto other = blocks_of(s, 2, kBlock);
  for (std::size_t j = 0; j < other.size(); ++j)
    EXPECT_LT(std::ranges::max(other[j]), thresholds[rates.size() == 1 ? 0 : 1][j]) << j;
  const std::vector<double> forces =
      text == nullptr ? std::vector{50.0} : std::vector{5.0, 10.0, 20.0, 50.0, 100.0};
  for (std::size_t place = 0; place < s.places.size(); ++place) {
    for (const double force : forces) {
      std::vector<std::vector<int>> times(rates.size());
      for (int seed = 1; seed <= seeds; ++seed) {
        const auto found = detect(s, place, force, static_cast<std::uint64_t>(seed), thresholds);
        for (std::size_t r = 0; r < rates.size(); ++r) times[r].push_back(found[r]);
      }
      if (force >= 50.0) {  // of seeded directions: those of seed 1 do not pass through the axes
        const int first = times[rates.size() == 1 ? 0 : 1].front();
        EXPECT_TRUE(first > 0 && first <= 20) << s.places[place].first << ": " << first << " ms";
      }
      std::printf("%-6s %-20s %5.0f N", s.robot, s.places[place].first, force);
      for (std::size_t r = 0; r < rates.size(); ++r) {
        std::vector<int> some;
        for (const int one : times[r])
          if (one >= 0) some.push_back(one);
        std::ranges::sort(some);
        std::printf("  | %6.2f/h: %zu of %d, median %d, worst %d ms", rates[r], some.size(), seeds,
                    some.empty() ? -1 : some[some.size() / 2], some.empty() ? -1 : some.back());
      }
      std::printf("\n");
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Robots, Collision, testing::Values("panda", "ur5e", "coman"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace tandem::runtime
