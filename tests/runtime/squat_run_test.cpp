// The squats as `tandem run` runs them: experiment, generated kernels, plugin, whole chain, log.
// Every cycle is under the real-time trap; the preset rtsan checks the same runs.
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>
#include <utility>

#include "log/log_file.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/runtime/bundled_run.hpp"
#include "tests/runtime/played_clock.hpp"

namespace tandem::runtime {
namespace {

constexpr double kRunning_s = 1.5;  // into the first descent
constexpr double kDegree = std::numbers::pi / 180.0;

struct Case {
  const char* robot;
  double depth_m;
  int squats;
  std::vector<const char*> joints{"LHipSag", "RHipSag", "LKneeSag", "RKneeSag"};
  bool bus_timing = false;
};
class SquatOf : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Robots, SquatOf,
                         testing::Values(Case{"coman", 0.10, 4}, Case{"walkman", 0.30, 4},
                                         Case{"coman", 0.10, 4, {"LKneeSag"}, true},
                                         Case{"anymal_c", 0.15, 2, {"LF_HFE", "RF_KFE", "RH_KFE"}}),
                         [](const auto& one) {
                           return std::string(one.param.robot) +
                                  (one.param.bus_timing ? "_with_bus_timing" : "");
                         });

/// A squat cycle by cycle, from the plant's truth: its feet, and what the ground does to them
/// against what the centre of mass does.
class SquatWatch {
 public:
  SquatWatch(const hal::TruthImage& truth, double mass_kg, std::int64_t period_ns, double depth_m)
      : feet_m_(truth.foot_position_m().begin(), truth.foot_position_m().end()),
        mass_kg_(mass_kg),
        period_s_(static_cast<double>(period_ns) * 1e-9),
        half_way_m_(truth.base_position_m()[2] - depth_m / 2.0) {}

  void take(const hal::TruthImage& truth) {
    double force_N = 0.0;
    for (std::size_t f = 0; f < truth.feet(); ++f) {
      const double* at = &truth.foot_position_m()[3 * f];
      const double* began = &feet_m_[3 * f];
      const double one_N = truth.foot_force_N()[3 * f + 2];
      force_N += one_N;
      least_force_N = std::min(least_force_N, one_N);
      way_m = std::max(way_m, std::hypot(at[0] - began[0], at[1] - began[1], at[2] - began[2]));
    }
    const double height_m = truth.center_of_mass_m()[2];
    const double accelerates =
        mass_kg_ * (height_m - 2.0 * heights_m_[1] + heights_m_[0]) / (period_s_ * period_s_);
    if (std::isfinite(accelerates)) {  // of the cycle before
      dynamic_force_N = std::max(dynamic_force_N, std::abs(accelerates));
      newton_error_N = std::max(newton_error_N, std::abs(force_N_ - mass_kg_ * 9.81 - accelerates));
    }
    heights_m_[0] = std::exchange(heights_m_[1], height_m);
    force_N_ = force_N;
    const bool low = truth.base_position_m()[2] < half_way_m_;
    if (low && !low_) ++squats;
    low_ = low;
  }

  double least_force_N = std::numeric_limits<double>::infinity();  ///< of any foot in any cycle
  double way_m = 0.0;            ///< of a foot from where it stood when the squat began
  double dynamic_force_N = 0.0;  ///< largest mass times acceleration of the centre of mass
  double newton_error_N = 0.0;   ///< largest |force - weight - that|
  int squats = 0;

 private:
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> feet_m_;
  double mass_kg_, period_s_, half_way_m_;
  double heights_m_[2] = {kUnknown, kUnknown};  // of the centre of mass, in the last two cycles
  double force_N_ = 0.0;
  bool low_ = false;
};

TEST_P(SquatOf, StaysOnItsFeetAndFollowsWithinADegree) {
  BundledRun squat(GetParam().robot, "squat",
                   {.change = [](Experiment& e) { e.sim.bus_timing = GetParam().bus_timing; }});
  squat.run_to(RunPhase::kRunning);
  const Experiment& e = *squat.experiment;
  const hal::TruthImage& truth = squat.backend->truth();
  SquatWatch watch(truth, squat.run->kernels().mass_kg, e.loop.period_ns, GetParam().depth_m);
  while (squat.cycle->step() && squat.cycle->phase() == RunPhase::kRunning) watch.take(truth);
  squat.cycle->run();
  for (const FaultReport& fault : squat.cycle->faults()) ADD_FAILURE() << fault.joint << fault.text;
  EXPECT_EQ(squat.cycle->running_cycles(), e.cycles());

  const auto tracking = squat.cycle->statistics().tracking();
  for (const char* name : GetParam().joints) {
    const int joint = e.robot.joint_index(name);
    ASSERT_GE(joint, 0) << name;
    EXPECT_LT(tracking[static_cast<std::size_t>(joint)].rms_rad, kDegree) << name;
  }

  const double weight_N = squat.run->kernels().mass_kg * 9.81;
  const double share_N = weight_N / static_cast<double>(truth.feet());
  EXPECT_GT(watch.least_force_N, 0.8 * share_N) << "no foot leaves the ground";
  EXPECT_LT(watch.way_m, 0.001) << "nor does it slip";
  EXPECT_LT(watch.newton_error_N, 0.1 * watch.dynamic_force_N) << "force = mass (g + acceleration)";
  EXPECT_EQ(watch.squats, GetParam().squats);
  const auto base = squat.cycle->statistics().base();
  ASSERT_TRUE(base);
  EXPECT_LT(base->final_tilt_rad, kDegree);
  EXPECT_NEAR(base->max_height_m - base->min_height_m, GetParam().depth_m,
              0.02 * GetParam().depth_m);
  const auto ground = squat.cycle->statistics().ground(weight_N);
  ASSERT_TRUE(ground);
  EXPECT_NEAR(ground->mean_vertical_force_N, weight_N, 0.005 * weight_N);
  EXPECT_NEAR(ground->max_foot_slip_m, watch.way_m, 0.0005) << "as the run reports it";
}

/// On real wires too every joint's sample comes in the cycle of its SYNC. The slow frames of
/// COMAN's arms need more than the answer window, so their echoes are read a cycle later, and no
/// more; when heartbeats come between, a forearm's sensor is a cycle late: once in 20 s of
/// squatting.
TEST(SquatRun, WithBusTimingIsOnTime) {
  BundledRun squat("coman", "squat", {.duration_s = kRunning_s, .change = [](Experiment& e) {
                                        e.sim.bus_timing = true;
                                      }});
  squat.run_to(RunPhase::kRunning);
  int late_cycles = 0;
  while (squat.cycle->step() && squat.cycle->phase() == RunPhase::kRunning) {
    const hal::StateImage& state = squat.cycle->state();
    for (const std::uint32_t age : state.age_cycles()) ASSERT_EQ(age, 0U);
    const std::uint32_t oldest = std::ranges::max(state.sensor_age_cycles());
    ASSERT_LE(oldest, 1U);
    late_cycles += oldest == 0 ? 0 : 1;
  }
  EXPECT_LE(late_cycles, 1);
  for (const hal::can::RoundTrip& trip : squat.backend->master().round_trips()) {
    EXPECT_GT(trip.cycles[1] + trip.cycles[2], 300U) << trip.node;
    for (std::size_t late = 3; late < trip.cycles.size(); ++late) {
      EXPECT_EQ(trip.cycles[late], 0U) << trip.node;
    }
  }
}

std::string hash_of_run(const std::string& path, double rate = 0.0, bool loaded = false,
                        bool played = false) {
  auto recorder = log::Recorder::open(path, {}, {});
  EXPECT_TRUE(recorder);
  BundledRun squat("coman", "squat", {.duration_s = kRunning_s, .rate = rate},
                   {.recorder = recorder->get()});
  std::atomic<bool> done{false};
  std::thread load([&] {
    double sum = 0.0;
    while (loaded && !done.load()) sum += std::sin(sum + 1.0);
  });
  if (played) {
    EXPECT_GE(test::run_with_played_clock(*squat.cycle, 1), 6);
  } else {
    squat.cycle->run();
  }
  done = true;
  load.join();
  const log::RecordingResult result = (*recorder)->close();
  EXPECT_EQ(result.dropped, 0U);
  EXPECT_EQ(result.error, "");
  return result.data_sha256;
}

TEST(SquatRun, LogsTheSameDataForTheSameSeedWhateverTheClockAndTheLoad) {
  const log::ScratchFolder folder;
  const std::string first = hash_of_run(folder / "1.mcap");
  EXPECT_EQ(hash_of_run(folder / "2.mcap"), first);
  EXPECT_EQ(hash_of_run(folder / "rate.mcap", 5.0), first);
  EXPECT_EQ(hash_of_run(folder / "load.mcap", 0.0, true), first);
  EXPECT_EQ(hash_of_run(folder / "played.mcap", 0.0, false, true), first);
}

TEST(SquatRun, RepeatsItsBytesAfterARestore) {
  BundledRun squat("coman", "squat", {.duration_s = kRunning_s});
  squat.run_to(RunPhase::kRunning);
  squat.steps(400);
  const auto snapshot = squat.cycle->save();
  ASSERT_TRUE(snapshot) << snapshot.error().to_string();
  const std::vector<std::byte> first = squat.bytes(300);
  ASSERT_TRUE(squat.cycle->restore(*snapshot));
  EXPECT_TRUE(squat.bytes(300) == first);
}

}  // namespace
}  // namespace tandem::runtime
