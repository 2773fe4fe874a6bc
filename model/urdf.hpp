// Reads a URDF strictly: a robot that cannot be simulated is refused, with link or joint, file
// and line. docs/urdf.md says what of URDF is understood.
// Layer: model.  Thread: non-RT only; readers in several threads wait for each other.
#pragma once

#include <expected>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "model/tree.hpp"

namespace tandem::model {

struct UrdfOptions {
  bool floating_base = false;
  bool mimic_independent = false;  ///< treat mimic joints as independent; else they are refused
  std::vector<std::pair<std::string, double>> lock{};  ///< joint -> fixed position [rad or m]
};

struct UrdfModel {
  Tree tree;
  Diagnostics warnings;  ///< what was tolerated
};

/// A link below this share of the mass of the body that it is part of may have an impossible
/// inertia: it is used as it stands, with a warning, because public descriptions carry cameras
/// and lids so. The body as a whole must be possible.
inline constexpr double kNegligibleMassShare = 0.01;

/// Understands revolute, continuous, prismatic and fixed joints. A link without mass, or fixed to
/// another, becomes part of that link's body. Visuals and collisions are not looked at.
///
/// Errors, all of them at once as far as the text can be understood:
///   - the file is missing, unreadable, cut off, no XML, no <robot>;
///   - a name, attribute or element is missing; a number is unreadable, NaN or infinite;
///   - two links or joints of one name; a joint to a link that is not there (nearest suggested);
///   - a link with two parents, a loop, two roots, no link at all;
///   - planar, floating or unknown joint types; mimic joints, unless independent or locked;
///   - a zero axis; reversed limits; a lock on a joint that is missing, fixed or beyond limits;
///   - negative mass; an inertia that is not positive definite or breaks the triangle inequality
///     (by more than 1e-6 of its largest moment), unless the link's mass is negligible;
///   - a moving joint that carries no mass at all, or a floating base without mass.
[[nodiscard]] std::expected<UrdfModel, Diagnostics> read_urdf(const std::string& file,
                                                              const UrdfOptions& options);
/// The same from memory; `file` only names it in errors.
[[nodiscard]] std::expected<UrdfModel, Diagnostics> parse_urdf(std::string_view text,
                                                               const std::string& file,
                                                               const UrdfOptions& options);

}  // namespace tandem::model
