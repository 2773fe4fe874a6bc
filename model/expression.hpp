// Expressions as a graph in which equal sub-expressions are one node: the scalar with which the
// dynamics algorithms are run once to be written down as code.
// Layer: model.  Thread: non-RT; a graph and its expressions belong to one thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

namespace tandem::model {

enum class Op : std::uint8_t { kInput, kConstant, kAdd, kSub, kMul, kDiv, kSqrt, kSin, kCos };

/// One operation. Operands are indices of earlier nodes, so indices are an evaluation order.
/// No node is the negative of another: signs live on references and end up at the outputs.
struct GraphNode {
  Op op = Op::kConstant;
  std::uint32_t a = 0;  ///< kInput: the array
  std::uint32_t b = 0;  ///< kInput: the element; unused by kSqrt, kSin, kCos
  double value = 0.0;   ///< kConstant: positive
};

/// How many operations a piece of the graph takes.
struct OperationCount {
  std::uint32_t add = 0;  ///< additions and subtractions
  std::uint32_t mul = 0;
  std::uint32_t div = 0;
  std::uint32_t sqrt = 0;
  std::uint32_t sincos = 0;  ///< sine and cosine of one angle count once
  std::uint32_t pairs = 0;   ///< times that two of the others are one, on a vector

  [[nodiscard]] OperationCount operator+(const OperationCount& other) const {
    return {add + other.add,   mul + other.mul,       div + other.div,
            sqrt + other.sqrt, sincos + other.sincos, pairs + other.pairs};
  }
};

class Graph;

/// A constant, or plus or minus a node. Arithmetic folds constants, drops zeros and ones, pulls
/// signs outwards and finds a node that exists already. Real-number identities are used freely,
/// so the last bits may differ from evaluation as written.
class Expr {
 public:
  Expr() = default;
  Expr(double value) : value_(value) {}  // NOLINT: constants mix freely with expressions
  Expr(Graph* graph, std::uint32_t node, bool negative)
      : graph_(graph), node_(node), negative_(negative) {}

  [[nodiscard]] bool is_constant() const { return graph_ == nullptr; }
  [[nodiscard]] double value() const { return value_; }       ///< @pre is_constant()
  [[nodiscard]] std::uint32_t node() const { return node_; }  ///< @pre !is_constant()
  [[nodiscard]] bool negative() const { return negative_; }   ///< @pre !is_constant()
  [[nodiscard]] Graph* graph() const { return graph_; }

  Expr operator-() const;
  Expr& operator+=(const Expr& other) { return *this = *this + other; }
  Expr& operator-=(const Expr& other) { return *this = *this - other; }
  Expr& operator*=(const Expr& other) { return *this = *this * other; }

  friend Expr operator+(const Expr& a, const Expr& b);
  friend Expr operator-(const Expr& a, const Expr& b) { return a + (-b); }
  friend Expr operator*(const Expr& a, const Expr& b);
  friend Expr operator/(const Expr& a, const Expr& b);
  friend Expr sqrt(const Expr& a);
  friend Expr sin(const Expr& a);
  friend Expr cos(const Expr& a);

 private:
  Graph* graph_ = nullptr;
  std::uint32_t node_ = 0;
  bool negative_ = false;
  double value_ = 0.0;
};

/// Owner of the nodes. Nodes are only ever added.
class Graph {
 public:
  Graph() = default;
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;

  /// Element `index` of input array `array`.
  [[nodiscard]] Expr input(std::uint32_t array, std::uint32_t index);
  [[nodiscard]] std::span<const GraphNode> nodes() const { return nodes_; }

  /// The node of these contents, made when there is none. For the arithmetic of Expr.
  [[nodiscard]] std::uint32_t intern(const GraphNode& node);
  /// `expr` as a node and a sign; a constant becomes a node.
  [[nodiscard]] Expr as_node(const Expr& expr);

 private:
  struct Hash {
    std::size_t operator()(const std::array<std::uint64_t, 3>& key) const;
  };
  std::vector<GraphNode> nodes_;
  std::unordered_map<std::array<std::uint64_t, 3>, std::uint32_t, Hash> known_;  // look-up only
};

/// Whether a node takes operands (is neither an input nor a constant).
[[nodiscard]] constexpr bool is_operation(Op op) { return op != Op::kInput && op != Op::kConstant; }
[[nodiscard]] constexpr bool is_binary(Op op) {
  return op == Op::kAdd || op == Op::kSub || op == Op::kMul || op == Op::kDiv;
}

/// Marks the nodes that `outputs` depend on.
[[nodiscard]] std::vector<bool> live_nodes(const Graph& graph, std::span<const Expr> outputs);

/// Operations among the live nodes.
[[nodiscard]] OperationCount count_operations(const Graph& graph, std::span<const Expr> outputs);

/// The outputs' values, for the inputs' (`inputs[array][element]`).
[[nodiscard]] std::vector<double> evaluate(const Graph& graph, std::span<const Expr> outputs,
                                           std::span<const std::vector<double>> inputs);

}  // namespace tandem::model
