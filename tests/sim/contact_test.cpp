#include "hal/sim/contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hal/sim/plant.hpp"
#include "tests/sim/hand_kernels.hpp"

namespace tandem::sim {
namespace {

using test::block_kernels;
using test::kBlockMass;
using test::kG;

hal::ContactConfig ground(double static_friction, double sliding_friction) {
  hal::ContactConfig c;
  c.stiffness_N_m = 20'000.0;
  c.damping_s_m = 3.0;
  c.tangential_stiffness_N_m = 20'000.0;
  c.tangential_damping_Ns_m = 50.0;
  c.static_friction = static_friction;
  c.sliding_friction = sliding_friction;
  const std::vector<std::array<double, 3>> corners{
      {0.2, 0.05, 0.0}, {0.2, -0.05, 0.0}, {-0.2, -0.05, 0.0}, {-0.2, 0.05, 0.0}};
  c.feet = {{"left", corners}, {"right", corners}};
  return c;
}

Plant block_on(const tandem_kernels* kernels, const hal::ContactConfig& contact, double height_m,
               Integrator integrator = Integrator::kRungeKutta4, std::int64_t step = 500'000) {
  PlantConfig config;
  config.kernels = kernels;
  config.contact = contact;
  config.base_height_m = height_m;
  config.integrator = integrator;
  config.substep_ns = step;
  Result<Plant> plant = Plant::create(config);
  EXPECT_TRUE(plant) << plant.error().to_string();
  return std::move(*plant);
}

// What eight points of 20 kN/m carry a 10 kg block with.
constexpr double kSag = kBlockMass * kG / (8 * 20'000.0);

double contact_force_z(Plant& plant) {
  plant.evaluate();
  const auto W = plant.contact().wrench_W();
  return W[2] + W[8];
}

class BothIntegrators : public testing::TestWithParam<Integrator> {};

hal::GroundPatch patch(double from_m, double to_m, double friction, double share = 1.0) {
  return {.name = "patch",
          .x_m = {from_m, to_m},
          .y_m = {-1.0, 1.0},
          .static_friction = friction,
          .sliding_friction = friction,
          .stiffness_share = share};
}

// Ice under the block is as a whole ground of ice, to the bit; ice elsewhere is none.
TEST(GroundPatch, CountsWhereItIsAlone) {
  const auto slid = [](const hal::ContactConfig& contact) {
    Plant plant = block_on(block_kernels<10>(), contact, 0.05);
    EXPECT_EQ(plant.advance(500'000'000), Code::kOk);
    return plant.q()[0];
  };
  hal::ContactConfig icy = ground(0.9, 0.8);
  icy.patches = {patch(5.0, 9.0, 0.5), patch(-2.0, 4.0, 0.05), patch(-2.0, 4.0, 0.7)};
  EXPECT_EQ(slid(icy), slid(ground(0.05, 0.05)));
  EXPECT_GT(slid(icy), 0.1);
  icy.patches = {patch(5.0, 9.0, 0.05)};
  EXPECT_EQ(slid(icy), slid(ground(0.9, 0.8)));
  EXPECT_LT(slid(icy), 0.01);
}

TEST(GroundPatch, IsSofterByItsShare) {
  hal::ContactConfig soft = ground(0.9, 0.8);
  soft.patches = {patch(-1.0, 1.0, 0.9, 0.25)};
  Plant plant = block_on(block_kernels<0>(), soft, 0.05);
  ASSERT_EQ(plant.advance(6'000'000'000), Code::kOk);
  EXPECT_NEAR(plant.q()[2], 0.05 - 4.0 * kSag, 1e-9);
}

TEST_P(BothIntegrators, RestingBlockCarriesItsWeightAndStandsStill) {
  Plant plant = block_on(block_kernels<0>(), ground(0.9, 0.8), 0.05, GetParam());
  ASSERT_EQ(plant.advance(3'000'000'000), Code::kOk);
  EXPECT_NEAR(contact_force_z(plant), kBlockMass * kG, 1e-9);
  EXPECT_NEAR(plant.q()[2], 0.05 - kSag, 1e-12);
  const std::array<double, 3> before{plant.q()[0], plant.q()[1], plant.q()[2]};
  ASSERT_EQ(plant.advance(10'000'000'000), Code::kOk);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(plant.q()[i], before[i], 1e-12);
}

TEST_P(BothIntegrators, StickingBlockOnAnInclineDoesNotCreep) {
  Plant plant = block_on(block_kernels<30>(), ground(0.9, 0.8), 0.05, GetParam());
  ASSERT_EQ(plant.advance(5'000'000'000), Code::kOk);
  const double before = plant.q()[0];
  ASSERT_EQ(plant.advance(30'000'000'000), Code::kOk);
  EXPECT_NEAR(plant.q()[0], before, 1e-10);  // [m] in 30 s
  plant.evaluate();
  const auto W = plant.contact().wrench_W();
  EXPECT_NEAR(W[0] + W[6], -kBlockMass * kG * 0.5, 1e-6);
}

TEST_P(BothIntegrators, SlidingBlockDeceleratesAtMuG) {
  Plant plant = block_on(block_kernels<0>(), ground(0.4, 0.4), 0.05 - kSag, GetParam());
  std::array<double, 7> q{0, 0, 0.05 - kSag, 0, 0, 0, 1};
  std::array<double, 6> v{2.0, 0, 0, 0, 0, 0};
  plant.set_state(q, v);
  ASSERT_EQ(plant.advance(100'000'000), Code::kOk);  // pitch has settled
  const double start = plant.v()[0], x = plant.q()[0];
  ASSERT_EQ(plant.advance(300'000'000), Code::kOk);
  EXPECT_NEAR((start - plant.v()[0]) / 0.3, 0.4 * kG, 1e-3 * kG);
  EXPECT_NEAR(plant.q()[0] - x, 0.5 * (start + plant.v()[0]) * 0.3, 5e-4);  // half a step: 0.3 mm
  ASSERT_EQ(plant.advance(2'000'000'000), Code::kOk);
  EXPECT_NEAR(plant.v()[0], 0.0, 1e-6);  // and stops
}

INSTANTIATE_TEST_SUITE_P(Contact, BothIntegrators,
                         testing::Values(Integrator::kLeapfrog, Integrator::kRungeKutta4));

TEST(Contact, SteepInclineIsSlidDownAtTheRateOfTheCone) {
  Plant plant = block_on(block_kernels<40>(), ground(0.5, 0.4), 0.05);
  ASSERT_EQ(plant.advance(500'000'000), Code::kOk);
  const double start = plant.v()[0];
  ASSERT_EQ(plant.advance(500'000'000), Code::kOk);
  const double slope = 40.0 * std::numbers::pi / 180.0;
  const double wanted = kG * (std::sin(slope) - 0.4 * std::cos(slope));
  EXPECT_NEAR((plant.v()[0] - start) / 0.5, wanted, 2e-3 * kG);
}

// An incline of 31 degrees, with friction that just holds and just does not.
TEST_P(BothIntegrators, ConeHoldsAt98PercentAndLetsGoAt102) {
  const double slope = 31.0 * std::numbers::pi / 180.0;
  const double holds = std::tan(slope) / 0.98, lets_go = std::tan(slope) / 1.02;
  Plant still = block_on(block_kernels<31>(), ground(holds, holds), 0.05, GetParam(), 250'000);
  ASSERT_EQ(still.advance(5'000'000'000), Code::kOk);
  const double before = still.q()[0];
  ASSERT_EQ(still.advance(10'000'000'000), Code::kOk);
  EXPECT_NEAR(still.q()[0], before, 1e-10);
  Plant sliding =
      block_on(block_kernels<31>(), ground(lets_go, lets_go), 0.05, GetParam(), 250'000);
  ASSERT_EQ(sliding.advance(2'000'000'000), Code::kOk);
  const double start = sliding.v()[0];
  ASSERT_EQ(sliding.advance(2'000'000'000), Code::kOk);
  const double wanted = kG * (std::sin(slope) - lets_go * std::cos(slope));
  EXPECT_NEAR((sliding.v()[0] - start) / 2.0, wanted, 1e-5 * wanted);
}

TEST(Contact, DropNeverGainsEnergy) {
  hal::ContactConfig contact = ground(0.9, 0.8);
  Plant plant = block_on(block_kernels<0>(), contact, 0.35, Integrator::kRungeKutta4, 20'000);
  // Tilted, so that it lands on one corner, turns and slides.
  const double half = 0.15;
  plant.set_state(std::array<double, 7>{0, 0, 0.35, std::sin(half) * 0.8, std::sin(half) * 0.6, 0,
                                        std::cos(half)},
                  std::array<double, 6>{0.3, 0, 0, 0, 0, 0.5});
  const auto energy = [&] {
    plant.evaluate();
    double kp[2];
    plant.kernels().energy(plant.q(), plant.v(), kp);
    return kp[0] + kp[1] + plant.contact().elastic_energy_J();
  };
  const double start = energy();
  double last = start;
  for (int k = 0; k < 50'000; ++k) {
    ASSERT_EQ(plant.advance(20'000), Code::kOk);
    const double now = energy();
    ASSERT_LE(now, last + 1e-7 * start) << "after " << k * 20e-6 << " s";
    last = now;
  }
  EXPECT_LT(last, 0.3 * start);
}

TEST(Contact, ReboundsOfAFlatDropGetLower) {
  for (const Integrator integrator : {Integrator::kLeapfrog, Integrator::kRungeKutta4}) {
    Plant plant = block_on(block_kernels<0>(), ground(0.9, 0.8), 0.15, integrator);
    double apex = 0.15;
    for (int bounce = 0; bounce < 3; ++bounce) {
      while (plant.v()[2] <= 0.0) ASSERT_EQ(plant.advance(500'000), Code::kOk);
      while (plant.v()[2] > 0.0) ASSERT_EQ(plant.advance(500'000), Code::kOk);
      EXPECT_LT(plant.q()[2], apex);
      apex = plant.q()[2];
    }
  }
}

// One foot alone, to look at single points.
struct OneFoot {
  explicit OneFoot(const hal::ContactConfig& config, std::vector<std::array<double, 3>> points)
      : contact(*Contact::create(config, {{0, 0, std::move(points)}})) {}
  std::array<double, 12> pose{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  std::array<double, 6> twist{};
  std::array<double, 6> wrench{};
  Contact contact;
};

TEST(Contact, NeverPulls) {
  OneFoot foot(ground(0.9, 0.8), {{0.0, 0.0, 0.0}});
  foot.pose[11] = -0.001;
  foot.twist[2] = 10.0;  // out of the ground faster than 1 / damping
  foot.contact.evaluate(foot.pose.data(), foot.twist.data(), true, foot.wrench.data());
  EXPECT_EQ(foot.wrench[2], 0.0);
  EXPECT_EQ(std::hypot(foot.wrench[0], foot.wrench[1]), 0.0);
  foot.twist[2] = -0.1;  // going in: elastic and damping add up
  foot.contact.evaluate(foot.pose.data(), foot.twist.data(), true, foot.wrench.data());
  EXPECT_NEAR(foot.wrench[2], 20'000.0 * 0.001 * (1.0 + 3.0 * 0.1), 1e-12);
  foot.pose[11] = 0.001;  // above the ground
  foot.contact.evaluate(foot.pose.data(), foot.twist.data(), true, foot.wrench.data());
  EXPECT_EQ(foot.wrench[2], 0.0);
}

TEST(Contact, WrenchIsInTheSitesFrameAboutItsOrigin) {
  OneFoot foot(ground(0.9, 0.8), {{0.1, 0.03, 0.0}});
  // Turned by 90 degrees about z: the site's x is W's y.
  foot.pose = {0, -1, 0, 1, 0, 0, 0, 0, 1, 0.5, 0.2, -0.001};
  foot.contact.evaluate(foot.pose.data(), foot.twist.data(), true, foot.wrench.data());
  foot.pose[9] += 0.0002;  // W's +x: the anchor pulls back along W's -x, the site's +y
  foot.contact.evaluate(foot.pose.data(), foot.twist.data(), true, foot.wrench.data());
  const double normal = 20.0, pull = 4.0;
  const double expected[6] = {0.0, pull, normal, 0.03 * normal, -0.1 * normal, 0.1 * pull};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(foot.wrench[i], expected[i], 1e-12) << i;
  // The same in W's axes: R times each half.
  const double expected_W[6] = {-pull, 0.0, normal, 0.1 * normal, 0.03 * normal, 0.1 * pull};
  const auto W = foot.contact.wrench_W();
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(W[i], expected_W[i], 1e-12) << i;
}

TEST(Contact, TwistOfTheSiteMovesItsPoints) {
  OneFoot foot(ground(0.9, 0.8), {{0.1, 0.0, 0.0}});
  foot.pose[11] = -0.001;
  foot.twist[4] = 0.5;  // about +y: a point at +x goes down with 0.05 m/s
  foot.contact.evaluate(foot.pose.data(), foot.twist.data(), true, foot.wrench.data());
  EXPECT_NEAR(foot.wrench[2], 20.0 * (1.0 + 3.0 * 0.05), 1e-12);
}

TEST(Contact, AnchorMovesOnlyWhenAskedTo) {
  OneFoot foot(ground(0.5, 0.5), {{0.0, 0.0, 0.0}});
  foot.pose[11] = -0.001;
  const auto evaluate = [&](bool move) {
    foot.contact.evaluate(foot.pose.data(), foot.twist.data(), move, foot.wrench.data());
    return foot.wrench[0];
  };
  EXPECT_EQ(evaluate(true), 0.0);
  foot.pose[9] = 0.01;  // far outside the cone of 10 N / 20 kN/m
  EXPECT_NEAR(evaluate(false), -10.0, 1e-12);
  foot.pose[9] = 0.0;
  EXPECT_EQ(evaluate(false), 0.0);  // the stage left no trace
  foot.pose[9] = 0.01;
  EXPECT_NEAR(evaluate(true), -10.0, 1e-12);
  foot.pose[9] = 0.01 - 0.0005;
  EXPECT_NEAR(evaluate(true), 0.0, 1e-9);  // the anchor was dragged along
}

TEST(Contact, BadParametersAreNamed) {
  hal::ContactConfig config = ground(0.5, 0.9);
  const Result<Contact> contact = Contact::create(config, {{0, 0, {{0.0, 0.0, 0.0}}}});
  ASSERT_FALSE(contact);
  EXPECT_EQ(contact.error().key, "contact.static_friction");
  config = ground(0.9, 0.9);
  config.stiffness_N_m = 0.0;
  EXPECT_FALSE(Contact::create(config, {{0, 0, {{0.0, 0.0, 0.0}}}}));
  EXPECT_TRUE(Contact::create(config, {}));  // a robot without feet needs no ground
}

}  // namespace
}  // namespace tandem::sim
