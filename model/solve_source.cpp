// Which entries of the factor are not zero follows from those of M. Elimination is written row by
// row without loops, for some columns of the right-hand side at a time, as vectors in registers.
#include "model/emit.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace tandem::model {
namespace {

constexpr int kMostLanes = 8;  // of a vector, in the widest variant

using Pattern = std::vector<std::vector<int>>;  // by row: columns in rising order

/// Where L of M = L^T D L (Featherstone 2008, section 6.5) has entries below the diagonal. Going
/// from the last row to the first makes new ones only where followers tie limbs together.
Pattern factor_pattern(const TracedKernel& inverse, std::size_t n) {
  std::vector<std::vector<bool>> entry(n, std::vector<bool>(n));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) {
      const Expr& M_ij = inverse.outputs[(2 * n + i) * n + j];
      entry[i][j] = !M_ij.is_constant() || M_ij.value() != 0.0;
    }
  Pattern before(n);
  for (std::size_t k = n; k-- > 0;)
    for (std::size_t i = 0; i < k; ++i) {
      if (!entry[k][i]) continue;
      before[k].push_back(static_cast<int>(i));
      for (std::size_t j = 0; j < i; ++j) entry[i][j] = entry[i][j] || entry[k][j];
    }
  return before;
}

/// How right-hand sides lie in the workspace: dtau_dq, dtau_dv, the identity side by side, each
/// from its first column that is not trivial. Of a floating base, those are trivial that accelerate
/// everything alike: M^-1 times M's own first columns.
struct Layout {
  int size, base_q, base_v, vectors, width;

  explicit Layout(const Mechanism& m)
      : size(m.kernel_nv()), base_q(m.floating_base ? 6 : 0), base_v(m.floating_base ? 3 : 0) {
    const int columns = 3 * size - base_q - base_v;
    int least = 0;
    for (const int some : {5, 4, 3}) {  // vectors of two rows fit the registers
      const int padded = (columns + 4 * some - 1) / (4 * some) * 4 * some;
      if (least != 0 && padded >= least) continue;
      least = padded;
      vectors = some;
    }
    width = (columns + kMostLanes * vectors - 1) / (kMostLanes * vectors) * kMostLanes * vectors;
  }
};

/// Writes x_r -= L_rk x_k (or L_kr) for all k that row r needs, row after row; two rows together
/// where the second needs what the first needs, and the first.
class Sweep {
 public:
  Sweep(const Layout& layout, const Pattern& before, std::uint32_t part_operations)
      : layout_(layout), before_(before), part_operations_(part_operations) {
    int entries = 0;
    for (const std::vector<int>& row : before) {
      first_.push_back(entries);
      entries += static_cast<int>(row.size());
    }
  }

  /// X = L^-T X, from the leaves to the root.
  void to_root() {
    Pattern behind(before_.size());
    for (int k = 0; k < layout_.size; ++k)
      for (const int i : before_[k]) behind[i].push_back(k);
    for (int r = layout_.size - 1; r >= 0; --r) r -= rows(behind, r, r - 1, false);
  }
  /// X = -L^-1 D^-1 X, from the root to the leaves.
  void to_leaves() {
    for (int r = 0; r < layout_.size; ++r) r += rows(before_, r, r + 1, true);
  }
  /// Adds the parts to `kernel`, and returns the calls of all.
  std::string finish(EmittedKernel& kernel) {
    close();
    std::string calls;
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      const std::string name = kernel.name + "_" + std::to_string(p);
      const std::string head = "void " + name +
                               "(const double* __restrict L, const double* __restrict "
                               "minus_reciprocal, double* __restrict x)";
      kernel.declarations.push_back(head + ";\n");
      kernel.parts.push_back(head + " {\n" + parts_[p] + "}\n");
      kernel.sizes.push_back(part_operations_);
      calls += fmt::format(
          "  for (int c = 0; c < columns; c += {} * lanes) {}(L, minus_reciprocal, x + c);\n",
          layout_.vectors, name);
    }
    return calls;
  }

 private:
  /// @return how many rows more than one
  int rows(const Pattern& others, int r, int next, bool scale) {
    const bool two = next >= 0 && next < layout_.size && follows(others, r, next);
    if (others[r].empty() && !two && !scale) return 0;
    body_ += "  {\n" + load("a", r, scale) + (two ? load("b", next, scale) : "");
    for (const int k : others[r]) {
      body_ += "    {\n      const double f = " + entry(r, k) + ";\n";
      if (two) body_ += "      const double g = " + entry(next, k) + ";\n";
      for (int i = 0; i < layout_.vectors; ++i)
        body_ += fmt::format("      const wide y{0} = {1}; a{0} -= f * y{0};{2}\n", i, at(k, i),
                             two ? fmt::format(" b{0} -= g * y{0};", i) : "");
      body_ += "    }\n";
    }
    body_ += store("a", r);
    if (two) {
      for (int i = 0; i < layout_.vectors; ++i)
        body_ += fmt::format("    b{0} -= {1} * a{0};\n", i, entry(next, r));
      body_ += store("b", next);
    }
    body_ += "  }\n";
    operations_ += 2 * static_cast<std::uint32_t>((two ? 2 : 1) * layout_.vectors) *
                   static_cast<std::uint32_t>(others[r].size() + 1);
    if (operations_ >= part_operations_) close();
    return two ? 1 : 0;
  }
  static bool follows(const Pattern& others, int r, int next) {
    std::vector<int> expected = others[r];
    expected.insert(std::ranges::lower_bound(expected, r), r);
    return others[next] == expected;
  }
  std::string entry(int r, int k) const {
    const int row = std::max(r, k);
    const auto& columns = before_[row];
    const auto place = std::ranges::find(columns, std::min(r, k)) - columns.begin();
    return fmt::format("L[{}]", first_[row] + place);
  }
  std::string at(int row, int i) const {
    return fmt::format("get<wide>(x + {} + {} * lanes)", row * layout_.width, i);
  }
  std::string load(const std::string& name, int row, bool scale) const {
    std::string text;
    for (int i = 0; i < layout_.vectors; ++i)
      text += fmt::format("    wide {}{} = {}{};\n", name, i,
                          scale ? fmt::format("minus_reciprocal[{}] * ", row) : "", at(row, i));
    return text;
  }
  std::string store(const std::string& name, int row) const {
    std::string text;
    for (int i = 0; i < layout_.vectors; ++i)
      text +=
          fmt::format("    put(x + {0} + {1} * lanes, {2}{1});\n", row * layout_.width, i, name);
    return text;
  }
  void close() {
    if (!body_.empty()) parts_.push_back(std::move(body_));
    body_.clear();
    operations_ = 0;
  }

  const Layout& layout_;
  const Pattern& before_;
  std::uint32_t part_operations_, operations_ = 0;
  std::vector<int> first_;  // per row of L: its first entry
  std::string body_;
  std::vector<std::string> parts_;
};

constexpr std::string_view kEntry = R"(
static inline void copy(const double* from, double* to, int count) {{
  int i = 0;
  for (; i + lanes <= count; i += lanes) put(to + i, get<wide>(from + i));
  if (count >= lanes) i = count - lanes;  // some of them once more
  for (; i + lanes <= count; i += lanes) put(to + i, get<wide>(from + i));
  for (; i < count; ++i) to[i] = from[i];
}}
void {name}({parameters}) {{
  constexpr int n = {size}, base_q = {base_q}, base_v = {base_v}, width = {width};
  constexpr int at_v = n - base_q, at_tau = at_v + n - base_v, columns = at_tau + n;
  double vdot[n], L[{entries}], minus_reciprocal[n];
  alignas(32) double s[sine_count];
  sines(q, s);
  forward_dynamics_at(s, q, v, tau, wrench, vdot);
  inverse_dynamics_derivatives_at(s, q, v, vdot, wrench, dvdot_dq, dvdot_dv, dvdot_dtau);
  mass_factor(dvdot_dtau, L, minus_reciprocal);
  alignas(64) double x[n * width];
  for (int i = 0; i < n; ++i) {{
    for (int j = at_tau / lanes * lanes; j < width; j += lanes) put(x + i * width + j, wide{{}});
    copy(dvdot_dq + i * n + base_q, x + i * width, n - base_q);
    copy(dvdot_dv + i * n + base_v, x + i * width + at_v, n - base_v);
    x[i * width + at_tau + i] = -1.0;
  }}
  const double minus_mass_reciprocal = -1.0 / dvdot_dtau[0];
{calls}  for (int i = 0; i < n; ++i) {{
    const double uniform = i < 3 ? minus_mass_reciprocal : 0.0;
    for (int j = 0; j < base_q; ++j) dvdot_dq[i * n + j] *= uniform;
    for (int j = 0; j < base_v; ++j) dvdot_dv[i * n + j] *= uniform;
    copy(x + i * width, dvdot_dq + i * n + base_q, n - base_q);
    copy(x + i * width + at_v, dvdot_dv + i * n + base_v, n - base_v);
    copy(x + i * width + at_tau, dvdot_dtau + i * n, n);
  }}
}}
)";

}  // namespace

TracedKernel trace_mass_factor(const TracedKernel& inverse, const Mechanism& m, Graph& graph) {
  const auto n = static_cast<std::size_t>(m.kernel_nv());
  const Pattern before = factor_pattern(inverse, n);
  std::vector<Expr> A;
  for (std::uint32_t i = 0; i < n * n; ++i) A.push_back(graph.input(0, i));
  const auto at = [&](std::size_t i, int j) -> Expr& {
    return A[i * n + static_cast<std::size_t>(j)];
  };
  std::vector<std::vector<Expr>> L(n);
  std::vector<Expr> minus_reciprocal(n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (const Expr& M_ij = inverse.outputs[(2 * n + i) * n + j];
          M_ij.is_constant() && M_ij.value() == 0.0)
        A[i * n + j] = 0.0;
  for (std::size_t k = n; k-- > 0;) {
    const Expr reciprocal = Expr(1.0) / A[k * n + k];
    minus_reciprocal[k] = -reciprocal;
    for (const int i : before[k]) {
      L[k].push_back(at(k, i) * reciprocal);
      for (const int j : before[k])
        if (j <= i) at(static_cast<std::size_t>(i), j) -= L[k].back() * at(k, j);
    }
  }
  TracedKernel result;
  for (const std::vector<Expr>& row : L)
    result.outputs.insert(result.outputs.end(), row.begin(), row.end());
  const int entries = static_cast<int>(result.outputs.size());
  result.outputs.insert(result.outputs.end(), minus_reciprocal.begin(), minus_reciprocal.end());
  result.shape = {"mass_factor",
                  {{"M", static_cast<int>(n * n)}},
                  {{"L", entries}, {"minus_reciprocal", static_cast<int>(n)}}};
  return result;
}

EmittedKernel emit_forward_derivatives(const TracedKernel& inverse, const Mechanism& m,
                                       EmittedKernel factor, std::uint32_t part_operations) {
  const Layout layout(m);
  const Pattern before = factor_pattern(inverse, static_cast<std::size_t>(layout.size));
  EmittedKernel result = std::move(factor);
  const KernelShape shape = kernel_shape(Kernel::kForwardDynamicsDerivatives, m);
  result.name = shape.name;
  result.parameters.clear();
  for (const KernelArray& array : shape.inputs)
    result.parameters += "const double* " + array.name + ", ";
  for (const KernelArray& array : shape.outputs)
    result.parameters += "double* " + array.name + ", ";
  result.parameters.resize(result.parameters.size() - 2);
  Sweep sweep(layout, before, part_operations);
  sweep.to_root();
  sweep.to_leaves();
  const std::string calls = sweep.finish(result);
  std::uint32_t entries = 0;
  for (const std::vector<int>& row : before) entries += static_cast<std::uint32_t>(row.size());
  const auto size = static_cast<std::uint32_t>(layout.size);
  const std::uint32_t columns =
      3 * size - static_cast<std::uint32_t>(layout.base_q + layout.base_v);
  result.count.add += 2 * entries * columns;
  result.count.mul += (2 * entries + size) * columns;
  result.entry += fmt::format(fmt::runtime(kEntry), fmt::arg("name", result.name),
                              fmt::arg("parameters", result.parameters),
                              fmt::arg("size", layout.size), fmt::arg("base_q", layout.base_q),
                              fmt::arg("base_v", layout.base_v), fmt::arg("width", layout.width),
                              fmt::arg("entries", std::max(entries, 1u)), fmt::arg("calls", calls));
  return result;
}

}  // namespace tandem::model
