// Signal handlers that only set atomic flags. Most signals get their former action back for the
// second time, so that a run that hangs can still be ended. Ended so in its bring-up a robot is
// left with drives that are enabled, so two signals in quick succession are one.
#include "rt/stop_signal.hpp"

#include <time.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>

#include "base/clock_ns.hpp"

namespace tandem::rt {
namespace {

// A signal handler reaches nothing but a global.
std::atomic<bool> stop_flag{false};
static_assert(std::atomic<bool>::is_always_lock_free);

std::atomic<int> stop_cause{0};  // the signal
static_assert(std::atomic<int>::is_always_lock_free);

std::atomic<EmergencyStop> emergency{EmergencyStop::kNone};
static_assert(std::atomic<EmergencyStop>::is_always_lock_free);

extern "C" void on_emergency_signal(int) {
  emergency.store(EmergencyStop::kBySignal, std::memory_order_relaxed);
}

/// A signal whose default action ends the process, and that somebody sends to end it.
struct Taken {
  int signal;
  bool even_ignored = false;  ///< else it stays ignored: SIGHUP under nohup
  bool once_more = true;      ///< the second one ends the process; the kernel repeats SIGXCPU
  struct sigaction former {};
  std::atomic<std::int64_t> first_ns{0};  // when it came first; 0: it did not
};
std::array<Taken, 8> taken{{{.signal = SIGINT, .even_ignored = true},
                            {.signal = SIGTERM, .even_ignored = true},
                            {.signal = SIGHUP},
                            {.signal = SIGQUIT},
                            {.signal = SIGUSR2},
                            {.signal = SIGPWR},
                            {.signal = SIGSTKFLT},
                            {.signal = SIGXCPU, .once_more = false}}};
/// Signals of timers and libraries that have gone: nobody sends them to end anything.
constexpr std::array kIgnored{SIGALRM, SIGVTALRM, SIGPROF, SIGIO, SIGPIPE, SIGXFSZ};
static_assert(std::atomic<std::int64_t>::is_always_lock_free);

extern "C" void on_stop_signal(int signal) {
  const int error = errno;
  int none = 0;
  if (!stop_flag.load(std::memory_order_relaxed)) stop_cause.compare_exchange_strong(none, signal);
  stop_flag.store(true, std::memory_order_relaxed);
  const std::int64_t now_ns = clock_ns(CLOCK_MONOTONIC);
  for (Taken& one : taken) {
    if (one.signal != signal || !one.once_more) continue;
    std::int64_t first_ns = 0;
    if (one.first_ns.compare_exchange_strong(first_ns, now_ns)) break;
    if (now_ns - first_ns < kOneSignal_ns) break;
    ::sigaction(signal, &one.former, nullptr);
    ::raise(signal);  // pending until this returns
  }
  errno = error;
}

bool is_default(int signal) {
  struct sigaction now {};
  return ::sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_DFL;
}

struct sigaction stopping() {
  struct sigaction action {};
  action.sa_handler = on_stop_signal;
  sigemptyset(&action.sa_mask);
  return action;
}

/// Those that have no name: whoever has a use for one has a handler for it.
void take_realtime_signals() {
  const struct sigaction action = stopping();
  for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) {
    if (is_default(signal)) ::sigaction(signal, &action, nullptr);
  }
}

}  // namespace

void install_stop_signals() {
  const struct sigaction action = stopping();
  for (Taken& one : taken) {
    struct sigaction now {};
    ::sigaction(one.signal, nullptr, &now);
    if (now.sa_handler == on_stop_signal) continue;
    const bool ignored = now.sa_handler == SIG_IGN;
    if (!one.even_ignored && now.sa_handler != SIG_DFL) continue;  // it has a use, or none
    one.former = now;
    one.first_ns.store(0);
    if (ignored) one.former.sa_handler = SIG_DFL;  // it could not be ended
    ::sigaction(one.signal, &action, nullptr);
  }
  take_realtime_signals();
  for (const int signal : kIgnored) {
    if (is_default(signal)) std::signal(signal, SIG_IGN);
  }
}

void remove_stop_signals() {
  for (const Taken& one : taken) {
    struct sigaction now {};
    ::sigaction(one.signal, nullptr, &now);
    if (now.sa_handler == on_stop_signal) ::sigaction(one.signal, &one.former, nullptr);
  }
}

void install_emergency_signal() {
  struct sigaction action {};
  action.sa_handler = on_emergency_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  ::sigaction(SIGUSR1, &action, nullptr);
}

void request_emergency_stop() noexcept {
  emergency.store(EmergencyStop::kOnRequest, std::memory_order_relaxed);
}

bool emergency_stop_waits() noexcept TANDEM_RT {
  return emergency.load(std::memory_order_relaxed) != EmergencyStop::kNone;
}

EmergencyStop take_emergency_stop() noexcept TANDEM_RT {
  if (!emergency_stop_waits()) return EmergencyStop::kNone;
  return emergency.exchange(EmergencyStop::kNone, std::memory_order_relaxed);
}

bool stop_requested() noexcept TANDEM_RT { return stop_flag.load(std::memory_order_relaxed); }
void request_stop() noexcept { stop_flag.store(true, std::memory_order_relaxed); }
void clear_stop() noexcept {
  stop_flag.store(false, std::memory_order_relaxed);
  stop_cause.store(0, std::memory_order_relaxed);
  for (Taken& one : taken) one.first_ns.store(0, std::memory_order_relaxed);
}
int stop_signal() noexcept { return stop_cause.load(std::memory_order_relaxed); }

}  // namespace tandem::rt
