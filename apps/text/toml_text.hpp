// A JSON object as TOML, for parameters that come in a request.
// Layer: apps/text.  Thread: any, non-RT.
#pragma once

#include <string>

#include "apps/text/console.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// A line per key; objects within become inline tables. Errors: a null, which TOML lacks.
/// @pre object.is_object()
[[nodiscard]] Result<std::string> toml_of(const Json& object);

}  // namespace tandem::apps
