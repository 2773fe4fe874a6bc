#include "sweep/slurm_options.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>

#include "base/quoting.hpp"

namespace tandem::sweep {
namespace {

struct Set {
  std::string_view option, why, hint;
};
constexpr std::string_view kCores = "the points at once are the cores: -j N";
constexpr std::string_view kWords = "each chunk writes to chunks/NUMBER.txt of the sweep's folder";
constexpr std::string_view kWaits = "the sweep submits, and does not wait: tandem sweep status";
// An option a line.
// clang-format off
constexpr Set kSet[] = {
    {"array", "the sweep sets it: an element for each chunk of points", "--chunk-points N makes larger ones"},
    {"wrap", "the sweep has a script of its own", "--dry-run prints it"},
    {"cpus-per-task", "the sweep sets it", kCores},
    {"ntasks", "the sweep sets it", kCores},
    {"ntasks-per-node", "the sweep sets it", kCores},
    {"nodes", "a chunk takes one node", kCores},
    {"output", "the sweep sets it", kWords},
    {"error", "the sweep sets it", kWords},
    {"open-mode", "the sweep sets it", kWords},
    {"input", "a chunk reads none", "leave it out"},
    {"chdir", "the sweep sets it: where the study was named", "change there before you submit"},
    {"job-name", "the sweep sets it: by the study's name", "--sbatch comment=TEXT says more"},
    {"clusters", "the sweep looks at the queue of this cluster alone", "submit on the other one"},
    {"test-only", "nothing would be submitted", "--dry-run prints what would be"},
    {"wait", "nothing would be noted until it ends", kWaits},
    {"parsable", "the sweep sets it", "leave it out"},
    {"quiet", "the sweep reads what sbatch says", "leave it out"},
    {"help", "nothing would be submitted", "sbatch --help"},
    {"usage", "nothing would be submitted", "sbatch --usage"},
    {"version", "nothing would be submitted", "sbatch --version"},
};
// clang-format on

std::string name_of(const std::string& option) { return option.substr(0, option.find('=')); }

bool is_long_option(const std::string& name) {
  return name.size() > 1 && std::ranges::all_of(name, [](char c) {
           return std::islower(static_cast<unsigned char>(c)) != 0 ||
                  std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
         });
}

Error wrong(const std::string& option, std::string_view why, std::string_view hint) {
  return {.message = fmt::format("--sbatch {}: {}", shown(option), why),
          .hint = std::string(hint),
          .file = {},
          .key = {}};
}

/// Numbers between colons, at most `most` of them.
std::vector<double> numbers_in(const std::string& text, std::size_t most) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (numbers.size() < most) {
    std::uint32_t number = 0;
    const auto read = std::from_chars(at, end, number);
    if (read.ec != std::errc()) return {};
    numbers.push_back(number);
    if (read.ptr == end) return numbers;
    if (*read.ptr != ':') return {};
    at = read.ptr + 1;
  }
  return {};
}

}  // namespace

Status check_sbatch(const std::vector<std::string>& options) {
  std::vector<std::string> names;
  for (const std::string& option : options) {
    const std::string name = name_of(option);
    if (option.starts_with('-') || option.contains('\n') || !is_long_option(name))
      return std::unexpected(wrong(option, "no option of sbatch",
                                   "give its long name and value: --sbatch partition=long"));
    const auto set = std::ranges::find(kSet, name, &Set::option);
    if (set != std::end(kSet)) return std::unexpected(wrong(option, set->why, set->hint));
    if (std::ranges::find(names, name) != names.end())
      return std::unexpected(wrong(option, "is given twice", "give it once"));
    if (name == "time" && !slurm_minutes(option.substr(std::min(option.size(), name.size() + 1))))
      return std::unexpected(wrong(option, "is no time", "write time=90, minutes, or 1:30:00"));
    names.push_back(name);
  }
  return {};
}

std::optional<std::string> sbatch_value(const std::vector<std::string>& options,
                                        std::string_view name) {
  for (const std::string& option : options)
    if (name_of(option) == name) return option.substr(std::min(option.size(), name.size() + 1));
  return std::nullopt;
}

std::optional<double> slurm_minutes(const std::string& text) {
  if (text == "infinite" || text == "INFINITE" || text == "UNLIMITED" || text == "0")
    return std::numeric_limits<double>::infinity();
  const std::size_t dash = text.find('-');
  if (dash == std::string::npos) {
    const auto at = numbers_in(text, 3);
    if (at.empty()) return std::nullopt;
    if (at.size() < 3) return at[0] + (at.size() == 2 ? at[1] / 60.0 : 0.0);
    return at[0] * 60.0 + at[1] + at[2] / 60.0;
  }
  const auto days = numbers_in(text.substr(0, dash), 1),
             rest = numbers_in(text.substr(dash + 1), 3);
  if (days.empty() || rest.empty()) return std::nullopt;
  double minutes = days[0] * 1440.0 + rest[0] * 60.0;
  if (rest.size() > 1) minutes += rest[1];
  if (rest.size() > 2) minutes += rest[2] / 60.0;
  return minutes;
}

}  // namespace tandem::sweep
