// Inverse dynamics as a matrix times the inertial parameters: Newton-Euler, one link at a time.
// Layer: identification.  Thread: any; evaluate() of one object in one thread at a time.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "identification/inertial_parameters.hpp"
#include "model/model_spec.hpp"
#include "model/tree.hpp"

namespace tandem::identification {

/// What there is besides the tree.
struct RegressorSpec {
  std::vector<model::SensorSpec> sensors{};   ///< docs/conventions.md has their sign
  std::vector<std::string> ground_links{};    ///< on which the ground acts: unknown forces
  std::vector<std::string> without_torque{};  ///< joints whose torque nobody measures
};

/// Links that are rigidly connected, and measured together. The parameters sought are those of its
/// heaviest link; the others are as described, for no motion tells them apart.
struct Piece {
  int body = 0;
  int link = 0;              ///< in tree.links: the heaviest
  model::Placement in_body;  ///< of that link's frame
  LinkParameters rest;       ///< of the other links, in that link's frame
  std::vector<int> beyond;   ///< sensors that measure its wrench; indices in the spec
};

/// One scalar equation of each instant.
struct Channel {
  enum class Kind : std::uint8_t { kBase, kJoint, kSensor } kind = Kind::kJoint;
  int index = 0;      ///< joint: coordinate; sensor: in the spec; base: 0
  int component = 0;  ///< base, sensor: force x y z, moment x y z
  std::string name;   ///< "joint panda_joint1", "base force x"
};

/// The state at an instant. Joint arrays are over the tree's coordinates (joints that follow
/// nobody), in the order of its joints.
struct Instant {
  Eigen::VectorXd q, v, vdot;  ///< [rad or m, per s, per s^2]
  Eigen::Vector3d w, al;       ///< of a floating base in its own frame [rad/s, rad/s^2]
  Eigen::Vector3d a;           ///< of its origin, minus gravity [m/s^2], same frame; of a
                               ///< fixed base minus gravity
  std::vector<Eigen::Matrix<double, 6, 1>> wrenches;  ///< per sensor of the spec, as measured
};

/// y = Y p + known, for each instant: y are the torques, the forces on the base (which are zero:
/// nothing holds it) and the measured wrenches; p the pieces' parameters, ten each.
///
/// Where the ground acts on what a sensor measures, that sensor cuts the tree: its wrench is known,
/// what lies beyond stays out, and nothing is said of it.
class Regressor {
 public:
  /// Errors: a sensor's joint or link is not in the description; the base floats and the ground
  /// acts on a link that no sensor measures.
  [[nodiscard]] static Result<Regressor> create(const model::Tree& tree, const RegressorSpec& spec);

  [[nodiscard]] const std::vector<Piece>& pieces() const { return pieces_; }
  [[nodiscard]] const std::vector<Channel>& channels() const { return channels_; }
  [[nodiscard]] Eigen::Index columns() const {
    return 10 * static_cast<Eigen::Index>(pieces_.size());
  }
  /// Links with mass of which no equation speaks: beyond a sensor that the ground acts on.
  [[nodiscard]] const std::vector<int>& unseen_links() const { return unseen_; }
  /// Names of the coordinates' joints.
  [[nodiscard]] const std::vector<std::string>& coordinates() const { return coordinates_; }
  [[nodiscard]] std::size_t sensor_count() const { return sensors_.size(); }
  /// The parameters of every piece as described, ten each.
  [[nodiscard]] Eigen::VectorXd described() const;

  /// @param Y      out: (channels x columns)
  /// @param known  out: (channels)
  void evaluate(const Instant& at, Eigen::MatrixXd& Y, Eigen::VectorXd& known);

  /// The motion of the base from that of a frame on a link, which an IMU measures.
  /// @param at  in: q, v, vdot; out: w, al, a of the base
  /// @param w, al, a  of the frame, in its axes; a without gravity's pull: specific force
  void base_from_link(int link, const Eigen::Vector3d& w, const Eigen::Vector3d& al,
                      const Eigen::Vector3d& a, Instant& at);

 private:
  using Wrenches = Eigen::Matrix<double, 6, 11>;  // the last column: what is known
  struct Moving {                                 // a body at an instant
    Eigen::Matrix3d R;                            // its axes in its parent's
    Eigen::Vector3d p, w, al, a;
  };
  struct Sensor {
    bool cuts = false;
    int top = 0;          // body of the far side
    bool moving = false;  // its joint moves: it leads to `top`
    int body = 0;         // that holds its frame
    model::Placement frame;
    int row = -1;  // its first channel; -1: none
  };
  explicit Regressor(const model::Tree& tree) : tree_(&tree) {}
  Status take_sensors(const RegressorSpec& spec);
  void make_pieces();
  void make_channels(const RegressorSpec& spec);
  void place(const Instant& at);
  void move(const Instant& at);
  [[nodiscard]] Wrenches needed(const Piece& piece) const;
  void climb(int body, Wrenches forces, const Piece* piece, Eigen::Index column, Eigen::MatrixXd& Y,
             Eigen::VectorXd& known) const;
  [[nodiscard]] bool is_beyond(int link, const std::string& joint) const;

  const model::Tree* tree_;
  std::vector<Sensor> sensors_;
  std::vector<std::string> sensor_names_, sensor_joints_;
  std::vector<std::vector<int>> beyond_;  // per link: sensors that it lies beyond
  std::vector<Piece> pieces_;
  std::vector<Channel> channels_;
  std::vector<int> unseen_;
  std::vector<int> coordinate_;  // per joint
  std::vector<int> joint_row_;   // per coordinate; -1: no channel
  std::vector<std::string> coordinates_;
  std::vector<Moving> bodies_;
};

}  // namespace tandem::identification
