// Robots whose free motion is learned from and which are pushed: for the collision tests.
#pragma once

#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/runtime/estimated_run.hpp"

namespace tandem::runtime {

/// A bundled robot in its bundled motion, and where it is pushed.
struct Subject {
  const char* robot;
  const char* experiment;
  double free_s, from_s;  ///< of free motion; settling of the filters is left out
  std::vector<std::pair<const char*, std::array<double, 3>>> places;  ///< joint, point of its link
};

inline const Subject& subject(const std::string& name) {
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

inline estimation::EstimationConfig observer_of(const std::string& robot) {
  estimation::EstimationConfig config = for_legs();
  if (robot != "coman") config.base.reset();
  return config;
}

/// What a threshold is learned for: of each joint, and of a floating base.
inline std::vector<double> felt(const EstimatedRun& run) {
  const auto joints = run.estimate().external_torque_Nm();
  const auto base = run.estimate().external_base_wrench();
  std::vector<double> all(joints.begin(), joints.end());
  all.insert(all.end(), base.begin(), base.end());
  return all;
}

/// Calls `see(felt)` in each cycle of a run that touches nothing.
template <typename See>
void free_motion(const Subject& s, std::uint64_t seed, See&& see) {
  EstimatedRun run(s.robot, s.experiment, {.seed = seed, .estimation = observer_of(s.robot)});
  run.run_to(RunPhase::kRunning);
  const double begin = run.time_s();
  while (run.time_s() < begin + s.from_s && run.cycle->step()) {
  }
  while (run.time_s() < begin + s.free_s && run.cycle->step()) see(felt(run));
  EXPECT_TRUE(run.cycle->faults().empty());
}

/// The thresholds of one false alarm an hour, of all joints together, by runs of these seeds.
inline std::vector<double> learned(const Subject& s, const std::vector<std::uint64_t>& seeds) {
  constexpr std::size_t kBlock = 500;                 // cycles
  std::vector<std::vector<std::vector<double>>> all;  // by joint, run, block
  for (std::size_t r = 0; r < seeds.size(); ++r) {
    std::size_t cycle = 0;
    free_motion(s, seeds[r], [&](std::span<const double> torque) {
      all.resize(torque.size(), std::vector<std::vector<double>>(seeds.size()));
      for (std::size_t j = 0; j < torque.size(); ++j) {
        std::vector<double>& largest = all[j][r];
        if (cycle % kBlock == 0) largest.push_back(0.0);
        largest.back() = std::max(largest.back(), std::abs(torque[j]));
      }
      ++cycle;
    });
  }
  std::vector<double> thresholds;
  for (const auto& runs : all)
    thresholds.push_back(
        estimation::learn_threshold(runs, 1e-3 * kBlock, 1.0 / static_cast<double>(all.size())));
  return thresholds;
}

/// Calls `see(felt)` in each of the 200 cycles of a push at a place, in a seeded
/// direction and at a seeded time of the motion.
template <typename See>
void pushed(const Subject& s, std::size_t place, double force_N, std::uint64_t seed, See&& see) {
  std::mt19937_64 random(seed * 977 + place);
  std::normal_distribution<double> gauss;
  Eigen::Vector3d way(gauss(random), gauss(random), gauss(random));
  way *= force_N / way.norm();
  const double at_s = 2.0 + 3.0 * std::uniform_real_distribution<double>()(random);
  const auto& [joint, point] = s.places[place];
  EstimatedRun run(s.robot, s.experiment, {.seed = seed + 100, .estimation = observer_of(s.robot)});
  const sim::ScenarioFault push =
      push_on(run.experiment->robot, joint, {way.x(), way.y(), way.z()}, at_s, 0.2, point);
  ASSERT_EQ(run.backend->robot().inject(push), Code::kOk);
  run.run_to_fault();
  see(felt(run));
  for (int i = 1; i < 200 && run.cycle->step(); ++i) see(felt(run));
}

}  // namespace tandem::runtime
