// A URDF's text with other inertias, without some limbs, or with joints that stand still.
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

/// `text` without these links and all that hangs on them, and without the joints to them. A joint's
/// name stands for the link that it moves. A joint of `still` stands still whatever it mimics: its
/// <mimic> of a joint that goes away goes, too.
///
/// Errors: no XML; a name that is not there, or the root's; another joint that is left mimics one
/// that goes away.
[[nodiscard]] Result<std::string> without_limbs(std::string_view text,
                                                const std::vector<std::string>& names,
                                                const std::vector<std::string>& still = {});

/// `text` with these joints fixed, whatever they were; all else stays, to the byte.
///
/// @param placements  joint and where its child's frame stands in its parent link's
/// Errors: no XML; a joint that is not there, or lacks a parent or a child.
[[nodiscard]] Result<std::string> with_fixed(
    std::string_view text, const std::vector<std::pair<std::string, Placement>>& placements);

}  // namespace tandem::model
