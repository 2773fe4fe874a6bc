#include "hal/sim/actuator.hpp"

#include <Eigen/Dense>
#include <complex>
#include <numbers>

#include "base/archive.hpp"

namespace tandem::sim {
namespace {

// The published figures (docs/robots.md): COMAN's leg; WALK-MAN's MEDIUM, whose back-EMF is almost
// all of D; and BIG, whose D is less than its back-EMF.
hal::ActuatorConfig motor(const std::string& kind, int order) {
  hal::ActuatorConfig c;
  c.name = kind;
  c.order = order;
  c.resistance_ohm = kind == "medium" ? 0.356 : 0.664;
  c.inductance_H = 0.32e-3;
  c.torque_constant_Nm_A = kind == "medium" ? 0.117 : kind == "big" ? 0.0455 : 0.041;
  c.gear_ratio = 100.0;
  c.inertia_kg_m2 = kind == "medium" ? 0.416 : kind == "big" ? 0.811 : 0.1387;
  c.damping_Nms_rad = kind == "medium" ? 385.16 : kind == "big" ? 19.95 : 25.5;
  c.spring_Nm_rad = kind == "medium" ? 5000.0 : kind == "big" ? 10000.0 : 395.46;
  c.spring_damping_Nms_rad = kind == "coman" ? 0.198 : 1.0;
  c.voltage_limit_V = 80.0;
  c.thermal_resistance_K_W = 2.0;
  c.thermal_time_constant_s = 60.0;
  return c;
}

constexpr double kLinkInertia = 0.35;  // a link without gravity turns behind each actuator

// The textbook equations, written down apart from the code under test: x' = A x + B V with
// x = [q, q', th, th', i].
struct Linear {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(5, 5);
  Eigen::VectorXd B = Eigen::VectorXd::Zero(5);
};

Linear textbook(const hal::ActuatorConfig& c) {
  const double N = c.gear_ratio, K = c.torque_constant_Nm_A, R = c.resistance_ohm;
  const double J = c.inertia_kg_m2, D = c.damping_Nms_rad, L = c.inductance_H;
  const double Ks = c.spring_Nm_rad, Ds = c.spring_damping_Nms_rad;
  // Back-EMF and friction share D; see ActuatorModel for a D below N^2 K^2 / R.
  const double emf = std::min(N * K, D * R / (N * K));
  const double friction = D - N * K * emf / R;
  Linear s;
  s.A(0, 1) = 1.0;
  if (c.order >= 2) {
    s.A.row(1) << -Ks / kLinkInertia, -Ds / kLinkInertia, Ks / kLinkInertia, Ds / kLinkInertia, 0;
    s.A(2, 3) = 1.0;
    s.A.row(3) << Ks / J, Ds / J, -Ks / J, -(Ds + D) / J, 0;
    s.B(3) = N * K / (R * J);
    if (c.order == 3) {
      s.A(3, 3) = -(Ds + friction) / J;
      s.A(3, 4) = N * K / J;
      s.B(3) = 0.0;
      s.A(4, 3) = -emf / L;
    }
  } else if (c.order == 1) {
    s.A(1, 1) = -friction / (kLinkInertia + J);
    s.A(1, 4) = N * K / (kLinkInertia + J);
    s.A(4, 1) = -emf / L;
  } else {
    s.A(1, 1) = -D / (kLinkInertia + J);
    s.B(1) = N * K / (R * (kLinkInertia + J));
  }
  if (c.order == 1 || c.order == 3) {
    s.A(4, 4) = -R / L;
    s.B(4) = 1.0 / L;
  }
  return s;
}

// One actuator and its link, integrated by Runge-Kutta of order 4 with V(t) of the test.
class Rig {
 public:
  explicit Rig(const hal::ActuatorConfig& config)
      : actuators_({*make_actuator(config)}), inertia_(kLinkInertia + armature(config)) {}

  Eigen::VectorXd rate(const Eigen::VectorXd& at, double volt) {
    actuators_.set_drive(0, volt, bridge_on);
    Eigen::VectorXd dx(5);
    actuators_.evaluate(&at[0], &at[1], {&at[2], &at[3], &at[4]}, &at[3], &torque_Nm,
                        {&dx[2], &dx[3], &dx[4]});
    dx[0] = at[1];
    dx[1] = torque_Nm / inertia_;
    return dx;
  }
  template <class Volt>
  void run(double seconds, double h, Volt volt) {
    const auto steps = static_cast<int>(std::lround(seconds / h));
    for (int k = 0; k < steps; ++k, t += h) {
      const Eigen::VectorXd k1 = rate(x, volt(t));
      const Eigen::VectorXd k2 = rate(x + 0.5 * h * k1, volt(t + 0.5 * h));
      const Eigen::VectorXd k3 = rate(x + 0.5 * h * k2, volt(t + 0.5 * h));
      const Eigen::VectorXd k4 = rate(x + h * k3, volt(t + h));
      x += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
      actuators_.finish_step(h, &x[0], &x[1], {&x[2], &x[3], &x[4]});
    }
  }

  Eigen::VectorXd x = Eigen::VectorXd::Zero(5);
  double t = 0.0, torque_Nm = 0.0;
  bool bridge_on = true;
  Actuators actuators_;

 private:
  double inertia_;
};

// The rows of the state that the order has for itself; the others are copies.
std::vector<int> states(int order) {
  if (order == 0) return {0, 1};
  if (order == 1) return {0, 1, 4};
  return order == 2 ? std::vector<int>{0, 1, 2, 3} : std::vector<int>{0, 1, 2, 3, 4};
}

class EveryOrder : public testing::TestWithParam<std::tuple<const char*, int>> {
 protected:
  hal::ActuatorConfig config = motor(std::get<0>(GetParam()), std::get<1>(GetParam()));
};

TEST_P(EveryOrder, StepResponseIsTheClosedForm) {
  const Linear textbook_system = textbook(config);
  const std::vector<int> rows = states(config.order);
  const auto n = static_cast<Eigen::Index>(rows.size());
  // The exponential of [A B; 0 0] t by its eigenvalues would meet a double zero: by squaring.
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 1, n + 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) system(i, j) = textbook_system.A(rows[i], rows[j]);
    system(i, n) = textbook_system.B(rows[i]);
  }
  Rig rig(config);
  for (const double seconds : {0.002, 0.02, 0.3}) {
    constexpr double kVolt = 10.0;
    rig.run(seconds - rig.t, 1e-5, [](double) { return kVolt; });
    const int squarings = 24;
    const Eigen::MatrixXd a = system * (seconds / std::ldexp(1.0, squarings));
    Eigen::MatrixXd exact = Eigen::MatrixXd::Identity(n + 1, n + 1) + a + a * a / 2.0;
    for (int k = 0; k < squarings; ++k) exact = exact * exact;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double wanted = kVolt * exact(i, n);
      EXPECT_NEAR(rig.x[rows[i]], wanted, 1e-6 * std::abs(wanted) + 1e-9)
          << "state " << rows[i] << " after " << seconds << " s";
    }
  }
}

TEST_P(EveryOrder, FrequencyResponseIsTheClosedForm) {
  using namespace std::complex_literals;
  const Linear system = textbook(config);
  const std::vector<int> rows = states(config.order);
  for (const double hertz : {2.0, 20.0, 100.0}) {
    const double w = 2.0 * std::numbers::pi * hertz;
    const Eigen::MatrixXcd resolvent = 1i * w * Eigen::MatrixXcd::Identity(5, 5) - system.A;
    const Eigen::VectorXcd H = resolvent.fullPivLu().solve(system.B.cast<std::complex<double>>());
    // Started on the steady state itself: x(t) = Re(H e^{jwt}).
    Rig rig(config);
    for (const int row : rows) rig.x[row] = H[row].real();
    const double h = std::min(1e-5, 1.0 / (hertz * 5000.0));
    rig.run(2.2 / hertz, h, [w](double t) { return std::cos(w * t); });
    for (const int row : rows) {
      const double wanted = (H[row] * std::exp(1i * w * rig.t)).real();
      EXPECT_NEAR(rig.x[row], wanted, 1e-6 * std::abs(H[row])) << hertz << " Hz, state " << row;
    }
  }
}

TEST_P(EveryOrder, NoLoadSpeedCountsBackEmfOnce) {
  constexpr double kVolt = 10.0;
  const double kt = config.gear_ratio * config.torque_constant_Nm_A;
  const double speed = kt / config.resistance_ohm * kVolt / config.damping_Nms_rad;
  Rig rig(config);
  rig.x[1] = rig.x[3] = speed;
  const double emf = rig.actuators_.model(0).back_emf_Vs_rad;
  rig.x[4] = (kVolt - emf * speed) / config.resistance_ohm;
  const Eigen::VectorXd rate = rig.rate(rig.x, kVolt);
  EXPECT_NEAR(rate[1], 0.0, 1e-11);
  EXPECT_NEAR(rate[3], 0.0, 1e-11);
  EXPECT_NEAR(rate[4], 0.0, 1e-9);
}

TEST_P(EveryOrder, OpenCircuitBrakesWithFrictionAlone) {
  Rig rig(config);
  rig.bridge_on = false;
  rig.x[1] = rig.x[3] = 2.0;  // link and rotor turn together
  rig.x[4] = 5.0;             // dies with the bridge
  const double friction = rig.actuators_.model(0).friction_Nms_rad;
  Eigen::VectorXd rate = rig.rate(rig.x, 40.0);
  const double rotor_torque =
      config.order >= 2 ? config.inertia_kg_m2 * rate[3] + rig.torque_Nm : rig.torque_Nm;
  EXPECT_NEAR(rotor_torque, -friction * 2.0, 1e-12);
  rig.run(0.01, 1e-4, [](double) { return 40.0; });
  EXPECT_EQ(rig.x[4], 0.0);
}

TEST_P(EveryOrder, VoltageAndCurrentSaturate) {
  config.current_limit_A = 3.0;
  config.voltage_limit_V = 24.0;
  Rig rig(config);
  rig.run(0.004, 1e-5, [](double) { return 1000.0; });
  EXPECT_EQ(rig.actuators_.voltage_V()[0], 24.0);
  EXPECT_NEAR(rig.x[4], 3.0, 1e-12);
  rig.run(0.004, 1e-5, [](double) { return -1000.0; });
  EXPECT_EQ(rig.actuators_.voltage_V()[0], -24.0);
  EXPECT_NEAR(rig.x[4], -3.0, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Published, EveryOrder,
                         testing::Combine(testing::Values("coman", "medium", "big"),
                                          testing::Values(0, 1, 2, 3)),
                         [](const auto& test) {
                           return std::string(std::get<0>(test.param)) + "_order_" +
                                  std::to_string(std::get<1>(test.param));
                         });

TEST(Actuators, LeapfrogConvergesWithOrderTwo) {
  for (const int order : {2, 3}) {
    const hal::ActuatorConfig config = motor("coman", order);
    const auto end = [&](double h) {  // of the motor, its link held
      Actuators actuators({*make_actuator(config)});
      actuators.set_drive(0, 10.0, true);
      double q = 0.0, qd = 0.0, th = 0.0, thd = 0.0, i = 0.0, tau = 0.0, r[3];
      const auto steps = static_cast<int>(std::lround(0.02 / h));
      for (int k = 0; k < steps; ++k) {
        actuators.evaluate(&q, &qd, {&th, &thd, &i}, &thd, &tau, {r, r + 1, r + 2});
        actuators.kick(0.5 * h, {r, r + 1, r + 2}, {&th, &thd, &i});
        const double ahead = thd + 0.5 * h * r[1];
        actuators.drift(h, &q, {&th, &thd, &i});
        actuators.evaluate(&q, &qd, {&th, &thd, &i}, &ahead, &tau, {r, r + 1, r + 2});
        actuators.kick(0.5 * h, {r, r + 1, r + 2}, {&th, &thd, &i});
        actuators.finish_step(h, &q, &qd, {&th, &thd, &i});
      }
      return th;
    };
    const double fine = end(1e-7);
    const double error = std::abs(end(2e-4) - fine), half = std::abs(end(1e-4) - fine);
    EXPECT_NEAR(std::log2(error / half), 2.0, 0.1) << "order " << order;
  }
}

TEST(Actuators, BackEmfIsTakenOutOfTheConfiguredDamping) {
  const ActuatorModel small = *make_actuator(motor("coman", 3));
  EXPECT_NEAR(small.friction_Nms_rad, 25.5 - 4.1 * 4.1 / 0.664, 1e-12);
  EXPECT_EQ(small.back_emf_Vs_rad, small.torque_per_A);
  const ActuatorModel big = *make_actuator(motor("big", 3));  // D 19.95 < 31.18
  EXPECT_EQ(big.friction_Nms_rad, 0.0);
  EXPECT_NEAR(big.torque_per_A * big.back_emf_Vs_rad / big.resistance_ohm, 19.95, 1e-12);
}

TEST(Actuators, WindingWarmsAsAFirstOrderLag) {
  hal::ActuatorConfig config = motor("coman", 2);
  Actuators actuators({*make_actuator(config)}, 20.0);
  actuators.set_drive(0, 6.64, true);  // 10 A at standstill, 66.4 W
  double q = 0.0, qd = 0.0, th = 0.0, thd = 0.0, i = 0.0;
  for (int k = 0; k < 60'000; ++k) actuators.finish_step(1e-3, &q, &qd, {&th, &thd, &i});
  EXPECT_NEAR(i, 10.0, 1e-12);
  EXPECT_NEAR(actuators.temperature_C()[0], 20.0 + 132.8 * (1.0 - std::exp(-1.0)), 1e-8);
}

TEST(Actuators, BrakeHoldsTheRotor) {
  Rig rig(motor("coman", 2));
  rig.bridge_on = false;
  rig.actuators_.set_brake(0, true, 0.0, 0.0);
  rig.x[0] = 0.1;
  rig.run(0.1, 1e-4, [](double) { return 0.0; });
  EXPECT_EQ(rig.x[2], 0.0);
  EXPECT_NE(rig.x[0], 0.1);  // the link swings on its spring
}

TEST(Actuators, MissingConstantsAreNamed) {
  hal::ActuatorConfig config = motor("coman", 3);
  config.inductance_H = 0.0;
  const Result<ActuatorModel> model = make_actuator(config);
  ASSERT_FALSE(model);
  EXPECT_EQ(model.error().key, "actuator.coman.inductance_H");
  config = motor("coman", 0);
  config.inductance_H = config.spring_Nm_rad = 0.0;
  EXPECT_TRUE(make_actuator(config));
  config.order = 4;
  EXPECT_FALSE(make_actuator(config));
}

TEST(Actuators, RigidOnesLeaveTheirInertiaToTheModel) {
  EXPECT_EQ(armature(motor("coman", 0)), 0.1387);
  EXPECT_EQ(armature(motor("coman", 1)), 0.1387);
  EXPECT_EQ(armature(motor("coman", 2)), 0.0);
  EXPECT_EQ(armature(motor("coman", 3)), 0.0);
}

}  // namespace
}  // namespace tandem::sim
