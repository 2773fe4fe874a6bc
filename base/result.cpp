// An Error as one line, "file:line: key: message (hint)", and the order in which many are shown.
#include "base/result.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace tandem {

std::string Error::to_string() const {
  std::string text;
  if (!file.empty()) {
    text += file;
    if (line > 0) text += ":" + std::to_string(line);
    text += ": ";
  }
  if (!key.empty()) text += key + ": ";
  text += message;
  if (!hint.empty()) text += " (" + hint + ")";
  return text;
}

void sort_by_line(Diagnostics& errors) {
  std::vector<std::size_t> order(errors.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(
      order, {}, [&](std::size_t i) { return std::tuple(errors[i].line == 0, errors[i].line, i); });
  Diagnostics sorted;
  for (const std::size_t i : order) sorted.push_back(std::move(errors[i]));
  errors = std::move(sorted);
}

}  // namespace tandem
