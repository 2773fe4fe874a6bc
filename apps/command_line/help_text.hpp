// How `--help` is laid out: the commands by task, every line within the terminal's width.
// Layer: apps/command_line.  Thread: main.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tandem::apps {

/// What somebody wants to do with `tandem`: each of its commands is for one.
enum class Task : std::uint8_t { kRun, kSee, kMove, kStop, kTest, kDebug, kMake, kMachine };

/// The word of a task in `tandem help WORD`; also the group of its commands.
[[nodiscard]] const char* to_string(Task task);
/// "Run a robot": what a task is.
[[nodiscard]] const char* title_of(Task task);
/// @return empty: no task has this word
[[nodiscard]] std::optional<Task> task_named(const std::string& word);

/// The commands of a task, with a line each.
[[nodiscard]] std::string help_of_task(const CLI::App& app, Task task);

/// A part of a command's footer: an example and what it does; or prose.
struct FooterPart {
  std::string text;
  std::string comment;
  bool example = false;
};

/// The parts of a footer. Examples have two blanks before them; what follows after two more, or far
/// to the right on a line of its own, says what they do.
[[nodiscard]] std::vector<FooterPart> parts_of(const std::string& footer);

/// An option or an argument: its names with what they take, and what it is.
struct OptionText {
  std::string name;
  std::string doc;
};

/// Every subcommand, in the order in which they were added.
[[nodiscard]] std::vector<const CLI::App*> all_subcommands(const CLI::App& app);
/// "tandem model build": as typed.
[[nodiscard]] std::string path_of(const CLI::App& app);
/// The commands of the task that has this command's name, in a line; empty: no task has.
[[nodiscard]] std::string see_also(const CLI::App& app);

/// Lays out help as wide as the standard output's terminal, else in 80 columns.
class HelpText : public CLI::Formatter {
 public:
  std::string make_description(const CLI::App* app) const override;
  std::string make_usage(const CLI::App* app, std::string name) const override;
  std::string make_subcommands(const CLI::App* app, CLI::AppFormatMode mode) const override;
  std::string make_subcommand(const CLI::App* sub) const override;
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_footer(const CLI::App* app) const override;

  /// What make_option() lays out.
  [[nodiscard]] OptionText text_of(const CLI::Option& option, bool is_positional) const;
};

}  // namespace tandem::apps
