// Letters, digits and a few signs only, so that a name from a file cannot become a path.
#include "base/file_name.hpp"

#include <algorithm>

#include "base/utf8.hpp"

namespace tandem {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool is_word(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || is_digit(c) || c == '_';
}

std::string length_problem(std::string_view name) {
  if (name.empty()) return "is empty";
  if (name.size() <= kLongestFileName) return {};
  return "is longer than " + std::to_string(kLongestFileName) + " characters";
}

}  // namespace

std::string file_name_problem(std::string_view name) {
  if (std::string problem = length_problem(name); !problem.empty()) return problem;
  const auto allowed = [](char c) { return is_word(c) || c == '-' || c == '.'; };
  if (!std::ranges::all_of(name, allowed)) {
    return "has other characters than letters, digits, _, - and .";
  }
  if (name.front() == '.' || name.front() == '-') {
    return std::string("begins with ") + name.front();
  }
  return {};
}

std::string topic_name_problem(std::string_view name) {
  if (std::string problem = length_problem(name); !problem.empty()) return problem;
  if (!std::ranges::all_of(name, is_word)) return "has other characters than letters, digits and _";
  return is_digit(name.front()) ? "begins with a digit" : "";
}

std::string shown_name_problem(std::string_view name) {
  if (std::string problem = length_problem(name); !problem.empty()) return problem;
  if (!is_utf8(name)) return "is not UTF-8";
  for (std::size_t i = 0; i < name.size(); ++i) {
    const auto c = static_cast<unsigned char>(name[i]);
    const bool c1 = c == 0xC2 && static_cast<unsigned char>(name[i + 1]) < 0xA0;  // U+0080 to 9F
    if (c < 0x20 || c == 0x7F || c1) return "has control characters";
  }
  return {};
}

std::string interface_name_problem(std::string_view name) {
  constexpr std::size_t kLongest = 15;  // IFNAMSIZ less the closing zero
  if (name.empty()) return "is empty";
  if (name.size() > kLongest) {
    return "is longer than " + std::to_string(kLongest) + " characters, the limit of Linux";
  }
  const auto forbidden = [](char c) {
    return c == '/' || c == ':' || c == 0x7F || static_cast<unsigned char>(c) <= ' ';
  };
  if (std::ranges::any_of(name, forbidden)) return "has a blank, '/' or ':'";
  return name == "." || name == ".." ? "is a folder's name" : "";
}

std::string topic_token(std::string_view name) {
  std::string token(name);
  std::ranges::replace_if(
      token, [](char c) { return !is_word(c); }, '_');
  if (!token.empty() && is_digit(token.front())) token.insert(0, 1, '_');
  return token.substr(0, kLongestFileName);
}

std::string topic_name_hint(std::string_view name) {
  const std::string use = "use letters, digits and _, no digit first";
  return name.empty() ? use : use + ": name = \"" + topic_token(name) + "\"";
}

}  // namespace tandem
