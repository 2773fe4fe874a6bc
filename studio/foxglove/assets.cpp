#include "studio/foxglove/assets.hpp"

#include <algorithm>
#include <cctype>

#include "base/file_beneath.hpp"
#include "base/nearest.hpp"

namespace tandem::studio::foxglove {
namespace {

/// What a description and the meshes in it may name.
constexpr std::string_view kKinds[] = {".bin", ".bmp", ".dae",  ".glb",  ".gltf", ".jpeg",
                                       ".jpg", ".mtl", ".obj",  ".ply",  ".png",  ".stl",
                                       ".tga", ".tif", ".tiff", ".urdf", ".webp"};

bool is_known_kind(std::string_view way) {
  std::string end(way.substr(std::min(way.size(), way.rfind('.'))));
  std::ranges::transform(end, end.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::ranges::find(kKinds, end) != std::end(kKinds);
}

}  // namespace

Result<std::string> read_asset(const std::string& folder, std::string_view uri) {
  constexpr std::string_view kPackage = "package://", kFile = "file://";
  const std::string shown(uri.substr(0, kMostNamed));
  const auto refuse = [&](const std::string& why) {
    return fail(shown + ": " + why,
                "meshes and pictures in the folder of the robot's description are given");
  };
  std::string_view way = uri;
  std::string_view package;
  if (way.starts_with(kPackage)) {
    way.remove_prefix(kPackage.size());
    package = way;
    way.remove_prefix(std::min(way.find('/'), way.size()));
    way.remove_prefix(std::min<std::size_t>(1, way.size()));
  } else if (way.starts_with(kFile)) {
    way.remove_prefix(kFile.size());
    if (!way.starts_with(folder + "/")) return refuse("it is elsewhere");
    way.remove_prefix(folder.size() + 1);
  } else if (way.find("://") != std::string_view::npos) {
    return refuse("nothing is fetched from elsewhere");
  }
  if (!is_known_kind(way)) return refuse("this is neither a mesh nor a picture");
  Result<std::string> found = read_beneath(folder, way, kMostAssetBytes);
  if (!found && !package.empty()) {
    Result<std::string> other = read_beneath(folder, package, kMostAssetBytes);
    if (other) return other;
  }
  if (!found) return refuse(found.error().message);
  return found;
}

}  // namespace tandem::studio::foxglove
