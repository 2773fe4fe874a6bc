// Masses and inertias that robot.toml gives instead of the description.
// Layer: model, private to urdf*.cpp.  Thread: non-RT only.
#pragma once

#include <string>

#include "model/urdf.hpp"
#include "model/urdf_outline.hpp"

namespace tandem::model {

/// The override of a link, or null.
[[nodiscard]] const LinkOverride* find_override(const UrdfOptions& options,
                                                const std::string& link);

/// Its place, for messages.
[[nodiscard]] const std::string& file_of(const UrdfOptions& options, const LinkOverride& given);
[[nodiscard]] std::string key_of(const LinkOverride& given);

/// `described` with what the override gives; both in the link's frame.
[[nodiscard]] Inertia overridden(const Inertia& described, const LinkOverride& given);

/// Reports overrides of links that are not there, each with the nearest.
void check_overrides(const UrdfOptions& options, const Outline& outline, Diagnostics& errors);

}  // namespace tandem::model
