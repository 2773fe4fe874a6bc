// Kernels as expressions: each algorithm once, run over the nodes of a graph.
#include "model/emit.hpp"

namespace tandem::model {

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

}  // namespace tandem::model
