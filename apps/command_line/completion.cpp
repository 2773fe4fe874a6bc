#include "apps/command_line/completion.hpp"

#include <algorithm>
#include <optional>

#include "apps/command_line/command_flags.hpp"
#include "apps/command_line/help_text.hpp"
#include "base/bundled_files.hpp"

namespace tandem::apps {
namespace {

constexpr char kHelp[] = "help";

/// Where on a line the next word stands.
struct Place {
  const CLI::App* command = nullptr;
  const CLI::Option* value_of = nullptr;  ///< the flag whose value it is; null: of none
  std::size_t arguments = 0;  ///< that stand before it, and are neither flags nor theirs
  bool flags = true;          ///< false behind "--"
};

bool is_shown(const CLI::Option& option) { return !option.get_group().empty(); }

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

const CLI::Option* flag_named(const CLI::App& app, const std::string& word) {
  for (const CLI::Option* option : app.get_options())
    if (!option->get_positional() && option->check_name(word)) return option;
  return nullptr;
}

const CLI::App* command_named(const CLI::App& app, const std::string& word) {
  const std::vector<const CLI::App*> all = all_subcommands(app);
  const auto found =
      std::ranges::find_if(all, [&](const CLI::App* sub) { return sub->get_name() == word; });
  return found == all.end() ? nullptr : *found;
}

/// Goes on behind `word`.
void pass(Place& at, const std::string& word) {
  if (at.value_of != nullptr) {
    at.value_of = nullptr;
  } else if (at.flags && word == "--") {
    at.flags = false;
  } else if (at.flags && word.starts_with('-') && word.size() > 1) {
    const CLI::Option* flag = flag_named(*at.command, word);
    if (flag != nullptr && takes_value(*flag)) at.value_of = flag;
  } else if (const CLI::App* sub = command_named(*at.command, word); sub != nullptr) {
    at = {.command = sub};
  } else {
    ++at.arguments;
  }
}

/// The argument that a word behind so many others is; the last one may take them all.
const CLI::Option* argument(const CLI::App& app, std::size_t number) {
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional() || !is_shown(*option)) continue;
    const auto takes = static_cast<std::size_t>(std::max(option->get_items_expected_max(), 0));
    if (number < takes) return option;
    number -= takes;
  }
  return nullptr;
}

void add_values(Completions& to, const CLI::Option& option) {
  const std::vector<std::string> choices = choices_of(option);
  for (const std::string& choice : choices) to.words.push_back({choice, {}});
  const std::optional<Bundled> kind = bundled_kind(option);
  if (kind) {
    for (const std::string& name : bundled_names(*kind)) to.words.push_back({name, "bundled"});
  }
  to.files = to.files || kind || (choices.empty() && option.get_type_name().starts_with("TEXT"));
}

void add_commands(Completions& to, const CLI::App& app) {
  for (const CLI::App* sub : all_subcommands(app))
    to.words.push_back({sub->get_name(), sub->get_description()});
}

void add_flags_of(Completions& to, const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_positional() || !is_shown(*option)) continue;
    for (const std::string& name : option->get_lnames())
      to.words.push_back({"--" + name, option->get_description()});
    if (option->get_lnames().empty() && !option->get_snames().empty())
      to.words.push_back({"-" + option->get_snames().front(), option->get_description()});
  }
}

}  // namespace

Completions completions(const CLI::App& app, const std::vector<std::string>& words) {
  Place at{.command = &app};
  Completions found;
  if (words.empty()) return found;
  const bool help = words.size() > 1 && words.front() == kHelp;
  for (std::size_t i = help ? 1 : 0; i + 1 < words.size(); ++i) pass(at, words[i]);
  std::string typed = words.back(), before;
  const std::size_t equals = typed.find('=');
  if (at.value_of == nullptr && at.flags && typed.starts_with("--") &&
      equals != std::string::npos) {
    at.value_of = flag_named(*at.command, typed.substr(0, equals));
    if (at.value_of == nullptr) return found;
    before = typed.substr(0, equals + 1);
    typed.erase(0, equals + 1);
  }
  if (at.value_of != nullptr) {
    add_values(found, *at.value_of);
  } else if (help) {
    add_commands(found, *at.command);
    for (int task = 0; words.size() == 2 && task <= static_cast<int>(Task::kMachine); ++task)
      found.words.push_back({to_string(static_cast<Task>(task)), "the commands of a task"});
  } else if (at.flags && typed.starts_with('-')) {
    add_flags_of(found, *at.command);
  } else {
    if (at.arguments == 0) add_commands(found, *at.command);
    if (at.arguments == 0 && at.command == &app)
      found.words.push_back({kHelp, "Help of a command, or of a task"});
    if (const CLI::Option* its = argument(*at.command, at.arguments)) add_values(found, *its);
  }
  std::erase_if(found.words, [&](const Completion& one) { return !one.word.starts_with(typed); });
  for (Completion& one : found.words) one.word.insert(0, before);
  return found;
}

std::string to_lines(const Completions& completions) {
  std::string lines;
  for (const Completion& one : completions.words)
    lines += one.word + (one.doc.empty() ? "" : "\t" + one.doc) + "\n";
  return lines + (completions.files ? ":files\n" : "");
}

}  // namespace tandem::apps
