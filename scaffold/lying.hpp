// A robot whose legs do not lie along -z of its root.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <Eigen/Core>
#include <string>

#include "base/result.hpp"

namespace tandem::scaffold {

/// It would be laid on its side. The hint has the link and the joint that put it upright.
/// @param down, ahead  axes of the root `root`: along its legs, and where it looks
[[nodiscard]] Error lies(const std::string& root, const Eigen::Vector3d& down,
                         const Eigen::Vector3d& ahead);

}  // namespace tandem::scaffold
