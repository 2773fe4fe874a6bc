#include "hal/sim/body_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/sim/plant.hpp"
#include "tests/sim/hand_kernels.hpp"

namespace tandem::sim {
namespace {

using model::Shape;

model::Tree one_link(const std::vector<Shape>& shapes) {
  model::Tree tree;
  tree.floating_base = true;
  tree.bodies = {{"base", {}}};
  tree.links.emplace_back();
  tree.links[0].name = "base";
  tree.links[0].inertia = {test::kBlockMass, Eigen::Vector3d::Zero(),
                           Eigen::Vector3d(0.1, 0.2, 0.25).asDiagonal()};
  tree.links[0].shapes = shapes;
  return tree;
}

hal::RobotConfig on_ground() {
  hal::RobotConfig robot;
  hal::ContactConfig& c = robot.contact;
  c.stiffness_N_m = 20'000.0;
  c.damping_s_m = 3.0;
  c.tangential_stiffness_N_m = 20'000.0;
  c.tangential_damping_Ns_m = 50.0;
  c.static_friction = 0.9;
  c.sliding_friction = 0.8;
  return robot;
}

const Shape kBox{Shape::Kind::kBox, {0.4, 0.2, 0.1}, {}};

/// The block without soles, its shape `shapes`, let go at a height and tilted.
struct Dropped {
  Dropped(const std::vector<Shape>& shapes, double height_m, double tilt_rad)
      : tree(one_link(shapes)), robot(on_ground()) {
    PlantConfig config;
    config.kernels = test::block_kernels<0>();
    config.contact = robot.contact;
    config.robot = &robot;
    config.tree = &tree;
    config.base_height_m = height_m;
    Result<Plant> made = Plant::create(config);
    EXPECT_TRUE(made) << made.error().to_string();
    plant = std::make_unique<Plant>(std::move(*made));
    const double half = 0.5 * tilt_rad;
    const double q[7] = {
        0, 0, height_m, 0.6 * std::sin(half), 0.8 * std::sin(half), 0, std::cos(half)};
    const double v[6] = {};
    plant->set_state(q, v);
  }
  [[nodiscard]] double energy_J() const {
    const double* v = plant->v();
    double energy =
        test::kBlockMass * test::kG * plant->q()[2] + plant->bodies().elastic_energy_J();
    for (int i = 0; i < 3; ++i) {
      energy += 0.5 * test::kBlockMass * v[i] * v[i];
      energy += 0.5 * test::kBlockInertia[i] * v[3 + i] * v[3 + i];
    }
    return energy;
  }
  model::Tree tree;
  hal::RobotConfig robot;
  std::unique_ptr<Plant> plant;
};

TEST(BodyContact, OfABlockThatFallsOnItsEdgeEndsInRestOnAFace) {
  Dropped block({kBox}, 0.5, 0.7);
  const double first_J = block.energy_J();
  double lowest_J = first_J;
  for (int i = 0; i < 4000; ++i) {
    ASSERT_EQ(block.plant->advance(1'000'000), Code::kOk);
    block.plant->evaluate();
    const double now_J = block.energy_J();
    ASSERT_LE(now_J, lowest_J + 0.005 * first_J) << i;  // of the integrator, in the impact
    lowest_J = std::min(lowest_J, now_J);
  }
  EXPECT_TRUE(block.plant->bodies().touching());
  EXPECT_NEAR(block.plant->bodies().vertical_force_N(), test::kBlockMass * test::kG, 1e-3);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(block.plant->v()[i], 0.0, 1e-6);
  const double sag = test::kBlockMass * test::kG / (4 * 20'000.0);
  EXPECT_NEAR(block.plant->q()[2], 0.05 - sag, 1e-6) << "flat on its largest face";
}

// The clearance that saves the kinematics is a bound, not a guess: with it and without, one bit.
TEST(BodyContact, IsFoundInTheSubStepInWhichItBegins) {
  Dropped block({kBox}, 0.5, 0.3);
  const double spin[6] = {0.5, 0.0, 0.0, 3.0, -8.0, 5.0};
  block.plant->set_state({block.plant->q(), 7}, spin);
  const auto lowest_corner_m = [&] {
    double R[9], low = std::numeric_limits<double>::infinity();
    test::block::rotation(block.plant->q(), R);
    for (int corner = 0; corner < 8; ++corner) {
      const double x = (corner & 1) != 0 ? 0.2 : -0.2, y = (corner & 2) != 0 ? 0.1 : -0.1;
      const double z = (corner & 4) != 0 ? 0.05 : -0.05;
      low = std::min(low, block.plant->q()[2] + R[6] * x + R[7] * y + R[8] * z);
    }
    return low;
  };
  int steps = 0;
  for (; !block.plant->bodies().touching(); ++steps) {
    ASSERT_LT(steps, 6000);
    ASSERT_GE(lowest_corner_m(), 0.0) << steps;
    ASSERT_EQ(block.plant->advance(250'000), Code::kOk);
    block.plant->evaluate();
  }
  EXPECT_LT(lowest_corner_m(), 0.0) << steps;
  EXPECT_GT(steps, 400) << "it fell 40 cm or so";
}

TEST(BodyContact, LeavesOutWhatStartsInsideTheGround) {
  Dropped block({kBox}, 0.02, 0.0);
  ASSERT_EQ(block.plant->advance(100'000'000), Code::kOk);
  EXPECT_LT(block.plant->q()[2], -0.02) << "nothing pushes: the upper corners come next";
  ASSERT_EQ(block.plant->advance(3'000'000'000), Code::kOk);
  EXPECT_NEAR(block.plant->q()[2], -0.05, 0.002);
}

/// A rod that swings about +y, a ball at its end.
model::Tree arm_on_fixed_base() {
  model::Tree tree;
  tree.bodies = {{"base", {}}, {"rod", {}}};
  tree.joints.resize(1);
  tree.joints[0].name = "swing";
  tree.joints[0].axis = Eigen::Vector3d::UnitY();
  tree.links.resize(2);
  tree.links[0].name = "base";
  tree.links[1].name = "rod";
  tree.links[1].body = 1;
  tree.links[1].parent = tree.links[1].moving = 0;
  tree.links[1].shapes = {{Shape::Kind::kSphere,
                           {0.02, 0.0, 0.0},
                           {Eigen::Matrix3d::Identity(), {0.0, 0.0, -test::kPendulumLength}}}};
  return tree;
}

// Virtual work: the torque of springs is the slope of their energy.
TEST(BodyContact, OfAnArmOnAFixedBaseGivesTheTorqueThatItsEnergyTells) {
  hal::RobotConfig robot = on_ground();
  robot.contact.height_m = -0.3;
  const double raised = 1.2, lying = 0.93, rest = 0.0, h = 1e-5;
  const BodyContact untouched(robot, arm_on_fixed_base(), *test::pendulum_kernels(), &raised, {},
                              1'000'000);
  const auto energy_J = [&](double q) {
    BodyContact contact = untouched;
    contact.evaluate(&q, &rest, true);
    return contact.elastic_energy_J();
  };
  BodyContact contact = untouched;
  contact.evaluate(&lying, &rest, true);
  ASSERT_TRUE(contact.touching("rod"));
  double torque_Nm = 0.0;
  contact.add_forces(&torque_Nm);
  ASSERT_GT(std::abs(torque_Nm), 1.0);
  const double slope = (energy_J(lying + h) - energy_J(lying - h)) / (2 * h);
  EXPECT_NEAR(torque_Nm, -slope, 1e-3 * std::abs(torque_Nm));
}

TEST(LinkPoints, OfALinkWithoutAShapeAreThoseOfTheBoxWithItsInertia) {
  model::Tree tree = one_link({});
  const double a = 0.5, b = 0.3, c = 0.2, m = test::kBlockMass;  // 333 kg/m^3
  tree.links[0].inertia = {
      m,
      {0.0, 0.0, 0.1},
      Eigen::Vector3d(b * b + c * c, a * a + c * c, a * a + b * b).asDiagonal() *
          Eigen::Matrix3d::Identity() * (m / 12.0)};
  const auto points = link_points(on_ground(), tree);
  ASSERT_EQ(points.size(), 1U);
  EXPECT_TRUE(points[0].guessed);
  ASSERT_EQ(points[0].in_body_m.size(), 8U);
  for (const Eigen::Vector3d& p : points[0].in_body_m) {
    EXPECT_NEAR(std::abs(p.x()), 0.5 * a, 1e-9);
    EXPECT_NEAR(std::abs(p.y()), 0.5 * b, 1e-9);
    EXPECT_NEAR(std::abs(p.z() - 0.1), 0.5 * c, 1e-9);
  }
  tree.links[0].inertia.mass_kg = 0.1;  // an inertia far too large for it
  double volume = 8.0;
  const auto shrunk = link_points(on_ground(), tree);
  for (int i = 0; i < 3; ++i) {
    volume *= std::abs(shrunk[0].in_body_m[0][i] - tree.links[0].inertia.com_m[i]);
  }
  EXPECT_NEAR(0.1 / volume, 200.0, 1e-6);
}

TEST(LinkPoints, LieOnTheirShapes) {
  const model::Placement at{Eigen::Matrix3d::Identity(), {0.1, 0.2, 0.3}};
  const auto points =
      link_points(on_ground(), one_link({{Shape::Kind::kSphere, {0.1, 0, 0}, at},
                                         {Shape::Kind::kCylinder, {0.1, 0, 0.4}, at},
                                         {Shape::Kind::kCapsule, {0.1, 0, 0.4}, at},
                                         {Shape::Kind::kMesh, {0, 0, 0}, at}}));
  ASSERT_EQ(points.size(), 1U);
  EXPECT_FALSE(points[0].guessed);
  ASSERT_EQ(points[0].in_body_m.size(), 6U + 8U + 8U);
  for (std::size_t i = 0; i < 22; ++i) {
    const Eigen::Vector3d p = points[0].in_body_m[i] - at.p;
    const double beyond = i < 6 ? 0.0 : 0.2;  // half the length
    const double z = std::max(0.0, std::abs(p.z()) - beyond);
    EXPECT_NEAR(Eigen::Vector3d(p.x(), p.y(), z).norm(), 0.1, 1e-12) << i;
  }
}

}  // namespace
}  // namespace tandem::sim
