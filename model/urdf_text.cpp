// Encodings by mark and declaration, references to characters, and what xacro left: <xacro:...>,
// ${...} and $(...), the first with the number of the others.
#include "model/urdf_text.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <filesystem>

#include "base/quoting.hpp"

namespace tandem::model {
namespace {

using std::string_view_literals::operator""sv;
using tinyxml2::XMLElement;

/// Whether XML 1.0 has this character.
bool is_xml_character(std::uint32_t code) {
  return code == 0x9 || code == 0xA || code == 0xD || (code >= 0x20 && code < 0xD800) ||
         (code >= 0xE000 && code < 0xFFFE) || (code >= 0x10000 && code < 0x110000);
}

/// Reference that `text` begins with: "&#" to ";", or up to 20 bytes where it has none.
std::string_view reference_at(std::string_view text) {
  constexpr std::size_t kLongest = 20;
  const std::size_t end = text.substr(0, kLongest).find_first_of(";\"'<>\n");
  if (end == std::string_view::npos) return text.substr(0, kLongest);
  return text.substr(0, text[end] == ';' ? end + 1 : end);
}

/// Whether a reference, "&#65;" or "&#x41;", stands for a character.
bool is_character(std::string_view reference) {
  if (!reference.ends_with(';')) return false;
  const bool hexadecimal = reference.substr(2).starts_with('x');
  const char* const first = reference.data() + (hexadecimal ? 3 : 2);
  const char* const last = reference.data() + reference.size() - 1;
  std::uint32_t code = 0;
  const auto read = std::from_chars(first, last, code, hexadecimal ? 16 : 10);
  return read.ec == std::errc{} && read.ptr == last && is_xml_character(code);
}

/// What xacro left in an element's attributes, or empty.
std::string left_in(const XMLElement& e) {
  for (const auto* a = e.FirstAttribute(); a != nullptr; a = a->Next()) {
    const std::string_view value = a->Value();
    if (value.contains("${") || value.contains("$(")) return std::string(value);
  }
  return {};
}

class Search {
 public:
  explicit Search(const std::string& file) : file_(file) {}

  std::optional<Error> run(const XMLElement& robot) {
    for (const XMLElement* e = robot.FirstChildElement(); e; e = e->NextSiblingElement()) {
      const std::string_view name = e->Name();
      const bool matters = name == "link" || name == "joint";
      if (name.starts_with("xacro:") || matters) {
        const char* own = matters ? e->Attribute("name") : nullptr;
        key_ = std::string(name) + (own == nullptr ? "" : " " + std::string(own));
        visit(*e, matters);
      }
    }
    if (first_ && places_ > 1) {
      first_->message += places_ == 2 ? ", as in one more place"
                                      : ", as in " + std::to_string(places_ - 1) + " more places";
    }
    return first_;
  }

 private:
  /// The depth is bounded: the parser refuses what is nested deeper.
  void visit(const XMLElement& e, bool attributes) {
    const std::string_view name = e.Name();
    if (name.starts_with("xacro:")) {
      return found(e, "<" + std::string(name) + "> is xacro, not URDF");
    }
    attributes = attributes && name != "visual" && name != "collision";
    if (attributes) {
      if (const std::string left = left_in(e); !left.empty()) {
        found(e, "'" + left + "' was left by xacro");
      }
    }
    for (const XMLElement* c = e.FirstChildElement(); c; c = c->NextSiblingElement()) {
      visit(*c, attributes);
    }
  }

  void found(const XMLElement& e, std::string message) {
    if (++places_ > 1) return;
    first_ = Error{.message = std::move(message),
                   .hint = "expand the xacro first: xacro FILE > robot.urdf",
                   .file = file_,
                   .line = e.GetLineNum(),
                   .key = key_};
  }

  const std::string& file_;
  std::string key_;
  std::optional<Error> first_;
  int places_ = 0;
};

}  // namespace

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

std::optional<Error> find_wrong_reference(std::string_view text, const std::string& file) {
  for (std::size_t at = 0; (at = text.find_first_of("<&", at)) != std::string_view::npos; ++at) {
    const std::string_view rest = text.substr(at);
    const char* const end = rest.starts_with("<!--")        ? "-->"
                            : rest.starts_with("<![CDATA[") ? "]]>"
                                                            : nullptr;
    if (end != nullptr) at = std::min(text.find(end, at), text.size() - 1);
    if (!rest.starts_with("&#") || is_character(reference_at(rest))) continue;
    const auto lines = std::ranges::count(text.substr(0, at), '\n');
    return Error{.message = "the character reference '" + std::string(reference_at(rest)) +
                            "' stands for no character",
                 .hint = "write the character itself, in UTF-8",
                 .file = file,
                 .line = 1 + static_cast<int>(lines),
                 .key = {}};
  }
  return std::nullopt;
}

std::optional<Error> find_xacro(const XMLElement& robot, const std::string& file) {
  return Search(file).run(robot);
}

}  // namespace tandem::model
