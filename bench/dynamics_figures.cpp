// The tables of docs/dynamics.md: operations and times of the bundled robots' kernels, and cost
// against the number of joints for chains and binary trees, compilation included.
// Times mean something on an idle machine only: medians of nine batches, of random states.
#include <fmt/core.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <set>

#include "hal/sim/setup.hpp"
#include "model/generate.hpp"
#include "model/kernel_build.hpp"
#include "model/kernel_check.hpp"
#include "model/kernel_library.hpp"
#include "model/urdf.hpp"
#include "runtime/experiment.hpp"

namespace tandem::bench {
namespace {

namespace fs = std::filesystem;
using model::Kernel;

struct Robot {
  std::string name;
  model::Tree tree;
  model::ModelSpec spec;
};

/// Median time of a call [us].
double median_us(const std::function<void(std::size_t state)>& call) {
  constexpr std::size_t kCalls = 2000;
  std::vector<double> batches;
  for (int batch = 0; batch < 9; ++batch) {
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < kCalls; ++i) call(i);
    const std::chrono::duration<double, std::micro> spent =
        std::chrono::steady_clock::now() - start;
    batches.push_back(spent.count() / kCalls);
  }
  std::ranges::nth_element(batches, batches.begin() + 4);
  return batches[4];
}

/// " 1234 (800) | 0.56 |": operations, those left as instructions on vectors serve two, and time of
/// forward dynamics, inverse dynamics and mass matrix.
std::string cells(const tandem_kernels& k, const model::Mechanism& m) {
  std::vector<model::SeededState> states;
  for (unsigned seed = 1; seed <= 16; ++seed) states.emplace_back(m, seed);
  std::vector<double> out(static_cast<std::size_t>(k.nv) * k.nv);
  const auto at = [&](std::size_t i) -> const model::SeededState& { return states[i % 16]; };
  const auto time = [&](Kernel kernel) {
    return median_us([&](std::size_t i) {
      const model::SeededState& s = at(i);
      if (kernel == Kernel::kForwardDynamics)
        k.forward_dynamics(s.q.data(), s.v.data(), s.tau.data(), s.wrench.data(), out.data());
      if (kernel == Kernel::kInverseDynamics)
        k.inverse_dynamics(s.q.data(), s.v.data(), s.vdot.data(), s.wrench.data(), out.data());
      if (kernel == Kernel::kMassMatrix) k.mass_matrix(s.q.data(), out.data());
    });
  };
  std::string text;
  for (const Kernel kernel :
       {Kernel::kForwardDynamics, Kernel::kInverseDynamics, Kernel::kMassMatrix}) {
    const tandem_kernel_count& count = k.counts[static_cast<int>(kernel)];
    const std::uint32_t operations = count.add + count.mul;
    const std::string left = count.pairs == 0 ? "" : fmt::format(" ({})", operations - count.pairs);
    text += fmt::format(" {}{} | {:.2f} |", operations, left, time(kernel));
  }
  return text;
}

/// One row, its library built first; `cost` adds what compiling took.
Status print_row(const Robot& robot, const fs::path& folder, bool cost) {
  rusage before{};
  getrusage(RUSAGE_CHILDREN, &before);
  const std::string library = (folder / (robot.name + ".so")).string();
  const auto built = model::build_kernels(
      robot.tree, robot.spec,
      {.library = library, .compiler = {}, .jobs = 0, .progress = {}, .waiting = {}});
  if (!built) return std::unexpected(built.error());
  rusage after{};
  getrusage(RUSAGE_CHILDREN, &after);
  const auto kernels = model::load_kernels(library);
  if (!kernels) return std::unexpected(kernels.error());
  const auto m = model::make_mechanism(robot.tree, robot.spec);
  if (!m) return std::unexpected(m.error());
  fmt::print("| {} | {}{} |{}", robot.name, robot.tree.joints.size(),
             robot.tree.floating_base ? " + base" : "", cells(**kernels, *m));
  if (cost) {
    fmt::print(" {} | {} | {} |", after.ru_utime.tv_sec - before.ru_utime.tv_sec,
               after.ru_maxrss / 1024, fs::file_size(library) / 1024);
  }
  fmt::print("\n");
  std::fflush(stdout);
  return {};
}

/// Operations of the derivatives of inverse dynamics; their time, and that of those of forward
/// dynamics, in multiples of forward dynamics': medians of batches side by side.
Status print_derivatives(Robot robot, const fs::path& folder) {
  robot.spec.derivatives = true;
  const std::string library = (folder / (robot.name + "_derivatives.so")).string();
  const auto built = model::build_kernels(
      robot.tree, robot.spec,
      {.library = library, .compiler = {}, .jobs = 0, .progress = {}, .waiting = {}});
  if (!built) return std::unexpected(built.error());
  const auto kernels = model::load_kernels(library);
  if (!kernels) return std::unexpected(kernels.error());
  const auto m = model::make_mechanism(robot.tree, robot.spec);
  if (!m) return std::unexpected(m.error());
  const tandem_kernels& k = **kernels;
  const model::SeededState s(*m, 1);
  const std::size_t size = std::size_t{k.nv} * k.nv;
  std::vector<double> a(size), b(size), c(size);
  const auto batch_ns = [](const auto& call) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < 32; ++i) call();
    return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start)
        .count();
  };
  std::vector<double> inverse, forward;
  for (int batch = 0; batch < 401; ++batch) {
    const double dynamics = batch_ns([&] {
      k.forward_dynamics(s.q.data(), s.v.data(), s.tau.data(), s.wrench.data(), a.data());
    });
    inverse.push_back(batch_ns([&] {
                        k.inverse_dynamics_derivatives(s.q.data(), s.v.data(), s.vdot.data(),
                                                       s.wrench.data(), a.data(), b.data(),
                                                       c.data());
                      }) /
                      dynamics);
    forward.push_back(batch_ns([&] {
                        k.forward_dynamics_derivatives(s.q.data(), s.v.data(), s.tau.data(),
                                                       s.wrench.data(), a.data(), b.data(),
                                                       c.data());
                      }) /
                      dynamics);
  }
  for (auto* ratios : {&inverse, &forward})
    std::ranges::nth_element(*ratios, ratios->begin() + 200);
  const tandem_kernel_count& count = k.counts[model::kKernels];
  fmt::print("| {} | {} ({}) | {:.1f} | {:.1f} |\n", robot.name, count.add + count.mul,
             count.add + count.mul - count.pairs, inverse[200], forward[200]);
  std::fflush(stdout);
  return {};
}

/// Equal links of 1 kg whose axes are x, y, z in turn; each link carries `branches` more.
Robot regular(const std::string& kind, int joints, int branches) {
  std::string urdf = "<robot name=\"regular\"><link name=\"link0\"/>";
  for (int i = 1; i <= joints; ++i) {
    urdf += fmt::format(
        "<link name=\"link{0}\"><inertial><origin xyz=\"0.05 0 0.1\"/><mass value=\"1\"/>"
        "<inertia ixx=\"0.02\" ixy=\"0\" ixz=\"0\" iyy=\"0.02\" iyz=\"0\" izz=\"0.01\"/>"
        "</inertial></link><joint name=\"joint{0:03}\" type=\"continuous\"><parent "
        "link=\"link{1}\"/><child link=\"link{0}\"/><origin xyz=\"0.1 0.05 0.2\"/>"
        "<axis xyz=\"{2} {3} {4}\"/></joint>",
        i, (i - 1) / branches, i % 3 == 1 ? 1 : 0, i % 3 == 2 ? 1 : 0, i % 3 == 0 ? 1 : 0);
  }
  auto read = model::parse_urdf(urdf + "</robot>", "regular.urdf", {});
  model::ModelSpec spec;
  spec.robot = fmt::format("{}_{}", kind, joints);
  return {spec.robot, std::move(read->tree), spec};
}

/// The bundled robots. What several folders wire in other ways is one robot: the first one's.
std::expected<std::vector<Robot>, Diagnostics> bundled() {
  std::set<fs::path> files;
  for (const auto& entry : fs::directory_iterator(TANDEM_CONFIG_FOLDER))
    if (fs::exists(entry.path() / "robot.toml")) files.insert(entry.path() / "robot.toml");
  std::vector<Robot> robots;
  std::set<std::string> known;
  for (const fs::path& file : files) {
    auto read = robot::read_complete_robot(file.string());
    if (!read) return std::unexpected(read.error());
    Robot robot{read->config.name, std::move(read->description.tree),
                sim::model_spec(read->config)};
    if (known.insert(model::description_hash(robot.tree, robot.spec)).second)
      robots.push_back(std::move(robot));
  }
  return robots;
}

int fail_with(const Error& error) {
  fmt::print(stderr, "{}\n", error.to_string());
  return 1;
}

int run(const fs::path& folder) {
  fs::create_directories(folder);
  ::setenv("CCACHE_DISABLE", "1", 1);  // what compiling costs without a cache
  const auto robots = bundled();
  if (!robots) return fail_with(robots.error().front());
  fmt::print(
      "| robot | joints | FD operations | [us] | ID operations | [us] | M operations | [us] |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Robot& robot : *robots)
    if (const Status row = print_row(robot, folder, false); !row) return fail_with(row.error());
  fmt::print(
      "\n| robot | operations of ID's derivatives | time / FD | of FD's derivatives, time / FD |\n"
      "| --- | --- | --- | --- |\n");
  for (const Robot& robot : *robots)
    if (const Status row = print_derivatives(robot, folder); !row) return fail_with(row.error());
  fmt::print(
      "\n| kind | joints | FD operations | [us] | ID operations | [us] | M operations | [us] "
      "| compiling, CPU [s] | memory [MB] | library [KB] |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const auto& [kind, branches] : {std::pair("chain", 1), {"tree", 2}})
    for (const int joints : {10, 20, 50, 100, 200})
      if (const Status row = print_row(regular(kind, joints, branches), folder, true); !row)
        return fail_with(row.error());
  return 0;
}

}  // namespace
}  // namespace tandem::bench

int main(int argc, char** argv) {
  std::string folder = std::filesystem::temp_directory_path() / "tandem_dynamics_figures";
  CLI::App app{
      "The tables of docs/dynamics.md: operations and times of the bundled robots, and "
      "what chains and trees cost"};
  app.add_option("folder", folder, "where libraries are built")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return tandem::bench::run(folder);
}
