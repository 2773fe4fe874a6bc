// The lines of a data sheet: sections with keys and values, as CiA 306 takes them from INI files.
// Layer: canopen.  Thread: non-RT only.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace tandem::canopen {

/// One line "key=value", both without the blanks around them.
struct IniPair {
  std::string_view key;
  std::string_view value;
  int line = 0;
};

/// "[name]" and the pairs below it.
struct IniSection {
  std::string_view name;
  int line = 0;
  std::vector<IniPair> pairs;

  /// The pair of this key, in whatever case it is written; nullptr: none. Linear.
  [[nodiscard]] const IniPair* find(std::string_view key) const noexcept;
  /// The value; empty when the key is missing.
  [[nodiscard]] std::string_view value(std::string_view key) const noexcept;
  /// An error at this key, or at the section when the key is missing or empty.
  [[nodiscard]] Error error(std::string_view key, std::string message, std::string hint) const;
};

/// Remarks on a text, "line 12: …"; beyond a hundred they are only counted.
class Remarks {
 public:
  /// @param line  0: of the whole text
  void add(int line, const std::string& text);
  [[nodiscard]] std::vector<std::string> take();

 private:
  std::vector<std::string> texts_;
  std::size_t more_ = 0;
};

/// The sections in the order of the text, which must outlive them. Lines end with LF or CR LF;
/// those that begin with ; or # are comments. A section or key may come twice.
/// Errors: a zero byte; a bracket that is not closed; the text ends in the middle of a line.
/// @param remarks  takes what else is odd
[[nodiscard]] Result<std::vector<IniSection>> read_ini(std::string_view text, Remarks& remarks);

/// Errors: a key twice in a section with different values.
[[nodiscard]] Status check_keys(std::span<const IniSection> sections, Remarks& remarks);

/// Whether both are the same but for the case of ASCII letters.
[[nodiscard]] bool same_word(std::string_view a, std::string_view b) noexcept;
/// The text with small ASCII letters.
[[nodiscard]] std::string small_letters(std::string_view text);
/// As UTF-8 without control characters, for names and messages: what is not UTF-8 is taken for
/// Latin-1, and of a long text the beginning.
[[nodiscard]] std::string printable(std::string_view text, std::size_t most_bytes = 200);
/// Without blanks at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text) noexcept;

}  // namespace tandem::canopen
