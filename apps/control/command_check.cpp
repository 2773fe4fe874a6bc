// Whether a request is one: of its command, and for an event.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "apps/control/command_rows.hpp"
#include "base/nearest.hpp"
#include "base/utf8.hpp"

namespace tandem::apps {
namespace {

/// What somebody wrote, as far as it can be a word.
std::string shown_name(const std::string& word) {
  return word.size() <= kMostNamed ? word : std::string(whole_characters(word, kMostNamed)) + "…";
}

}  // namespace

Status check_keys(const CommandRow& row, const Json& request, bool suggests) {
  std::vector<std::string> names;
  for (const ControlKey& key : row.keys) {
    if (key.sent) names.push_back(key.name);
  }
  for (const auto& [name, value] : request.items()) {
    if (name == "do") continue;
    const auto known = std::ranges::find(row.keys, name, &ControlKey::name);
    if (known == row.keys.end() || !known->sent) {
      return fail(fmt::format("{}: unknown key \"{}\"", row.name, shown_name(name)),
                  names.empty() ? "it takes none"
                  : suggests    ? suggest(name, names)
                                : R"({"do": "help"} lists them)");
    }
    if (Status fits = check_value(*known, value); !fits) {
      return fail(fmt::format("{}: \"{}\" {}", row.name, name, fits.error().message),
                  fits.error().hint);
    }
  }
  for (const ControlKey& key : row.keys) {
    if (key.required && key.sent && !request.contains(key.name)) {
      return fail(fmt::format("{}: \"{}\" is missing", row.name, key.name), key.doc);
    }
  }
  return {};
}

Status check_event(const Json& request) {
  const auto name = request.find("do");
  if (name == request.end() || !name->is_string()) {
    return fail("`do` does not name a command", "write { do = \"controller.set\", … }");
  }
  const auto wanted = name->get<std::string>();
  const CommandRow* row = command_row(wanted);
  if (row == nullptr || !row->more.by_event) {
    std::vector<std::string> names;
    for (const CommandRow& one : command_rows())
      if (one.more.by_event) names.push_back(one.name);
    if (row == nullptr)
      return fail(fmt::format("unknown command \"{}\"", shown_name(wanted)),
                  suggest(wanted, names));
    return fail(wanted + " is not for events",
                fmt::format("these are: {}", fmt::join(names, ", ")));
  }
  return check_keys(*row, request);
}

}  // namespace tandem::apps
