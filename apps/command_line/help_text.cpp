#include "apps/command_line/help_text.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <set>
#include <sstream>

#include "apps/text/columns.hpp"

namespace tandem::apps {
namespace {

constexpr std::size_t kColumns = 80;     // without a terminal
constexpr std::size_t kWidest = 120;     // of a terminal: longer lines are hard to read
constexpr std::size_t kComment = 24;     // blanks before a comment's further lines, at least
constexpr std::size_t kHanging = 6;      // before what goes on in a line of its own
constexpr std::size_t kName = 30;        // columns of a name and its type, before its help
constexpr std::size_t kNarrowName = 22;  // the same where a line has less than 100

/// What stands in help for each Task, in the order of Task.
struct TaskText {
  const char* word;
  const char* doc;
};
constexpr TaskText kTasks[]{{"run", "Run a robot"},
                            {"see", "See what it does"},
                            {"move", "Move it"},
                            {"stop", "Stop it, and what stopped it"},
                            {"test", "Test it"},
                            {"debug", "Find out why"},
                            {"make", "Make a robot of your own"},
                            {"machine", "This machine and this build"}};
static_assert(std::size(kTasks) == static_cast<std::size_t>(Task::kMachine) + 1);

std::size_t line() {
  static const std::size_t columns = line_columns(stdout, kColumns, kWidest);
  return columns;
}

std::string blanks(std::size_t count) { return std::string(count, ' '); }

/// `text` in lines, each after so many blanks.
std::string block(const std::string& text, std::size_t indent) {
  std::string lines;
  for (const std::string& one : wrapped(text, line() - std::min(indent, line() - 20)))
    lines += blanks(indent) + one + "\n";
  return lines;
}

/// Lets a list of choices without blanks be broken where it would not fit.
std::string breakable(const std::string& text, std::size_t most) {
  std::istringstream words(text);
  std::string out;
  for (std::string word; words >> word;) {
    if (columns_of(word) > most) {
      for (std::size_t comma = 0; (comma = word.find(',', comma)) != std::string::npos; ++comma)
        word.insert(++comma, " ");
    }
    out += (out.empty() ? "" : " ") + word;
  }
  return out;
}

/// A name, and beside it, or below where it is long, what it is.
std::string entry(const std::string& name, const std::string& doc) {
  const std::size_t column = (line() < 100 ? kNarrowName : kName) + 4;
  if (doc.empty()) return "  " + name + "\n";
  const std::string text = block(breakable(doc, line() - column), column);
  if (columns_of(name) + 4 > column) return block(name, 2) + text;
  return "  " + left(name, column - 2) + text.substr(column);
}

/// A command in lines that a shell takes together: none ends within quotes, or behind a flag.
std::string command_lines(std::string command) {
  constexpr char kKept = '\1';
  char quote = 0;
  std::size_t word = 0;
  for (std::size_t i = 0; i < command.size(); ++i) {
    char& c = command[i];
    if (quote == 0 && (c == '\'' || c == '"')) {
      quote = c;
    } else if (c == quote) {
      quote = 0;
    } else if (c == ' ') {
      const bool flag = command[word] == '-' && command.substr(i + 1, 1) != "-";
      word = i + 1;
      if (quote != 0 || flag) c = kKept;
    }
  }
  std::string lines;
  for (const std::string& one : wrapped(command, line() - kHanging - 2))
    lines += (lines.empty() ? "  " : " \\\n" + blanks(kHanging)) + one;
  std::ranges::replace(lines, kKept, ' ');
  return lines + "\n";
}

}  // namespace

std::vector<FooterPart> parts_of(const std::string& footer) {
  std::vector<FooterPart> parts;
  std::istringstream lines(footer);
  for (std::string one; std::getline(lines, one);) {
    const std::size_t indent = std::min(one.find_first_not_of(' '), one.size());
    const std::string text = one.substr(indent);
    if (indent >= kComment && !parts.empty() && parts.back().example) {
      parts.back().comment += (parts.back().comment.empty() ? "" : " ") + text;
    } else if (indent > 0) {
      const std::size_t gap = std::min(text.find("  "), text.size());
      const std::size_t comment = std::min(text.find_first_not_of(' ', gap), text.size());
      parts.push_back({text.substr(0, gap), text.substr(comment), true});
    } else if (!text.empty() && !parts.empty() && !parts.back().example &&
               !parts.back().text.empty() && !parts.back().text.ends_with(':')) {
      parts.back().text += " " + text;
    } else {
      parts.push_back({text, {}, false});
    }
  }
  return parts;
}

std::vector<const CLI::App*> all_subcommands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::string path_of(const CLI::App& app) {
  const CLI::App* parent = app.get_parent();
  return parent == nullptr ? app.get_name() : path_of(*parent) + " " + app.get_name();
}

std::string see_also(const CLI::App& app) {
  const CLI::App* parent = app.get_parent();
  const std::optional<Task> task = parent == nullptr ? std::nullopt : task_named(app.get_name());
  if (!task) return {};
  std::string others;
  for (const CLI::App* other : parent->get_subcommands({})) {
    if (other->get_group() == to_string(*task) && other != &app)
      others += (others.empty() ? "" : ", ") + other->get_name();
  }
  return fmt::format("{}: also {}.", kTasks[static_cast<std::size_t>(*task)].doc, others);
}

const char* to_string(Task task) { return kTasks[static_cast<std::size_t>(task)].word; }

const char* title_of(Task task) { return kTasks[static_cast<std::size_t>(task)].doc; }

std::optional<Task> task_named(const std::string& word) {
  const auto* const found =
      std::ranges::find_if(kTasks, [&](const TaskText& one) { return one.word == word; });
  if (found == std::end(kTasks)) return std::nullopt;
  return static_cast<Task>(found - std::begin(kTasks));
}

std::string help_of_task(const CLI::App& app, Task task) {
  const TaskText& its = kTasks[static_cast<std::size_t>(task)];
  std::string text = fmt::format("{} (`tandem help {}`):\n", its.doc, its.word);
  for (const CLI::App* sub : app.get_subcommands({})) {
    if (sub->get_group() == its.word) text += HelpText().make_subcommand(sub);
  }
  return text;
}

std::string HelpText::make_description(const CLI::App* app) const {
  return block(app->get_description(), 0);
}

std::string HelpText::make_usage(const CLI::App* app, std::string name) const {
  std::string usage = CLI::Formatter::make_usage(app, std::move(name));
  usage.erase(usage.find_last_not_of('\n') + 1);
  return block(usage, 0);
}

std::string HelpText::make_subcommands(const CLI::App* app, CLI::AppFormatMode) const {
  std::string text;
  if (app->get_parent() != nullptr) {  // their group is this one's
    for (const CLI::App* sub : app->get_subcommands({})) text += make_subcommand(sub);
    return text.empty() ? text : "\nSubcommands:\n" + text;
  }
  for (const TaskText& task : kTasks) text += "\n" + help_of_task(*app, *task_named(task.word));
  return text;
}

std::string HelpText::make_subcommand(const CLI::App* sub) const {
  return entry(sub->get_display_name(true), sub->get_description());
}

OptionText HelpText::text_of(const CLI::Option& option, bool is_positional) const {
  std::string name = make_option_name(&option, is_positional);
  if (!option.get_option_text().empty()) {
    name += " " + option.get_option_text();
  } else if (option.get_type_size() != 0) {
    if (!option.get_type_name().empty()) name += " " + option.get_type_name();
    if (!option.get_default_str().empty()) name += "=" + option.get_default_str();
    if (option.get_expected_max() == CLI::detail::expected_max_vector_size) name += " ...";
    if (option.get_required()) name += " REQUIRED";
  }
  std::string doc = make_option_desc(&option);
  const auto add = [&doc](const char* words, const std::set<CLI::Option*>& others) {
    std::string names;
    for (const CLI::Option* other : others)
      names += (names.empty() ? "" : ", ") + other->get_name();
    if (!names.empty()) doc += fmt::format(" ({} {})", words, names);
  };
  add("with", option.get_needs());
  add("not with", option.get_excludes());
  return {std::move(name), std::move(doc)};
}

std::string HelpText::make_option(const CLI::Option* option, bool is_positional) const {
  const OptionText text = text_of(*option, is_positional);
  return entry(text.name, text.doc);
}

std::string HelpText::make_footer(const CLI::App* app) const {
  std::string footer = app->get_footer();
  const std::string also = see_also(*app);
  if (!also.empty()) footer += (footer.empty() ? "" : "\n\n") + also;
  if (footer.empty()) return {};
  std::istringstream lines(footer);
  bool fits = true;
  for (std::string one; std::getline(lines, one);) fits = fits && columns_of(one) <= line();
  if (fits) return footer + "\n";
  std::string text;
  for (const FooterPart& part : parts_of(footer)) {
    if (!part.example) {
      text += part.text.empty() ? "\n" : block(part.text, 0);
      continue;
    }
    text += command_lines(part.text);
    if (!part.comment.empty()) text += block(part.comment, kHanging);
  }
  return text;
}

}  // namespace tandem::apps
