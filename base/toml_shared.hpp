// What the tables of a parsed file share, and values as text. For the reader alone.
// Layer: base.  Thread: any, one at a time.
#pragma once

#include <map>
#include <set>
#include <string>

// The library asserts what some texts that are no TOML make false, and then reports them: a build
// with assertions must not end by them.
#define TOML_ASSERT(expr) static_assert(true)
#include <toml++/toml.h>

#include "base/toml_reader.hpp"

namespace tandem {

struct TomlTable::Shared {
  toml::table root;
  std::string file, text;
  SetText set;  // whose text is `text`
  Diagnostics diagnostics;
  std::set<std::string> meant;  // keys that a misspelt one stands for: not missing besides
  std::map<std::string, std::string> names;  // of entries of arrays: "joint[0]" is "hip"

  /// A dotted path as errors have it: entries by their names, where they have one.
  [[nodiscard]] std::string shown(const std::string& path) const {
    std::string out;
    std::size_t from = 0;
    for (std::size_t at = path.find(']'); at != std::string::npos; at = path.find(']', at + 1)) {
      const auto name = names.find(path.substr(0, at + 1));
      if (name == names.end()) continue;
      out.append(path, from, path.rfind('[', at) - from).append("." + name->second);
      from = at + 1;
    }
    return out.append(path, from);
  }
};

/// What two values that mean the same have in common.
[[nodiscard]] std::string value_text(const toml::node& node);

/// For TomlTable::values(). @param key  of `node`, dotted
void add_values(const toml::node& node, const std::string& key,
                std::map<std::string, std::string>& values);

/// For TomlTable::json(): in a line. Numbers are the shortest that read the same; those that are
/// not finite, dates and times are texts.
[[nodiscard]] std::string json_text(const toml::node& node);

}  // namespace tandem
