// Linearises springs, dampers and ground at the start posture, and bisects for the step u at which
// the largest eigenvalue of M^-1 (u^2 K + u D) is 1.
#include "hal/sim/stability.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "model/symmetric_eigen.hpp"

namespace tandem::sim {
namespace {

using Matrix = Eigen::MatrixXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Coordinates: the model's velocities, then one motor per joint.
struct Linear {
  explicit Linear(Eigen::Index size)
      : M(Matrix::Identity(size, size)), D(Matrix::Zero(size, size)), K(Matrix::Zero(size, size)) {}
  Matrix M, D, K;
};

void add_joints(const PlantConfig& config, const Plant& plant, Linear& to) {
  const Eigen::Index nv = plant.kernels().nv, n = plant.kernels().joints, base = nv - n;
  for (std::size_t j = 0; j < plant.joints(); ++j) {
    const auto i = static_cast<Eigen::Index>(plant.model_index(j));
    const ActuatorModel& m = plant.actuators().model(plant.model_index(j));
    const double motor_damping =
        m.friction_Nms_rad + m.torque_per_A * m.back_emf_Vs_rad / m.resistance_ohm;
    const Eigen::Index link = base + i, rotor = nv + i;
    const double dampers = plant.predicts(plant.model_index(j)) ? kPredictedDamper : 1.0;
    to.D(link, link) += dampers * config.joints[j].damping_Nms_rad;
    if (!m.elastic()) {
      to.D(link, link) += dampers * motor_damping;
      continue;
    }
    to.M(rotor, rotor) = m.inertia_kg_m2;
    to.D(rotor, rotor) += motor_damping;
    for (const auto& [matrix, value] : {std::pair{&to.K, m.spring_Nm_rad},
                                        std::pair{&to.D, dampers * m.spring_damping_Nms_rad}}) {
      (*matrix)(link, link) += value;
      (*matrix)(rotor, rotor) += value;
      (*matrix)(link, rotor) -= value;
      (*matrix)(rotor, link) -= value;
    }
  }
}

void add_passive(const PlantConfig& config, const Plant& plant, Linear& to) {
  const Eigen::Index base = plant.kernels().nv - plant.kernels().joints;
  for (std::size_t j = 0; j < config.passive.size(); ++j) {
    const Eigen::Index link = base + static_cast<Eigen::Index>(plant.passive()[j]);
    const double dampers = plant.predicts(plant.passive()[j]) ? kPredictedDamper : 1.0;
    to.D(link, link) += dampers * config.passive[j].damping_Nms_rad;
  }
}

void add_ground(const PlantConfig& config, const Plant& plant, Linear& to) {
  const tandem_kernels& k = plant.kernels();
  const Eigen::Index nv = k.nv;
  if (plant.contact().points() == 0) return;
  RowMajor J(6 * k.sites, nv);
  k.site_jacobians(plant.q(), J.data());
  std::vector<double> pose(12 * k.sites), twist(6 * k.sites), acceleration(6 * k.sites);
  k.site_motion(plant.q(), plant.v(), plant.vdot(), pose.data(), twist.data(), acceleration.data());
  const hal::ContactConfig& c = config.contact;
  const double gravity = std::hypot(k.gravity_m_s2[0], k.gravity_m_s2[1], k.gravity_m_s2[2]);
  const double per_point_N =
      plant.added().mass_kg() * gravity / static_cast<double>(plant.contact().points());
  const Eigen::Vector3d spring(c.tangential_stiffness_N_m, c.tangential_stiffness_N_m,
                               c.stiffness_N_m);
  const Eigen::Vector3d damper(c.tangential_damping_Ns_m, c.tangential_damping_Ns_m,
                               c.damping_s_m * per_point_N);
  for (std::size_t f = 0; f < c.feet.size(); ++f) {
    const auto site = static_cast<Eigen::Index>(plant.contact().site(f));
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(pose.data() + 12 * site);
    for (const std::array<double, 3>& point : c.feet[f].points_m) {
      const Eigen::Vector3d lever = R * Eigen::Vector3d(point[0], point[1], point[2]);
      Eigen::Matrix3d turn;  // w -> w x lever
      turn << 0, lever.z(), -lever.y(), -lever.z(), 0, lever.x(), lever.y(), -lever.x(), 0;
      const Matrix Jp = J.middleRows(6 * site, 3) + turn * J.middleRows(6 * site + 3, 3);
      to.K.topLeftCorner(nv, nv) += Jp.transpose() * spring.asDiagonal() * Jp;
      to.D.topLeftCorner(nv, nv) += Jp.transpose() * damper.asDiagonal() * Jp;
    }
  }
}

std::string place_of(const tandem_kernels& k, Eigen::Index index) {
  const Eigen::Index nv = k.nv, base = nv - k.joints;
  if (index < base) return "the floating base";
  const bool rotor = index >= nv;
  const char* joint = k.joint_names[rotor ? index - nv : index - base];
  return (rotor ? "the motor of joint " : "joint ") + std::string(joint);
}

/// A current's own time, L / R. The leapfrog takes it exactly; in longer steps of Runge-Kutta's
/// it grew to its limit and stayed there, at any voltage.
StepLimit shortest_current(const PlantConfig& config, const Plant& plant) {
  StepLimit limit{std::numeric_limits<double>::infinity(), {}};
  if (config.integrator != Integrator::kRungeKutta4) return limit;
  for (std::size_t j = 0; j < plant.joints(); ++j) {
    const ActuatorModel& m = plant.actuators().model(plant.model_index(j));
    const double seconds = step_stretch(config.integrator) * m.inductance_H / m.resistance_ohm;
    if (!m.current_is_state() || seconds >= limit.seconds) continue;
    limit = {seconds, "the current of joint " + config.joints[j].name};
  }
  return limit;
}

}  // namespace

StepLimit longest_step(const PlantConfig& config, const Plant& plant) {
  const tandem_kernels& k = plant.kernels();
  Linear system(k.nv + k.joints);
  RowMajor M(k.nv, k.nv);
  k.mass_matrix(plant.q(), M.data());
  AddedInertia added = plant.added();
  added.let_go();  // what is carried makes nothing stiffer
  added.add_to_mass_matrix(plant.q(), M.data());
  system.M.topLeftCorner(k.nv, k.nv) = M;
  add_joints(config, plant, system);
  add_passive(config, plant, system);
  add_ground(config, plant, system);
  const StepLimit electrical = shortest_current(config, plant);
  if (system.K.isZero(0.0) && system.D.isZero(0.0)) return electrical;
  // With x = L^-T y the mass is the identity, and the largest eigenvalue grows with u.
  const Eigen::LLT<Matrix> L(system.M);
  const auto scaled = [&](const Matrix& A) -> Matrix {
    return L.matrixL().solve(L.matrixL().solve(A).transpose());
  };
  const Matrix K = scaled(system.K), D = scaled(system.D);
  double low = 0.0, high = 1.0;
  for (int halving = 0; halving < 60 && high - low > 1e-3 * high; ++halving) {
    const double u = low > 0.0 ? 0.5 * (low + high) : 0.1 * high;
    const Matrix A = u * u * K + u * D;
    (model::symmetric_eigenvalues(A).maxCoeff() < 1.0 ? low : high) = u;
  }
  const Matrix modes = model::symmetric_eigen(high * high * K + high * D).vectors;
  const Eigen::VectorXd mode = L.matrixU().solve(modes.rightCols(1));
  Eigen::Index most = 0;
  mode.cwiseAbs().maxCoeff(&most);
  const double mechanical_s = step_stretch(config.integrator) * low;
  return electrical.seconds < mechanical_s ? electrical
                                           : StepLimit{mechanical_s, place_of(k, most)};
}

}  // namespace tandem::sim
