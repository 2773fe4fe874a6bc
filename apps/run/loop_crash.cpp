// Handlers of std::terminate, of signals and of exit(), which stop the loop's thread in a cycle.
#include "apps/run/loop_crash.hpp"

#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <initializer_list>
#include <string>
#include <thread>

#include "apps/run/gate.hpp"
#include "apps/text/console.hpp"
#include "base/call_stack.hpp"
#include "base/crash_signals.hpp"
#include "base/loaded_libraries.hpp"
#include "base/place_search.hpp"
#include "controllers/hosted_call.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

thread_local runtime::Heartbeat* loop_heartbeat = nullptr;  // null: another thread
std::terminate_handler usual_end = nullptr;
/// For a signal handler when the loop's own stack is full.
alignas(std::max_align_t) std::array<std::byte, 262144> signal_stack;
std::atomic<const char*> reason{nullptr};
/// The search of the loop's crash, and that of one before the first cycle: null before the first
/// run.
PlaceSearch *loop_search = nullptr, *early_search = nullptr;
std::atomic<bool> robot_stopped{false};
constexpr char kTitle[] = "called from (innermost first):";
constexpr char kNowhere[] =
    "its stack leads nowhere: build it with -fsanitize=address (docs/controllers.md)";
constexpr char kNotice[] = "note: file and line of the crash are looked for, at most 20 s long\n";

/// In one piece, as another thread writes, too. Safe in a signal handler. What is no sign of ASCII
/// is a question mark.
void write_line(std::initializer_list<const char*> parts) noexcept {
  std::array<char, 1024> line;
  std::size_t size = 0;
  for (const char* part : parts) {
    for (; *part != '\0' && size + 1 < line.size(); ++part)
      line[size++] = *part >= 0x20 && *part < 0x7F ? *part : '?';
  }
  line[size++] = '\n';
  (void)!::write(STDERR_FILENO, line.data(), size);
}

bool in_cycle() noexcept {
  return loop_heartbeat != nullptr && runtime::Heartbeat::at_work(loop_heartbeat->beats());
}

bool is_controllers(std::uintptr_t call) noexcept {
  return is_defined_beside(call, "tandem_controller_plugin");
}

/// A robot moves as long as the process lives that crashes outside of its loop.
ChildTime early_time() {
  if (loop_search == nullptr) return {.notice = kNotice};
  return {.longest = std::chrono::seconds(2)};
}

/// A crash outside of the cycle, in a controller's code.
struct EarlyCrash {
  const char* controller;
  const char* why;

  static void write(void* self) {
    const auto& crash = *static_cast<const EarlyCrash*>(self);
    const CrashPlace place = early_search == nullptr ? CrashPlace{} : early_search->place();
    fail_begun_json(
        {.message = std::string("the controller crashed before its first cycle: ") + crash.why +
                    place.in_function(),
         .hint = place.offset.empty() ? kNowhere : "correct it; the standard error has the calls",
         .file = place.file,
         .line = place.line,
         .key = crash.controller});
  }
};

void write_early_exit(const std::string& controller, const char* message) {
  fail_begun_json({.message = message,
                   .hint = "a controller returns its errors; correct it",
                   .file = {},
                   .key = controller});
}

/// First what lets the watchdog stop the robot, which waits for nothing that follows here.
void begin_to_stand_still(const char* why) noexcept {
  reason.store(why);
  loop_heartbeat->stand_still();
}

[[noreturn]] void stand_still(const char* what, const char* more, const CallStack& stack) noexcept {
  const bool looks = loop_search != nullptr && loop_search->note(stack, &is_controllers);
  write_line({"fault: ", what, more, looks ? loop_search->noted() : ""});
  if (looks) {
    constexpr timespec kMillisecond{.tv_sec = 0, .tv_nsec = 1'000'000};
    for (int i = 0; i < 5'000 && !robot_stopped.load(); ++i) ::nanosleep(&kMillisecond, nullptr);
    loop_search->look({.notice = kNotice});
    loop_search->write(STDERR_FILENO, kTitle);
    loop_search->end();
  }
  while (true) ::pause();
}

/// What is thrown in a controller ends here, as its functions are noexcept.
[[noreturn]] void on_exception() {
  if (!in_cycle()) usual_end();
  begin_to_stand_still("an exception");
  std::string what = "of an unknown type";
  try {
    if (const auto thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::exception& exception) {
    what = exception.what();
  } catch (...) {  // NOLINT(bugprone-empty-catch): `what` says so already
  }
  stand_still("an exception left the loop, which stands still: ", what.c_str(), take_call_stack());
}

/// The words of a process that ends now.
void tell_early_crash(const char* controller, const char* why, const CallStack& stack) noexcept {
  const bool looks = early_search != nullptr && early_search->note(stack, &is_controllers);
  write_line({"error: ", controller, kEarlyCrash, why, looks ? early_search->noted() : ""});
  if (!looks) return;
  early_search->look(early_time());
  early_search->write(STDERR_FILENO, kTitle);
  EarlyCrash crash{controller, why};
  (void)run_in_child(&EarlyCrash::write, &crash, early_time());
}

void on_signal(int signal, siginfo_t*, void* context) {
  Gate::stand_aside();  // its own look at the stack would crash
  if (!in_cycle()) {
    if (const char* controller = hosted_controller())
      tell_early_crash(controller, crash_text(signal), crashed_call_stack(context));
    std::signal(signal, SIG_DFL);
    std::raise(signal);
    return;
  }
  begin_to_stand_still(crash_text(signal));
  stand_still("the loop crashed, and stands still: ", crash_text(signal),
              crashed_call_stack(context));
}

void on_exit() {
  if (!in_cycle()) return;
  begin_to_stand_still("exit()");
  stand_still("exit() was called in the loop, which stands still", "", take_call_stack());
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

void robot_is_stopped() noexcept { robot_stopped.store(true); }

void await_crash_place() {
  if (loop_search == nullptr || reason.load() == nullptr) return;
  constexpr std::chrono::milliseconds kLook(10);
  rt::clear_stop();
  for (auto left = kPlaceTime; left > kLook && !loop_search->is_over(); left -= kLook) {
    if (rt::stop_requested()) return;
    std::this_thread::sleep_for(kLook);
  }
}

Error loop_error(const std::string& fault) {
  const bool noted = loop_search != nullptr && loop_search->is_noted();
  const CrashPlace place = noted ? loop_search->place() : CrashPlace{};
  return {.message = fault + place.in_function(),
          .hint = noted && place.offset.empty() ? kNowhere : "",
          .file = place.file,
          .line = place.line,
          .key = {}};
}

void name_crashing_controllers() {
  static PlaceSearch search;
  early_search = &search;
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
  if (loop_search == nullptr) loop_search = new PlaceSearch;  // a crash may come at the very end
  handle_all();
  std::atexit(on_exit);
}

}  // namespace tandem::apps
