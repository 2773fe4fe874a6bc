#include "runtime/condition/fault_names.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string_view>
#include <utility>

#include "hal/wire_name.hpp"

namespace tandem::runtime {
namespace {

/// Causes by the names of the table: "kBoardSilent" is board_silent.
std::string snake(std::string_view name) {
  std::string out;
  for (const char c : name.substr(1)) {
    if (c >= 'A' && c <= 'Z' && !out.empty()) out += '_';
    out += c;
  }
  return hal::wire_name(out);
}

}  // namespace

std::vector<NamedCauses> named_causes() {
  static constexpr std::pair<const char*, const char*> kRows[] = {
#define TANDEM_FAULT_CAUSE(name, strikes, category, event, number, brief, words, advice) \
  {#name, #event},
#include "hal/fault_causes.inc"
#undef TANDEM_FAULT_CAUSE
  };
  static_assert(std::size(kRows) <= 64, "a bit each");
  std::vector<NamedCauses> all{{"any", 0}};
  const auto add = [&all](const std::string& name, std::uint64_t bit) {
    const auto at = std::ranges::find(all, name, &NamedCauses::name);
    if (at == all.end()) {
      all.push_back({name, bit});
    } else {
      at->causes |= bit;
    }
  };
  for (std::size_t i = 0; i < std::size(kRows); ++i) {
    const std::uint64_t bit = std::uint64_t{1} << i;
    add("any", bit);
    add(snake(kRows[i].first), bit);
    // kFault is the event of most drives' causes: "any" of those is no name.
    if (snake(kRows[i].second) != "fault") add(snake(kRows[i].second), bit);
  }
  return all;
}

}  // namespace tandem::runtime
