#include "base/xml_scan.hpp"

#include <algorithm>
#include <utility>

namespace tandem {
namespace {

/// Number of a tag's attributes: the equals signs outside of its quotes.
std::size_t attributes_in(std::string_view tag) {
  std::size_t count = 0;
  char quote = '\0';
  for (const char c : tag) {
    if (quote != '\0') {
      quote = c == quote ? '\0' : quote;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '=') {
      ++count;
    }
  }
  return count;
}

}  // namespace

std::optional<std::size_t> behind_no_tag(std::string_view text, std::size_t at) {
  const std::pair<std::string_view, std::string_view> kinds[] = {
      {"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}, {"<!", ">"}};
  for (const auto& [begins, ends] : kinds)
    if (text.substr(at).starts_with(begins)) {
      const std::size_t end = text.find(ends, at + begins.size());
      return end == std::string_view::npos ? text.size() : end + ends.size();
    }
  return {};
}

std::size_t behind_tag(std::string_view text, std::size_t at) {
  char quote = '\0';
  for (; at < text.size(); ++at) {
    const char c = text[at];
    if (quote != '\0') {
      quote = c == quote ? '\0' : quote;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '>') {
      return at + 1;
    }
  }
  return at;
}

Status check_xml_bounds(std::string_view text, const std::string& file, const Bound& most_parts) {
  std::size_t depth = 0, parts = 0;
  for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at)) {
    if (const auto behind = behind_no_tag(text, at)) {
      at = *behind;
      continue;
    }
    const std::size_t end = behind_tag(text, at);
    const std::string_view tag = text.substr(at, end - at);
    const bool closes = tag.starts_with("</");
    const std::size_t attributes = tag.size() > bounds::kXmlTag.most ? 0 : attributes_in(tag);
    parts += closes ? 0 : 1 + attributes;
    if (closes) depth -= depth > 0 ? 1 : 0;
    if (!closes && !tag.ends_with("/>")) ++depth;
    const Bound* const broken = tag.size() > bounds::kXmlTag.most          ? &bounds::kXmlTag
                                : attributes > bounds::kXmlAttributes.most ? &bounds::kXmlAttributes
                                : depth > bounds::kXmlDepth.most           ? &bounds::kXmlDepth
                                : parts > most_parts.most                  ? &most_parts
                                                                           : nullptr;
    if (broken != nullptr) {
      const auto lines = std::ranges::count(text.substr(0, at), '\n');
      return std::unexpected(beyond(*broken, file, 1 + static_cast<int>(lines)));
    }
    at = end;
  }
  return {};
}

std::string without_instructions(std::string_view text) {
  std::string out(text);
  for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at)) {
    const std::size_t end = behind_no_tag(text, at).value_or(behind_tag(text, at));
    const std::string_view one = text.substr(at, end - at);
    const bool declares = one.starts_with("<?xml") && one.size() > 5 &&
                          std::string_view(" \t\r\n?").find(one[5]) != std::string_view::npos;
    if (one.starts_with("<?") && one.ends_with("?>") && one.size() > 3 && !declares) {
      std::replace_if(
          out.begin() + static_cast<std::ptrdiff_t>(at),
          out.begin() + static_cast<std::ptrdiff_t>(end),
          [](char c) { return c != '\n' && c != '\r'; }, ' ');
    }
    at = end;
  }
  return out;
}

}  // namespace tandem
