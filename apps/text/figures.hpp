// Figures of a result, each declared in one line: key, words, value. The JSON, the rows for people
// and the tables of docs/json.md follow from it.
// Layer: apps/text.  Thread: main.
#pragma once

#include <cmath>
#include <concepts>
#include <initializer_list>
#include <optional>
#include <ranges>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "apps/text/console.hpp"

namespace tandem::apps {

class Figures;

/// A result whose figures are declared: by `void figures(Figures&, const T&)` in this namespace.
template <class T>
concept Declared = requires(Figures& f, const T& of) {
  figures(f, of);
};

/// Results by name, in their order.
template <class T>
using Named = std::vector<std::pair<std::string, T>>;

/// Results that have a name, by it.
template <class T>
[[nodiscard]] Named<T> by_name(const std::vector<T>& results) {
  Named<T> named;
  for (const T& one : results) named.emplace_back(one.name, one);
  return named;
}

/// `value`; nothing (null in JSON) where it was not measured.
template <class T>
[[nodiscard]] std::optional<T> known(bool is_known, T value) {
  return is_known ? std::optional<T>(std::move(value)) : std::nullopt;
}

/// Takes the declarations, for one of two purposes: the JSON of a result, or its documentation.
/// For the latter it visits a T{}, or a null pointer: what that does not have is given by a
/// function, which is not called then.
///
///   void figures(Figures& f, const StartUp& start) {
///     f("axes", "that were enabled", start.axes);
///   }
class Figures {
 public:
  struct Row {
    std::string path, type, words;
  };

  /// One figure.
  /// @param key    ends with the unit; its order is that of the calls
  /// @param words  for docs/json.md: what key and type do not say
  /// @param value  number (null unless it is finite), text, list, percentiles, a declared result,
  ///               Named or optional of these; or a function that returns one, or that takes the
  ///               declarations of an object
  template <class V>
  void operator()(const char* key, const char* words, const V& value) {
    if constexpr (std::invocable<const V&, Figures&>) {
      group(key, words, value);
    } else if constexpr (std::invocable<const V&>) {
      using Value = std::remove_cvref_t<std::invoke_result_t<const V&>>;
      documents_ ? describe<Value>(path_ + key, words, "") : set(key, value);
    } else {
      documents_ ? describe<V>(path_ + key, words, "") : set(key, [&] { return value; });
    }
  }

  template <class V>
  void operator()(const char* key, const V& value) {
    (*this)(key, "", value);
  }

  template <class V>
  [[nodiscard]] static Json json_of(const V& value) {
    if constexpr (std::is_pointer_v<V> && Declared<V>) {
      return value == nullptr ? Json() : visited(value);
    } else if constexpr (Declared<V>) {
      return visited(value);
    } else if constexpr (kOptional<V>) {
      return value ? json_of(*value) : Json();
    } else if constexpr (kNamed<V>) {
      Json all = Json::object();
      for (const auto& [name, one] : value) all[name] = json_of(one);
      return all;
    } else if constexpr (kResults<V>) {
      Json all = Json::array();
      for (const auto& one : value) all.push_back(json_of(one));
      return all;
    } else if constexpr (kPercentiles<V>) {
      return percentiles_json(value);
    } else if constexpr (std::floating_point<V>) {
      return std::isfinite(value) ? Json(value) : Json();
    } else {
      return Json(value);
    }
  }

  /// Every figure of a T, those of the results in it included: "joints.*.limited_cycles".
  template <class T>
  [[nodiscard]] static std::vector<Row> rows_of() {
    Figures f;
    f.documents_ = true;
    f.describe_inside<T>("");
    return std::move(f.rows_);
  }

 private:
  template <class V>
  static constexpr bool kOptional = requires(V v) {
    v.has_value();
  };
  template <class V>
  static constexpr bool kNamed = requires {
    typename V::value_type::first_type;
  };
  template <class V>
  static constexpr bool kPercentiles =
      std::same_as<V, rt::Percentiles> || std::same_as<V, rt::Histogram>;
  template <class V>
  static constexpr bool kResults = [] {
    if constexpr (std::ranges::range<V> && !kNamed<V>)
      return Declared<std::ranges::range_value_t<V>>;
    return false;
  }();

  template <class V>
  static Json visited(const V& value) {
    Figures f;
    f.json_ = Json::object();
    figures(f, value);
    return std::move(f.json_);
  }

  template <class V>
  void group(const char* key, const char* words, const V& declare) {
    if (documents_) rows_.push_back({path_ + key, "object", words});
    Json outer = std::exchange(json_, Json::object());
    const std::string outside = std::exchange(path_, path_ + key + ".");
    declare(*this);
    path_ = outside;
    outer[key] = std::exchange(json_, Json());
    json_ = std::move(outer);
  }

  /// Null replaces nothing: of two alternatives that have one key.
  template <class V>
  void set(const char* key, const V& value) {
    Json json = json_of(std::remove_cvref_t<decltype(value())>(value()));
    if (!json.is_null() || !json_.contains(key)) json_[key] = std::move(json);
  }

  template <class V>
  void describe(const std::string& path, const char* words, const char* or_null) {
    if constexpr (kOptional<V>) {
      describe<typename V::value_type>(path, words, " or null");
    } else {
      const bool null = (std::is_pointer_v<V> && Declared<V>) || std::same_as<V, rt::Histogram>;
      rows_.push_back({path, type_of<V>() + (null ? " or null" : or_null), words});
      describe_inside<V>(path);
    }
  }

  template <class V>
  void describe_inside(const std::string& path) {
    if constexpr (Declared<V>) {
      const std::string outside = std::exchange(path_, path.empty() ? path : path + ".");
      figures(*this, V{});
      path_ = outside;
    } else if constexpr (kOptional<V>) {
      describe_inside<typename V::value_type>(path);
    } else if constexpr (kNamed<V>) {
      describe_inside<typename V::value_type::second_type>(path + ".*");
    } else if constexpr (kResults<V>) {
      describe_inside<std::ranges::range_value_t<V>>(path + "[]");
    }
  }

  template <class V>
  static std::string type_of() {
    if constexpr (std::same_as<V, bool>)
      return "boolean";
    else if constexpr (std::integral<V>)
      return "integer";
    else if constexpr (std::floating_point<V>)
      return "number";
    else if constexpr (Declared<V>)
      return "object";
    else if constexpr (kNamed<V>)
      return "object by name";
    else if constexpr (kPercentiles<V>)
      return "percentiles";
    else if constexpr (std::convertible_to<V, std::string> && !std::same_as<V, Json>)
      return "text";
    else if constexpr (std::same_as<V, std::vector<std::string>>)
      return "list of text";
    else
      return "list";
  }

  bool documents_ = false;
  Json json_;
  std::string path_;  // of what is described: "joints.*."
  std::vector<Row> rows_;
};

/// The JSON of a result, or of a list of them.
template <class T>
[[nodiscard]] Json figures_json(const T& of) {
  return Figures::json_of(of);
}

/// A text for people, in which "{ground.max_foot_slip_m:.3f mm}" is a figure of a result's JSON:
/// its path, format and unit, into which it is converted; without a unit into that of the next one
/// that has it ("{from_ns:.1f} to {to_ns:.1f s}"). Percentiles are four numbers, a list is its
/// elements; "{axes|axis|axes}" is a number with what it counts.
/// @param unit  into which figures are converted that no unit follows; it is not shown
/// @return nothing where one of the figures is null, absent or an empty list
[[nodiscard]] std::optional<std::string> figures_text(std::string_view text, const Json& figures,
                                                      std::string_view unit = {});

/// Adds such a text, if there is one.
void add_figures(Facts& facts, const Json& figures, const std::string& name, std::string_view text);
/// Adds several.
void add_figures(Facts& facts, const Json& figures,
                 std::initializer_list<std::pair<const char*, std::string>> rows);

/// A column of a table of results.
struct Column {
  std::string header;     ///< ends with the unit: "from [s]"
  std::string_view text;  ///< as of figures_text(); empty: the result's name
};
/// A table with a row for each result of a list, or by name; "-" where there is no such text.
[[nodiscard]] Table figures_table(const std::vector<Column>& columns, const Json& results);

}  // namespace tandem::apps
