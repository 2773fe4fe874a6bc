// What options check of their values, and what they say of that to completion.
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include "apps/command_line/command_flags.hpp"

namespace tandem::apps {
namespace {

/// Names of a check, by which completion knows what it takes: of a_bundled(), for each Bundled.
constexpr std::string_view kBundledNames[]{"robot", "experiment", "robot_or_experiment",
                                           "tests", "study",      "scenario"};
static_assert(std::size(kBundledNames) == static_cast<std::size_t>(Bundled::kScenario) + 1);

/// Begins the name of an is_one_of(); its choices follow, by comma.
constexpr std::string_view kChoices = "choices:";

/// The names of an option's checks.
std::vector<std::string> checks_of(const CLI::Option& option) {
  std::vector<std::string> names;
  try {
    // CLI11 has no other way to ask.
    for (int i = 0;; ++i)
      names.push_back(const_cast<CLI::Option&>(option).get_validator(i)->get_name());
  } catch (const CLI::OptionNotFound&) {
    return names;
  }
}

/// Number that the whole of `text` is; CLI11's own cast lets a number overflow.
std::optional<std::int64_t> whole_number(const std::string& text) {
  std::int64_t number = 0;
  const char* end = text.data() + text.size();
  const auto [last, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && last == end ? std::optional(number) : std::nullopt;
}

}  // namespace

CLI::Validator a_bundled(Bundled kind) {
  const auto find = [kind](std::string& text) -> std::string {
    if (const Result<std::string> file = named_file(text, kind)) text = *file;
    return "";
  };
  return {find, "", std::string(kBundledNames[static_cast<std::size_t>(kind)])};
}

CLI::Validator is_one_of(const std::vector<std::string>& choices, CLI::Validator check) {
  std::string names(kChoices);
  for (const std::string& choice : choices) names += choice + ",";
  return choices.empty() ? check : check.name(names);
}

std::optional<Bundled> bundled_kind(const CLI::Option& option) {
  for (const std::string& name : checks_of(option)) {
    const auto* const at = std::ranges::find(kBundledNames, name);
    if (at != std::end(kBundledNames)) return static_cast<Bundled>(at - std::begin(kBundledNames));
  }
  return std::nullopt;
}

std::vector<std::string> choices_of(const CLI::Option& option) {
  std::string list;
  for (const std::string& name : checks_of(option))
    if (name.starts_with(kChoices)) list = name.substr(kChoices.size());
  const std::string type = option.get_type_name();  // "TEXT:{sim,can}"
  if (const std::size_t open = type.find('{'); list.empty() && open != std::string::npos)
    list = type.substr(open + 1, type.find('}', open) - open - 1);
  std::vector<std::string> choices;
  std::istringstream words(list);
  for (std::string word; std::getline(words, word, ',');) choices.push_back(word);
  return choices;
}

CLI::Validator is_given(const std::string& hint) {
  const auto check = [hint](const std::string& text) -> std::string {
    return text.empty() ? "is empty (" + hint + ")" : "";
  };
  return {check, ""};
}

CLI::Validator is_seed() {
  const auto check = [](const std::string& text) -> std::string {
    if (whole_number(text).value_or(-1) >= 0) return "";
    return "'" + text + "' is no whole number from 0 to 9223372036854775807";
  };
  return {check, "0 to 9223372036854775807"};
}

CLI::Validator a_duration() {
  const auto check = [](const std::string& text) -> std::string {
    double duration_s = 0.0;
    const bool number = CLI::detail::lexical_cast(text, duration_s);
    if (number && duration_s > 0.0 && duration_s <= 1e6) return "";
    return "'" + text + "' is no number of seconds above 0, and up to 1000000";
  };
  return {check, "above 0, to 1e6"};
}

CLI::Validator is_count() {
  const auto check = [](const std::string& text) -> std::string {
    if (whole_number(text).value_or(0) > 0) return "";
    return "'" + text + "' is no whole number above 0";
  };
  return {check, "1 or more"};
}

CLI::Validator a_memory_size() {
  const auto read = [](std::string& text) -> std::string {
    constexpr double kMost = 1e12;
    double number = -1.0;
    const char* end = text.data() + text.size();
    const auto [last, error] = std::from_chars(text.data(), end, number);
    const std::string unit = CLI::detail::to_lower(CLI::detail::trim_copy({last, end}));
    double bytes = std::numeric_limits<double>::quiet_NaN();
    for (const auto& [name, size] : {std::pair{"", 1.0},
                                     {"b", 1.0},
                                     {"kb", 1e3},
                                     {"mb", 1e6},
                                     {"gb", 1e9},
                                     {"kib", 1024.0},
                                     {"mib", 1048576.0},
                                     {"gib", 1073741824.0}}) {
      if (unit == name) bytes = number * size;
    }
    if (error != std::errc() || !(bytes >= 0.0 && bytes <= kMost)) {
      return "'" + text +
             "' is no memory: give 0, or a number with kB, MB or GB, as 512MB or "
             "0.5GB, up to 1000GB";
    }
    text = std::to_string(std::llround(bytes));
    return "";
  };
  return {read, "0, 512MB, 0.5GB"};
}

}  // namespace tandem::apps
