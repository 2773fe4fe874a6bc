// Which ends of a robot are its feet, and where they touch the ground.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <string>
#include <vector>

#include "scaffold/posed.hpp"

namespace tandem::scaffold {

/// A foot. Its sole's frame has z up and x ahead when the robot stands.
struct FoundFoot {
  std::string name;  ///< of its site; given by name_limbs()
  int link = 0;      ///< in the tree: what the sole's frame is fixed to
  int body = 0;
  model::Placement sole_in_link;        ///< flat: the middle of the points; else a ball's centre
  double radius_m = 0.0;                ///< of a point foot's ball; 0: flat, or a bare point
  std::vector<Eigen::Vector3d> points;  ///< in the sole's frame
  std::string guess;                    ///< what was assumed; empty: the description has it

  [[nodiscard]] bool flat() const { return points.size() > 2; }
  /// A cylinder that lies: it touches the ground along this [m], of any length; 0: it does not.
  [[nodiscard]] Eigen::Vector3d line() const {
    return points.size() == 2 ? Eigen::Vector3d(points[0] - points[1]) : Eigen::Vector3d::Zero();
  }
};

enum class FeetBy : std::uint8_t {
  kName,       ///< a link of a limb's end is called foot, sole, ankle or toe
  kStructure,  ///< the lowest ends of limbs
};

/// @param neutral  a posture in which soles are level, as far as anybody knows
/// @return none when nothing looks like a foot
[[nodiscard]] std::vector<FoundFoot> find_feet(const model::Tree& tree, const Posed& neutral,
                                               FeetBy by);

/// Along which of the root's axes the legs lie: -z, or another one when nearly all of them do.
[[nodiscard]] Eigen::Vector3d direction_down(const model::Tree& tree,
                                             const std::vector<FoundFoot>& feet,
                                             const Posed& neutral);

/// Where a robot looks whose legs lie along `down`: across the axes about which most of the legs'
/// joints turn, to the side to which its feet reach; one of the root's axes.
[[nodiscard]] Eigen::Vector3d direction_ahead_of(const model::Tree& tree,
                                                 const std::vector<FoundFoot>& feet,
                                                 const Posed& neutral, const Eigen::Vector3d& down);

/// Where the robot looks, by model::direction_ahead(): one of the root's axes, in W.
[[nodiscard]] Eigen::Vector3d direction_ahead(const std::vector<FoundFoot>& feet,
                                              const Posed& neutral);

/// Turns every sole's frame so that x is ahead, in the posture in which it is level.
void face_ahead(const Eigen::Vector3d& ahead, const Posed& neutral, std::vector<FoundFoot>& feet);

/// Puts the contact point of each ball under its centre, in the posture in which it stands; from
/// then on the foot is that point.
void settle_balls(const Eigen::Vector3d& ahead, const Posed& standing,
                  std::vector<FoundFoot>& feet);

}  // namespace tandem::scaffold
