// The loop is one linear map from a period's state to the next one's. Its matrix is found by
// applying it to unit vectors.
#include "apps/robot/ringing_loops.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>
#include <vector>

#include "apps/robot/start_torque.hpp"
#include "firmware_emu/setup.hpp"
#include "model/interpreted_kernels.hpp"

namespace tandem::apps {
namespace {

/// A loop that grows by less in a period may be held by what is not looked at: friction, the
/// ground.
constexpr double kGrows = 1.02;

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

/// Motor and link (of a rigid drive: the link twice), and the voltage, which is held.
enum Physics : Eigen::Index { kMotor, kMotorRate, kLink, kLinkRate, kVoltage, kPhysics };
/// What the board remembers: the last samples, and the filtered rates.
enum Memory : Eigen::Index {
  kLastMotor = kPhysics,
  kLastLink,
  kLastTorque,
  kMotorEstimate,
  kLinkEstimate,
  kTorqueEstimate,
  kStates
};

/// Over a period, with the voltage held.
Eigen::MatrixXd physics_of(const hal::ActuatorConfig& a, double inertia, double period_s) {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(kPhysics, kPhysics);
  const double per_V = a.gear_ratio * a.torque_constant_Nm_A / a.resistance_ohm;
  A(kMotor, kMotorRate) = A(kLink, kLinkRate) = 1.0;
  if (a.order < 2) {
    for (const Eigen::Index rate : {kMotorRate, kLinkRate}) {
      A(rate, rate) = -a.damping_Nms_rad / inertia;
      A(rate, kVoltage) = per_V / inertia;
    }
    return exponential(A * period_s);
  }
  A(kMotorRate, kVoltage) = per_V / a.inertia_kg_m2;
  A(kMotorRate, kMotorRate) = -a.damping_Nms_rad / a.inertia_kg_m2;
  for (const auto& [position, rate, sign] :
       {std::tuple{kMotor, kMotorRate, -1.0}, std::tuple{kLink, kLinkRate, 1.0}}) {
    A(kMotorRate, position) += sign * a.spring_Nm_rad / a.inertia_kg_m2;
    A(kMotorRate, rate) += sign * a.spring_damping_Nms_rad / a.inertia_kg_m2;
    A(kLinkRate, position) -= sign * a.spring_Nm_rad / inertia;
    A(kLinkRate, rate) -= sign * a.spring_damping_Nms_rad / inertia;
  }
  return exponential(A * period_s);
}

/// What the board does with a sample: firmware_emu/joint_controller.cpp with a reference of 0.
void sample(const hal::ActuatorConfig& a, const hal::GainsConfig& g, double period_s,
            Eigen::VectorXd& x) {
  const auto estimate = [&](Eigen::Index rate, Eigen::Index last, double now, double cutoff_Hz) {
    const double decay = std::exp(-2.0 * std::numbers::pi * cutoff_Hz * period_s);
    x(rate) = decay * x(rate) + (1.0 - decay) * (now - x(last)) / period_s;
    x(last) = now;
  };
  const firmware::AxisSetup board;
  const bool elastic = a.order >= 2;
  const double torque_Nm = elastic ? a.spring_Nm_rad * (x(kMotor) - x(kLink)) : 0.0;
  estimate(kMotorEstimate, kLastMotor, x(kMotor), board.motor_velocity_cutoff_Hz);
  estimate(kLinkEstimate, kLastLink, x(kLink), board.link_velocity_cutoff_Hz);
  estimate(kTorqueEstimate, kLastTorque, torque_Nm, board.torque_rate_cutoff_Hz);
  const bool of_motor = g.position_feedback == hal::PositionFeedback::kMotor;
  const double reference_Nm = -g.position.gains.kp * x(of_motor ? kMotor : kLink) -
                              g.position.gains.kd * x(of_motor ? kMotorEstimate : kLinkEstimate);
  const double constant = a.gear_ratio * a.torque_constant_Nm_A;
  x(kVoltage) = g.torque_feedforward * a.resistance_ohm / constant * reference_Nm +
                g.emf_compensation * constant * x(kMotorEstimate);
  if (elastic) {  // a rigid drive has no torque loop, but a current loop
    x(kVoltage) +=
        g.torque.gains.kp * (reference_Nm - torque_Nm) - g.torque.gains.kd * x(kTorqueEstimate);
  }
}

struct Ringing {
  const hal::JointConfig* joint;
  double growth = 0.0;
  double period_s = 0.0;
};

std::vector<Ringing> joints_that_ring(const RobotFiles& robot, const hal::PostureConfig* posture) {
  auto mechanism = model::make_mechanism(robot.tree, robot.spec, model::Frames::kAsDescribed);
  if (!mechanism) return {};  // is said when the kernels are made
  const model::InterpretedKernels kernels(std::move(*mechanism), robot.config.name);
  const tandem_kernels& k = *kernels.get();
  const std::vector<double> q = coordinates_at(robot.config, k, posture);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> M(k.nv, k.nv);
  k.mass_matrix(q.data(), M.data());
  const Eigen::MatrixXd mobility = M.inverse();
  std::vector<Ringing> ringing;
  for (std::size_t i = 0; i < k.joints; ++i) {
    const int index = robot.config.joint_index(k.joint_names[i]);
    if (index < 0) continue;
    const hal::JointConfig& joint = robot.config.joints[static_cast<std::size_t>(index)];
    const hal::BoardConfig* board = robot.config.board(joint.board);
    if (board == nullptr || !board->eds.empty()) continue;
    const auto row = static_cast<Eigen::Index>(k.nv - k.joints + i);
    const double period_s = static_cast<double>(board->control_period_ns) * 1e-9;
    double growth = std::numeric_limits<double>::infinity();
    for (const double inertia : {M(row, row), 1.0 / mobility(row, row)}) {
      growth = std::min(growth, loop_growth(robot.config.actuator_of(joint),
                                            robot.config.gains_of(joint), inertia, period_s));
    }
    if (growth > kGrows) ringing.push_back({&joint, growth, period_s});
  }
  return ringing;
}

}  // namespace

double loop_growth(const hal::ActuatorConfig& actuator, const hal::GainsConfig& gains,
                   double inertia_kg_m2, double period_s) {
  const Eigen::MatrixXd physics = physics_of(actuator, inertia_kg_m2, period_s);
  Eigen::MatrixXd step = Eigen::MatrixXd::Identity(kStates, kStates);
  for (Eigen::Index i = 0; i < kStates; ++i) {
    Eigen::VectorXd x = step.col(i);
    sample(actuator, gains, period_s, x);
    x.head(kPhysics) = (physics * x.head(kPhysics)).eval();
    step.col(i) = x;
  }
  return step.eigenvalues().cwiseAbs().maxCoeff();
}

std::optional<Error> ringing_loops(const RobotFiles& robot, const std::string& posture) {
  const hal::PostureConfig* start = robot.config.posture(posture);
  if (start == nullptr && !posture.empty()) return {};  // has been said elsewhere
  if (!robot.config.loops.empty()) return {};
  const std::vector<Ringing> ringing = joints_that_ring(robot, start);
  if (ringing.empty()) return {};
  const Ringing& worst = *std::ranges::max_element(ringing, {}, &Ringing::growth);
  return Error{
      .message = fmt::format(
          "with these gains and a control period of {:g} ms the position loop "
          "will probably oscillate (error code FF03): it grows by {:.3g} in "
          "each period{}",
          worst.period_s * 1e3, worst.growth,
          ringing.size() == 1 ? "" : fmt::format("; so will {} more", ringing.size() - 1)),
      .hint = "shorten its board's control_period_ns, or lower the gains (docs/firmware.md)",
      .file = robot.config.file,
      .line = worst.joint->line,
      .key = "joint." + worst.joint->name + ".gains"};
}

}  // namespace tandem::apps
