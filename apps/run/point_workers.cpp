#include "apps/run/point_workers.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "apps/run/commands.hpp"
#include "apps/text/console.hpp"
#include "base/process.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;
using WorkerClock = std::chrono::steady_clock;

/// What a point's process does: the same as `tandem run` with its settings.
[[noreturn]] void run_point(const sweep::Study& study, const sweep::Point& point,
                            const PreparedStudy& prepared, const std::string& json,
                            const std::string& log_folder) {
  RunOptions options = child_options(study.experiment);
  options.settings = point.settings;
  options.seed = point.seed;
  options.kernel_variant = prepared.kernel_variant;
  options.json = json;
  options.no_log = log_folder.empty();
  options.log_folder = log_folder;
  begin_json(json);
  Exit exit = Exit::kUsage;
  {
    const TextsInstead instead(prepared.texts);
    ReportOfRun none;
    exit = run_command(options, none);
  }
  if (exit == Exit::kUsage) write_failure(json);
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

PointWorkers::PointWorkers(const sweep::Study& study, std::string folder,
                           const PreparedStudy& prepared)
    : study_(study), folder_(std::move(folder)), prepared_(prepared) {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
  fs::create_directories(folder_, ignored);
}

PointWorkers::~PointWorkers() {
  for (const Going& one : going_) {
    (void)::kill(-one.child, SIGKILL);
    (void)wait_for(one.child);
  }
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

std::string PointWorkers::file_of(const sweep::Point& point, const char* ending) const {
  return fmt::format("{}/{}{}", folder_, point.index, ending);
}

Status PointWorkers::start(const sweep::Point& point, const std::string& log_folder) {
  std::fflush(nullptr);
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    (void)::setpgid(0, 0);
    (void)::prctl(PR_SET_PDEATHSIG, SIGKILL);  // a sweep that is killed leaves nobody
    if (::getppid() != parent || !redirect(file_of(point, ".txt"))) ::_exit(127);
    run_point(study_, point, prepared_, file_of(point, ".json"), log_folder);
  }
  if (child < 0) {
    return fail(std::string("no process can be made for a point: ") + std::strerror(errno),
                "end other processes, or give fewer workers: --jobs");
  }
  (void)::setpgid(child, child);
  going_.push_back({.point = point,
                    .child = child,
                    .ended = Descriptor(static_cast<int>(::syscall(SYS_pidfd_open, child, 0))),
                    .begin = WorkerClock::now()});
  return {};
}

Status PointWorkers::wait(const Take& take) {
  std::vector<pollfd> polled;
  for (const Going& one : going_)
    polled.push_back({.fd = one.ended.get(), .events = POLLIN, .revents = 0});
  (void)::poll(polled.data(), polled.size(), 100);
  for (std::size_t i = 0; i < going_.size();) {
    Going& one = going_[i];
    int raw = 0;
    if (::waitpid(one.child, &raw, WNOHANG) == one.child) {
      const Status taken = take_one(one, exit_status(raw), take);
      going_.erase(going_.begin() + static_cast<std::ptrdiff_t>(i));
      if (!taken) return taken;
      continue;
    }
    const std::chrono::duration<double> took = WorkerClock::now() - one.begin;
    if (!one.late && took.count() > study_.time_limit_s) {
      one.late = true;
      (void)::kill(-one.child, SIGKILL);
    }
    ++i;
  }
  return {};
}

Status PointWorkers::take_one(Going& one, int status, const Take& take) {
  const std::chrono::duration<double> took = WorkerClock::now() - one.begin;
  const std::string json = file_of(one.point, ".json"), output = file_of(one.point, ".txt");
  std::error_code ignored;
  if (status == static_cast<int>(Exit::kUsage) && !one.late && !fs::exists(json, ignored)) {
    return fail(folder_ + ": a point's result cannot be written there",
                "make room; then the same command goes on from here");
  }
  const ChildRun run = child_run(json, output, status, one.late ? study_.time_limit_s : 0.0);
  for (const std::string& file : {json, output}) (void)::unlink(file.c_str());
  return take(one.point, run, took.count());
}

}  // namespace tandem::apps
