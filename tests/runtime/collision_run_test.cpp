// A push in a run of a bundled robot is found, and free motion is not taken for one.
// Hours of it: collision_curve_test.cpp.
#include "estimation/alarm_curve.hpp"
#include "tests/runtime/collision_subjects.hpp"

namespace tandem::runtime {
namespace {

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
  run.run_to_fault();
  for (int i = 0; i < 300; ++i) run.cycle->step();
  const tandem_kernels& k = run.run->kernels();
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
INSTANTIATE_TEST_SUITE_P(Robots, Collision, testing::Values("panda", "ur5e", "coman"),
                         [](const auto& test) { return std::string(test.param); });

TEST_P(Collision, IsFoundSoonAndNotWithoutOne) {
  Subject s = subject(GetParam());
  s.free_s = std::min(s.free_s, 9.5);
  const std::vector<double> thresholds = learned(s, {1, 2, 3});
  estimation::FalseAlarms alarms(thresholds, 200);
  free_motion(s, 4, [&](std::span<const double> torque) { alarms.look(torque); });
  EXPECT_GT(alarms.cycles(), 6000U);
  EXPECT_EQ(alarms.alarms(1.0), 0U);
  for (std::size_t place = 0; place < s.places.size(); ++place) {
    estimation::DetectionTimes times(thresholds, std::vector{1.0});
    times.begin_push();
    // Directions are seeded: those of seed 1 do not pass through the axes.
    pushed(s, place, 50.0, 1, [&](std::span<const double> torque) { times.look(torque); });
    EXPECT_LE(times.with(0).worst, 20.0) << s.places[place].first;
  }
}

// Up along the leg: no joint feels half of its threshold, and the base feels all of it.
TEST(Collision, ThatNoJointFeelsIsFoundAtTheBase) {
  estimation::EstimationConfig config = observer_of("coman");
  config.collision.emplace();
  for (const auto& [joint, torque_Nm] : {std::pair{"LHipYaw", 0.9}, {"LHipSag", 2.0}})
    config.collision->thresholds.push_back({joint, torque_Nm});
  for (const char* channel : estimation::kBaseChannels)
    config.collision->thresholds.push_back({channel, 12.0});
  EstimatedRun run("coman", "squat", {.estimation = config});
  const sim::ScenarioFault push =
      push_on(run.experiment->robot, "LHipYaw", {-9.0, 2.0, 49.0}, 3.0, 0.2, {0.0, 0.0, -0.1});
  ASSERT_EQ(run.backend->robot().inject(push), Code::kOk);
  run.run_to_fault();
  ASSERT_TRUE(run.cycle->faults().empty()) << run.cycle->faults()[0].text;
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(run.cycle->step());
  EXPECT_EQ(run.estimate().base_collided()[0], 1);
  for (const std::uint8_t joint : run.estimate().collided()) EXPECT_EQ(joint, 0);
  ASSERT_FALSE(run.cycle->faults().empty());
  EXPECT_EQ(run.cycle->faults()[0].joint, "base");
  EXPECT_NE(run.cycle->faults()[0].text.find("N (base_force_"), std::string::npos)
      << run.cycle->faults()[0].text;
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(run.cycle->step());
  EXPECT_EQ(run.estimate().base_collided()[0], 0) << "the push is over";
}

// The wrench on the base is the force, in its frame, whatever is pushed.
TEST(Push, OnAHumanoidIsTheBasesExternalForce) {
  EstimatedRun run("coman", "squat", {.noise = false, .estimation = observer_of("coman")});
  const std::array<double, 3> force_N{20.0, -15.0, 30.0};
  ASSERT_EQ(run.backend->robot().inject(
                push_on(run.experiment->robot, "LShLat", force_N, 3.0, 0.5, {0.0, 0.0, -0.1})),
            Code::kOk);
  run.run_to_fault();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int i = 0; i < 400; ++i) {
    ASSERT_TRUE(run.cycle->step());
    const auto wrench = run.estimate().external_base_wrench();
    if (i >= 200) mean += Eigen::Vector3d(wrench[0], wrench[1], wrench[2]) / 200.0;
  }
  EXPECT_NEAR((mean - Eigen::Vector3d(force_N.data())).norm(), 0.0, 6.0) << mean.transpose();
}

}  // namespace
}  // namespace tandem::runtime
