// Closed loops in the plant: a four-bar linkage against its closed form, an ankle driven through
// rods, and both for energy, redundancy, statics and snapshots.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include <random>

#include "hal/sim/plant.hpp"
#include "rt/scoped_realtime.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem::sim {
namespace {

using Eigen::VectorXd;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::size_t kCoupler = 1, kRocker = 2;  // in the kernels' order: crank, coupler, rocker

class LoopTest : public testing::Test {
 protected:
  explicit LoopTest(const char* name) : robot(test::load_test_robot(name)), k(*robot.kernels) {}

  // Motors without friction, at the positions given.
  [[nodiscard]] PlantConfig config(const std::vector<double>& position,
                                   Integrator integrator = Integrator::kRungeKutta4) const {
    PlantConfig plant;
    plant.kernels = robot.kernels.get();
    plant.passive = robot.robot.passive;
    plant.loops = robot.robot.loop_specs();
    plant.integrator = integrator;
    for (std::size_t j = 0; j < position.size(); ++j) {
      const hal::JointConfig& joint = robot.robot.joints[j];
      hal::ActuatorConfig actuator = robot.robot.actuator_of(joint);
      actuator.damping_Nms_rad = 0.0;
      plant.joints.push_back({joint.name, actuator, position[j], 0.0});
    }
    return plant;
  }
  [[nodiscard]] static Plant make(const PlantConfig& config) {
    Result<Plant> plant = Plant::create(config);
    if (!plant) throw std::runtime_error(plant.error().to_string());
    return std::move(*plant);
  }
  [[nodiscard]] double energy(const Plant& plant) const {
    double e[2];
    k.energy(plant.q(), plant.v(), e);
    return e[0] + e[1];
  }
  /// Lets the plant swing without power. @return the largest change of its energy, over how much
  /// of it was kinetic at most
  double swing(Plant& plant, double seconds) {
    const double before = energy(plant);
    double change = 0.0;
    double kinetic = 0.0;
    for (int i = 0; i < static_cast<int>(seconds * 1e3); ++i) {
      EXPECT_EQ(plant.advance(1'000'000), Code::kOk) << plant.diverged_text();
      change = std::max(change, std::abs(energy(plant) - before));
      double e[2];
      k.energy(plant.q(), plant.v(), e);
      kinetic = std::max(kinetic, e[0]);
      for (std::size_t l = 0; l < plant.loops().equations().loops(); ++l) {
        worst_m = std::max(worst_m, plant.loops().position_error_m(l));
        worst_m_s = std::max(worst_m_s, plant.loops().velocity_error_m_s(l));
      }
    }
    EXPECT_GT(kinetic, 0.01) << "it did move";
    return change / kinetic;
  }
  [[nodiscard]] VectorXd accelerations(Plant& plant) const {
    plant.evaluate();
    return Eigen::Map<const VectorXd>(plant.vdot(), k.nv);
  }

  test::TestRobot robot;
  const tandem_kernels& k;
  double worst_m = 0.0, worst_m_s = 0.0;
};

TEST(Semidefinite, SolvesWhatIsConsistentWhateverItsRank) {
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  model::SemidefiniteSolver solver(8);
  for (Eigen::Index n = 1; n <= 8; ++n)
    for (Eigen::Index rank = 0; rank <= n; ++rank) {
      const Matrix B = Matrix::NullaryExpr(n, rank, [&] { return normal(generator); });
      const Matrix S = B * B.transpose();
      const VectorXd b = S * VectorXd::NullaryExpr(n, [&] { return normal(generator); });
      VectorXd x = b;
      solver.factorise({S.data(), static_cast<std::size_t>(n * n)}, static_cast<std::size_t>(n));
      solver.solve({x.data(), static_cast<std::size_t>(n)});
      EXPECT_EQ(solver.rank(), static_cast<std::size_t>(rank));
      EXPECT_LT((S * x - b).norm(), 1e-8 * (1.0 + b.norm())) << n << ' ' << rank;
    }
}

class FourBar : public LoopTest {
 protected:
  FourBar() : LoopTest("four_bar") {}

  // The upper branch: angles of coupler (to the crank) and rocker, by the law of cosines.
  static std::array<double, 2> closed_form(double crank) {
    constexpr double a = 0.1, b = 0.28, c = 0.2, ground = 0.3;
    const Eigen::Vector2d B(a * std::cos(crank), a * std::sin(crank));
    const Eigen::Vector2d D(ground, 0.0);
    const Eigen::Vector2d DB = B - D;
    const double d = DB.norm();
    const double at_D = std::acos((c * c + d * d - b * b) / (2.0 * c * d));
    const double rocker = std::atan2(DB.y(), DB.x()) - at_D;
    const Eigen::Vector2d C = D + c * Eigen::Vector2d(std::cos(rocker), std::sin(rocker));
    return {std::atan2(C.y() - B.y(), C.x() - B.x()) - crank, rocker};
  }
  static double turns_apart(double a, double b) { return std::remainder(a - b, 2.0 * M_PI); }
};

TEST_F(FourBar, ClosesAtEveryAngleOfItsCrankAsItsClosedFormSays) {
  auto loops = model::ClosedLoops::create(robot.robot.loop_specs(), robot.robot.passive_names(), k);
  ASSERT_TRUE(loops) << loops.error().to_string();
  std::vector<double> q{1.0, -0.6, 1.5};
  for (int i = 0; i <= 200; ++i) {
    q[0] = 1.0 + 2.0 * M_PI * i / 100.0;  // two turns
    ASSERT_TRUE(loops->close(q.data(), 20)) << q[0];
    const auto [coupler, rocker] = closed_form(q[0]);
    EXPECT_NEAR(turns_apart(q[kCoupler], coupler), 0.0, 1e-10) << q[0];
    EXPECT_NEAR(turns_apart(q[kRocker], rocker), 0.0, 1e-10) << q[0];
  }
}

TEST_F(FourBar, SwingsOnTheClosedFormAndKeepsItsEnergy) {
  Plant plant = make(config({1.0}));
  EXPECT_LT(swing(plant, 10.0), 1e-9);
  EXPECT_LT(worst_m, 1e-11);
  EXPECT_LT(worst_m_s, 1e-11);
  const auto [coupler, rocker] = closed_form(plant.q()[0]);
  EXPECT_NEAR(turns_apart(plant.q()[kCoupler], coupler), 0.0, 1e-9);
  EXPECT_NEAR(turns_apart(plant.q()[kRocker], rocker), 0.0, 1e-9);
}

TEST_F(FourBar, KeepsItsEnergyWithinItsStepWithTheSimpleIntegratorToo) {
  Plant plant = make(config({1.0}, Integrator::kLeapfrog));
  EXPECT_LT(swing(plant, 10.0), 1e-5);
  EXPECT_LT(worst_m, 1e-11);
  EXPECT_LT(worst_m_s, 1e-11);
}

// One coordinate is left: (G^T M G) a = G^T (tau - h - M G' v) with G = dq / d crank, by
// differences of the closed form.
TEST_F(FourBar, AcceleratesAsItsOneCoordinateDoes) {
  const double crank = 1.0;
  const double rate = 3.0;
  const auto q_of = [](double x) {
    const auto [coupler, rocker] = closed_form(x);
    return Eigen::Vector3d(x, coupler, rocker);
  };
  const double h = 1e-4;
  const Eigen::Vector3d q = q_of(crank);
  const Eigen::Vector3d G = (q_of(crank + h) - q_of(crank - h)) / (2.0 * h);
  const Eigen::Vector3d G_rate = (q_of(crank + h) - 2.0 * q + q_of(crank - h)) / (h * h) * rate;
  const Eigen::Vector3d v = G * rate;
  Matrix M(3, 3);
  Eigen::Vector3d bias;
  k.mass_matrix(q.data(), M.data());
  k.bias(q.data(), v.data(), bias.data());
  const double expected = -G.dot(bias + M * G_rate * rate) / G.dot(M * G);
  Plant plant = make(config({crank}));
  plant.set_state(std::span(q.data(), 3), std::span(v.data(), 3));
  const VectorXd actual = accelerations(plant);
  EXPECT_NEAR(actual[0], expected, 1e-5 * std::abs(expected));
  EXPECT_NEAR((actual - (G * expected + G_rate * rate)).norm(), 0.0, 1e-4 * actual.norm());
}

// In space a planar revolute joint's five equations say two things, a ball's three the same two.
TEST_F(FourBar, TakesEquationsThatRepeatEachOther) {
  PlantConfig revolute = config({1.0});
  PlantConfig ball = revolute;
  ball.loops[0].type = model::KinematicLoopType::kBall;
  const std::vector<double> v{2.0, 0.0, 0.0};
  std::vector<VectorXd> results;
  for (const PlantConfig& one : {revolute, ball}) {
    Plant plant = make(one);
    EXPECT_EQ(plant.loops().equations().rows(),
              one.loops[0].type == model::KinematicLoopType::kBall ? 3u : 5u);
    model::ClosedLoops loops = plant.loops().equations();
    std::vector<double> rates = v;
    loops.move(plant.q(), rates.data());
    loops.differentiate(plant.q());
    loops.close_rates(rates.data());
    plant.set_state(std::vector<double>(plant.q(), plant.q() + 3), rates);
    results.push_back(accelerations(plant));
    const Matrix A = Eigen::Map<const Matrix>(loops.jacobian().data(),
                                              static_cast<Eigen::Index>(loops.rows()), 3);
    EXPECT_EQ(Eigen::FullPivLU<Matrix>(A).setThreshold(1e-9).rank(), 2);
    loops.move(plant.q(), plant.v());
    for (std::size_t r = 0; r < loops.rows(); ++r)
      EXPECT_NEAR(
          A.row(static_cast<Eigen::Index>(r)).dot(results.back()) + loops.equations()[r].bias, 0.0,
          1e-10);
  }
  EXPECT_LT((results[0] - results[1]).norm(), 1e-9 * results[0].norm());
}

TEST_F(FourBar, NeedsTheTorqueAtItsMotorThatItsWeightChangesBy) {
  auto loops = model::ClosedLoops::create(robot.robot.loop_specs(), robot.robot.passive_names(), k);
  ASSERT_TRUE(loops);
  const std::vector<double> zero(3, 0.0);
  const auto potential = [&](double crank) {
    const auto [coupler, rocker] = closed_form(crank);
    const double q[3] = {crank, coupler, rocker};
    double e[2];
    k.energy(q, zero.data(), e);
    return e[1];
  };
  std::vector<double> q{0.7, -0.6, 1.5};
  for (q[0] = 0.7; q[0] < 6.0; q[0] += 0.5) {
    ASSERT_TRUE(loops->close(q.data(), 50));
    double tau[3];
    k.bias(q.data(), zero.data(), tau);
    loops->carry_passive(tau);
    EXPECT_NEAR(tau[0], (potential(q[0] + 1e-5) - potential(q[0] - 1e-5)) / 2e-5, 1e-7);
    EXPECT_NEAR(tau[kCoupler], 0.0, 1e-12);
    EXPECT_NEAR(tau[kRocker], 0.0, 1e-12);
  }
}

TEST_F(FourBar, SaysWhichLoopAPostureCannotClose) {
  PlantConfig open = config({1.0});
  open.loops[0].type = model::KinematicLoopType::kRod;
  open.loops[0].length_m = 2.0;  // the bars reach 0.78 m
  const Result<Plant> plant = Plant::create(open);
  ASSERT_FALSE(plant);
  EXPECT_EQ(plant.error().key, "loop.pin");
  EXPECT_NE(plant.error().message.find("cannot be closed from the start's posture: a gap of 1.2"),
            std::string::npos)
      << plant.error().message;
}

// Linked with the real-time trap: what happens in the cycle allocates nothing.
TEST_F(FourBar, AdvancesClosesAndCarriesWithinTheCycle) {
  Plant plant = make(config({1.0}));
  auto loops = model::ClosedLoops::create(robot.robot.loop_specs(), robot.robot.passive_names(), k);
  ASSERT_TRUE(loops);
  double q[3] = {1.2, -0.6, 1.5};
  double tau[3] = {1.0, 2.0, 3.0};
  Code code = Code::kTimeout;
  bool closed = false;
  {
    const rt::ScopedRealtime in_cycle;
    code = plant.advance(10'000'000);
    closed = loops->close(q, 20);
    loops->carry_passive(tau);
  }
  EXPECT_EQ(code, Code::kOk);
  EXPECT_TRUE(closed);
}

TEST_F(FourBar, GoesOnFromASnapshotBitByBit) {
  for (const Integrator integrator : {Integrator::kLeapfrog, Integrator::kRungeKutta4}) {
    Plant plant = make(config({1.0}, integrator));
    ASSERT_EQ(plant.advance(100'000'000), Code::kOk);
    Archive saved;
    plant.archive(saved);
    ASSERT_EQ(plant.advance(100'000'000), Code::kOk);
    const std::vector<double> q(plant.q(), plant.q() + 3);
    Plant other = make(config({0.5}, integrator));
    Archive restored(saved.bytes());
    other.archive(restored);
    ASSERT_TRUE(restored.ok() && restored.at_end());
    ASSERT_EQ(other.advance(100'000'000), Code::kOk);
    EXPECT_EQ(std::vector<double>(other.q(), other.q() + 3), q);
  }
}

class ParallelAnkle : public LoopTest {
 protected:
  ParallelAnkle() : LoopTest("parallel_ankle") {}
  [[nodiscard]] double position(const Plant& plant, const std::string& joint) const {
    for (std::uint32_t i = 0; i < k.joints; ++i)
      if (k.joint_names[i] == joint) return plant.q()[i];
    return NAN;
  }
};

TEST_F(ParallelAnkle, PitchesAsItsMotorsTurnTogetherAndRollsAsTheyPart) {
  for (const double angle : {-0.6, -0.2, 0.0, 0.3, 0.7}) {
    const Plant plant = make(config({angle, angle}));  // a parallelogram
    EXPECT_NEAR(position(plant, "ankle_pitch"), angle, 1e-12);
    EXPECT_NEAR(position(plant, "ankle_roll"), 0.0, 1e-12);
  }
  const Plant plant = make(config({0.3, -0.3}));
  EXPECT_NEAR(position(plant, "ankle_pitch"), 0.0, 0.02);
  EXPECT_GT(std::abs(position(plant, "ankle_roll")), 0.2);
}

TEST_F(ParallelAnkle, SwingsOnItsRodsAndKeepsItsEnergy) {
  Plant plant = make(config({0.5, 0.1}));
  EXPECT_LT(swing(plant, 5.0), 1e-6);
  EXPECT_LT(worst_m, 1e-11);
  EXPECT_LT(worst_m_s, 1e-11);
}

// The forces at the rods' ends, as the sensors see them, account for the whole acceleration.
TEST_F(ParallelAnkle, AcceleratesByTheForcesOfItsRodsAlone) {
  Plant plant = make(config({0.5, 0.1}));
  ASSERT_EQ(plant.advance(50'000'000), Code::kOk);
  const VectorXd closed = accelerations(plant);
  VectorXd vdot(k.nv);
  k.forward_dynamics(plant.q(), plant.v(), plant.tau(), plant.wrench(), vdot.data());
  EXPECT_LT((vdot - closed).norm(), 1e-9 * closed.norm());
}

}  // namespace
}  // namespace tandem::sim
