// Keys of TOML tables as rows: a key's name, what it may be, the member that it fills and its
// words. The reader and docs/configuration.md follow from the row; the member's own value is the
// default.
// Layer: base.  Thread: non-RT only.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/toml_reader.hpp"

namespace tandem {

/// What a key may be, and what the page says of it.
struct KeyFacts {
  std::string_view name;
  Range range = kAnyNumber;
  /// "skip|hold|stop": a choice, by the values of the enum or bool; an empty one is not offered.
  std::string_view choices = {};
  std::string_view words = {};      ///< one line of the page
  std::string_view otherwise = {};  ///< for the page: the default, where no value is it
  std::string_view limits = {};     ///< for the page: the range, where the row's does not say it
  bool required = false;
  bool own = false;  ///< of one table alone: tables of defaults do not have it
};

/// A row of a table whose values go to a Config. Without `read` ordinary code reads the key.
template <class Config>
struct Key : KeyFacts {
  void (*read)(TomlTable&, const KeyFacts&, Config&) = nullptr;
  std::string (*shown)(const KeyFacts&, const Config&) = nullptr;  ///< the default, for the page

  [[nodiscard]] constexpr Key by_default(std::string_view text) const {
    Key key = *this;
    key.otherwise = text;
    return key;
  }
  [[nodiscard]] constexpr Key within(std::string_view text) const {
    Key key = *this;
    key.limits = text;
    return key;
  }
};

/// The choices that are offered: "a||b" offers a and b.
[[nodiscard]] std::vector<std::string> offered_words(std::string_view choices);

/// What a key reads into; errors go to the table, and the value stays as it was then.
void read_key(TomlTable& table, const KeyFacts& key, bool& value);
void read_key(TomlTable& table, const KeyFacts& key, double& value);
void read_key(TomlTable& table, const KeyFacts& key, std::int64_t& value);
void read_key(TomlTable& table, const KeyFacts& key, std::string& value);
void read_key(TomlTable& table, const KeyFacts& key, std::vector<std::string>& value);
void read_key(TomlTable& table, const KeyFacts& key, std::vector<double>& value);
/// @return index of the one that is there; `value` when none is
[[nodiscard]] std::size_t read_choice(TomlTable& table, const KeyFacts& key, std::size_t value);
/// @param count  of numbers in the list
void read_key(TomlTable& table, const KeyFacts& key, double* values, std::size_t count);

template <class Integer>
requires std::is_integral_v<Integer>
void read_key(TomlTable& table, const KeyFacts& key, Integer& value) {
  auto number = static_cast<std::int64_t>(value);
  read_key(table, key, number);
  value = static_cast<Integer>(number);
}
template <class Enum>
requires std::is_enum_v<Enum>
void read_key(TomlTable& table, const KeyFacts& key, Enum& value) {
  value = static_cast<Enum>(read_choice(table, key, static_cast<std::size_t>(value)));
}
template <std::size_t kCount>
void read_key(TomlTable& table, const KeyFacts& key, std::array<double, kCount>& value) {
  read_key(table, key, value.data(), kCount);
}
template <class Value>
void read_key(TomlTable& table, const KeyFacts& key, std::optional<Value>& value) {
  if (table.has(key.name)) read_key(table, key, value.emplace());
}
template <class Value>
void read_key(TomlTable& table, const KeyFacts& key, Given<Value>& given) {
  read_key(table, key, given.value);
  if (table.has(key.name)) given.line = table.line(key.name);
}

/// A default as the page has it; empty for what is none.
[[nodiscard]] std::string shown_key(const KeyFacts& key, double value);
[[nodiscard]] std::string shown_key(const KeyFacts& key, const std::string& value);
[[nodiscard]] std::string shown_choice(const KeyFacts& key, std::size_t value);
template <class Value>
std::string shown_key(const KeyFacts& key, const Given<Value>& given) {
  return shown_key(key, given.value);
}
template <class Value>
std::string shown_key(const KeyFacts& key, const Value& value) {
  if constexpr (std::is_same_v<Value, bool>) {
    return key.choices.empty() ? value ? "`true`" : "`false`" : shown_choice(key, value ? 1 : 0);
  } else if constexpr (std::is_enum_v<Value>) {
    return shown_choice(key, static_cast<std::size_t>(value));
  } else if constexpr (std::is_arithmetic_v<Value>) {
    return shown_key(key, static_cast<double>(value));
  } else {
    return {};
  }
}

template <class Config, class Value>
Config config_of(Value Config::*);
/// What the page says of a key whose range says nothing.
template <class Config, class Value>
constexpr std::string_view kind_of(Value Config::*) {
  return std::is_same_v<Value, std::string> ? "text" : std::is_same_v<Value, bool> ? "boolean" : "";
}

/// The row of a key with a number in a range, or with anything.
template <auto kMember>
constexpr auto key(std::string_view name, Range range, std::string_view words) {
  using Config = decltype(config_of(kMember));
  return Key<Config>{
      {.name = name, .range = range, .words = words, .limits = kind_of(kMember)},
      [](TomlTable& table, const KeyFacts& row, Config& config) {
        read_key(table, row, config.*kMember);
      },
      [](const KeyFacts& row, const Config& config) { return shown_key(row, config.*kMember); }};
}
template <auto kMember>
constexpr auto key(std::string_view name, std::string_view words) {
  return key<kMember>(name, kAnyNumber, words);
}
/// The row of a key with a word.
template <auto kMember>
constexpr auto choice(std::string_view name, std::string_view choices, std::string_view words) {
  auto row = key<kMember>(name, words);
  row.choices = choices;
  row.limits = {};
  return row;
}
/// The same of a key that has to be there.
template <class Config>
constexpr Key<Config> required(Key<Config> row) {
  row.required = true;
  return row;
}
/// The same of a key that tables of defaults do not have.
template <class Config>
constexpr Key<Config> own(Key<Config> row) {
  row.own = true;
  return row;
}
/// The row of a key that ordinary code reads.
template <class Config>
constexpr Key<Config> by_hand(std::string_view name, std::string_view otherwise,
                              std::string_view limits, std::string_view words) {
  return {{.name = name, .words = words, .otherwise = otherwise, .limits = limits}};
}

/// Reads every row's key in their order; of a table of defaults those that it may have.
template <class Config, std::size_t kCount>
void read_keys(TomlTable& table, const Key<Config> (&keys)[kCount],
               std::type_identity_t<Config>& config) {
  for (const Key<Config>& key : keys) {
    if (key.read != nullptr && !(key.own && table.is_partial())) key.read(table, key, config);
  }
}
/// The same of a table that its rows describe as a whole.
template <class Config, std::size_t kCount>
void read_whole(TomlTable table, const Key<Config> (&keys)[kCount],
                std::type_identity_t<Config>& config) {
  read_keys(table, keys, config);
  table.finish();
}

/// The tables of keys of a page.
struct KeyPage {
  struct Table {
    std::string title;              ///< as its heading begins: "[sim]"
    std::vector<std::string> rows;  ///< of Markdown
  };
  std::vector<Table> tables;

  /// @param prefix  of keys of a table in it: "hoist."
  template <class Config, std::size_t kCount>
  void add(const std::string& title, const Key<Config> (&keys)[kCount],
           const std::string& prefix = {}, const Config& defaults = {}) {
    for (const Key<Config>& key : keys) {
      add_row(title, prefix, key, key.shown == nullptr ? "" : key.shown(key, defaults));
    }
  }

 private:
  void add_row(const std::string& title, const std::string& prefix, const KeyFacts& key,
               const std::string& value);
};

}  // namespace tandem
