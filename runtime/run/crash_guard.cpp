#include "runtime/run/crash_guard.hpp"

#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <mutex>
#include <utility>

#include "base/crash_signals.hpp"
#include "base/loaded_libraries.hpp"
#include "base/place_search.hpp"
#include "controllers/hosted_call.hpp"

namespace tandem::runtime {
namespace {

constexpr std::size_t kMostGuards = 64;          // further ones name nobody
constexpr std::size_t kStackBytes = 256 * 1024;  // of handlers, on which debug information is read
constexpr int kExitStatus = 1;                   // as of a run that ended by a fault

/// A thread in a run. No thread_local variable: a handler's first look at one may take the heap.
struct Place {
  std::atomic<CrashScene*> scene{nullptr};
  std::atomic<pthread_t> thread{};
};
std::array<Place, kMostGuards> places;
std::mutex installing;
int guards = 0;
std::array<struct sigaction, kCrashSignals.size()> former{};  // what the handler has replaced
std::atomic<int> hosts{0};                                    // guards while which controllers load
std::atomic<pthread_t> teller{};                              // the thread that ends the process

PlaceSearch* search = nullptr;  // null: nothing was installed yet

bool is_controllers(std::uintptr_t call) noexcept {
  return is_defined_beside(call, "tandem_controller_plugin");
}

/// " at nod.so+0x12a0", which is known at once.
const char* note(const CallStack& stack) noexcept {
  return search->note(stack, &is_controllers) ? search->noted() : "";
}

/// The stack that was noted; its files and lines take their time.
void write_calls() noexcept {
  search->look({.notice = "note: file and line of the crash are looked for, at most 20 s long\n"});
  search->write(STDERR_FILENO, "called from (innermost first):");
}

CrashScene* scene_here() noexcept {
  for (const Place& place : places) {
    CrashScene* const scene = place.scene.load(std::memory_order_acquire);
    if (scene != nullptr && place.thread.load(std::memory_order_relaxed) == ::pthread_self())
      return scene;
  }
  return nullptr;
}

void end_by(int signal) noexcept {
  std::signal(signal, SIG_DFL);
  ::raise(signal);  // at the latest when the handler returns
}

void on_signal(int signal, siginfo_t* info, void* context);

bool is_ours(const struct sigaction& action) {
  return (action.sa_flags & SA_SIGINFO) != 0 && action.sa_sigaction == &on_signal;
}

/// To the handler that was there before.
void pass_on(int signal, siginfo_t* info, void* context) {
  const auto index = std::ranges::find(kCrashSignals, signal) - kCrashSignals.begin();
  const struct sigaction& before = former[static_cast<std::size_t>(index)];
  if ((before.sa_flags & SA_SIGINFO) != 0) {
    before.sa_sigaction(signal, info, context);
  } else if (before.sa_handler == SIG_IGN && info->si_code <= 0) {
    return;
  } else if (before.sa_handler == SIG_DFL || before.sa_handler == SIG_IGN) {
    return end_by(signal);
  } else {
    before.sa_handler(signal);
  }
  // One that came while this one was installed puts it back, and raises the signal again.
  struct sigaction now {};
  sigset_t pending;
  ::sigaction(signal, nullptr, &now);
  if (is_ours(now) && ::sigpending(&pending) == 0 && ::sigismember(&pending, signal) == 1)
    std::signal(signal, SIG_DFL);
}

/// One thread ends the process; another one that crashes meanwhile waits for that.
/// @return false: this thread crashed in the telling
bool become_teller() noexcept {
  pthread_t nobody{};
  if (teller.compare_exchange_strong(nobody, ::pthread_self())) return true;
  while (nobody != ::pthread_self()) ::pause();
  return false;
}

/// Says what crashed: a cycle, or a controller before its first one. False: neither did.
bool tell_crash(int signal, const siginfo_t& info, const void* context) {
  // Not what other processes sent, and not kill() of this one.
  if (info.si_code <= 0 && (info.si_code != SI_TKILL || info.si_pid != ::getpid())) return false;
  CrashScene* const scene = scene_here();
  if (scene != nullptr && scene->in_cycle()) {
    if (become_teller()) {
      scene->tell("crashed", crash_text(signal), crashed_call_stack(context));
    }
    return true;
  }
  const char* const controller = hosts.load() > 0 ? hosted_controller() : nullptr;
  if (controller == nullptr) return false;
  if (!become_teller()) return true;
  const char* const where = note(crashed_call_stack(context));
  for (const char* part : {"fault: controller ", controller,
                           " crashed before its first cycle: ", crash_text(signal), where, "\n"}) {
    write_text(part);
  }
  write_calls();
  return true;
}

void on_signal(int signal, siginfo_t* info, void* context) {
  const bool told = tell_crash(signal, *info, context);
  pass_on(signal, info, context);
  if (told) end_by(signal);
}

void on_exit() {
  CrashScene* const scene = scene_here();
  if (scene == nullptr || !scene->in_cycle()) return;
  scene->tell("called exit()", "", take_call_stack());
  ::_exit(kExitStatus);
}

void install() {
  static std::once_flag once;
  std::call_once(once, [] {
    prepare_call_stacks();
    static PlaceSearch of_the_process;
    search = &of_the_process;
    (void)std::atexit(&on_exit);
  });
  struct sigaction action {};
  action.sa_sigaction = &on_signal;
  action.sa_flags = SA_ONSTACK | SA_SIGINFO;
  for (std::size_t i = 0; i < kCrashSignals.size(); ++i) {
    struct sigaction before {};
    ::sigaction(kCrashSignals[i], &action, &before);
    if (!is_ours(before)) former[i] = before;  // else somebody has put it back
  }
}

void put_back() {
  for (std::size_t i = 0; i < kCrashSignals.size(); ++i) {
    struct sigaction was {};
    ::sigaction(kCrashSignals[i], &former[i], &was);
    if (!is_ours(was)) ::sigaction(kCrashSignals[i], &was, nullptr);  // it came later, and stays
  }
}

}  // namespace

CrashScene::CrashScene(std::function<void(const char*)> last) : last_(std::move(last)) {
  ::sem_init(&wake_, 0, 0);
  if (!last_) return;
  thread_ = std::thread([this] {
    while (::sem_wait(&wake_) != 0) {
    }
    if (ends_) return;
    last_(what_.data());
    done_ = true;
  });
}

CrashScene::~CrashScene() {
  ends_ = true;
  ::sem_post(&wake_);
  if (thread_.joinable()) thread_.join();
  ::sem_destroy(&wake_);
}

void CrashScene::look_at(Run& run) {
  run_ = &run;
  run.controllers().watch_calls(this);
}

void CrashScene::enter(std::uint32_t controller, ControllerFunction function) noexcept {
  controller_ = controller;
  function_ = function;
}

void CrashScene::leave() noexcept { controller_ = kNobody; }

bool CrashScene::in_cycle() const noexcept {
  if (controller_ != kNobody) return true;
  return run_ != nullptr && Heartbeat::at_work(run_->cycle().heartbeat().beats());
}

void CrashScene::tell(const char* how, const char* why, const CallStack& stack) noexcept {
  const char* const colon = *why == '\0' ? "" : ": ";
  const char* const where = note(stack);  // the log's, too
  if (controller_ == kNobody) {
    std::snprintf(what_.data(), what_.size(), "the run %s in its cycle, in no controller%s%s%s",
                  how, colon, why, where);
  } else {
    const char* name = run_->controllers().names()->text(static_cast<std::size_t>(controller_));
    std::snprintf(what_.data(), what_.size(), "controller %s %s in %s%s%s%s",
                  name == nullptr ? "?" : name, how, to_string(function_), colon, why, where);
  }
  for (const char* part : {"fault: ", static_cast<const char*>(what_.data()), "\n"})
    write_text(part);
  ::sem_post(&wake_);
  write_calls();
  constexpr timespec kLook{.tv_sec = 0, .tv_nsec = 10'000'000};
  for (int i = 0; i < 1000 && last_ && !done_; ++i) ::nanosleep(&kLook, nullptr);
}

CrashGuard::CrashGuard(CrashScene& scene, bool hosts_controllers)
    : place_(kMostGuards), hosts_(hosts_controllers) {
  // Not the thread's own, if it has one: Python's has little room.
  thread_local const std::unique_ptr<std::byte[]> room(new std::byte[kStackBytes]);
  const stack_t stack{.ss_sp = room.get(), .ss_flags = 0, .ss_size = kStackBytes};
  has_stack_ = ::sigaltstack(&stack, &stack_before_) == 0;
  const std::lock_guard lock(installing);
  if (hosts_) ++hosts;
  if (guards++ == 0) install();
  for (std::size_t i = 0; i < places.size() && place_ == kMostGuards; ++i) {
    if (places[i].scene.load() != nullptr) continue;
    places[i].thread.store(::pthread_self());
    places[i].scene.store(&scene);
    place_ = i;
  }
}

CrashGuard::~CrashGuard() {
  {
    const std::lock_guard lock(installing);
    if (place_ < kMostGuards) places[place_].scene.store(nullptr);
    if (--guards == 0) put_back();
    if (hosts_) --hosts;
  }
  if (has_stack_) ::sigaltstack(&stack_before_, nullptr);
}

}  // namespace tandem::runtime
