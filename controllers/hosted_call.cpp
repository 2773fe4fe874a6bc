// Marks the thread as inside a controller's library, so that an exit() there is reported by name
// instead of ending the process silently.
#include "controllers/hosted_call.hpp"

#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>

namespace tandem {
namespace {

constexpr int kStatus = 2;  // what a controller that cannot be used ends a command with

thread_local const std::string* inside = nullptr;             // the controller whose code runs
thread_local const std::function<void()>* on_exit = nullptr;  // of a bounded_call()

const GivenUp none;
// No object: the clean-up of one is registered with the linker's lock, which a library may hold.
thread_local const GivenUp* given_up = &none;

std::atomic<bool> one_goes_on{false};
std::atomic<void (*)(const std::string&, const char*)> exit_told{nullptr};

void refuse_the_end() {
  if (inside == nullptr) return;
  if (on_exit != nullptr) {
    (*on_exit)();
    for (;;) ::pause();
  }
  constexpr char kMessage[] = "the controller ended the process with exit()";
  std::fprintf(stderr, "error: %s: %s (a controller returns its errors; correct it)\n",
               inside->c_str(), kMessage);
  if (const auto told = exit_told.load()) told(*inside, kMessage);
  ::_exit(kStatus);
}

}  // namespace

HostedCode::HostedCode(const std::string& controller) : outer_(inside), outer_exits_(on_exit) {
  [[maybe_unused]] static const int registered = std::atexit(&refuse_the_end);
  inside = &controller;
}

// What was registered last is called first: before other libraries clean up, which are still
// needed.
HostedCode::HostedCode(const std::string& controller, const std::function<void()>& exits)
    : HostedCode(controller) {
  (void)std::atexit(&refuse_the_end);
  on_exit = &exits;
}

HostedCode::~HostedCode() {
  inside = outer_;
  on_exit = outer_exits_;
}

bool a_hosted_call_goes_on() noexcept { return one_goes_on.load(std::memory_order_relaxed); }
void note_hosted_call_goes_on() noexcept { one_goes_on.store(true, std::memory_order_relaxed); }

const GivenUp& hosted_call_given_up() noexcept { return *given_up; }
void this_thread_is_of(const GivenUp& call) noexcept { given_up = &call; }
void tell_hosted_exit(void (*told)(const std::string&, const char*)) noexcept {
  exit_told.store(told);
}

const char* hosted_controller() noexcept { return inside == nullptr ? nullptr : inside->c_str(); }

}  // namespace tandem
