// Ground that is inclined, stepped, bumpy or moves: figures by hand, and energy.
#include "hal/config/terrain.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "hal/config/terrain_grid.hpp"
#include "hal/sim/plant.hpp"
#include "tests/sim/hand_kernels.hpp"

namespace tandem::sim {
namespace {

using hal::GroundShapeKind;
using test::kBlockMass;
using test::kG;

constexpr double kDeg = std::numbers::pi / 180.0;

hal::ContactConfig gripping(double friction) {
  hal::ContactConfig c;
  c.stiffness_N_m = 20'000.0;
  c.damping_s_m = 3.0;
  c.tangential_stiffness_N_m = 20'000.0;
  c.tangential_damping_Ns_m = 50.0;
  c.static_friction = c.sliding_friction = friction;
  const std::vector<std::array<double, 3>> corners{
      {0.2, 0.05, 0.0}, {0.2, -0.05, 0.0}, {-0.2, -0.05, 0.0}, {-0.2, 0.05, 0.0}};
  c.feet = {{"left", corners}, {"right", corners}};
  return c;
}

hal::GroundShape incline(double slope_deg, double towards_deg) {
  return {.name = "slope",
          .kind = GroundShapeKind::kSlope,
          .slope_rad = slope_deg * kDeg,
          .towards_rad = towards_deg * kDeg};
}

Plant block(const hal::ContactConfig& contact, Integrator integrator = Integrator::kRungeKutta4,
            std::int64_t step_ns = 500'000) {
  PlantConfig config;
  config.kernels = test::block_kernels<0>();
  config.contact = contact;
  config.base_height_m = 0.05;
  config.integrator = integrator;
  config.substep_ns = step_ns;
  Result<Plant> plant = Plant::create(config);
  EXPECT_TRUE(plant) << plant.error().to_string();
  return std::move(*plant);
}

double energy_J(Plant& plant) {
  plant.evaluate();
  double kp[2];
  plant.kernels().energy(plant.q(), plant.v(), kp);
  return kp[0] + kp[1] + plant.contact().elastic_energy_J();
}

/// Lies on the plane that rises by `slope` towards `towards`, with a velocity up it.
void lay(Plant& plant, double slope, double towards, double up_m_s) {
  // Turned about the horizontal axis across the slope.
  const double half = -0.5 * slope;
  const double axis_x = -std::sin(towards), axis_y = std::cos(towards);
  const double height = 0.05 - kBlockMass * kG * std::cos(slope) / (8 * 20'000.0);
  const std::array<double, 3> up{-std::sin(slope) * std::cos(towards),
                                 -std::sin(slope) * std::sin(towards), std::cos(slope)};
  plant.set_state(
      std::array<double, 7>{height * up[0], height * up[1], height * up[2], axis_x * std::sin(half),
                            axis_y * std::sin(half), 0, std::cos(half)},
      std::array<double, 6>{up_m_s, 0, 0, 0, 0, 0});
}

class Slopes : public testing::TestWithParam<Integrator> {};

// tan 30 degrees is 0.577.
TEST_P(Slopes, BelowTheConeABlockStays) {
  hal::ContactConfig contact = gripping(0.6);
  contact.terrain.add(incline(30.0, 0.0));
  Plant plant = block(contact, GetParam());
  lay(plant, 30.0 * kDeg, 0.0, 0.0);
  ASSERT_EQ(plant.advance(5'000'000'000), Code::kOk);
  const double x = plant.q()[0], z = plant.q()[2];
  ASSERT_EQ(plant.advance(10'000'000'000), Code::kOk);
  EXPECT_NEAR(plant.q()[0], x, 1e-10);
  EXPECT_NEAR(plant.q()[2], z, 1e-10);
  plant.evaluate();
  const auto W = plant.contact().wrench_W();
  EXPECT_NEAR(W[2] + W[8], kBlockMass * kG, 1e-6);  // the whole force is upright
  EXPECT_NEAR(W[0] + W[6], 0.0, 1e-6);
}

TEST_P(Slopes, AboveItABlockSlidesAtTheRateOfTheCone) {
  for (const double towards_deg : {0.0, 90.0, 213.0}) {
    hal::ContactConfig contact = gripping(0.4);
    contact.terrain.add(incline(40.0, towards_deg));
    Plant plant = block(contact, GetParam());
    lay(plant, 40.0 * kDeg, towards_deg * kDeg, 0.0);
    ASSERT_EQ(plant.advance(300'000'000), Code::kOk);
    const std::array<double, 3> start{plant.v()[0], plant.v()[1], plant.v()[2]};
    const double spin = plant.v()[5];
    ASSERT_EQ(plant.advance(500'000'000), Code::kOk);
    EXPECT_NEAR(spin, 0.0, 1e-3);
    double speed2 = 0.0;
    for (std::size_t i = 0; i < 3; ++i) speed2 += std::pow(plant.v()[i] - start[i], 2);
    // 9.81 (sin 40 - 0.4 cos 40) = 3.29984
    EXPECT_NEAR(std::sqrt(speed2) / 0.5, 3.29984, 0.01) << towards_deg;
  }
}

INSTANTIATE_TEST_SUITE_P(Terrain, Slopes,
                         testing::Values(Integrator::kLeapfrog, Integrator::kRungeKutta4));

// Acceleration from force, and force from acceleration.
TEST(Terrain, ForwardDynamicsAndInverseAgreeWithItsForce) {
  hal::ContactConfig contact = gripping(0.4);
  contact.terrain.add(incline(25.0, 30.0));
  Plant plant = block(contact);
  lay(plant, 25.0 * kDeg, 30.0 * kDeg, 0.0);
  ASSERT_EQ(plant.advance(200'000'000), Code::kOk);
  plant.evaluate();
  std::array<double, 6> tau{};
  plant.kernels().inverse_dynamics_at(plant.sines(), plant.q(), plant.v(), plant.vdot(),
                                      plant.wrench(), tau.data());
  for (const double value : tau) EXPECT_NEAR(value, 0.0, 1e-9);
}

/// The derivatives are those of the height, and no place is steeper than it says.
TEST(Terrain, HeightIsContinuousAndItsDerivativesAreIts) {
  std::mt19937 random(46);
  std::uniform_real_distribution<double> anywhere(-1.5, 2.5);
  const std::array<double, 2> x{-0.3, 1.2}, y{-0.5, 0.7};
  for (const hal::GroundShape& shape :
       {hal::GroundShape{"a", GroundShapeKind::kSlope, x, y, 0.0, 0.2, 0.7, 0.3},
        hal::GroundShape{"b", GroundShapeKind::kStep, x, y, 0.15, 0.0, 0.0, 0.25},
        hal::GroundShape{"c", GroundShapeKind::kBump, x, y, -0.1}}) {
    hal::Terrain terrain;
    terrain.add(shape);
    EXPECT_FALSE(terrain.level());
    for (int i = 0; i < 2000; ++i) {
      const double at_x = anywhere(random), at_y = anywhere(random), h = 1e-6;
      const hal::Surface place = terrain.at(at_x, at_y);
      const auto height = [&](double dx, double dy) {
        return terrain.at(at_x + dx, at_y + dy).height_m;
      };
      EXPECT_NEAR(place.along_x, (height(h, 0) - height(-h, 0)) / (2 * h), 2e-6) << shape.name;
      EXPECT_NEAR(place.along_y, (height(0, h) - height(0, -h)) / (2 * h), 2e-6) << shape.name;
      EXPECT_LE(std::hypot(place.along_x, place.along_y), terrain.steepest()) << shape.name;
    }
  }
}

TEST(Terrain, HeightsAreThoseOfTheirShapes) {
  hal::Terrain terrain;
  terrain.add({"step", GroundShapeKind::kStep, {1.0, 2.0}, {-1.0, 1.0}, 0.08, 0.0, 0.0, 0.02});
  terrain.add({"bump", GroundShapeKind::kBump, {1.0, 3.0}, {-1.0, 1.0}, 0.04});
  terrain.add(incline(45.0, 90.0));
  EXPECT_NEAR(terrain.at(0.0, 0.0).height_m, 0.0, 1e-15);
  EXPECT_NEAR(terrain.at(1.5, 0.0).height_m, 0.08 + 0.02, 1e-12);  // half the bump's length
  EXPECT_NEAR(terrain.at(2.0, 0.0).height_m, 0.08 + 0.04, 1e-12);
  EXPECT_NEAR(terrain.at(2.5, 0.25).height_m, 0.02 * 0.5 * (1.0 + std::sqrt(0.5)) + 0.25, 1e-12);
  EXPECT_NEAR(terrain.at(1.5, 1.01).height_m, 0.04 + 1.01, 1e-12);  // half down the step's edge
  EXPECT_NEAR(terrain.at(5.0, -0.3).height_m, -0.3, 1e-12);
}

// A point without friction glides over a hill: its speed is that of a marble on a rail.
TEST(Terrain, NoFrictionNoDampingKeepsTheEnergy) {
  hal::ContactConfig contact = gripping(0.0);
  contact.damping_s_m = 0.0;
  contact.feet = {{"left", {{0.0, -0.1, 0.0}}}, {"right", {{0.0, 0.1, 0.0}}}};  // below its middle
  contact.terrain.add({"bump", GroundShapeKind::kBump, {0.5, 2.5}, {-5.0, 5.0}, 0.05});
  Plant plant = block(contact, Integrator::kRungeKutta4, 50'000);
  plant.set_state(std::array<double, 7>{0, 0, 0.05 - kBlockMass * kG / (2 * 20'000.0), 0, 0, 0, 1},
                  std::array<double, 6>{2.0, 0, 0, 0, 0, 0});
  const double start_J = energy_J(plant);
  double worst_J = 0.0, highest_m = 0.0;
  for (int i = 0; i < 700; ++i) {
    ASSERT_EQ(plant.advance(1'000'000), Code::kOk);
    worst_J = std::max(worst_J, std::abs(energy_J(plant) - start_J));
    highest_m = std::max(highest_m, plant.q()[2]);
  }
  EXPECT_GT(highest_m, 0.08);
  EXPECT_LT(worst_J, 1e-3);  // of 25 J
}

TEST(Terrain, ADropOnSlopesStepsAndBumpsNeverGainsEnergy) {
  for (const hal::GroundShape& shape :
       {incline(20.0, 40.0),
        hal::GroundShape{"b", GroundShapeKind::kStep, {0.1, 1.0}, {-1.0, 1.0}, 0.05},
        hal::GroundShape{"c", GroundShapeKind::kBump, {-0.5, 0.7}, {-0.6, 0.5}, 0.05}}) {
    hal::ContactConfig contact = gripping(0.8);
    contact.terrain.add(shape);
    Plant plant = block(contact, Integrator::kRungeKutta4, 20'000);
    const double half = 0.15;
    plant.set_state(std::array<double, 7>{0, 0, 0.35, std::sin(half) * 0.8, std::sin(half) * 0.6, 0,
                                          std::cos(half)},
                    std::array<double, 6>{0.3, 0, 0, 0, 0, 0.5});
    const double start = energy_J(plant);
    double last = start;
    for (int k = 0; k < 1500; ++k) {
      ASSERT_EQ(plant.advance(500'000), Code::kOk);
      const double now = energy_J(plant);
      ASSERT_LE(now, last + 2e-5 * start) << shape.name << " after " << k * 0.5 << " ms";
      last = now;
    }
    EXPECT_LT(last, 0.6 * start);
  }
}

/// Between the lines as a picture draws them.
double drawn(const hal::TerrainGrid& grid, double x, double y) {
  const auto place = [](const std::vector<double>& lines, double at) {
    const auto above = std::ranges::upper_bound(lines, at);
    const std::size_t i = std::clamp<std::ptrdiff_t>(above - lines.begin() - 1, 0,
                                                     static_cast<std::ptrdiff_t>(lines.size()) - 2);
    return std::pair(i, (at - lines[i]) / (lines[i + 1] - lines[i]));
  };
  const auto [i, u] = place(grid.x_m, x);
  const auto [j, v] = place(grid.y_m, y);
  const auto at = [&](std::size_t a, std::size_t b) {
    return grid.height_m[b * grid.x_m.size() + a];
  };
  return std::lerp(std::lerp(at(i, j), at(i + 1, j), u),
                   std::lerp(at(i, j + 1), at(i + 1, j + 1), u), v);
}

TEST(Terrain, IsDrawnAsItIsFeltWithFewLines) {
  hal::Terrain terrain;
  terrain.add(incline(5.0, 30.0));
  hal::GroundShape step{.name = "step", .kind = GroundShapeKind::kStep};
  step.x_m = {0.5, 1.5};
  step.y_m = {-1.0, 1.0};
  step.height_m = 0.1;
  terrain.add(step);
  hal::GroundShape bump{.name = "bump", .kind = GroundShapeKind::kBump};
  bump.x_m = {2.0, 14.0};
  bump.y_m = {-2.0, 2.0};
  bump.height_m = -0.2;
  terrain.add(bump);
  const hal::TerrainGrid grid = hal::grid_of(terrain);
  EXPECT_FALSE(grid.coarser);
  EXPECT_LT(grid.x_m.size(), 60U);
  EXPECT_EQ(grid.height_m.size(), grid.x_m.size() * grid.y_m.size());
  EXPECT_DOUBLE_EQ(grid.x_m.front(), -10.0);
  EXPECT_DOUBLE_EQ(grid.x_m.back(), 15.0) << "a metre beyond what is not everywhere";
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(-10.0, 15.0), y(-10.0, 10.0);
  for (int i = 0; i < 20'000; ++i) {
    const double at_x = x(random), at_y = y(random);
    ASSERT_NEAR(drawn(grid, at_x, at_y), terrain.at(at_x, at_y).height_m, 3e-3)
        << at_x << " " << at_y;
  }
}

TEST(Terrain, OfAThousandStepsIsDrawnCoarserAndBounded) {
  hal::Terrain terrain;
  for (int i = 0; i < 1000; ++i) {
    hal::GroundShape step{.name = "step", .kind = GroundShapeKind::kStep};
    step.x_m = {0.3 * i, 0.3 * i + 0.25};
    step.y_m = {-1e4, 1e4};
    step.height_m = 0.01;
    terrain.add(step);
  }
  const hal::TerrainGrid grid = hal::grid_of(terrain);
  EXPECT_TRUE(grid.coarser);
  EXPECT_LE(grid.x_m.size(), hal::TerrainGrid::kMostLines);
  EXPECT_GT(grid.x_m.size(), hal::TerrainGrid::kMostLines / 2);
  EXPECT_TRUE(std::ranges::is_sorted(grid.x_m));
  EXPECT_DOUBLE_EQ(grid.x_m.back(), hal::TerrainGrid::kMost_m);
  EXPECT_DOUBLE_EQ(grid.y_m.front(), -hal::TerrainGrid::kMost_m);
  EXPECT_DOUBLE_EQ(hal::grid_of({}).x_m.back(), hal::TerrainGrid::kLeast_m);
}

hal::GroundShake shake(std::size_t axis, double amplitude_m, double frequency_Hz) {
  hal::GroundShake shake{.name = "shake", .amplitude_m = amplitude_m, .frequency_Hz = frequency_Hz};
  shake.along[axis] = 1.0;
  return shake;
}

TEST(MovingGround, IsASineWithoutAJump) {
  hal::Terrain terrain;
  hal::GroundShake one = shake(1, 0.02, 2.0);
  one.from_s = 1.0;
  one.for_s = 3.0;
  terrain.add(one);
  for (const double t : {0.0, 1.0, 4.0, 9.0}) {
    EXPECT_EQ(terrain.motion_at(t).position_m[1], 0.0) << t;
    EXPECT_EQ(terrain.motion_at(t).velocity_m_s[1], 0.0) << t;
  }
  EXPECT_NEAR(terrain.motion_at(2.125).position_m[1], 0.02, 1e-15);
  EXPECT_NEAR(terrain.motion_at(2.0).velocity_m_s[1], 0.02 * 4.0 * std::numbers::pi, 1e-12);
  for (double t = 0.9; t < 4.2; t += 0.0137) {
    const double h = 1e-6;
    const double rate =
        (terrain.motion_at(t + h).position_m[1] - terrain.motion_at(t - h).position_m[1]) / (2 * h);
    EXPECT_NEAR(terrain.motion_at(t).velocity_m_s[1], rate, 1e-6) << t;
    EXPECT_LE(std::abs(rate), terrain.fastest_m_s());
  }
}

// The ground's 0.02 m at 1 Hz take 0.8 m/s2: a grip of 0.6 carries the block along.
TEST(MovingGround, CarriesAlongWhatGripsIt) {
  hal::ContactConfig contact = gripping(0.6);
  contact.terrain.add(shake(0, 0.02, 1.0));
  Plant plant = block(contact);
  ASSERT_EQ(plant.advance(2'250'000'000), Code::kOk);
  EXPECT_NEAR(plant.q()[0], 0.02, 2e-4);
  EXPECT_NEAR(plant.v()[0], 0.0, 2e-3);
  ASSERT_EQ(plant.advance(250'000'000), Code::kOk);
  EXPECT_NEAR(plant.v()[0], -0.02 * 2.0 * std::numbers::pi, 2e-3);
}

// 0.05 m at 5 Hz are 49 m/s2: the block slides both ways, and never is faster than mu g.
TEST(MovingGround, DragsWhatSlidesAtMuG) {
  hal::ContactConfig contact = gripping(0.1);
  contact.terrain.add(shake(0, 0.05, 5.0));
  Plant plant = block(contact);
  ASSERT_EQ(plant.advance(410'000'000), Code::kOk);
  const double start = plant.v()[0];
  ASSERT_EQ(plant.advance(30'000'000), Code::kOk);  // the ground goes to +x all the while
  EXPECT_NEAR((plant.v()[0] - start) / 0.03, 0.1 * kG, 0.02 * kG);
}

TEST(MovingGround, LiftsWithoutLosingTheBlock) {
  hal::ContactConfig contact = gripping(0.6);
  contact.terrain.add(shake(2, 0.05, 1.0));
  Plant plant = block(contact, Integrator::kLeapfrog);
  ASSERT_EQ(plant.advance(2'250'000'000), Code::kOk);
  // At the top it weighs less by 0.05 (2 pi)^2 = 1.974 m/s2.
  plant.evaluate();
  const auto W = plant.contact().wrench_W();
  EXPECT_NEAR(W[2] + W[8], kBlockMass * (kG - 1.974), 1.0);
  EXPECT_NEAR(plant.q()[2], 0.05 + 0.05 - kBlockMass * (kG - 1.974) / (8 * 20'000.0), 2e-4);
}

}  // namespace
}  // namespace tandem::sim
