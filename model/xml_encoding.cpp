#include "model/xml_encoding.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "base/quoting.hpp"

namespace tandem::model {

using std::string_view_literals::operator""sv;

std::string wide_encoding(std::string_view text) {
  struct Sign {
    std::string_view begins;
    const char* encoding;
  };
  // Longer ones first: UTF-32's little-endian mark begins as UTF-16's.
  static constexpr Sign kSigns[] = {{"\xFF\xFE\0\0"sv, "UTF-32"}, {"\0\0\xFE\xFF"sv, "UTF-32"},
                                    {"<\0\0\0"sv, "UTF-32LE"},    {"\0\0\0<"sv, "UTF-32BE"},
                                    {"\xFF\xFE"sv, "UTF-16"},     {"\xFE\xFF"sv, "UTF-16"},
                                    {"<\0"sv, "UTF-16LE"},        {"\0<"sv, "UTF-16BE"}};
  for (const Sign& sign : kSigns)
    if (text.starts_with(sign.begins)) return sign.encoding;
  return {};
}

std::string declared_encoding(std::string_view text) {
  const std::string_view first = text.substr(0, std::min(text.find("?>"), text.size()));
  std::size_t at = first.find("<?xml");
  if (at == std::string_view::npos) return {};
  at = first.find("encoding", at);
  if (at == std::string_view::npos) return {};
  at = first.find_first_of("\"'", at);
  if (at == std::string_view::npos) return {};
  const std::size_t end = first.find(first[at], at + 1);
  if (end == std::string_view::npos) return {};
  const std::string name(first.substr(at + 1, end - at - 1));
  const auto of_names = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.' || c == ':';
  };
  if (name.size() > 40 || !std::ranges::all_of(name, of_names)) return {};
  std::string low = name;
  std::ranges::transform(low, low.begin(), [](unsigned char c) { return std::tolower(c); });
  const bool plain = low == "utf-8" || low == "utf8" || low == "ascii" || low == "us-ascii";
  return plain ? "" : name;
}

std::string conversion(const std::string& encoding, const std::string& file) {
  const std::filesystem::path path(file);
  const std::string converted = path.stem().string() + "-utf8" + path.extension().string();
  return "convert it: iconv -f " + encoding + " -t UTF-8 " + shell_word(file) + " > " +
         shell_word(converted);
}

}  // namespace tandem::model
