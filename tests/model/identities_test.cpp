#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "tests/model/reference.hpp"

namespace tandem::model {
namespace {

// A random state of a robot, with wrenches at its sites; seeded.
struct RandomState {
  Array q, v, vdot, wrench;

  RandomState(const Mechanism& m, unsigned seed) {
    std::mt19937 generator(seed);
    const auto array = [&](int size) {
      Array values;
      for (int i = 0; i < size; ++i)
        values.push_back(-1.5 + 3.0 * static_cast<double>(generator()) / 4294967296.0);
      return values;
    };
    q = array(m.nq());
    v = array(m.nv());
    vdot = array(m.nv());
    wrench = array(6 * m.wrenches);
    if (m.floating_base) normalise(q);
  }
  static void normalise(Array& q) { Eigen::Map<Eigen::Vector4d>(q.data() + 3).normalize(); }
};

// q moved along v for a time: a first-order step, and for the base's rotation an exact one.
Array moved(const Mechanism& m, const Array& q, const Array& v, double time) {
  Array result = q;
  if (m.floating_base) {
    const Eigen::Quaterniond base(q[6], q[3], q[4], q[5]);
    const Eigen::Vector3d step = base * Eigen::Vector3d(v[0], v[1], v[2]) * time;
    const Eigen::Vector3d w(v[3], v[4], v[5]);
    const Eigen::Quaterniond next =
        base * Eigen::Quaterniond(Eigen::AngleAxisd(w.norm() * time, w.normalized()));
    for (int i = 0; i < 3; ++i) result[i] += step[i];
    result[3] = next.x();
    result[4] = next.y();
    result[5] = next.z();
    result[6] = next.w();
  }
  for (int j = 0; j < m.joint_count(); ++j) result[m.q_index(j)] += v[m.v_index(j)] * time;
  return result;
}

Array times(const Array& matrix, const Array& v) {
  Array result(matrix.size() / v.size(), 0.0);
  for (std::size_t i = 0; i < result.size(); ++i)
    for (std::size_t j = 0; j < v.size(); ++j) result[i] += matrix[i * v.size() + j] * v[j];
  return result;
}

Mechanism with_armature(const ReferenceRobot& robot) {
  ModelSpec spec = reference_spec(robot);
  const Tree tree = reference_tree(robot);
  for (std::size_t j = 0; j < tree.joints.size(); j += 2)
    spec.armature.emplace_back(tree.joints[j].name, 0.05 + 0.01 * static_cast<double>(j));
  return *make_mechanism(tree, spec);
}

class Identities : public testing::TestWithParam<ReferenceRobot> {};

TEST_P(Identities, ForwardUndoesInverseDynamicsWithWrenchesAndArmature) {
  for (const Mechanism& m : {reference_mechanism(GetParam()), with_armature(GetParam())}) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const RandomState s(m, seed);
      const Array tau =
          evaluate_kernel(Kernel::kInverseDynamics, m, {s.q, s.v, s.vdot, s.wrench})[0];
      const Array vdot = evaluate_kernel(Kernel::kForwardDynamics, m, {s.q, s.v, tau, s.wrench})[0];
      EXPECT_LE(relative_error(vdot, s.vdot), 1e-9);
    }
  }
}

TEST_P(Identities, InverseDynamicsIsMassMatrixBiasAndTransposedJacobians) {
  const Mechanism m = with_armature(GetParam());
  const RandomState s(m, 4);
  const Array tau = evaluate_kernel(Kernel::kInverseDynamics, m, {s.q, s.v, s.vdot, s.wrench})[0];
  const Array bias = evaluate_kernel(Kernel::kBias, m, {s.q, s.v})[0];
  Array expected = times(evaluate_kernel(Kernel::kMassMatrix, m, {s.q})[0], s.vdot);
  const Array J = evaluate_kernel(Kernel::kSiteJacobians, m, {s.q})[0];
  const Array pose = evaluate_kernel(Kernel::kSiteMotion, m, {s.q, s.v, s.vdot})[0];
  const std::size_t nv = s.v.size();
  for (std::size_t i = 0; i < nv; ++i) {
    expected[i] += bias[i];
    for (std::size_t site = 0; site < m.sites.size(); ++site)
      for (std::size_t row = 0; row < 6; ++row) {
        double in_world = 0.0;  // the wrench is given in the site's frame
        for (std::size_t k = 0; k < 3; ++k)
          in_world += pose[12 * site + 3 * (row % 3) + k] * s.wrench[6 * site + row / 3 * 3 + k];
        expected[i] -= J[(6 * site + row) * nv + i] * in_world;
      }
  }
  EXPECT_LE(relative_error(tau, expected), 1e-12);
}

// dp/dt = tau + b along any motion, with dp/dt from differences: no Coriolis matrix is needed.
TEST_P(Identities, GeneralisedMomentumChangesByItsTorquesAndItsBias) {
  const Mechanism m = with_armature(GetParam());
  const RandomState s(m, 8);
  const double h = 1e-5;
  const auto momentum_at = [&](double time) {
    Array v = s.v, middle = s.v;  // half way: second order in time
    for (std::size_t i = 0; i < v.size(); ++i) v[i] += s.vdot[i] * time;
    for (std::size_t i = 0; i < v.size(); ++i) middle[i] += s.vdot[i] * time / 2;
    return evaluate_kernel(Kernel::kGeneralisedMomentum, m,
                           {moved(m, s.q, middle, time), v, s.wrench})[0];
  };
  const Array before = momentum_at(-h), after = momentum_at(h);
  const Array tau = evaluate_kernel(Kernel::kInverseDynamics, m, {s.q, s.v, s.vdot, s.wrench})[0];
  const Arrays now = evaluate_kernel(Kernel::kGeneralisedMomentum, m, {s.q, s.v, s.wrench});
  Array difference(tau.size()), expected(tau.size());
  for (std::size_t i = 0; i < tau.size(); ++i) {
    difference[i] = (after[i] - before[i]) / (2 * h);
    expected[i] = tau[i] + now[1][i];
  }
  EXPECT_LE(relative_error(difference, expected), 1e-7);
}

// p = M v; of dM/dt = C + C^T and C v + g = h follow C^T v - g = dM/dt v - h, and the energy:
// v^T C^T v = v^T C v. At rest b is minus gravity.
TEST_P(Identities, GeneralisedMomentumIsThatOfMassMatrixAndCoriolisMatrix) {
  const Mechanism m = with_armature(GetParam());
  const RandomState s(m, 9);
  const Array none(s.wrench.size(), 0.0), rest(s.v.size(), 0.0);
  const auto mass_times_v = [&](const Array& q) {
    return times(evaluate_kernel(Kernel::kMassMatrix, m, {q})[0], s.v);
  };
  const Arrays now = evaluate_kernel(Kernel::kGeneralisedMomentum, m, {s.q, s.v, none});
  EXPECT_LE(relative_error(now[0], mass_times_v(s.q)), 1e-12);
  const Array bias = evaluate_kernel(Kernel::kBias, m, {s.q, s.v})[0];
  const Array gravity = evaluate_kernel(Kernel::kBias, m, {s.q, rest})[0];
  const double h = 1e-5;
  const Array before = mass_times_v(moved(m, s.q, s.v, -h));
  const Array after = mass_times_v(moved(m, s.q, s.v, h));
  Array transposed(s.v.size()), expected(s.v.size());
  double power = 0.0, power_of_C = 0.0, scale = 0.0;
  for (std::size_t i = 0; i < s.v.size(); ++i) {
    transposed[i] = now[1][i] + gravity[i];
    expected[i] = (after[i] - before[i]) / (2 * h) - (bias[i] - gravity[i]);
    power += s.v[i] * transposed[i];
    power_of_C += s.v[i] * (bias[i] - gravity[i]);
    scale += std::abs(s.v[i] * transposed[i]) + 0.01 * std::abs(s.v[i] * bias[i]);  // it cancels
  }
  EXPECT_LE(relative_error(transposed, expected), 1e-7);
  EXPECT_NEAR(power, power_of_C, 1e-11 * scale);
  Array at_rest = evaluate_kernel(Kernel::kGeneralisedMomentum, m, {s.q, rest, none})[1];
  for (double& force : at_rest) force = -force;
  EXPECT_LE(relative_error(at_rest, gravity), 1e-12);
}

TEST_P(Identities, JacobiansAreTheDifferencesOfPoses) {
  const Mechanism m = reference_mechanism(GetParam());
  const RandomState s(m, 5);
  const double h = 1e-5;
  const Arrays motion = evaluate_kernel(Kernel::kSiteMotion, m, {s.q, s.v, s.vdot});
  const Array J = evaluate_kernel(Kernel::kSiteJacobians, m, {s.q})[0];
  EXPECT_LE(relative_error(times(J, s.v), motion[1]), 1e-12);
  const Arrays com = evaluate_kernel(Kernel::kCenterOfMass, m, {s.q, s.v});
  EXPECT_LE(relative_error(times(com[2], s.v), com[1]), 1e-12);
  const auto at = [&](double time) { return moved(m, s.q, s.v, time); };
  const Array before = evaluate_kernel(Kernel::kSiteMotion, m, {at(-h), s.v, s.vdot})[0];
  const Array after = evaluate_kernel(Kernel::kSiteMotion, m, {at(h), s.v, s.vdot})[0];
  for (std::size_t site = 0; site < m.sites.size(); ++site)
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_NEAR((after[12 * site + 9 + i] - before[12 * site + 9 + i]) / (2 * h),
                  motion[1][6 * site + i], 1e-7);
  const Array c_before = evaluate_kernel(Kernel::kCenterOfMass, m, {at(-h), s.v})[0];
  const Array c_after = evaluate_kernel(Kernel::kCenterOfMass, m, {at(h), s.v})[0];
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR((c_after[i] - c_before[i]) / (2 * h), com[1][i], 1e-7);
}

TEST_P(Identities, SiteAccelerationsAreTheDifferencesOfTwists) {
  const Mechanism m = reference_mechanism(GetParam());
  const RandomState s(m, 6);
  const double h = 1e-5;
  const auto twist_at = [&](double time) {
    Array v = s.v;
    for (std::size_t i = 0; i < v.size(); ++i) v[i] += s.vdot[i] * time;
    Array middle = s.v;  // velocity half way: second order in time
    for (std::size_t i = 0; i < v.size(); ++i) middle[i] += s.vdot[i] * time / 2;
    return evaluate_kernel(Kernel::kSiteMotion, m, {moved(m, s.q, middle, time), v, s.vdot})[1];
  };
  const Array before = twist_at(-h);
  const Array after = twist_at(h);
  const Array acceleration = evaluate_kernel(Kernel::kSiteMotion, m, {s.q, s.v, s.vdot})[2];
  for (std::size_t i = 0; i < acceleration.size(); ++i)
    EXPECT_NEAR((after[i] - before[i]) / (2 * h), acceleration[i], 1e-6);
}

// Free motion without torques, by Runge-Kutta of fourth order.
struct FreeMotion {
  const Mechanism& m;
  Array q, v;

  void step(double h) {
    const Array none(static_cast<std::size_t>(6 * m.wrenches), 0.0);
    const Array torques(v.size(), 0.0);
    const auto rates = [&](const Array& at_q, const Array& at_v) {
      Array qdot(at_q.size(), 0.0);
      if (m.floating_base) {
        const Eigen::Quaterniond base(at_q[6], at_q[3], at_q[4], at_q[5]);
        const Eigen::Vector3d p = base * Eigen::Vector3d(at_v[0], at_v[1], at_v[2]);
        const Eigen::Quaterniond w(0.0, 0.5 * at_v[3], 0.5 * at_v[4], 0.5 * at_v[5]);
        const Eigen::Quaterniond rate = base * w;
        for (int i = 0; i < 3; ++i) qdot[i] = p[i];
        for (int i = 0; i < 4; ++i) qdot[3 + i] = rate.coeffs()[i];
      }
      for (int j = 0; j < m.joint_count(); ++j) qdot[m.q_index(j)] = at_v[m.v_index(j)];
      return std::pair(
          qdot, evaluate_kernel(Kernel::kForwardDynamics, m, {at_q, at_v, torques, none})[0]);
    };
    const auto plus = [](Array a, const Array& b, double scale) {
      for (std::size_t i = 0; i < a.size(); ++i) a[i] += scale * b[i];
      return a;
    };
    const auto k1 = rates(q, v);
    const auto k2 = rates(plus(q, k1.first, h / 2), plus(v, k1.second, h / 2));
    const auto k3 = rates(plus(q, k2.first, h / 2), plus(v, k2.second, h / 2));
    const auto k4 = rates(plus(q, k3.first, h), plus(v, k3.second, h));
    for (const auto& [k, scale] : {std::pair(&k1, 1.0), {&k2, 2.0}, {&k3, 2.0}, {&k4, 1.0}}) {
      q = plus(q, k->first, scale * h / 6);
      v = plus(v, k->second, scale * h / 6);
    }
    if (m.floating_base) RandomState::normalise(q);
  }
};

TEST_P(Identities, APassiveRobotKeepsItsEnergyAndInFlightItsMomentum) {
  const Mechanism m = with_armature(GetParam());
  const RandomState start(m, 7);
  FreeMotion motion{m, start.q, start.v};
  const auto total_energy = [&] {
    const Array e = evaluate_kernel(Kernel::kEnergy, m, {motion.q, motion.v})[0];
    return e[0] + e[1];
  };
  const auto momentum = [&] {
    return evaluate_kernel(Kernel::kCentroidalMomentum, m, {motion.q, motion.v})[0];
  };
  const double energy_before = total_energy();
  const Array before = momentum();
  const double h = 2e-5;
  const int steps = 500;
  for (int i = 0; i < steps; ++i) motion.step(h);
  EXPECT_GT(relative_error(motion.v, start.v), 1e-3);  // it did move
  EXPECT_NEAR(total_energy(), energy_before, 1e-9 * std::abs(energy_before));
  if (!m.floating_base) return;
  Array expected = before;
  for (int i = 0; i < 3; ++i) expected[i] += m.mass_kg * m.gravity[i] * h * steps;
  EXPECT_LE(relative_error(momentum(), expected), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Robots, Identities, testing::ValuesIn(kReferenceRobots),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace tandem::model
