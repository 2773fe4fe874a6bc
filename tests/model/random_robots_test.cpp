// Random trees against the sums over their links: what holds for the robots at hand holds for
// any URDF. TANDEM_ROBOTS=10000 TANDEM_FIRST=0 choose how many and which; a failure names its seed.
#include <gtest/gtest.h>

#include <cstdlib>

#include "model/emit.hpp"
#include "model/kernel_check.hpp"
#include "model/lanes.hpp"
#include "model/sums.hpp"
#include "model/symmetric_eigen.hpp"
#include "tests/model/random_robot.hpp"
#include "tests/model/reference.hpp"
#include "tests/support/sums_over_links.hpp"

namespace tandem::model {
namespace {

constexpr double kTolerance = 1e-11;

long number_from(const char* variable, long otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtol(text, nullptr, 10);
}

struct RandomTree {
  Tree tree;
  ModelSpec spec;

  RandomTree(std::uint64_t seed, const RandomRobotOptions& options) {
    const RandomRobot robot(seed, options);
    auto read = parse_urdf(robot.urdf(), "random.urdf", {.floating_base = options.floating_base});
    if (!read) throw std::runtime_error(read.error().front().to_string() + "\n" + robot.urdf());
    tree = std::move(read->tree);
    spec.robot = "random";
    spec.floating_base = options.floating_base;
    spec.sites = {{"tip", "tip", {}, {}, true},
                  {"other", "link1", {0.1, -0.2, 0.3}, {0.4, 0.5, 0.6}, true}};
    for (const Joint* joint : {&tree.joints.front(), &tree.joints.back()}) {
      const int child = tree.child_link_index(joint->name);
      spec.sensors.push_back(
          {joint->name, joint->name, tree.links[static_cast<std::size_t>(child)].name});
      if (tree.joints.size() == 1) break;
    }
    if (seed % 3 == 0) spec.armature.emplace_back(tree.joints.front().name, 0.05);
  }
};

// The kernel as it is generated: its expressions, evaluated.
Arrays generated(Kernel kernel, const Mechanism& m, const Arrays& in) {
  Graph graph;
  const TracedKernel traced = trace_kernel(kernel, m, graph);
  Graph ordered;
  const OrderedSums sums =
      ordered_sums(graph, traced.outputs, pair_lanes(graph, traced, m), ordered);
  const Array all = evaluate(ordered, sums.outputs, in);
  Arrays out;
  auto next = all.begin();
  for (const KernelArray& array : traced.shape.outputs) {
    out.emplace_back(next, next + array.size);
    next += array.size;
  }
  return out;
}

// How far rounding alone may move forward dynamics: the condition of the scaled mass matrix.
double forward_tolerance(const SumsOverLinks& truth) {
  const Eigen::MatrixXd M = truth.mass_matrix().cast<double>();
  const Eigen::VectorXd scale = M.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * M * scale.asDiagonal();
  const Eigen::VectorXd values = symmetric_eigenvalues(scaled);
  const double condition = values.maxCoeff() / std::max(values.minCoeff(), 1e-300);
  return std::max(kTolerance, 16.0 * 2.2e-16 * condition);
}

void check_one(std::uint64_t seed, const RandomRobotOptions& options) {
  const RandomTree robot(seed, options);
  const Result<Mechanism> m = make_mechanism(robot.tree, robot.spec);
  ASSERT_TRUE(m) << m.error().to_string();
  const SeededState inputs(*m, static_cast<unsigned>(seed) + 77);
  const SumsOverLinks truth(robot.tree, robot.spec, inputs.q, inputs.v);
  for (int k = 0; k < kKernels; ++k) {
    const Kernel kernel = static_cast<Kernel>(k);
    const Arrays in = inputs.of(kernel);
    const Arrays expected = truth.outputs(kernel, in);
    const Arrays actual = generated(kernel, *m, in);
    ASSERT_EQ(actual.size(), expected.size());
    const double tolerance =
        kernel == Kernel::kForwardDynamics ? forward_tolerance(truth) : kTolerance;
    for (std::size_t i = 0; i < expected.size(); ++i)
      EXPECT_LE(kernel_error(kernel, m->mass_kg, actual[i], expected[i]), tolerance)
          << kernel_shape(kernel, *m).name << " output " << i << " of seed " << seed << ", "
          << options.joints << " joints, " << options.digits << " digits";
  }
}

// A part of all, so that they run side by side.
constexpr std::uint64_t kParts = 4;
class RandomRobots : public testing::TestWithParam<std::uint64_t> {};

TEST_P(RandomRobots, AgreeWithTheSumsOverTheirLinksInEveryKernel) {
  const auto first = static_cast<std::uint64_t>(number_from("TANDEM_FIRST", 0));
  const auto count = static_cast<std::uint64_t>(number_from("TANDEM_ROBOTS", 300));
  for (std::uint64_t seed = first + GetParam(); seed < first + count; seed += kParts)
    check_one(seed, options_of(seed, 60));
}

INSTANTIATE_TEST_SUITE_P(Part, RandomRobots, testing::Range<std::uint64_t>(0, kParts));

// Right angles of few digits make axes that are nearly parallel: 1.5708 is 3.7e-6 off.
class RightAngles : public testing::TestWithParam<int> {};

TEST_P(RightAngles, OfSoManyDigitsAreTakenAsTheyAreWritten) {
  for (std::uint64_t seed = 0; seed < 25; ++seed)
    check_one(seed, {.joints = 6,
                     .branching = 0.0,
                     .near_parallel = 0.0,
                     .right_angles = 0.9,
                     .digits = GetParam(),
                     .mass_decades = 1.0});
}

INSTANTIATE_TEST_SUITE_P(Digits, RightAngles, testing::Values(4, 5, 7, 8, 9, 10, 12));

}  // namespace
}  // namespace tandem::model
