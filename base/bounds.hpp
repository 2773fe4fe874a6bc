// How much is read of what others wrote. Libraries that read recurse and allocate, so what is
// beyond is refused before they get it. docs/bounds.md lists the figures.
// Layer: base.  Thread: any.
#pragma once

#include <cstddef>
#include <string_view>

#include "base/result.hpp"

namespace tandem {

/// The most that is read of something.
struct Bound {
  std::size_t most;
  std::string_view unit;  ///< "levels of tables and lists"
  std::string_view of;    ///< "TOML": where it holds
};

namespace bounds {
#define TANDEM_BOUND(name, most, unit, of) inline constexpr Bound name{most, unit, of};
#include "base/bounds.inc"
#undef TANDEM_BOUND
}  // namespace bounds

inline constexpr Bound kBounds[] = {
#define TANDEM_BOUND(name, most, unit, of) bounds::name,
#include "base/bounds.inc"
#undef TANDEM_BOUND
};

/// "more than 32 levels of tables and lists", at its place.
[[nodiscard]] Error beyond(const Bound& bound, std::string file = {}, int line = 0,
                           std::string key = {});

/// Appends an error, or counts it in the list's last one when bounds::kErrors are listed.
void add_error(Diagnostics& errors, Error error);

/// Whether TOML's parser may have the text: how deep keys, tables and lists are in each other, and
/// how many and how long they are. What is no TOML is left to the parser.
[[nodiscard]] Status check_toml_bounds(std::string_view text, const std::string& file);

}  // namespace tandem
