// The collision shapes of a URDF.
// Layer: model.  Thread: any, non-RT.
#pragma once

#include <tinyxml2.h>

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "model/tree.hpp"

namespace tandem::model {

/// The shape of a <collision> or a <visual>.
[[nodiscard]] Shape shape_of(const tinyxml2::XMLElement& collision);

/// By link. Reads a description whose other parts are right. A shape that cannot be understood, or
/// whose figures are unusable, is a mesh: nothing of the dynamics depends on it.
[[nodiscard]] std::map<std::string, std::vector<Shape>> collision_shapes(std::string_view text);

}  // namespace tandem::model
