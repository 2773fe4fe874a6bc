// What the simulated robot's links weigh more, or less, than its kernels say: other masses, and
// what it carries. Layer: hal/sim.  Thread: create non-RT; the rest RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/payload.hpp"
#include "hal/sim/tree_motion.hpp"
#include "model/kernels.h"
#include "model/spatial.hpp"
#include "model/tree.hpp"

namespace tandem::sim {

/// The dynamics with D = (what the robot weighs) - (what the kernels say), per body:
///
///   M' = M + sum J^T D J + armature     h' = h + sum J^T (D (J' v - g) + v x* D v)
///
/// which is exact, whatever the kernels are, and whenever D changes: M' is factorised where the
/// kernels' forward dynamics are O(n). Without anything added the kernels are called, to the bit.
/// D's parts stand in the links' places, so that force/torque sensors feel those beyond them.
class AddedInertia {
 public:
  AddedInertia() = default;
  /// Nothing is added, and nothing can be but armature.
  AddedInertia(const tandem_kernels& kernels);
  /// @param described  the tree of the kernels
  /// @param actual     the same tree with other masses
  AddedInertia(const tandem_kernels& kernels, const hal::RobotConfig& robot,
               const model::Tree& described, const model::Tree& actual);

  /// Adds to the inertia of a joint of the kernels, for good.
  void add_armature(std::size_t joint, double more_kg_m2);
  /// What is carried is let go.
  void let_go() noexcept TANDEM_RT;
  void carry(const Load& load) noexcept TANDEM_RT;

  [[nodiscard]] bool any() const noexcept { return any_ != 0; }
  [[nodiscard]] const tandem_kernels& kernels() const noexcept { return *kernels_; }
  /// The whole robot's.
  [[nodiscard]] double mass_kg() const noexcept { return kernels_->mass_kg + added_kg_; }

  /// As the kernels' of the same names. @param sines  of q
  void forward_dynamics(const double* sines, const double* q, const double* v, const double* tau,
                        const double* wrench, double* vdot) noexcept TANDEM_RT;
  void inverse_dynamics(const double* sines, const double* q, const double* v, const double* vdot,
                        const double* wrench, double* tau) noexcept TANDEM_RT;
  /// Adds what M (nv*nv) and the center of mass c (3) of the kernels lack.
  void add_to_mass_matrix(const double* q, double* M) noexcept TANDEM_RT;
  void add_to_center_of_mass(const double* q, double* c) noexcept TANDEM_RT;
  /// Adds what is beyond force/torque sensor `sensor` (of robot.toml) to its six channels.
  void add_beyond(std::size_t sensor, const double* q, const double* v, const double* vdot,
                  double* channels) noexcept TANDEM_RT;

  void archive(Archive& ar) { ar(link_, body_, added_kg_, any_); }

 private:
  using Moments = model::Moments<double>;
  /// A twist, or a wrench, at W's origin and along its axes.
  struct Spatial {
    Vec3 linear{}, angular{};
  };
  struct Place {
    std::size_t body;
    Mat3 R;
    Vec3 p;
  };
  struct Sensor {
    Place frame{};
    std::vector<std::uint8_t> beyond;  // by link; empty: no force/torque sensor
  };
  [[nodiscard]] static Moments moments_of(const model::Inertia& inertia) noexcept;
  [[nodiscard]] static Moments placed(const Mat3& R, const Vec3& p, const Moments& x) noexcept;
  [[nodiscard]] static Spatial force_of(const Moments& x, const Spatial& acceleration) noexcept;
  [[nodiscard]] static Spatial needed(const Moments& x, const Spatial& velocity,
                                      const Spatial& acceleration) noexcept;
  [[nodiscard]] static double power(const Spatial& a, const Spatial& b) noexcept;

  void add(const Load& load, double sign) noexcept;
  void add_sensors(const hal::RobotConfig& robot, const model::Tree& tree);
  void place(const double* q, const double* v) noexcept;
  void accelerate(const double* vdot) noexcept;
  void add_forces(double* tau) noexcept;
  void add_composites(double* M) noexcept;
  [[nodiscard]] Spatial along(std::size_t joint) const noexcept;

  const tandem_kernels* kernels_ = nullptr;
  TreeMotion motion_;
  std::size_t base_ = 0;          // 6, or 0
  std::vector<Place> places_;     // of the links, in their bodies
  std::vector<Moments> own_;      // by link, for good; in the body's frame, as the next two
  std::vector<Moments> link_;     // with what is carried
  std::vector<Moments> body_;     // those of its links
  std::vector<double> armature_;  // by coordinate
  std::vector<Sensor> sensors_;
  double added_kg_ = 0.0;
  std::uint64_t any_ = 0, own_any_ = 0;

  // Scratch: by body in W; the moments of all beyond it.
  std::vector<Spatial> velocity_, acceleration_, base_axes_;
  std::vector<Moments> composite_;
  std::vector<double> body_force_, M_, rest_, bias_;
};

}  // namespace tandem::sim
