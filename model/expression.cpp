// Hash-consing of nodes with constant folding; signs are kept beside the nodes and move to the
// outputs.
#include "model/expression.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace tandem::model {
namespace {

Graph* graph_of(const Expr& a, const Expr& b) {
  return a.graph() != nullptr ? a.graph() : b.graph();
}

Expr make(Graph* graph, Op op, std::uint32_t a, std::uint32_t b, bool negative) {
  return {graph, graph->intern({.op = op, .a = a, .b = b}), negative};
}

bool is_zero(const Expr& a) { return a.is_constant() && a.value() == 0.0; }

const GraphNode& node_of(const Expr& a) { return a.graph()->nodes()[a.node()]; }

// An operand of a node: a constant folds again.
Expr operand_of(Graph* graph, std::uint32_t node, bool negative) {
  const GraphNode& operand = graph->nodes()[node];
  if (operand.op != Op::kConstant) return {graph, node, negative};
  return negative ? -operand.value : operand.value;
}

// x in (x + y) - y, (x - y) + y and y - (y - x): sum is a node, term a node or constant.
bool cancels(const Expr& sum, const Expr& term, Expr& left) {
  if (sum.is_constant() || term.is_constant()) return false;
  const GraphNode& node = node_of(sum);
  if (node.op != Op::kAdd && node.op != Op::kSub) return false;
  const bool b_negative = sum.negative() != (node.op == Op::kSub);
  if (node.a == term.node() && sum.negative() != term.negative()) {
    left = operand_of(sum.graph(), node.b, b_negative);
    return true;
  }
  if (node.b == term.node() && b_negative != term.negative()) {
    left = operand_of(sum.graph(), node.a, sum.negative());
    return true;
  }
  return false;
}

// x and k of k x.
bool is_multiple(const Expr& product, std::uint32_t& x, double& k) {
  if (product.is_constant()) return false;
  const GraphNode& node = node_of(product);
  if (node.op != Op::kMul) return false;
  const GraphNode& factor = product.graph()->nodes()[node.b];
  if (factor.op != Op::kConstant) return false;
  x = node.a;
  k = product.negative() ? -factor.value : factor.value;
  return true;
}

}  // namespace

std::size_t Graph::Hash::operator()(const std::array<std::uint64_t, 3>& key) const {
  std::uint64_t hash = 0x9E3779B97F4A7C15u;
  for (const std::uint64_t part : key) {
    hash = (hash ^ part) * 0xBF58476D1CE4E5B9u;
    hash ^= hash >> 29;
  }
  return hash;
}

std::uint32_t Graph::intern(const GraphNode& node) {
  const std::array<std::uint64_t, 3> key{static_cast<std::uint64_t>(node.op),
                                         (static_cast<std::uint64_t>(node.a) << 32) | node.b,
                                         std::bit_cast<std::uint64_t>(node.value)};
  const auto [entry, added] = known_.try_emplace(key, static_cast<std::uint32_t>(nodes_.size()));
  if (added) nodes_.push_back(node);
  return entry->second;
}

Expr Graph::input(std::uint32_t array, std::uint32_t index) {
  return make(this, Op::kInput, array, index, false);
}

Expr Graph::as_node(const Expr& expr) {
  if (!expr.is_constant()) return expr;
  const double value = expr.value();
  const GraphNode node{.op = Op::kConstant, .a = 0, .b = 0, .value = std::abs(value)};
  return {this, intern(node), std::signbit(value)};
}

Expr Expr::operator-() const {
  Expr result = *this;
  result.negative_ = !negative_;
  result.value_ = -value_;
  return result;
}

Expr operator+(const Expr& a, const Expr& b) {
  if (a.is_constant() && b.is_constant()) return a.value() + b.value();
  if (is_zero(a)) return b;
  if (is_zero(b)) return a;
  Expr left;
  if (cancels(a, b, left) || cancels(b, a, left)) return left;
  Graph* graph = graph_of(a, b);
  std::uint32_t of_a = 0, of_b = 0;
  double ka = 0.0, kb = 0.0;
  if (is_multiple(a, of_a, ka) && is_multiple(b, of_b, kb) && of_a == of_b)
    return Expr(graph, of_a, false) * Expr(ka + kb);
  Expr x = graph->as_node(a);
  Expr y = graph->as_node(b);
  if (x.node() == y.node() && x.negative() != y.negative()) return 0.0;
  if (x.node() > y.node()) std::swap(x, y);
  const Op op = x.negative() == y.negative() ? Op::kAdd : Op::kSub;
  return make(graph, op, x.node(), y.node(), x.negative());
}

Expr operator*(const Expr& a, const Expr& b) {
  if (a.is_constant() && b.is_constant()) return a.value() * b.value();
  if (a.is_constant()) return b * a;
  Graph* graph = a.graph();
  if (b.is_constant()) {
    if (b.value() == 0.0) return 0.0;
    if (b.value() == 1.0) return a;
    if (b.value() == -1.0) return -a;
    const GraphNode node = node_of(a);  // k1 * (k2 * x) = (k1 k2) * x
    if (node.op == Op::kMul && graph->nodes()[node.b].op == Op::kConstant) {
      const double k = graph->nodes()[node.b].value * b.value();
      return Expr(graph, node.a, a.negative()) * k;
    }
    const Expr constant = graph->as_node(b);
    return make(graph, Op::kMul, a.node(), constant.node(), a.negative() != constant.negative());
  }
  const bool negative = a.negative() != b.negative();
  return make(graph, Op::kMul, std::min(a.node(), b.node()), std::max(a.node(), b.node()),
              negative);
}

Expr operator/(const Expr& a, const Expr& b) {
  if (b.is_constant()) return a * (1.0 / b.value());
  if (is_zero(a)) return 0.0;
  Graph* graph = b.graph();
  const Expr x = graph->as_node(a);
  return make(graph, Op::kDiv, x.node(), b.node(), x.negative() != b.negative());
}

Expr sqrt(const Expr& a) {
  if (a.is_constant()) return std::sqrt(a.value());
  std::uint32_t operand = a.node();
  if (a.negative()) {  // as a node: 0 - a
    const std::uint32_t zero = a.graph()->as_node(0.0).node();
    operand = a.graph()->intern({.op = Op::kSub, .a = zero, .b = operand});
  }
  return make(a.graph(), Op::kSqrt, operand, 0, false);
}

Expr sin(const Expr& a) {
  if (a.is_constant()) return std::sin(a.value());
  return make(a.graph(), Op::kSin, a.node(), 0, a.negative());
}

Expr cos(const Expr& a) {
  if (a.is_constant()) return std::cos(a.value());
  return make(a.graph(), Op::kCos, a.node(), 0, false);
}

std::vector<bool> live_nodes(const Graph& graph, std::span<const Expr> outputs) {
  const auto nodes = graph.nodes();
  std::vector<bool> live(nodes.size(), false);
  for (const Expr& output : outputs)
    if (!output.is_constant()) live[output.node()] = true;
  for (std::size_t i = nodes.size(); i-- > 0;) {
    if (!live[i] || !is_operation(nodes[i].op)) continue;
    live[nodes[i].a] = true;
    if (is_binary(nodes[i].op)) live[nodes[i].b] = true;
  }
  return live;
}

OperationCount count_operations(const Graph& graph, std::span<const Expr> outputs) {
  const auto nodes = graph.nodes();
  const std::vector<bool> live = live_nodes(graph, outputs);
  std::vector<bool> angle(nodes.size(), false);
  OperationCount count;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!live[i]) continue;
    switch (nodes[i].op) {
      case Op::kAdd:
      case Op::kSub: ++count.add; break;
      case Op::kMul: ++count.mul; break;
      case Op::kDiv: ++count.div; break;
      case Op::kSqrt: ++count.sqrt; break;
      case Op::kSin:
      case Op::kCos:
        if (!angle[nodes[i].a]) ++count.sincos;
        angle[nodes[i].a] = true;
        break;
      case Op::kInput:
      case Op::kConstant: break;
    }
  }
  return count;
}

std::vector<double> evaluate(const Graph& graph, std::span<const Expr> outputs,
                             std::span<const std::vector<double>> inputs) {
  const auto nodes = graph.nodes();
  std::vector<double> value(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const GraphNode& node = nodes[i];
    switch (node.op) {
      case Op::kInput: value[i] = inputs[node.a][node.b]; break;
      case Op::kConstant: value[i] = node.value; break;
      case Op::kAdd: value[i] = value[node.a] + value[node.b]; break;
      case Op::kSub: value[i] = value[node.a] - value[node.b]; break;
      case Op::kMul: value[i] = value[node.a] * value[node.b]; break;
      case Op::kDiv: value[i] = value[node.a] / value[node.b]; break;
      case Op::kSqrt: value[i] = std::sqrt(value[node.a]); break;
      case Op::kSin: value[i] = std::sin(value[node.a]); break;
      case Op::kCos: value[i] = std::cos(value[node.a]); break;
    }
  }
  std::vector<double> result;
  result.reserve(outputs.size());
  for (const Expr& output : outputs) {
    if (output.is_constant()) {
      result.push_back(output.value());
    } else {
      result.push_back(output.negative() ? -value[output.node()] : value[output.node()]);
    }
  }
  return result;
}

}  // namespace tandem::model
