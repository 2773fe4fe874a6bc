// Words in the names of links and joints.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

namespace tandem::scaffold {

[[nodiscard]] inline std::string lower(std::string_view name) {
  std::string result(name);
  std::ranges::transform(result, result.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

/// Whether `word` (lower case) occurs anywhere in the name.
[[nodiscard]] inline bool mentions(std::string_view name, std::string_view word) {
  return lower(name).find(word) != std::string::npos;
}

/// Whether `word` stands by itself: between separators, digits, or changes of case ("left_ft",
/// "FT_LFoot", "ftSensor", not "soft").
[[nodiscard]] inline bool has_word(std::string_view name, std::string_view word) {
  const std::string low = lower(name);
  const auto letter = [&](std::size_t i) {
    return std::isalpha(static_cast<unsigned char>(name[i])) != 0;
  };
  const auto capital = [&](std::size_t i) {
    return std::isupper(static_cast<unsigned char>(name[i])) != 0;
  };
  for (std::size_t at = low.find(word); at != std::string::npos; at = low.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    const bool begins = at == 0 || !letter(at - 1) || (capital(at) && !capital(at - 1));
    const bool ends = end == name.size() || !letter(end) || (capital(end) && !capital(end - 1));
    if (begins && ends) return true;
  }
  return false;
}

}  // namespace tandem::scaffold
