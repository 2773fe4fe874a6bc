// A tree prepared for the algorithms: every body's frame turned and shifted so that its joint
// moves about (or along) its own z and constant transforms are sparse, and constant inertias
// regrouped so that each body keeps only what its joint can distinguish.
// Layer: model.  Thread: non-RT to build; immutable afterwards.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "model/limbs.hpp"
#include "model/model_spec.hpp"
#include "model/spatial.hpp"
#include "model/tree.hpp"

namespace tandem::model {

/// A constant placement of frame B in frame A: x_A = R x_B + p.
struct FixedPlacement {
  FixedRotation R;
  Vec3<double> p{0.0, 0.0, 0.0};
};

/// Joint j moves body j + 1, whose frame is that of the parent moved by `in_parent` and then by
/// q + offset about z (revolute) or q along z (prismatic).
struct MechanismJoint {
  int parent = 0;
  bool prismatic = false;
  FixedPlacement in_parent;
  double offset = 0.0;  ///< revolute only [rad]
  double cos_offset = 1.0;
  double sin_offset = 0.0;
  double armature = 0.0;
};

/// A frame fixed to a body.
struct MechanismSite {
  int body = 0;
  FixedPlacement in_body;
  int wrench = -1;  ///< index among the wrenches, -1: none may act here
};

/// The wrench through a joint of the description: that of all that lies beyond it.
struct MechanismSensor {
  int body = 0;             ///< holds the far side of the joint
  Moments<double> beyond;   ///< of that body's part beyond the joint, in its frame
  std::vector<int> joints;  ///< moving joints that start beyond, on that body
  std::vector<int> sites;   ///< sites with a wrench beyond, on that body
  int through = -1;         ///< joint that leads from frame_body to body; -1: the same
  FixedPlacement in_body;   ///< the sensor's frame in its body (body, or its parent)
};

/// Where a joint's position comes from: multiplier * q of that coordinate + offset.
struct JointCoordinate {
  int index = 0;  ///< among the joints that follow nobody
  double multiplier = 1.0;
  double offset = 0.0;
};

/// nq() and nv() count every joint, as the algorithms do; the kernels' arrays hold coordinates,
/// of which a follower has none (model/coordinates.hpp).
struct Mechanism {
  bool floating_base = false;
  Vec3<double> gravity{0.0, 0.0, -9.81};
  std::vector<MechanismJoint> joints;
  std::vector<JointCoordinate> coordinate_of;  ///< per joint
  int coordinates = 0;                         ///< joints that follow nobody
  std::vector<std::vector<int>> children;      ///< per body: the joints that start there
  std::vector<Moments<double>> moments;        ///< per body, regrouped
  std::vector<Moments<double>> true_moments;   ///< per body, as described
  std::vector<LimbPair> limbs;                 ///< that are built alike
  std::vector<MechanismSite> sites;
  std::vector<MechanismSensor> sensors;
  int wrenches = 0;
  double mass_kg = 0.0;                  ///< of everything that moves
  std::vector<std::string> joint_names;  ///< per coordinate
  std::vector<std::string> site_names, wrench_names, sensor_names;

  [[nodiscard]] int joint_count() const { return static_cast<int>(joints.size()); }
  [[nodiscard]] int q_index(int joint) const { return joint + (floating_base ? 7 : 0); }
  [[nodiscard]] int v_index(int joint) const { return joint + (floating_base ? 6 : 0); }
  [[nodiscard]] int nq() const { return q_index(joint_count()); }
  [[nodiscard]] int nv() const { return v_index(joint_count()); }
  [[nodiscard]] bool has_followers() const { return coordinates < joint_count(); }
  [[nodiscard]] int kernel_nq() const { return q_index(coordinates); }
  [[nodiscard]] int kernel_nv() const { return v_index(coordinates); }
};

/// How a mechanism is prepared.
enum class Frames : std::uint8_t {
  kFewestOperations,  ///< frames chosen and inertias regrouped, for generated code
  kAsDescribed,       ///< each body's own joint's frame, inertias as they are: to check the other
};

/// Prepares `tree` for the algorithms.
///
/// Errors: a site's link, a sensor's joint or link, or an armature's joint that the tree lacks
/// (the nearest name is suggested); a sensor whose link is on neither side of its joint; a name
/// used twice; an armature that is negative or not finite.
[[nodiscard]] Result<Mechanism> make_mechanism(const Tree& tree, const ModelSpec& spec,
                                               Frames frames = Frames::kFewestOperations);

/// R as turns and a permutation; entries within kExactRightAngle of 0 or +-1 are exact.
[[nodiscard]] FixedRotation factor_rotation(const Eigen::Matrix3d& R);

/// The joint between a parent's and a body's chosen frames (`parent`, `own`: in the frames of
/// the description). A revolute joint's constant rotation is split so that what can be an
/// offset of its angle is.
[[nodiscard]] MechanismJoint make_joint(const Joint& joint, const Placement& parent,
                                        const Placement& own);

/// Where each body's frame stands in the description's frame of that body, chosen so that the
/// constant transforms between them take the fewest operations.
[[nodiscard]] std::vector<Placement> align_frames(const Tree& tree);

/// The same, left where the description has them: turned only so that z is the joint's axis.
[[nodiscard]] std::vector<Placement> described_frames(const Tree& tree);

}  // namespace tandem::model
