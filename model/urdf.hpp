// Reads a URDF strictly: a robot that cannot be simulated is refused, with link or joint, file
// and line. docs/urdf.md says what of URDF is understood.
// Layer: model.  Thread: non-RT only; readers in several threads wait for each other.
#pragma once

#include <array>
#include <expected>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "model/right_angles.hpp"
#include "model/tree.hpp"

namespace tandem::model {

/// Mass and inertia of a link instead of the description's. What is empty stays as described.
struct LinkOverride {
  std::string link;
  std::optional<double> mass_kg{};               ///< 0 without inertia_kg_m2: no inertia either
  std::optional<std::array<double, 3>> com_m{};  ///< in the link's frame
  /// ixx ixy ixz iyy iyz izz about the center of mass, along the axes of the link.
  std::optional<std::array<double, 6>> inertia_kg_m2{};
  int line = 0;  ///< in UrdfOptions::overrides_file, for messages
  // Where an experiment says it: empty in robot.toml.
  std::string file{};  ///< of `line`
  std::string key{};   ///< "parallel.link.torso"
};

struct UrdfOptions {
  bool floating_base = false;
  bool mimic_independent = false;  ///< treat mimic joints as independent; else they follow
  std::vector<std::pair<std::string, double>> lock{};  ///< joint -> fixed position [rad or m]
  bool repair_inertia = false;      ///< take the nearest possible inertia for an impossible one
  bool exact_right_angles = false;  ///< take angles within 1e-5 rad of a right one for it
  std::vector<LinkOverride> links{};
  std::map<std::string, int> lock_lines{};  ///< joint of `lock` -> line in the next
  std::string overrides_file{};  ///< the file that `lock` and `links` stand in, for messages
};

struct UrdfModel {
  Tree tree;
  std::shared_ptr<const std::string> text{};  ///< what was read
  Diagnostics warnings;                       ///< what was tolerated, left out or repaired
  RightAngles right_angles{};                 ///< those that the text writes with few digits
  /// Joint -> why its limits in `tree` are NaN where they are. A joint without limits has none.
  std::map<std::string, std::string> limits_notes{};
};

/// A link below this share of the mass of the body that it is part of may have an impossible
/// inertia: it is used as it stands, with a warning, because public descriptions carry cameras
/// and lids so. The body as a whole must be possible. Repaired are such links, too.
inline constexpr double kNegligibleMassShare = 0.01;

/// The hint of the warning that each repaired inertia has.
inline constexpr const char* kRepaired =
    "by inertia = \"repair\" in [model]; correct it in the URDF";

/// Understands revolute, continuous, prismatic and fixed joints, and a floating one from a root
/// without mass, which is left out: its child is then the floating base. A link without mass, or
/// fixed to another, becomes part of that link's body. Visuals are not looked at, nor is the
/// inertia of what is fixed to the world; collision shapes are taken as far as they can be read.
/// A moving joint's limits are NaN where the description gives none or reversed, negative or zero
/// ones.
///
/// Errors, all of them at once as far as the text can be understood:
///   - the file is missing, unreadable, cut off, no XML, no <robot>;
///   - a name, attribute or element is missing; a number (but a limit) unreadable, NaN or infinite;
///   - two links or joints of one name; a joint to a link that is not there (nearest suggested);
///   - a link with two parents, a loop, two roots, no link at all;
///   - planar or unknown joint types; a floating one elsewhere, or with a fixed base (either may be
///     locked at 0); a joint that mimics itself, rings of mimics; a UTF-16 file; xacro that was not
///     expanded;
///   - a zero axis; a lock on a joint that is missing, fixed or beyond limits; an override of a
///     link that is not there;
///   - negative mass; an inertia that is not positive definite or breaks the triangle inequality
///     (by more than 1e-6 of its largest moment), unless the link's mass is negligible or
///     inertias are repaired;
///   - a moving joint that carries no mass at all, or a floating base without mass.
[[nodiscard]] std::expected<UrdfModel, Diagnostics> read_urdf(const std::string& file,
                                                              const UrdfOptions& options);
/// The same from memory; `file` only names it in errors.
[[nodiscard]] std::expected<UrdfModel, Diagnostics> parse_urdf(std::string_view text,
                                                               const std::string& file,
                                                               const UrdfOptions& options);

/// What is impossible about an inertia, or empty.
[[nodiscard]] std::string inertia_problem(const Inertia& inertia);

}  // namespace tandem::model
