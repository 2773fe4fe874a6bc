// Which limb a node belongs to follows from the inputs that it depends on, or the outputs that
// depend on it. Nodes of the second limb are looked up by their operands. The signs are the
// solution of linear equations over {plus, minus}, one for each operand of a sum.
#include "model/lanes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "model/parities.hpp"

namespace tandem::model {
namespace {

constexpr std::uint32_t kNone = Lanes::kNone;

// Least share of a kernel's operations in pairs: with fewer, what is gathered into vectors costs as
// much as the pairs save.
constexpr double kLeastShare = 0.05;

constexpr std::size_t kMostLikes = 3;  // a quadruped has four legs

// Constants that are the same but for the digits of a description differ by less.
constexpr double kLastDigits = 1e-6;

enum class Side : std::uint8_t { kTrunk, kFirst, kSecond };

Side operator+(Side a, Side b) {
  if (a == b || b == Side::kTrunk) return a;
  return a == Side::kTrunk ? b : Side::kTrunk;
}

/// Where the elements of a kernel's arrays belong.
class Elements {
 public:
  explicit Elements(const Mechanism& m)
      : m_(m), side_(m.joints.size() + 1), partner_(side_.size()) {
    for (const LimbPair& limb : m.limbs) {
      for (std::size_t k = 0; k < limb.first.size(); ++k) {
        const auto first = static_cast<std::size_t>(limb.first[k]) + 1;
        const auto second = static_cast<std::size_t>(limb.second[k]) + 1;
        side_[first] = Side::kFirst;
        side_[second] = Side::kSecond;
        partner_[first] = static_cast<int>(second);
      }
    }
  }

  Side side(const KernelArray& array, int element) const {
    const int nv = m_.kernel_nv();
    if (array.name == "q") return of_coordinate(element - m_.q_index(0));
    if (array.name == "M" || array.name.starts_with("dtau_"))
      return of_rate(element / nv) + of_rate(element % nv);
    if (array.name == "wrench") return side_[wrench_body(element / 6)];
    if (array.name == "pose") return site(element / 12);
    if (array.name == "twist" || array.name == "acceleration") return site(element / 6);
    if (array.name == "out") return side_[sensor_body(element / 6)];
    if (array.name == "J" && array.size != 3 * nv)
      return site(element / (6 * nv)) + of_rate(element % nv);
    if (array.name == "J") return of_rate(element % nv);
    return array.size == nv ? of_rate(element) : Side::kTrunk;
  }

  /// The element of the second limb that corresponds to an input of the first; -1: none.
  int partner(const KernelArray& array, int element) const {
    if (array.name == "wrench") {
      const int other = partner_wrench(element / 6);
      return other < 0 ? -1 : 6 * other + element % 6;
    }
    if (array.name == "M") {  // its lower triangle
      const int row = partner_rate(element / m_.kernel_nv());
      const int column = partner_rate(element % m_.kernel_nv());
      return std::max(row, column) * m_.kernel_nv() + std::min(row, column);
    }
    const int base = array.name == "q" ? m_.q_index(0) : m_.v_index(0);
    const int joint = joint_of(element - base);
    if (joint < 0) return -1;
    const int other = partner_[static_cast<std::size_t>(joint) + 1] - 1;
    return base + m_.coordinate_of[static_cast<std::size_t>(other)].index;
  }

 private:
  Side site(int index) const {
    return side_[static_cast<std::size_t>(m_.sites[static_cast<std::size_t>(index)].body)];
  }
  /// The joint that has the coordinate, where it alone does.
  int joint_of(int coordinate) const {
    int found = -1;
    for (std::size_t j = 0; j < m_.joints.size(); ++j) {
      if (m_.coordinate_of[j].index != coordinate) continue;
      if (found >= 0) return -1;
      found = static_cast<int>(j);
    }
    return found;
  }
  Side of_coordinate(int coordinate) const {
    if (coordinate < 0) return Side::kTrunk;
    const int joint = joint_of(coordinate);
    return joint < 0 ? Side::kTrunk : side_[static_cast<std::size_t>(joint) + 1];
  }
  /// The same rate where it is not that of a joint of a first limb.
  int partner_rate(int index) const {
    const int joint = joint_of(index - m_.v_index(0));
    const int other = joint < 0 ? 0 : partner_[static_cast<std::size_t>(joint) + 1];
    if (other == 0) return index;
    return m_.v_index(m_.coordinate_of[static_cast<std::size_t>(other - 1)].index);
  }
  Side of_rate(int index) const { return of_coordinate(index - m_.v_index(0)); }
  std::size_t wrench_body(int wrench) const {
    for (const MechanismSite& site : m_.sites)
      if (site.wrench == wrench) return static_cast<std::size_t>(site.body);
    return 0;
  }
  std::size_t sensor_body(int sensor) const {
    return static_cast<std::size_t>(m_.sensors[static_cast<std::size_t>(sensor)].body);
  }
  /// The wrench that is as many on its body as this one is.
  int partner_wrench(int wrench) const {
    const std::size_t body = wrench_body(wrench);
    int count = 0;
    for (int w = 0; w < wrench; ++w) count += wrench_body(w) == body ? 1 : 0;
    for (int w = 0; w < m_.wrenches; ++w) {
      if (wrench_body(w) != static_cast<std::size_t>(partner_[body])) continue;
      if (count-- == 0) return w;
    }
    return -1;
  }

  const Mechanism& m_;
  std::vector<Side> side_;    // per body
  std::vector<int> partner_;  // per body of a first limb
};

const std::vector<std::uint32_t> kNoOperand{0};  // no second operand

bool is_sum(Op op) { return op == Op::kAdd || op == Op::kSub; }

class Pairing {
 public:
  Pairing(const Graph& graph, const TracedKernel& kernel, const Mechanism& m,
          std::span<const std::uint32_t> wanted)
      : nodes_(graph.nodes()),
        kernel_(kernel),
        wanted_(wanted),
        elements_(m),
        live_(live_nodes(graph, kernel.outputs)),
        side_(nodes_.size(), Side::kTrunk),
        common_(nodes_.size(), false),
        others_(nodes_.size()) {
    lanes_.second_of.assign(nodes_.size(), kNone);
    lanes_.first_of.assign(nodes_.size(), kNone);
    lanes_.minus.assign(nodes_.size(), false);
    lanes_.like_of.assign(nodes_.size(), kNone);
    lanes_.swapped.assign(nodes_.size(), false);
  }

  Lanes run() {
    find_sides();
    pair_inputs();
    list_operations();
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (live_[i] && side_[i] == Side::kFirst) find_partner(i);
      if (live_[i] && side_[i] == Side::kTrunk && common_[i]) find_likes(i);
    }
    choose_signs();
    return std::move(lanes_);
  }

 private:
  using Key = std::array<std::uint32_t, 3>;
  using Operations = std::map<Key, std::vector<std::uint32_t>>;

  // A node belongs to a limb when it depends on that limb's inputs and not on the other's, when
  // only that limb's outputs depend on it, or when only nodes of that limb use it.
  void find_sides() {
    std::vector<std::uint8_t> from(nodes_.size()), to(nodes_.size());
    const auto bit = [](Side side) -> std::uint8_t {
      return side == Side::kTrunk ? 4 : side == Side::kFirst ? 1 : 2;
    };
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const GraphNode& node = nodes_[i];
      if (node.op == Op::kInput)
        from[i] = bit(elements_.side(kernel_.shape.inputs[node.a], static_cast<int>(node.b)));
      if (!is_operation(node.op)) continue;
      from[i] = from[node.a];
      if (is_binary(node.op)) from[i] |= from[node.b];
    }
    std::size_t number = 0;
    for (const KernelArray& array : kernel_.shape.outputs) {
      for (int e = 0; e < array.size; ++e, ++number) {
        const Expr& output = kernel_.outputs[number];
        if (!output.is_constant()) to[output.node()] |= bit(elements_.side(array, e));
      }
    }
    for (std::size_t i = nodes_.size(); i-- > 0;) {
      if (!live_[i] || !is_operation(nodes_[i].op)) continue;
      to[nodes_[i].a] |= to[i];
      if (is_binary(nodes_[i].op)) to[nodes_[i].b] |= to[i];
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const std::uint8_t limbs = from[i] & 3;
      common_[i] = limbs == 0;
      if (limbs == 1 || limbs == 2) {
        side_[i] = limbs == 1 ? Side::kFirst : Side::kSecond;
      } else if (is_operation(nodes_[i].op) && (to[i] == 1 || to[i] == 2)) {
        side_[i] = to[i] == 1 ? Side::kFirst : Side::kSecond;
      }
    }
    std::vector<std::uint8_t> used(nodes_.size());
    for (const Expr& output : kernel_.outputs)
      if (!output.is_constant()) used[output.node()] |= bit(side_[output.node()]);
    for (std::size_t i = nodes_.size(); i-- > 0;) {
      if (!live_[i] || !is_operation(nodes_[i].op)) continue;
      if (side_[i] == Side::kTrunk && (used[i] == 1 || used[i] == 2))
        side_[i] = used[i] == 1 ? Side::kFirst : Side::kSecond;
      used[nodes_[i].a] |= bit(side_[i]);
      if (is_binary(nodes_[i].op)) used[nodes_[i].b] |= bit(side_[i]);
    }
  }

  void pair(std::uint32_t first, std::uint32_t second) {
    lanes_.second_of[first] = second;
    lanes_.first_of[second] = first;
  }

  void pair_inputs() {
    std::map<std::array<std::uint32_t, 2>, std::uint32_t> inputs;
    for (std::uint32_t i = 0; i < nodes_.size(); ++i)
      if (nodes_[i].op == Op::kInput) inputs[{nodes_[i].a, nodes_[i].b}] = i;
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      const GraphNode& node = nodes_[i];
      if (node.op != Op::kInput || side_[i] != Side::kFirst) continue;
      const int other = elements_.partner(kernel_.shape.inputs[node.a], static_cast<int>(node.b));
      const auto found = inputs.find({node.a, static_cast<std::uint32_t>(other)});
      if (other >= 0 && found != inputs.end()) pair(i, found->second);
    }
  }

  // Operations by what they do to what. Constants differ between limbs, in size or sign.
  static Key key(Op op, std::uint32_t a, std::uint32_t b) {
    if (is_sum(op)) op = Op::kAdd;
    if (op != Op::kDiv && a > b) std::swap(a, b);
    return {static_cast<std::uint32_t>(op), a, b};
  }
  std::uint32_t no_constant(std::uint32_t i) const {
    return nodes_[i].op == Op::kConstant ? kNone : i;
  }
  Key own_key(std::uint32_t i) const {
    const GraphNode& node = nodes_[i];
    return key(node.op, no_constant(node.a), is_binary(node.op) ? no_constant(node.b) : 0);
  }
  void list_operations() {
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (!live_[i] || !is_operation(nodes_[i].op)) continue;
      if (side_[i] == Side::kTrunk) {
        if (common_[i]) trunk_[own_key(i)].push_back(i);
        continue;
      }
      (side_[i] == Side::kFirst ? first_ : second_)[own_key(i)].push_back(i);
    }
  }

  // What may stand for an operand of a first limb in the second: its partner first. What two first
  // limbs have in common, as they are equal, may be two nodes of the second limbs, which are not.
  std::vector<std::uint32_t> images_of_first(std::uint32_t i) const {
    if (nodes_[i].op == Op::kConstant) return {kNone};
    std::vector<std::uint32_t> images = others_[i];
    if (lanes_.second_of[i] != kNone) images.insert(images.begin(), lanes_.second_of[i]);
    if (side_[i] == Side::kTrunk) images.insert(images.begin(), i);
    return images;
  }
  double constant_of(std::uint32_t i) const {
    const GraphNode& node = nodes_[i];
    if (nodes_[node.a].op == Op::kConstant) return nodes_[node.a].value;
    if (is_binary(node.op) && nodes_[node.b].op == Op::kConstant) return nodes_[node.b].value;
    return 0.0;
  }

  // Calls act(a, those of `operations`) for what does the same to what stands for node i's
  // operands, `a` for the first.
  template <class Act>
  void for_matches(std::uint32_t i, const Operations& operations, const Act& act) const {
    const GraphNode& node = nodes_[i];
    if (!is_operation(node.op)) return;
    for (const std::uint32_t a : images_of_first(node.a)) {
      for (const std::uint32_t b : is_binary(node.op) ? images_of_first(node.b) : kNoOperand) {
        const auto found = operations.find(key(node.op, a, b));
        if (found != operations.end()) act(a, found->second);
      }
    }
  }

  void find_partner(std::uint32_t i) {
    for_matches(i, second_, [&](std::uint32_t a, const std::vector<std::uint32_t>& matches) {
      if (lanes_.second_of[i] == kNone) {
        const std::uint32_t best = choose(i, matches);
        if (best != kNone && lanes_.first_of[best] == kNone) {
          pair(i, best);
          make_alike(i, best, a);
          const Op op = nodes_[i].op;
          if (op != Op::kSin && op != Op::kCos) ++lanes_.operations;
        }
      }
      if (!common_[i]) return;
      for (const std::uint32_t other : matches) {
        if (other == lanes_.second_of[i] || !rounds_alike(i, other)) continue;
        others_[i].push_back(other);
        if (lanes_.like_of[other] == kNone) make_alike(i, other, a);
      }
    });
  }
  // Likes of what limbs of both sides share: a first limb may share with one second limb what its
  // partner shares with another first one, as a quadruped's legs do across.
  void find_likes(std::uint32_t i) {
    for_matches(i, trunk_, [&](std::uint32_t, const std::vector<std::uint32_t>& matches) {
      for (const std::uint32_t other : matches)
        if (other != i && others_[i].size() < kMostLikes && rounds_alike(i, other))
          others_[i].push_back(other);
    });
  }

  // Two operations with the same constant, but for its last digits.
  bool rounds_alike(std::uint32_t i, std::uint32_t other) const {
    const double a = constant_of(i);
    const double b = constant_of(other);
    return std::abs(a - b) <= kLastDigits * std::max({std::abs(a), std::abs(b), 0.01});
  }
  // `a`: the operand of the second that is like the first operand of the first.
  void make_alike(std::uint32_t first, std::uint32_t second, std::uint32_t a) {
    lanes_.like_of[second] = first;
    const GraphNode& node = nodes_[second];
    lanes_.swapped[second] = is_binary(node.op) && node.op != Op::kDiv && no_constant(node.a) != a;
  }

  // Chooses among several that differ in their constant alone: as the limbs are built alike, the
  // algorithm makes them in the same order. Where it makes more of them for one limb than for the
  // other, as some are equal, the one with the nearest constant.
  std::uint32_t choose(std::uint32_t i, const std::vector<std::uint32_t>& others) const {
    if (!wanted_.empty() && std::ranges::count(others, wanted_[i]) != 0) return wanted_[i];
    const std::vector<std::uint32_t>& own = first_.at(own_key(i));
    if (own.size() != others.size()) return nearest(constant_of(i), others);
    return others[static_cast<std::size_t>(std::ranges::find(own, i) - own.begin())];
  }

  // Candidate with the nearest constant, of those that are not paired yet; kNone: all are.
  std::uint32_t nearest(double constant, const std::vector<std::uint32_t>& candidates) const {
    std::uint32_t best = kNone;
    double least = 0.0;
    for (const std::uint32_t candidate : candidates) {
      if (lanes_.first_of[candidate] != kNone) continue;
      const double other = constant_of(candidate);
      const double far = std::abs(constant - other);
      if (best != kNone && far >= least - 1e-9) continue;
      best = candidate;
      least = far;
    }
    return best;
  }

  // The second operands in the order of the first ones.
  std::array<std::array<std::uint32_t, 2>, 2> operands(std::uint32_t i) const {
    const GraphNode& x = nodes_[i];
    const GraphNode& y = nodes_[lanes_.second_of[i]];
    return lanes_.swapped[lanes_.second_of[i]]
               ? std::array{std::array{x.a, y.b}, std::array{x.b, y.a}}
               : std::array{std::array{x.a, y.a}, std::array{x.b, y.b}};
  }
  // A vector that is made where it is used, with either sign.
  bool is_free(std::uint32_t first, std::uint32_t second) const {
    return nodes_[first].op == Op::kConstant ||
           (first != second && lanes_.second_of[first] != second);
  }

  // The sign of a vector's lane 1 as a sum of variables.
  Parities::Row sign_of(std::uint32_t first) {
    const auto known = sign_.find(first);
    if (known != sign_.end()) return known->second;
    return sign_[first] = Parities::variable(parities_.new_variable());
  }

  void choose_signs() {
    std::vector<Parities::Row> wishes, sines;
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (lanes_.second_of[i] == kNone) continue;
      const Op op = nodes_[i].op;
      if (op == Op::kCos) {
        sign_[i] = {};
      } else if (op == Op::kInput) {
        wishes.push_back(sign_of(i));
      } else if (op == Op::kSin) {
        sines.push_back(sign_of(i));  // the table has both
      } else if (is_operation(op)) {
        sign_operation(i);
      }
    }
    wish_for_outputs(wishes);
    wishes.insert(wishes.end(), sines.begin(), sines.end());
    for (const Parities::Row& wish : wishes) (void)parities_.require_zero(wish);
    parities_.solve();
    for (const auto& [first, row] : sign_) lanes_.minus[first] = parities_.sum(row);
  }

  // Both lanes are written with one sign: as they stand.
  void wish_for_outputs(std::vector<Parities::Row>& wishes) {
    std::map<std::uint32_t, bool> negative;
    for (const Expr& output : kernel_.outputs)
      if (!output.is_constant()) negative.emplace(output.node(), output.negative());
    for (const auto& [node, first_negative] : negative) {
      if (lanes_.second_of[node] == kNone) continue;
      const auto second = negative.find(lanes_.second_of[node]);
      if (second == negative.end()) continue;
      Parities::Row wish = sign_of(node);
      if (first_negative != second->second) Parities::add(wish, Parities::one());
      wishes.push_back(std::move(wish));
    }
  }

  void sign_operation(std::uint32_t i) {
    const Op first_op = nodes_[i].op;
    const Op second_op = nodes_[lanes_.second_of[i]].op;
    const auto pairs = operands(i);
    const bool swapped = lanes_.swapped[lanes_.second_of[i]];
    Parities::Row own;
    bool has_own = false;
    for (std::size_t k = 0; k < 2; ++k) {
      const auto [x, y] = pairs[k];
      const bool free = is_free(x, y);
      if (!is_sum(first_op)) {
        Parities::add(own, free ? Parities::variable(parities_.new_variable()) : sign_of(x));
        continue;
      }
      if (free) continue;
      const bool first_minus = k == 1 && first_op == Op::kSub;
      const bool second_minus = (k == 1) != swapped && second_op == Op::kSub;
      Parities::Row sign = sign_of(x);
      if (first_minus != second_minus) Parities::add(sign, Parities::one());
      if (has_own) {
        Parities::add(sign, own);
        (void)parities_.require_zero(sign);
      } else {
        own = std::move(sign);
        has_own = true;
      }
    }
    sign_[i] = std::move(own);
  }

  std::span<const GraphNode> nodes_;
  const TracedKernel& kernel_;
  std::span<const std::uint32_t> wanted_;
  Elements elements_;
  std::vector<bool> live_;
  std::vector<Side> side_;
  std::vector<bool> common_;                        // depends on no limb
  std::vector<std::vector<std::uint32_t>> others_;  // of such a node: more of the second limbs
  Operations first_, second_;                       // of each limb
  Operations trunk_;                                // that depend on no limb, and belong to none
  Parities parities_;
  std::map<std::uint32_t, Parities::Row> sign_;  // of pairs, and of what both limbs share
  Lanes lanes_;
};

}  // namespace

Lanes pair_lanes(const Graph& graph, const TracedKernel& kernel, const Mechanism& m,
                 std::span<const std::uint32_t> wanted) {
  Lanes lanes = Pairing(graph, kernel, m, wanted).run();
  const OperationCount all = count_operations(graph, kernel.outputs);
  const std::uint32_t operations = all.add + all.mul + all.div + all.sqrt;
  return lanes.operations < kLeastShare * operations ? Lanes{} : lanes;
}

}  // namespace tandem::model
