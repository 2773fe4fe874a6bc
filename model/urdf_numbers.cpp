#include "model/urdf_numbers.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace tandem::model {
namespace {

constexpr double kLargestNumber = 1e30;
constexpr std::string_view kBlanks = " \t\r\n";

}  // namespace

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  std::size_t at = 0;
  while ((at = text.find_first_not_of(kBlanks, at)) != std::string_view::npos) {
    const std::size_t end = std::min(text.find_first_of(kBlanks, at), text.size());
    words.emplace_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

NumberText number_of(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  const char* const end = word.data() + word.size();
  double value = 0.0;
  const auto [stop, failure] = std::from_chars(word.data(), end, value);
  if (failure == std::errc::invalid_argument || stop != end) return {};
  if (failure != std::errc{}) {  // too large; or too small, which std::from_chars calls the same
    const bool small = word.find("e-") != word.npos || word.find("E-") != word.npos;
    const double size = small ? 0.0 : std::numeric_limits<double>::infinity();
    return {NumberKind::kEndless, word.starts_with('-') ? -size : size};
  }
  return {std::abs(value) <= kLargestNumber ? NumberKind::kFinite : NumberKind::kEndless, value};
}

}  // namespace tandem::model
