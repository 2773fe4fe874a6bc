// The base's estimate beside the truth, in runs of bundled robots.
#include <Eigen/Geometry>

#include "hal/truth.hpp"
#include "rt/scoped_realtime.hpp"
#include "runtime/fall_watch.hpp"
#include "tests/runtime/estimated_run.hpp"

namespace tandem::runtime {
namespace {

// The angle between the z axes of two orientations [rad].
double tilt_between(std::span<const double> a, std::span<const double> b) {
  const Eigen::Quaterniond A(a[3], a[0], a[1], a[2]), B(b[3], b[0], b[1], b[2]);
  const double c = (A * Eigen::Vector3d::UnitZ()).dot(B * Eigen::Vector3d::UnitZ());
  return std::acos(std::clamp(c, -1.0, 1.0));
}

struct Worst {
  double tilt_rad = 0.0, height_m = 0.0, level_m = 0.0, velocity_m_s = 0.0, force_N = 0.0;
  int cycles = 0;

  void see(const EstimatedRun& run, std::span<const double> origin) {
    const auto& e = run.estimate();
    const auto& t = run.truth();
    tilt_rad = std::max(tilt_rad, tilt_between(e.base_quaternion(), t.base_quaternion()));
    height_m = std::max(height_m, std::abs(e.base_position_m()[2] - t.base_position_m()[2]));
    level_m =
        std::max(level_m, std::hypot(e.base_position_m()[0] - t.base_position_m()[0] + origin[0],
                                     e.base_position_m()[1] - t.base_position_m()[1] + origin[1]));
    for (std::size_t i = 0; i < 3; ++i)
      velocity_m_s = std::max(velocity_m_s, std::abs(e.base_velocity()[i] - t.base_velocity()[i]));
    for (std::size_t i = 0; i < t.foot_force_N().size(); ++i)
      force_N = std::max(force_N, std::abs(e.foot_force_N()[i] - t.foot_force_N()[i]));
    ++cycles;
  }
};

// From where the estimate starts, or the controllers, whatever is later.
Worst watch(EstimatedRun& run, double from_s, double to_s) {
  Worst worst;
  std::vector<double> origin;
  while (run.time_s() < to_s && run.cycle->step()) {
    if (!run.estimate().has_base() || run.time_s() < from_s) continue;
    const auto& t = run.truth();
    const auto& e = run.estimate();
    if (origin.empty())
      origin = {t.base_position_m()[0] - e.base_position_m()[0],
                t.base_position_m()[1] - e.base_position_m()[1]};
    worst.see(run, origin);
  }
  return worst;
}

TEST(BaseEstimate, OfComanSquattingStaysNearTheTruth) {
  const bool long_run = std::getenv("TANDEM_LONG_RUNS") != nullptr;
  EstimatedRun run("coman", "squat", {.estimation = for_legs()});
  run.run_to(RunPhase::kRunning);
  ASSERT_TRUE(run.estimate().has_base()) << "it started while the robot stood";
  const Worst worst = watch(run, run.time_s() + 1.0, run.time_s() + (long_run ? 30.0 : 9.0));
  std::printf(
      "COMAN squatting %.0f s: tilt %.3f deg, height %.2f mm, level %.2f mm, velocity %.4f "
      "m/s, foot force %.2f N\n",
      1e-3 * worst.cycles, worst.tilt_rad * 180.0 / M_PI, 1e3 * worst.height_m, 1e3 * worst.level_m,
      worst.velocity_m_s, worst.force_N);
  EXPECT_TRUE(run.cycle->faults().empty());
  EXPECT_LT(worst.tilt_rad, 0.01);
  EXPECT_LT(worst.height_m, 0.01);
  EXPECT_LT(worst.velocity_m_s, 0.05);
}

TEST(BaseEstimate, OfComanStandingDoesNotDrift) {
  const bool long_run = std::getenv("TANDEM_LONG_RUNS") != nullptr;
  EstimatedRun run("coman", "hold", {.estimation = for_legs(), .change = [](Experiment& e) {
                                       e.duration_s = 60.0;
                                     }});
  run.run_to(RunPhase::kRunning);
  ASSERT_TRUE(run.estimate().has_base());
  const Worst worst = watch(run, run.time_s() + 1.0, run.time_s() + (long_run ? 60.0 : 6.0));
  std::printf("COMAN standing %.0f s: tilt %.3f deg, height %.2f mm, level %.2f mm\n",
              1e-3 * worst.cycles, worst.tilt_rad * 180.0 / M_PI, 1e3 * worst.height_m,
              1e3 * worst.level_m);
  EXPECT_LT(worst.level_m, 0.01);
  EXPECT_LT(worst.height_m, 0.01);
}

TEST(BaseEstimate, IsRewoundWithTheRunToTheSameBits) {
  EstimatedRun run("coman", "squat", {.estimation = for_legs()});
  run.run_to(RunPhase::kRunning);
  for (int i = 0; i < 300; ++i) run.cycle->step();
  const auto saved = run.cycle->save();
  ASSERT_TRUE(saved) << saved.error().to_string();
  const auto play = [&] {
    std::vector<std::byte> all;
    for (int i = 0; i < 200; ++i) {
      run.cycle->step();
      const auto bytes = run.estimate().bytes();
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
    return all;
  };
  const auto first = play();
  ASSERT_TRUE(run.cycle->restore(*saved));
  EXPECT_EQ(play(), first);
}

std::string refusal(const std::string& robot, const std::string& name,
                    const std::function<void(hal::Robot&, estimation::EstimationConfig&)>& change) {
  auto e =
      read_experiment(std::string(TANDEM_SOURCE_DIR) + "/config/" + robot + "/" + name + ".toml");
  auto kernels =
      model::load_kernels(std::string(TANDEM_BINARY_DIR) + "/lib/models/" + robot + "_kernels.so");
  if (!e || !kernels) return "cannot be read";
  hal::Robot described = hal::robot_of(e->robot);
  estimation::EstimationConfig config = for_legs();
  change(described, config);
  const auto made = estimation::Estimator::make(described, kernels->get(), config, 1'000'000);
  return made ? "" : made.error().to_string();
}

TEST(BaseEstimate, RefusesByNameWhatTheRobotLacks) {
  using Robot = hal::Robot;
  using Config = estimation::EstimationConfig;
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos ? std::string() : text + " lacks " + part;
  };
  EXPECT_EQ(refusal("coman", "squat", [](Robot&, Config&) {}), "");
  EXPECT_EQ(has(refusal("coman", "squat",
                        [](Robot& robot, Config&) {
                          std::erase_if(robot.sensors,
                                        [](const hal::Sensor& s) { return s.name == "imu"; });
                        }),
                "the robot has no IMU"),
            "");
  EXPECT_EQ(has(refusal("coman", "squat",
                        [](Robot& robot, Config&) {
                          std::erase_if(robot.sensors,
                                        [](const hal::Sensor& s) { return s.name == "left_foot"; });
                        }),
                "the foot 'l_sole' has no force/torque sensor"),
            "");
  EXPECT_EQ(has(refusal("coman", "squat", [](Robot&, Config& c) { c.base->imu = "head"; }),
                "the robot has no IMU 'head'"),
            "");
  EXPECT_EQ(has(refusal("coman", "squat", [](Robot&, Config& c) { c.base.reset(); }),
                "add [estimation.base]"),
            "");
  EXPECT_EQ(has(refusal("panda", "hold", [](Robot&, Config&) {}), "the robot's base does not move"),
            "");
  EXPECT_EQ(
      has(refusal("coman", "squat",
                  [](Robot&, Config& c) {
                    c.collision = estimation::CollisionConfig{.thresholds = {{"LElbow", 1.0}}};
                  }),
          "the robot has no joint 'LElbow'"),
      "");
}

}  // namespace
}  // namespace tandem::runtime
