// A biped of point masses with hand-written kernels: the smallest robot that can squat.
// Dynamics are static (velocity products are left out), kinematics are exact.
// Layer: tests.  Thread: any.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <string>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "model/kernels.h"
#include "tests/support/at_sines.hpp"

namespace tandem::test {

struct BipedBody {
  const char* joint;
  int parent;          ///< body; 0 is the base
  Eigen::Vector3d at;  ///< the joint in the parent's frame
  Eigen::Vector3d axis;
  double mass_kg;
  Eigen::Vector3d com;  ///< in the body's own frame
};

inline constexpr int kBipedJoints = 14;
inline constexpr int kBipedNv = 6 + kBipedJoints;
inline constexpr double kBipedMass = 52.0;

/// Body i + 1 hangs on joint i. Two legs of thigh 0.4 m and shank 0.4 m, two arms.
inline const std::array<BipedBody, kBipedJoints>& biped_bodies() {
  const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  static const std::array<BipedBody, kBipedJoints> bodies{{
      {"LArm", 0, {0, 0.2, 0.5}, y, 2.0, {0, 0, -0.3}},
      {"LHipYaw", 0, {0, 0.1, 0}, z, 0.5, {0, 0, 0}},
      {"LHipLat", 2, {0, 0, 0}, x, 0.5, {0, 0, 0}},
      {"LHipSag", 3, {0, 0, 0}, y, 5.0, {0.02, 0, -0.2}},
      {"LKneeSag", 4, {0, 0, -0.4}, y, 3.0, {0, 0, -0.2}},
      {"LAnkSag", 5, {0, 0, -0.4}, y, 0.5, {0, 0, 0}},
      {"LAnkLat", 6, {0, 0, 0}, x, 1.5, {0.03, 0, -0.04}},
      {"RArm", 0, {0, -0.2, 0.5}, y, 2.0, {0, 0, -0.3}},
      {"RHipYaw", 0, {0, -0.1, 0}, z, 0.5, {0, 0, 0}},
      {"RHipLat", 9, {0, 0, 0}, x, 0.5, {0, 0, 0}},
      {"RHipSag", 10, {0, 0, 0}, y, 5.0, {0.02, 0, -0.2}},
      {"RKneeSag", 11, {0, 0, -0.4}, y, 3.0, {0, 0, -0.2}},
      {"RAnkSag", 12, {0, 0, -0.4}, y, 0.5, {0, 0, 0}},
      {"RAnkLat", 13, {0, 0, 0}, x, 1.5, {0.03, 0, -0.04}},
  }};
  return bodies;
}
inline constexpr double kBipedBaseMass = 26.0;
inline constexpr std::array<int, 2> kBipedFeet{7, 14};  // bodies; the sole is 0.08 m below

/// Where every body stands, and the Jacobian of a point on one.
class BipedPose {
 public:
  explicit BipedPose(const double* q) {
    R[0] = Eigen::Quaterniond(q[6], q[3], q[4], q[5]).toRotationMatrix();
    p[0] = {q[0], q[1], q[2]};
    for (std::size_t i = 0; i < kBipedJoints; ++i) {
      const BipedBody& body = biped_bodies()[i];
      const auto parent = static_cast<std::size_t>(body.parent);
      p[i + 1] = p[parent] + R[parent] * body.at;
      R[i + 1] = R[parent] * Eigen::AngleAxisd(q[7 + i], body.axis).toRotationMatrix();
    }
  }
  /// (6 x nv): linear then angular velocity in W of `point` on `body`, from v.
  using Jacobian = Eigen::Matrix<double, 6, kBipedNv>;
  [[nodiscard]] Jacobian jacobian(int body, const Eigen::Vector3d& point) const {
    Jacobian J = Jacobian::Zero();
    J.block<3, 3>(0, 0) = R[0];
    J.block<3, 3>(3, 3) = R[0];
    for (int k = 0; k < 3; ++k) {
      J.block<3, 1>(0, 3 + k) = R[0].col(k).cross(point - p[0]);
    }
    for (int b = body; b != 0; b = biped_bodies()[static_cast<std::size_t>(b - 1)].parent) {
      const auto i = static_cast<std::size_t>(b);
      const Eigen::Vector3d axis = R[i] * biped_bodies()[i - 1].axis;
      J.block<3, 1>(0, 5 + b) = axis.cross(point - p[i]);
      J.block<3, 1>(3, 5 + b) = axis;
    }
    return J;
  }
  [[nodiscard]] Eigen::Vector3d com_of(int body) const {
    const auto i = static_cast<std::size_t>(body);
    if (body == 0) return p[0] + R[0] * Eigen::Vector3d(-0.02, 0, 0.25);
    return p[i] + R[i] * biped_bodies()[i - 1].com;
  }
  [[nodiscard]] static double mass_of(int body) {
    return body == 0 ? kBipedBaseMass : biped_bodies()[static_cast<std::size_t>(body - 1)].mass_kg;
  }
  [[nodiscard]] Eigen::Vector3d sole(int foot) const {
    const auto i = static_cast<std::size_t>(kBipedFeet[static_cast<std::size_t>(foot)]);
    return p[i] + R[i] * Eigen::Vector3d(0, 0, -0.08);
  }
  std::array<Eigen::Matrix3d, kBipedJoints + 1> R;
  std::array<Eigen::Vector3d, kBipedJoints + 1> p;
};

inline void biped_site_motion(const double* q, const double*, const double*, double* pose,
                              double* twist, double* acceleration) {
  const BipedPose at(q);
  for (int foot = 0; foot < 2; ++foot) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(pose + 12 * foot) =
        at.R[static_cast<std::size_t>(kBipedFeet[static_cast<std::size_t>(foot)])];
    Eigen::Map<Eigen::Vector3d>(pose + 12 * foot + 9) = at.sole(foot);
  }
  std::fill(twist, twist + 12, 0.0);
  std::fill(acceleration, acceleration + 12, 0.0);
}

template <int kRows>
using BipedRows = Eigen::Matrix<double, kRows, kBipedNv, Eigen::RowMajor>;
using BipedVector = Eigen::Matrix<double, kBipedNv, 1>;

inline void biped_site_jacobians(const double* q, double* J) {
  const BipedPose at(q);
  for (int foot = 0; foot < 2; ++foot) {
    Eigen::Map<BipedRows<6>>(J + 6 * kBipedNv * foot) =
        at.jacobian(kBipedFeet[static_cast<std::size_t>(foot)], at.sole(foot));
  }
}

inline void biped_center_of_mass(const double* q, const double* v, double* c, double* cdot,
                                 double* J) {
  const BipedPose at(q);
  Eigen::Vector3d com = Eigen::Vector3d::Zero();
  BipedRows<3> jacobian = BipedRows<3>::Zero();
  for (int body = 0; body <= kBipedJoints; ++body) {
    const double share = BipedPose::mass_of(body) / kBipedMass;
    com += share * at.com_of(body);
    jacobian += share * at.jacobian(body, at.com_of(body)).topRows<3>();
  }
  Eigen::Map<Eigen::Vector3d>{c} = com;
  Eigen::Map<BipedRows<3>>{J} = jacobian;
  Eigen::Map<Eigen::Vector3d>{cdot} = jacobian * Eigen::Map<const BipedVector>(v);
}

/// Generalised forces of the point masses' weight and acceleration, less those of the wrenches.
inline void biped_inverse_dynamics(const double* q, const double*, const double* vdot,
                                   const double* wrench, double* tau) {
  const BipedPose at(q);
  const Eigen::Map<const BipedVector> a(vdot);
  BipedVector sum = BipedVector::Zero();
  for (int body = 0; body <= kBipedJoints; ++body) {
    const Eigen::Matrix<double, 3, kBipedNv> J = at.jacobian(body, at.com_of(body)).topRows<3>();
    const Eigen::Vector3d force = BipedPose::mass_of(body) * (J * a + Eigen::Vector3d(0, 0, 9.81));
    sum += J.transpose() * force;
  }
  for (int foot = 0; foot < 2; ++foot) {
    const int body = kBipedFeet[static_cast<std::size_t>(foot)];
    const Eigen::Matrix3d& R = at.R[static_cast<std::size_t>(body)];
    Eigen::Matrix<double, 6, 1> f;
    f << R * Eigen::Map<const Eigen::Vector3d>(wrench + 6 * foot),
        R * Eigen::Map<const Eigen::Vector3d>(wrench + 6 * foot + 3);
    sum -= at.jacobian(body, at.sole(foot)).transpose() * f;
  }
  Eigen::Map<BipedVector>{tau} = sum;
}

inline void biped_site_twists(const double* q, const double* v, double* pose, double* twist) {
  double acceleration[12];
  biped_site_motion(q, v, nullptr, pose, twist, acceleration);
}

inline void biped_bias(const double* q, const double* v, double* h) {
  const std::array<double, kBipedNv> rest{};
  const std::array<double, 12> free{};
  biped_inverse_dynamics(q, v, rest.data(), free.data(), h);
}

inline const tandem_kernels* biped_kernels() {
  static const std::vector<const char*> joints = [] {
    std::vector<const char*> names;
    for (const BipedBody& body : biped_bodies()) names.push_back(body.joint);
    return names;
  }();
  static const std::array<const char*, 2> soles{"l_sole", "r_sole"};
  static const tandem_kernels kernels = [] {
    tandem_kernels k{};
    k.sines = no_sines;
    k.abi = TANDEM_KERNELS_ABI;
    k.floating_base = 1;
    k.robot = "biped";
    k.nq = 7 + kBipedJoints;
    k.nv = kBipedNv;
    k.joints = kBipedJoints;
    k.sites = 2;
    k.wrenches = 2;
    k.joint_names = joints.data();
    k.site_names = soles.data();
    k.wrench_names = soles.data();
    k.mass_kg = kBipedMass;
    k.site_motion = biped_site_motion;
    k.site_motion_at = at_sines<biped_site_motion>;
    k.site_twists_at = at_sines<biped_site_twists>;
    k.site_jacobians = biped_site_jacobians;
    k.site_jacobians_at = at_sines<biped_site_jacobians>;
    k.center_of_mass = biped_center_of_mass;
    k.center_of_mass_at = at_sines<biped_center_of_mass>;
    k.inverse_dynamics = biped_inverse_dynamics;
    k.inverse_dynamics_at = at_sines<biped_inverse_dynamics>;
    k.bias = biped_bias;
    k.bias_at = at_sines<biped_bias>;
    return k;
  }();
  return &kernels;
}

/// Its configuration: the joints stand in the reverse of the model's order.
inline hal::RobotConfig biped_robot() {
  hal::RobotConfig robot;
  robot.file = "biped/robot.toml";
  robot.name = "biped";
  robot.model.floating_base = true;
  robot.actuators.push_back({.name = "motor", .inertia_kg_m2 = 0.2});
  robot.actuators[0].current_limit_A = 50.0;
  robot.actuators[0].voltage_limit_V = 80.0;
  robot.gains.emplace_back().name = "leg";
  robot.gains[0].position.gains = {1000.0, 0.0, 50.0};
  robot.gains[0].stiffness_Nm_rad = 300.0;
  robot.gains[0].damping_Nms_rad = 20.0;
  hal::PostureConfig stand{{"stand", 0.8, {}}};
  for (auto body = biped_bodies().rbegin(); body != biped_bodies().rend(); ++body) {
    hal::JointConfig& joint = robot.joints.emplace_back();
    joint.name = body->joint;
    joint.actuator = "motor";
    joint.gains = "leg";
    joint.min_position_rad = -2.0;
    joint.max_position_rad = 2.0;
    joint.max_velocity_rad_s = 5.0;
    joint.max_torque_Nm = 200.0;
    const std::string name = joint.name.substr(1);
    stand.position_rad.push_back(name == "KneeSag"  ? 0.5
                                 : name == "HipSag" ? -0.25
                                 : name == "AnkSag" ? -0.25
                                                    : 0.0);
  }
  robot.postures.push_back(stand);
  for (const char* sole : {"l_sole", "r_sole"}) {
    robot.contact.feet.push_back(
        {sole, {{0.12, 0.05, 0}, {0.12, -0.05, 0}, {-0.06, -0.05, 0}, {-0.06, 0.05, 0}}});
  }
  return robot;
}

}  // namespace tandem::test
