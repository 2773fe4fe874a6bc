// Mimic joints of a URDF: which joint follows which, and which stand still because of it.
// Layer: model, private to urdf*.cpp.  Thread: non-RT only.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "model/urdf.hpp"
#include "model/urdf_outline.hpp"

namespace tandem::model {

/// What a joint follows, chains of mimics resolved: multiplier * q of `leader` + offset.
struct Following {
  std::string leader;
  double multiplier = 1.0;
  double offset = 0.0;
};

struct Mimics {
  std::map<std::string, Following> followers;  ///< by joint
  /// Joints that stand still: those of UrdfOptions::lock, and what follows one of them or a fixed
  /// joint (or follows with multiplier 0).
  std::vector<std::pair<std::string, double>> still;
};

/// Resolves the mimic joints of `outline` (none when `options.mimic_independent`). A lock of a
/// mimic joint wins over what it mimics.
///
/// Errors are appended: a joint that mimics itself, a ring of mimics, factors that multiply to
/// something that is not finite.
[[nodiscard]] Mimics resolve_mimics(const Outline& outline, const UrdfOptions& options,
                                    const std::string& file, Diagnostics& errors);

/// Sets the followers' `leader`, and narrows every leader's range and speed to what its followers
/// allow. Limits of a follower that leave its leader no way are taken away.
///
/// Appends a warning for each range or speed that became narrower, and for each follower whose
/// limits are not used.
void apply_mimics(const Mimics& mimics, Tree& tree, Diagnostics& warnings);

}  // namespace tandem::model
