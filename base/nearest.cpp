// Edit distance with transpositions; a missing unit suffix (_rad, _Nm) counts as two edits.
#include "base/nearest.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>

namespace tandem {
namespace {

/// Entries of a row of distances between a name and a candidate near it: too_far() of the longest
/// name is 33.
constexpr std::size_t kMostRow = kMostNamed + kMostNamed / 2 + 2;

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

/// With three letters one edit is a slip, and two are another word: "foo" and "on".
std::size_t too_far(std::string_view name) { return std::max<std::size_t>(1, name.size() / 2) + 1; }

/// Optimal string alignment distance. @pre both are shorter than kMostRow
std::size_t distance(std::string_view a, std::string_view b) {
  std::array<std::uint8_t, kMostRow> before{}, last{}, row{};  // two rows ago, one, now
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = static_cast<std::uint8_t>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = static_cast<std::uint8_t>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      int d = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
                           lower(a[i - 2]) == lower(b[j - 1]);
      if (swapped) d = std::min(d, before[j - 2] + 1);
      row[j] = static_cast<std::uint8_t>(d);
    }
    before = last;
    last = row;
  }
  return last[b.size()];
}

/// The distance, or what a lacking unit counts, in half edits; twice too_far() when it is not worth
/// looking.
std::size_t nearness(std::string_view name, std::string_view candidate) {
  const std::size_t far = too_far(name);
  const bool lacks_unit = !name.empty() && candidate.size() > name.size() &&
                          candidate[name.size()] == '_' && candidate.starts_with(name);
  const std::size_t least = candidate.size() > name.size() ? candidate.size() - name.size()
                                                           : name.size() - candidate.size();
  const std::size_t unit = lacks_unit ? std::min<std::size_t>(4, 2 * far - 1) : 2 * far;
  return least >= far ? unit : std::min(2 * distance(name, candidate), unit);
}

struct Best {
  std::string_view name;
  std::size_t count = 0;  ///< of those as near
};

Best best_of(std::string_view name, std::span<const std::string> candidates) {
  Best best;
  if (name.size() > kMostNamed) return best;
  std::size_t least = 2 * too_far(name);
  for (const std::string& candidate : candidates.first(std::min(candidates.size(), kMostLooked))) {
    const std::size_t d = nearness(name, candidate);
    if (d == least && best.count > 0) ++best.count;
    if (d >= least) continue;
    least = d;
    best = {candidate, 1};
  }
  return best;
}

}  // namespace

std::string nearest(std::string_view name, std::span<const std::string> candidates) {
  return std::string(best_of(name, candidates).name);
}

std::string suggest(std::string_view name, std::span<const std::string> candidates,
                    std::size_t most) {
  const Best best = best_of(name, candidates);
  // "category3" is as near to "category0" as to "category1", and means neither: all are listed.
  if (best.count == 1) return "did you mean '" + std::string(best.name) + "'?";
  if (candidates.empty()) return {};
  std::string text = "known: ";
  for (std::size_t i = 0; i < std::min(most, candidates.size()); ++i) {
    text += (i == 0 ? "" : ", ") + candidates[i];
  }
  if (candidates.size() > most) text += ", …";
  return text;
}

}  // namespace tandem
