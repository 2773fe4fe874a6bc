// Engines of others that work in joint coordinates: they accelerate any tree (fixed and floating
// bases, prismatic joints, branches, rotors, odd axes, bodies without mass) as our algorithms do,
// and the forces that they say explain the motion.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "hal/sim/engine_loader.hpp"
#include "model/interpreted_kernels.hpp"
#include "model/placements.hpp"
#include "model/urdf.hpp"
#include "tests/model/random_robot.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem::sim {
namespace {

class EngineMechanics : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { plugin_ = load_engine(GetParam()).value(); }

  void compare();

  /// The points of its soles in the base's frame, in the posture with all joints at 0.
  static std::vector<Eigen::Vector3d> soles(const test::TestRobot& robot) {
    const std::vector<double> zero(robot.tree->joints.size());
    const std::vector<model::Placement> bodies = model::place_bodies(*robot.tree, zero);
    std::vector<Eigen::Vector3d> points;
    for (const hal::Foot& foot : robot.robot.contact.feet) {
      const auto site =
          std::ranges::find(robot.robot.model.sites, foot.site, &hal::SiteConfig::name);
      const model::Link& link =
          robot.tree->links[static_cast<std::size_t>(robot.tree->link_index(site->link))];
      const model::Placement sole = bodies[static_cast<std::size_t>(link.body)] * link.in_body *
                                    model::placement_of(site->xyz_m, site->rpy_rad);
      for (const auto& [x, y, z] : foot.points_m)
        points.emplace_back(sole.R * Eigen::Vector3d(x, y, z) + sole.p);
    }
    return points;
  }

  /// The worst difference of the accelerations in some states, over the largest acceleration.
  static double worst(Engine& engine, const tandem_kernels& k, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    double most = 0.0;
    for (int i = 0; i < 5; ++i) {
      std::vector<double> q(k.nq), v(k.nv), tau(k.nv), ours(k.nv), theirs(k.nv);
      for (auto* values : {&q, &v, &tau})
        for (double& value : *values) value = number(random);
      if (k.floating_base != 0) {
        const double length = std::hypot(std::hypot(q[3], q[4]), std::hypot(q[5], q[6]));
        for (std::size_t j = 3; j < 7; ++j) q[j] /= length;
      }
      k.forward_dynamics(q.data(), v.data(), tau.data(), nullptr, ours.data());
      engine.accelerations(q.data(), v.data(), tau.data(), theirs.data());
      double difference = 0.0, scale = 0.0;
      for (std::size_t j = 0; j < k.nv; ++j) {
        difference = std::max(difference, std::abs(ours[j] - theirs[j]));
        scale = std::max(scale, std::abs(ours[j]));
      }
      most = std::max(most, difference / scale);
    }
    return most;
  }

  /// Takes the mass of a body inside, and of a base that is fixed.
  static void make_hollow(model::Tree& tree) {
    const int inside = tree.joints.back().parent;
    if (inside > 0 || !tree.floating_base)
      tree.bodies[static_cast<std::size_t>(inside)].inertia = {};
    if (!tree.floating_base) tree.bodies.front().inertia = {};
  }

  const EnginePlugin* plugin_ = nullptr;
};

void EngineMechanics::compare() {
  int taken = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    model::RandomRobotOptions options = model::options_of(seed, 20);
    options.mass_decades = 1.0;  // the comparison is of engines, not of conditions
    options.near_parallel = 0.0;
    const model::RandomRobot robot(seed, options);
    auto read =
        model::parse_urdf(robot.urdf(), "random.urdf", {.floating_base = options.floating_base});
    ASSERT_TRUE(read) << read.error().front().to_string();
    EngineModel model;
    model.tree = std::move(read->tree);
    if (seed % 4 == 0) make_hollow(model.tree);
    model.armature_kg_m2.assign(model.tree.joints.size(), 0.0);
    model::ModelSpec spec;
    spec.floating_base = options.floating_base;
    if (plugin_->armature) {
      for (std::size_t j = 0; j < model.tree.joints.size(); j += 2) {
        model.armature_kg_m2[j] = 0.1;
        spec.armature.emplace_back(model.tree.joints[j].name, 0.1);
      }
    }
    const auto mechanism = model::make_mechanism(model.tree, spec);
    ASSERT_TRUE(mechanism) << mechanism.error().to_string();
    const model::InterpretedKernels kernels(*mechanism);
    const auto engine = plugin_->create(model);
    if (!engine) {
      EXPECT_EQ(seed % 4, 0u);
      EXPECT_NE(engine.error().to_string().find("mass"), std::string::npos);
      continue;
    }
    ++taken;
    EXPECT_LT(worst(**engine, *kernels.get(), seed), 1e-8) << "seed " << seed;
  }
  EXPECT_GT(taken, 30);
}

TEST_P(EngineMechanics, AccelerateAnyTreeAsOursDoAndPrintNothing) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  compare();
  EXPECT_EQ(testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr(), "");
}

/// COMAN on the ground: what its momentum gains is what the engine's forces, each at its point,
/// and gravity give.
TEST_P(EngineMechanics, SayTheForcesThatMoveTheRobot) {
  const test::TestRobot coman = test::load_test_robot("coman");
  const tandem_kernels& k = *coman.kernels;
  constexpr double kStep_s = 250e-6;
  const auto engine = make_engine(GetParam(), coman.robot, *coman.tree, kStep_s);
  ASSERT_TRUE(engine) << engine.error().to_string();
  const std::vector<Eigen::Vector3d> points = soles(coman);
  std::vector<double> q(k.nq), v(k.nv), tau(k.nv), forces(3 * points.size()), vdot(k.nv);
  q[6] = 1.0;
  const double lowest = std::ranges::min(points, {}, [](const auto& p) { return p.z(); }).z();
  q[2] = coman.robot.contact.height_m - lowest - 1e-6;  // touching the ground
  v[0] = 0.3;                                           // and sliding
  v[1] = -0.2;
  const std::vector<double> q0 = q, v0 = v;
  (*engine)->set_state(q.data(), v.data());
  (*engine)->step(kStep_s, tau.data(), q.data(), v.data(), forces.data());
  // The base's axes have turned with it; the change is wanted in those at the beginning.
  const Eigen::Quaterniond turn(q[6], q[3], q[4], q[5]);
  for (double* part : {v.data(), v.data() + 3}) {
    const Eigen::Vector3d turned = turn * Eigen::Map<const Eigen::Vector3d>(part);
    std::copy_n(turned.data(), 3, part);
  }
  for (std::size_t i = 0; i < k.nv; ++i) vdot[i] = (v[i] - v0[i]) / kStep_s;
  const std::vector<double> wrench(6 * k.wrenches, 0.0);
  std::vector<double> needed(k.nv);
  k.inverse_dynamics(q0.data(), v0.data(), vdot.data(), wrench.data(), needed.data());
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Map<const Eigen::Vector3d> f(&forces[3 * i]);
    EXPECT_GE(f.z(), 0.0);
    EXPECT_LE(f.x(), 0.0);  // against the sliding
    force += f;
    moment += points[i].cross(f);
  }
  const double size = force.norm();
  EXPECT_GT(size, 100.0);
  EXPECT_GT(force.head<2>().norm(), 0.1 * size);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(needed[axis], force[axis], 2e-5 * size);  // a step's turn about the mass, squared
    // Where on the ball, of 1 mm, is the engine's matter.
    EXPECT_NEAR(needed[3 + axis], moment[axis], 2.0 * EngineModel::kRadius_m * size);
  }
}

/// Those with joints' coordinates and rigid contact, as far as they are installed.
std::vector<std::string> judged() {
  std::vector<std::string> names = installed_engines();
  std::erase_if(names, [](const std::string& name) { return name == "ode" || name == "simbody"; });
  return names;
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(EngineMechanics);  // sanitizer builds have none
INSTANTIATE_TEST_SUITE_P(Of, EngineMechanics, testing::ValuesIn(judged()),
                         [](const auto& engine) { return engine.param; });

}  // namespace
}  // namespace tandem::sim
