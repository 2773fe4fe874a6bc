#include "apps/command_line/program.hpp"

#include <csignal>
#include <cstdio>
#include <expected>
#include <string>
#include <string_view>
#include <system_error>

#include "apps/text/console.hpp"

namespace tandem::apps {
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

/// perform() until it ends, or a stream that it prints to is full: fmt::print() throws then.
/// @return what it returned, or the stream's errno: that was its end
std::expected<Exit, int> performed(const Command& command,
                                   const std::function<Exit(const Command&)>& perform) {
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

int run_program(int argc, const char* const* argv,
                const std::function<Exit(const Command&)>& perform) {
  show_harmless();
  std::signal(SIGXFSZ, SIG_IGN);  // a file at the limit of `ulimit -f` is its writer's error
  const Command command = parse_command_line(argc, argv);
  if (!std::holds_alternative<Exit>(command)) {  // before it does anything
    if (const Status kept = check_writable(json_argument(argc, argv)); !kept) {
      print_errors({kept.error()});
      return static_cast<int>(Exit::kUsage);
    }
    begin_json(json_argument(argc, argv));
  }
  const std::expected<Exit, int> done = performed(command, perform);
  Exit exit = done.value_or(Exit::kUsage);
  const std::string json = json_argument(argc, argv);
  const Status printed = flush_output(done || std::ferror(stdout) == 0 ? 0 : done.error());
  if (!printed && done != Exit::kUsage) print_errors({printed.error()});  // else it has said why
  if (!printed && exit == Exit::kDone) exit = Exit::kUsage;
  if (exit == Exit::kUsage && (done || json != "-")) write_failure(json);
  return static_cast<int>(exit);
}

}  // namespace tandem::apps
