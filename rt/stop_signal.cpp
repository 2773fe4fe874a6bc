// Signal handlers that only set atomic flags. SIGINT, SIGTERM and SIGHUP keep their default action
// for the second time, so that a run that hangs can still be ended.
#include "rt/stop_signal.hpp"

#include <atomic>
#include <csignal>

namespace tandem::rt {
namespace {

// A signal handler reaches nothing but a global.
std::atomic<bool> stop_flag{false};
static_assert(std::atomic<bool>::is_always_lock_free);

std::atomic<bool> emergency_flag{false};

extern "C" void on_emergency_signal(int) { emergency_flag.store(true, std::memory_order_relaxed); }
extern "C" void on_stop_signal(int) { stop_flag.store(true, std::memory_order_relaxed); }

}  // namespace

void install_stop_signals() {
  struct sigaction action {};
  action.sa_handler = on_stop_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // the second signal acts as usual
  sigemptyset(&action.sa_mask);
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  // The terminal has gone; under nohup it is to be ignored.
  struct sigaction former {};
  ::sigaction(SIGHUP, nullptr, &former);
  if (former.sa_handler != SIG_IGN) ::sigaction(SIGHUP, &action, nullptr);
}

void install_emergency_signal() {
  struct sigaction action {};
  action.sa_handler = on_emergency_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  ::sigaction(SIGUSR1, &action, nullptr);
}

bool take_emergency_stop() noexcept TANDEM_RT {
  return emergency_flag.load(std::memory_order_relaxed) &&
         emergency_flag.exchange(false, std::memory_order_relaxed);
}

bool stop_requested() noexcept TANDEM_RT { return stop_flag.load(std::memory_order_relaxed); }
void request_stop() noexcept { stop_flag.store(true, std::memory_order_relaxed); }
void clear_stop() noexcept { stop_flag.store(false, std::memory_order_relaxed); }

}  // namespace tandem::rt
