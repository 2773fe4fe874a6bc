#include "base/keys.hpp"

#include <algorithm>
#include <charconv>
#include <limits>
#include <ranges>

namespace tandem {
namespace {

/// The words between the bars, by the values that they stand for.
std::vector<std::string> words_of(std::string_view choices) {
  std::vector<std::string> words;
  for (const auto word : choices | std::views::split('|')) {
    words.emplace_back(word.begin(), word.end());
  }
  return words;
}

std::int64_t whole(double limit) {
  using Limits = std::numeric_limits<std::int64_t>;
  if (limit >= 9.2e18) return Limits::max();
  return limit <= -9.2e18 ? Limits::min() : static_cast<std::int64_t>(limit);
}

std::string shown_number(double value) {
  std::array<char, 32> out{};
  const bool plain = std::abs(value) < 1e15 && value == std::trunc(value);
  const auto end =
      plain ? std::to_chars(out.data(), out.data() + out.size(), static_cast<std::int64_t>(value))
            : std::to_chars(out.data(), out.data() + out.size(), value);
  return {out.data(), end.ptr};
}

std::string range_text(const KeyFacts& key) {
  if (!key.limits.empty()) return std::string(key.limits);
  std::string text;
  for (const std::string& word : offered_words(key.choices)) {
    text += (text.empty() ? "`\"" : ", `\"") + word + "\"`";
  }
  if (!text.empty()) return text;
  const bool below = key.range.min > kAnyNumber.min, above = key.range.max < 9.2e18;
  const std::string least = shown_number(key.range.min), most = shown_number(key.range.max);
  if (below && above) return (key.range.open_min ? "> " : "") + least + " to " + most;
  if (below) return (key.range.open_min ? "> " : "≥ ") + least;
  return above ? "≤ " + most : "";
}

}  // namespace

std::vector<std::string> offered_words(std::string_view choices) {
  std::vector<std::string> words = choices.empty() ? std::vector<std::string>{} : words_of(choices);
  std::erase(words, "");
  return words;
}

void read_key(TomlTable& table, const KeyFacts& key, bool& value) {
  if (key.choices.empty()) {
    value = table.boolean_or(key.name, value);
  } else {
    value = read_choice(table, key, value ? 1 : 0) == 1;
  }
}

void read_key(TomlTable& table, const KeyFacts& key, double& value) {
  value = key.required ? table.number(key.name, key.range)
                       : table.number_or(key.name, value, key.range);
}

void read_key(TomlTable& table, const KeyFacts& key, std::int64_t& value) {
  const std::int64_t least = whole(key.range.min), most = whole(key.range.max);
  value = key.required ? table.integer(key.name, least, most)
                       : table.integer_or(key.name, value, least, most);
}

void read_key(TomlTable& table, const KeyFacts& key, std::string& value) {
  if (!key.choices.empty()) {
    const std::vector<std::string> offered = offered_words(key.choices);
    value =
        key.required ? table.choice(key.name, offered) : table.choice_or(key.name, value, offered);
  } else {
    value = key.required ? table.text(key.name) : table.text_or(key.name, value);
  }
}

void read_key(TomlTable& table, const KeyFacts& key, std::vector<std::string>& value) {
  value = table.texts_or(key.name, value);
}

void read_key(TomlTable& table, const KeyFacts& key, std::vector<double>& value) {
  value = table.numbers_or(key.name, value, key.range);
}

void read_key(TomlTable& table, const KeyFacts& key, double* values, std::size_t count) {
  std::vector<double> numbers(values, values + count);
  numbers = key.required ? table.numbers(key.name, count, key.range)
                         : table.numbers_or(key.name, numbers, key.range, count);
  if (numbers.size() == count) std::ranges::copy(numbers, values);
}

std::size_t read_choice(TomlTable& table, const KeyFacts& key, std::size_t value) {
  const std::vector<std::string> all = words_of(key.choices);
  const std::vector<std::string> offered = offered_words(key.choices);
  const std::string word = key.required ? table.choice(key.name, offered)
                                        : table.choice_or(key.name, all.at(value), offered);
  const auto found = std::ranges::find(all, word);
  return found == all.end() || word.empty() ? value : static_cast<std::size_t>(found - all.begin());
}

std::string shown_key(const KeyFacts&, double value) {
  return std::isfinite(value) ? shown_number(value) : "";
}
std::string shown_key(const KeyFacts&, const std::string& value) {
  return value.empty() ? "" : "`\"" + value + "\"`";
}
std::string shown_choice(const KeyFacts& key, std::size_t value) {
  return "`\"" + words_of(key.choices).at(value) + "\"`";
}

void KeyPage::add_row(const std::string& title, const std::string& prefix, const KeyFacts& key,
                      const std::string& value) {
  if (tables.empty() || tables.back().title != title) tables.push_back({title, {}});
  const std::string otherwise = key.required            ? "required"
                                : key.otherwise.empty() ? value
                                                        : std::string(key.otherwise);
  tables.back().rows.push_back("| `" + prefix + std::string(key.name) + "` | " + otherwise + " | " +
                               range_text(key) + " | " + std::string(key.words) + " |");
}

}  // namespace tandem
