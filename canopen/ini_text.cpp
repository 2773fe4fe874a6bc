// Splits a sheet's text into lines, and the lines into sections, keys and values.
#include "canopen/ini_text.hpp"

#include <algorithm>
#include <utility>

#include "base/bounds.hpp"
#include "base/utf8.hpp"

namespace tandem::canopen {
namespace {

constexpr std::size_t kMostRemarks = bounds::kSheetRemarks.most;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr char kEndOfFile = 0x1A;  // of DOS

constexpr char small(char c) noexcept {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

/// Reads line by line into the sections.
class IniReader {
 public:
  IniReader(std::string_view text, Remarks& remarks) : rest_(text), remarks_(remarks) {}

  Status read() {
    while (!rest_.empty()) {
      const std::size_t end = rest_.find('\n');
      const std::string_view line = trimmed(rest_.substr(0, end));
      whole_line_ = end != std::string_view::npos;
      rest_ = whole_line_ ? rest_.substr(end + 1) : std::string_view{};
      ++number_;
      if (line.empty() || line.front() == ';' || line.front() == '#') continue;
      const Status taken = line.front() == '[' ? open_section(line) : add_pair(line);
      if (!taken) return taken;
    }
    return {};
  }
  [[nodiscard]] std::vector<IniSection> take() { return std::move(sections_); }

 private:
  std::unexpected<Error> wrong(std::string message, std::string hint) const {
    Error error{.message = std::move(message), .hint = std::move(hint), .file = {}, .key = {}};
    error.line = number_;
    if (!sections_.empty()) error.key = "[" + printable(sections_.back().name) + "]";
    return std::unexpected(std::move(error));
  }

  /// The last line is half of one; or this one is no line of a sheet.
  Status not_a_line(std::string_view line) {
    if (!whole_line_) {
      return wrong("the file ends in the middle of a line",
                   "it seems to be cut off: get the whole file");
    }
    if (line.front() == '[') {
      return wrong("a section's name has no closing bracket", "expected is [NAME]");
    }
    remarks_.add(number_, "is neither [section] nor key=value");
    return {};
  }

  Status open_section(std::string_view line) {
    const std::size_t end = line.find(']');
    if (end == std::string_view::npos) return not_a_line(line);
    sections_.push_back({.name = trimmed(line.substr(1, end - 1)), .line = number_, .pairs = {}});
    return {};
  }

  Status add_pair(std::string_view line) {
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos) return not_a_line(line);
    if (sections_.empty()) {
      remarks_.add(number_, "stands before the first section");
      return {};
    }
    sections_.back().pairs.push_back({.key = trimmed(line.substr(0, equals)),
                                      .value = trimmed(line.substr(equals + 1)),
                                      .line = number_});
    return {};
  }

  std::string_view rest_;
  Remarks& remarks_;
  int number_ = 0;
  bool whole_line_ = true;  // with its end
  std::vector<IniSection> sections_;
};

/// Keys that a section has twice: the same value is tolerated.
Status check_keys_of(const IniSection& section, Remarks& remarks) {
  std::vector<std::pair<std::string, const IniPair*>> keys;
  keys.reserve(section.pairs.size());
  for (const IniPair& pair : section.pairs) keys.emplace_back(small_letters(pair.key), &pair);
  std::ranges::sort(keys);  // those of a key in the order of the lines
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (keys[i].first != keys[i - 1].first) continue;
    const IniPair& first = *keys[i - 1].second;
    const IniPair& second = *keys[i].second;
    if (first.value == second.value) {
      remarks.add(second.line, "the key '" + printable(second.key) + "' comes again");
      continue;
    }
    Error error =
        section.error(second.key,
                      "is here twice, as '" + printable(first.value) + "' in line " +
                          std::to_string(first.line) + " and as '" + printable(second.value) + "'",
                      "keep one of them");
    error.line = second.line;
    return std::unexpected(std::move(error));
  }
  return {};
}

}  // namespace

bool same_word(std::string_view a, std::string_view b) noexcept {
  return std::ranges::equal(a, b, {}, small, small);
}

std::string small_letters(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), small);
  return result;
}

std::string_view trimmed(std::string_view text) noexcept {
  constexpr std::string_view kBlanks = " \t\r\n\f\v";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string printable(std::string_view text, std::size_t most_bytes) {
  const bool latin = !is_utf8(text);
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    // Not in the middle of a character.
    if (result.size() >= most_bytes && (latin || (byte & 0xC0) != 0x80)) return result + "...";
    if (byte < 0x20 || byte == 0x7F) {
      result += ' ';
    } else if (latin && byte >= 0x80) {
      result += static_cast<char>(0xC0 | byte >> 6);
      result += static_cast<char>(0x80 | (byte & 0x3F));
    } else {
      result += c;
    }
  }
  return result;
}

const IniPair* IniSection::find(std::string_view key) const noexcept {
  for (const IniPair& pair : pairs) {
    if (same_word(pair.key, key)) return &pair;
  }
  return nullptr;
}

std::string_view IniSection::value(std::string_view key) const noexcept {
  const IniPair* pair = find(key);
  return pair != nullptr ? pair->value : std::string_view{};
}

Error IniSection::error(std::string_view key, std::string message, std::string hint) const {
  Error error{.message = std::move(message), .hint = std::move(hint), .file = {}, .key = {}};
  error.key = "[" + printable(name) + "]";
  error.line = line;
  if (key.empty()) return error;
  error.key += " " + printable(key);
  if (const IniPair* pair = find(key)) error.line = pair->line;
  return error;
}

void Remarks::add(int line, const std::string& text) {
  if (texts_.size() == kMostRemarks) {
    ++more_;
    return;
  }
  texts_.push_back(line == 0 ? text : "line " + std::to_string(line) + ": " + text);
}

std::vector<std::string> Remarks::take() {
  if (more_ > 0) texts_.push_back("and " + std::to_string(more_) + " more");
  more_ = 0;
  return std::exchange(texts_, {});
}

Result<std::vector<IniSection>> read_ini(std::string_view text, Remarks& remarks) {
  if (text.contains('\0')) {
    return fail("has a zero byte, so it is no text of a data sheet",
                "save it as plain text: ASCII or UTF-8");
  }
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  if (text.ends_with(kEndOfFile)) text.remove_suffix(1);
  IniReader reader(text, remarks);
  if (Status read = reader.read(); !read) return std::unexpected(std::move(read.error()));
  return reader.take();
}

Status check_keys(std::span<const IniSection> sections, Remarks& remarks) {
  for (const IniSection& section : sections) {
    if (Status checked = check_keys_of(section, remarks); !checked) return checked;
  }
  return {};
}

}  // namespace tandem::canopen
