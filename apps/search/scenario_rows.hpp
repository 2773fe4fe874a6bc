// A scenario's text, taken apart into what happens in it and the rest, and put together again.
// Layer: apps/search.  Thread: main.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace tandem::apps {

/// The kinds of rows that can be left out: "[[push]], [[fault]], …".
[[nodiscard]] std::string row_kinds_text();

/// Something that happens: a row of one of these kinds.
struct ScenarioRow {
  std::size_t place = 0;  ///< among the rows of the file
  std::string text;       ///< header, keys, and the comment above them
  std::string kind{};     ///< "push"

  bool operator==(const ScenarioRow&) const = default;
};
using ScenarioRows = std::vector<ScenarioRow>;

/// The text of an experiment. Comments, order and layout are kept.
class ScenarioText {
 public:
  /// Errors: no TOML; such rows in a list in brackets, which has no lines of its own to leave out.
  /// @param file  names it in errors
  [[nodiscard]] static Result<ScenarioText> read(const std::string& text, const std::string& file);

  [[nodiscard]] const ScenarioRows& rows() const { return rows_; }
  /// The rows that may come at any time of a run: all but what is there when it begins.
  [[nodiscard]] static std::vector<std::string> later_kinds();
  /// The experiment without those.
  [[nodiscard]] std::string without_later() const;
  /// The experiment with these of its rows, which may have other texts.
  [[nodiscard]] std::string with(const ScenarioRows& rows) const;

 private:
  ScenarioRows rows_;
  std::vector<std::string> between_;  // [i] stands before row i, the last behind all
};

/// Simpler texts of a row, each with another value of one key: smaller, shorter, with fewer digits,
/// or without the key where its default is simpler. The simplest first; empty: there are none.
/// @param key  one of keys_of_row()
[[nodiscard]] std::vector<std::string> simpler_rows(const std::string& row, const std::string& key);
/// The keys of a row that may become simpler, those that make it weaker last: a row at its weakest
/// would not fail without them any more.
[[nodiscard]] std::vector<std::string> keys_of_row(const std::string& row);

/// A number, or a list of them, of TOML, times a factor, with nine digits; empty: it is none.
[[nodiscard]] std::optional<std::string> scaled_value(const std::string& value, double factor);

/// An experiment's text as it has to be in another folder: what names a file relative to its own
/// does so from there. A value counts as such a name when the file is there.
[[nodiscard]] Result<std::string> relocated(const std::string& text, const std::string& file,
                                            const std::string& new_file);

}  // namespace tandem::apps
