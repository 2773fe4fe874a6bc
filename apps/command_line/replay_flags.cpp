// The flags of `tandem replay`.
#include "apps/command_line/command_flags.hpp"

namespace tandem::apps {
namespace {

constexpr char kReplayExamples[] = R"(Examples:
  tandem replay runs/coman-squat-001.mcap            the same controllers on what was read: equal?
  tandem replay LOG --plugin squat=build/squat.so    a changed one: where its commands part
  tandem replay LOG --plugin squat=FILE --watch      once more whenever FILE is built
  tandem report LOG LOG.replay                       one over the other

The exit status is 0 when every command of the log is the same, 1 when one differs or the replay
ends before the log does, 2 when nothing could be played. docs/replay.md)";

}  // namespace

void add_flags(CLI::App& app, ReplayCommandOptions& o) {
  app.add_option("log", o.log, "Log of a run, from its first cycle on")->required();
  CLI::Option* plugin =
      app.add_option_function<std::vector<std::string>>(
             "--plugin",
             [&o](const std::vector<std::string>& all) {
               for (const std::string& one : all) {
                 const std::size_t at = one.find('=');
                 o.plugins.emplace_back(one.substr(0, at), one.substr(at + 1));
               }
             },
             "NAME=FILE: this library instead of the controller NAME of the run; repeatable")
          ->allow_extra_args(false)
          ->check(CLI::Validator(
              [](const std::string& text) -> std::string {
                const std::size_t at = text.find('=');
                const bool both = at != std::string::npos && at > 0 && at + 1 < text.size();
                return both ? "" : "'" + text + "' is not NAME=FILE: --plugin squat=build/squat.so";
              },
              ""));
  app.add_option("-o,--output", o.output,
                 "Log of what it commands (default with --plugin: NAME.replay.mcap beside LOG)")
      ->check(is_given("name a file, or leave it out"));
  app.add_flag("--watch", o.watch, "Replay again whenever a FILE of --plugin has changed")
      ->needs(plugin);
  app.add_option("--to", o.to_s, "End after this time of the run [s]")->check(CLI::Range(0.0, 1e9));
  app.add_flag("--no-build", o.no_build,
               "Refuse when the robot's kernels are missing, instead of building them");
  app.add_flag("--quiet,-q", o.quiet, "No table");
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  app.footer(kReplayExamples);
}

}  // namespace tandem::apps
