// A run whose plant is not the model: who sees it, and that it can be wound back.
#include <gtest/gtest.h>

#include <cmath>

#include "runtime/plant_options.hpp"
#include "tests/runtime/estimated_run.hpp"

namespace tandem::runtime {
namespace {

/// The largest tracking error [rad] until `until_s`, from `from_s` on.
struct Watch {
  BundledRun& run;
  double error_rad(double from_s, double until_s) {
    double most = 0.0;
    for (;;) {
      const double now_s = 1e-9 * static_cast<double>(run.run->truth().time_ns()[0]);
      if (now_s >= until_s || !run.cycle->step()) return most;
      if (now_s < from_s || run.cycle->phase() != RunPhase::kRunning) continue;
      for (std::size_t j = 0; j < run.experiment->robot.joints.size(); ++j) {
        const double error =
            run.run->command().position_rad()[j] - run.run->truth().position_rad()[j];
        most = std::max(most, std::abs(error));
      }
    }
  }
};

TEST(PlantChanges, AreSeenByComputedTorqueWhileTheHandHoldsWhatItDoesNotKnow) {
  BundledRun run("panda", "payload");
  Watch watch{run};
  const double before = watch.error_rad(2.5, 4.9);
  const double holding = watch.error_rad(5.5, 8.9);
  const double after = watch.error_rad(10.0, 12.0);
  std::printf("error: %.4f, with 1.6 kg %.4f, after it %.4f rad\n", before, holding, after);
  EXPECT_GT(holding, 3.0 * before);
  EXPECT_LT(after, 1.5 * before);
  EXPECT_EQ(run.run->kernels().mass_kg, BundledRun("panda", "hold").run->kernels().mass_kg);
}

TEST(PlantChanges, CanBeWoundBackOverAPickUpAndADrop) {
  BundledRun run("panda", "payload", {.change = [](Experiment& e) {
                   auto plant = std::make_shared<sim::PlantChanges>(*e.plant);
                   plant->carried[0].start_ns = 1'500'000'000;
                   plant->carried[0].duration_ns = 200'000'000;
                   e.plant = plant;
                 }});
  run.run_to(RunPhase::kRunning);
  while (run.run->truth().time_ns()[0] < 1'400'000'000) run.steps(1);
  const auto saved = run.cycle->save();
  ASSERT_TRUE(saved) << saved.error().to_string();
  const std::vector<std::byte> first = run.bytes(200);  // it is in the hand
  const auto held = run.cycle->save();
  const std::vector<std::byte> second = run.bytes(300);
  ASSERT_TRUE(run.cycle->restore(*held));
  EXPECT_EQ(run.bytes(300), second);
  ASSERT_TRUE(run.cycle->restore(*saved));
  EXPECT_EQ(run.bytes(200), first);
  EXPECT_EQ(run.bytes(300), second);
}

/// [sim] of an experiment, for one that is read already.
std::shared_ptr<const sim::PlantChanges> changes(const Experiment& e, const std::string& text) {
  const auto document = TomlDocument::parse(text, "x.toml");
  auto plant =
      read_plant_changes(document->root().table("sim"), e.robot, e.description.get(), e.files);
  for (const Error& error : document->diagnostics()) ADD_FAILURE() << error.to_string();
  return plant;
}

// The observer knows the described robot: what hangs at the hand is a force there.
TEST(PlantChanges, AreAForceToTheEstimator) {
  EstimatedRun run(
      "panda", "hold",
      {.noise = false,
       .estimation = {.observer = estimation::ObserverConfig{}, .wrenches = {{.site = "hand"}}},
       .change = [](Experiment& e) {
         e.plant = changes(e,
                           "[[sim.payload]]\nname = 'box'\nsite = 'hand'\nmass_kg = 1.6\n"
                           "from_s = 3.0\n");
       }});
  run.run_to(RunPhase::kRunning);
  const auto force = [&] { return run.estimate().external_force_N(); };
  while (run.time_s() < 2.95) run.steps(1);
  EXPECT_NEAR(force()[2], 0.0, 0.3);
  while (run.time_s() < 4.5) run.steps(1);
  std::printf("force at the hand: %.2f %.2f %.2f N\n", force()[0], force()[1], force()[2]);
  EXPECT_NEAR(force()[0], 0.0, 0.3);
  EXPECT_NEAR(force()[1], 0.0, 0.3);
  EXPECT_NEAR(force()[2], -1.6 * 9.81, 0.3);
}

// What is wrong with its encoder a joint does not know.
TEST(PlantChanges, PutAJointWhereItsEncoderDoesNotSay) {
  EstimatedRun run("panda", "hold", {.noise = false, .change = [](Experiment& e) {
                                       e.plant = changes(
                                           e, "[sim.joint.panda_joint2]\nzero_error_rad = 0.02\n");
                                     }});
  run.run_to(RunPhase::kRunning);
  run.steps(1000);
  const double read = run.run->state().position_rad()[1];
  EXPECT_NEAR(read - run.truth().position_rad()[1], 0.02, 1e-4);
  EXPECT_NEAR(run.run->state().position_rad()[0], run.truth().position_rad()[0], 1e-4);
}

}  // namespace
}  // namespace tandem::runtime
