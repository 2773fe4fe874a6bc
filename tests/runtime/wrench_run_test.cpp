// The wrench that the loop estimates at a hand which is pushed with a known force.
#include <array>

#include "base/own_system_call.hpp"
#include "hal/sim/setup.hpp"
#include "model/interpreted_kernels.hpp"
#include "model/mechanism.hpp"
#include "rt/scoped_realtime.hpp"
#include "tests/runtime/estimated_run.hpp"

namespace tandem::runtime {
namespace {

using Six = std::array<double, 6>;

struct Hand {
  const char* robot;
  const char* experiment;
  const char* site;
  const char* joint;           ///< whose link is pushed
  std::array<double, 3> at_m;  ///< there, in the link's frame
  std::array<double, 3> force_N;
};
const Hand kPanda{"panda", "hold", "hand", "panda_joint7", {0, 0, 0.107}, {12.0, -20.0, 15.0}};
const Hand kUr5e{"ur5e", "hold", "tool0", "wrist_3_joint", {0, 0, 0}, {12.0, -20.0, 15.0}};

struct Seen {
  Six mean{}, worst{};  ///< of force and moment; |value - true force, or 0|
  double unexplained_Nm = 0.0;
};

/// From 0.3 s after the push begins, a second long.
/// @param beside  an estimator of the test's own, in place of the run's: outside of the cycle
Seen watch(EstimatedRun& run, const Hand& hand, estimation::Estimator* beside = nullptr) {
  Seen seen;
  const hal::EstimateImage& estimate = beside == nullptr ? run.estimate() : beside->image();
  const auto step = [&] {
    const bool more = run.cycle->step();
    if (beside != nullptr) {
      TANDEM_OWN_SYSTEM_CALL;  // its kernels are interpreted and take heap
      beside->update(run.cycle->state());
    }
    return more;
  };
  const auto pushed = [&] { return run.backend->robot().faults()[0].active != 0; };
  while (!pushed() && step()) {
  }
  for (int i = 0; i < 300; ++i) step();
  constexpr int kCycles = 1000;
  for (int i = 0; i < kCycles; ++i) {
    step();
    for (std::size_t k = 0; k < 6; ++k) {
      const double value =
          k < 3 ? estimate.external_force_N()[k] : estimate.external_moment_Nm()[k - 3];
      seen.mean[k] += value / kCycles;
      seen.worst[k] = std::max(seen.worst[k], std::abs(value - (k < 3 ? hand.force_N[k] : 0.0)));
    }
    seen.unexplained_Nm = std::max(seen.unexplained_Nm, estimate.unexplained_torque_Nm()[0]);
  }
  EXPECT_TRUE(pushed());
  std::printf("%s: mean", hand.robot);
  for (const double value : seen.mean) std::printf(" %.2f", value);
  std::printf("; worst error");
  for (const double value : seen.worst) std::printf(" %.2f", value);
  std::printf("; not explained %.2f Nm\n", seen.unexplained_Nm);
  return seen;
}

struct Bounds {
  double mean_N, worst_N, mean_Nm, worst_Nm;
};
void expect_near(const Seen& seen, const Hand& hand, const Bounds& bounds) {
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_NEAR(seen.mean[k], k < 3 ? hand.force_N[k] : 0.0, k < 3 ? bounds.mean_N : bounds.mean_Nm)
        << k;
    EXPECT_LT(seen.worst[k], k < 3 ? bounds.worst_N : bounds.worst_Nm) << k;
  }
}

sim::Fault push_of(const hal::RobotConfig& robot, const Hand& hand) {
  return push_on(robot, hand.joint, hand.force_N, 3.0, 2.0, hand.at_m);
}

EstimatedRun::Options options_of(const Hand& hand) {
  return {
      .estimation = {.observer = estimation::ObserverConfig{}, .wrenches = {{.site = hand.site}}},
      .change = [](Experiment& e) { e.duration_s = 5.0; }};
}

class Wrench : public testing::TestWithParam<const Hand*> {};
INSTANTIATE_TEST_SUITE_P(Hands, Wrench, testing::Values(&kPanda, &kUr5e),
                         [](const auto& test) { return std::string(test.param->robot); });

TEST_P(Wrench, AtThePushedHandIsThePush) {
  const Hand& hand = *GetParam();
  EstimatedRun run(hand.robot, hand.experiment, options_of(hand));
  ASSERT_EQ(run.backend->robot().inject(push_of(run.experiment->robot, hand)), Code::kOk);
  const Seen seen = watch(run, hand);
  expect_near(seen, hand, {.mean_N = 0.2, .worst_N = 3.0, .mean_Nm = 0.05, .worst_Nm = 0.5});
  EXPECT_LT(seen.unexplained_Nm, 0.5);
}

// COMAN has no site at its hands, and what is not declared costs nothing. So the estimator's model
// has one more; the simulation's is the shipped one.
TEST(WrenchOfComan, AtTheHandOfComansArmIsThePush) {
  const Hand hand{"coman", "hold", "hand", "LWrj2", {0, 0, -0.08}, {12.0, -20.0, 15.0}};
  auto read = read_robot(std::string(TANDEM_SOURCE_DIR) + "/config/coman/robot.toml");
  ASSERT_TRUE(read);
  const model::Tree& tree = read->description.tree;
  model::ModelSpec spec = tandem::sim::model_spec(read->config);
  const std::string link = tree.links[tree.child_link_index(hand.joint)].name;
  spec.sites.push_back({.name = hand.site, .link = link, .xyz_m = hand.at_m});
  const model::InterpretedKernels model(*model::make_mechanism(tree, spec));
  estimation::EstimationConfig config = options_of(hand).estimation;
  config.base = for_legs().base;
  auto beside =
      estimation::Estimator::make(hal::robot_of(read->config), model.get(), config, 1'000'000);
  ASSERT_TRUE(beside) << beside.error().to_string();
  EstimatedRun run(hand.robot, hand.experiment,
                   {.change = [](Experiment& e) { e.duration_s = 5.0; }});
  ASSERT_EQ(run.backend->robot().inject(push_of(run.experiment->robot, hand)), Code::kOk);
  const Seen seen = watch(run, hand, beside->get());
  expect_near(seen, hand, {.mean_N = 1.0, .worst_N = 7.0, .mean_Nm = 0.1, .worst_Nm = 0.7});
}

}  // namespace
}  // namespace tandem::runtime
