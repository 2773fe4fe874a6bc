#include <gtest/gtest.h>

#include <cmath>

#include "model/expression.hpp"

namespace tandem::model {
namespace {

struct ExpressionTest : testing::Test {
  Graph graph;
  Expr x = graph.input(0, 0);
  Expr y = graph.input(0, 1);

  [[nodiscard]] OperationCount count(std::vector<Expr> outputs) const {
    return count_operations(graph, outputs);
  }
  [[nodiscard]] double value(const Expr& output, double x_value, double y_value) const {
    const std::vector<Array> inputs{{x_value, y_value}};
    return evaluate(graph, std::vector<Expr>{output}, inputs)[0];
  }
  using Array = std::vector<double>;
};

TEST_F(ExpressionTest, EqualExpressionsAreOneNode) {
  const Expr a = (x + y) * x;
  const Expr b = x * (y + x);
  EXPECT_EQ(a.node(), b.node());
}

TEST_F(ExpressionTest, AnExpressionAndItsNegativeAreOneNode) {
  const Expr a = x - y;
  const Expr b = y - x;
  EXPECT_EQ(a.node(), b.node());
  EXPECT_NE(a.negative(), b.negative());
  const OperationCount both = count({a * x, b * x});
  EXPECT_EQ(both.add, 1u);
  EXPECT_EQ(both.mul, 1u);
}

TEST_F(ExpressionTest, ConstantsFold) {
  const Expr folded = Expr(2.0) * Expr(3.0) - Expr(1.0);
  ASSERT_TRUE(folded.is_constant());
  EXPECT_EQ(folded.value(), 5.0);
  EXPECT_EQ(count({(x * 2.0) * 3.0}).mul, 1u);
  EXPECT_EQ(value((x * 2.0) * 3.0, 5.0, 0.0), 30.0);
}

// As a node it is a scalar among a batch's vectors, which do not compile.
TEST_F(ExpressionTest, WhatIsLeftOfASumIsAConstantIfItIsOne) {
  for (const Expr& left : {(x + 2.0) - x, (x - 2.0) - x, x - (x - 2.0), (2.0 - x) + x}) {
    ASSERT_TRUE(left.is_constant());
    EXPECT_EQ(std::abs(left.value()), 2.0);
    EXPECT_TRUE((left * 3.0 + 1.0).is_constant());
  }
  EXPECT_EQ(((x - 2.0) - x).value(), -2.0);
}

TEST_F(ExpressionTest, ZerosAndOnesVanish) {
  EXPECT_TRUE((x * 0.0).is_constant());
  EXPECT_EQ((x * 1.0).node(), x.node());
  EXPECT_EQ((x + 0.0).node(), x.node());
  EXPECT_EQ((0.0 - x).node(), x.node());
  EXPECT_TRUE((0.0 - x).negative());
  EXPECT_TRUE((x - x).is_constant());
  EXPECT_EQ(((x + y) - y).node(), x.node());
  EXPECT_EQ((y - (y - x)).node(), x.node());
}

TEST_F(ExpressionTest, SignsLeaveProductsQuotientsAndSines) {
  EXPECT_EQ((-x * y).node(), (x * -y).node());
  EXPECT_EQ((-x * -y).node(), (x * y).node());
  EXPECT_FALSE((-x * -y).negative());
  EXPECT_EQ((-x / y).node(), (x / y).node());
  EXPECT_TRUE(sin(-x).negative());
  EXPECT_FALSE(cos(-x).negative());
}

TEST_F(ExpressionTest, OnlyWhatTheOutputsNeedIsCounted) {
  const Expr dead = x * y;
  const Expr alive = x + y;
  EXPECT_EQ(count({alive}).mul, 0u);
  EXPECT_EQ(count({dead, alive}).mul, 1u);
}

TEST_F(ExpressionTest, SineAndCosineOfOneAngleCountOnce) {
  const OperationCount c = count({sin(x), cos(x), sin(y)});
  EXPECT_EQ(c.sincos, 2u);
}

TEST_F(ExpressionTest, EvaluatesWhatItSays) {
  const Expr e = sqrt(x * x + y * y) / (y - x) + sin(x) * cos(-y);
  EXPECT_NEAR(value(e, 3.0, 4.0), 5.0 + std::sin(3.0) * std::cos(4.0), 1e-15);
}

}  // namespace
}  // namespace tandem::model
