// Links other than soles on the ground: what a robot that falls lies on.
// Layer: hal/sim.  Thread: create non-RT; the rest RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/apparent_inertia.hpp"
#include "hal/sim/ground_law.hpp"
#include "hal/sim/link_points.hpp"
#include "hal/sim/rotation.hpp"
#include "hal/sim/tree_motion.hpp"
#include "model/kernels.h"
#include "model/tree.hpp"

namespace tandem::sim {

/// The same law as the soles' (class Contact), at points of links: class Contact's stiffness and
/// dampers, bounded by what the lightest posture of the point's link lets the sub-step h integrate
/// with four points on the ground, m the mass that the point shows (point_mass()):
///
///   k, kt <= m (0.4 / h)^2 / 4        damper, dt <= 0.3 m / h / 4
///
/// Forces act as generalized forces J^T f, for the kernels know no site there. The kinematics are
/// evaluated only while the robot may have come near: after a look at every link, its clearance is
/// used up by a bound on what any point can have travelled since.
class BodyContact {
 public:
  BodyContact() = default;
  /// Points that are inside the ground at `q` (nq) are left out: `tandem check` names their links.
  /// @param sensors  robot.toml's, for add_beyond()
  BodyContact(const hal::RobotConfig& robot, const model::Tree& tree, const tandem_kernels& kernels,
              const double* q, std::span<const PostureInertia> postures, std::int64_t substep_ns);

  /// As Contact's.
  void move_ground(const hal::GroundMotion& moved) noexcept { moved_ = moved; }
  /// Computes the ground's forces at this state. Cheap while nothing is near.
  /// @param move_anchors  true exactly once per sub-step, at its first evaluation
  void evaluate(const double* q, const double* v, bool move_anchors) noexcept TANDEM_RT;
  /// The robot has moved for `h_s` with `v`.
  void moved(const double* v, double h_s) noexcept TANDEM_RT;
  /// The robot is somewhere else.
  void lost() noexcept TANDEM_RT { clearance_m_ = 0.0; }

  /// Whether any point touches, at the last evaluate(); as the next three.
  [[nodiscard]] bool touching() const noexcept { return touching_ != 0; }
  /// Adds J^T f to `forces` (nv).
  void add_forces(double* forces) const noexcept TANDEM_RT;
  /// Adds to the six channels of force/torque sensor `sensor` (of robot.toml) what is held up
  /// beyond it. Does nothing for other sensors.
  void add_beyond(std::size_t sensor, double* channels) const noexcept TANDEM_RT;
  /// Vertical force on all links together [N], and what their springs hold [J].
  [[nodiscard]] double vertical_force_N() const noexcept;
  [[nodiscard]] double elastic_energy_J() const noexcept { return energy_J_; }
  /// Whether any point of the link touches.
  [[nodiscard]] bool touching(const std::string& link) const noexcept;

  void archive(Archive& ar) {
    ar(anchor_x_, anchor_y_, anchored_, groups_force_, generalized_, energy_J_, clearance_m_,
       step_m_, touching_);
  }

 private:
  struct Group {  // one link's points
    std::size_t link, body, begin, end;
    Vec3 center;  // of a ball around them, in the body's frame
    double radius;
  };
  struct Beyond {  // a force/torque sensor
    std::size_t body = 0;
    Mat3 R{};
    Vec3 p{};                         // its frame in the body
    std::vector<std::uint8_t> group;  // beyond it, or not
  };
  void add_groups(const model::Tree& tree, const std::vector<LinkPoints>& points);
  void add_reach(const model::Tree& tree);
  void add_sensors(const hal::RobotConfig& robot, const model::Tree& tree);
  void fit(const tandem_kernels& kernels, std::span<const PostureInertia> postures,
           std::int64_t substep_ns);
  [[nodiscard]] Vec3 on_ground(const Vec3& at) const noexcept;
  [[nodiscard]] double clearance_m(const Vec3& center, double radius) const noexcept;
  void touch(const Group& group, double* force, bool move_anchors) noexcept;
  void generalize() noexcept;

  hal::ContactConfig config_;
  hal::GroundMotion moved_;  // at the last evaluation
  TreeMotion motion_;
  std::vector<std::string> names_;  // of links
  std::vector<Group> groups_;
  std::vector<Vec3> points_;  // in their bodies' frames
  std::vector<PointGround> ground_;
  std::vector<double> reach_m_;  // per kernels' joint: of the points beyond it; NaN: unknown
  double base_reach_m_ = 0.0;
  std::vector<Beyond> sensors_;

  std::vector<double> anchor_x_, anchor_y_;
  std::vector<std::uint8_t> anchored_;
  std::vector<double> groups_force_;  // 6 per group: in W, moment about W's origin
  std::vector<double> body_force_;    // 6 per body, scratch
  std::vector<double> generalized_;   // nv
  double energy_J_ = 0.0;
  double clearance_m_ = 0.0, step_m_ = 0.0;
  std::uint64_t touching_ = 0;
};

}  // namespace tandem::sim
