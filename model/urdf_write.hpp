// A URDF's text with other inertias.
// Layer: model.  Thread: non-RT only.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "model/tree.hpp"

namespace tandem::model {

/// `text` with the <inertial> of these links replaced, or added; all else stays, to the byte.
///
/// @param inertias  link and its inertia, in the link's frame, along its axes
/// Errors: no XML; a link that is not there.
[[nodiscard]] Result<std::string> with_inertias(
    std::string_view text, const std::vector<std::pair<std::string, Inertia>>& inertias);

}  // namespace tandem::model
