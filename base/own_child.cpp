#include "base/own_child.hpp"

#include <fcntl.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>

namespace tandem {
namespace {

using std::chrono::nanoseconds;

constexpr nanoseconds kLook = std::chrono::milliseconds(10);
constexpr nanoseconds kPatience = std::chrono::seconds(2);
constexpr rlim_t kProcessor_s = 10;

nanoseconds now() noexcept {
  timespec at{};
  ::clock_gettime(CLOCK_MONOTONIC, &at);
  return std::chrono::seconds(at.tv_sec) + nanoseconds(at.tv_nsec);
}

void pause_for(nanoseconds time) noexcept {
  const timespec length{.tv_sec = 0, .tv_nsec = time.count()};
  ::nanosleep(&length, nullptr);
}

/// Waits for something, be it for ever. One that waits for the processor or the disk does not.
bool sleeps(pid_t child) noexcept {
  char path[32], text[512];
  std::snprintf(path, sizeof path, "/proc/%d/stat", static_cast<int>(child));
  const int file = ::open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const ssize_t size = ::read(file, text, sizeof text - 1);
  ::close(file);
  if (size <= 0) return false;
  text[size] = '\0';
  const char* const name_end = std::strrchr(text, ')');
  return name_end != nullptr && std::strncmp(name_end, ") S", 3) == 0;
}

bool ended_well(pid_t child, const ChildTime& time) noexcept {
  const nanoseconds began = now();
  nanoseconds slept{};
  const char* notice = time.notice;
  for (nanoseconds taken{}; taken < time.longest && slept < kPatience; taken = now() - began) {
    int status = 0;
    const pid_t ended = ::waitpid(child, &status, WNOHANG);
    if (ended != 0) return ended == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
    if (notice != nullptr && taken > kPatience) {
      (void)!::write(STDERR_FILENO, notice, std::strlen(notice));
      notice = nullptr;
    }
    pause_for(kLook);
    slept = sleeps(child) ? slept + kLook : nanoseconds{};
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  return false;
}

/// What it inherits from the thread of a loop is not for work that nobody waits for.
void become_ordinary() noexcept {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGXCPU})
    std::signal(signal, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  const rlimit processor{kProcessor_s, kProcessor_s};
  ::setrlimit(RLIMIT_CPU, &processor);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const sched_param ordinary{};
  ::sched_setscheduler(0, SCHED_OTHER, &ordinary);
  cpu_set_t all;
  std::memset(&all, 0xFF, sizeof all);
  ::sched_setaffinity(0, sizeof all, &all);
}

}  // namespace

bool run_in_child(void (*work)(void*), void* with, const ChildTime& time) noexcept {
  const pid_t child = ::_Fork();
  if (child != 0) return child > 0 && ended_well(child, time);
  become_ordinary();
  work(with);
  ::_exit(0);
}

}  // namespace tandem
