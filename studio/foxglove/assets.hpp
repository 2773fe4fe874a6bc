// The files that a robot's description names: meshes and their pictures.
// Layer: studio/foxglove.  Thread: any.
#pragma once

#include <string>
#include <string_view>

#include "base/result.hpp"

namespace tandem::studio::foxglove {

inline constexpr std::uint64_t kMostAssetBytes = std::uint64_t{16} << 20;

/// The bytes of a mesh or a picture in the folder of a description, or below it. Nothing else is
/// read, whatever the URI says.
/// @param folder  of the description
/// @param uri     "package://NAME/meshes/foot.stl" (the package is the folder, or one in it),
///                "meshes/foot.stl", "file:///the/folder/meshes/foot.stl"
/// Errors: another URI, another kind of file, one that is not there or has more than
/// kMostAssetBytes.
[[nodiscard]] Result<std::string> read_asset(const std::string& folder, std::string_view uri);

}  // namespace tandem::studio::foxglove
