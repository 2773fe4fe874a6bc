// "This value of this file is another": a key and a value that replace what a TOML text has.
// Layer: base.  Thread: non-RT only.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace tandem {

/// What a caller says instead of a file, as `--set 'push[0].impulse_Ns[0]=-6'`.
struct TomlSetting {
  std::string key;    ///< path from the root: "push[0].impulse_Ns[0]", "controller.hold.active"
  std::string value;  ///< in TOML
  std::string said;   ///< how errors call it: "--set KEY=VALUE"
};

/// Reads KEY=VALUE. A bare word that is no value of TOML is a text: `posture=stand`.
/// Errors: no key, no value, several lines, a value that is none.
[[nodiscard]] Result<TomlSetting> read_setting(std::string_view text);

/// A text with settings, and how its lines and keys belong to those of the file.
struct SetText {
  std::string text;
  std::vector<int> added_lines;  ///< in `text`, ascending: the file lacks them
  /// Path as the reader knows it ("push[0].impulse_Ns[0]"), and who set it. A table that had to be
  /// added is one, too.
  std::vector<std::pair<std::string, std::string>> who;

  /// The file's line of a line of `text`.
  [[nodiscard]] int line_of_file(int line) const;
  /// Who set what stands at `path`, a part of it, or the whole that it is in; empty: nobody.
  [[nodiscard]] std::string said_of(const std::string& path) const;
};

/// Puts each value into its place, as if it stood in the file: a value that is there is replaced, a
/// key that a table lacks is added to it. An entry of an array of tables is called by its number or
/// by its name: `push[0]`, `push."a bump"`. Whether the key means anything is for who reads it.
/// Errors, with the setting as their file: a path that leads nowhere, with the nearest name; a
/// table instead of a value; a text that is no TOML by itself.
[[nodiscard]] Result<SetText> with_settings(std::string_view text,
                                            const std::vector<TomlSetting>& settings);

/// The settings below a key, without it: "robot.x" is "x"; the others stay in `settings`.
[[nodiscard]] std::vector<TomlSetting> take_below(std::string_view key,
                                                  std::vector<TomlSetting>& settings);

}  // namespace tandem
