// Engines of others behind the plant: the same accelerations, motion, feet and snapshots, and what
// they cannot do refused by name. What is not installed is named by one skipped test.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "base/archive.hpp"
#include "hal/sim/engine_loader.hpp"
#include "hal/sim/held_robot.hpp"
#include "hal/sim/rotation.hpp"
#include "model/interpreted_kernels.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem::sim {
namespace {

constexpr double kStep_s = 250e-6;

struct State {
  std::vector<double> q, v, tau;
};

State random_state(const tandem_kernels& k, std::mt19937& random) {
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  State s{std::vector<double>(k.nq), std::vector<double>(k.nv), std::vector<double>(k.nv)};
  for (auto* values : {&s.q, &s.v, &s.tau})
    for (double& value : *values) value = number(random);
  for (double& value : s.tau) value *= 10.0;
  if (k.floating_base != 0) {
    normalise_quaternion(s.q.data() + 3);
    s.q[2] += 3.0;  // off the ground
  }
  return s;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0.0, scale = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, std::abs(a[i] - b[i]));
    scale = std::max(scale, std::abs(b[i]));
  }
  return most / scale;
}

/// Our accelerations in the air.
std::vector<double> ours(const tandem_kernels& k, const State& s) {
  const std::vector<double> wrench(6 * k.wrenches, 0.0);
  std::vector<double> vdot(k.nv);
  k.forward_dynamics(s.q.data(), s.v.data(), s.tau.data(), wrench.data(), vdot.data());
  return vdot;
}

class Engines : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { plugin_ = load_engine(GetParam()).value(); }
  std::unique_ptr<Engine> make(const test::TestRobot& robot) const {
    auto engine = make_engine(GetParam(), robot.robot, *robot.tree, kStep_s);
    if (!engine) throw std::runtime_error(engine.error().to_string());
    return std::move(*engine);
  }
  const EnginePlugin* plugin_ = nullptr;
};

TEST_P(Engines, AccelerateAsTheKernelsDo) {
  for (const char* name : {"coman", "panda"}) {
    const test::TestRobot robot = test::load_test_robot(name);
    const tandem_kernels& k = *robot.kernels;
    const auto made = make_engine(GetParam(), robot.robot, *robot.tree, kStep_s);
    if (!made) {  // Panda's rotors are rigid
      EXPECT_FALSE(plugin_->armature);
      EXPECT_NE(made.error().to_string().find(GetParam()), std::string::npos);
      EXPECT_NE(made.error().to_string().find("panda_joint1"), std::string::npos);
      continue;
    }
    std::mt19937 random(1);
    double worst = 0.0;
    for (int i = 0; i < 100; ++i) {
      const State s = random_state(k, random);
      std::vector<double> vdot(k.nv);
      (*made)->accelerations(s.q.data(), s.v.data(), s.tau.data(), vdot.data());
      worst = std::max(worst, largest_difference(vdot, ours(k, s)));
    }
    EXPECT_LT(worst, 1e-8) << name;
  }
}

TEST_P(Engines, MoveAsTheyAccelerate) {
  const test::TestRobot robot = test::load_test_robot("coman");
  const tandem_kernels& k = *robot.kernels;
  const std::unique_ptr<Engine> engine = make(robot);
  std::mt19937 random(2);
  std::vector<double> forces(3 * 16, 1.0);
  for (int i = 0; i < 10; ++i) {
    const State s = random_state(k, random);
    constexpr double kShort_s = 3e-8;  // rates change by vdot times it, some 4e-4
    State next = s;
    engine->set_state(s.q.data(), s.v.data());
    engine->step(kShort_s, s.tau.data(), next.q.data(), next.v.data(), forces.data());
    std::vector<double> vdot(k.nv), rate(k.joints), expected(s.v.begin() + 6, s.v.end());
    for (std::size_t j = 0; j < k.nv; ++j) vdot[j] = (next.v[j] - s.v[j]) / kShort_s;
    for (std::size_t j = 0; j < k.joints; ++j) rate[j] = (next.q[7 + j] - s.q[7 + j]) / kShort_s;
    EXPECT_LT(largest_difference(vdot, ours(k, s)), 1e-3);
    EXPECT_LT(largest_difference(rate, expected), 1e-3);
    // The base: along its own axes, and turned about them.
    double moved_W[3];
    for (int axis = 0; axis < 3; ++axis) moved_W[axis] = (next.q[axis] - s.q[axis]) / kShort_s;
    const Vec3 moved = rotate_back(rotation_of(s.q.data() + 3).data(), moved_W);
    const double back[4] = {-s.q[3], -s.q[4], -s.q[5], s.q[6]};
    const auto turn = quaternion_product(back, next.q.data() + 3);
    const double sign = turn[3] < 0.0 ? -2.0 : 2.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(moved[axis], s.v[axis], 1e-3);
      EXPECT_NEAR(sign * turn[axis] / kShort_s, s.v[3 + axis], 1e-3);
    }
    for (std::size_t p = 0; p < 3 * 8; ++p) EXPECT_EQ(forces[p], 0.0) << "in the air";
  }
}

/// Turning and sliding joints in turn about any axes, two children to a body; in the air.
EngineModel odd_tree(bool floating, bool armature, std::mt19937& random) {
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  const auto vector = [&] {
    return Eigen::Vector3d(number(random), number(random), number(random));
  };
  const auto inertia = [&] {
    const Eigen::Vector3d a = vector();
    return model::Inertia{
        1.0, 0.1 * vector(),
        0.01 * ((1.0 + a.squaredNorm()) * Eigen::Matrix3d::Identity() - a * a.transpose())};
  };
  EngineModel out;
  out.tree.floating_base = floating;
  out.tree.bodies.push_back({"base", inertia()});
  for (int j = 0; j < 6; ++j) {
    model::Joint joint;
    joint.name = "j" + std::to_string(j);
    joint.parent = j / 2;
    joint.type = j % 2 == 0 ? model::JointType::kPrismatic : model::JointType::kRevolute;
    joint.axis = vector().normalized();
    joint.in_parent = {Eigen::AngleAxisd(2.0, vector().normalized()).toRotationMatrix(), vector()};
    out.tree.joints.push_back(joint);
    out.tree.bodies.push_back({joint.name, inertia()});
    out.armature_kg_m2.push_back(armature ? 0.1 * (j + 1) : 0.0);
  }
  out.ground_m = -100.0;
  out.step_s = kStep_s;
  return out;
}

TEST_P(Engines, MoveSlidersAndRotorsOnAnyBase) {
  std::mt19937 random(3);
  for (const bool floating : {true, false}) {
    const EngineModel tree = odd_tree(floating, plugin_->armature, random);
    model::ModelSpec spec;
    spec.floating_base = floating;
    for (std::size_t j = 0; j < tree.tree.joints.size(); ++j)
      spec.armature.emplace_back(tree.tree.joints[j].name, tree.armature_kg_m2[j]);
    const model::InterpretedKernels kernels(model::make_mechanism(tree.tree, spec).value());
    const tandem_kernels& k = *kernels.get();
    const std::unique_ptr<Engine> engine = plugin_->create(tree).value();
    for (int i = 0; i < 20; ++i) {
      const State s = random_state(k, random);
      std::vector<double> vdot(k.nv), no_forces;
      engine->accelerations(s.q.data(), s.v.data(), s.tau.data(), vdot.data());
      EXPECT_LT(largest_difference(vdot, ours(k, s)), 1e-8);
      constexpr int kSteps = 100;
      constexpr double kShort_s = 1e-6;
      State next = s;
      engine->set_state(s.q.data(), s.v.data());
      for (int step = 0; step < kSteps; ++step)
        engine->step(kShort_s, s.tau.data(), next.q.data(), next.v.data(), no_forces.data());
      for (std::size_t j = 0; j < k.nv; ++j) vdot[j] = (next.v[j] - s.v[j]) / (kSteps * kShort_s);
      EXPECT_LT(largest_difference(vdot, ours(k, s)), 1e-2);
    }
  }
}

/// COMAN with its boards, whose drives hold the posture "stand".
class Standing : public HeldRobot {
 public:
  explicit Standing(const std::string& engine, const test::TestRobot& coman)
      : HeldRobot(coman.robot, made(engine, coman), "stand") {}
  void run(int cycles) {
    for (int i = 0; i < cycles; ++i) ASSERT_EQ(step(), Code::kOk) << robot->status_text();
  }
  std::vector<std::byte> snapshot() {
    Archive ar;
    EXPECT_TRUE(robot->archive(ar));
    return {ar.bytes().begin(), ar.bytes().end()};
  }

 private:
  static std::unique_ptr<SimRobot> made(const std::string& engine, const test::TestRobot& coman) {
    auto robot = SimRobot::create(
        coman.robot, coman.kernels.get(),
        {.engine = engine, .posture = "stand", .release_ns = 200'000'000, .tree = coman.tree});
    if (!robot) throw std::runtime_error(robot.error().to_string());
    return std::move(*robot);
  }
};

TEST_P(Engines, LetComanStand) {
  const test::TestRobot coman = test::load_test_robot("coman");
  Standing standing(GetParam(), coman);
  standing.run(3'000);
  ASSERT_TRUE(standing.robot->plant().released());
  const double weight = coman.kernels->mass_kg * 9.81;
  double ground = 0.0, felt = 0.0;
  constexpr int kCycles = 500;
  const double height = standing.robot->truth().base_position_m()[2];
  for (int i = 0; i < kCycles; ++i) {
    standing.run(1);
    const auto force = standing.robot->truth().foot_force_N();
    ground += (force[2] + force[5]) / kCycles;
    for (const char* foot : {"left_foot", "right_foot"})
      felt += standing.state.sensor_values(
                  static_cast<std::size_t>(coman.robot.sensor_index(foot)))[2] /
              kCycles;
  }
  EXPECT_NEAR(ground, weight, 0.01 * weight);
  EXPECT_LT(felt, ground);
  EXPECT_GT(felt, 0.9 * ground);  // less the feet's own weight
  EXPECT_NEAR(standing.robot->truth().base_position_m()[2], height, 1e-3);
}

TEST_P(Engines, GoOnFromASnapshotWithTheSameBits) {
  const test::TestRobot coman = test::load_test_robot("coman");
  Standing first(GetParam(), coman), second(GetParam(), coman);
  first.run(2'500);
  const hal::CycleTime time = first.time;
  const std::vector<std::byte> before = first.snapshot();
  first.run(100);
  const std::vector<std::byte> after = first.snapshot();
  ASSERT_NE(before, after);
  for (Standing* standing : {&first, &second}) {
    Archive restore{std::span(before)};
    ASSERT_TRUE(standing->robot->archive(restore));
    standing->time = time;
    standing->run(100);
    EXPECT_EQ(standing->snapshot(), after) << (standing == &first ? "the same" : "another one");
  }
}

TEST_P(Engines, RefuseAClosedLoopByName) {
  const test::TestRobot robot = test::load_test_robot("four_bar");
  const auto made = make_engine(GetParam(), robot.robot, *robot.tree, kStep_s);
  ASSERT_FALSE(made);
  EXPECT_NE(made.error().message.find("'" + GetParam() + "' cannot close the loop"),
            std::string::npos);
}

TEST_P(Engines, MoveAMasslessLinkOrRefuseItByName) {
  test::TestRobot robot = test::load_test_robot("double_pendulum");
  model::Tree tree = *robot.tree;
  tree.bodies[1].inertia = {};
  const EngineModel model{
      .tree = tree, .armature_kg_m2 = {0.0, 0.0}, .points = {}, .step_s = kStep_s};
  const auto made = plugin_->create(model);
  if (!made) {
    EXPECT_NE(made.error().message.find("'" + tree.bodies[1].name + "' has no mass"),
              std::string::npos)
        << made.error().to_string();
    return;
  }
  const model::InterpretedKernels kernels(model::make_mechanism(tree, {}).value());
  std::mt19937 random(1);
  const State s = random_state(*kernels.get(), random);
  std::vector<double> theirs(s.v.size());
  (*made)->accelerations(s.q.data(), s.v.data(), s.tau.data(), theirs.data());
  EXPECT_LT(largest_difference(theirs, ours(*kernels.get(), s)), 1e-6);
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(Engines);  // sanitizer builds have none
INSTANTIATE_TEST_SUITE_P(Of, Engines, testing::ValuesIn(installed_engines()),
                         [](const auto& engine) { return engine.param; });

TEST(EngineLoader, FindsEveryEngine) {
  std::string missing;
  for (const std::string& name : known_engines()) {
    if (name != kOwnEngine && std::ranges::count(installed_engines(), name) == 0)
      missing += " " + name;
  }
  if (!missing.empty())
    GTEST_SKIP() << "in make test-all: not installed (scripts/install-dependencies engines):"
                 << missing;
}

TEST(EngineLoader, RefusesWhatIsNotThereByName) {
  const auto unknown = load_engine("mujoko");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().to_string(),
            "sim.engine: there is no engine 'mujoko' beside Tandem's own (did you mean 'mujoco'?)");
  for (const std::string& name : known_engines()) {
    if (name == kOwnEngine || std::ranges::count(installed_engines(), name) != 0) continue;
    const auto missing = load_engine(name);
    ASSERT_FALSE(missing);
    EXPECT_NE(missing.error().to_string().find("'" + name + "' is not installed"),
              std::string::npos);
    EXPECT_NE(missing.error().hint.find("apt-get install lib" + name + "-dev"), std::string::npos);
  }
}

}  // namespace
}  // namespace tandem::sim
