// A robot as a tree of bodies, free of the file that described it: what a description's reader
// fills in and what the dynamics algorithms consume. Plain data.
// Layer: model.  Thread: non-RT to fill; immutable afterwards.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace tandem::model {

/// Where frame B stands in frame A: x_A = R x_B + p.
struct Placement {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< B's axes in A, orthonormal
  Eigen::Vector3d p = Eigen::Vector3d::Zero();      ///< B's origin in A [m]
};

/// A * B: the placement of C in A from B in A and C in B.
[[nodiscard]] inline Placement operator*(const Placement& a_b, const Placement& b_c) {
  return {a_b.R * b_c.R, a_b.R * b_c.p + a_b.p};
}

/// Mass distribution, in the axes and from the origin of a frame that the holder names.
struct Inertia {
  double mass_kg = 0.0;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d about_com_kg_m2 = Eigen::Matrix3d::Zero();  ///< symmetric
};

enum class JointType : std::uint8_t { kRevolute, kContinuous, kPrismatic };

struct Travel {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

/// A joint that moves: joint i moves body i + 1. Its frame is the URDF joint's frame, which is
/// the frame of body i + 1 at q = 0.
struct Joint {
  std::string name;
  int parent = 0;  ///< body; always smaller than i + 1
  JointType type = JointType::kRevolute;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit length, in the joint's frame
  Placement in_parent;  ///< the joint's frame (q = 0) in the parent body's frame
  double lower = -std::numeric_limits<double>::infinity();  ///< position [rad or m]
  double upper = std::numeric_limits<double>::infinity();
  double velocity = std::numeric_limits<double>::infinity();  ///< [rad/s or m/s]
  double effort = std::numeric_limits<double>::infinity();    ///< [Nm or N]
  int line = 0;  ///< in the description; 0 when unknown

  /// A follower (URDF: mimic) has no coordinate of its own: its position is `multiplier` times
  /// that of joint `leader`, plus `offset`. Leaders follow nobody and stand anywhere in the tree.
  int leader = -1;  ///< index in `joints`; -1: follows nobody
  double multiplier = 1.0;
  double offset = 0.0;  ///< [rad or m]

  [[nodiscard]] bool follows() const { return leader >= 0; }
  /// False for a continuous joint, and where the description gives no limits.
  [[nodiscard]] bool has_limits() const { return std::isfinite(lower) && std::isfinite(upper); }
  /// Range in which the leader keeps a follower within its limits.
  [[nodiscard]] Travel leaders_range() const {
    if (!has_limits()) return {};
    const double a = (lower - offset) / multiplier;
    const double b = (upper - offset) / multiplier;
    return a < b ? Travel{a, b} : Travel{b, a};
  }
};

/// One <collision> of a link.
struct Shape {
  enum class Kind : std::uint8_t { kBox, kSphere, kCylinder, kCapsule, kMesh } kind = Kind::kMesh;
  /// Box: edges. Sphere: radius in x. Cylinder: radius in x, length in z. Capsule: the same, its
  /// two caps beyond the length. Mesh, and what has no usable figures: 0.
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  Placement in_link;  ///< its own frame in the link's: a cylinder lies along z
};

/// What moves as one piece: a link and all that is fixed to it.
struct Body {
  std::string name;  ///< of the link whose frame is the body's frame
  Inertia inertia;   ///< of all its links together, in the body's frame
};

/// A link of the description. Its frame is that of the joint that leads to it.
struct Link {
  std::string name;
  int body = 0;                 ///< the body it is part of
  Placement in_body;            ///< its frame in the body's frame
  Inertia inertia;              ///< its own, in its own frame; mass 0 when it has none
  int parent = -1;              ///< link; smaller than its own index; -1: the root
  std::string joint;            ///< from the parent to it, moving or fixed; empty: the root
  int moving = -1;              ///< index in `joints` when that joint moves, else -1
  std::vector<Shape> shapes{};  ///< not part of the dynamics
};

/// Joints, bodies and links stand in the model's order: depth first from the root, the children
/// of a link by the name of their joint (fixed ones count in that order, though they make no
/// body of their own). A locked joint is a fixed one.
struct Tree {
  std::string name;            ///< the description's robot name
  std::string file;            ///< the description's path; may be empty
  bool floating_base = false;  ///< body 0 moves freely, else it is fixed to the world
  std::vector<Joint> joints;
  std::vector<Body> bodies;  ///< joints.size() + 1; body 0 is the root's
  std::vector<Link> links;   ///< link 0 is the root

  /// Coordinates of the joints: one for each that follows nobody.
  [[nodiscard]] int coordinates() const {
    int count = 0;
    for (const Joint& joint : joints) count += joint.follows() ? 0 : 1;
    return count;
  }
  [[nodiscard]] int nv() const { return coordinates() + (floating_base ? 6 : 0); }
  [[nodiscard]] int nq() const { return coordinates() + (floating_base ? 7 : 0); }
  /// Index in `links`, or -1.
  [[nodiscard]] int link_index(const std::string& link) const {
    for (std::size_t i = 0; i < links.size(); ++i)
      if (links[i].name == link) return static_cast<int>(i);
    return -1;
  }
  /// Index in `links` of the child of the (moving or fixed) joint so named, or -1.
  [[nodiscard]] int child_link_index(const std::string& joint) const {
    for (std::size_t i = 0; i < links.size(); ++i)
      if (!joint.empty() && links[i].joint == joint) return static_cast<int>(i);
    return -1;
  }
  /// Index in `joints` of the moving joint so named, or -1.
  [[nodiscard]] int joint_index(const std::string& joint) const {
    for (std::size_t i = 0; i < joints.size(); ++i)
      if (joints[i].name == joint) return static_cast<int>(i);
    return -1;
  }
  /// Joints that move `body`, the root's side first; a follower's leader stands for it.
  [[nodiscard]] std::vector<int> path_to(int body) const {
    std::vector<int> path;
    for (; body > 0; body = joints[static_cast<std::size_t>(body - 1)].parent) {
      const Joint& joint = joints[static_cast<std::size_t>(body - 1)];
      const int moves = joint.follows() ? joint.leader : body - 1;
      if (std::ranges::find(path, moves) == path.end()) path.push_back(moves);
    }
    std::ranges::reverse(path);
    return path;
  }
};

/// The inertia of two pieces together; both given in the same frame.
[[nodiscard]] inline Inertia operator+(const Inertia& a, const Inertia& b) {
  const double mass = a.mass_kg + b.mass_kg;
  if (!(mass > 0.0)) return {0.0, Eigen::Vector3d::Zero(), a.about_com_kg_m2 + b.about_com_kg_m2};
  const Eigen::Vector3d d = a.com_m - b.com_m;
  const double reduced = a.mass_kg * b.mass_kg / mass;
  return {mass, (a.mass_kg * a.com_m + b.mass_kg * b.com_m) / mass,
          a.about_com_kg_m2 + b.about_com_kg_m2 +
              reduced * (d.dot(d) * Eigen::Matrix3d::Identity() - d * d.transpose())};
}

/// The same piece seen from frame A, when `inertia` is given in frame B.
[[nodiscard]] inline Inertia operator*(const Placement& a_b, const Inertia& inertia) {
  return {inertia.mass_kg, a_b.R * inertia.com_m + a_b.p,
          a_b.R * inertia.about_com_kg_m2 * a_b.R.transpose()};
}

}  // namespace tandem::model
