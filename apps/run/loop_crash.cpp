// Handlers of std::terminate, of signals and of exit(), which stop the loop's thread in a cycle.
#include "apps/run/loop_crash.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>

#include "base/call_stack.hpp"
#include "controllers/hosted_call.hpp"

namespace tandem::apps {
namespace {

thread_local runtime::Heartbeat* loop_heartbeat = nullptr;  // null: another thread
std::terminate_handler usual_end = nullptr;
/// For a signal handler when the loop's own stack is full.
alignas(std::max_align_t) std::array<std::byte, 262144> signal_stack;
std::atomic<const char*> reason{nullptr};
constexpr char kTitle[] = "called from (innermost first):";

bool in_cycle() noexcept {
  return loop_heartbeat != nullptr && runtime::Heartbeat::at_work(loop_heartbeat->beats());
}

/// What stops the robot does not wait for the words.
[[noreturn]] void stand_still(const char* why, const CallStack& stack) {
  reason.store(why);
  loop_heartbeat->stand_still();
  write_call_stack(STDERR_FILENO, kTitle, stack);
  while (true) ::pause();
}

/// What is thrown in a controller ends here, as its functions are noexcept.
[[noreturn]] void on_exception() {
  if (!in_cycle()) usual_end();
  std::string what = "of an unknown type";
  try {
    if (const auto thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::exception& exception) {
    what = exception.what();
  } catch (...) {  // NOLINT(bugprone-empty-catch): `what` says so already
  }
  fmt::print(stderr, "fault: an exception left the loop, which stands still: {}\n", what);
  stand_still("an exception", take_call_stack());
}

const char* name_of(int signal) {
  switch (signal) {
    case SIGSEGV: return "segmentation fault (SIGSEGV)";
    case SIGBUS: return "bus error (SIGBUS)";
    case SIGFPE: return "arithmetic error (SIGFPE)";
    case SIGILL: return "illegal instruction (SIGILL)";
    default: return "abort() (SIGABRT)";
  }
}

/// Calls only what is safe in a signal handler.
void write_text(const char* text) { (void)!::write(STDERR_FILENO, text, std::strlen(text)); }

/// The same of a name: what is no sign of ASCII is a question mark.
void write_name(const char* name) {
  for (; *name != '\0'; ++name) {
    const char sign[2] = {*name >= 0x20 && *name < 0x7F ? *name : '?', '\0'};
    write_text(sign);
  }
}

void on_signal(int signal, siginfo_t*, void* context) {
  if (!in_cycle()) {
    if (const char* controller = hosted_controller()) {
      write_text("error: ");
      write_name(controller);
      for (const char* part :
           {": the controller crashed before its first cycle: ", name_of(signal), "\n"})
        write_text(part);
      write_call_stack(STDERR_FILENO, kTitle, interrupted_call_stack(context));
    }
    std::signal(signal, SIG_DFL);
    std::raise(signal);
    return;
  }
  write_text("fault: the loop crashed, and stands still: ");
  write_text(name_of(signal));
  write_text("\n");
  stand_still(name_of(signal), interrupted_call_stack(context));
}

void on_exit() {
  if (!in_cycle()) return;
  write_text("fault: exit() was called in the loop, which stands still\n");
  stand_still("exit()", take_call_stack());
}

void handle(int signal) {
  struct sigaction action {};
  ::sigaction(signal, nullptr, &action);
  if (action.sa_handler != SIG_DFL) return;
  action.sa_sigaction = on_signal;
  action.sa_flags = SA_ONSTACK | SA_SIGINFO;
  ::sigaction(signal, &action, nullptr);
}

void handle_all() {
  prepare_call_stacks();
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) handle(signal);
}

}  // namespace

const char* crash_reason() noexcept {
  const char* why = reason.load();
  return why == nullptr ? "" : why;
}

void name_crashing_controllers() { handle_all(); }

int end_beside_controllers(int status) {
  if (!a_hosted_call_goes_on()) return status;
  std::fflush(nullptr);
  ::_exit(status);
}

void stand_still_on_crash(runtime::Heartbeat& heartbeat) {
  loop_heartbeat = &heartbeat;
  const std::terminate_handler before = std::set_terminate(on_exception);
  if (before != on_exception) usual_end = before;  // else this is not the first run of the process
  stack_t stack{};
  ::sigaltstack(nullptr, &stack);
  if ((stack.ss_flags & SS_DISABLE) != 0) {  // a sanitizer's is its own to free
    stack = {.ss_sp = signal_stack.data(), .ss_flags = 0, .ss_size = signal_stack.size()};
    ::sigaltstack(&stack, nullptr);
  }
  handle_all();
  std::atexit(on_exit);
}

}  // namespace tandem::apps
