// [model.link.NAME] of robot.toml: mass, center of mass and inertia that replace the URDF's.
#include "model/urdf_override.hpp"

#include <algorithm>

#include "base/nearest.hpp"

namespace tandem::model {

const LinkOverride* find_override(const UrdfOptions& options, const std::string& link) {
  const auto found = std::ranges::find(options.links, link, &LinkOverride::link);
  return found == options.links.end() ? nullptr : &*found;
}

const std::string& file_of(const UrdfOptions& options, const LinkOverride& given) {
  return given.file.empty() ? options.overrides_file : given.file;
}

std::string key_of(const LinkOverride& given) {
  return given.key.empty() ? "model.link." + given.link : given.key;
}

Inertia overridden(const Inertia& described, const LinkOverride& given) {
  Inertia result = described;
  if (given.mass_kg) result.mass_kg = *given.mass_kg;
  if (given.com_m) result.com_m = Eigen::Vector3d(given.com_m->data());
  if (given.inertia_kg_m2) {
    const auto& [xx, xy, xz, yy, yz, zz] = *given.inertia_kg_m2;
    result.about_com_kg_m2 << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  } else if (result.mass_kg == 0.0 && given.mass_kg) {
    result.about_com_kg_m2.setZero();
  }
  return result;
}

void check_overrides(const UrdfOptions& options, const Outline& outline, Diagnostics& errors) {
  std::vector<std::string> known;
  for (const OutlineLink& link : outline.links) known.push_back(link.name);
  for (const LinkOverride& given : options.links) {
    if (std::ranges::find(known, given.link) != known.end()) continue;
    errors.push_back({"the description has no link '" + given.link + "'",
                      suggest(given.link, known), file_of(options, given), given.line,
                      key_of(given)});
  }
}

}  // namespace tandem::model
