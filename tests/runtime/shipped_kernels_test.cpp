// The kernel libraries that are shipped, as they are: every bundled robot, every kernel and
// variant, against the sums over its links, and over ten seconds of free motion.
#include <gtest/gtest.h>

#include <filesystem>

#include "hal/sim/setup.hpp"
#include "model/generate.hpp"
#include "model/kernel_build.hpp"
#include "model/kernel_check.hpp"
#include "model/kernel_library.hpp"
#include "model/symmetric_eigen.hpp"
#include "runtime/experiment.hpp"
#include "tests/model/reference.hpp"
#include "tests/support/sums_over_links.hpp"

namespace tandem::runtime {
namespace {

using model::Array;
using model::Arrays;
using model::Kernel;

struct Shipped {
  model::Tree tree;
  model::ModelSpec spec;
  model::Mechanism mechanism;
  std::string library;

  explicit Shipped(const std::string& robot) {
    auto read = robot::read_complete_robot(TANDEM_SOURCE_DIR "/config/" + robot + "/robot.toml");
    if (!read) throw std::runtime_error(read.error().front().to_string());
    tree = std::move(read->description.tree);
    spec = sim::model_spec(read->config);
    mechanism = *model::make_mechanism(tree, spec);
    library = model::library_path(TANDEM_BINARY_DIR "/lib/models", read->config.name);
  }
  [[nodiscard]] model::KernelLibrary load(const char* variant = "") const {
    auto loaded = model::load_kernels(library, model::description_hash(tree, spec), variant);
    if (!loaded) throw std::runtime_error(loaded.error().to_string());
    return *std::move(loaded);
  }
};

class ShippedKernels : public testing::TestWithParam<const char*> {};

// Forward dynamics can be no better than rounding times the condition of the mass matrix.
double tolerance(Kernel kernel, const model::SumsOverLinks& truth) {
  if (kernel != Kernel::kForwardDynamics) return 1e-11;
  const Eigen::MatrixXd M = truth.mass_matrix().cast<double>();
  const Eigen::VectorXd values = model::symmetric_eigenvalues(M);
  return std::max(1e-11, 2.2e-16 * values.maxCoeff() / values.minCoeff());
}

TEST_P(ShippedKernels, AreTheSumsOverTheRobotsLinksInEveryVariant) {
  const Shipped robot(GetParam());
  int variants = 0;
  for (const char* variant : model::kVariantNames) {
    const auto loaded = model::load_kernels(robot.library, {}, variant);
    if (!loaded) continue;  // another CPU's
    ++variants;
    for (unsigned seed = 100; seed < 120; ++seed) {
      const model::SeededState state(robot.mechanism, seed);
      const model::SumsOverLinks truth(robot.tree, robot.spec, state.q, state.v);
      for (int k = 0; k < model::kKernels; ++k) {
        const auto kernel = static_cast<Kernel>(k);
        const Arrays in = state.of(kernel);
        const Arrays expected = truth.outputs(kernel, in);
        const Arrays actual = model::call_kernel(**loaded, kernel, robot.mechanism, in);
        for (std::size_t i = 0; i < expected.size(); ++i)
          EXPECT_LE(model::kernel_error(kernel, robot.mechanism.mass_kg, actual[i], expected[i]),
                    tolerance(kernel, truth))
              << model::kernel_shape(kernel, robot.mechanism).name << " " << variant;
      }
    }
  }
  EXPECT_GE(variants, 1);
}

// A robot without torques and, with a floating base, in free fall; by Runge-Kutta of fourth order.
class FreeMotion {
 public:
  FreeMotion(const Shipped& robot, const model::KernelLibrary& library)
      : m_(robot.mechanism),
        kernels_(*library),
        tau_(static_cast<std::size_t>(m_.nv()), 0.0),
        wrench_(static_cast<std::size_t>(6 * m_.wrenches), 0.0) {
    const model::SeededState state(m_, 5);
    q = state.q;
    for (const double rate : state.v) v.push_back(0.2 * rate);
  }

  void step(double h) {
    const Rates k1 = rates(q, v);
    const Rates k2 = rates(plus(q, k1.q, h / 2), plus(v, k1.v, h / 2));
    const Rates k3 = rates(plus(q, k2.q, h / 2), plus(v, k2.v, h / 2));
    const Rates k4 = rates(plus(q, k3.q, h), plus(v, k3.v, h));
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] += h / 6 * (k1.q[i] + 2 * k2.q[i] + 2 * k3.q[i] + k4.q[i]);
    for (std::size_t i = 0; i < v.size(); ++i)
      v[i] += h / 6 * (k1.v[i] + 2 * k2.v[i] + 2 * k3.v[i] + k4.v[i]);
    if (m_.floating_base) Eigen::Map<Eigen::Vector4d>(q.data() + 3).normalize();
  }

  [[nodiscard]] std::array<double, 2> energy() const {  // kinetic, potential
    std::array<double, 2> e{};
    kernels_.energy(q.data(), v.data(), e.data());
    return e;
  }
  [[nodiscard]] Array momentum() const {
    Array h(6);
    kernels_.centroidal_momentum(q.data(), v.data(), h.data());
    return h;
  }

  Array q, v;

 private:
  struct Rates {
    Array q, v;
  };

  [[nodiscard]] Rates rates(const Array& at_q, const Array& at_v) const {
    Rates result{Array(at_q.size(), 0.0), Array(at_v.size(), 0.0)};
    if (m_.floating_base) {
      const Eigen::Quaterniond base(at_q[6], at_q[3], at_q[4], at_q[5]);
      const Eigen::Vector3d p = base * Eigen::Vector3d(at_v[0], at_v[1], at_v[2]);
      const Eigen::Quaterniond rate =
          base * Eigen::Quaterniond(0.0, 0.5 * at_v[3], 0.5 * at_v[4], 0.5 * at_v[5]);
      for (int i = 0; i < 3; ++i) result.q[i] = p[i];
      for (int i = 0; i < 4; ++i) result.q[3 + i] = rate.coeffs()[i];
    }
    for (int j = 0; j < m_.joint_count(); ++j) result.q[m_.q_index(j)] = at_v[m_.v_index(j)];
    kernels_.forward_dynamics(at_q.data(), at_v.data(), tau_.data(), wrench_.data(),
                              result.v.data());
    return result;
  }
  static Array plus(Array a, const Array& b, double scale) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] += scale * b[i];
    return a;
  }

  const model::Mechanism& m_;
  const tandem_kernels& kernels_;
  Array tau_, wrench_;
};

TEST_P(ShippedKernels, KeepEnergyAndMomentumOverTenSecondsOfFreeMotion) {
  const Shipped robot(GetParam());
  const model::KernelLibrary library = robot.load();
  FreeMotion motion(robot, library);
  const auto [kinetic, potential] = motion.energy();
  const Array before = motion.momentum();
  const Array start = motion.v;
  constexpr double kStep = 1e-4;
  constexpr int kSteps = 100'000;
  double most_kinetic = kinetic;
  for (int i = 0; i < kSteps; ++i) {
    motion.step(kStep);
    if (i % 100 == 0) most_kinetic = std::max(most_kinetic, motion.energy()[0]);
  }
  EXPECT_GT(model::relative_error(motion.v, start), 1e-2);  // it did move
  const auto [kinetic_after, potential_after] = motion.energy();
  const double drift = kinetic_after + potential_after - kinetic - potential;
  RecordProperty("energy_drift", std::to_string(drift / most_kinetic));
  EXPECT_LE(std::abs(drift), 1e-8 * most_kinetic);
  if (!robot.mechanism.floating_base) return;
  Array expected = before;
  for (int i = 0; i < 3; ++i)
    expected[i] += robot.mechanism.mass_kg * robot.mechanism.gravity[i] * kStep * kSteps;
  const Array after = motion.momentum();
  for (int i = 0; i < 6; ++i)  // linear beside what gravity gave, angular beside its own size
    EXPECT_NEAR(after[i], expected[i], 1e-9 * (i < 3 ? std::abs(expected[2]) : most_kinetic)) << i;
}

INSTANTIATE_TEST_SUITE_P(Robots, ShippedKernels,
                         testing::Values("coman", "walkman", "icub", "anymal_c", "panda", "ur5e",
                                         "double_pendulum", "four_bar", "parallel_ankle"),
                         [](const auto& test) { return std::string(test.param); });

// COMAN's and WALK-MAN's springs leave their links without armature: Pinocchio's very model.
class ShippedHumanoid : public testing::TestWithParam<const char*> {};

TEST_P(ShippedHumanoid, AgreesWithPinocchioInTwentyStates) {
  const Shipped robot(GetParam());
  ASSERT_TRUE(robot.spec.armature.empty());
  const model::KernelLibrary library = robot.load();
  const Array none(static_cast<std::size_t>(6 * robot.mechanism.wrenches), 0.0);
  const nlohmann::json reference = model::read_reference(GetParam());
  ASSERT_EQ(reference["states"].size(), 20u);
  for (const nlohmann::json& state : reference["states"]) {
    const auto of = [&](const char* key) { return model::flat(state[key]); };
    const auto check = [&](Kernel kernel, const Arrays& in, const Array& expected) {
      const Arrays actual = model::call_kernel(*library, kernel, robot.mechanism, in);
      EXPECT_LE(model::relative_error(actual[0], expected), 1e-11)
          << model::kernel_shape(kernel, robot.mechanism).name;
    };
    const Array q = of("q");
    const Array v = of("v");
    check(Kernel::kForwardDynamics, {q, v, of("tau"), none}, of("fd_ddq_exact"));
    check(Kernel::kInverseDynamics, {q, v, of("a"), none}, of("id_tau"));
    check(Kernel::kMassMatrix, {q}, model::full_from_lower(state["M_lower"]));
    check(Kernel::kBias, {q, v}, of("nle"));
    check(Kernel::kCenterOfMass, {q, v}, of("com"));
    check(Kernel::kCentroidalMomentum, {q, v}, of("centroidal_momentum"));
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, ShippedHumanoid, testing::Values("coman", "walkman"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace tandem::runtime
