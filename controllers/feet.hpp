// The feet of a robot as its controllers see them: where the ground may hold it, and how firmly.
// Layer: controllers.  Thread: non-RT to make; then any.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/robot.hpp"
#include "model/kernels.h"

namespace tandem {

/// What the ground can fix of a foot, by the shape that its contact points span.
enum class FootShape : std::uint8_t {
  kPoint,    ///< its position: it turns freely
  kLine,     ///< position, and what turns the line: it rolls about the line
  kSurface,  ///< position and orientation
};

/// One [[contact.foot]]. Points, middle and axis stand in the site's frame.
struct FootContact {
  std::string name;      ///< of its site
  std::size_t site = 0;  ///< among the kernels' sites
  std::vector<std::array<double, 3>> points_m;
  std::array<double, 3> middle_m{};  ///< of the points
  FootShape shape = FootShape::kPoint;
  std::array<double, 3> axis{};  ///< of length 1: along a line; normal to a surface, either way
};

/// Points nearer than this to a point or a line do not make more of it [m].
inline constexpr double kFootExtent_m = 0.005;

/// The feet of these names, in their order.
/// Errors: no name at all, one that is no [[contact.foot]], one twice, a site that the kernels
/// lack.
[[nodiscard]] Result<std::vector<FootContact>> find_feet(const hal::Robot& robot,
                                                         const tandem_kernels& kernels,
                                                         std::span<const std::string> names);

/// The names of every [[contact.foot]], in the file's order.
[[nodiscard]] std::vector<std::string> foot_names(const hal::Robot& robot);

/// The frame G of the ground in the frame that the poses stand in.
struct GroundFrame {
  Eigen::Matrix3d R;         ///< columns: ahead, to the left, up
  Eigen::Vector3d origin_m;  ///< the middle of the feet's middles
};

/// Up is normal to the plane that fits the contact points best. Points on one line leave open how
/// the ground leans about it, a single one leaves it open in all directions: then the frame's own
/// z decides. Ahead is the frame's own x, laid onto the ground.
///
/// @param pose  (12 * sites) of the kernels, with the base along the frame
/// @rt    no allocation, lock or throw.
[[nodiscard]] GroundFrame ground_under(std::span<const FootContact> feet,
                                       std::span<const double> pose) noexcept TANDEM_RT;

}  // namespace tandem
