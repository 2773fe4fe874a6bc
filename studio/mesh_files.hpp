// The mesh files that a robot's description names, as far as the studio may show them.
// Layer: studio.  Thread: one at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace tandem::studio {

inline constexpr std::size_t kMostMeshes = 500;
inline constexpr std::uintmax_t kMostMeshBytes = std::uintmax_t{32} << 20U;

/// Files are asked for by their number in the description, so that no request names a path. Shown
/// is a regular file (STL, OBJ, COLLADA) of 32 MB at most that lies in the description's package:
/// the folder above it with a package.xml, else the folder above one that is called "urdf", else
/// its own; of package://NAME/… the folder NAME beside or above it. Links are followed before that
/// is looked at.
class MeshFiles {
 public:
  MeshFiles() = default;
  /// @param urdf  the description's text; @param file  its path; empty: of a log, which has no mesh
  MeshFiles(const std::string& urdf, const std::string& file);

  /// Names as the description has them, each once.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// Why one cannot be shown; empty: it can, as it is now.
  [[nodiscard]] std::string why_not(std::size_t mesh) const;
  /// Its bytes. Errors: why_not()'s; it cannot be read.
  [[nodiscard]] Result<std::string> read(std::size_t mesh) const;

 private:
  [[nodiscard]] Result<std::string> path_of(std::size_t mesh) const;

  std::string file_;
  std::vector<std::string> names_;
};

inline constexpr std::string_view kMeshPath = "/mesh/";
/// The number of "/mesh/12"; empty: the path is no mesh's.
[[nodiscard]] std::optional<std::size_t> mesh_number(std::string_view path);

}  // namespace tandem::studio
