// Nodes become statements in the order in which the algorithm made them, cut into parts of 500
// operations; what a later part needs goes through the workspace.
#include "model/emit.hpp"

#include <algorithm>
#include <charconv>
#include <functional>
#include <limits>
#include <queue>
#include <set>

namespace tandem::model {
namespace {

constexpr std::size_t kLongestInline = 96;  // characters of an expression written into another
constexpr int kEarlyDepth = 3;    // of an angle: (multiplier * q + offset) + the frames' own offset
constexpr int kMostZeros = 1000;  // of one output that are written one by one
constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

// The shortest text that reads back as the same double, never an integer literal.
std::string literal(double value) {
  char text[40];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  std::string result(text, end);
  if (result.find_first_of(".en") == std::string::npos) result += ".0";
  return result;
}

// Writes one kernel. Nodes are emitted in the order in which the algorithm made them, which
// walks limb by limb; a value that a later part needs goes through the workspace w.
class Emitter {
 public:
  Emitter(const Graph& graph, const TracedKernel& kernel, std::uint32_t part_operations)
      : nodes_(graph.nodes()),
        kernel_(kernel),
        part_operations_(part_operations),
        live_(live_nodes(graph, kernel.outputs)),
        uses_(nodes_.size(), 0),
        part_of_(nodes_.size(), kNowhere),
        last_part_(nodes_.size(), 0),
        slot_(nodes_.size(), kNowhere),
        angle_(nodes_.size(), kNowhere),
        text_(nodes_.size()),
        outputs_of_(nodes_.size()) {
    result_.name = kernel.shape.name;
    result_.count = count_operations(graph, kernel.outputs);
  }

  EmittedKernel run() {
    name_arguments();
    find_angles();
    find_uses();
    schedule();
    for (std::uint32_t part = 0; part < parts_.size(); ++part) write_part(part);
    write_entry();
    return std::move(result_);
  }

 private:
  void name_arguments() {
    for (const KernelArray& in : kernel_.shape.inputs) {
      parameters_ += "const double* __restrict " + in.name + ", ";
      arguments_ += in.name + ", ";
      result_.parameters += (result_.parameters.empty() ? "" : ", ");
      result_.parameters += "const double* " + in.name;
    }
    for (std::uint32_t a = 0, first = 0; a < kernel_.shape.outputs.size(); ++a) {
      const KernelArray& out = kernel_.shape.outputs[a];
      parameters_ += "double* __restrict " + out.name + ", ";
      arguments_ += out.name + ", ";
      result_.parameters += ", double* " + out.name;
      int zeros = 0;
      for (int i = 0; i < out.size; ++i) zeros += is_zero(first + static_cast<std::uint32_t>(i));
      if (zeros > kMostZeros) cleared_.insert(out.name);
      for (int i = 0; i < out.size; ++i, ++first) {
        cleared_outputs_.push_back(zeros > kMostZeros && is_zero(first));
        output_names_.push_back(out.name + "[" + std::to_string(i) + "]");
        const Expr& output = kernel_.outputs[first];
        if (!output.is_constant()) outputs_of_[output.node()].push_back(first);
      }
    }
    parameters_ += "double* __restrict w";
    arguments_ += "w";
  }

  bool is_zero(std::uint32_t output) const {
    const Expr& value = kernel_.outputs[output];
    return value.is_constant() && value.value() == 0.0;
  }

  // An angle that is a sum or product of inputs and constants: known before the first part.
  bool is_early(std::uint32_t i, int depth = 0) const {
    const Node& node = nodes_[i];
    if (!is_operation(node.op)) return true;
    if (node.op != Op::kAdd && node.op != Op::kSub && node.op != Op::kMul) return false;
    return depth < kEarlyDepth && is_early(node.a, depth + 1) && is_early(node.b, depth + 1);
  }

  bool is_trigonometric(std::uint32_t i) const {
    return nodes_[i].op == Op::kSin || nodes_[i].op == Op::kCos;
  }

  void find_angles() {
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (!live_[i] || !is_trigonometric(i) || !is_early(nodes_[i].a)) continue;
      if (angle_[nodes_[i].a] != kNowhere) continue;
      angle_[nodes_[i].a] = static_cast<std::uint32_t>(angles_.size());
      angles_.push_back(nodes_[i].a);
    }
    table_ = (static_cast<std::uint32_t>(angles_.size()) + 3) / 4 * 4;  // whole vectors
    workspace_ = 3 * table_;
  }

  // Its sine or cosine was computed with all others before the first part.
  bool is_tabulated(std::uint32_t i) const {
    return is_trigonometric(i) && angle_[nodes_[i].a] != kNowhere;
  }

  void find_uses() {
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (!live_[i] || !is_operation(nodes_[i].op) || is_tabulated(i)) continue;
      ++uses_[nodes_[i].a];
      if (is_binary(nodes_[i].op)) ++uses_[nodes_[i].b];
    }
    for (std::uint32_t i = 0; i < nodes_.size(); ++i)
      uses_[i] += static_cast<std::uint32_t>(outputs_of_[i].size());
  }

  void schedule() {
    parts_.emplace_back();
    std::uint32_t operations = 0;
    for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
      if (uses_[i] == 0 || !is_operation(nodes_[i].op) || is_tabulated(i)) continue;
      if (operations == part_operations_) {
        result_.sizes.push_back(operations);
        parts_.emplace_back();
        operations = 0;
      }
      part_of_[i] = static_cast<std::uint32_t>(parts_.size() - 1);
      parts_.back().push_back(i);
      ++operations;
      mark_used(nodes_[i].a, part_of_[i]);
      if (is_binary(nodes_[i].op)) mark_used(nodes_[i].b, part_of_[i]);
    }
    result_.sizes.push_back(operations);
  }
  void mark_used(std::uint32_t i, std::uint32_t part) { last_part_[i] = part; }

  std::string operand(std::uint32_t i) {
    const Node& node = nodes_[i];
    if (node.op == Op::kConstant) return literal(node.value);
    if (node.op == Op::kInput)
      return kernel_.shape.inputs[node.a].name + "[" + std::to_string(node.b) + "]";
    if (is_tabulated(i)) {
      const std::size_t table = (node.op == Op::kSin ? 1 : 2) * table_;
      return "w[" + std::to_string(table + angle_[node.a]) + "]";
    }
    if (!text_[i].empty()) return "(" + text_[i] + ")";
    if (part_of_[i] != part_) return "w[" + std::to_string(slot_[i]) + "]";
    return "t" + std::to_string(i);
  }

  std::string expression(std::uint32_t i) {
    const Node& node = nodes_[i];
    std::string a = operand(node.a);
    switch (node.op) {
      case Op::kAdd: return a + " + " + operand(node.b);
      case Op::kSub: return a + " - " + operand(node.b);
      case Op::kMul: return a + " * " + operand(node.b);
      case Op::kDiv: return a + " / " + operand(node.b);
      case Op::kSqrt: return "__builtin_sqrt(" + a + ")";
      case Op::kSin: return "__builtin_sin(" + a + ")";
      case Op::kCos: return "__builtin_cos(" + a + ")";
      case Op::kInput:
      case Op::kConstant: break;
    }
    return a;
  }

  void write_part(std::uint32_t part) {
    part_ = part;
    release_slots(part);
    std::string body;
    for (const std::uint32_t i : parts_[part]) {
      const std::string value = expression(i);
      const bool crosses = last_part_[i] > part;
      if (uses_[i] == 1 && outputs_of_[i].empty() && !crosses && value.size() < kLongestInline) {
        text_[i] = value;
        continue;
      }
      const std::string name = "t" + std::to_string(i);
      body += "  const double " + name + " = " + value + ";\n";
      for (const std::uint32_t output : outputs_of_[i])
        body += "  " + output_names_[output] + " = " +
                (kernel_.outputs[output].negative() ? "-" : "") + name + ";\n";
      if (crosses) body += "  w[" + std::to_string(take_slot(i)) + "] = " + name + ";\n";
    }
    if (part + 1 == parts_.size()) body += plain_outputs();
    const std::string name = kernel_.shape.name + "_" + std::to_string(part);
    result_.declarations.push_back("void " + name + "(" + parameters_ + ");\n");
    result_.parts.push_back("void " + name + "(" + parameters_ + ") {\n" + body + "}\n");
  }

  // Outputs that are constants, inputs or tabulated.
  std::string plain_outputs() {
    std::string body;
    for (std::size_t k = 0; k < kernel_.outputs.size(); ++k) {
      const Expr& output = kernel_.outputs[k];
      if (cleared_outputs_[k]) continue;
      if (output.is_constant()) {
        body += "  " + output_names_[k] + " = " + literal(output.value()) + ";\n";
      } else if (part_of_[output.node()] == kNowhere) {
        body += "  " + output_names_[k] + " = " + (output.negative() ? "-" : "") +
                operand(output.node()) + ";\n";
      }
    }
    return body;
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
  void release_slots(std::uint32_t part) {
    std::erase_if(taken_, [&](std::uint32_t i) {
      if (last_part_[i] >= part) return false;
      free_.push(slot_[i]);
      return true;
    });
  }

  void write_entry() {
    std::string body;
    if (workspace_ > 0)
      body += "  alignas(32) double w[" + std::to_string(workspace_) + "];\n";
    else
      body += "  double* w = nullptr;\n";
    for (const KernelArray& out : kernel_.shape.outputs)
      if (cleared_.contains(out.name))
        body += "  for (int i = 0; i < " + std::to_string(out.size) + "; ++i) " + out.name +
                "[i] = 0.0;\n";
    for (std::size_t k = 0; k < angles_.size(); ++k)
      body += "  w[" + std::to_string(k) + "] = " + early(angles_[k]) + ";\n";
    for (std::size_t k = angles_.size(); k < table_; ++k)
      body += "  w[" + std::to_string(k) + "] = 0.0;\n";
    const std::string n = std::to_string(table_);
    if (!angles_.empty())
      body += "  sines_and_cosines(" + n + ", w, w + " + n + ", w + 2 * " + n + ");\n";
    for (std::size_t part = 0; part < parts_.size(); ++part)
      body += "  " + kernel_.shape.name + "_" + std::to_string(part) + "(" + arguments_ + ");\n";
    result_.entry =
        "void " + kernel_.shape.name + "(" + result_.parameters + ") {\n" + body + "}\n";
  }
  // An angle in full, its operands too: nothing is computed before it.
  std::string early(std::uint32_t i) {
    const Node& node = nodes_[i];
    if (!is_operation(node.op)) return operand(i);
    for (const std::uint32_t k : {node.a, node.b})
      text_[k] = is_operation(nodes_[k].op) ? early(k) : "";
    return expression(i);
  }

  std::span<const Node> nodes_;
  const TracedKernel& kernel_;
  std::uint32_t part_operations_;
  std::vector<bool> live_;
  std::vector<std::uint32_t> uses_, part_of_, last_part_, slot_, angle_;
  std::vector<std::string> text_;                       // written where it is used
  std::vector<std::vector<std::uint32_t>> outputs_of_;  // per node
  std::vector<std::string> output_names_;
  std::set<std::string> cleared_;      // outputs, mostly zeros, that a loop clears first
  std::vector<bool> cleared_outputs_;  // per output: nothing is left to write
  std::vector<std::uint32_t> angles_;
  std::vector<std::vector<std::uint32_t>> parts_;
  std::uint32_t part_ = 0;
  std::uint32_t table_ = 0;  // its length
  std::uint32_t workspace_ = 0;
  std::priority_queue<std::uint32_t, std::vector<std::uint32_t>, std::greater<>> free_;
  std::vector<std::uint32_t> taken_;
  std::string parameters_, arguments_;
  EmittedKernel result_;
};

}  // namespace

TracedKernel trace_kernel(Kernel kernel, const Mechanism& m, Graph& graph) {
  TracedKernel result{kernel_shape(kernel, m), {}};
  std::vector<std::vector<Expr>> in;
  std::vector<std::vector<Expr>> out;
  for (const KernelArray& array : result.shape.inputs) {
    const auto number = static_cast<std::uint32_t>(in.size());
    in.emplace_back();
    for (int i = 0; i < array.size; ++i)
      in.back().push_back(graph.input(number, static_cast<std::uint32_t>(i)));
  }
  for (const KernelArray& array : result.shape.outputs)
    out.emplace_back(static_cast<std::size_t>(array.size), Expr(0.0));
  run_kernel<Expr>(kernel, m, in, out);
  for (const std::vector<Expr>& array : out)
    result.outputs.insert(result.outputs.end(), array.begin(), array.end());
  return result;
}

TracedKernel trace_mass_times(const Mechanism& m, Graph& graph) {
  Mechanism floating = m;  // in empty space
  floating.gravity = {0.0, 0.0, 0.0};
  const KernelShape shape = kernel_shape(Kernel::kInverseDynamics, m);  // q, v, vdot, wrench -> tau
  const KernelArray& vdot = shape.inputs[2];
  TracedKernel result{{"mass_times", {shape.inputs[0], vdot}, shape.outputs}, {}};
  std::vector<std::vector<Expr>> in;
  for (const KernelArray& array : shape.inputs)
    in.emplace_back(static_cast<std::size_t>(array.size), Expr(0.0));
  for (std::uint32_t i = 0; i < in[0].size(); ++i) in[0][i] = graph.input(0, i);
  for (std::uint32_t i = 0; i < in[2].size(); ++i) in[2][i] = graph.input(1, i);
  std::vector<std::vector<Expr>> out;
  out.emplace_back(static_cast<std::size_t>(shape.outputs[0].size), Expr(0.0));
  run_kernel<Expr>(Kernel::kInverseDynamics, floating, in, out);
  result.outputs = std::move(out[0]);
  return result;
}

EmittedKernel emit_kernel(const Graph& graph, const TracedKernel& kernel,
                          std::uint32_t part_operations) {
  return Emitter(graph, kernel, part_operations).run();
}

}  // namespace tandem::model
