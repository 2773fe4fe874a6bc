// Nodes become statements in the order in which the algorithm made them, cut into parts of 500
// operations; what a later part needs goes through the workspace.
#include "model/emit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <set>

#include "model/lanes.hpp"
#include "model/stores.hpp"
#include "model/sums.hpp"

namespace tandem::model {
namespace {

constexpr std::size_t kLongestInline = 96;  // characters of an expression written into another
constexpr int kEarlyDepth = 3;    // of an angle: (multiplier * q + offset) + the frames' own offset
constexpr int kMostZeros = 1000;  // of one output that are written one by one
constexpr std::size_t kLongestWait = 60;  // units between two outputs that are stored at once
constexpr double kManyOutputs = 0.25;     // per unit: stores count then
constexpr std::string_view kPosture = "q";
constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

// The shortest text that reads back as the same double, never an integer literal.
std::string literal(double value) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  std::string result(text, end);
  if (result.find_first_of(".en") == std::string::npos) result += ".0";
  return result;
}

// Writes one kernel. A unit is an operation, or two of a pair, known by its node of the first limb.
// Units are written in the order in which the algorithm made them, which walks limb by limb; a
// value that a later part needs goes through the workspace w.
class Emitter {
 public:
  Emitter(const Graph& graph, const TracedKernel& kernel, const Lanes& lanes, SineTable& sines,
          std::uint32_t part_operations, std::uint32_t states)
      : nodes_(graph.nodes()),
        kernel_(kernel),
        lanes_(lanes),
        sines_(sines),
        part_operations_(part_operations),
        states_(states),
        number_(states == 1   ? "double"
                : states == 4 ? "four"
                              : "eight"),
        array_(states == 8 ? "eight_at" : "double"),
        name_(kernel.shape.name + (states == 1 ? "" : "_" + number_)),
        live_(live_nodes(graph, kernel.outputs)),
        uses_(nodes_.size(), 0),
        part_of_(nodes_.size(), kNowhere),
        last_part_(nodes_.size(), 0),
        slot_(nodes_.size(), kNowhere),
        angle_(nodes_.size(), kNowhere),
        negated_(nodes_.size(), false),
        text_(nodes_.size()),
        outputs_of_(nodes_.size()) {
    result_.name = name_;
    result_.count = count_operations(graph, kernel.outputs);
    result_.count.pairs = lanes.operations;
  }

  EmittedKernel run() {
    name_arguments();
    find_angles();
    find_uses();
    schedule();
    find_zeros();
    for (std::uint32_t part = 0; part < parts_.size(); ++part) write_part(part);
    write_entry();
    return std::move(result_);
  }

 private:
  void name_arguments() {
    at_sines_ = states_ == 1 && kernel_.shape.inputs.front().name == kPosture;
    if (at_sines_) {
      parameters_ = "const double* __restrict s, ";
      arguments_ = "s, ";
    }
    if (states_ == 4) {
      parameters_ = "long states, ";
      arguments_ = "states, ";
      result_.parameters = "long states";
    }
    for (const KernelArray& in : kernel_.shape.inputs) {
      parameters_ += "const " + array_ + "* __restrict " + in.name + ", ";
      arguments_ += in.name + ", ";
      result_.parameters += (result_.parameters.empty() ? "" : ", ");
      result_.parameters += "const " + array_ + "* " + in.name;
    }
    for (std::uint32_t a = 0, first = 0; a < kernel_.shape.outputs.size(); ++a) {
      const KernelArray& out = kernel_.shape.outputs[a];
      parameters_ += array_ + "* __restrict " + out.name + ", ";
      arguments_ += out.name + ", ";
      result_.parameters += ", " + array_ + "* " + out.name;
      int zeros = 0;
      for (int i = 0; i < out.size; ++i) zeros += is_zero(first + static_cast<std::uint32_t>(i));
      if (zeros > kMostZeros) cleared_.insert(out.name);
      for (int i = 0; i < out.size; ++i, ++first) {
        array_of_.push_back(a);
        cleared_outputs_.push_back(zeros > kMostZeros && is_zero(first));
        output_names_.push_back(element(out, std::to_string(i)));
        const Expr& output = kernel_.outputs[first];
        if (!output.is_constant()) outputs_of_[output.node()].push_back(first);
      }
    }
    parameters_ += number_ + "* __restrict w";
    arguments_ += "w";
  }

  // Four states may be some of many, whose numbers stand side by side.
  std::string element(const KernelArray& array, const std::string& i) const {
    return states_ == 4 ? fmt::format("four_of({} + {} * states)", array.name, i)
                        : array.name + "[" + i + "]";
  }

  bool is_zero(std::uint32_t output) const {
    const Expr& value = kernel_.outputs[output];
    return value.is_constant() && value.value() == 0.0;
  }

  // An angle that is a sum or product of positions and constants: known before the first part.
  bool is_early(std::uint32_t i, int depth = 0) const {
    const GraphNode& node = nodes_[i];
    if (node.op == Op::kInput) return kernel_.shape.inputs[node.a].name == kPosture;
    if (!is_operation(node.op)) return true;
    if (node.op != Op::kAdd && node.op != Op::kSub && node.op != Op::kMul) return false;
    return depth < kEarlyDepth && is_early(node.a, depth + 1) && is_early(node.b, depth + 1);
  }

  bool is_trigonometric(std::uint32_t i) const {
    return nodes_[i].op == Op::kSin || nodes_[i].op == Op::kCos;
  }

  // Those of pairs first, side by side.
  void find_angles() {
    for (const bool pairs : {true, false}) {
      for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
        if (!live_[i] || !is_trigonometric(i) || !is_early(nodes_[i].a)) continue;
        const std::uint32_t angle = nodes_[i].a, other = lanes_.second(i);
        if (!pairs) {
          angle_[angle] = sines_.index(early(angle));
        } else if (other != kNowhere && is_early(nodes_[other].a)) {
          sines_.add_pair(early(angle), early(nodes_[other].a));
        }
      }
    }
    if (states_ > 1) workspace_ = 3 * static_cast<std::uint32_t>(sines_.angles().size());
  }

  // Its sine or cosine was computed with all others before the first part.
  bool is_tabulated(std::uint32_t i) const {
    return is_trigonometric(i) && angle_[nodes_[i].a] != kNowhere;
  }
  std::string tabulated(std::uint32_t i) const {
    const std::uint32_t angle = angle_[nodes_[i].a];
    const bool sine = nodes_[i].op == Op::kSin;
    if (states_ == 1)
      return fmt::format("s[{}]", sine ? SineTable::sine(angle) : SineTable::cosine(angle));
    const auto angles = static_cast<std::uint32_t>(sines_.angles().size());
    return fmt::format("w[{}]", angles + 2 * angle + (sine ? 0 : 1));
  }
  // Two that one vector of the table holds.
  bool are_tabulated(std::uint32_t first, std::uint32_t second) const {
    return is_tabulated(first) && is_tabulated(second) && lanes_.second(first) == second &&
           SineTable::adjoin(angle_[nodes_[first].a], angle_[nodes_[second].a]);
  }

  void find_uses() {
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (!live_[i] || !is_operation(nodes_[i].op) || is_tabulated(i)) continue;
      ++uses_[nodes_[i].a];
      if (is_binary(nodes_[i].op)) ++uses_[nodes_[i].b];
    }
    for (std::uint32_t i = 0; i < nodes_.size(); ++i)
      uses_[i] += static_cast<std::uint32_t>(outputs_of_[i].size());
    for (std::uint32_t i = 0; i < nodes_.size(); ++i)
      if (is_written(i) && !is_second(i)) negated_[i] = is_better_negated(i);
  }

  // What outputs want with a minus, where that costs nothing.
  bool is_better_negated(std::uint32_t i) const {
    const GraphNode& node = nodes_[i];
    const bool scales = node.op == Op::kMul && nodes_[node.b].op == Op::kConstant;
    if (!scales && node.op != Op::kAdd && node.op != Op::kSub) return false;
    bool any = false, all = true;
    const auto look = [&](std::uint32_t of, bool minus) {
      for (const std::uint32_t output : outputs_of_[of]) {
        any = true;
        all = all && kernel_.outputs[output].negative() != minus;
      }
    };
    look(i, false);
    if (is_pair(i)) look(lanes_.second(i), lanes_.minus[i]);
    return any && all;
  }

  bool is_written(std::uint32_t i) const {
    return uses_[i] != 0 && is_operation(nodes_[i].op) && !is_tabulated(i);
  }
  bool is_pair(std::uint32_t i) const {
    return lanes_.second(i) != kNowhere && is_written(i) && is_written(lanes_.second(i));
  }
  bool is_second(std::uint32_t i) const {
    return lanes_.first(i) != kNowhere && is_pair(lanes_.first(i));
  }
  std::uint32_t unit_of(std::uint32_t i) const { return is_second(i) ? lanes_.first(i) : i; }

  template <class Do>
  void for_operands(std::uint32_t unit, const Do& act) const {
    const auto of = [&](std::uint32_t i) {
      act(nodes_[i].a);
      if (is_binary(nodes_[i].op)) act(nodes_[i].b);
    };
    of(unit);
    if (is_pair(unit)) of(lanes_.second(unit));
  }

  // Every unit after those that it needs, else in the order of the graph.
  std::vector<std::uint32_t> order() const {
    std::vector<std::uint32_t> missing(nodes_.size(), 0), result;
    std::vector<std::vector<std::uint32_t>> users(nodes_.size());
    std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> ready;
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (!is_written(i) || is_second(i)) continue;
      for_operands(i, [&](std::uint32_t operand) {
        if (!is_written(operand)) return;
        users[unit_of(operand)].push_back(i);
        ++missing[i];
      });
      if (missing[i] == 0) ready.push(i);
    }
    while (!ready.empty()) {
      const std::uint32_t unit = ready.top();
      ready.pop();
      result.push_back(unit);
      for (const std::uint32_t user : users[unit])
        if (--missing[user] == 0) ready.push(user);
    }
    return result;
  }

  void schedule() {
    parts_.emplace_back();
    std::uint32_t operations = 0;
    for (const std::uint32_t i : order()) {
      if (operations == part_operations_) {
        result_.sizes.push_back(operations);
        parts_.emplace_back();
        operations = 0;
      }
      part_of_[i] = static_cast<std::uint32_t>(parts_.size() - 1);
      parts_.back().push_back(i);
      ++operations;
      for_operands(i, [&](std::uint32_t operand) { last_part_[unit_of(operand)] = part_of_[i]; });
    }
    result_.sizes.push_back(operations);
  }

  // A node's own value.
  std::string operand(std::uint32_t i) {
    const GraphNode& node = nodes_[i];
    if (node.op == Op::kConstant) return literal(node.value);
    if (node.op == Op::kInput) return element(kernel_.shape.inputs[node.a], std::to_string(node.b));
    if (is_tabulated(i)) return tabulated(i);
    const std::uint32_t unit = unit_of(i);
    if (is_pair(unit)) {
      const std::uint32_t lane = unit == i ? 0 : 1;
      const std::string value = part_of_[unit] == part_
                                    ? "p" + std::to_string(unit) + "[" + std::to_string(lane) + "]"
                                    : "w[" + std::to_string(slot_[unit] + lane) + "]";
      const bool minus = negated_[unit] != (lane == 1 && lanes_.minus[unit]);
      return minus ? "(-" + value + ")" : value;
    }
    if (!text_[i].empty()) return "(" + text_[i] + ")";
    const std::string value =
        part_of_[i] != part_ ? "w[" + std::to_string(slot_[i]) + "]" : "t" + std::to_string(i);
    return negated_[i] ? "(-" + value + ")" : value;
  }

  // The operation of node i, or the negative of its result where that is what is held.
  std::string joined(std::uint32_t i, const std::string& a, const std::string& b) const {
    switch (nodes_[i].op) {
      case Op::kAdd: return negated_[i] ? "-" + a + " - " + b : a + " + " + b;
      case Op::kSub: return negated_[i] ? b + " - " + a : a + " - " + b;
      case Op::kMul: return (negated_[i] ? "-" : "") + a + " * " + b;
      default: return a + " / " + b;
    }
  }

  std::string expression(std::uint32_t i) {
    const GraphNode& node = nodes_[i];
    std::string a = operand(node.a);
    switch (node.op) {
      case Op::kAdd:
      case Op::kSub:
      case Op::kMul:
      case Op::kDiv: return joined(i, a, operand(node.b));
      case Op::kSqrt: return "root(" + a + ")";
      case Op::kSin: return "sine(" + a + ")";
      case Op::kCos: return "cosine(" + a + ")";
      case Op::kInput:
      case Op::kConstant: break;
    }
    return a;
  }

  // A vector of `first` and plus or minus `second`.
  std::string vector(std::uint32_t first, std::uint32_t second, bool minus) {
    if (are_tabulated(first, second)) {
      const std::uint32_t angle = angle_[nodes_[first].a];
      if (nodes_[first].op == Op::kSin)
        return fmt::format("pair(s + {})",
                           minus ? SineTable::flipped(angle) : SineTable::sine(angle));
      const std::string pair = fmt::format("pair(s + {})", SineTable::cosine(angle));
      return minus ? "flip(" + pair + ")" : pair;
    }
    const bool paired = lanes_.second(first) == second;
    if (paired && is_pair(first)) {
      const std::string pair = part_of_[first] == part_
                                   ? "p" + std::to_string(first)
                                   : "pair(w + " + std::to_string(slot_[first]) + ")";
      const std::string value = negated_[first] ? "(-" + pair + ")" : pair;
      return lanes_.minus[first] == minus ? value : "flip(" + value + ")";
    }
    return "two{" + operand(first) + ", " + (minus ? "-" : "") + operand(second) + "}";
  }

  // Two operations as one. Which operands correspond, and which signs lane 1 needs of them.
  std::string pair_expression(std::uint32_t i) {
    const std::uint32_t other = lanes_.second(i);
    const GraphNode& x = nodes_[i];
    const GraphNode& y = nodes_[other];
    const bool swapped = lanes_.swapped[other];
    const std::uint32_t a = swapped ? y.b : y.a;
    const std::uint32_t b = swapped ? y.a : y.b;
    const bool minus = lanes_.minus[i];
    if (x.op == Op::kAdd || x.op == Op::kSub) {
      const bool minus_b = x.op == Op::kSub;
      const bool second_minus_a = swapped && y.op == Op::kSub;
      const bool second_minus_b = !swapped && y.op == Op::kSub;
      return joined(i, vector(x.a, a, minus != second_minus_a),
                    vector(x.b, b, (minus != second_minus_b) != minus_b));
    }
    // The product's sign is on the operand whose sign is free, if any is.
    const bool held_a = held_minus(x.a, a);
    const bool a_is_free = is_free(x.a, a) && !is_free(x.b, b);
    const bool minus_b = a_is_free ? held_minus(x.b, b) : minus != held_a;
    const bool minus_a = minus != minus_b;
    return joined(i, vector(x.a, a, minus_a), vector(x.b, b, minus_b));
  }
  // With either sign: a sine, or what no vector holds and is made where it is used.
  bool is_free(std::uint32_t first, std::uint32_t second) const {
    if (are_tabulated(first, second)) return nodes_[first].op == Op::kSin;
    return lanes_.second(first) != second || !is_pair(first);
  }
  bool held_minus(std::uint32_t first, std::uint32_t second) const {
    return !is_free(first, second) && !is_tabulated(first) && lanes_.minus[first];
  }

  void write_part(std::uint32_t part) {
    part_ = part;
    release_slots(part);
    plan_stores(part);
    std::string body;
    for (const std::uint32_t i : parts_[part]) {
      if (is_pair(i)) {
        body += fmt::format("  const two p{} = {};\n", i, pair_expression(i));
        body += stores_after(i);
        if (last_part_[i] > part)
          body +=
              "  pair(w + " + std::to_string(take_slots(i)) + ") = p" + std::to_string(i) + ";\n";
        continue;
      }
      const std::string value = expression(i);
      const bool crosses = last_part_[i] > part;
      if (uses_[i] == 1 && outputs_of_[i].empty() && !crosses && value.size() < kLongestInline) {
        text_[i] = value;
        body += stores_after(i);
        continue;
      }
      const std::string name = "t" + std::to_string(i);
      body += "  const " + number_ + " " + name + " = " + value + ";\n" + stores_after(i);
      if (crosses) body += "  w[" + std::to_string(take_slot(i)) + "] = " + name + ";\n";
    }
    if (part + 1 == parts_.size()) body += plain_outputs();
    const std::string name = name_ + "_" + std::to_string(part);
    result_.declarations.push_back("void " + name + "(" + parameters_ + ");\n");
    result_.parts.push_back("void " + name + "(" + parameters_ + ") {\n" + body + "}\n");
  }

  // When the outputs of a part are stored.
  void plan_stores(std::uint32_t part) {
    const std::vector<std::uint32_t>& units = parts_[part];
    std::map<std::uint32_t, std::size_t> known;
    const auto add = [&](std::uint32_t node, std::size_t time) {
      for (const std::uint32_t output : outputs_of_[node]) known[output] = time;
    };
    for (std::size_t time = 0; time < units.size(); ++time) {
      add(units[time], time);
      if (is_pair(units[time])) add(lanes_.second(units[time]), time);
    }
    const bool many = states_ == 1 && kernel_.outputs.size() > kManyOutputs * units_;
    for (const OutputStore& store : stores_of(known, array_of_, many ? kLongestWait : 0))
      stores_[units[store.time]].push_back(store);
  }

  // The outputs that wait for this unit, and some of the zeros, which wait for nothing: they are
  // spread over the whole kernel.
  std::string stores_after(std::uint32_t unit) {
    std::string body;
    for (const OutputStore& store : stores_[unit]) {
      if (store.count == 1) {
        body += "  " + output_names_[store.first] + " = " + output_value(store.first) + ";\n";
        continue;
      }
      std::string values = output_value(store.first);
      for (std::uint32_t k = 1; k < store.count; ++k)
        values += ", " + output_value(store.first + k);
      body += vector_store(store, values);
    }
    ++written_units_;
    for (; written_zeros_ * units_ < zeros_.size() * written_units_; ++written_zeros_)
      body += vector_store(zeros_[written_zeros_], {});
    return body;
  }
  std::string vector_store(const OutputStore& store, const std::string& values) const {
    const char* type = store.count == 1 ? "double" : store.count == 2 ? "two" : "four";
    return fmt::format("  put(&{}, {}{{{}}});\n", output_names_[store.first], type, values);
  }
  std::string output_value(std::uint32_t output) {
    const Expr& value = kernel_.outputs[output];
    return (value.negative() ? "-" : "") + operand(value.node());
  }

  void find_zeros() {
    for (const std::vector<std::uint32_t>& part : parts_) units_ += part.size();
    if (states_ > 1) return;
    std::vector<bool> wanted(kernel_.outputs.size());
    for (std::uint32_t k = 0; k < wanted.size(); ++k)
      wanted[k] = is_zero(k) && !cleared_outputs_[k];
    if (units_ > 0) zeros_ = stores_of_runs(wanted, array_of_);
    for (const OutputStore& store : zeros_)
      for (std::uint32_t k = 0; k < store.count; ++k) cleared_outputs_[store.first + k] = true;
  }

  // Outputs that are constants, inputs or tabulated.
  std::string plain_outputs() {
    std::string body;
    for (std::size_t k = 0; k < kernel_.outputs.size(); ++k) {
      const Expr& output = kernel_.outputs[k];
      if (cleared_outputs_[k]) continue;
      if (output.is_constant()) {
        body += "  " + output_names_[k] + " = " + constant(output.value()) + ";\n";
      } else if (!is_written(output.node())) {
        body +=
            "  " + output_names_[k] + " = " + output_value(static_cast<std::uint32_t>(k)) + ";\n";
      }
    }
    return body;
  }

  std::string constant(double value) const {
    return states_ == 1 ? literal(value) : number_ + "{} + " + literal(value);
  }

  std::uint32_t take_slot(std::uint32_t i) {
    if (free_.empty()) {
      slot_[i] = workspace_++;
    } else {
      slot_[i] = free_.top();
      free_.pop();
    }
    taken_.push_back(i);
    return slot_[i];
  }
  // Takes two aligned slots for a pair, and gives the first of them.
  std::uint32_t take_slots(std::uint32_t i) {
    if (free_pairs_.empty()) {
      if (workspace_ % 2 != 0) free_.push(workspace_++);
      slot_[i] = workspace_;
      workspace_ += 2;
    } else {
      slot_[i] = free_pairs_.top();
      free_pairs_.pop();
    }
    taken_.push_back(i);
    return slot_[i];
  }
  void release_slots(std::uint32_t part) {
    std::erase_if(taken_, [&](std::uint32_t i) {
      if (last_part_[i] >= part) return false;
      (is_pair(i) ? free_pairs_ : free_).push(slot_[i]);
      return true;
    });
  }

  void write_entry() {
    std::string body;
    if (workspace_ > 0)
      body += (states_ == 1 ? "  alignas(32) " : "  ") + number_ + " w[" +
              std::to_string(workspace_) + "];\n";
    else
      body += "  " + number_ + "* w = nullptr;\n";
    for (const KernelArray& out : kernel_.shape.outputs)
      if (cleared_.contains(out.name))
        body += "  for (int i = 0; i < " + std::to_string(out.size) + "; ++i) " +
                element(out, "i") + " = " + constant(0.0) + ";\n";
    if (states_ > 1) body += sines_of_states();
    for (std::size_t part = 0; part < parts_.size(); ++part)
      body += "  " + name_ + "_" + std::to_string(part) + "(" + arguments_ + ");\n";
    if (!at_sines_) {
      result_.entry = "void " + name_ + "(" + result_.parameters + ") {\n" + body + "}\n";
      return;
    }
    const std::string own = arguments_.substr(0, arguments_.size() - 3);  // without ", w"
    result_.entry = fmt::format(
        "void {0}_at(const double* s, {1}) {{\n{2}}}\n"
        "void {0}({1}) {{\n  alignas(32) double s[sine_count];\n  sines(q, s);\n  "
        "{0}_at({3});\n}}\n",
        name_, result_.parameters, body, own);
  }
  std::string sines_of_states() const {
    const std::vector<std::string>& angles = sines_.angles();
    if (angles.empty()) return {};
    std::string body;
    for (std::size_t k = 0; k < angles.size(); ++k)
      body += fmt::format("  w[{}] = {};\n", k, angles[k].empty() ? number_ + "{}" : angles[k]);
    return body + fmt::format(
                      "  sines_and_cosines<{0}, {0}_bits, 2>({1}, reinterpret_cast<double*>(w), "
                      "reinterpret_cast<double*>(w + {2}));\n",
                      number_, states_ * angles.size(), angles.size());
  }
  // An angle in full, its operands too: nothing is computed before it.
  std::string early(std::uint32_t i) {
    const GraphNode& node = nodes_[i];
    const auto value = [&](std::uint32_t k) {
      return is_operation(nodes_[k].op) ? "(" + early(k) + ")" : operand(k);
    };
    switch (node.op) {
      case Op::kAdd: return value(node.a) + " + " + value(node.b);
      case Op::kSub: return value(node.a) + " - " + value(node.b);
      case Op::kMul: return value(node.a) + " * " + value(node.b);
      default: return operand(i);
    }
  }

  std::span<const GraphNode> nodes_;
  const TracedKernel& kernel_;
  Lanes lanes_;
  SineTable& sines_;
  std::uint32_t part_operations_;
  std::uint32_t states_;               // at once: 1, 4 or 8
  std::string number_, array_, name_;  // types of a number and of what arguments point at
  std::vector<bool> live_;
  std::vector<std::uint32_t> uses_, part_of_, last_part_, slot_, angle_;
  std::vector<bool> negated_;                           // held as its negative
  std::vector<std::string> text_;                       // written where it is used
  std::vector<std::vector<std::uint32_t>> outputs_of_;  // per node
  std::vector<std::string> output_names_;
  std::vector<std::uint32_t> array_of_;                       // per output
  std::map<std::uint32_t, std::vector<OutputStore>> stores_;  // after a unit
  std::vector<OutputStore> zeros_;
  std::size_t units_ = 0, written_units_ = 0, written_zeros_ = 0;
  std::set<std::string> cleared_;      // outputs, mostly zeros, that a loop clears first
  std::vector<bool> cleared_outputs_;  // per output: nothing is left to write
  bool at_sines_ = false;              // takes the table of the robot's sines
  std::vector<std::vector<std::uint32_t>> parts_;
  std::uint32_t part_ = 0;
  std::uint32_t workspace_ = 0;
  using Slots = std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>>;
  Slots free_, free_pairs_;
  std::vector<std::uint32_t> taken_;
  std::string parameters_, arguments_;
  EmittedKernel result_;
};

}  // namespace

EmittedKernel emit_kernel(const Graph& graph, const TracedKernel& kernel, const Mechanism& m,
                          SineTable& sines, std::uint32_t part_operations) {
  Graph ordered;
  OrderedSums sums = ordered_sums(graph, kernel.outputs, pair_lanes(graph, kernel, m), ordered);
  const TracedKernel same{kernel.shape, std::move(sums.outputs)};
  const Lanes lanes = pair_lanes(ordered, same, m, sums.second_of);
  return Emitter(ordered, same, lanes, sines, part_operations, 1).run();
}

EmittedKernel emit_batch(const Graph& graph, const TracedKernel& kernel, std::uint32_t states,
                         std::uint32_t part_operations) {
  SineTable own;
  return Emitter(graph, kernel, {}, own, part_operations, states).run();
}

}  // namespace tandem::model
