#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>

#include "base/quoting.hpp"
#include "model/emit.hpp"
#include "model/file_lock.hpp"
#include "model/kernel_build.hpp"
#include "model/kernel_check.hpp"
#include "model/kernel_library.hpp"
#include "model/sines.hpp"
#include "tests/model/random_robot.hpp"
#include "tests/model/reference.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::model {
namespace {

std::string built_library(const std::string& robot) {
  return library_path(TANDEM_TEST_KERNELS, robot);
}

Runner runner(const tandem_kernels& k, const Mechanism& m) {
  return [&k, &m](Kernel kernel, const Arrays& in) { return call_kernel(k, kernel, m, in); };
}

struct Compiled {
  const char* robot;
  const char* variant;
};
void PrintTo(const Compiled& c, std::ostream* out) { *out << c.robot << " " << c.variant; }

class CompiledKernels : public testing::TestWithParam<Compiled> {
 protected:
  void SetUp() override {
    const auto [name, variant] = GetParam();
    const ReferenceRobot& robot = reference_robot(name);
    mechanism = reference_mechanism(robot);
    const std::string hash = description_hash(reference_tree(robot), reference_spec(robot));
    const auto loaded = load_kernels(built_library(name), hash);
    ASSERT_TRUE(loaded) << loaded.error().to_string();
    const auto chosen = load_kernels(built_library(name), hash, variant);
    if (!chosen) GTEST_SKIP() << chosen.error().to_string();
    library = *chosen;
  }
  Mechanism mechanism;
  KernelLibrary library;
};

TEST_P(CompiledKernels, AgreeWithPinocchioInEveryQuantity) {
  against_reference(reference_robot(GetParam().robot), mechanism, runner(*library, mechanism),
                    [&](const char* quantity, const Array& actual, const Array& expected) {
                      EXPECT_LE(relative_error(actual, expected), 1e-10) << quantity;
                    });
}

TEST_P(CompiledKernels, ComputeWhatTheAlgorithmsComputeOnDoubles) {
  const Runner compiled = runner(*library, mechanism);
  const nlohmann::json reference = read_reference(GetParam().robot);
  for (const nlohmann::json& state : reference["states"]) {
    Array wrench(static_cast<std::size_t>(6 * mechanism.wrenches));
    for (std::size_t i = 0; i < wrench.size(); ++i) wrench[i] = 3.0 - static_cast<double>(i);
    const Array q = flat(state["q"]);
    const Array v = flat(state["v"]);
    const Array a = flat(state["a"]);
    const Arrays all[] = {{q, v, flat(state["tau"]), wrench},
                          {q, v, a, wrench},
                          {q},
                          {q, v},
                          {q, v},
                          {q, v},
                          {q, v},
                          {q, v, a},
                          {q, v},
                          {q},
                          {q, v, a, wrench},
                          {q, v, wrench},
                          {q, v, a, wrench},
                          {q, v, flat(state["tau"]), wrench}};
    for (int k = 0; k < static_cast<int>(library->kernel_count); ++k) {
      const Kernel kernel = static_cast<Kernel>(k);
      const Arrays expected = evaluate_kernel(kernel, mechanism, all[k]);
      const Arrays actual = compiled(kernel, all[k]);
      for (std::size_t i = 0; i < expected.size(); ++i)
        EXPECT_LE(
            relative_error(actual[i], expected[i]),
            kernel == Kernel::kForwardDynamics || kernel == Kernel::kForwardDynamicsDerivatives
                ? 1e-10
                : 1e-13)
            << kernel_shape(kernel, mechanism).name;
    }
  }
}

// One after the other with the same sines.
TEST_P(CompiledKernels, ComputeTheSameWithSinesAtHand) {
  const tandem_kernels& k = *library;
  const SeededState state(mechanism, 5);
  const double *q = state.q.data(), *v = state.v.data(), *vdot = state.vdot.data(),
               *tau = state.tau.data(), *wrench = state.wrench.data();
  Sines sines(k);
  sines.take(q);
  const double* s = sines.data();
  for (int number = 0; number < kKernels; ++number) {
    const auto kernel = static_cast<Kernel>(number);
    const Arrays expected = call_kernel(k, kernel, mechanism, state.of(kernel));
    Arrays out;
    for (const Array& array : expected) out.emplace_back(array.size());
    const auto o = [&](std::size_t i) { return out[i].data(); };
    switch (kernel) {
      case Kernel::kForwardDynamics: k.forward_dynamics_at(s, q, v, tau, wrench, o(0)); break;
      case Kernel::kInverseDynamics: k.inverse_dynamics_at(s, q, v, vdot, wrench, o(0)); break;
      case Kernel::kMassMatrix: k.mass_matrix_at(s, q, o(0)); break;
      case Kernel::kBias: k.bias_at(s, q, v, o(0)); break;
      case Kernel::kCenterOfMass: k.center_of_mass_at(s, q, v, o(0), o(1), o(2)); break;
      case Kernel::kCentroidalMomentum: k.centroidal_momentum_at(s, q, v, o(0)); break;
      case Kernel::kEnergy: k.energy_at(s, q, v, o(0)); break;
      case Kernel::kSiteMotion: k.site_motion_at(s, q, v, vdot, o(0), o(1), o(2)); break;
      case Kernel::kSiteTwists: k.site_twists_at(s, q, v, o(0), o(1)); break;
      case Kernel::kSiteJacobians: k.site_jacobians_at(s, q, o(0)); break;
      case Kernel::kSensorWrenches: k.sensor_wrenches_at(s, q, v, vdot, wrench, o(0)); break;
      case Kernel::kGeneralisedMomentum:
        k.generalised_momentum_at(s, q, v, wrench, o(0), o(1));
        break;
      case Kernel::kInverseDynamicsDerivatives:
      case Kernel::kForwardDynamicsDerivatives: break;
    }
    EXPECT_EQ(out, expected) << kernel_shape(kernel, mechanism).name;
  }
}

// However many states there are, and whatever the others are.
TEST_P(CompiledKernels, ComputeBatchesAsTheyComputeOneState) {
  for (const Kernel kernel : {Kernel::kForwardDynamics, Kernel::kInverseDynamics}) {
    std::vector<Arrays> states;
    for (unsigned seed = 11; seed < 23; ++seed)
      states.push_back(SeededState(mechanism, seed).of(kernel));
    std::vector<Arrays> four;
    for (std::size_t i = 0; i < states.size(); i += 4) {
      const auto some = call_batch(*library, kernel, mechanism, {&states[i], &states[i] + 4});
      four.insert(four.end(), some.begin(), some.end());
    }
    EXPECT_EQ(call_batch(*library, kernel, mechanism, states), four) << "twelve at once";
    // What exceeds a multiple of four is left out, by every variant: six are four.
    const auto six = call_batch(*library, kernel, mechanism, {states.begin(), states.begin() + 6});
    EXPECT_EQ((std::vector<Arrays>{six.begin(), six.begin() + 4}),
              (std::vector<Arrays>{four.begin(), four.begin() + 4}));
    for (const double value : six[5][0]) EXPECT_TRUE(std::isnan(value)) << "not written";
    EXPECT_EQ(call_batch(*library, kernel, mechanism, {states.begin(), states.begin() + 8}),
              (std::vector<Arrays>{four.begin(), four.begin() + 8}));
    for (std::size_t i = 0; i < states.size(); ++i) {
      const Array one = call_kernel(*library, kernel, mechanism, states[i])[0];
      EXPECT_LE(relative_error(four[i][0], one), 1e-11) << "state " << i;
    }
  }
}

TEST_P(CompiledKernels, SayWhatTheyAre) {
  EXPECT_EQ(library->abi, TANDEM_KERNELS_ABI);
  EXPECT_STREQ(library->robot, GetParam().robot);
  EXPECT_STREQ(library->variant, GetParam().variant);
  EXPECT_EQ(library->nq, static_cast<std::uint32_t>(mechanism.nq()));
  EXPECT_EQ(library->nv, static_cast<std::uint32_t>(mechanism.nv()));
  ASSERT_EQ(library->joints, mechanism.joint_names.size());
  for (std::size_t j = 0; j < mechanism.joint_names.size(); ++j)
    EXPECT_EQ(library->joint_names[j], mechanism.joint_names[j]);
  ASSERT_EQ(library->sites, mechanism.site_names.size());
  for (std::size_t s = 0; s < mechanism.site_names.size(); ++s)
    EXPECT_EQ(library->site_names[s], mechanism.site_names[s]);
  EXPECT_EQ(library->wrenches, mechanism.wrench_names.size());
  EXPECT_EQ(library->sensors, mechanism.sensor_names.size());
  EXPECT_EQ(library->mass_kg, mechanism.mass_kg);
  EXPECT_EQ(library->gravity_m_s2[2], -9.81);
  const bool derivatives = reference_spec(reference_robot(GetParam().robot)).derivatives;
  const int kernels = derivatives ? kAllKernels : kKernels;
  EXPECT_EQ(library->inverse_dynamics_derivatives != nullptr, derivatives);
  EXPECT_EQ(library->forward_dynamics_derivatives != nullptr, derivatives);
  ASSERT_EQ(library->kernel_count, static_cast<std::uint32_t>(kernels));
  for (int k = 0; k < kernels; ++k)
    EXPECT_EQ(library->counts[k].kernel, kernel_shape(static_cast<Kernel>(k), mechanism).name);
}

INSTANTIATE_TEST_SUITE_P(
    Robots, CompiledKernels,
    testing::Values(Compiled{"double_pendulum", "baseline"},
                    Compiled{"double_pendulum", "x86-64-v3"},
                    Compiled{"double_pendulum", "x86-64-v4"}, Compiled{"ur5e", "baseline"},
                    Compiled{"ur5e", "x86-64-v3"}, Compiled{"ur5e", "x86-64-v4"},
                    Compiled{"coman", "baseline"}, Compiled{"coman", "x86-64-v3"},
                    Compiled{"coman", "x86-64-v4"}),
    [](const auto& test) {
      std::string name = std::string(test.param.robot) + "_" + test.param.variant;
      for (char& c : name) c = c == '-' ? '_' : c;
      return name;
    });

TEST(Kernels, SinesAndCosinesAreThoseOfLibmWithinTwoUlp) {
  // The double pendulum's first site rotates with q0 + q1 about one axis: entries are sin, cos.
  const auto library = load_kernels(built_library("double_pendulum"));
  ASSERT_TRUE(library);
  const Array v(2, 0.0);
  Array pose(12 * (*library)->sites);
  Array twist(6 * (*library)->sites);
  Array acceleration(6 * (*library)->sites);
  double worst = 0.0;
  for (int i = -40000; i <= 41000; ++i) {
    // The largest are beyond the polynomials: libm's.
    const double angle = i < 20000 ? i * 1e-3 : i <= 40000 ? i * 2.5 : i * 1e4;
    const Array q{angle, 0.0};
    (*library)->site_motion(q.data(), v.data(), v.data(), pose.data(), twist.data(),
                            acceleration.data());
    worst = std::max(worst, std::abs(pose[4] - std::cos(angle)));
    worst = std::max(worst, std::abs(pose[7] - std::sin(angle)));
  }
  EXPECT_LE(worst, 2.3e-16);
}

#ifdef __x86_64__
TEST(Kernels, SinesAndCosinesAreComputedWithVectors) {
  const test::ScratchFolder folder;
  const std::string file = folder / "code.txt";
  ASSERT_EQ(std::system(("objdump -d --no-show-raw-insn " + shell_word(built_library("coman")) +
                         " > " + shell_word(file))
                            .c_str()),
            0);
  std::ifstream code(file);
  std::map<std::string, int> packed;  // instructions on two doubles and more, by function
  std::string function;
  for (std::string line; std::getline(code, line);) {
    if (line.ends_with(">:")) {
      function = line.find("sines_and_cosines") == std::string::npos ? "" : line;
      if (!function.empty()) packed[function] = 0;
    } else if (!function.empty() && line.find("pd ") != std::string::npos) {
      ++packed[function];
    }
  }
  // One of each variant for single calls; for batches four at a time, of the widest also eight.
  EXPECT_EQ(packed.size(), 6u);
  for (const auto& [name, count] : packed) EXPECT_GE(count, 25) << name;
}
#endif

TEST(Kernels, AStateThatIsNotFiniteGivesResultsThatAreNotFinite) {
  const auto library = load_kernels(built_library("ur5e"));
  ASSERT_TRUE(library);
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const Array q{0.1, bad, 0.3, 0.4, 0.5, 0.6};
    const Array v(6, 0.1);
    const Array wrench(6 * (*library)->wrenches, 0.0);
    Array vdot(6, 0.0);
    (*library)->forward_dynamics(q.data(), v.data(), v.data(), wrench.data(), vdot.data());
    EXPECT_FALSE(std::isfinite(vdot[1]));
  }
}

TEST(Generator, WritesTheSameTextTwice) {
  const ReferenceRobot& robot = reference_robot("coman");
  const auto first = generate_kernels(reference_tree(robot), reference_spec(robot));
  const auto second = generate_kernels(reference_tree(robot), reference_spec(robot));
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->hash, second->hash);
  ASSERT_EQ(first->sources.size(), second->sources.size());
  for (std::size_t i = 0; i < first->sources.size(); ++i)
    EXPECT_TRUE(first->sources[i].text == second->sources[i].text) << first->sources[i].name;
}

// What is compiled with few optimisations is straight-line code of robots with many joints alone.
TEST(Generator, MarksPartsOfLargeRobotsAsLight) {
  const auto light = [](const Tree& tree, const ModelSpec& spec) {
    std::vector<std::string> names;
    const auto generated = generate_kernels(tree, spec);
    for (const SourceFile& source : generated->sources)
      if (source.light) names.push_back(source.name);
    return names;
  };
  const ReferenceRobot& coman = reference_robot("coman");
  EXPECT_TRUE(light(reference_tree(coman), reference_spec(coman)).empty());
  const RandomRobot robot(3, {.joints = 100, .branching = 1.0});
  const Tree tree = parse_urdf(robot.urdf(), "large.urdf", {})->tree;
  const std::vector<std::string> names = light(tree, {});
  EXPECT_GT(names.size(), 10u);
  for (const std::string& name : names) EXPECT_TRUE(name.starts_with("part_")) << name;
  ModelSpec spec;
  spec.derivatives = true;  // their parts have loops
  EXPECT_TRUE(light(tree, spec).empty());
}

TEST(Generator, StaysBelowTheOperationGoals) {
  for (const auto& [name, goal] : {std::pair("coman", 10000u), {"walkman", 11500u}}) {
    const Mechanism m = reference_mechanism(reference_robot(name));
    Graph graph;
    const TracedKernel kernel = trace_kernel(Kernel::kForwardDynamics, m, graph);
    const OperationCount count = count_operations(graph, kernel.outputs);
    EXPECT_LT(count.add + count.mul, goal) << name;
    EXPECT_EQ(count.sincos, static_cast<std::uint32_t>(m.joint_count())) << name;
  }
}

TEST(Generator, HashFollowsWhatMattersAndNothingElse) {
  const ReferenceRobot& robot = reference_robot("ur5e");
  Tree tree = reference_tree(robot);
  ModelSpec spec = reference_spec(robot);
  const std::string hash = description_hash(tree, spec);
  EXPECT_EQ(hash.size(), 64u);
  tree.file = "elsewhere.urdf";
  EXPECT_EQ(description_hash(tree, spec), hash);
  tree.links.back().inertia.mass_kg += 1e-12;
  EXPECT_NE(description_hash(tree, spec), hash);
  tree = reference_tree(robot);
  spec.armature.emplace_back("elbow_joint", 0.1);
  EXPECT_NE(description_hash(tree, spec), hash);
  spec = reference_spec(robot);
  spec.derivatives = !spec.derivatives;
  EXPECT_NE(description_hash(tree, spec), hash);
}

TEST(KernelLibrary, SaysWhatIsWrongWithAFileAndWhatToDo) {
  auto library = load_kernels("/nonexistent/kernels.so");
  ASSERT_FALSE(library);
  EXPECT_NE(library.error().to_string().find("tandem model build"), std::string::npos);
  const test::ScratchFolder folder;
  const std::string text = folder / "text.so";
  std::ofstream(text) << "no library";
  library = load_kernels(text);
  ASSERT_FALSE(library);
  EXPECT_NE(library.error().message.find("was not made by tandem"), std::string::npos);
  library = load_kernels(built_library("ur5e"), std::string(64, '0'));
  ASSERT_FALSE(library);
  EXPECT_NE(library.error().message.find("another description"), std::string::npos);
  library = load_kernels(built_library("ur5e"), {}, "x86-64-v9");
  ASSERT_FALSE(library);
  EXPECT_NE(library.error().hint.find("baseline"), std::string::npos);
}

// Libraries with a damaged byte or a missing end had ended the process by a signal: 21 of 60.
TEST(KernelLibrary, OpensNoDamagedOne) {
  std::ifstream in(built_library("double_pendulum"), std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(in), {}};
  const test::ScratchFolder folder;
  const std::string path = folder / "damaged.so";
  for (std::size_t i = 0; i < 60; ++i) {
    std::string damaged = whole;
    const std::size_t at = i < 30 ? 2 * i : whole.size() * (i - 30) / 30;
    if (i % 2 == 0) {
      damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    } else {
      damaged.resize(at);
    }
    std::ofstream(path, std::ios::binary) << damaged;
    const auto library = load_kernels(path);
    ASSERT_FALSE(library) << i;
    EXPECT_NE(library.error().hint.find("tandem model build"), std::string::npos);
  }
  std::ofstream(path, std::ios::binary) << whole;
  EXPECT_TRUE(load_kernels(path));
}

TEST(KernelLibrary, OpensNoneThatOthersMayChange) {
  const test::ScratchFolder folder;
  const std::string path = folder / "shared.so";
  std::filesystem::copy_file(built_library("double_pendulum"), path);
  std::filesystem::permissions(path, std::filesystem::perms::all);
  const auto library = load_kernels(path);
  ASSERT_FALSE(library);
  EXPECT_EQ(library.error().message, "may be changed by everybody");
}

struct BuildFolder : test::ScratchFolder {
  [[nodiscard]] BuildOptions options() const {
    return {.library = *this / "k.so", .compiler = {}, .jobs = 1, .progress = {}, .waiting = {}};
  }
};

TEST(KernelBuild, DoesNothingWhenUpToDateAndOnlyWhatChangedElse) {
  const BuildFolder folder;
  const ReferenceRobot& robot = reference_robot("double_pendulum");
  const Tree tree = reference_tree(robot);
  ModelSpec spec = reference_spec(robot);
  BuildOptions options = folder.options();
  int calls = 0;
  int last_total = 0;
  options.progress = [&](int done, int total, const std::string&) {
    EXPECT_EQ(done, ++calls);
    last_total = total;
  };
  const auto first = build_kernels(tree, spec, options);
  ASSERT_TRUE(first) << first.error().to_string();
  EXPECT_FALSE(first->was_up_to_date);
  EXPECT_EQ(calls, last_total);
  EXPECT_TRUE(load_kernels(options.library, first->hash));
  options.progress = {};
  EXPECT_TRUE(build_kernels(tree, spec, options)->was_up_to_date);
  spec.armature.emplace_back(tree.joints[0].name, 0.25);
  const auto second = build_kernels(tree, spec, options);
  ASSERT_TRUE(second);
  EXPECT_GT(second->compiled, 0);
  EXPECT_LT(second->compiled, first->compiled);  // library.cpp is the same
  EXPECT_TRUE(load_kernels(options.library, second->hash));
  EXPECT_FALSE(load_kernels(options.library, first->hash));
}

TEST(KernelBuild, WaitsForAnotherBuilderOfTheSameLibrary) {
  const BuildFolder folder;
  const ReferenceRobot& robot = reference_robot("double_pendulum");
  BuildOptions options = folder.options();
  const Tree tree = reference_tree(robot);
  ASSERT_TRUE(build_kernels(tree, reference_spec(robot), options));
  std::optional<FileLock> other(std::move(*FileLock::take(options.library + ".build/lock", {})));
  int waited = 0;
  options.waiting = [&] {
    ++waited;
    other.reset();
  };
  const auto report = build_kernels(tree, reference_spec(robot), options);
  ASSERT_TRUE(report) << report.error().to_string();
  EXPECT_TRUE(report->was_up_to_date);
  EXPECT_EQ(waited, 1);
}

// With a base that floats and derivatives, which build_kernels() checks like any other kernel.
TEST(KernelBuild, CompilesEveryFileAgainWhenForced) {
  const BuildFolder folder;
  const ReferenceRobot& robot = reference_robot("double_pendulum");
  Tree tree = reference_tree(robot);
  ModelSpec spec = reference_spec(robot);
  tree.floating_base = spec.floating_base = spec.derivatives = true;
  BuildOptions options = folder.options();
  const auto first = build_kernels(tree, spec, options);
  ASSERT_TRUE(first) << first.error().to_string();
  options.force = true;
  const auto second = build_kernels(tree, spec, options);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->compiled, first->compiled);
}

TEST(KernelBuild, NamesTheCompilerThatIsNotThereAndTheLogOfOneThatFails) {
  const BuildFolder folder;
  const ReferenceRobot& robot = reference_robot("double_pendulum");
  BuildOptions options = folder.options();
  options.compiler = "no-such-compiler";
  auto report = build_kernels(reference_tree(robot), reference_spec(robot), options);
  ASSERT_FALSE(report);
  EXPECT_NE(report.error().message.find("no-such-compiler"), std::string::npos);
  EXPECT_NE(report.error().hint.find("g++"), std::string::npos);
  options.compiler = "/bin/false";
  report = build_kernels(reference_tree(robot), reference_spec(robot), options);
  ASSERT_FALSE(report);
  EXPECT_TRUE(std::filesystem::exists(report.error().file));
  options.library = "/proc/nowhere/k.so";
  report = build_kernels(reference_tree(robot), reference_spec(robot), options);
  ASSERT_FALSE(report);
  EXPECT_NE(report.error().message.find("/proc/nowhere"), std::string::npos);
}

// A chain of 70 joints: its mass matrix is a loop over columns, which build_kernels() checks like
// any other kernel.
TEST(KernelBuild, WritesTheMassMatrixOfALongChainAsALoop) {
  const BuildFolder folder;
  const RandomRobot robot(3, {.joints = 70, .branching = 0.0});
  const auto read = parse_urdf(robot.urdf(), "chain.urdf", {});
  ASSERT_TRUE(read);
  ModelSpec spec;
  spec.robot = "chain";
  const auto generated = generate_kernels(read->tree, spec);
  ASSERT_TRUE(generated) << generated.error().to_string();
  std::size_t bytes = 0;
  for (const SourceFile& source : generated->sources) bytes += source.text.size();
  EXPECT_LT(bytes, 3'000'000u);
  const Mechanism m = *make_mechanism(read->tree, spec);
  Graph graph;
  const TracedKernel product = trace_mass_times(m, graph);
  const SeededState state(m, 9);
  const Array M = evaluate_kernel(Kernel::kMassMatrix, m, {state.q})[0];
  Array expected(state.vdot.size(), 0.0);
  for (std::size_t i = 0; i < expected.size(); ++i)
    for (std::size_t j = 0; j < expected.size(); ++j)
      expected[i] += M[i * expected.size() + j] * state.vdot[j];
  const std::vector<Array> inputs{state.q, state.vdot};
  EXPECT_LE(relative_error(evaluate(graph, product.outputs, inputs), expected), 1e-12);
}

// A compiler that takes 9.81 for 9.82: whatever breaks the code, the library is not written.
TEST(KernelBuild, WritesNoLibraryThatDisagreesWithTheDescription) {
  const BuildFolder folder;
  const ReferenceRobot& robot = reference_robot("double_pendulum");
  BuildOptions options = folder.options();
  ASSERT_TRUE(build_kernels(reference_tree(robot), reference_spec(robot), options));
  options.compiler = folder / "compiler";
  std::ofstream(options.compiler)
      << "#!/bin/sh\nsed -i 's/9[.]81/9.82/g' part_*.cpp\nexec c++ \"$@\"\n";
  std::filesystem::permissions(options.compiler, std::filesystem::perms::owner_all);
  ModelSpec spec = reference_spec(robot);
  spec.armature.emplace_back(reference_tree(robot).joints[0].name, 0.25);
  const auto report = build_kernels(reference_tree(robot), spec, options);
  ASSERT_FALSE(report);
  EXPECT_NE(report.error().message.find("is off by"), std::string::npos)
      << report.error().to_string();
  const auto old =
      load_kernels(options.library, description_hash(reference_tree(robot), reference_spec(robot)));
  EXPECT_TRUE(old) << "the library from before is no longer there";
}

}  // namespace
}  // namespace tandem::model
