// From the first output on, each with as many of the next as can be stored with it.
#include "model/stores.hpp"

#include <algorithm>

namespace tandem::model {
namespace {

constexpr std::uint32_t kMost = 4;  // of a vector with AVX2

std::uint32_t vector_of(std::uint32_t count) { return count == 3 ? 2 : std::min(count, kMost); }

}  // namespace

std::vector<OutputStore> stores_of(std::map<std::uint32_t, std::size_t> known,
                                   std::span<const std::uint32_t> array_of, std::size_t longest) {
  std::vector<OutputStore> result;
  while (!known.empty()) {
    const auto [first, at] = *known.begin();
    std::size_t earliest = at, latest = at;
    std::uint32_t count = 0;
    for (const auto& [output, time] : known) {
      earliest = std::min(earliest, time);
      latest = std::max(latest, time);
      const bool joins = output == first + count && array_of[output] == array_of[first] &&
                         latest - earliest <= longest;
      if (count > 0 && (longest == 0 || count == kMost || !joins)) break;
      ++count;
    }
    OutputStore store{first, vector_of(count), 0};
    for (std::uint32_t k = first; k < first + store.count; ++k) {
      store.time = std::max(store.time, known[k]);
      known.erase(k);
    }
    result.push_back(store);
  }
  return result;
}

std::vector<OutputStore> stores_of_runs(const std::vector<bool>& wanted,
                                        std::span<const std::uint32_t> array_of) {
  std::vector<OutputStore> result;
  const auto count = static_cast<std::uint32_t>(wanted.size());
  for (std::uint32_t k = 0, end = 0; k < count; k = end) {
    end = k + 1;
    if (!wanted[k]) continue;
    while (end < count && wanted[end] && array_of[end] == array_of[k]) ++end;
    const std::uint32_t step = vector_of(end - k);
    for (std::uint32_t at = k; at < end; at += step)
      result.push_back({std::min(at, end - step), step, 0});
  }
  return result;
}

}  // namespace tandem::model
