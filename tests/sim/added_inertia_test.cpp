#include "hal/sim/added_inertia.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "model/interpreted_kernels.hpp"
#include "model/sines.hpp"
#include "model/urdf.hpp"
#include "tests/model/random_robot.hpp"

namespace tandem::sim {
namespace {

/// A robot as described, and as it is.
struct Pair {
  model::Tree described, actual;
  hal::RobotConfig robot;  // its sensors
  model::ModelSpec spec, actual_spec;
};

/// What a body has is the sum of its links.
void sum_up(model::Tree& tree) {
  for (model::Body& body : tree.bodies) body.inertia = {};
  for (const model::Link& link : tree.links) {
    model::Body& body = tree.bodies[static_cast<std::size_t>(link.body)];
    body.inertia = body.inertia + link.in_body * link.inertia;
  }
}

/// Every link gets another mass, center and inertia, and every second joint another armature.
Pair changed(const model::Tree& tree, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Pair pair{tree, tree, {}, {}, {}};
  sum_up(pair.described);
  for (model::Link& link : pair.actual.links) {
    if (!(link.inertia.mass_kg > 0.0)) continue;
    link.inertia.mass_kg *= uniform(0.4, 2.0);
    link.inertia.about_com_kg_m2 *= uniform(0.4, 2.0);
    link.inertia.com_m += 0.05 * Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
  }
  sum_up(pair.actual);
  pair.spec.floating_base = tree.floating_base;
  pair.spec.gravity_m_s2 = {0.3, -0.2, -9.81};
  // A sensor at every joint; two of three are inside, the rest have nothing beyond.
  for (const model::Link& link : tree.links) {
    if (link.joint.empty()) continue;
    hal::SensorConfig sensor;
    sensor.name = "at_" + link.joint;
    sensor.type = hal::SensorType::kForceTorque;
    sensor.joint = link.joint;
    sensor.link = link.name;
    pair.robot.sensors.push_back(sensor);
    pair.spec.sensors.push_back({sensor.name, sensor.joint, sensor.link});
  }
  pair.actual_spec = pair.spec;
  for (std::size_t j = 0; j < tree.joints.size(); j += 2) {
    if (tree.joints[j].follows()) continue;
    pair.spec.armature.emplace_back(tree.joints[j].name, 0.2);
    pair.actual_spec.armature.emplace_back(tree.joints[j].name, 0.5);
  }
  return pair;
}

struct State {
  std::vector<double> q, v, tau, vdot, wrench;
};
State state_of(const tandem_kernels& k, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto fill = [&](std::vector<double>& to, std::size_t size, double most) {
    for (std::size_t i = 0; i < size; ++i)
      to.push_back(std::uniform_real_distribution<double>(-most, most)(random));
  };
  State s;
  fill(s.q, k.nq, 1.5);
  fill(s.v, k.nv, 2.0);
  fill(s.tau, k.nv, 5.0);
  fill(s.vdot, k.nv, 5.0);
  s.wrench.assign(6 * k.wrenches, 0.0);
  if (k.floating_base == 0) return s;
  double norm = 0.0;
  for (std::size_t i = 3; i < 7; ++i) norm += s.q[i] * s.q[i];
  for (std::size_t i = 3; i < 7; ++i) s.q[i] /= std::sqrt(norm);
  return s;
}

/// Forward and inverse dynamics, M, center of mass, sensors: one after another.
std::vector<std::vector<double>> figures_of(AddedInertia& robot, const State& s) {
  const tandem_kernels& k = robot.kernels();
  model::Sines sines(k);
  sines.take(s.q.data());
  std::vector<std::vector<double>> all(5);
  all[0].assign(k.nv, 0.0);
  robot.forward_dynamics(sines.data(), s.q.data(), s.v.data(), s.tau.data(), s.wrench.data(),
                         all[0].data());
  all[1].assign(k.nv, 0.0);
  robot.inverse_dynamics(sines.data(), s.q.data(), s.v.data(), s.vdot.data(), s.wrench.data(),
                         all[1].data());
  all[2].assign(std::size_t{k.nv} * k.nv, 0.0);
  k.mass_matrix(s.q.data(), all[2].data());
  robot.add_to_mass_matrix(s.q.data(), all[2].data());
  std::vector<double> cdot(3), J(3 * k.nv);
  all[3].assign(3, 0.0);
  k.center_of_mass(s.q.data(), s.v.data(), all[3].data(), cdot.data(), J.data());
  robot.add_to_center_of_mass(s.q.data(), all[3].data());
  all[4].assign(6 * k.sensors, 0.0);
  k.sensor_wrenches(s.q.data(), s.v.data(), s.vdot.data(), s.wrench.data(), all[4].data());
  for (std::size_t i = 0; i < k.sensors; ++i)
    robot.add_beyond(i, s.q.data(), s.v.data(), s.vdot.data(), all[4].data() + 6 * i);
  return all;
}

double difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0.0, size = 1.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, std::abs(a[i] - b[i]));
    size = std::max(size, std::abs(b[i]));
  }
  return a.size() == b.size() ? most / size : NAN;
}

/// By kernels of the actual tree, and by those of the described one with the difference added.
double worst(const Pair& pair, std::uint64_t seed) {
  State s;
  std::vector<std::vector<double>> wanted;
  double mass_kg = 0.0;
  {
    const model::InterpretedKernels actual(*model::make_mechanism(pair.actual, pair.actual_spec));
    s = state_of(*actual.get(), seed);
    AddedInertia nothing(*actual.get());
    wanted = figures_of(nothing, s);
    mass_kg = actual.get()->mass_kg;
  }
  const model::InterpretedKernels kernels(*model::make_mechanism(pair.described, pair.spec));
  AddedInertia robot(*kernels.get(), pair.robot, pair.described, pair.actual);
  for (std::size_t j = 0; j < kernels.get()->joints; ++j) {
    const std::string name = kernels.get()->joint_names[j];
    for (const auto& [joint, armature] : pair.spec.armature)
      if (joint == name) robot.add_armature(j, 0.3);
  }
  EXPECT_NEAR(robot.mass_kg(), mass_kg, 1e-9 * mass_kg);
  const auto found = figures_of(robot, s);
  double most = 0.0;
  for (std::size_t f = 0; f < found.size(); ++f) {
    const double one = difference(found[f], wanted[f]);
    EXPECT_LT(one, 1e-9) << "figure " << f << ", seed " << seed;
    most = std::max(most, one);
  }
  // Forward is the inverse of inverse.
  model::Sines sines(*kernels.get());
  sines.take(s.q.data());
  std::vector<double> again(s.vdot.size());
  robot.forward_dynamics(sines.data(), s.q.data(), s.v.data(), found[1].data(), s.wrench.data(),
                         again.data());
  EXPECT_LT(difference(again, s.vdot), 1e-9) << "seed " << seed;
  return most;
}

model::Tree random_tree(std::uint64_t seed) {
  model::RandomRobotOptions options = model::options_of(seed, 12);
  options.mass_decades = 1.0;  // of the comparison, not of conditions
  options.near_parallel = 0.0;
  const model::RandomRobot robot(seed, options);
  return model::parse_urdf(robot.urdf(), "random.urdf", {.floating_base = options.floating_base})
      ->tree;
}

TEST(AddedInertia, MakesAnyTreeTheOneWithOtherMasses) {
  double most = 0.0;
  int floating = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const Pair pair = changed(random_tree(seed), seed);
    floating += pair.described.floating_base ? 1 : 0;
    most = std::max(most, worst(pair, seed));
  }
  std::printf("worst relative difference of 60 trees: %.2g\n", most);
  EXPECT_GT(floating, 10);
  EXPECT_LT(floating, 50);
}

constexpr const char* kFollower = R"(<robot name="gripper">
<link name="base"/>
<link name="arm"><inertial><mass value="2"/><origin xyz="0.1 0 0.2"/>
  <inertia ixx="0.02" iyy="0.03" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="left"><inertial><mass value="0.3"/><origin xyz="0 0.05 0"/>
  <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="right"><inertial><mass value="0.4"/><origin xyz="0.02 0 0.1"/>
  <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="lift" type="prismatic"><parent link="base"/><child link="arm"/><axis xyz="0 0.6 0.8"/>
  <limit lower="-1" upper="1" effort="9" velocity="9"/></joint>
<joint name="left_hinge" type="revolute"><parent link="arm"/><child link="left"/>
  <origin xyz="0.1 0 0.3" rpy="0.3 0.2 0.1"/><axis xyz="1 0 0"/>
  <limit lower="-2" upper="2" effort="9" velocity="9"/></joint>
<joint name="right_hinge" type="revolute"><parent link="left"/><child link="right"/>
  <origin xyz="0 0.1 0.1" rpy="0 0.5 0"/><axis xyz="0 1 0"/>
  <limit lower="-9" upper="9" effort="9" velocity="9"/><mimic joint="left_hinge" multiplier="-1.5"
  offset="0.2"/></joint></robot>)";

// Two joints of one coordinate, one behind the other: each meets itself and the other in M.
TEST(AddedInertia, LetsJointsFollowOthers) {
  const auto read = model::parse_urdf(kFollower, "follower.urdf", {});
  ASSERT_TRUE(read) << read.error().front().to_string();
  for (std::uint64_t seed = 0; seed < 20; ++seed)
    EXPECT_LT(worst(changed(read->tree, seed), seed), 1e-9);
}

// What is carried is the same as a link that is as heavy, and when it is gone nothing is left.
TEST(AddedInertia, CarriesLoadsAndLetsThemGo) {
  const model::Tree tree = random_tree(3);
  Pair pair{tree, tree, {}, {}, {}};
  sum_up(pair.described);
  pair.spec.floating_base = pair.actual_spec.floating_base = tree.floating_base;
  Load load{.link = tree.links.size() - 1, .in_link = {}};
  load.in_link.mass_kg = 1.6;
  load.in_link.com_m = Eigen::Vector3d(0.02, -0.03, 0.1);
  load.in_link.about_com_kg_m2 = Eigen::Vector3d(0.004, 0.005, 0.006).asDiagonal();
  model::Link& link = pair.actual.links[load.link];
  link.inertia = link.inertia + load.in_link;
  sum_up(pair.actual);
  State s;
  std::vector<std::vector<double>> wanted;
  {
    const model::InterpretedKernels actual(*model::make_mechanism(pair.actual, pair.spec));
    s = state_of(*actual.get(), 3);
    AddedInertia nothing(*actual.get());
    wanted = figures_of(nothing, s);
  }
  const model::InterpretedKernels kernels(*model::make_mechanism(pair.described, pair.spec));
  AddedInertia robot(*kernels.get(), pair.robot, pair.described, pair.described);
  EXPECT_FALSE(robot.any());
  const auto before = figures_of(robot, s);
  robot.carry(load);
  EXPECT_TRUE(robot.any());
  const auto carried = figures_of(robot, s);
  for (std::size_t f = 0; f < wanted.size(); ++f)
    EXPECT_LT(difference(carried[f], wanted[f]), 1e-9) << f;
  EXPECT_GT(difference(carried[0], before[0]), 1e-3);  // else the test compares nothing

  Archive saved;
  robot.archive(saved);
  robot.let_go();
  EXPECT_FALSE(robot.any());
  EXPECT_EQ(figures_of(robot, s), before);  // to the bit
  Archive back(saved.bytes());
  robot.archive(back);
  EXPECT_TRUE(back.ok() && back.at_end());
  EXPECT_EQ(figures_of(robot, s), carried);
}

}  // namespace
}  // namespace tandem::sim
