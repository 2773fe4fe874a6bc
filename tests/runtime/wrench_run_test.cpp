// The wrench that the loop estimates at a hand which is pushed with a known force.
#include <array>

#include "tests/runtime/estimated_run.hpp"

namespace tandem::runtime {
namespace {

using Six = std::array<double, 6>;

struct Hand {
  const char* robot;
  const char* file;  ///< the robot's
  const char* site;
  const char* joint;           ///< whose link is pushed
  std::array<double, 3> at_m;  ///< there, in the link's frame: the site's origin
  std::array<double, 3> force_N = {12.0, -20.0, 15.0};

  /// Component `k` of force and moment.
  [[nodiscard]] double truth(std::size_t k) const { return k < 3 ? force_N[k] : 0.0; }
};
const Hand kPanda{"panda", "robot.toml", "hand", "panda_joint7", {0, 0, 0.107}};
const Hand kUr5e{"ur5e", "robot.toml", "tool0", "wrist_3_joint", {0, 0, 0}};
const Hand kComan{"coman", "robot_hands.toml", "l_hand", "LWrj2", {0, 0, -0.07}};

/// Over the cycles of all seeds; of force and moment along each axis.
struct Seen {
  Six sum{}, squares{}, worst{};  ///< of the estimate; of its errors: squared, absolute
  double unexplained_Nm = 0.0;
  int cycles = 0;

  void take(const hal::EstimateImage& estimate, const Hand& hand) {
    for (std::size_t k = 0; k < 6; ++k) {
      const double value =
          k < 3 ? estimate.external_force_N()[k] : estimate.external_moment_Nm()[k - 3];
      const double error = value - hand.truth(k);
      sum[k] += value;
      squares[k] += error * error;
      worst[k] = std::max(worst[k], std::abs(error));
    }
    unexplained_Nm = std::max(unexplained_Nm, estimate.unexplained_torque_Nm()[0]);
    ++cycles;
  }
  [[nodiscard]] double mean(std::size_t k) const { return sum[k] / cycles; }
  [[nodiscard]] double rms(std::size_t k) const { return std::sqrt(squares[k] / cycles); }
};

/// Stands still and is pushed for 2 s; of these a second, from 0.3 s after it begins. All of it in
/// the cycle, under the traps.
void watch(const Hand& hand, std::uint64_t seed, Seen& seen) {
  const bool floats = hand.robot == kComan.robot;
  estimation::EstimationConfig config = floats ? for_legs() : estimation::EstimationConfig{};
  config.observer = estimation::ObserverConfig{};
  config.wrenches = {{.site = hand.site}};
  EstimatedRun run(hand.robot, "hold",
                   {.seed = seed, .noise = false, .estimation = config, .change = [&](auto& e) {
                      const std::string folder = std::string(TANDEM_SOURCE_DIR) + "/config/";
                      auto read = robot::read_complete_robot(folder + hand.robot + "/" + hand.file);
                      e.robot = std::move(read->config);
                      e.description =
                          std::make_shared<const model::UrdfModel>(std::move(read->description));
                      add_noise(e.robot);
                      e.duration_s = 5.0;
                    }});
  ASSERT_EQ(run.backend->robot().inject(
                push_on(run.experiment->robot, hand.joint, hand.force_N, 3.0, 2.0, hand.at_m)),
            Code::kOk);
  run.run_to_fault();
  const std::int64_t pushed_ns = run.estimate().time_ns()[0];
  for (int i = 0; i < 1300; ++i) {
    ASSERT_TRUE(run.cycle->step());
    if (i >= 300) seen.take(run.estimate(), hand);
  }
  EXPECT_NE(run.backend->robot().faults()[0].active, 0);
  const Peak peak = run.cycle->statistics().estimate().wrenches.at(0).force_N;
  EXPECT_GT(peak.value, 27.0) << "27.7 N and some noise";
  EXPECT_GE(peak.time_ns, pushed_ns);
}

struct Bounds {
  double mean_N, rms_N, mean_Nm, rms_Nm;
};
class Wrench : public testing::TestWithParam<std::pair<const Hand*, Bounds>> {};
INSTANTIATE_TEST_SUITE_P(Hands, Wrench,
                         testing::Values(std::pair{&kPanda, Bounds{0.2, 0.8, 0.05, 0.15}},
                                         std::pair{&kUr5e, Bounds{0.2, 0.8, 0.05, 0.15}},
                                         std::pair{&kComan, Bounds{1.0, 2.0, 0.1, 0.2}}),
                         [](const auto& test) { return std::string(test.param.first->robot); });

TEST_P(Wrench, AtThePushedHandIsThePush) {
  const auto& [hand, bounds] = GetParam();
  Seen seen;
  for (const std::uint64_t seed : {1, 2, 3, 4, 5}) watch(*hand, seed, seen);
  ASSERT_EQ(seen.cycles, 5000);
  for (std::size_t k = 0; k < 6; ++k) {
    std::printf("%s %s %c: mean %.2f, rms error %.2f, worst %.2f\n", hand->robot,
                k < 3 ? "force" : "moment", "xyz"[k % 3], seen.mean(k), seen.rms(k), seen.worst[k]);
    EXPECT_NEAR(seen.mean(k), hand->truth(k), k < 3 ? bounds.mean_N : bounds.mean_Nm) << k;
    EXPECT_LT(seen.rms(k), k < 3 ? bounds.rms_N : bounds.rms_Nm) << k;
  }
  std::printf("%s: not explained %.2f Nm at most\n", hand->robot, seen.unexplained_Nm);
}

}  // namespace
}  // namespace tandem::runtime
