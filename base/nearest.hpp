// "Did you mean …?": the nearest of the names that would have been right.
// Layer: base.  Thread: non-RT only.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace tandem {

/// Longest name that is compared, and most candidates that it is compared with: a word that nobody
/// knows costs 1.6 million steps at most, some milliseconds, whoever sent it.
inline constexpr std::size_t kMostNamed = 64, kMostLooked = 256;

/// The candidate with the smallest edit distance to `name` (case-insensitive, transpositions
/// count once), or empty when none is near enough to be a slip of the finger. A name
/// without its unit (`mass` for `mass_kg`) is near enough.
[[nodiscard]] std::string nearest(std::string_view name, std::span<const std::string> candidates);

/// "did you mean 'x'?" or, when nothing is near, "known: a, b, c" (at most `most` names).
[[nodiscard]] std::string suggest(std::string_view name, std::span<const std::string> candidates,
                                  std::size_t most = 12);

}  // namespace tandem
