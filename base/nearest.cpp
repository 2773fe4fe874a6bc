// Edit distance with transpositions; a missing unit suffix (_rad, _Nm) counts as two edits.
#include "base/nearest.hpp"

#include <algorithm>
#include <cctype>
#include <vector>

namespace tandem {
namespace {

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

/// Optimal string alignment distance.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (same ? 0U : 1U)});
      const bool swapped = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
                           lower(a[i - 2]) == lower(b[j - 1]);
      if (swapped) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

std::size_t too_far(std::string_view name) { return std::max<std::size_t>(2, name.size() / 2) + 1; }

/// The distance, or what a lacking unit counts.
std::size_t nearness(std::string_view name, const std::string& candidate) {
  const bool lacks_unit = !name.empty() && candidate.starts_with(std::string(name) + "_");
  return std::min(distance(name, candidate), lacks_unit ? 2 : too_far(name));
}

}  // namespace

std::string nearest(std::string_view name, std::span<const std::string> candidates) {
  std::string best;
  std::size_t best_distance = too_far(name);
  for (const std::string& candidate : candidates) {
    const std::size_t d = nearness(name, candidate);
    if (d < best_distance) {
      best_distance = d;
      best = candidate;
    }
  }
  return best;
}

std::string suggest(std::string_view name, std::span<const std::string> candidates,
                    std::size_t most) {
  const std::string best = nearest(name, candidates);
  const auto as_near = [&](const std::string& one) {
    return !best.empty() && nearness(name, one) == nearness(name, best);
  };
  // Of "category0" and "category1" neither is meant by "category3": all are listed.
  if (std::ranges::count_if(candidates, as_near) == 1) return "did you mean '" + best + "'?";
  if (candidates.empty()) return {};
  std::string text = "known: ";
  for (std::size_t i = 0; i < std::min(most, candidates.size()); ++i) {
    text += (i == 0 ? "" : ", ") + candidates[i];
  }
  if (candidates.size() > most) text += ", …";
  return text;
}

}  // namespace tandem
