// Kernels written by hand for bodies whose motion is known in closed form.
//
// Block: one floating rigid body, 10 kg, inertia (0.1, 0.2, 0.25) kg m2 about its base's origin.
//   sites 0 "left" (0, 0.1, -0.05), 1 "right" (0, -0.1, -0.05): take wrenches, axes as the base;
//   site 2 "imu" (0.05, 0.02, 0.1), turned by 90 degrees about x.
//   sensors 0 "left_ft", 1 "right_ft": 0.02 m above the soles, between block and massless sole.
//   Gravity is tilted by `tilt_deg` about -y, so that the ground is an incline falling to +x.
// Pendulum: fixed base, one joint about +y through W's origin, 2 kg at 0.5 m, hanging at q = 0;
//   site 0 "tip" at the mass, axes as the link; sensor 0 "root" at the joint, axes as the link.
#pragma once

#include <cmath>
#include <numbers>

#include "model/kernels.h"
#include "tests/support/at_sines.hpp"

namespace tandem::test {

inline constexpr double kG = 9.81;
inline constexpr double kBlockMass = 10.0;
inline constexpr double kBlockInertia[3] = {0.1, 0.2, 0.25};
inline constexpr double kPendulumMass = 2.0;
inline constexpr double kPendulumLength = 0.5;

/// Gravity of the block's world, tilted by a whole number of degrees.
template <int tilt_deg>
inline const double kTilted[3] = {kG* std::sin(tilt_deg* std::numbers::pi / 180.0), 0.0,
                                  -kG* std::cos(tilt_deg* std::numbers::pi / 180.0)};

/// The poses and twists of a `site_motion`.
template <void (*site_motion)(const double*, const double*, const double*, double*, double*,
                              double*)>
void site_twists(const double* q, const double* v, double* pose, double* twist) {
  const double rest[6] = {};
  double acceleration[18];
  site_motion(q, v, rest, pose, twist, acceleration);
}

namespace block {

inline constexpr double kSite[3][3] = {{0.0, 0.1, -0.05}, {0.0, -0.1, -0.05}, {0.05, 0.02, 0.1}};

inline void rotation(const double* q, double* R) {
  const double x = q[3], y = q[4], z = q[5], w = q[6];
  const double rows[9] = {
      1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
      2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
      2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
  for (int i = 0; i < 9; ++i) R[i] = rows[i];
}
inline void cross(const double* a, const double* b, double* out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}
inline void turn(const double* R, const double* v, double* out) {
  for (int i = 0; i < 3; ++i) out[i] = R[3 * i] * v[0] + R[3 * i + 1] * v[1] + R[3 * i + 2] * v[2];
}

// Force and moment on the block that are not M vdot, in its own frame.
template <int tilt_deg>
void load(const double* q, const double* v, const double* wrench, double* F, double* N) {
  double R[9];
  rotation(q, R);
  const double* w = v + 3;
  double coriolis[3], gyro[3];
  cross(w, v, coriolis);
  const double L[3] = {kBlockInertia[0] * w[0], kBlockInertia[1] * w[1], kBlockInertia[2] * w[2]};
  cross(w, L, gyro);
  for (int i = 0; i < 3; ++i) {
    const double g = R[i] * kTilted<tilt_deg>[0] + R[3 + i] * kTilted<tilt_deg>[1] +
                     R[6 + i] * kTilted<tilt_deg>[2];
    F[i] = kBlockMass * (g - coriolis[i]);
    N[i] = -gyro[i];
  }
  for (int s = 0; s < 2; ++s) {
    double lever[3];
    cross(kSite[s], wrench + 6 * s, lever);
    for (int i = 0; i < 3; ++i) {
      F[i] += wrench[6 * s + i];
      N[i] += wrench[6 * s + 3 + i] + lever[i];
    }
  }
}

template <int tilt_deg>
void forward_dynamics(const double* q, const double* v, const double* tau, const double* wrench,
                      double* vdot) {
  double F[3], N[3];
  load<tilt_deg>(q, v, wrench, F, N);
  for (int i = 0; i < 3; ++i) {
    vdot[i] = (tau[i] + F[i]) / kBlockMass;
    vdot[3 + i] = (tau[3 + i] + N[i]) / kBlockInertia[i];
  }
}

template <int tilt_deg>
void inverse_dynamics(const double* q, const double* v, const double* vdot, const double* wrench,
                      double* tau) {
  double F[3], N[3];
  load<tilt_deg>(q, v, wrench, F, N);
  for (int i = 0; i < 3; ++i) {
    tau[i] = kBlockMass * vdot[i] - F[i];
    tau[3 + i] = kBlockInertia[i] * vdot[3 + i] - N[i];
  }
}

inline void site_motion(const double* q, const double* v, const double* vdot, double* pose,
                        double* twist, double* acceleration) {
  double R[9];
  rotation(q, R);
  for (int s = 0; s < 3; ++s) {
    double* P = pose + 12 * s;
    for (int i = 0; i < 3; ++i) {  // site 2: x_site = x, y_site = z, z_site = -y of the base
      P[3 * i] = R[3 * i];
      P[3 * i + 1] = s == 2 ? R[3 * i + 2] : R[3 * i + 1];
      P[3 * i + 2] = s == 2 ? -R[3 * i + 1] : R[3 * i + 2];
    }
    double lever[3], rate[3], wv[3], wwr[3], wdr[3], linear[3];
    turn(R, kSite[s], lever);
    cross(v + 3, kSite[s], rate);
    cross(v + 3, v, wv);
    cross(v + 3, rate, wwr);
    cross(vdot + 3, kSite[s], wdr);
    for (int i = 0; i < 3; ++i) {
      P[9 + i] = q[i] + lever[i];
      linear[i] = vdot[i] + wv[i] + wwr[i] + wdr[i];
      rate[i] += v[i];
    }
    turn(R, rate, twist + 6 * s);
    turn(R, v + 3, twist + 6 * s + 3);
    turn(R, linear, acceleration + 6 * s);
    turn(R, vdot + 3, acceleration + 6 * s + 3);
  }
}

inline void sensor_wrenches(const double*, const double*, const double*, const double* wrench,
                            double* out) {
  for (int s = 0; s < 2; ++s) {
    const double lever[3] = {0.0, 0.0, -0.02};
    double moment[3];
    cross(lever, wrench + 6 * s, moment);
    for (int i = 0; i < 3; ++i) {
      out[6 * s + i] = wrench[6 * s + i];
      out[6 * s + 3 + i] = wrench[6 * s + 3 + i] + moment[i];
    }
  }
}

template <int tilt_deg>
void energy(const double* q, const double* v, double* out) {
  out[0] = out[1] = 0.0;
  for (int i = 0; i < 3; ++i) {
    out[0] += 0.5 * (kBlockMass * v[i] * v[i] + kBlockInertia[i] * v[3 + i] * v[3 + i]);
    out[1] -= kBlockMass * kTilted<tilt_deg>[i] * q[i];
  }
}

inline void center_of_mass(const double* q, const double* v, double* c, double* cdot, double*) {
  double R[9];
  rotation(q, R);
  turn(R, v, cdot);
  for (int i = 0; i < 3; ++i) c[i] = q[i];
}

inline void mass_matrix(const double*, double* M) {
  for (int i = 0; i < 36; ++i) M[i] = 0.0;
  for (int i = 0; i < 3; ++i) {
    M[7 * i] = kBlockMass;
    M[7 * (3 + i)] = kBlockInertia[i];
  }
}
/// Column by column: the twist that each unit velocity gives.
inline void site_jacobians(const double* q, double* J) {
  const double rest[6] = {};
  double pose[36], twist[18], acceleration[18];
  for (int column = 0; column < 6; ++column) {
    double v[6] = {};
    v[column] = 1.0;
    site_motion(q, v, rest, pose, twist, acceleration);
    for (int row = 0; row < 18; ++row) J[6 * row + column] = twist[row];
  }
}

inline constexpr const char* kSites[] = {"left", "right", "imu"};
inline constexpr const char* kSensors[] = {"left_ft", "right_ft"};

}  // namespace block

template <int tilt_deg = 0>
const tandem_kernels* block_kernels() {
  static const tandem_kernels kernels = [] {
    tandem_kernels k{};
    k.sines = no_sines;
    k.abi = TANDEM_KERNELS_ABI;
    k.floating_base = 1;
    k.robot = "block";
    k.nq = 7;
    k.nv = 6;
    k.sites = 3;
    k.wrenches = 2;
    k.sensors = 2;
    k.site_names = k.wrench_names = block::kSites;
    k.sensor_names = block::kSensors;
    k.mass_kg = kBlockMass;
    for (int i = 0; i < 3; ++i) k.gravity_m_s2[i] = kTilted<tilt_deg>[i];
    k.forward_dynamics = block::forward_dynamics<tilt_deg>;
    k.forward_dynamics_at = at_sines<block::forward_dynamics<tilt_deg>>;
    k.inverse_dynamics = block::inverse_dynamics<tilt_deg>;
    k.inverse_dynamics_at = at_sines<block::inverse_dynamics<tilt_deg>>;
    k.site_motion = block::site_motion;
    k.site_motion_at = at_sines<block::site_motion>;
    k.site_twists_at = at_sines<site_twists<block::site_motion>>;
    k.mass_matrix = block::mass_matrix;
    k.mass_matrix_at = at_sines<block::mass_matrix>;
    k.site_jacobians = block::site_jacobians;
    k.site_jacobians_at = at_sines<block::site_jacobians>;
    k.sensor_wrenches = block::sensor_wrenches;
    k.sensor_wrenches_at = at_sines<block::sensor_wrenches>;
    k.energy = block::energy<tilt_deg>;
    k.center_of_mass = block::center_of_mass;
    k.center_of_mass_at = at_sines<block::center_of_mass>;
    return k;
  }();
  return &kernels;
}

namespace pendulum {

inline constexpr double kInertia = kPendulumMass * kPendulumLength * kPendulumLength;

/// Armature in milli kg m2, gravity in cm/s2: both constants of the kernels, as generated ones are.
template <int armature_g, int gravity_cm>
void forward_dynamics(const double* q, const double*, const double* tau, const double*,
                      double* vdot) {
  const double weight = kPendulumMass * gravity_cm * 0.01 * kPendulumLength;
  vdot[0] = (tau[0] - weight * std::sin(q[0])) / (kInertia + armature_g * 1e-3);
}
template <int armature_g, int gravity_cm>
void inverse_dynamics(const double* q, const double*, const double* vdot, const double*,
                      double* tau) {
  const double weight = kPendulumMass * gravity_cm * 0.01 * kPendulumLength;
  tau[0] = (kInertia + armature_g * 1e-3) * vdot[0] + weight * std::sin(q[0]);
}
inline void site_motion(const double* q, const double* v, const double* vdot, double* pose,
                        double* twist, double* acceleration) {
  const double s = std::sin(q[0]), c = std::cos(q[0]), l = kPendulumLength;
  const double P[12] = {c, 0, s, 0, 1, 0, -s, 0, c, -l * s, 0, -l * c};
  const double T[6] = {-l * c * v[0], 0, l * s * v[0], 0, v[0], 0};
  const double a = vdot[0], w2 = v[0] * v[0];
  const double A[6] = {l * (s * w2 - c * a), 0, l * (c * w2 + s * a), 0, a, 0};
  for (int i = 0; i < 12; ++i) pose[i] = P[i];
  for (int i = 0; i < 6; ++i) twist[i] = T[i];
  for (int i = 0; i < 6; ++i) acceleration[i] = A[i];
}
template <int armature_g>
void mass_matrix(const double*, double* M) {
  M[0] = kInertia + armature_g * 1e-3;
}
inline void center_of_mass(const double* q, const double* v, double* c, double* cdot, double* J) {
  const double s = std::sin(q[0]), k = std::cos(q[0]), l = kPendulumLength;
  const double at[3] = {-l * s, 0, -l * k}, slope[3] = {-l * k, 0, l * s};
  for (int i = 0; i < 3; ++i) {
    c[i] = at[i];
    J[i] = slope[i];
    cdot[i] = slope[i] * v[0];
  }
}
template <int gravity_cm>
void sensor_wrenches(const double* q, const double* v, const double* vdot, const double*,
                     double* out) {
  const double l = kPendulumLength, g = gravity_cm * 0.01;
  const double x = kPendulumMass * (g * std::sin(q[0]) + l * vdot[0]);
  const double z = kPendulumMass * (-g * std::cos(q[0]) - l * v[0] * v[0]);
  const double wrench[6] = {x, 0.0, z, 0.0, -l * x, 0.0};
  for (int i = 0; i < 6; ++i) out[i] = wrench[i];
}
inline constexpr const char* kSensors[] = {"root"};
inline constexpr const char* kJoints[] = {"swing"};
inline constexpr const char* kSites[] = {"tip"};

}  // namespace pendulum

template <int armature_g = 0, int gravity_cm = 981>
const tandem_kernels* pendulum_kernels() {
  static const tandem_kernels kernels = [] {
    tandem_kernels k{};
    k.sines = no_sines;
    k.abi = TANDEM_KERNELS_ABI;
    k.robot = "pendulum";
    k.nq = k.nv = k.joints = k.sites = 1;
    k.joint_names = pendulum::kJoints;
    k.site_names = pendulum::kSites;
    k.mass_kg = kPendulumMass;
    k.gravity_m_s2[2] = -gravity_cm * 0.01;
    k.forward_dynamics = pendulum::forward_dynamics<armature_g, gravity_cm>;
    k.forward_dynamics_at = at_sines<pendulum::forward_dynamics<armature_g, gravity_cm>>;
    k.inverse_dynamics = pendulum::inverse_dynamics<armature_g, gravity_cm>;
    k.inverse_dynamics_at = at_sines<pendulum::inverse_dynamics<armature_g, gravity_cm>>;
    k.sensors = 1;
    k.sensor_names = pendulum::kSensors;
    k.sensor_wrenches = pendulum::sensor_wrenches<gravity_cm>;
    k.sensor_wrenches_at = at_sines<pendulum::sensor_wrenches<gravity_cm>>;
    k.mass_matrix = pendulum::mass_matrix<armature_g>;
    k.mass_matrix_at = at_sines<pendulum::mass_matrix<armature_g>>;
    k.site_motion = pendulum::site_motion;
    k.site_motion_at = at_sines<pendulum::site_motion>;
    k.site_twists_at = at_sines<site_twists<pendulum::site_motion>>;
    k.center_of_mass = pendulum::center_of_mass;
    k.center_of_mass_at = at_sines<pendulum::center_of_mass>;
    return k;
  }();
  return &kernels;
}

}  // namespace tandem::test
