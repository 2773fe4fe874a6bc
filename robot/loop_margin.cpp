// A loop is one linear map from a period's state to the next one's. Its matrices are found by
// applying it to unit vectors: closed for its eigenvalues, opened for its frequency response.
#include "robot/loop_margin.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>
#include <tuple>
#include <vector>

#include "firmware_emu/setup.hpp"

namespace tandem::robot {
namespace {

using Complex = std::complex<double>;

/// exp(A), by squaring the series of a small part of it.
Eigen::MatrixXd exponential(Eigen::MatrixXd A) {
  int halvings = 0;
  for (; A.lpNorm<Eigen::Infinity>() > 0.25; ++halvings) A /= 2.0;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Identity(A.rows(), A.cols()), term = sum;
  for (int k = 1; k < 14; ++k) {
    term = term * A / k;
    sum += term;
  }
  for (; halvings > 0; --halvings) sum = sum * sum;
  return sum;
}

/// Motor and link (of a rigid drive: the link twice), the winding's current where it is a state,
/// and the voltage, which is held.
enum Physics : Eigen::Index { kMotor, kMotorRate, kLink, kLinkRate, kCurrent, kVoltage, kPhysics };
/// What the board remembers: the last samples, the filtered rates, and the integrals.
enum Memory : Eigen::Index {
  kLastMotor = kPhysics,
  kLastLink,
  kLastTorque,
  kMotorEstimate,
  kLinkEstimate,
  kTorqueEstimate,
  kOuterSum,
  kInnerSum,
  kStates
};

/// The motor's constants as hal/sim/actuator.hpp derives them: D is friction and back-EMF together.
struct Motor {
  explicit Motor(const hal::ActuatorConfig& a)
      : torque_per_A(a.torque_per_A()),
        back_emf(std::min(torque_per_A, a.damping_Nms_rad * a.resistance_ohm / torque_per_A)),
        friction(std::max(0.0, a.damping_Nms_rad - torque_per_A * back_emf / a.resistance_ohm)),
        resistance(a.resistance_ohm),
        current_is_state((a.order & 1) != 0),
        elastic(a.order >= 2) {}

  /// The motor's current in a state of the physics.
  [[nodiscard]] double current(const Eigen::VectorXd& x) const {
    return current_is_state ? x(kCurrent) : (x(kVoltage) - back_emf * x(kMotorRate)) / resistance;
  }

  double torque_per_A, back_emf, friction, resistance;
  bool current_is_state, elastic;
};

/// What the torque sensor shows: the spring's torque, or a rigid drive's own.
double torque_of(const hal::ActuatorConfig& a, const Motor& motor, const Eigen::VectorXd& x) {
  if (!motor.elastic) {
    return motor.torque_per_A * motor.current(x) - motor.friction * x(kMotorRate);
  }
  return a.spring_Nm_rad * (x(kMotor) - x(kLink)) +
         a.spring_damping_Nms_rad * (x(kMotorRate) - x(kLinkRate));
}

/// Over a period, with the voltage held.
Eigen::MatrixXd physics_of(const hal::ActuatorConfig& a, double inertia, double period_s) {
  const Motor motor(a);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(kPhysics, kPhysics);
  for (Eigen::Index i = 0; i < kPhysics; ++i) {
    const Eigen::VectorXd x = Eigen::VectorXd::Unit(kPhysics, i);
    const double drive_Nm = motor.torque_per_A * motor.current(x) - motor.friction * x(kMotorRate);
    const double link_Nm = torque_of(a, motor, x);
    A(kMotor, i) = x(kMotorRate);
    A(kLink, i) = x(kLinkRate);
    A(kLinkRate, i) = link_Nm / inertia;
    A(kMotorRate, i) = motor.elastic ? (drive_Nm - link_Nm) / a.inertia_kg_m2 : link_Nm / inertia;
    if (motor.current_is_state) {
      A(kCurrent, i) =
          (x(kVoltage) - motor.resistance * x(kCurrent) - motor.back_emf * x(kMotorRate)) /
          a.inductance_H;
    }
  }
  return exponential(A * period_s);
}

/// What the board does with a sample: firmware_emu/joint_controller.cpp with a reference of 0.
///
/// @param open  what stands for the output of the judged loop; empty: the output itself
/// @return that output
double sample(const LoopPlant& plant, Eigen::VectorXd& x, std::optional<double> open = {}) {
  const hal::ActuatorConfig& a = plant.actuator;
  const hal::GainsConfig& g = plant.gains;
  const Motor motor(a);
  const firmware::AxisSetup board;
  const auto estimate = [&](Eigen::Index rate, Eigen::Index last, double now, double cutoff_Hz) {
    const double decay = std::exp(-2.0 * std::numbers::pi * cutoff_Hz * plant.period_s);
    x(rate) = decay * x(rate) + (1.0 - decay) * (now - x(last)) / plant.period_s;
    x(last) = now;
  };
  const auto integrate = [&](Eigen::Index sum, double ki, double error) {
    x(sum) += ki * error * plant.period_s;
  };
  const double torque_Nm = torque_of(a, motor, x);
  const double link_rate_before = x(kLinkEstimate);
  estimate(kMotorEstimate, kLastMotor, x(kMotor), board.parameters.motor_velocity_cutoff_Hz);
  estimate(kLinkEstimate, kLastLink, x(kLink), board.parameters.link_velocity_cutoff_Hz);
  estimate(kTorqueEstimate, kLastTorque, torque_Nm, board.parameters.torque_rate_cutoff_Hz);

  double reference_Nm = 0.0;
  const bool of_motor = g.position_feedback == hal::PositionFeedback::kMotor;
  if (plant.loop == hal::PidLoop::kPosition) {
    reference_Nm = x(kOuterSum) - g.position.gains.kp * x(of_motor ? kMotor : kLink) -
                   g.position.gains.kd * x(of_motor ? kMotorEstimate : kLinkEstimate);
    integrate(kOuterSum, g.position.gains.ki, -x(kLink));
  } else if (plant.loop == hal::PidLoop::kVelocity) {
    const double acceleration = (x(kLinkEstimate) - link_rate_before) / plant.period_s;
    reference_Nm =
        x(kOuterSum) - g.velocity.gains.kp * x(kLinkEstimate) - g.velocity.gains.kd * acceleration;
    integrate(kOuterSum, g.velocity.gains.ki, -x(kLinkEstimate));
  }
  const bool opens_torque = plant.loop == hal::PidLoop::kTorque;
  const double outer_Nm = opens_torque ? reference_Nm : open.value_or(reference_Nm);
  const double error_Nm = outer_Nm - torque_Nm;
  const double inner_V =
      g.torque.gains.kp * error_Nm + x(kInnerSum) - g.torque.gains.kd * x(kTorqueEstimate);
  integrate(kInnerSum, g.torque.gains.ki, error_Nm);
  x(kVoltage) = g.torque_feedforward * a.resistance_ohm / motor.torque_per_A * outer_Nm +
                g.emf_compensation * motor.torque_per_A * x(kMotorEstimate) +
                (opens_torque ? open.value_or(inner_V) : inner_V);
  return opens_torque ? inner_V : reference_Nm;
}

/// The loop opened at its output: x' = A x + B u, y = C x, and it is closed by u = y. Nothing
/// passes from u to y within one sample.
struct Opened {
  Eigen::MatrixXd A;
  Eigen::VectorXd B;
  Eigen::RowVectorXd C;

  Opened(const LoopPlant& plant, double inertia_kg_m2)
      : A(kStates, kStates), B(kStates), C(kStates) {
    const Eigen::MatrixXd physics = physics_of(plant.actuator, inertia_kg_m2, plant.period_s);
    for (Eigen::Index i = 0; i <= kStates; ++i) {
      const bool input = i == kStates;
      Eigen::VectorXd x = Eigen::VectorXd::Zero(kStates);
      if (!input) x(i) = 1.0;
      const double output = sample(plant, x, input ? 1.0 : 0.0);
      x.head(kPhysics) = (physics * x.head(kPhysics)).eval();
      if (input) {
        B = x;
      } else {
        A.col(i) = x;
        C(i) = output;
      }
    }
  }

  /// y / u at a frequency: the negative of the loop gain.
  [[nodiscard]] Complex response(double angle) const {
    const Eigen::MatrixXcd M =
        std::polar(1.0, angle) * Eigen::MatrixXcd::Identity(kStates, kStates) - A.cast<Complex>();
    return (C.cast<Complex>() * M.partialPivLu().solve(B.cast<Complex>()))(0);
  }

  [[nodiscard]] double growth() const { return (A + B * C).eigenvalues().cwiseAbs().maxCoeff(); }
};

/// Angles per period at which to look: evenly by their logarithm, and about each resonance.
std::vector<double> angles_of(const Opened& loop, double period_s) {
  constexpr int kPoints = 300;
  const double low = 0.01 * period_s;
  std::vector<double> angles;
  for (int i = 0; i <= kPoints; ++i) {
    angles.push_back(low * std::pow(std::numbers::pi / low, static_cast<double>(i) / kPoints));
  }
  for (const Complex& root : loop.A.eigenvalues()) {
    const double angle = std::arg(root);
    for (const double factor : {0.97, 0.99, 1.0, 1.01, 1.03}) {
      const double at = angle * factor;
      if (at > low && at < std::numbers::pi) angles.push_back(at);
    }
  }
  std::ranges::sort(angles);
  return angles;
}

/// The least distance in phase from -1 where the loop gain passes 1, and where that is.
void find_margin(const Opened& loop, LoopVerdict& verdict) {
  double before_angle = 0.0, before = 0.0;
  for (const double angle : angles_of(loop, verdict.period_s)) {
    const double gain = std::log(std::abs(loop.response(angle)));
    if (before_angle > 0.0 && (gain > 0.0) != (before > 0.0)) {
      const double share = before / (before - gain);
      const double at = before_angle * std::pow(angle / before_angle, share);
      const double margin = std::abs(std::arg(loop.response(at))) * 180.0 / std::numbers::pi;
      if (!(margin >= verdict.phase_margin_deg)) {
        verdict.phase_margin_deg = margin;
        verdict.crossover_rad_s = at / verdict.period_s;
      }
    }
    before_angle = angle;
    before = gain;
  }
}

}  // namespace

bool LoopVerdict::stable() const {
  constexpr double kGrows_per_s = 0.1;
  return std::log(growth) <= kGrows_per_s * period_s;
}

bool LoopVerdict::worse_than(const LoopVerdict& other) const {
  if (!stable() || !other.stable()) return growth > other.growth;
  return phase_margin_deg < other.phase_margin_deg || std::isnan(other.phase_margin_deg);
}

LoopVerdict judge_loop(const LoopPlant& plant, std::span<const double> inertias_kg_m2,
                       bool with_margin) {
  std::optional<LoopVerdict> worst;
  for (const double inertia_kg_m2 : inertias_kg_m2) {
    const Opened loop(plant, inertia_kg_m2);
    LoopVerdict verdict{.loop = plant.loop,
                        .inertia_kg_m2 = inertia_kg_m2,
                        .growth = loop.growth(),
                        .period_s = plant.period_s};
    if (with_margin && verdict.stable()) find_margin(loop, verdict);
    if (!worst || verdict.worse_than(*worst)) worst = verdict;
  }
  return *worst;
}

}  // namespace tandem::robot
