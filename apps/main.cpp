// The program `tandem`: reads its command line and calls the command. Those that need no loop are
// in `tandem-tools`, which it becomes.
#include <string_view>

#include "apps/clients/commands.hpp"
#include "apps/command_line/program.hpp"
#include "apps/run/commands.hpp"
#include "apps/run/controller_trial.hpp"
#include "apps/run/loop_crash.hpp"
#include "apps/run/tools_program.hpp"
#include "apps/search/commands.hpp"

int main(int argc, char** argv) {
  using namespace tandem::apps;
  name_crashing_controllers();
  if (argc == 3 && std::string_view(argv[1]) == kTryController) return try_controller(argv[2]);
  ReportOfRun report;
  const Overloaded perform{
      [](Exit done) { return done; },
      [&](const RunOptions& options) { return run_command(options, report); },
      [&](const ServeOptions& options) { return serve_command(options, report); },
      [](const EmulateOptions& options) { return emulate_command(options); },
      [](const CheckOptions& options) { return check_command(options); },
      [](const TestOptions& options) { return test_command(options); },
      [](const SweepOptions& options) { return sweep_command(options); },
      [](const ShrinkOptions& options) { return shrink_command(options); },
      [](const SearchOptions& options) { return search_command(options); },
      [](const ReplayCommandOptions& options) { return replay_command(options); },
      [](const ControllerCheckOptions& options) { return controller_check_command(options); },
      [](const AskOptions& options) { return ask_command(options); },
      [](const AskedOptions& options) { return asked_command(options); },
      [](const TopicOptions& options) { return topic_command(options); },
      [&](const StudioCommandOptions& options) {
        return options.logs.empty() ? attach_studio(options) : become_tools({argv, argv + argc});
      },
      [&](const auto&) {
        return become_tools({argv, argv + argc});
      },
  };
  const int status =
      run_program(argc, argv, [&](const Command& command) { return std::visit(perform, command); });
  if (!report.log.empty()) become_report(report, status);
  return end_beside_controllers(status);
}
