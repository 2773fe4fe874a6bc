// Followers (URDF: mimic) in the dynamics, against the same tree with a coordinate for every
// joint and the constraint q_tree = G q + g applied from outside.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "model/emit.hpp"
#include "model/interpreted_kernels.hpp"
#include "model/kernel_build.hpp"
#include "model/kernel_library.hpp"
#include "model/lanes.hpp"
#include "model/placements.hpp"
#include "model/regular.hpp"
#include "tests/model/reference.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::model {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Eigen::VectorXd;

struct Coupling {
  const char* follower;
  const char* leader;
  double multiplier;
  double offset;
};

// A public robot with followers beside, above and below their leaders, in one limb and across.
struct CoupledRobot {
  const char* name;
  std::vector<Coupling> couplings;
};
void PrintTo(const CoupledRobot& robot, std::ostream* out) { *out << robot.name; }

const std::vector<CoupledRobot> kCoupledRobots{
    {"panda", {{"panda_finger_joint2", "panda_finger_joint1", 1.0, 0.0}}},
    {"double_pendulum", {{"joint2", "joint1", -0.5, 0.3}}},
    {"ur5e",
     {{"shoulder_lift_joint", "wrist_2_joint", -2.0, 0.1},  // above its leader
      {"wrist_1_joint", "elbow_joint", 0.7, -0.4}}},        // below
    {"coman",
     {{"LElbj", "RElbj", -1.0, 0.0},
      {"WaistSag", "WaistLat", 0.5, 0.2},
      {"RKneeSag", "LKneeSag", 1.0, 0.0}}},
};

struct Coupled {
  Mechanism free;     // every joint a coordinate
  Mechanism follows;  // the same with followers
  Matrix G;           // v_free = G v
  VectorXd offsets;   // of the joints

  explicit Coupled(const CoupledRobot& robot) {
    const ReferenceRobot& reference = reference_robot(robot.name);
    ModelSpec spec = reference_spec(reference);
    Tree tree = reference_tree(reference);
    for (std::size_t j = 0; j < tree.joints.size(); j += 3)
      spec.armature.emplace_back(tree.joints[j].name, 0.05);
    free = *make_mechanism(tree, spec);
    for (const Coupling& c : robot.couplings) {
      Joint& joint = tree.joints.at(static_cast<std::size_t>(tree.joint_index(c.follower)));
      joint.leader = tree.joint_index(c.leader);
      EXPECT_GE(joint.leader, 0) << c.leader;
      joint.multiplier = c.multiplier;
      joint.offset = c.offset;
    }
    follows = *make_mechanism(tree, spec);
    const int base = free.v_index(0);
    G = Matrix::Zero(free.nv(), tree.nv());
    G.topLeftCorner(base, base).setIdentity();
    offsets = VectorXd::Zero(static_cast<int>(tree.joints.size()));
    std::vector<int> column(tree.joints.size(), -1);
    int next = base;
    for (std::size_t j = 0; j < tree.joints.size(); ++j)
      if (!tree.joints[j].follows()) column[j] = next++;
    for (std::size_t j = 0; j < tree.joints.size(); ++j) {
      const Joint& joint = tree.joints[j];
      const auto from = joint.follows() ? static_cast<std::size_t>(joint.leader) : j;
      G(base + static_cast<int>(j), column[from]) = joint.follows() ? joint.multiplier : 1.0;
      offsets[static_cast<int>(j)] = joint.follows() ? joint.offset : 0.0;
    }
  }

  [[nodiscard]] Array rates(const Array& v) const {
    const VectorXd all = G * Eigen::Map<const VectorXd>(v.data(), G.cols());
    return {all.begin(), all.end()};
  }
  [[nodiscard]] Array positions(const Array& q) const {
    const int base_v = free.v_index(0);
    const Array joints(q.begin() + free.q_index(0), q.end());
    const VectorXd all =
        G.bottomRightCorner(free.joint_count(), G.cols() - base_v) *
            Eigen::Map<const VectorXd>(joints.data(), static_cast<int>(joints.size())) +
        offsets;
    Array result(q.begin(), q.begin() + free.q_index(0));
    result.insert(result.end(), all.begin(), all.end());
    return result;
  }
  [[nodiscard]] Array forces(const Array& tau) const {
    const VectorXd all = G.transpose() * Eigen::Map<const VectorXd>(tau.data(), G.rows());
    return {all.begin(), all.end()};
  }
  [[nodiscard]] Array columns(const Array& J) const {
    const int rows = static_cast<int>(J.size()) / static_cast<int>(G.rows());
    const Matrix all = Eigen::Map<const Matrix>(J.data(), rows, G.rows()) * G;
    return {all.data(), all.data() + all.size()};
  }
};

struct State {
  Array q, v, vdot, wrench;
  State(const Mechanism& m, unsigned seed) {
    std::mt19937 generator(seed);
    const auto array = [&](int size) {
      Array values;
      for (int i = 0; i < size; ++i)
        values.push_back(-1.5 + 3.0 * static_cast<double>(generator()) / 4294967296.0);
      return values;
    };
    q = array(m.kernel_nq());
    v = array(m.kernel_nv());
    vdot = array(m.kernel_nv());
    wrench = array(6 * m.wrenches);
    if (m.floating_base) Eigen::Map<Eigen::Vector4d>(q.data() + 3).normalize();
  }
};

class Followers : public testing::TestWithParam<CoupledRobot> {};

TEST_P(Followers, HaveTheTreesOwnMassMatrixForcesAndJacobiansWithTheConstraintApplied) {
  const Coupled robot(GetParam());
  const Mechanism& m = robot.follows;
  EXPECT_EQ(m.kernel_nv() + static_cast<int>(GetParam().couplings.size()), robot.free.nv());
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const State s(m, seed);
    const Array q = robot.positions(s.q);
    const Array v = robot.rates(s.v);
    const Array vdot = robot.rates(s.vdot);
    const auto ours = [&](Kernel kernel, const Arrays& in) {
      return evaluate_kernel(kernel, m, in);
    };
    const auto tree = [&](Kernel kernel, const Arrays& in) {
      return evaluate_kernel(kernel, robot.free, in);
    };
    const Array M = tree(Kernel::kMassMatrix, {q})[0];
    const Matrix reduced = robot.G.transpose() *
                           Eigen::Map<const Matrix>(M.data(), robot.G.rows(), robot.G.rows()) *
                           robot.G;
    EXPECT_LE(relative_error(ours(Kernel::kMassMatrix, {s.q})[0],
                             Array(reduced.data(), reduced.data() + reduced.size())),
              1e-14);
    EXPECT_LE(relative_error(ours(Kernel::kBias, {s.q, s.v})[0],
                             robot.forces(tree(Kernel::kBias, {q, v})[0])),
              1e-14);
    EXPECT_LE(
        relative_error(ours(Kernel::kInverseDynamics, {s.q, s.v, s.vdot, s.wrench})[0],
                       robot.forces(tree(Kernel::kInverseDynamics, {q, v, vdot, s.wrench})[0])),
        1e-14);
    const Arrays momentum = ours(Kernel::kGeneralisedMomentum, {s.q, s.v, s.wrench});
    const Arrays of_tree = tree(Kernel::kGeneralisedMomentum, {q, v, s.wrench});
    for (std::size_t k = 0; k < 2; ++k)
      EXPECT_LE(relative_error(momentum[k], robot.forces(of_tree[k])), 1e-14);
    EXPECT_LE(relative_error(ours(Kernel::kSiteJacobians, {s.q})[0],
                             robot.columns(tree(Kernel::kSiteJacobians, {q})[0])),
              1e-14);
    const Arrays com = ours(Kernel::kCenterOfMass, {s.q, s.v});
    const Arrays com_of_tree = tree(Kernel::kCenterOfMass, {q, v});
    EXPECT_LE(relative_error(com[0], com_of_tree[0]), 1e-14);
    EXPECT_LE(relative_error(com[1], com_of_tree[1]), 1e-14);
    EXPECT_LE(relative_error(com[2], robot.columns(com_of_tree[2])), 1e-14);
    // The same algorithm, over frames that may differ: an arm with a follower is like no other.
    const auto expect_equal = [&](Kernel kernel, const Arrays& in, const Arrays& in_tree) {
      const Arrays expected = tree(kernel, in_tree);
      const Arrays actual = ours(kernel, in);
      for (std::size_t k = 0; k < expected.size(); ++k)
        EXPECT_LE(relative_error(actual[k], expected[k]), 1e-14) << static_cast<int>(kernel);
    };
    expect_equal(Kernel::kEnergy, {s.q, s.v}, {q, v});
    expect_equal(Kernel::kCentroidalMomentum, {s.q, s.v}, {q, v});
    expect_equal(Kernel::kSiteMotion, {s.q, s.v, s.vdot}, {q, v, vdot});
    expect_equal(Kernel::kSensorWrenches, {s.q, s.v, s.vdot, s.wrench}, {q, v, vdot, s.wrench});
  }
}

// The other road: every joint free, held together by multipliers (d'Alembert), solved at once.
TEST_P(Followers, AccelerateAsTheTreeHeldTogetherByForcesThatDoNoWork) {
  const Coupled robot(GetParam());
  const int n = robot.free.nv();
  const int count = static_cast<int>(GetParam().couplings.size());
  const State s(robot.follows, 4);
  Array tau(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) tau[static_cast<std::size_t>(i)] = 3.0 * std::sin(i + 1.0);
  const Array q = robot.positions(s.q);
  const Array v = robot.rates(s.v);
  const Array none(static_cast<std::size_t>(n), 0.0);
  const Array M = evaluate_kernel(Kernel::kMassMatrix, robot.free, {q})[0];
  const Array h = evaluate_kernel(Kernel::kInverseDynamics, robot.free, {q, v, none, s.wrench})[0];
  // A vdot = 0 for every follower: A's rows are orthogonal to G's columns.
  const Matrix A = Eigen::FullPivLU<Matrix>(robot.G.transpose()).kernel().transpose();
  ASSERT_EQ(A.rows(), count);
  Matrix kkt = Matrix::Zero(n + count, n + count);
  kkt.topLeftCorner(n, n) = Eigen::Map<const Matrix>(M.data(), n, n);
  kkt.topRightCorner(n, count) = A.transpose();
  kkt.bottomLeftCorner(count, n) = A;
  VectorXd right = VectorXd::Zero(n + count);
  for (int i = 0; i < n; ++i)
    right[i] = tau[static_cast<std::size_t>(i)] - h[static_cast<std::size_t>(i)];
  const VectorXd solution = kkt.fullPivLu().solve(right);
  const Array expected(solution.begin(), solution.begin() + n);
  const Array vdot = evaluate_kernel(Kernel::kForwardDynamics, robot.follows,
                                     {s.q, s.v, robot.forces(tau), s.wrench})[0];
  EXPECT_LE(relative_error(robot.rates(vdot), expected), 1e-10);
}

TEST_P(Followers, ForwardUndoesInverseDynamicsAsCodeAndOnDoubles) {
  const Coupled robot(GetParam());
  const Mechanism& m = robot.follows;
  Graph graph;
  const TracedKernel traced = trace_kernel(Kernel::kForwardDynamics, m, graph);
  for (unsigned seed = 5; seed <= 7; ++seed) {
    const State s(m, seed);
    const Array tau = evaluate_kernel(Kernel::kInverseDynamics, m, {s.q, s.v, s.vdot, s.wrench})[0];
    const Arrays in{s.q, s.v, tau, s.wrench};
    EXPECT_LE(relative_error(evaluate_kernel(Kernel::kForwardDynamics, m, in)[0], s.vdot), 1e-10);
    EXPECT_LE(relative_error(evaluate(graph, traced.outputs, in), s.vdot), 1e-10);
  }
}

TEST_P(Followers, LeaveThePassiveRobotItsEnergy) {
  const Coupled robot(GetParam());
  const Mechanism& m = robot.follows;
  if (m.floating_base) return;  // the joints' part is the same; identities_test has the base's
  const State start(m, 8);
  const Array none(start.v.size(), 0.0);
  const Array free(start.wrench.size(), 0.0);
  Array q = start.q;
  Array v = start.v;
  const auto energy = [&] {
    const Array e = evaluate_kernel(Kernel::kEnergy, m, {q, v})[0];
    return e[0] + e[1];
  };
  const auto plus = [](Array a, const Array& b, double scale) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] += scale * b[i];
    return a;
  };
  const auto rate = [&](const Array& at_q, const Array& at_v) {
    return evaluate_kernel(Kernel::kForwardDynamics, m, {at_q, at_v, none, free})[0];
  };
  const double before = energy();
  const double h = 1e-4;
  for (int i = 0; i < 500; ++i) {
    const Array a1 = rate(q, v);
    const Array v2 = plus(v, a1, h / 2);
    const Array a2 = rate(plus(q, v, h / 2), v2);
    const Array v3 = plus(v, a2, h / 2);
    const Array a3 = rate(plus(q, v2, h / 2), v3);
    const Array v4 = plus(v, a3, h);
    const Array a4 = rate(plus(q, v3, h), v4);
    q = plus(plus(plus(plus(q, v, h / 6), v2, h / 3), v3, h / 3), v4, h / 6);
    v = plus(plus(plus(plus(v, a1, h / 6), a2, h / 3), a3, h / 3), a4, h / 6);
  }
  EXPECT_GT(relative_error(v, start.v), 1e-3);
  EXPECT_NEAR(energy(), before, 1e-8 * std::abs(before));
}

// Where nothing is compiled: what `tandem check` says of weak drives comes from them.
TEST_P(Followers, AreNoCoordinatesOfInterpretedKernels) {
  const Coupled robot(GetParam());
  const Mechanism& m = robot.follows;
  const State s(m, 8);
  const InterpretedKernels kernels(m);
  ASSERT_EQ(kernels.get()->nv, static_cast<std::uint32_t>(m.kernel_nv()));
  ASSERT_EQ(kernels.get()->nv - kernels.get()->joints, m.floating_base ? 6u : 0u);
  Array h(kernels.get()->nv), M(h.size() * h.size()), tau(h.size());
  kernels.get()->bias(s.q.data(), s.v.data(), h.data());
  kernels.get()->mass_matrix(s.q.data(), M.data());
  kernels.get()->inverse_dynamics(s.q.data(), s.v.data(), s.vdot.data(), s.wrench.data(),
                                  tau.data());
  EXPECT_EQ(h, evaluate_kernel(Kernel::kBias, m, {s.q, s.v})[0]);
  EXPECT_EQ(M, evaluate_kernel(Kernel::kMassMatrix, m, {s.q})[0]);
  EXPECT_EQ(tau, evaluate_kernel(Kernel::kInverseDynamics, m, {s.q, s.v, s.vdot, s.wrench})[0]);
}

INSTANTIATE_TEST_SUITE_P(Robots, Followers, testing::ValuesIn(kCoupledRobots),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(Mimic, RobotsWithoutFollowersKeepTheArticulatedBodyAlgorithmToTheLastOperation) {
  const Mechanism m = reference_mechanism(reference_robot("coman"));
  ASSERT_FALSE(m.has_followers());
  Graph graph;
  const TracedKernel kernel = trace_kernel(Kernel::kForwardDynamics, m, graph);
  Graph tree_graph;
  std::vector<std::vector<Expr>> in;
  for (std::uint32_t a = 0; a < kernel.shape.inputs.size(); ++a) {
    in.emplace_back();
    for (int i = 0; i < kernel.shape.inputs[a].size; ++i)
      in.back().push_back(tree_graph.input(a, static_cast<std::uint32_t>(i)));
  }
  std::vector<std::vector<Expr>> out{std::vector<Expr>(static_cast<std::size_t>(m.nv()))};
  run_tree_kernel<Expr>(Kernel::kForwardDynamics, m, in, out);
  SineTable sines, of_tree;
  EXPECT_EQ(emit_kernel(graph, kernel, m, sines, 500).parts,
            emit_kernel(tree_graph, {kernel.shape, out[0]}, m, of_tree, 500).parts);
}

TEST(Mimic, AFollowersMassIsEnoughForItsLeader) {
  const ReferenceRobot& reference = reference_robot("double_pendulum");
  Tree tree = reference_tree(reference);
  tree.joints[0].leader = 1;  // the joint near the base follows
  tree.bodies[2].inertia = {};
  for (Link& link : tree.links)
    if (link.body == 2) link.inertia = {};
  EXPECT_TRUE(check_regular(tree, reference_spec(reference), {}));
  tree.joints[0].leader = -1;
  const Status alone = check_regular(tree, reference_spec(reference), {});
  ASSERT_FALSE(alone);
  EXPECT_NE(alone.error().message.find("joint 'joint2'"), std::string::npos)
      << alone.error().message;
}

// The generated text itself: angles that are products, compiled.
TEST(Mimic, CompiledKernelsComputeWhatTheAlgorithmsDoOnDoubles) {
  const test::ScratchFolder folder;
  const ReferenceRobot& reference = reference_robot("double_pendulum");
  Tree tree = reference_tree(reference);
  tree.joints[1].leader = 0;
  tree.joints[1].multiplier = -0.5;
  tree.joints[1].offset = 0.3;
  ModelSpec spec = reference_spec(reference);
  spec.derivatives = true;  // build_kernels() checks them
  EXPECT_NE(description_hash(tree, spec), description_hash(reference_tree(reference), spec));
  const std::string library = folder / "k.so";
  const auto built = build_kernels(
      tree, spec, {.library = library, .compiler = {}, .jobs = 1, .progress = {}, .waiting = {}});
  ASSERT_TRUE(built) << built.error().to_string();
  const auto kernels = load_kernels(library, built->hash);
  ASSERT_TRUE(kernels);
  const tandem_kernels& k = **kernels;
  const Mechanism m = *make_mechanism(tree, spec);
  ASSERT_EQ(k.nq, 1u);
  ASSERT_EQ(k.joints, 1u);
  EXPECT_STREQ(k.joint_names[0], tree.joints[0].name.c_str());
  const State s(m, 9);
  Array vdot(1);
  k.forward_dynamics(s.q.data(), s.v.data(), s.vdot.data(), s.wrench.data(), vdot.data());
  EXPECT_LE(relative_error(vdot, evaluate_kernel(Kernel::kForwardDynamics, m,
                                                 {s.q, s.v, s.vdot, s.wrench})[0]),
            1e-13);
  Array J(6 * k.sites);
  k.site_jacobians(s.q.data(), J.data());
  EXPECT_LE(relative_error(J, evaluate_kernel(Kernel::kSiteJacobians, m, {s.q})[0]), 1e-14);
}

TEST(Placements, PutFollowersWhereTheKernelsDo) {
  const ReferenceRobot& reference = reference_robot("coman");
  Tree tree = reference_tree(reference);
  const ModelSpec spec = reference_spec(reference);  // sites are the feet
  Joint& knee = tree.joints[static_cast<std::size_t>(tree.joint_index("RKneeSag"))];
  knee.leader = tree.joint_index("LKneeSag");
  knee.multiplier = -0.5;
  knee.offset = 0.2;
  const Mechanism m = *make_mechanism(tree, spec);
  Array q(static_cast<std::size_t>(m.kernel_nq()), 0.0);  // base first, then who follows nobody
  q[6] = 1.0;
  std::vector<double> position(tree.joints.size(), 0.0);
  std::size_t next = 7;
  for (std::size_t j = 0; j < tree.joints.size(); ++j)
    if (!tree.joints[j].follows()) q[next++] = position[j] = 0.1 + 0.01 * static_cast<double>(j);
  const Array rest(static_cast<std::size_t>(m.kernel_nv()), 0.0);
  const Array pose = evaluate_kernel(Kernel::kSiteMotion, m, {q, rest, rest})[0];
  const std::vector<Placement> bodies = place_bodies(tree, position);
  for (std::size_t s = 0; s < spec.sites.size(); ++s) {
    const Link& link = tree.links[static_cast<std::size_t>(tree.link_index(spec.sites[s].link))];
    const Placement at = bodies[static_cast<std::size_t>(link.body)] * link.in_body;
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(pose[12 * s + 9 + i], at.p[i], 1e-14);
  }
}

}  // namespace
}  // namespace tandem::model
