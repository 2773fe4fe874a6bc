// Derivatives of inverse and forward dynamics against differences of dynamics that are computed
// another way: sums over the links, by Jacobians in the world (tests/support/sums_over_links.hpp).
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdlib>

#include "model/emit.hpp"
#include "model/kernel_build.hpp"
#include "model/kernel_check.hpp"
#include "model/kernel_library.hpp"
#include "model/lanes.hpp"
#include "tests/model/random_robot.hpp"
#include "tests/model/reference.hpp"
#include "tests/support/scratch_folder.hpp"
#include "tests/support/sums_over_links.hpp"

namespace tandem::model {
namespace {

constexpr double kStep = 1e-5;
constexpr double kDifferenceTolerance = 1e-7;

// q with element `k` of v's order moved; of a floating base in its own frame.
Array displaced(const Mechanism& m, Array q, int k, double step) {
  if (!m.floating_base || k >= 6) {
    q[static_cast<std::size_t>(m.floating_base ? k + 1 : k)] += step;
    return q;
  }
  const Eigen::Quaterniond base(q[6], q[3], q[4], q[5]);
  const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k % 3);
  if (k < 3) {
    const Eigen::Vector3d moved = base * axis * step;
    for (std::size_t i = 0; i < 3; ++i) q[i] += moved[static_cast<Eigen::Index>(i)];
  } else {
    Eigen::Map<Eigen::Vector4d>(q.data() + 3) =
        (base * Eigen::Quaterniond(Eigen::AngleAxisd(step, axis))).coeffs();
  }
  return q;
}

using Dynamics = std::function<Array(const Array& q, const Array& v)>;

// Central differences to q and v, row-major.
Arrays differences(const Mechanism& m, const SeededState& state, const Dynamics& dynamics) {
  const std::size_t nv = state.v.size();
  Arrays result(2, Array(nv * nv));
  for (std::size_t k = 0; k < nv; ++k) {
    const auto column = [&](Array& matrix, const Array& after, const Array& before) {
      for (std::size_t i = 0; i < nv; ++i)
        matrix[i * nv + k] = (after[i] - before[i]) / (2.0 * kStep);
    };
    const auto at_q = [&](double step) {
      return dynamics(displaced(m, state.q, static_cast<int>(k), step), state.v);
    };
    const auto at_v = [&](double step) {
      Array v = state.v;
      v[k] += step;
      return dynamics(state.q, v);
    };
    column(result[0], at_q(kStep), at_q(-kStep));
    column(result[1], at_v(kStep), at_v(-kStep));
  }
  return result;
}

struct Robot {
  Tree tree;
  ModelSpec spec;
};

// Both kernels of a robot without followers.
void check(const Robot& robot, unsigned seed) {
  const Mechanism m = *make_mechanism(robot.tree, robot.spec);
  const SeededState state(m, seed);
  const auto differences_of = [&](Kernel kernel, const Array& in) {
    return differences(m, state, [&](const Array& q, const Array& v) {
      return SumsOverLinks(robot.tree, robot.spec, q, v)
          .outputs(kernel, {q, v, in, state.wrench})[0];
    });
  };
  const SumsOverLinks truth(robot.tree, robot.spec, state.q, state.v);
  const Arrays inverse = evaluate_kernel(Kernel::kInverseDynamicsDerivatives, m,
                                         state.of(Kernel::kInverseDynamicsDerivatives));
  const Arrays of_inverse = differences_of(Kernel::kInverseDynamics, state.vdot);
  EXPECT_LE(relative_error(inverse[0], of_inverse[0]), kDifferenceTolerance) << seed;
  EXPECT_LE(relative_error(inverse[1], of_inverse[1]), kDifferenceTolerance) << seed;
  EXPECT_LE(relative_error(inverse[2], truth.outputs(Kernel::kMassMatrix, {state.q})[0]), 1e-11);

  const Arrays forward = evaluate_kernel(Kernel::kForwardDynamicsDerivatives, m,
                                         state.of(Kernel::kForwardDynamicsDerivatives));
  const Arrays of_forward = differences_of(Kernel::kForwardDynamics, state.tau);
  EXPECT_LE(relative_error(forward[0], of_forward[0]), kDifferenceTolerance) << seed;
  EXPECT_LE(relative_error(forward[1], of_forward[1]), kDifferenceTolerance) << seed;
  const auto n = static_cast<Eigen::Index>(state.v.size());
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Matrix unit =
      truth.mass_matrix().cast<double>() * Eigen::Map<const Matrix>(forward[2].data(), n, n);
  EXPECT_LE((unit - Matrix::Identity(n, n)).lpNorm<Eigen::Infinity>(), 1e-9) << seed;
}

class RobotDerivatives : public testing::TestWithParam<ReferenceRobot> {};

TEST_P(RobotDerivatives, AreTheDifferencesOfTheDynamicsWithWrenchesAndArmature) {
  Robot robot{reference_tree(GetParam()), reference_spec(GetParam())};
  for (std::size_t j = 0; j < robot.tree.joints.size(); j += 2)
    robot.spec.armature.emplace_back(robot.tree.joints[j].name, 0.05);
  check(robot, 3);
}

INSTANTIATE_TEST_SUITE_P(Robots, RobotDerivatives, testing::ValuesIn(kReferenceRobots),
                         [](const auto& test) { return std::string(test.param.name); });

// Prismatic joints anywhere, on a base of either kind. Masses of one decade: differences of
// accelerations cannot tell more where light links hang on heavy ones.
TEST(Derivatives, OfRandomRobotsAreTheDifferencesOfTheirDynamics) {
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    const RandomRobotOptions options{.joints = 3 + static_cast<int>(seed % 7),
                                     .floating_base = seed % 2 == 1,
                                     .mass_decades = 1};
    auto read = parse_urdf(RandomRobot(seed, options).urdf(), "random.urdf",
                           {.floating_base = options.floating_base});
    ASSERT_TRUE(read);
    Robot robot{std::move(read->tree), {}};
    robot.spec.robot = "random";
    robot.spec.floating_base = options.floating_base;
    robot.spec.sites = {{"tip", "tip", {}, {}, true},
                        {"other", "link1", {0.1, -0.2, 0.3}, {0.4, 0.5, 0.6}, true}};
    check(robot, static_cast<unsigned>(seed) + 5);
  }
}

// Chosen frames and regrouped inertias, as code and its pairs have them, against neither.
TEST(Derivatives, AreTheSameInChosenFramesAndAsExpressions) {
  for (const ReferenceRobot& robot : kReferenceRobots) {
    const Tree tree = reference_tree(robot);
    const Mechanism m = reference_mechanism(robot);
    const Mechanism described = *make_mechanism(tree, reference_spec(robot), Frames::kAsDescribed);
    const Kernel kernel = Kernel::kInverseDynamicsDerivatives;
    Graph graph;
    const TracedKernel traced = trace_kernel(kernel, m, graph);
    const Arrays in = SeededState(m, 8).of(kernel);
    const Array actual = evaluate(graph, traced.outputs, in);
    Array expected;
    for (const Array& matrix : evaluate_kernel(kernel, described, in))
      expected.insert(expected.end(), matrix.begin(), matrix.end());
    EXPECT_LE(relative_error(actual, expected), 1e-12) << robot.name;
  }
}

TEST(Derivatives, OfMirroredLimbsAreComputedInPairs) {
  const Mechanism m = reference_mechanism(reference_robot("coman"));
  Graph graph;
  const TracedKernel traced = trace_kernel(Kernel::kInverseDynamicsDerivatives, m, graph);
  const OperationCount count = count_operations(graph, traced.outputs);
  EXPECT_GT(pair_lanes(graph, traced, m).operations, 4 * (count.add + count.mul) / 10);
}

// Followers above, below and beside their leaders, in one limb and across.
TEST(Derivatives, OfFollowersAreTheDifferencesOfTheDynamicsOfTheirCoordinates) {
  struct Coupling {
    const char *robot, *follower, *leader;
    double multiplier;
  };
  for (const Coupling& c : {Coupling{"ur5e", "shoulder_lift_joint", "wrist_2_joint", -2.0},
                            {"ur5e", "wrist_1_joint", "elbow_joint", 0.7},
                            {"panda", "panda_finger_joint2", "panda_finger_joint1", 1.0},
                            {"coman", "LElbj", "RElbj", -1.0}}) {
    Tree tree = reference_tree(reference_robot(c.robot));
    Joint& joint = tree.joints.at(static_cast<std::size_t>(tree.joint_index(c.follower)));
    joint.leader = tree.joint_index(c.leader);
    joint.multiplier = c.multiplier;
    joint.offset = 0.1;
    const Mechanism m = *make_mechanism(tree, reference_spec(reference_robot(c.robot)));
    const SeededState state(m, 4);
    for (const auto& [kernel, of, in] :
         {std::tuple(Kernel::kInverseDynamics, Kernel::kInverseDynamicsDerivatives, state.vdot),
          {Kernel::kForwardDynamics, Kernel::kForwardDynamicsDerivatives, state.tau}}) {
      const Arrays expected = differences(m, state, [&](const Array& q, const Array& v) {
        return evaluate_kernel(kernel, m, {q, v, in, state.wrench})[0];
      });
      const Arrays actual = evaluate_kernel(of, m, {state.q, state.v, in, state.wrench});
      EXPECT_LE(relative_error(actual[0], expected[0]), kDifferenceTolerance) << c.follower;
      EXPECT_LE(relative_error(actual[1], expected[1]), kDifferenceTolerance) << c.follower;
    }
  }
}

// In make test-all, for compiling it takes a minute. build_kernels() compares every variant.
TEST(Derivatives, OfAHumanoidAreCompiled) {
  if (std::getenv("TANDEM_DERIVATIVES_ALL") == nullptr)
    GTEST_SKIP()
        << "in make test-all: TANDEM_DERIVATIVES_ALL=1 compiles those of COMAN and of iCub";
  for (const char* name : {"coman", "icub"}) {
    const test::ScratchFolder folder;
    ModelSpec spec = reference_spec(reference_robot(name));
    spec.derivatives = true;
    const auto built = build_kernels(
        reference_tree(reference_robot(name)), spec,
        {.library = folder / "k.so", .compiler = {}, .jobs = 0, .progress = {}, .waiting = {}});
    EXPECT_TRUE(built) << built.error().to_string();
  }
}

}  // namespace
}  // namespace tandem::model
