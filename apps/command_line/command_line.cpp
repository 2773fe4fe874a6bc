#include "apps/command_line/command_line.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>

#include "apps/command_line/command_flags.hpp"
#include "apps/command_line/completion.hpp"
#include "apps/command_line/help_text.hpp"
#include "apps/command_line/man_page.hpp"
#include "apps/text/console.hpp"
#include "base/nearest.hpp"

namespace tandem::apps {
namespace {

const char kExamples[] = R"(Examples:
  tandem run config/coman/squat.toml                 simulate, as fast as possible
  tandem run config/coman/squat.toml --realtime      in real time
  tandem emulate config/coman/squat.toml --lockstep  the robot on the other end of CAN
  tandem serve config/coman/squat.toml               a robot for `tandem run X --hal dds`
  tandem top                                         a live table of the run that goes on
  tandem check config/coman/squat.toml               read every file, move nothing
  tandem report runs/coman-squat-001.mcap            draw the plots of a run
  tandem identify runs/panda-excite-001.mcap --robot config/panda/robot.toml --out identified
  tandem log csv runs/coman-squat-001.mcap --fields position_rad
  tandem log replay runs/ur5e-q.mcap --robot config/ur5e/robot.toml --out replay.toml
  tandem model info config/coman/robot.toml          joints, mass, operation counts
  tandem doctor                                      is this machine fit for real time?
  tandem latency --load idle --duration 10           wake-up latency of this machine
Robots and experiments that come with Tandem go by their names, too: `tandem run coman/squat`.
`tandem COMMAND --help` shows more, with examples. `tandem help see` lists the commands of a task.
Lines fit the terminal, or $COLUMNS; with $NO_COLOR there are no colours.

Exit status: 0 done; 1 the run ended in a fault, or not as expected; 2 wrong input or usage, or no run to ask;
130 (129, 143) a signal ended it before its planned end.)";

/// The innermost subcommand that was named.
const CLI::App& innermost(const CLI::App& app) {
  const CLI::App* at = &app;
  while (!at->get_subcommands().empty()) at = at->get_subcommands().front();
  return *at;
}

std::vector<std::string> flags_of(const CLI::App& app) {
  std::vector<std::string> flags;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
  }
  return flags;
}

std::vector<std::string> subcommands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* sub : all_subcommands(app)) names.push_back(sub->get_name());
  return names;
}

/// A flag whose list of values, in braces, has `word`; empty: none.
std::string flag_that_takes(const CLI::App& app, const std::string& word) {
  for (const CLI::Option* option : app.get_options()) {
    std::string values = option->get_type_name();
    std::ranges::replace_if(
        values, [](char c) { return c == '{' || c == '}'; }, ',');
    const bool named = !option->get_lnames().empty();
    if (named && values.contains("," + word + ",")) return "--" + option->get_lnames().front();
  }
  return {};
}

/// Whether an argument has been given that is no flag: `tandem eds ROBOT`.
bool has_its_argument(const CLI::App& app) {
  const auto options = app.get_options(
      [](const CLI::Option* option) { return option->get_positional() && !option->empty(); });
  return !options.empty();
}

/// "LOG, OTHER": the arguments that are no flags, as the help names them.
std::string arguments_of(const CLI::App& app) {
  std::string names;
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) continue;
    names += (names.empty() ? "" : ", ") + option->get_name();
  }
  return names;
}

/// The message for words that fit nowhere, with the nearest that would.
std::string unknown_word(const CLI::App& app, const std::string& word) {
  const bool flag = word.starts_with('-');
  const std::vector<std::string> known = flag ? flags_of(app) : subcommands_of(app);
  const std::string name = word.substr(0, word.find('='));
  if (!flag && (known.empty() || has_its_argument(app))) {
    const std::string takes = flag_that_takes(app, word);
    const std::string named = arguments_of(app);
    return fmt::format("'{}' is one argument too many: {}", word,
                       !takes.empty()  ? fmt::format("did you mean {} {}?", takes, word)
                       : named.empty() ? path_of(app) + " takes none"
                                       : path_of(app) + " takes " + named);
  }
  return fmt::format("unknown {} '{}': {}", flag ? "flag" : "command", name, suggest(name, known));
}

Exit report_usage_error(const CLI::App& command, const std::string& message) {
  fmt::print(stderr, "tandem: {}\nTry `{} --help`.\n", message, path_of(command));
  remember_error(
      {.message = message, .hint = "try `" + path_of(command) + " --help`", .file = {}, .key = {}});
  return Exit::kUsage;
}

Exit report_usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = innermost(app);
  const std::vector<std::string> unknown = app.remaining(true);
  return report_usage_error(command, unknown.empty() ? std::string(error.what())
                                                     : unknown_word(command, unknown.front()));
}

/// Checks the words of `tandem joint move --help`, and so of `tandem help joint move`.
/// @return the status, when one of the words should be a command, and is none
std::optional<Exit> check_commands(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* command = &app;
  for (const std::string& word : words) {
    const std::vector<const CLI::App*> known = all_subcommands(*command);
    if (known.empty()) break;
    if (word.starts_with('-')) continue;
    const auto next =
        std::ranges::find_if(known, [&](const CLI::App* sub) { return sub->get_name() == word; });
    if (next == known.end()) return report_usage_error(*command, unknown_word(*command, word));
    command = *next;
  }
  return std::nullopt;
}

/// CLI11 takes "nan" and "inf" for numbers, and a range does not keep "nan" out.
/// @throw CLI::ValidationError  of the first such value of an option that was given
void refuse_not_finite(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_type_name().find("FLOAT") == std::string::npos) continue;
    for (const std::string& text : option->results()) {
      double number = 0.0;
      if (CLI::detail::lexical_cast(text, number) && std::isfinite(number)) continue;
      throw CLI::ValidationError(option->get_name(), "'" + text + "' is no finite number");
    }
  }
  for (const CLI::App* command : app.get_subcommands()) refuse_not_finite(*command);
}

/// @throw CLI::ValidationError  of the first option that should be a file or a bundled name
void refuse_unknown_names(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    const std::optional<Bundled> kind = bundled_kind(*option);
    if (!kind) continue;
    for (const std::string& text : option->results()) {
      const Result<std::string> file = named_file(text, *kind);
      if (!file) throw CLI::ValidationError(option->get_name(), file.error().to_string());
    }
  }
  for (const CLI::App* command : app.get_subcommands()) refuse_unknown_names(*command);
}

/// The subcommands with their options; the one that was named, once the line is parsed.
class Subcommands {
 public:
  explicit Subcommands(CLI::App& app) : app_(app) {}

  template <class Options>
  void add(const char* name, Task task, const char* doc) {
    add_to<Options>(app_, name, doc)->group(to_string(task));
  }
  /// One more command of the group `group`, which is there.
  template <class Options>
  void add_to_group(const char* group, const char* name, const char* doc) {
    CLI::App* first = app_.get_subcommand(group);
    first->description(first->get_description() + ", " + name);
    add_to<Options>(*first, name, doc);
  }
  template <class Options>
  CLI::App* add_to(CLI::App& app, const char* name, const char* doc) {
    const auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand(name, doc);
    add_flags(*command, *options);
    choices_.push_back([command, options]() -> std::optional<Command> {
      if (!command->parsed()) return std::nullopt;
      return *options;
    });
    return command;
  }
  /// Every command to a running process.
  void add_asked() {
    const auto options = std::make_shared<AskedOptions>();
    apps::add_asked(app_, *options);
    choices_.push_back([options]() -> std::optional<Command> {
      if (options->row == nullptr) return std::nullopt;
      return *options;
    });
  }
  [[nodiscard]] Command chosen() const {
    for (const auto& choice : choices_) {
      if (auto command = choice()) return std::move(*command);
    }
    return Exit::kUsage;
  }

 private:
  CLI::App& app_;
  std::vector<std::function<std::optional<Command>()>> choices_;
};

void add_all(Subcommands& commands) {
  commands.add<RunOptions>("run", Task::kRun, "Run an experiment");
  commands.add<ServeOptions>("serve", Task::kRun, "Run a robot for controllers in other processes");
  commands.add<EmulateOptions>("emulate", Task::kRun,
                               "The robot on the other end of CAN: boards' firmware and plant");
  commands.add<CheckOptions>("check", Task::kTest, "Validate an experiment's or robot's files");
  commands.add<TestOptions>("test", Task::kTest,
                            "Run experiments that say what they expect, as a suite");
  commands.add<SweepOptions>("sweep", Task::kTest,
                             "Run an experiment at many values, on all cores");
  commands.add<ShrinkOptions>("shrink", Task::kTest,
                              "The fewest, smallest events with which a scenario fails");
  commands.add<SearchOptions>("search", Task::kTest, "Where the margin of an experiment is least");
  commands.add<ReplayCommandOptions>("replay", Task::kDebug,
                                     "Play a run again from its log, and compare");
  commands.add<ReportOptions>("report", Task::kSee, "Draw the plots of a log, or of up to three");
  commands.add<ExciteOptions>("excite", Task::kMake,
                              "An experiment that excites a robot's dynamics");
  commands.add<IdentifyOptions>("identify", Task::kMake, "Masses, inertias and friction from logs");
  commands.add<LogOptions>("log", Task::kSee,
                           "Logs: info, csv, export, diff, import, replay, thresholds");
  commands.add<ModelOptions>("model", Task::kMake,
                             "A robot's kernels, and its package for ROS 2: build, info, ros2");
  commands.add<NewOptions>("new", Task::kMake, "A robot's folder from its URDF alone");
  commands.add<EdsOptions>("eds", Task::kMake,
                           "Data sheets (EDS): write those of a robot's nodes, show one");
  commands.add_asked();
  commands.add_to_group<ControllerCheckOptions>(
      "controller", "check", "Whether a controller keeps the rules of the cycle");
  commands.add_to_group<ControllerNewOptions>("controller", "new",
                                              "The project of a controller of your own");
  commands.add<StudioCommandOptions>("studio", Task::kSee,
                                     "A run that goes on, or logs, in a browser");
  commands.add<TopicOptions>("topic", Task::kSee, "Topics of ROS 2 and DDS: list, echo, hz");
  commands.add<AskOptions>("ask", Task::kDebug, "Ask a running process, in JSON");
  commands.add<DoctorOptions>("doctor", Task::kMachine, "Is this machine fit for real time?");
  commands.add<BenchOptions>("bench", Task::kMachine, "Measure this build: engines");
  commands.add<LatencyOptions>("latency", Task::kMachine,
                               "Wake-up latency of the loop, beside cyclictest");
}

}  // namespace

Command parse_command_line(int argc, const char* const* argv) {
  CLI::App app{"Tandem: one controller, simulated robot and real robot in tandem.", "tandem"};
  app.footer(kExamples);
  app.require_subcommand(1);
  app.set_version_flag("--version", "tandem " TANDEM_VERSION);
  app.formatter(std::make_shared<HelpText>());

  Subcommands commands(app);
  add_all(commands);
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (!words.empty() && words.front() == kComplete) {
    words.erase(words.begin());
    fmt::print("{}", to_lines(completions(app, words)));
    return Exit::kDone;
  }
  if (!words.empty() && words.front() == "help") {
    words.erase(words.begin());
    if (words.size() == 2 && words.front() == "--man") {
      const Status written = write_man_pages(app, words.back());
      if (!written) print_errors({written.error()});
      return written ? Exit::kDone : Exit::kUsage;
    }
    const auto task = words.size() == 1 ? task_named(words.front()) : std::nullopt;
    if (task && std::ranges::count(subcommands_of(app), to_string(*task)) == 0) {
      fmt::print("{}", help_of_task(app, *task));
      return Exit::kDone;
    }
    words.emplace_back("--help");
  }
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));  // as CLI11 wants them
    refuse_not_finite(app);
    refuse_unknown_names(app);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) return report_usage_error(app, error);
    if (const auto unknown = check_commands(app, words)) return *unknown;
    errno = 0;
    app.exit(error);                                          // prints help or version
    if (std::ferror(stdout) != 0) (void)flush_output(errno);  // why is known here alone
    return Exit::kDone;
  }
  return commands.chosen();
}

}  // namespace tandem::apps
