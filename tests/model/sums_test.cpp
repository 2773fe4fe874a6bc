#include <gtest/gtest.h>

#include <random>

#include "model/sums.hpp"
#include "tests/model/reference.hpp"

namespace tandem::model {
namespace {

struct SumsTest : testing::Test {
  Graph written;
  Graph ordered;
  std::vector<Expr> x;

  SumsTest() {
    for (std::uint32_t i = 0; i < 6; ++i) x.push_back(written.input(0, i));
  }
  Expr order(const Expr& output) {
    return ordered_sums(written, std::vector{output}, {}, ordered).outputs[0];
  }
  [[nodiscard]] const GraphNode& node(std::uint32_t i) const { return ordered.nodes()[i]; }
};

// 1 / x0 is known last: the other four terms are added before.
TEST_F(SumsTest, AddWhatIsKnownLastAtTheEnd) {
  const Expr late = Expr(1.0) / x[0];
  const Expr sum = order(late * x[1] - x[2] + x[3] * x[4] - x[5]);
  const GraphNode& last = node(sum.node());
  ASSERT_TRUE(last.op == Op::kAdd || last.op == Op::kSub);
  const bool a = node(last.a).op == Op::kMul && node(node(last.a).a).op != Op::kInput;
  const bool b = node(last.b).op == Op::kMul && node(node(last.b).b).op != Op::kInput;
  EXPECT_TRUE(a || b);
}

TEST_F(SumsTest, AreWorthTheSameAndTakeNoMoreOperations) {
  const Expr late = sin(x[0]) / (x[1] - x[2]);
  const Expr shared = x[3] * x[4] + x[5];
  const std::vector<Expr> outputs{late * late - shared + x[0] - Expr(2.0) * shared, shared, -late,
                                  Expr(3.0), Expr(1.0) - x[0] - late * x[5]};
  const OrderedSums sums = ordered_sums(written, outputs, {}, ordered);
  const std::vector<std::vector<double>> inputs{{0.3, 1.7, -0.4, 2.0, 0.9, -1.1}};
  const auto expected = evaluate(written, outputs, inputs);
  const auto values = evaluate(ordered, sums.outputs, inputs);
  for (std::size_t i = 0; i < outputs.size(); ++i) EXPECT_NEAR(values[i], expected[i], 1e-14) << i;
  EXPECT_EQ(count_operations(ordered, sums.outputs).add, count_operations(written, outputs).add);
  EXPECT_EQ(count_operations(ordered, sums.outputs).mul, count_operations(written, outputs).mul);
}

// A term twice is two terms.
TEST_F(SumsTest, KeepATermThatStandsTwice) {
  const Expr twice = x[0] * x[1];
  const Expr sum = order(twice - x[2] + (twice - x[3]));
  const std::vector<std::vector<double>> inputs{{2.0, 3.0, 1.0, 1.0, 0.0, 0.0}};
  EXPECT_EQ(evaluate(ordered, std::vector{sum}, inputs)[0], 10.0);
}

TEST_F(SumsTest, OfANegativeRootAreStillItsSquare) {
  const Expr root = order(sqrt(x[0] - x[1] / x[2]));
  const std::vector<std::vector<double>> inputs{{5.0, 2.0, 2.0, 0.0, 0.0, 0.0}};
  EXPECT_EQ(evaluate(ordered, std::vector{root}, inputs)[0], 2.0);
}

// The same bytes whatever stood in memory before.
TEST_F(SumsTest, OfARobotAreTheSameEveryTime) {
  const ReferenceRobot& reference = reference_robot("anymal_c");
  const Mechanism m = *make_mechanism(reference_tree(reference), reference_spec(reference));
  std::vector<std::string> first;
  for (int round = 0; round < 3; ++round) {
    const std::vector<double> litter(100'000 * (round + 1), 1e300);
    Graph graph;
    const TracedKernel kernel = trace_kernel(Kernel::kForwardDynamics, m, graph);
    SineTable sines;
    const EmittedKernel emitted = emit_kernel(graph, kernel, m, sines, 500);
    if (round == 0) first = emitted.parts;
    EXPECT_EQ(emitted.parts, first);
  }
}

}  // namespace
}  // namespace tandem::model
