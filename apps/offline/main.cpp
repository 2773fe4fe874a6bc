// The program `tandem-tools`: the commands that need no loop. `tandem` becomes it for these.
#include <sys/mman.h>
#include <unistd.h>

#include <chrono>
#include <expected>
#include <fstream>
#include <string>
#include <thread>

#include "apps/bench/commands.hpp"
#include "apps/command_line/program.hpp"
#include "apps/machine/child_process.hpp"
#include "apps/machine/commands.hpp"
#include "apps/text/console.hpp"
#include "apps/tools/commands.hpp"
#include "base/process.hpp"

namespace {

/// Simulates an experiment in a process of its own. @return what ended it early; empty: nothing
tandem::Result<std::string> tried_in_simulation(const std::string& experiment) {
  // In memory: an interrupt leaves no file.
  const int memory = ::memfd_create("trial", MFD_CLOEXEC);
  const std::string heard = "/proc/self/fd/" + std::to_string(memory);
  auto child = tandem::apps::ChildProcess::start(
      {tandem::program_beside("tandem"), "run", experiment, "--hal", "sim", "--quiet", "--no-log"},
      heard);
  if (!child) return std::unexpected(child.error());
  while (!child->poll()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  std::string line, last = "it ended with status " + std::to_string(*child->poll());
  for (std::ifstream in(heard); std::getline(in, line);)
    if (!line.empty()) last = line;
  ::close(memory);
  return *child->poll() == 0 ? std::string() : last;
}

using namespace tandem::apps;

Exit perform(const Command& command) {
  return std::visit(
      Overloaded{
          [](Exit done) { return done; },
          [](const ModelOptions& options) { return model_command(options); },
          [](const NewOptions& options) { return new_command(options); },
          [](const ControllerNewOptions& options) { return controller_new_command(options); },
          [](const LogOptions& options) { return log_command(options); },
          [](const EdsOptions& options) { return eds_command(options); },
          [](const ReportOptions& options) { return report_command(options); },
          [](const StudioCommandOptions& options) { return studio_of_logs(options); },
          [](const ExciteOptions& options) { return excite_command(options, tried_in_simulation); },
          [](const IdentifyOptions& options) { return identify_command(options); },
          [](const DoctorOptions& options) { return doctor_command(options); },
          [](const LatencyOptions& options) { return latency_command(options); },
          [](const BenchOptions& options) { return bench_command(options); },
          [](const auto&) {
            return refuse({.message = "`tandem-tools` has no such command",
                           .hint = "say `tandem` for it",
                           .file = {},
                           .key = {}});
          },
      },
      command);
}

}  // namespace

int main(int argc, char** argv) { return run_program(argc, argv, perform); }
