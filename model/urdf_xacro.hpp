// Whether a URDF still holds what xacro should have replaced.
// Layer: model, private to urdf*.cpp.  Thread: non-RT only.
#pragma once

#include <tinyxml2.h>

#include <optional>
#include <string>

#include "base/result.hpp"

namespace tandem::model {

/// One error for the whole file, at the first element of xacro's or the first attribute with
/// `${…}` or `$(…)` that matters: one of a link or joint, but not in visuals and collisions.
[[nodiscard]] std::optional<Error> find_xacro(const tinyxml2::XMLElement& robot,
                                              const std::string& file);

}  // namespace tandem::model
