#include "studio/mesh_files.hpp"

#include <tinyxml2.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <filesystem>

#include "base/open_file.hpp"

namespace tandem::studio {
namespace {

namespace fs = std::filesystem;

constexpr int kLevels = 5;  // above the description, where its package may be
constexpr std::size_t kLongestName = 1000;
constexpr std::string_view kShown[] = {".stl", ".obj", ".dae"};

void collect(const tinyxml2::XMLElement* element, std::vector<std::string>& names) {
  for (; element != nullptr; element = element->NextSiblingElement()) {
    const char* name =
        std::string_view(element->Name()) == "mesh" ? element->Attribute("filename") : nullptr;
    if (name != nullptr && names.size() < kMostMeshes &&
        std::ranges::find(names, std::string_view(name)) == names.end()) {
      names.emplace_back(name);
    }
    collect(element->FirstChildElement(), names);
  }
}

/// Where a package://NAME is, seen from a folder; empty: nowhere near.
fs::path package_near(fs::path folder, const std::string& name) {
  std::error_code none;
  for (int level = 0; level < kLevels; ++level) {
    if (folder.filename() == name) return folder;
    if (fs::is_directory(folder / name, none)) return folder / name;
    if (folder == folder.parent_path()) break;
    folder = folder.parent_path();
  }
  return {};
}

fs::path package_of(const fs::path& description) {
  std::error_code none;
  const fs::path own = description.parent_path();
  fs::path folder = own;
  for (int level = 0; level < kLevels; ++level) {
    if (fs::is_regular_file(folder / "package.xml", none)) return folder;
    if (folder == folder.parent_path()) break;
    folder = folder.parent_path();
  }
  return own.filename() == "urdf" ? own.parent_path() : own;
}

bool is_below(const fs::path& path, const fs::path& folder) {
  const auto [end, rest] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  return end == folder.end();
}

/// The path of a mesh, and the folder in which it has to be.
struct MeshPlace {
  fs::path path, folder;
};

Result<MeshPlace> place_of(const std::string& name, const fs::path& description) {
  for (const std::string_view scheme : {"package://", "model://"}) {
    if (!name.starts_with(scheme)) continue;
    const std::string rest = name.substr(scheme.size());
    const std::string package = rest.substr(0, rest.find('/'));
    const bool plain = !package.empty() && package != "." && package != "..";
    const fs::path folder = plain ? package_near(description.parent_path(), package) : fs::path();
    if (folder.empty() || package.size() == rest.size()) {
      return fail("its package is not beside or above the description");
    }
    return MeshPlace{folder / fs::path(rest.substr(package.size() + 1)), folder};
  }
  const std::string path = name.starts_with("file://") ? name.substr(7) : name;
  if (path.find("://") != std::string::npos) return fail("it is no file of this machine");
  return MeshPlace{description.parent_path() / path, package_of(description)};
}

}  // namespace

MeshFiles::MeshFiles(const std::string& urdf, const std::string& file) {
  std::error_code none;
  if (!file.empty()) file_ = fs::absolute(file, none).lexically_normal().string();
  tinyxml2::XMLDocument document;
  if (document.Parse(urdf.data(), urdf.size()) != tinyxml2::XML_SUCCESS) return;
  collect(document.FirstChildElement(), names_);
}

Result<std::string> MeshFiles::path_of(std::size_t mesh) const {
  const std::string& name = names_.at(mesh);
  if (file_.empty()) return fail("a log has its name alone");
  if (name.size() > kLongestName) return fail("its name is too long");
  const auto place = place_of(name, file_);
  if (!place) return std::unexpected(place.error());
  std::string ending = place->path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (std::ranges::find(kShown, ending) == std::end(kShown)) {
    return fail("it is neither STL, OBJ nor COLLADA");
  }
  std::error_code error;
  const fs::path path = fs::canonical(place->path, error);
  if (error || !fs::is_regular_file(path, error) || error) return fail("it is not there");
  const fs::path folder = fs::canonical(place->folder, error);
  if (error || !is_below(path, folder)) return fail("it lies outside the description's package");
  const std::uintmax_t size = fs::file_size(path, error);
  if (error || size > kMostMeshBytes) return fail("it has more than 32 MB");
  return path.string();
}

std::string MeshFiles::why_not(std::size_t mesh) const {
  const Result<std::string> path = path_of(mesh);
  return path ? std::string() : path.error().message;
}

Result<std::string> MeshFiles::read(std::size_t mesh) const {
  if (mesh >= names_.size()) return fail("the description has no such mesh");
  const Result<std::string> path = path_of(mesh);
  if (!path) return std::unexpected(path.error());
  return read_file(*path, {}, kMostMeshBytes);
}

std::optional<std::size_t> mesh_number(std::string_view path) {
  if (!path.starts_with(kMeshPath)) return std::nullopt;
  path.remove_prefix(kMeshPath.size());
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(path.data(), path.data() + path.size(), number);
  const bool whole = error == std::errc() && end == path.data() + path.size();
  return whole && number < kMostMeshes ? std::optional(number) : std::nullopt;
}

}  // namespace tandem::studio
