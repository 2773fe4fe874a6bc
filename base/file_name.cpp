#include "base/file_name.hpp"

#include <algorithm>

namespace tandem {

std::string file_name_problem(std::string_view name) {
  if (name.empty()) return "is empty";
  if (name.size() > kLongestFileName) {
    return "is longer than " + std::to_string(kLongestFileName) + " characters";
  }
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  if (!std::ranges::all_of(name, allowed)) {
    return "has other characters than letters, digits, _, - and .";
  }
  if (name.front() == '.' || name.front() == '-') {
    return std::string("begins with ") + name.front();
  }
  return {};
}

}  // namespace tandem
