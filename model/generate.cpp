// Traces every kernel, emits it, and gathers the parts into files of about equal length, with one
// entry file per variant.
#include "model/generate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "base/quoting.hpp"
#include "model/emit.hpp"
#include "model/kernel_sources.hpp"

namespace tandem::model {
namespace {

// Operations of one function, and of one source file: gcc's time and memory grow with the
// square of a function's length, and files are compiled side by side.
constexpr std::uint32_t kPartOperations = 500;
constexpr std::uint32_t kFileOperations = 3000;

// The mass matrix of a chain has as many operations as the square of its joints. Beyond so many it
// is written as a loop over its columns, each the forces of one unit acceleration: as accurate,
// slower to run, and linear in code.
constexpr std::uint32_t kMostMassMatrixOperations = 40'000;

constexpr std::string_view kBanner =
    "// Made by `tandem model build`: change the robot's description instead.\n";

// Beyond so many operations of forward dynamics code is far larger than the caches. A batch then
// calls the kernel for one state after another: as fast, and half as much to compile.
constexpr std::uint32_t kMostBatchOperations = 20'000;

// Vectors of two lanes, of four and eight states, and as wide as the variant has them.
constexpr std::string_view kVectors =
    R"(typedef double two __attribute__((vector_size(16), may_alias));
typedef long long two_bits __attribute__((vector_size(16), may_alias));
static inline two& pair(double* at) { return *reinterpret_cast<two*>(at); }
static inline two pair(const double* at) { return *reinterpret_cast<const two*>(at); }
static inline two flip(two x) {  // minus lane 1
  const two_bits sign = {0, static_cast<long long>(0x8000000000000000u)};
  return reinterpret_cast<two>(reinterpret_cast<two_bits>(x) ^ sign);
}
typedef double four __attribute__((vector_size(32), may_alias));
typedef double four_at __attribute__((vector_size(32), may_alias, aligned(8)));
static inline four_at& four_of(double* at) { return *reinterpret_cast<four_at*>(at); }
static inline const four_at& four_of(const double* at) {
  return *reinterpret_cast<const four_at*>(at);
}
static inline double root(double x) { return __builtin_sqrt(x); }
static inline double sine(double x) { return __builtin_sin(x); }
static inline double cosine(double x) { return __builtin_cos(x); }
static inline four root(four x) { return four{root(x[0]), root(x[1]), root(x[2]), root(x[3])}; }
static inline four sine(four x) { return four{sine(x[0]), sine(x[1]), sine(x[2]), sine(x[3])}; }
static inline four cosine(four x) {
  return four{cosine(x[0]), cosine(x[1]), cosine(x[2]), cosine(x[3])};
}
#if defined(__AVX512F__)
typedef double eight __attribute__((vector_size(64), may_alias));
typedef double eight_at __attribute__((vector_size(64), may_alias, aligned(8)));
static inline eight root(eight x) {
  for (int i = 0; i < 8; ++i) x[i] = root(x[i]);
  return x;
}
static inline eight sine(eight x) {
  for (int i = 0; i < 8; ++i) x[i] = sine(x[i]);
  return x;
}
static inline eight cosine(eight x) {
  for (int i = 0; i < 8; ++i) x[i] = cosine(x[i]);
  return x;
}
typedef eight wide;
#elif defined(__AVX2__)
typedef four wide;
#else
typedef two wide;
#endif
constexpr int lanes = sizeof(wide) / sizeof(double);
template <class T>
static inline T get(const double* from) {
  T value;
  __builtin_memcpy(&value, from, sizeof value);
  return value;
}
template <class T>
static inline void put(double* to, const T& value) {
  __builtin_memcpy(to, &value, sizeof value);
}
)";

// With shorter vectors four or eight states at once are slower than one or four after another.
constexpr std::string_view kIfFourLanes = "#ifdef __AVX2__\n";
constexpr std::string_view kIfEightLanes = "#ifdef __AVX512F__\n";

/// Everything that a library holds.
struct Emitted {
  using Some = std::vector<EmittedKernel>;
  SineTable sines;
  Some kernels;        // by number
  Some fours, eights;  // batches; may be empty
  Some derivatives;    // of inverse and forward dynamics, or none

  /// `text` of one of these, for the variants that have it.
  std::string guarded(const Some& of, const std::string& text) const {
    if (&of == &fours) return std::string(kIfFourLanes) + text + "#endif\n";
    if (&of == &eights) return std::string(kIfEightLanes) + text + "#endif\n";
    return text;
  }
};

std::string name_table(const std::string& name, const std::vector<std::string>& values) {
  std::string text = fmt::format("const char* const {}[] = {{", name);
  for (const std::string& value : values) text += quoted_text(value) + ", ";
  return text + "nullptr};\n";
}

std::string count_table(const std::vector<KernelCount>& counts) {
  std::string text = "const tandem_kernel_count counts[] = {\n";
  for (const auto& [kernel, c] : counts)
    text += fmt::format("    {{\"{}\", {}, {}, {}, {}, {}, {}}},\n", kernel, c.add, c.mul, c.div,
                        c.sqrt, c.sincos, c.pairs);
  return text + "};\n";
}

constexpr Kernel kBatches[] = {Kernel::kForwardDynamics, Kernel::kInverseDynamics};

// The loop of a batch over its states, four at a time, where they stand.
std::string fours_source(const KernelShape& shape) {
  std::string given = "states";
  for (const auto* arrays : {&shape.inputs, &shape.outputs})
    for (const KernelArray& array : *arrays) given += ", " + array.name + " + s";
  return fmt::format("  for (; s + 4 <= states; s += 4) {}_four({});\n", shape.name, given);
}

// The same for one (`step` 1) or eight at a time, in arrays of its own but for exactly eight, which
// stand as they are wanted: with steps in between, that kernel takes an eighth longer.
std::string states_source(const KernelShape& shape, int step) {
  const std::string number = step == 1 ? "double" : "eight";
  const std::string call = shape.name + (step == 1 ? "" : "_" + number);
  std::string arrays, in, out, own, given;
  const auto add = [&](const KernelArray& array, bool output) {
    const std::string& name = array.name;
    arrays += fmt::format("    {} {}_[{}];\n", number, name, std::max(array.size, 1));
    const std::string copy =
        output ? fmt::format("put({0} + i * states + s, {0}_[i])", name)
               : fmt::format("{0}_[i] = get<{1}>({0} + i * states + s)", name, number);
    (output ? out : in) += fmt::format("    for (int i = 0; i < {}; ++i) {};\n", array.size, copy);
    const auto argument = [&](const std::string& from) {
      return step == 1 ? from
                       : fmt::format("reinterpret_cast<{}{}_at*>({})", output ? "" : "const ",
                                     number, from);
    };
    given += (given.empty() ? "" : ", ") + argument(name);
    own += (own.empty() ? "" : ", ") + argument(name + "_");
  };
  for (const KernelArray& array : shape.inputs) add(array, false);
  for (const KernelArray& array : shape.outputs) add(array, true);
  std::string text;
  if (step > 1) text += fmt::format("  if (states == {}) return {}({});\n", step, call, given);
  text += fmt::format("  for (; s + {0} <= states - states % 4; s += {0}) {{\n", step);
  return text + arrays + in + "    " + call + "(" + own + ");\n" + out + "  }\n";
}

// A kernel's function for many states: with `vectors`, as many at a time as the variant can.
std::string batch_source(const KernelShape& shape, bool vectors) {
  std::string text = fmt::format("void {}_batch(uint32_t states", shape.name);
  for (const KernelArray& array : shape.inputs) text += ", const double* " + array.name;
  for (const KernelArray& array : shape.outputs) text += ", double* " + array.name;
  text += ") {\n  uint32_t s = 0;\n";
  if (vectors)
    text += fmt::format("{}{}#endif\n{}{}#else\n", kIfEightLanes, states_source(shape, 8),
                        kIfFourLanes, fours_source(shape));
  text += states_source(shape, 1);
  return text + (vectors ? "#endif\n}\n\n" : "}\n\n");
}

// The entries of one variant and its table.
std::string variant_source(const Mechanism& m, const GeneratedKernels& result, const Emitted& all) {
  const auto& [sines, kernels, fours, eights, derivatives] = all;
  std::string text{kBanner};
  text += "#include \"parts.h\"\n\nnamespace TANDEM_VARIANT {\nnamespace {\n\n";
  text += kTrigSource;
  text += "\n" + sines.source();
  for (const auto* some : {&kernels, &fours, &eights, &derivatives})
    for (const EmittedKernel& kernel : *some) text += all.guarded(*some, kernel.entry + "\n");
  for (const Kernel kernel : kBatches)
    text += batch_source(kernel_shape(kernel, m), !fours.empty());
  text += name_table("joints", m.joint_names) + name_table("sites", m.site_names) +
          name_table("wrenches", m.wrench_names) + name_table("sensors", m.sensor_names) +
          count_table(result.counts) + "\n}  // namespace\n\n";
  text += "extern const tandem_kernels table = {\n";
  text += fmt::format("    TANDEM_KERNELS_ABI, {}, {},\n    \"{}\",\n    TANDEM_VARIANT_NAME,\n",
                      m.floating_base ? 1 : 0, quoted_text(result.robot), result.hash);
  text += fmt::format("    {}, {}, {}, {}, {}, {},\n", m.kernel_nq(), m.kernel_nv(), m.coordinates,
                      m.sites.size(), m.wrenches, m.sensors.size());
  text += "    joints, sites, wrenches, sensors,\n";
  text += fmt::format("    {:.17g}, {{{:.17g}, {:.17g}, {:.17g}}},\n    counts, {},\n", m.mass_kg,
                      m.gravity[0], m.gravity[1], m.gravity[2], result.counts.size());
  for (const EmittedKernel& kernel : kernels) text += "    " + kernel.name + ",\n";
  for (const Kernel kernel : kBatches) text += "    " + kernel_shape(kernel, m).name + "_batch,\n";
  text += "    sine_count, sines,\n";
  for (const EmittedKernel& kernel : kernels) text += "    " + kernel.name + "_at,\n";
  for (const EmittedKernel& kernel : derivatives) text += "    " + kernel.name + ",\n";
  return text + "};\n\n}  // namespace TANDEM_VARIANT\n";
}

std::string parts_header(const Emitted& all) {
  std::string text{kBanner};
  text += "#pragma once\n#include \"kernels.h\"\n\nnamespace TANDEM_VARIANT {\n";
  text += kVectors;
  for (const auto* some : {&all.kernels, &all.fours, &all.eights, &all.derivatives})
    for (const EmittedKernel& kernel : *some)
      for (const std::string& declaration : kernel.declarations)
        text += all.guarded(*some, declaration);
  return text + "}  // namespace TANDEM_VARIANT\n";
}

// The parts, gathered into files of about the same length. Straight-line code that has outgrown the
// caches gains nothing from -O2; the derivatives' parts have loops, which do.
void add_part_files(const Emitted& all, GeneratedKernels& result) {
  const bool light = all.fours.empty() && all.derivatives.empty();
  std::string body;
  std::uint32_t operations = 0;
  int number = 0;
  const auto close = [&] {
    if (body.empty()) return;
    result.sources.push_back({fmt::format("part_{:02}.cpp", number++),
                              std::string(kBanner) +
                                  "#include \"parts.h\"\n\nnamespace TANDEM_VARIANT {\n\n" + body +
                                  "}  // namespace TANDEM_VARIANT\n",
                              true, light});
    body.clear();
    operations = 0;
  };
  for (const auto* some : {&all.kernels, &all.fours, &all.eights, &all.derivatives})
    for (const EmittedKernel& kernel : *some)
      for (std::size_t part = 0; part < kernel.parts.size(); ++part) {
        if (operations + kernel.sizes[part] > kFileOperations) close();
        body += all.guarded(*some, kernel.parts[part] + "\n");
        operations += kernel.sizes[part];
      }
  close();
}

// A constant that is not finite cannot be written as C++. It stands for a division by nothing.
Status check_finite(const Graph& graph, const TracedKernel& kernel) {
  const std::vector<bool> live = live_nodes(graph, kernel.outputs);
  bool finite = true;
  for (std::size_t i = 0; i < live.size(); ++i)
    if (live[i] && graph.nodes()[i].op == Op::kConstant)
      finite = finite && std::isfinite(graph.nodes()[i].value);
  for (const Expr& output : kernel.outputs)
    if (output.is_constant()) finite = finite && std::isfinite(output.value());
  if (finite) return {};
  return fail("the kernel " + kernel.shape.name + " holds a constant that is not finite",
              "look for a joint that moves no mass or inertia, or for numbers out of all scale");
}

OperationCount times(OperationCount count, std::uint32_t n) {
  return {count.add * n,  count.mul * n,    count.div * n,
          count.sqrt * n, count.sincos * n, count.pairs * n};
}

EmittedKernel emit(const Graph& graph, const TracedKernel& kernel, const Mechanism& m,
                   SineTable& sines) {
  return emit_kernel(graph, kernel, m, sines, kPartOperations);
}

// The mass matrix column by column.
EmittedKernel mass_matrix_by_columns(const Mechanism& m, SineTable& sines) {
  Graph graph;
  EmittedKernel kernel = emit(graph, trace_mass_times(m, graph), m, sines);
  const int nv = kernel_shape(Kernel::kBias, m).outputs[0].size;
  kernel.name = kernel_shape(Kernel::kMassMatrix, m).name;
  kernel.count = times(kernel.count, static_cast<std::uint32_t>(nv));
  kernel.entry += fmt::format(R"(
void {0}_at(const double* s, const double* q, double* M) {{
  double unit[{1}] = {{}};
  double column[{1}];
  for (int j = 0; j < {1}; ++j) {{
    unit[j] = 1.0;
    mass_times_at(s, q, unit, column);
    unit[j] = 0.0;
    for (int i = j; i < {1}; ++i) M[i * {1} + j] = M[j * {1} + i] = column[i];
  }}
}}
void {0}(const double* q, double* M) {{
  alignas(32) double s[sine_count];
  sines(q, s);
  {0}_at(s, q, M);
}}
)",
                              kernel.name, nv);
  return kernel;
}

// Those of inverse dynamics are expressions; those of forward dynamics solve with their mass
// matrix.
Status add_derivatives(const Mechanism& m, Emitted& all) {
  Graph graph;
  const TracedKernel inverse = trace_kernel(Kernel::kInverseDynamicsDerivatives, m, graph);
  if (Status status = check_finite(graph, inverse); !status) return status;
  all.derivatives.push_back(emit(graph, inverse, m, all.sines));
  Graph factor_graph;
  const TracedKernel factor = trace_mass_factor(inverse, m, factor_graph);
  EmittedKernel forward = emit_forward_derivatives(
      inverse, m, emit(factor_graph, factor, m, all.sines), kPartOperations);
  forward.count = forward.count + all.kernels.front().count + all.derivatives.front().count;
  all.derivatives.push_back(std::move(forward));
  return {};
}

constexpr std::string_view kLibrarySource = R"(#include "kernels.h"

namespace baseline { extern const tandem_kernels table; }
#ifdef TANDEM_X86_64
namespace x86_64_v3 { extern const tandem_kernels table; }
namespace x86_64_v4 { extern const tandem_kernels table; }
#endif

static bool same(const char* a, const char* b) {
  while (*a != '\0' && *a == *b) ++a, ++b;
  return *a == *b;
}

extern "C" __attribute__((visibility("default"))) const tandem_kernels* tandem_kernels_get(
    const char* variant) {
#ifdef TANDEM_X86_64
  __builtin_cpu_init();
  const bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                  __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
  const bool v4 = v3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                  __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                  __builtin_cpu_supports("avx512vl");
  if (v4 && (variant == nullptr || same(variant, "x86-64-v4"))) return &x86_64_v4::table;
  if (v3 && (variant == nullptr || same(variant, "x86-64-v3"))) return &x86_64_v3::table;
#endif
  if (variant == nullptr || same(variant, "baseline")) return &baseline::table;
  return nullptr;
}
)";

}  // namespace

Result<GeneratedKernels> generate_kernels(const Tree& tree, const ModelSpec& spec) {
  const Result<Mechanism> mechanism = make_mechanism(tree, spec);
  if (!mechanism) return std::unexpected(mechanism.error());
  GeneratedKernels result;
  result.robot = spec.robot;
  result.hash = description_hash(tree, spec);
  Emitted all;
  auto& [sines, kernels, fours, eights, derivatives] = all;
  for (int k = 0; k < kKernels; ++k) {
    Graph graph;
    const TracedKernel kernel = trace_kernel(static_cast<Kernel>(k), *mechanism, graph);
    if (Status status = check_finite(graph, kernel); !status)
      return std::unexpected(status.error());
    kernels.push_back(emit(graph, kernel, *mechanism, sines));
    if (static_cast<Kernel>(k) == Kernel::kMassMatrix &&
        kernels.back().count.add + kernels.back().count.mul > kMostMassMatrixOperations)
      kernels.back() = mass_matrix_by_columns(*mechanism, sines);
    result.counts.push_back({kernels.back().name, kernels.back().count});
    if (std::ranges::find(kBatches, static_cast<Kernel>(k)) != std::end(kBatches) &&
        kernels.front().count.add + kernels.front().count.mul <= kMostBatchOperations)
      for (auto [states, batches] : {std::pair(4, &fours), std::pair(8, &eights)})
        batches->push_back(emit_batch(graph, kernel, states, kPartOperations));
  }
  if (spec.derivatives) {
    if (Status status = add_derivatives(*mechanism, all); !status)
      return std::unexpected(status.error());
    for (const EmittedKernel& kernel : derivatives)
      result.counts.push_back({kernel.name, kernel.count});
  }
  result.headers.push_back({"kernels.h", std::string(kKernelsHeader), false});
  result.headers.push_back({"parts.h", parts_header(all), false});
  add_part_files(all, result);
  result.sources.push_back({"variant.cpp", variant_source(*mechanism, result, all), true});
  result.sources.push_back(
      {"library.cpp", std::string(kBanner) + std::string(kLibrarySource), false});
  return result;
}

Result<OperationCount> count_kernel(Kernel kernel, const Tree& tree, const ModelSpec& spec) {
  const Result<Mechanism> mechanism = make_mechanism(tree, spec);
  if (!mechanism) return std::unexpected(mechanism.error());
  Graph graph;
  SineTable sines;
  return emit(graph, trace_kernel(kernel, *mechanism, graph), *mechanism, sines).count;
}

}  // namespace tandem::model
