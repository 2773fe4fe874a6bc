/* The C ABI of a robot's generated kernels: one shared library per robot.
 * Layer: model.  Thread: any; every kernel is pure, allocates nothing, and cannot fail: a state
 * that is not finite gives results that are not finite.
 *
 * Conventions (docs/conventions.md): SI; world W z-up; q of a floating base is
 * [x y z qx qy qz qw, joints…] with a unit quaternion (base to world), v is
 * [linear, angular of the base in the base's own frame, joint rates…]. Spatial vectors are
 * linear first. nq = 7 + joints, nv = 6 + joints (floating) or both = joints (fixed).
 * Joints stand in the model's order: depth first, children by name. Gravity is included. */
#ifndef TANDEM_MODEL_KERNELS_H
#define TANDEM_MODEL_KERNELS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define TANDEM_KERNELS_ABI 6u

/* Operations of one kernel as emitted (before the compiler). */
typedef struct tandem_kernel_count {
  const char* kernel; /* "forward_dynamics" */
  uint32_t add;       /* additions and subtractions */
  uint32_t mul;
  uint32_t div;
  uint32_t sqrt;
  uint32_t sincos; /* sine and cosine of one angle count once */
  uint32_t pairs;  /* times that two of these, of limbs that are alike, are one instruction */
} tandem_kernel_count;

typedef struct tandem_kernels {
  uint32_t abi; /* TANDEM_KERNELS_ABI */
  uint32_t floating_base;
  const char* robot;
  const char* description_hash; /* SHA-256, hex, of everything the kernels were made from */
  const char* variant;          /* "baseline", "x86-64-v3", … the one chosen at load */
  uint32_t nq, nv, joints, sites, wrenches, sensors;
  const char* const* joint_names;  /* joints, model order: v index (6 or 0) + i */
  const char* const* site_names;   /* sites: frames with pose, twist, acceleration, Jacobian */
  const char* const* wrench_names; /* wrenches: the sites where an external wrench may act */
  const char* const* sensor_names; /* sensors: six-axis force/torque */
  double mass_kg;                  /* of everything that moves */
  double gravity_m_s2[3];          /* in W */
  const tandem_kernel_count* counts;
  uint32_t kernel_count;

  /* vdot(nv) = M^-1 (tau + sum J^T f - h). tau(nv): the base's six entries are a wrench in the
   * base's frame, normally zero. wrench(6*wrenches): force then moment about the site's origin,
   * in the site's own frame, acting on the robot. */
  void (*forward_dynamics)(const double* q, const double* v, const double* tau,
                           const double* wrench, double* vdot);
  /* tau(nv) = M vdot + h - sum J^T f */
  void (*inverse_dynamics)(const double* q, const double* v, const double* vdot,
                           const double* wrench, double* tau);
  /* M(nv*nv), symmetric, both triangles; armature on the diagonal */
  void (*mass_matrix)(const double* q, double* M);
  /* h(nv): Coriolis, centrifugal and gravity */
  void (*bias)(const double* q, const double* v, double* h);
  /* c(3), cdot(3) in W; J(3*nv) row-major with cdot = J v */
  void (*center_of_mass)(const double* q, const double* v, double* c, double* cdot, double* J);
  /* h(6) about the centre of mass, in W: linear then angular */
  void (*centroidal_momentum)(const double* q, const double* v, double* h);
  /* kinetic_potential(2), J; the potential is zero at W's origin */
  void (*energy)(const double* q, const double* v, double* kinetic_potential);
  /* Per site s: pose(12*s) is R (3x3 row-major, site to W) then p (3, in W); twist(6*s) and
   * acceleration(6*s) of the site's origin in W axes, linear (classical, without gravity) then
   * angular. */
  void (*site_motion)(const double* q, const double* v, const double* vdot, double* pose,
                      double* twist, double* acceleration);
  /* The same without accelerations, which costs less. */
  void (*site_twists)(const double* q, const double* v, double* pose, double* twist);
  /* J(6*nv) row-major per site, one after another: twist = J v, as in site_motion */
  void (*site_jacobians)(const double* q, double* J);
  /* Per sensor six: the wrench that the child's side (away from the base) applies to the parent's
   * side through the sensor's joint, force then moment about the sensor frame's origin, in the
   * sensor's frame. In the foot of a standing robot the force points up: + weight / 2. */
  void (*sensor_wrenches)(const double* q, const double* v, const double* vdot,
                          const double* wrench, double* out);

  /* p(nv) = M v, the generalised momentum, and b(nv) = C^T v - g + sum J^T f, with which
   * dp/dt = tau + b; C is any factorisation of the Coriolis forces with dM/dt = C + C^T. No
   * acceleration enters: what a momentum observer needs. */
  void (*generalised_momentum)(const double* q, const double* v, const double* wrench, double* p,
                               double* b);

  /* Several states in a call, for sweeps, predictions and differences: element i of state s stands
   * at [i * states + s] of every array. `states` is a multiple of four, and what exceeds one is
   * left out. Fastest is exactly eight with AVX-512. Never null in a library. */
  void (*forward_dynamics_batch)(uint32_t states, const double* q, const double* v,
                                 const double* tau, const double* wrench, double* vdot);
  void (*inverse_dynamics_batch)(uint32_t states, const double* q, const double* v,
                                 const double* vdot, const double* wrench, double* tau);

  /* Several kernels at one posture: sines(q, s) computes the sines and cosines of it once, and each
   * kernel's _at form takes them and the same q. s(sine_count) is aligned to 32 bytes; how it is
   * laid out is the library's own matter. Results are those of the forms above, bit for bit. */
  uint32_t sine_count;
  void (*sines)(const double* q, double* s);
  void (*forward_dynamics_at)(const double* s, const double* q, const double* v, const double* tau,
                              const double* wrench, double* vdot);
  void (*inverse_dynamics_at)(const double* s, const double* q, const double* v, const double* vdot,
                              const double* wrench, double* tau);
  void (*mass_matrix_at)(const double* s, const double* q, double* M);
  void (*bias_at)(const double* s, const double* q, const double* v, double* h);
  void (*center_of_mass_at)(const double* s, const double* q, const double* v, double* c,
                            double* cdot, double* J);
  void (*centroidal_momentum_at)(const double* s, const double* q, const double* v, double* h);
  void (*energy_at)(const double* s, const double* q, const double* v, double* kinetic_potential);
  void (*site_motion_at)(const double* s, const double* q, const double* v, const double* vdot,
                         double* pose, double* twist, double* acceleration);
  void (*site_twists_at)(const double* s, const double* q, const double* v, double* pose,
                         double* twist);
  void (*site_jacobians_at)(const double* s, const double* q, double* J);
  void (*sensor_wrenches_at)(const double* s, const double* q, const double* v, const double* vdot,
                             const double* wrench, double* out);
  void (*generalised_momentum_at)(const double* s, const double* q, const double* v,
                                  const double* wrench, double* p, double* b);

  /* Derivatives, each nv*nv, row-major: row i, column j is that of element i to element j. The
   * columns of a floating base's q are a displacement in the order of v, in the base's own frame:
   * translation t, then rotation by the vector r; p <- p + R t, R <- R exp(r). Wrenches stay as
   * they are in their sites' frames. Null in a library that was not asked for them: robot.toml,
   * [model] derivatives = true. */
  /* of tau; dtau_dvdot is M */
  void (*inverse_dynamics_derivatives)(const double* q, const double* v, const double* vdot,
                                       const double* wrench, double* dtau_dq, double* dtau_dv,
                                       double* dtau_dvdot);
  /* of vdot; dvdot_dtau is M^-1 */
  void (*forward_dynamics_derivatives)(const double* q, const double* v, const double* tau,
                                       const double* wrench, double* dvdot_dq, double* dvdot_dv,
                                       double* dvdot_dtau);
} tandem_kernels;

/* The library's only symbol. Never null. `variant` may be NULL (the best one this CPU runs) or
 * name one; NULL is returned when this library or CPU does not have it. */
const tandem_kernels* tandem_kernels_get(const char* variant);

#ifdef __cplusplus
}
#endif

#endif
