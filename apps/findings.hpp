// Errors and warnings as commands show them.
// Layer: apps.  Thread: any, non-RT.
#pragma once

#include <fmt/core.h>

#include "apps/console.hpp"
#include "model/urdf.hpp"

namespace tandem::apps {

/// Objects with file, line, key, message and hint.
[[nodiscard]] inline Json findings_json(const Diagnostics& findings) {
  Json list = Json::array();
  for (const Error& finding : findings) {
    list.push_back({{"file", finding.file},
                    {"line", finding.line},
                    {"key", finding.key},
                    {"message", finding.message},
                    {"hint", finding.hint}});
  }
  return list;
}

/// Prints those that say of a link's inertia that no body can have it, or that it was replaced:
/// what is simulated is then not quite what the description says.
inline void print_inertia_warnings(const Diagnostics& warnings) {
  for (Error warning : warnings) {
    if (!warning.key.starts_with("link ")) continue;
    if (warning.hint == model::kRepaired) warning.hint += "; correct it in the URDF";
    fmt::print(stderr, "warning: {}\n", warning.to_string());
  }
}

}  // namespace tandem::apps
