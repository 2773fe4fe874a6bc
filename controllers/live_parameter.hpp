// Numbers of a controller that the experiment sets, and that may be set while it runs: declared by
// ControllerSetup::parameter().
// Layer: controllers.  Thread: declared non-RT; read and set by the loop, shown to any.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/archive.hpp"
#include "base/file_name.hpp"
#include "base/realtime.hpp"
#include "base/toml_reader.hpp"

namespace tandem {

/// A value as somebody gives it: a number, true or false, a word, or a list's numbers. Nothing:
/// none is given.
struct ParameterValue {
  enum class Is : std::uint8_t { kNothing, kNumber, kBoolean, kText, kNumbers };

  ParameterValue() = default;
  ParameterValue(double value) : number(value), is(Is::kNumber) {}
  ParameterValue(int value) : ParameterValue(static_cast<double>(value)) {}
  ParameterValue(bool value) : number(value ? 1.0 : 0.0), is(Is::kBoolean) {}
  ParameterValue(const char* value) : text(value), is(Is::kText) {}
  ParameterValue(std::string value) : text(std::move(value)), is(Is::kText) {}
  ParameterValue(std::vector<double> values) : numbers(std::move(values)), is(Is::kNumbers) {}

  double number = 0.0;  ///< of a boolean 0 or 1
  std::string text{};
  std::vector<double> numbers{};
  Is is = Is::kNothing;
};

/// The default of a parameter that has none and need not be given: it is not finite until it is.
inline constexpr double kNotGiven = std::numeric_limits<double>::quiet_NaN();

/// What a controller says of a parameter.
struct ParameterFacts {
  std::string unit{};                  ///< "Nm/rad"; empty: none
  double min = kAnyNumber.min;         ///< in its unit
  double max = kAnyNumber.max;         ///< in its unit
  bool above_min = false;              ///< `min` itself is refused
  bool whole = false;                  ///< whole numbers only, up to 2^53
  std::vector<std::string> choices{};  ///< a word of these instead of a number
  ParameterValue otherwise{};          ///< its default; nothing: it has to be given
  bool live = false;                   ///< it may be set while the controller runs
  std::string doc{};                   ///< one line
};

enum class ParameterType : std::uint8_t { kNumber, kInteger, kBoolean, kChoice };
[[nodiscard]] constexpr const char* to_string(ParameterType type) noexcept {
  constexpr const char* kNames[]{"number", "integer", "boolean", "choice"};
  return kNames[static_cast<std::size_t>(type)];
}

/// A parameter that was declared, or an element of a list of them.
struct ParameterRow {
  std::string name;  ///< of an element the list's and its own: "kp_Nm_rad.elbow"
  ParameterFacts facts;
  ParameterType type = ParameterType::kNumber;
  double otherwise = kNotGiven;  ///< as `value`
  /// A boolean's is 0 or 1, a choice's the word's index. A plain number, which a debugger shows:
  /// now() and put() read and write it for other threads.
  double value = kNotGiven;
  bool changed = false;  ///< the loop's: before the next update()
  bool was_set = false;  ///< the loop's: since the controller was loaded
  std::string list{};    ///< that it is an element of; empty: it stands alone
  static_assert(std::atomic_ref<double>::is_always_lock_free);

  [[nodiscard]] double now() const noexcept TANDEM_RT {  // C++23 has no atomic_ref to const
    return std::atomic_ref(const_cast<double&>(value)).load(std::memory_order_relaxed);
  }
  void put(double number) noexcept TANDEM_RT {
    std::atomic_ref(value).store(number, std::memory_order_relaxed);
  }
  /// Whether it may be `number`: finite, in its range, whole where it has to be.
  [[nodiscard]] bool fits(double number) const noexcept TANDEM_RT {
    if (!std::isfinite(number)) return false;
    if (type == ParameterType::kBoolean || type == ParameterType::kChoice) return true;
    if (facts.above_min ? number <= facts.min : number < facts.min) return false;
    return number <= facts.max && (type != ParameterType::kInteger || number == std::floor(number));
  }
  /// The word for `number`, of a boolean or a choice; empty: it is a number.
  [[nodiscard]] std::string_view word_of(double number) const noexcept TANDEM_RT {
    if (type == ParameterType::kBoolean) return number == 1.0 ? "true" : "false";
    const bool has = type == ParameterType::kChoice && number >= 0.0 &&
                     number < static_cast<double>(facts.choices.size());
    return has ? std::string_view(facts.choices[static_cast<std::size_t>(number)]) : "";
  }
  /// As a file gives it, and exactly: "0.1", "true", "compliant"; empty: it has none.
  [[nodiscard]] std::string text() const {
    const double number = now();
    if (std::isnan(number)) return {};
    if (type > ParameterType::kInteger) return std::string(word_of(number));
    std::array<char, 32> digits{};
    return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr};
  }
  /// An element's name in its list: "elbow".
  [[nodiscard]] std::string element() const {
    return list.empty() ? "" : name.substr(list.size() + 1);
  }
};

/// A declared parameter: a number to calculate with. Until it is assigned it is not finite. It
/// counts as long as the ControllerIo that it was declared in. In gdb: `print kp_.row_->value`.
class Parameter {
 public:
  Parameter() = default;
  explicit Parameter(const ParameterRow& row) : row_(&row) {}

  [[nodiscard]] double value() const noexcept TANDEM_RT {
    return row_ == nullptr ? kNotGiven : row_->now();
  }
  operator double() const noexcept TANDEM_RT { return value(); }
  /// Whether it is true, where it is a boolean.
  [[nodiscard]] bool on() const noexcept TANDEM_RT { return value() == 1.0; }
  /// Whether it has a value: it may lack one where its default is kNotGiven.
  [[nodiscard]] bool given() const noexcept TANDEM_RT { return !std::isnan(value()); }
  /// Whether it is that word, where it is a choice.
  [[nodiscard]] bool is(std::string_view word) const noexcept TANDEM_RT {
    return row_ != nullptr && row_->type == ParameterType::kChoice &&
           row_->word_of(row_->now()) == word;
  }
  /// Whether this is the first update() after it was set.
  [[nodiscard]] bool changed() const noexcept TANDEM_RT { return row_ != nullptr && row_->changed; }

 private:
  const ParameterRow* row_ = nullptr;
};

/// The parameters of one controller.
class Parameters {
 public:
  static constexpr std::size_t kMost = 1024;  ///< each element of a list counts

  /// Reads `name` of `table`. What is wrong with it, or with the declaration, is reported there.
  [[nodiscard]] Parameter declare(TomlTable& table, std::string_view name, ParameterFacts facts) {
    const std::string key(name);
    if (!is_new(table, key, 1)) {
      const auto known = std::ranges::find(rows_, key, &ParameterRow::name);
      return known == rows_.end() ? Parameter() : Parameter(*known);
    }
    ParameterRow& row = rows_.emplace_back();
    row.name = key;
    row.facts = std::move(facts);
    if (const char* wrong = complete(row, key); *wrong != '\0') {
      table.error(key, wrong, "correct the controller");
    } else {
      row.put(read(table, row));
    }
    return Parameter(row);
  }

  /// The same of a list: a number for each of `elements`. The file gives one for all of them, a
  /// list, or a table by their names; of those that the table lacks the default counts.
  /// @param facts  of all of them, or one for each
  /// @return one for each
  [[nodiscard]] std::vector<Parameter> declare_list(TomlTable& table, std::string_view name,
                                                    const std::vector<std::string>& elements,
                                                    const std::vector<ParameterFacts>& facts) {
    const std::string key(name);
    std::vector<Parameter> handles(elements.size());
    if (!is_new(table, key, elements.size())) return handles;
    const char* wrong = facts.size() == 1 || facts.size() == elements.size()
                            ? ""
                            : "has facts for another number of elements than it has";
    const std::size_t first = rows_.size();
    for (std::size_t i = 0; i < elements.size() && *wrong == '\0'; ++i) {
      const std::string full = key + "." + elements[i];
      if (!shown_name_problem(elements[i]).empty()) wrong = "has an element without a good name";
      if (std::ranges::find(rows_, full, &ParameterRow::name) != rows_.end())
        wrong = "has two elements of one name";
      ParameterRow& row = rows_.emplace_back();
      row.name = full;
      row.list = key;
      row.facts = facts[facts.size() == 1 ? 0 : i];
      handles[i] = Parameter(row);
      if (*wrong == '\0') wrong = complete(row, key);
      if (*wrong == '\0' && row.type > ParameterType::kInteger)
        wrong = "is a list, and a list is of numbers";
    }
    if (*wrong != '\0') {
      table.error(key, wrong, "correct the controller");
    } else {
      read_list(table, key, first);
    }
    return handles;
  }

  [[nodiscard]] std::deque<ParameterRow>& rows() noexcept { return rows_; }

  /// Whether a value of `former`, the one of a build before, means the same in `row`.
  [[nodiscard]] static bool is_same(const ParameterRow& former, const ParameterRow& row) {
    return former.name == row.name && former.type == row.type &&
           former.facts.choices == row.facts.choices && former.facts.unit == row.facts.unit &&
           former.facts.live && row.facts.live;
  }

  // The loop's.

  /// Sets `row` to what `former` was set to, if it was, and that is in its range.
  void take_over(const ParameterRow& former, ParameterRow& row) noexcept TANDEM_RT {
    const double value = former.now();
    if (former.was_set && row.fits(value)) set(row, value);
  }
  void set(ParameterRow& row, double value) noexcept TANDEM_RT {
    row.put(value);
    row.changed = row.was_set = any_changed_ = true;
  }
  /// After an update() of the controller: what it has seen is no change any more.
  void seen() noexcept TANDEM_RT {
    if (!any_changed_) return;
    for (ParameterRow& row : rows_) row.changed = false;
    any_changed_ = false;
  }
  void archive(Archive& ar) {
    for (ParameterRow& row : rows_) {
      double value = row.now();
      ar(value, row.changed, row.was_set);
      if (ar.reading()) row.put(value);
    }
    ar(any_changed_);
  }

 private:
  static constexpr double kMostWhole = 9007199254740992.0;  // 2^53

  /// Whether `key` may be declared, with so many numbers; else it is reported.
  [[nodiscard]] bool is_new(TomlTable& table, const std::string& key, std::size_t numbers) const {
    const bool known = std::ranges::any_of(
        rows_, [&](const ParameterRow& row) { return row.name == key || row.list == key; });
    if (known) {
      table.error(key, "the controller declares this parameter twice", "declare it once");
    } else if (rows_.size() + numbers > kMost) {
      table.error("", "the controller declares more than 1024 parameters", "declare fewer");
      return false;
    }
    return !known;
  }

  /// Type and default. @return what is wrong with the declaration; empty: nothing
  [[nodiscard]] static const char* complete(ParameterRow& row, const std::string& key) {
    ParameterFacts& facts = row.facts;
    const ParameterValue& given = facts.otherwise;
    using Is = ParameterValue::Is;
    if (!topic_name_problem(key).empty()) {
      return "is no name of a parameter: letters, digits and _, no digit first";
    }
    if (!facts.choices.empty()) {
      row.type = ParameterType::kChoice;
      if (given.is == Is::kNothing) return "";
      const auto found = std::ranges::find(facts.choices, given.text);
      if (given.is != Is::kText || found == facts.choices.end()) {
        return "has a default that is none of its choices";
      }
      row.otherwise = static_cast<double>(found - facts.choices.begin());
      return "";
    }
    if (given.is == Is::kText) return "has a word as default, and no choices";
    if (given.is != Is::kNothing) row.otherwise = given.number;
    if (given.is == Is::kBoolean) {
      row.type = ParameterType::kBoolean;
      return "";
    }
    if (facts.whole) {
      row.type = ParameterType::kInteger;
      facts.min = std::max(facts.min, -kMostWhole);
      facts.max = std::min(facts.max, kMostWhole);
    }
    if (!(facts.min <= facts.max)) return "has a range without numbers";
    const double least = facts.min, most = facts.max;
    if (row.otherwise < least || row.otherwise > most ||
        (facts.above_min && row.otherwise == least)) {
      return "has a default outside its range";
    }
    return "";
  }

  [[nodiscard]] static double read(TomlTable& table, const ParameterRow& row) {
    const ParameterFacts& facts = row.facts;
    const bool required = facts.otherwise.is == ParameterValue::Is::kNothing;
    const Range range{facts.min, facts.max, facts.above_min};
    switch (row.type) {
      case ParameterType::kNumber:
        return required ? table.number(row.name, range)
                        : table.number_or(row.name, row.otherwise, range);
      case ParameterType::kInteger:
        if (!required && !table.has(row.name)) return row.otherwise;
        return static_cast<double>(table.integer(row.name, static_cast<std::int64_t>(facts.min),
                                                 static_cast<std::int64_t>(facts.max)));
      case ParameterType::kBoolean: return table.boolean_or(row.name, row.otherwise == 1.0) ? 1 : 0;
      case ParameterType::kChoice: break;
    }
    const std::string word = required
                                 ? table.choice(row.name, facts.choices)
                                 : table.choice_or(row.name, facts.otherwise.text, facts.choices);
    const auto found = std::ranges::find(facts.choices, word);
    return found == facts.choices.end() ? 0.0 : static_cast<double>(found - facts.choices.begin());
  }

  /// The elements from `first` on.
  void read_list(TomlTable& table, const std::string& key, std::size_t first) {
    const std::size_t count = rows_.size() - first;
    const auto element = [&](std::size_t i) -> ParameterRow& { return rows_[first + i]; };
    const auto required = [&](std::size_t i) {
      return element(i).facts.otherwise.is == ParameterValue::Is::kNothing;
    };
    std::vector<double> values;
    for (std::size_t i = 0; i < count; ++i) values.push_back(element(i).otherwise);
    const auto given = table.values();
    const auto found = given.find(key);
    const bool is_list = found != given.end() && found->second.starts_with('[');
    const bool is_missing = !table.has(key) && count > 0 && required(0);
    if (is_missing || (found != given.end() && !is_list)) {
      std::ranges::fill(values, table.number(key));
    } else if (given.lower_bound(key + ".") != given.lower_bound(key + "/")) {  // '.' + 1 is '/'
      TomlTable by_name = table.table(key);
      for (std::size_t i = 0; i < count; ++i) {
        const std::string name = element(i).element();
        values[i] = required(i) ? by_name.number(name) : by_name.number_or(name, values[i]);
      }
      if (count > 0) by_name.finish();
      if (by_name.has_errors()) return;
    } else if (table.has(key)) {
      std::vector<double> list = table.numbers(key, 0);
      const bool counts = !table.has_errors(key) && !table.has_errors("joints");
      if (counts && count > 0 && list.size() != count)
        table.error(key, "has " + std::to_string(list.size()) + " numbers",
                    "give one for all, or one for each of " + names_of(first));
      if (list.size() == count) values = std::move(list);
    }
    if (table.has_errors(key)) return;
    for (std::size_t i = 0; i < count; ++i) {
      const bool is_default = std::isnan(values[i]) && std::isnan(element(i).otherwise);
      if (!is_default && !element(i).fits(values[i]))
        return refuse(table, key, element(i), values[i]);
      element(i).put(values[i]);
    }
  }
  [[nodiscard]] std::string names_of(std::size_t first) const {
    std::string names;
    for (std::size_t i = first; i < rows_.size(); ++i)
      names += (names.empty() ? "" : ", ") + rows_[i].element();
    return names;
  }
  static void refuse(TomlTable& table, const std::string& key, const ParameterRow& row,
                     double value) {
    char words[160];
    std::snprintf(words, sizeof words, "%g is out of range", value);
    const std::string what = row.element() + ": " + words;
    const ParameterFacts& facts = row.facts;
    std::snprintf(words, sizeof words, "must be %s%g and at most %g%s",
                  facts.above_min ? "greater than " : "at least ", facts.min, facts.max,
                  facts.whole ? ", and whole" : "");
    table.error(key, what, words);
  }

  std::deque<ParameterRow> rows_;  // they stay where they are
  bool any_changed_ = false;
};

}  // namespace tandem
