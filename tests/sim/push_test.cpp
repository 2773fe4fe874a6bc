// Pushes on bodies whose answer is known: momentum, and a pendulum in closed form.
#include "hal/sim/push.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "hal/sim/plant.hpp"
#include "hal/sim/push_row.hpp"
#include "model/interpreted_kernels.hpp"
#include "model/urdf.hpp"
#include "tests/model/random_robot.hpp"

namespace tandem::sim {
namespace {

/// A plant of a tree without motors; every joint swings freely.
struct Free {
  Free(const model::Tree& described, std::array<double, 3> gravity_m_s2, std::int64_t substep_ns,
       Integrator integrator = Integrator::kRungeKutta4)
      : tree(described), kernels(*model::make_mechanism(tree, spec(gravity_m_s2))) {
    PlantConfig config;
    config.kernels = kernels.get();
    config.robot = &robot;
    config.tree = &tree;
    config.integrator = integrator;
    config.substep_ns = substep_ns;
    config.base_height_m = 50.0;
    for (std::size_t j = 0; j < kernels.get()->joints; ++j)
      config.passive.push_back({.name = kernels.get()->joint_names[j]});
    robot.contact.height_m = -1e6;
    auto made = Plant::create(config);
    if (!made) throw std::runtime_error(made.error().to_string());
    plant.emplace(std::move(*made));
  }
  model::ModelSpec spec(std::array<double, 3> gravity_m_s2) const {
    model::ModelSpec all;
    all.floating_base = tree.floating_base;
    all.gravity_m_s2 = gravity_m_s2;
    return all;
  }
  /// In W: linear [Ns], and about the center of mass [Nms].
  std::array<double, 6> momentum() const {
    const tandem_kernels& k = *kernels.get();
    std::vector<double> M(std::size_t{k.nv} * k.nv), c(3), cdot(3), J(3 * k.nv);
    k.mass_matrix(plant->q(), M.data());
    k.center_of_mass(plant->q(), plant->v(), c.data(), cdot.data(), J.data());
    double p[6] = {};
    for (std::size_t r = 0; r < 6; ++r)
      for (std::size_t i = 0; i < k.nv; ++i) p[r] += M[r * k.nv + i] * plant->v()[i];
    const Mat3 R = rotation_of(plant->q() + 3);
    const Vec3 linear = rotate(R.data(), p);
    const Vec3 about_base = rotate(R.data(), p + 3);
    const Vec3 arm{c[0] - plant->q()[0], c[1] - plant->q()[1], c[2] - plant->q()[2]};
    const Vec3 moved = cross(arm, linear);
    return {linear[0],
            linear[1],
            linear[2],
            about_base[0] - moved[0],
            about_base[1] - moved[1],
            about_base[2] - moved[2]};
  }
  void push(const ScenarioFault& fault) { plant->pushes().begin(fault, plant->time_ns()); }
  void advance(std::int64_t ns) { ASSERT_EQ(plant->advance(ns), Code::kOk); }

  model::Tree tree;
  model::InterpretedKernels kernels;
  hal::RobotConfig robot;
  std::optional<Plant> plant;
};

/// As a row of a scenario has it.
ScenarioFault push_of(const std::string& row, const model::Tree& tree, std::int64_t duration_ns) {
  const auto document = TomlDocument::parse(row, "push.toml");
  TomlTable table = document->root();
  ScenarioFault push{.duration_ns = duration_ns, .kind = hal::FaultKind::kPush};
  read_push(table, {}, &tree, push);
  table.finish();
  EXPECT_TRUE(document->diagnostics().empty())
      << document->diagnostics().front().to_string() << "\n"
      << row;
  return push;
}

model::Tree parsed(const std::string& urdf, bool floating) {
  const auto read = model::parse_urdf(urdf, "robot.urdf", {.floating_base = floating});
  if (!read) throw std::runtime_error(read.error().front().to_string());
  return read->tree;
}

constexpr const char* kPendulum = R"(<robot name="pendulum"><link name="base"/>
<link name="arm"><inertial><mass value="2"/><origin xyz="0 0 -0.5"/>
  <inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="swing" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
</joint></robot>)";
constexpr double kInertia = 0.02 + 2.0 * 0.25;  // about the joint

// 1000 steps of 100 us hold the duration of 83.3 ms not evenly, and no shape is even over one.
TEST(Push, GivesAPendulumItsImpulseWhateverTheSteps) {
  const model::Tree tree = parsed(kPendulum, false);
  for (const std::string shape : {"step", "half_sine", "triangle"}) {
    for (const Integrator integrator : {Integrator::kLeapfrog, Integrator::kRungeKutta4}) {
      Free one(tree, {0.0, 0.0, 0.0}, 100'000, integrator);
      one.push(push_of("link = 'arm'\nimpulse_Nms = [0, 0.26, 0]\nshape = '" + shape + "'\n", tree,
                       83'333'333));
      one.advance(100'000'000);
      EXPECT_NEAR(one.plant->v()[0], 0.26 / kInertia, 1e-13) << shape;
      EXPECT_FALSE(one.plant->pushes().any());
    }
  }
}

// Where a half-sine of torque has taken it: A T^2 / (pi I), and it goes on at 2 A T / (pi I).
TEST(Push, MovesAPendulumAsTheIntegralsOfItsShapeSay) {
  const model::Tree tree = parsed(kPendulum, false);
  Free one(tree, {0.0, 0.0, 0.0}, 100'000);
  const double T = 0.2, A = 3.0, pi = std::numbers::pi;
  one.push(
      push_of("link = 'arm'\ntorque_Nm = [0, 3, 0]\nshape = 'half_sine'\n", tree, 200'000'000));
  one.advance(100'000'000);
  EXPECT_NEAR(one.plant->v()[0], A * T / (pi * kInertia), 1e-12);
  one.advance(100'000'000);
  EXPECT_NEAR(one.plant->q()[0], A * T * T / (pi * kInertia), 1e-9);
  EXPECT_NEAR(one.plant->v()[0], 2.0 * A * T / (pi * kInertia), 1e-12);
}

// Small: theta = F r / (m g l) (1 - cos w t), with w^2 = m g l / I, under a force that stays.
TEST(Push, HoldsAPendulumOffItsRest) {
  const model::Tree tree = parsed(kPendulum, false);
  Free one(tree, {0.0, 0.0, -9.81}, 500'000);
  one.push(push_of("link = 'arm'\npoint_m = [0, 0, -0.8]\nforce_N = [-1e-4, 0, 0]\n", tree, -1));
  one.advance(1'000'000'000);
  const double stiffness = 2.0 * 9.81 * 0.5, w = std::sqrt(stiffness / kInertia);
  EXPECT_NEAR(one.plant->q()[0], 1e-4 * 0.8 / stiffness * (1.0 - std::cos(w)), 1e-12);
  EXPECT_TRUE(one.plant->pushes().any());
}

// Whatever the tree, the link, the point and the frame: in flight momentum grows by the impulse,
// and by its moment about the center of mass where that stands still.
TEST(Push, ChangesTheMomentumOfAnyTreeByItsImpulse) {
  double worst = 0.0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    model::RandomRobotOptions options = model::options_of(seed, 5);
    options.floating_base = true;
    options.mass_decades = 1.0;
    const model::Tree tree = parsed(model::RandomRobot(seed, options).urdf(), true);
    Free one(tree, {0.0, 0.0, 0.0}, 100'000);
    const std::string link = tree.links[seed % tree.links.size()].name;
    one.push(push_of("link = '" + link +
                         "'\nimpulse_Ns = [0.3, -0.2, 0.5]\npoint_m = [0.02, 0.01, -0.03]\n"
                         "shape = 'half_sine'\n",
                     tree, 7'300'000));
    const double before = one.momentum()[0];
    one.advance(10'000'000);
    const auto after = one.momentum();
    EXPECT_EQ(before, 0.0);
    const double wanted[3] = {0.3, -0.2, 0.5};
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(after[i], wanted[i], 1e-9) << "seed " << seed << ", link " << link;
      worst = std::max(worst, std::abs(after[i] - wanted[i]));
    }
  }
  std::printf("worst difference of six trees: %.2g Ns\n", worst);
}

constexpr const char* kBlock = R"(<robot name="block"><link name="block">
  <inertial><mass value="4"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/>
  </inertial></link></robot>)";

// A ball of inertia: w = R x J / I.
TEST(Push, TurnsABodyByItsMoment) {
  const model::Tree tree = parsed(kBlock, true);
  Free one(tree, {0.0, 0.0, 0.0}, 50'000);
  one.push(push_of("link = 'block'\nimpulse_Nms = [0.02, -0.01, 0.03]\n", tree, 1'100'000));
  one.push(push_of("link = 'block'\nimpulse_Ns = [4, 8, -2]\n", tree, 1'100'000));
  one.advance(2'000'000);
  const auto p = one.momentum();
  const double wanted[6] = {4.0, 8.0, -2.0, 0.02, -0.01, 0.03};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(p[i], wanted[i], 1e-12) << i;
}

// One in the body's own frame turns with it: after a quarter turn +x is W's +y.
TEST(Push, TurnsWithItsBodyIfAsked) {
  const model::Tree tree = parsed(kBlock, true);
  Free one(tree, {0.0, 0.0, 0.0}, 250'000);
  const double s = std::sqrt(0.5);
  const std::vector<double> q{0.0, 0.0, 50.0, 0.0, 0.0, s, s}, v(6, 0.0);
  one.plant->set_state(q, v);
  one.push(push_of("link = 'block'\nimpulse_Ns = [3, 0, 0]\nframe = 'local'\n", tree, 1'000'000));
  one.advance(2'000'000);
  EXPECT_NEAR(one.momentum()[0], 0.0, 1e-14);
  EXPECT_NEAR(one.momentum()[1], 3.0, 1e-14);
}

TEST(Push, IsSummedUpForTheLog) {
  const model::Tree tree = parsed(kBlock, true);
  Free one(tree, {0.0, 0.0, 0.0}, 250'000);
  one.push(push_of("link = 'block'\nforce_N = [0, 10, 0]\npoint_m = [0.3, 0, 0]\n", tree, -1));
  one.push(push_of("link = 'block'\ntorque_Nm = [0, 0, 2]\n", tree, 100'000));  // of 250 us
  one.advance(250'000);
  double force[3], moment[3];
  const double center[3] = {0.0, 0.0, 50.0};
  one.plant->set_state(std::vector<double>{0, 0, 50, 0, 0, 0, 1}, std::vector<double>(6, 0.0));
  one.plant->pushes().sum_up(one.plant->q(), one.plant->v(), center, force, moment);
  EXPECT_NEAR(force[1], 10.0, 1e-14);
  EXPECT_NEAR(moment[2], 0.3 * 10.0 + 0.4 * 2.0, 1e-12);
}

}  // namespace
}  // namespace tandem::sim
