// Strict reading of TOML: every key is typed, ranged and expected; every error has a line.
// Layer: base.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "base/toml_setting.hpp"

namespace toml {
inline namespace v3 {
class node;
class table;
}  // namespace v3
}  // namespace toml

namespace tandem {

/// Closed interval that a number must lie in, in the unit of its key.
struct Range {
  double min = -std::numeric_limits<double>::max();
  double max = std::numeric_limits<double>::max();
  bool open_min = false;  ///< true: `min` itself is refused
};
inline constexpr Range kAnyNumber{};
inline constexpr Range kPositive{0.0, std::numeric_limits<double>::max(), true};
inline constexpr Range kNotNegative{0.0, std::numeric_limits<double>::max(), false};

/// A key's value, and who gave it.
template <class Value>
struct Given {
  Value value{};
  int line = 0;           ///< of the key; 0: the file does not give it
  bool of_sheet = false;  ///< the drive's data sheet gave it

  operator const Value&() const noexcept { return value; }
  Given& operator=(const Value& other) {
    value = other;
    return *this;
  }
};

/// One table of a TOML file, read key by key.
///
/// A getter that meets a missing key without default, a wrong type, a number that is not finite
/// or out of range, appends an Error (file, line, dotted key, hint) to the document's
/// diagnostics and returns the default, or an empty value. `finish()` reports the keys that
/// nobody asked for, with the nearest known one. So one reading finds every error, each once.
class TomlTable {
 public:
  [[nodiscard]] double number(std::string_view key, Range range = kAnyNumber);
  [[nodiscard]] double number_or(std::string_view key, double value, Range range = kAnyNumber);
  [[nodiscard]] std::int64_t integer(std::string_view key, std::int64_t min, std::int64_t max);
  [[nodiscard]] std::int64_t integer_or(std::string_view key, std::int64_t value, std::int64_t min,
                                        std::int64_t max);
  [[nodiscard]] bool boolean_or(std::string_view key, bool value);
  [[nodiscard]] std::string text(std::string_view key);
  [[nodiscard]] std::string text_or(std::string_view key, std::string value);
  /// One of `allowed`; anything else is an error that suggests the nearest.
  [[nodiscard]] std::string choice(std::string_view key, const std::vector<std::string>& allowed);
  [[nodiscard]] std::string choice_or(std::string_view key, std::string value,
                                      const std::vector<std::string>& allowed);
  /// Exactly `size` numbers (any count when `size` is 0).
  [[nodiscard]] std::vector<double> numbers(std::string_view key, std::size_t size,
                                            Range range = kAnyNumber);
  /// @param size  how many they must be; 0: any count
  [[nodiscard]] std::vector<double> numbers_or(std::string_view key, std::vector<double> value,
                                               Range range = kAnyNumber, std::size_t size = 0);
  [[nodiscard]] std::vector<std::string> texts_or(std::string_view key,
                                                  std::vector<std::string> value);
  /// The elements of a list of numbers, texts or booleans, each in TOML: for a --set.
  [[nodiscard]] std::vector<std::string> value_texts(std::string_view key);
  /// A list of equal-length rows: [[x, y, z], …]. No columns: as many as the first one has.
  [[nodiscard]] std::vector<std::vector<double>> rows(std::string_view key, std::size_t columns);

  [[nodiscard]] bool has(std::string_view key) const;
  /// Whether the key is there and holds a text: for a number that may also be a word.
  [[nodiscard]] bool is_text(std::string_view key) const;
  /// The sub-table `key`; an empty one, after an error, when it is missing or no table.
  [[nodiscard]] TomlTable table(std::string_view key);
  /// The sub-table `key`; an empty one without error when it is missing. A key that is then
  /// required of it is still an error, at this table's line.
  [[nodiscard]] TomlTable table_or_empty(std::string_view key);
  /// The sub-table `key` as JSON in a line, for who checks its keys by himself; numbers that are
  /// not finite become texts. Empty, after an error, when it is missing or no table.
  [[nodiscard]] std::string json(std::string_view key);
  /// The array of tables [[key]] in the order of the file; empty when it is missing.
  /// @param named_by  the key whose value names one in errors that has no `name`, unless it is a
  ///                  path
  [[nodiscard]] std::vector<TomlTable> tables(std::string_view key, std::string_view named_by = {});
  /// Every key of this table itself, sorted; marks none as read. For free-form maps (posture.home)
  /// and tables of tables ([actuator.NAME]).
  [[nodiscard]] std::vector<std::string> keys() const;
  /// Every value of this table itself and of the tables in it, by its key from here on, "a.b[0].c":
  /// for comparing two tables. Numbers are the shortest that reads the same, whether written as 12
  /// or 12.0; a table without any is `{}`. Marks none as read.
  [[nodiscard]] std::map<std::string, std::string> values() const;

  /// From now on the keys that this table lacks are those of `defaults`: a sub-table or list as a
  /// whole. What is wrong with one of them is reported there, and once.
  void inherit(const TomlTable& defaults);
  /// From now on a key that is missing is no error: a table of defaults need not be whole.
  void make_partial() { partial_ = true; }
  [[nodiscard]] bool is_partial() const { return partial_; }

  /// Reports an error of the caller's own at `key` (or at the table when empty). The same error
  /// twice is one.
  void error(std::string_view key, std::string message, std::string hint = {});
  /// Whether an error of one of its keys has been reported, its defaults' included.
  [[nodiscard]] bool has_errors() const;
  /// Whether one has been reported of this key.
  [[nodiscard]] bool has_errors(std::string_view key) const;
  /// The same error without reporting it.
  [[nodiscard]] Error error_at(std::string_view key, std::string message,
                               std::string hint = {}) const;
  /// Reports every key that no getter asked for; where one of them looks like a required key that
  /// is missing, that is not reported beside it.
  void finish();
  /// In its place, before reading: `known` are the keys that may be there.
  /// @return false: one of those reported is a table. What it holds is not where it is looked for.
  [[nodiscard]] bool holds_only(const std::vector<std::string>& known);
  /// Whether it holds tables and nothing else, as [gains] does: they are [gains.NAME]. The first
  /// key that stands outside one is an error, for all of them.
  [[nodiscard]] bool holds_tables();

  /// The file's folder, for paths given relative to the file; "." when it has none.
  [[nodiscard]] std::string folder() const;
  [[nodiscard]] const std::string& path() const { return path_; }  ///< dotted, "" for the root
  [[nodiscard]] int line() const;
  [[nodiscard]] int line(std::string_view key) const;  ///< of the key's value; else the table's

 private:
  friend class TomlDocument;
  struct Shared;  // the parsed document and its diagnostics
  TomlTable(std::shared_ptr<Shared> shared, const toml::table* table, std::string path, int line);
  const toml::node* get(std::string_view key) const;
  const toml::node* find(std::string_view key);
  const toml::node* require(std::string_view key);
  void report_unknown(std::string_view key, const std::vector<std::string>& known);
  bool check_number(std::string_view key, const toml::node& node, Range range, double& out);
  [[nodiscard]] std::string dotted(std::string_view key) const;

  std::shared_ptr<Shared> shared_;
  const toml::table* table_;
  std::string path_;
  int line_;                     // of the table, or of the one it is missing from
  const toml::table* defaults_;  // empty without inherit()
  std::string defaults_path_;
  bool partial_ = false;
  std::set<std::string, std::less<>> asked_;
  mutable std::set<std::string, std::less<>> looked_for_;  // by has(): known, and not read by it
};

/// A parsed file. Copies and tables share it.
class TomlDocument {
 public:
  /// Errors: the file cannot be read; the text is no TOML (with line).
  /// @param of_xml    the hint for a file that is XML
  /// @param settings  what is otherwise than in the file. Their errors, and the reader's of what
  ///                  they set, have the setting in place of file and line
  [[nodiscard]] static Result<TomlDocument> load(const std::string& file, const char* of_xml = "",
                                                 const std::vector<TomlSetting>& settings = {});
  /// The same from memory; `file` only names it in errors. Errors: beyond a bound of bounds.hpp.
  [[nodiscard]] static Result<TomlDocument> parse(std::string_view text, const std::string& file,
                                                  const char* of_xml = "",
                                                  const std::vector<TomlSetting>& settings = {});

  [[nodiscard]] TomlTable root() const;
  [[nodiscard]] const Diagnostics& diagnostics() const;
  [[nodiscard]] const std::string& file() const;
  /// What was read, with its settings: the file may be another by now.
  [[nodiscard]] const std::string& text() const;
  /// The file's folder, for paths given relative to the file; "." when it has none.
  [[nodiscard]] std::string folder() const;

 private:
  std::shared_ptr<TomlTable::Shared> shared_;
};

}  // namespace tandem
