#include "apps/run/run_workers.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <thread>
#include <utility>

#include "apps/robot/kernel_build.hpp"
#include "apps/run/commands.hpp"
#include "apps/run/connection.hpp"
#include "apps/text/console.hpp"
#include "base/process.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;
using WorkerClock = std::chrono::steady_clock;

constexpr const char* kLacks = ".lacks";  // a file that says: no kernels fit

/// What the process does that builds a run's kernels: all of a run but the run.
[[noreturn]] void build_here(const RunOptions& options, const TextsInstead::Texts* texts) {
  {
    std::optional<TextsInstead> instead;
    if (texts != nullptr) instead.emplace(*texts);
    (void)runtime::composed<WiredComposition>(options.experiment, options,
                                              {.build = builder(options.quiet)});
  }
  std::fflush(nullptr);
  ::_exit(0);
}

/// What a run's process does.
[[noreturn]] void run_here(const RunOptions& options, const TextsInstead::Texts* texts) {
  begin_json(options.json);
  Exit exit = Exit::kUsage;
  {
    std::optional<TextsInstead> instead;
    if (texts != nullptr) instead.emplace(*texts);
    ReportOfRun none;
    exit = run_command(options, none);
  }
  if (exit == Exit::kUsage) write_failure(options.json);
  std::fflush(nullptr);
  ::_exit(static_cast<int>(exit));
}

/// Its standard streams: nothing comes in, all goes to a file.
bool redirect(const std::string& output) {
  const int in = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  const int out = ::open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  return in >= 0 && out >= 0 && ::dup2(in, STDIN_FILENO) >= 0 && ::dup2(out, STDOUT_FILENO) >= 0 &&
         ::dup2(out, STDERR_FILENO) >= 0;
}

}  // namespace

RunWorkers::RunWorkers(std::string folder, std::size_t jobs, double limit_s)
    : folder_(std::move(folder)),
      jobs_(jobs > 0 ? jobs : std::max(1U, std::thread::hardware_concurrency())),
      limit_s_(limit_s) {
  if (folder_.empty()) return;
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
  fs::create_directories(folder_, ignored);
}

RunWorkers::~RunWorkers() {
  end_all();
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

void RunWorkers::end_all() {
  for (const Going& one : going_) {
    (void)::kill(-one.child, SIGKILL);
    (void)wait_for(one.child);
  }
  going_.clear();
  lacking_.clear();
}

std::string RunWorkers::file_of(std::size_t files, const char* ending) const {
  return fmt::format("{}/{}{}", folder_, files, ending);
}

Status RunWorkers::start(std::uint64_t number, RunOptions options) {
  return begin(Work::kRun, number, std::move(options));
}

Status RunWorkers::begin(Work work, std::uint64_t number, RunOptions options) {
  if (folder_.empty()) return fail("there is no folder for what runs write", "set TMPDIR");
  const std::size_t files = started_++;
  options.json = file_of(files, ".json");
  options.lacks_kernels = work == Work::kRun ? file_of(files, kLacks) : std::string();
  std::fflush(nullptr);
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    (void)::setpgid(0, 0);
    (void)::prctl(PR_SET_PDEATHSIG, SIGKILL);  // a sweep that is killed leaves nobody
    if (::getppid() != parent || !redirect(file_of(files, ".txt"))) ::_exit(127);
    if (work == Work::kBuild) build_here(options, texts_);
    run_here(options, texts_);
  }
  if (child < 0) {
    return fail(std::string("no process can be made for a run: ") + std::strerror(errno),
                "end other processes, or give fewer at once: --jobs");
  }
  (void)::setpgid(child, child);
  going_.push_back({.number = number,
                    .options = std::move(options),
                    .work = work,
                    .files = files,
                    .child = child,
                    .ended = Descriptor(static_cast<int>(::syscall(SYS_pidfd_open, child, 0))),
                    .begin = WorkerClock::now()});
  return {};
}

/// One at a time: the next one's may be the same kernels, and each build uses every core.
Status RunWorkers::build_next() {
  const auto builds = [](const Going& one) { return one.work == Work::kBuild; };
  if (lacking_.empty() || std::ranges::any_of(going_, builds)) return {};
  Going next = std::move(lacking_.front());
  lacking_.erase(lacking_.begin());
  return begin(Work::kBuild, next.number, std::move(next.options));
}

bool RunWorkers::lacks_kernels(const Going& one) const {
  std::error_code ignored;
  return one.work == Work::kRun && fs::remove(file_of(one.files, kLacks), ignored);
}

Result<std::vector<EndedRun>> RunWorkers::take_ended() {
  if (Status built = build_next(); !built) return std::unexpected(built.error());
  std::vector<pollfd> polled;
  for (const Going& one : going_)
    polled.push_back({.fd = one.ended.get(), .events = POLLIN, .revents = 0});
  (void)::poll(polled.data(), polled.size(), 100);
  std::vector<EndedRun> all;
  for (std::size_t i = 0; i < going_.size();) {
    Going& one = going_[i];
    int raw = 0;
    if (::waitpid(one.child, &raw, WNOHANG) == one.child) {
      Going over = std::move(one);
      going_.erase(going_.begin() + static_cast<std::ptrdiff_t>(i));
      if (over.work == Work::kBuild) {
        const Status again = begin(Work::kRunAgain, over.number, std::move(over.options));
        if (!again) return std::unexpected(again.error());
        continue;
      }
      if (lacks_kernels(over)) {
        (void)ended(over, 0);  // removes what it wrote
        lacking_.push_back(std::move(over));
        continue;
      }
      auto run = ended(over, exit_status(raw));
      if (!run) return std::unexpected(run.error());
      all.push_back(std::move(*run));
      continue;
    }
    const std::chrono::duration<double> took = WorkerClock::now() - one.begin;
    if (one.work != Work::kBuild && !one.late && took.count() > limit_s_) {
      one.late = true;
      (void)::kill(-one.child, SIGKILL);
    }
    ++i;
  }
  return all;
}

Result<EndedRun> RunWorkers::ended(const Going& one, int status) const {
  const std::chrono::duration<double> took = WorkerClock::now() - one.begin;
  const std::string json = file_of(one.files, ".json"), output = file_of(one.files, ".txt");
  std::error_code ignored;
  if (status == static_cast<int>(Exit::kUsage) && !one.late && !fs::exists(json, ignored)) {
    return fail(folder_ + ": a run's result cannot be written there",
                "make room; then the same command goes on from here");
  }
  EndedRun ended{.number = one.number,
                 .run = child_run(json, output, status, one.late ? limit_s_ : 0.0),
                 .seconds = took.count()};
  for (const std::string& file : {json, output}) (void)::unlink(file.c_str());
  return ended;
}

}  // namespace tandem::apps
