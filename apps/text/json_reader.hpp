// JSON from outside: questions, answers of others.
// Layer: apps/text.  Thread: any.
#pragma once

#include <cstddef>
#include <string_view>

#include "apps/text/console.hpp"
#include "base/bounds.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// Deepest nesting, most values in all and most keys of an object that are read: beyond what any
/// question or answer needs, and below what costs time or stack.
inline constexpr int kDeepestJson = static_cast<int>(bounds::kJsonDepth.most);
inline constexpr std::size_t kMostJsonValues = bounds::kJsonValues.most;
inline constexpr std::size_t kMostJsonKeys = bounds::kJsonKeys.most;

/// One JSON object. Errors: no JSON (with the byte), a number that no double holds, another value
/// than an object, a key twice, nested or longer than the limits. Throws nothing, whatever it gets.
[[nodiscard]] Result<Json> read_json_object(std::string_view text);

}  // namespace tandem::apps
