// What a robot's kernels are made from, besides the description: the [model] part of robot.toml
// and what the other parts say about frames and inertia. Plain data.
// Layer: model.  Thread: non-RT.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace tandem::model {

/// A named frame fixed to a link, with pose, twist, acceleration and Jacobian.
struct SiteSpec {
  std::string name;
  std::string link;                 ///< of the description
  std::array<double, 3> xyz_m{};    ///< origin in the link's frame
  std::array<double, 3> rpy_rad{};  ///< fixed axes x, y, z in that order (URDF)
  bool wrench = false;              ///< an external wrench may act here
};

/// A six-axis sensor: the wrench through a joint of the description, moving or fixed.
struct SensorSpec {
  std::string name;
  std::string joint;
  std::string frame_link;  ///< the frame that the wrench is expressed in; on either
                           ///< side of the joint
};

/// Everything that the kernels of one robot depend on, beyond the description file's content.
struct ModelSpec {
  std::string robot;  ///< the name kernels report
  std::string urdf;   ///< path of the description
  bool floating_base = false;
  bool mimic_independent = false;  ///< treat mimic joints as independent; else they follow
  std::vector<std::pair<std::string, double>> lock;  ///< joint -> fixed position [rad or m]
  std::array<double, 3> gravity_m_s2{0.0, 0.0, -9.81};
  std::vector<SiteSpec> sites;
  std::vector<SensorSpec> sensors;
  bool derivatives = false;  ///< kernels of the derivatives of inverse and forward dynamics, too
  /// Rotor inertia on the link side [kg m^2 or kg] by joint, added to M's diagonal; joints not
  /// named have none. A joint behind a spring has none: its motor is a state of its own.
  std::vector<std::pair<std::string, double>> armature;
};

}  // namespace tandem::model
