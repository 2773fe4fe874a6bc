// The program `tandem`: reads its command line and calls the command.
#include <sys/mman.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <expected>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>

#include "apps/bench/commands.hpp"
#include "apps/clients/commands.hpp"
#include "apps/machine/child_process.hpp"
#include "apps/machine/commands.hpp"
#include "apps/run/commands.hpp"
#include "apps/run/loop_crash.hpp"
#include "apps/text/console.hpp"
#include "apps/tools/commands.hpp"

namespace {

/// What --json was given, also on a command line that is wrong elsewhere; empty without.
std::string json_argument(int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word.starts_with("--json=")) return std::string(word.substr(7));
    if (word != "--json" || i + 1 == argc) continue;
    const std::string_view value = argv[i + 1];
    return value == "-" || !value.starts_with('-') ? std::string(value) : std::string();
  }
  return {};
}

/// Simulates an experiment in a process of its own. @return what ended it early; empty: nothing
tandem::Result<std::string> tried_in_simulation(const std::string& experiment) {
  // In memory: an interrupt leaves no file.
  const int memory = ::memfd_create("trial", MFD_CLOEXEC);
  const std::string heard = "/proc/self/fd/" + std::to_string(memory);
  auto child = tandem::apps::ChildProcess::start(
      {"/proc/self/exe", "run", experiment, "--hal", "sim", "--quiet", "--no-log"}, heard);
  if (!child) return std::unexpected(child.error());
  while (!child->poll()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  std::string line, last = "it ended with status " + std::to_string(*child->poll());
  for (std::ifstream in(heard); std::getline(in, line);)
    if (!line.empty()) last = line;
  ::close(memory);
  return *child->poll() == 0 ? std::string() : last;
}

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};

using namespace tandem::apps;

Exit perform(const Command& command) {
  return std::visit(
      Overloaded{
          [](Exit done) { return done; },
          [](const RunOptions& options) { return run_command(options); },
          [](const ServeOptions& options) { return serve_command(options); },
          [](const EmulateOptions& options) { return emulate_command(options); },
          [](const AskOptions& options) { return ask_command(options); },
          [](const AskedOptions& options) { return asked_command(options); },
          [](const CheckOptions& options) { return check_command(options); },
          [](const ModelOptions& options) { return model_command(options); },
          [](const NewOptions& options) { return new_command(options); },
          [](const LogOptions& options) { return log_command(options); },
          [](const EdsOptions& options) { return eds_command(options); },
          [](const ReportOptions& options) { return report_command(options); },
          [](const ExciteOptions& options) { return excite_command(options, tried_in_simulation); },
          [](const IdentifyOptions& options) { return identify_command(options); },
          [](const DoctorOptions& options) { return doctor_command(options); },
          [](const TopicOptions& options) { return topic_command(options); },
          [](const LatencyOptions& options) { return latency_command(options); },
          [](const BenchOptions& options) { return bench_command(options); },
      },
      command);
}

/// perform() until it ends, or a stream that it prints to is full: fmt::print() throws then.
/// @return what it returned, or the stream's errno: that was its end
std::expected<Exit, int> performed(const Command& command) {
  try {
    return perform(command);
  } catch (const std::system_error& error) {
    if (std::ferror(stdout) != 0 || std::ferror(stderr) != 0) {
      return std::unexpected(error.code().value());
    }
    if (error.code() != std::errc::resource_unavailable_try_again) throw;
    print_errors({{.message = "this process cannot make the threads that it needs",
                   .hint = "raise the limit of threads: ulimit -u, TasksMax= of its systemd unit, "
                           "pids.max of its container; or end other processes",
                   .file = {},
                   .key = {}}});
    return Exit::kUsage;
  } catch (const Json::exception& error) {
    print_errors({{.message = std::string("the answer is of another form: ") + error.what(),
                   .hint = "is what answers a `tandem` of this version?",
                   .file = {},
                   .key = {}}});
    return Exit::kFault;
  }
}

}  // namespace

int main(int argc, char** argv) {
  show_harmless();
  std::signal(SIGXFSZ, SIG_IGN);  // a file at the limit of `ulimit -f` is its writer's error
  name_crashing_controllers();
  const Command command = parse_command_line(argc, argv);
  if (!std::holds_alternative<Exit>(command)) {  // before it does anything
    if (const tandem::Status kept = check_writable(json_argument(argc, argv)); !kept) {
      print_errors({kept.error()});
      return static_cast<int>(Exit::kUsage);
    }
  }
  const std::expected<Exit, int> done = performed(command);
  Exit exit = done.value_or(Exit::kUsage);
  const std::string json = json_argument(argc, argv);
  const tandem::Status printed = flush_output(done || std::ferror(stdout) == 0 ? 0 : done.error());
  if (!printed && done != Exit::kUsage) print_errors({printed.error()});  // else it has said why
  if (!printed && exit == Exit::kDone) exit = Exit::kUsage;
  if (exit == Exit::kUsage && (done || json != "-")) write_failure(json);
  return end_beside_controllers(static_cast<int>(exit));
}
