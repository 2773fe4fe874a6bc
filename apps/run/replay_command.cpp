// `tandem replay`: a run played again from its log, and again whenever a changed controller is
// built.
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>
#include <thread>

#include "apps/robot/kernel_build.hpp"
#include "apps/run/commands.hpp"
#include "apps/run/replay_figures.hpp"
#include "apps/run/replay_guard.hpp"
#include "apps/text/console.hpp"
#include "apps/text/draft.hpp"
#include "base/counted.hpp"
#include "base/process.hpp"
#include "base/quoting.hpp"
#include "log/log_file.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

/// Beside the log: "arm-001.replay.mcap".
std::string replay_path(const std::string& log) {
  const fs::path path(log);
  return (path.parent_path() / (path.stem().string() + ".replay.mcap")).string();
}

/// What is there may be somebody's only log.
Status check_replaces(const std::string& file) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return {};
  const auto there = log::LogFile::open(file);
  if (there && !log::value_of(there->result(), "replay_of").empty()) return {};
  return std::unexpected(Error{.message = "is there, and is no replay's log",
                               .hint = "name another file: -o FILE",
                               .file = file,
                               .key = {}});
}

std::string at_text(std::int64_t time_ns) {
  return fmt::format("{:.3f} s", 1e-9 * static_cast<double>(time_ns));
}

/// "equal, 32220 cycles", or how far that is so.
std::string verdict(const runtime::ReplayResult& result) {
  if (result.first)
    return fmt::format("differs in {} of {} cycles", result.differ, result.compared);
  return "equal, " + counted(result.compared, "cycle") +
         (result.why_short.empty() ? "" : ", and no further");
}

void add_first(const runtime::CommandDifference& first, Facts& facts) {
  facts.add("first", fmt::format("at {} (cycle {}): {}{}", at_text(first.time_ns), first.cycle,
                                 first.joint.empty() ? "" : shown(first.joint) + " ", first.field));
  facts.add("recorded", fmt::format("{}", first.recorded));
  facts.add("now",
            fmt::format(
                "{}{}", first.replayed,
                first.controller.empty() ? "" : ", by the controller " + shown(first.controller)));
}

void print_spreads(const runtime::ReplayResult& result, std::FILE* out) {
  constexpr std::size_t kMost = 32;
  if (result.spreads.empty()) return;
  Table table({"joint", "differs in", "at most", "at", "first at", "cycles"});
  for (const runtime::CommandSpread& one : result.spreads) {
    if (table.rows() == kMost) break;
    table.add({shown(one.joint), one.field, fmt::format("{:.6g}", one.largest),
               at_text(one.time_ns), at_text(one.first_ns), std::to_string(one.cycles)});
  }
  table.print(out);
  if (result.spreads.size() > kMost)
    fmt::print(out, "and {} more numbers: --json FILE has all\n", result.spreads.size() - kMost);
  fmt::print(out, "\n");
}

void print(const runtime::ReplayResult& result, const ReplayCommandOptions& options,
           std::FILE* out) {
  print_warnings(result.notes);
  print_spreads(result, out);
  const double cycles = static_cast<double>(result.cycles);
  Facts facts;
  facts.add("replay", verdict(result));
  if (result.first) add_first(*result.first, facts);
  if (!result.why_short.empty()) facts.add("ends", result.why_short);
  facts.add("speed",
            fmt::format("{:.0f} cycles a second, {:.0f} times real time", cycles / result.seconds,
                        1e-9 * static_cast<double>(result.end_ns) / result.seconds));
  if (!result.log.empty()) {
    facts.add("log", result.log);
    facts.add("next", "tandem report " + shell_word(options.log) + " " + shell_word(result.log));
  }
  facts.print(out);
}

/// Which file it is now; empty: there is none.
struct FileState {
  std::int64_t time_ns = 0, bytes = 0;
  std::uint64_t inode = 0;
  bool operator==(const FileState&) const = default;
};
std::optional<FileState> state_of(const std::string& file) {
  struct stat is {};
  if (::stat(file.c_str(), &is) != 0 || is.st_size == 0) return std::nullopt;
  return FileState{is.st_mtim.tv_sec * 1'000'000'000 + is.st_mtim.tv_nsec, is.st_size, is.st_ino};
}
using FileStates = std::vector<std::optional<FileState>>;
FileStates states_of(const std::vector<std::pair<std::string, std::string>>& plugins) {
  FileStates all;
  for (const auto& [name, file] : plugins) all.push_back(state_of(file));
  return all;
}

/// Until one of them is another than `seen` and nobody writes them any more. Empty: it was stopped.
std::optional<FileStates> await_change(
    const std::vector<std::pair<std::string, std::string>>& plugins, const FileStates& seen) {
  constexpr auto kLook = std::chrono::milliseconds(50);
  constexpr int kQuiet = 4;  // looks without a change: a linker writes in one go
  FileStates last = seen;
  for (int quiet = 0; !rt::stop_requested();) {
    std::this_thread::sleep_for(kLook);
    FileStates now = states_of(plugins);
    const bool whole = std::ranges::all_of(now, [](const auto& one) { return one.has_value(); });
    quiet = whole && now == last ? quiet + 1 : 0;
    last = std::move(now);
    if (quiet >= kQuiet && last != seen) return last;
  }
  return std::nullopt;
}

/// Each replay is a process of its own: a crash of the controller ends that one.
Exit watch(const ReplayCommandOptions& options) {
  rt::install_stop_signals();
  std::FILE* out = human_output(options.json);
  FileStates seen = states_of(options.plugins);
  for (;;) {
    std::fflush(nullptr);
    const pid_t child = ::fork();
    if (child < 0) return refuse(fail("no process can be made for the replay").error());
    if (child == 0) {
      ReplayCommandOptions once = options;
      once.watch = false;
      const auto status = static_cast<int>(replay_command(once));
      std::fflush(nullptr);
      ::_exit(status);
    }
    const int status = wait_for(child);
    if (status >= 128 && !rt::stop_requested())
      say(Said::kError, fmt::format("the replay ended by signal {}", status - 128));
    fmt::print(out, "watching {}; Ctrl-C ends it\n\n", shown(options.plugins.front().second));
    std::fflush(out);
    auto changed = await_change(options.plugins, seen);
    if (!changed) return Exit::kDone;
    seen = std::move(*changed);
  }
}

}  // namespace

Exit replay_command(const ReplayCommandOptions& options) {
  if (const Status writable = check_writable(options.json); !writable)
    return refuse(writable.error());
  if (options.watch) return watch(options);
  std::FILE* out = human_output(options.json);
  const bool writes = !options.output.empty() || !options.plugins.empty();
  const std::string output = options.output.empty() ? replay_path(options.log) : options.output;
  std::optional<Draft> draft;
  if (writes) {
    if (const Status may = check_replaces(output); !may) return refuse(may.error());
    draft.emplace(Draft::file(output));
  }
  rt::install_stop_signals();
  runtime::ReplayOptions how{.plugins = {options.plugins.begin(), options.plugins.end()},
                             .output = draft ? draft->path() : "",
                             .kernels = {missing_kernels(options.no_build), builder(options.quiet)},
                             .goes_on = [] { return !rt::stop_requested(); },
                             .guard =
                                 [&](runtime::RobotCycle& cycle, const auto& composition) {
                                   return std::make_shared<ReplayGuard>(cycle, composition,
                                                                        draft ? draft->path() : "",
                                                                        options.json);
                                 }};
  if (options.to_s) how.to_ns = static_cast<std::int64_t>(*options.to_s * 1e9);
  std::expected<runtime::ReplayResult, Diagnostics> result;
  std::thread([&] { result = runtime::replay(options.log, how); }).join();  // a crash ends it alone
  if (!result) {
    print_errors(result.error());
    write_failure(options.json);
    return Exit::kUsage;
  }
  if (draft) {
    if (const Status placed = draft->place(); !placed) return refuse(placed.error());
    result->log = output;
  }
  if (!options.quiet) print(*result, options, out);
  return end_with_json(options.json, figures_json(*result),
                       result->equal() ? Exit::kDone : Exit::kFault);
}

}  // namespace tandem::apps
