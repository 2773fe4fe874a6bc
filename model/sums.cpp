// Sums are taken apart into their terms, sorted and put together again, one node after another.
#include "model/sums.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace tandem::model {
namespace {

// Cycles until a result can be used: those of Intel's and AMD's cores since 2017, about.
constexpr int kAdd = 3;
constexpr int kMultiply = 4;  // or a multiplication with an addition
constexpr int kDivide = 14;
constexpr int kRoot = 18;

bool is_sum(const GraphNode& node) { return node.op == Op::kAdd || node.op == Op::kSub; }

class Ordering {
 public:
  Ordering(const Graph& from, std::span<const Expr> outputs, const Lanes& lanes, Graph& to)
      : from_(from.nodes()),
        outputs_(outputs),
        lanes_(lanes),
        to_(to),
        live_(live_nodes(from, outputs)),
        uses_(from_.size(), 0),
        user_(from_.size(), 0),
        image_(from_.size()),
        order_(from_.size()),
        made_(from_.size()) {}

  OrderedSums run() {
    find_uses();
    for (std::uint32_t i = 0; i < from_.size(); ++i)
      if (live_[i] && !is_part(i)) make(i);
    OrderedSums result;
    for (const Expr& output : outputs_) {
      const Expr value = output.is_constant() ? output : image_[output.node()];
      result.outputs.push_back(!output.is_constant() && output.negative() ? -value : value);
    }
    result.second_of.assign(to_.nodes().size(), Lanes::kNone);
    for (std::uint32_t i = 0; i < from_.size(); ++i) {
      const std::uint32_t second = lanes_.second(i);
      if (second == Lanes::kNone || made_[i].size() != made_[second].size()) continue;
      for (std::size_t k = 0; k < made_[i].size(); ++k)
        result.second_of[made_[i][k]] = made_[second][k];
    }
    return result;
  }

 private:
  struct Term {
    std::uint32_t node;
    bool negative;
    int known;     // when what it is made of is known
    bool product;  // which takes no time of its own
  };

  void find_uses() {
    const auto use = [&](std::uint32_t operand, std::uint32_t user) {
      ++uses_[operand];
      user_[operand] = user;
    };
    for (std::uint32_t i = 0; i < from_.size(); ++i) {
      if (!live_[i] || !is_operation(from_[i].op)) continue;
      use(from_[i].a, i);
      if (is_binary(from_[i].op)) use(from_[i].b, i);
    }
    for (const Expr& output : outputs_)
      if (!output.is_constant()) uses_[output.node()] += 2;  // stays a node
  }

  // A sum or a product that one sum alone uses: no node of its own, but a part of that. What is
  // alike in two limbs is no part of a sum that is not.
  bool is_part(std::uint32_t i) const {
    return uses_[i] == 1 && is_sum(from_[user_[i]]) && (is_sum(from_[i]) || is_product(i)) &&
           (alike(i) == Lanes::kNone) == (alike(user_[i]) == Lanes::kNone);
  }
  std::uint32_t alike(std::uint32_t i) const {
    return lanes_.second(i) != Lanes::kNone ? lanes_.second(i) : lanes_.like(i);
  }
  bool is_product(std::uint32_t i) const { return from_[i].op == Op::kMul; }

  void make(std::uint32_t i) {
    image_[i] = image_of(i);
    keep(i, image_[i]);
  }
  void keep(std::uint32_t i, const Expr& x) {
    if (!x.is_constant()) made_[i].push_back(x.node());
  }

  Expr image_of(std::uint32_t i) {
    const GraphNode& node = from_[i];
    if (is_sum(node)) return sum(i);
    switch (node.op) {
      case Op::kInput: return known_at(to_.input(node.a, node.b), 0);
      case Op::kConstant: return node.value;
      case Op::kMul: return product(i);
      case Op::kDiv:
        return known_at(image_[node.a] / image_[node.b],
                        std::max(at(node.a), at(node.b)) + kDivide);
      case Op::kSqrt: return known_at(sqrt(image_[node.a]), at(node.a) + kRoot);
      case Op::kSin: return known_at(sin(image_[node.a]), 0);  // before all else
      case Op::kCos: return known_at(cos(image_[node.a]), 0);
      case Op::kAdd:
      case Op::kSub: break;
    }
    return {};
  }
  Expr product(std::uint32_t i) {
    const GraphNode& node = from_[i];
    return known_at(image_[node.a] * image_[node.b], std::max(at(node.a), at(node.b)) + kMultiply);
  }

  int at(std::uint32_t i) const { return known(image_[i]); }
  int known(const Expr& x) const { return x.is_constant() ? 0 : known_[x.node()]; }
  Expr known_at(const Expr& x, int cycles) {
    known_.resize(to_.nodes().size(), cycles);
    return x;
  }

  // The same places for a pair.
  void collect(std::uint32_t i, bool negative, std::vector<Term>& terms) const {
    const GraphNode& node = from_[i];
    std::array operands{std::pair(node.a, negative),
                        std::pair(node.b, negative != (node.op == Op::kSub))};
    if (lanes_.like(i) != Lanes::kNone && lanes_.swapped[i]) std::swap(operands[0], operands[1]);
    for (const auto& [operand, minus] : operands) {
      if (is_part(operand) && is_sum(from_[operand])) {
        collect(operand, minus, terms);
      } else if (is_part(operand)) {
        const GraphNode& factors = from_[operand];
        terms.push_back({operand, minus, std::max(at(factors.a), at(factors.b)), true});
      } else {
        terms.push_back({operand, minus, at(operand), false});
      }
    }
  }

  // By when they are known, or as those of a sum were that it is like.
  std::vector<Term> sorted_terms(std::uint32_t i) {
    std::vector<Term> terms;
    collect(i, false, terms);
    const std::uint32_t other = alike(i);
    if (other != Lanes::kNone && order_[other].size() == terms.size()) {
      order_[i] = order_[other];
    } else {
      order_[i].resize(terms.size());
      std::iota(order_[i].begin(), order_[i].end(), std::size_t{0});
      std::ranges::stable_sort(order_[i], {}, [&](std::size_t k) { return terms[k].known; });
    }
    std::vector<Term> sorted;
    for (const std::size_t k : order_[i]) sorted.push_back(terms[k]);
    return sorted;
  }

  Expr sum(std::uint32_t i) {
    const std::vector<Term> terms = sorted_terms(i);
    // The compiler fuses the sum with that one of two products that is made first.
    const auto made = [&](const Term& term) {
      const Expr x = term.product ? product(term.node) : image_[term.node];
      if (term.product) keep(i, x);
      return term.negative ? -x : x;
    };
    const Expr second = made(terms[1]);
    Expr result = made(terms[0]);
    int time = known(result);
    for (std::size_t k = 1; k < terms.size(); ++k) {
      result = result + (k == 1 ? second : made(terms[k]));
      time = std::max(time, terms[k].known) + (terms[k].product ? kMultiply : kAdd);
      known_at(result, time);
      if (k + 1 < terms.size()) keep(i, result);
    }
    return result;
  }

  std::span<const GraphNode> from_;
  std::span<const Expr> outputs_;
  const Lanes& lanes_;
  Graph& to_;
  std::vector<bool> live_;
  std::vector<std::uint32_t> uses_, user_;  // the last user
  std::vector<Expr> image_;
  std::vector<std::vector<std::size_t>> order_;   // of a sum's terms
  std::vector<std::vector<std::uint32_t>> made_;  // nodes of `to`, of one of `from`
  std::vector<int> known_;                        // per node of `to`, in cycles
};

}  // namespace

OrderedSums ordered_sums(const Graph& from, std::span<const Expr> outputs, const Lanes& lanes,
                         Graph& to) {
  return Ordering(from, outputs, lanes, to).run();
}

}  // namespace tandem::model
