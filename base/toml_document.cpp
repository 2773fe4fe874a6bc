// A file as a whole.
#include <utility>

#include "base/bounds.hpp"
#include "base/open_file.hpp"
#include "base/toml_shared.hpp"

namespace tandem {
namespace {

/// `KEY = "WORD"` for a line that reads `KEY = WORD`, else empty.
std::string quoted_line(std::string_view text, std::size_t number) {
  for (; number > 1 && text.contains('\n'); --number) text.remove_prefix(text.find('\n') + 1);
  text = text.substr(0, text.find_first_of("\r\n#"));
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos) return {};
  const auto trimmed = [](std::string_view part) {
    const std::size_t from = part.find_first_not_of(" \t");
    return from == std::string_view::npos
               ? std::string()
               : std::string(part.substr(from, part.find_last_not_of(" \t") + 1 - from));
  };
  const std::string word = trimmed(text.substr(equals + 1));
  if (word.empty() || word.find_first_of("\"'[]{},") != std::string::npos) return {};
  return trimmed(text.substr(0, equals)) + " = \"" + word + "\"";
}

}  // namespace

Result<TomlDocument> TomlDocument::load(const std::string& file, const char* of_xml,
                                        const std::vector<TomlSetting>& settings) {
  if (file.empty()) {
    return std::unexpected(Error{"the file's name is empty", "name a .toml file", {}, 0, {}});
  }
  const Result<std::string> text = read_file(file, "name a .toml file", kMostTomlBytes);
  if (!text) return std::unexpected(text.error());
  if (text->find_first_not_of(" \t\r\n") == std::string::npos) {
    return std::unexpected(Error{"the file is empty", "name another, or write it", file, 0, {}});
  }
  return parse(*text, file, of_xml, settings);
}

Result<TomlDocument> TomlDocument::parse(std::string_view text, const std::string& file,
                                         const char* of_xml,
                                         const std::vector<TomlSetting>& settings) {
  if (const std::size_t first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
      first != std::string_view::npos && text[first] == '<') {
    return std::unexpected(Error{"this is XML, not TOML", of_xml, file, 1, {}});
  }
  if (Status within = check_toml_bounds(text, file); !within)
    return std::unexpected(within.error());
  if (!settings.empty()) {
    auto set = with_settings(text, settings);
    if (!set) return std::unexpected(set.error());
    auto document = parse(set->text, file, of_xml);
    if (document) document->shared_->set = std::move(*set);
    return document;
  }
  TomlDocument document;
  document.shared_ = std::make_shared<TomlTable::Shared>();
  document.shared_->file = file;
  document.shared_->text = text;
  try {
    document.shared_->root = toml::parse(text, file);
  } catch (const toml::parse_error& e) {
    const bool encoding = e.description().find("utf-8") != std::string_view::npos;
    const bool twice = e.description().find("redefine existing table") != std::string_view::npos;
    const bool wide = e.description().find("representable in 64 bits") != std::string_view::npos;
    const std::string quoted = quoted_line(text, e.source().begin.line);
    const bool value = e.description().find("parsing value") != std::string_view::npos;
    return std::unexpected(Error{"not valid TOML: " + std::string(e.description()),
                                 encoding ? "save the file as UTF-8"
                                 : twice  ? "of several write each as [[NAME]], or remove one"
                                 : wide   ? "an integer is at most 9223372036854775807"
                                 : value && !quoted.empty() ? "a text stands in quotes: " + quoted
                                                            : "correct the syntax at this line",
                                 file,
                                 static_cast<int>(e.source().begin.line),
                                 {}});
  }
  return document;
}

TomlTable TomlDocument::root() const { return {shared_, &shared_->root, {}, 1}; }
const Diagnostics& TomlDocument::diagnostics() const { return shared_->diagnostics; }
const std::string& TomlDocument::file() const { return shared_->file; }
const std::string& TomlDocument::text() const { return shared_->text; }
std::string TomlDocument::folder() const { return root().folder(); }

}  // namespace tandem
