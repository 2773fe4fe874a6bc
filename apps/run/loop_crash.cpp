// Handlers of std::terminate, of signals and of exit(), which stop the loop's thread in a cycle.
#include "apps/run/loop_crash.hpp"

#include <fmt/core.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <string>

#include "apps/text/console.hpp"
#include "base/call_stack.hpp"
#include "base/crash_signals.hpp"
#include "base/loaded_libraries.hpp"
#include "controllers/hosted_call.hpp"

namespace tandem::apps {
namespace {

thread_local runtime::Heartbeat* loop_heartbeat = nullptr;  // null: another thread
std::terminate_handler usual_end = nullptr;
/// For a signal handler when the loop's own stack is full.
alignas(std::max_align_t) std::array<std::byte, 262144> signal_stack;
std::atomic<const char*> reason{nullptr};
/// In memory that a child shares, which finds it out: CrashPlace.
struct SharedPlace {
  std::array<char, 512> function{}, file{};
  int line = 0;
  std::atomic<bool> known{false};
};
SharedPlace* shared_place = nullptr;  // null: there is no memory for it
constexpr char kTitle[] = "called from (innermost first):";

bool in_cycle() noexcept {
  return loop_heartbeat != nullptr && runtime::Heartbeat::at_work(loop_heartbeat->beats());
}

/// The innermost call of a controller's library, and of its own files if one is: a template of
/// /usr/include is not what its author wrote. Without any the innermost call of all.
CrashPlace author_place(const CallStack& stack) {
  const std::vector<CallPlace> places = places_of(stack);
  const CallPlace* chosen = nullptr;
  for (const CallPlace& place : places) {
    if (!is_defined_beside(place.call, "tandem_controller_plugin")) continue;  // no controller's
    if (chosen == nullptr) chosen = &place;
    if (place.file.empty() || place.file.starts_with("/usr/")) continue;
    chosen = &place;
    break;
  }
  if (chosen == nullptr && !places.empty()) chosen = &places.front();
  if (chosen == nullptr) return {};
  return {chosen->function, chosen->file, chosen->line};
}

/// For the thread that ends the process. In a child.
void share_place(void* stack) {
  const CrashPlace place = author_place(*static_cast<const CallStack*>(stack));
  const auto copy = [](const std::string& from, std::array<char, 512>& to) {
    to[from.copy(to.data(), to.size() - 1)] = '\0';
  };
  copy(place.function, shared_place->function);
  copy(place.file, shared_place->file);
  shared_place->line = place.line;
  shared_place->known.store(true);
}

/// A crash outside of the cycle, in a controller's code.
struct EarlyCrash {
  const char* controller;
  const char* why;
  const CallStack* stack;  // null: without a place

  static void write(void* self) {
    const auto& crash = *static_cast<const EarlyCrash*>(self);
    const CrashPlace place = crash.stack == nullptr ? CrashPlace{} : author_place(*crash.stack);
    fail_begun_json({.message = std::string("the controller crashed before its first cycle: ") +
                                crash.why + place.in_function(),
                     .hint = "correct it; the standard error has the calls",
                     .file = place.file,
                     .line = place.line,
                     .key = crash.controller});
  }
};

/// The JSON of a process that ends now.
void write_early_crash(const char* controller, const char* why, const CallStack& stack) {
  EarlyCrash crash{controller, why, &stack};
  if (run_in_child(&EarlyCrash::write, &crash)) return;
  crash.stack = nullptr;
  (void)run_in_child(&EarlyCrash::write, &crash);
}

void write_early_exit(const std::string& controller, const char* message) {
  fail_begun_json({.message = message,
                   .hint = "a controller returns its errors; correct it",
                   .file = {},
                   .key = controller});
}

/// What stops the robot does not wait for the words.
[[noreturn]] void stand_still(const char* why, const CallStack& stack) {
  reason.store(why);
  loop_heartbeat->stand_still();
  write_call_stack(STDERR_FILENO, kTitle, stack);
  CallStack copy = stack;
  if (shared_place != nullptr) (void)run_in_child(&share_place, &copy);
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

/// To standard error; what is no sign of ASCII is a question mark.
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
           {": the controller crashed before its first cycle: ", crash_text(signal), "\n"})
        write_text(part);
      const CallStack stack = interrupted_call_stack(context);
      write_call_stack(STDERR_FILENO, kTitle, stack);
      write_early_crash(controller, crash_text(signal), stack);
    }
    std::signal(signal, SIG_DFL);
    std::raise(signal);
    return;
  }
  write_text("fault: the loop crashed, and stands still: ");
  write_text(crash_text(signal));
  write_text("\n");
  stand_still(crash_text(signal), interrupted_call_stack(context));
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
  for (const int signal : kCrashSignals) handle(signal);
}

}  // namespace

const char* crash_reason() noexcept {
  const char* why = reason.load();
  return why == nullptr ? "" : why;
}

std::string CrashPlace::in_function() const { return function.empty() ? "" : " in " + function; }

CrashPlace crash_place() {
  if (shared_place == nullptr || reason.load() == nullptr) return {};
  constexpr timespec kLook{.tv_sec = 0, .tv_nsec = 10'000'000};
  for (int i = 0; i < 150 && !shared_place->known.load(); ++i) ::nanosleep(&kLook, nullptr);
  if (!shared_place->known.load()) return {};
  return {shared_place->function.data(), shared_place->file.data(), shared_place->line};
}

Error loop_error(const std::string& fault) {
  const CrashPlace place = crash_place();
  return {.message = fault + place.in_function(),
          .hint = {},
          .file = place.file,
          .line = place.line,
          .key = {}};
}

void name_crashing_controllers() {
  handle_all();
  tell_hosted_exit(&write_early_exit);
}

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
  if (shared_place == nullptr) {
    void* memory = ::mmap(nullptr, sizeof(SharedPlace), PROT_READ | PROT_WRITE,
                          MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory != MAP_FAILED) shared_place = new (memory) SharedPlace;
  }
  handle_all();
  std::atexit(on_exit);
}

}  // namespace tandem::apps
