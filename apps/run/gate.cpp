// Heap, locks and threads come by the functions that tandem_gate.so interposes. System calls come
// by Linux' syscall user dispatch: within a controller's call each raises SIGSYS, whose handler
// notes it and lets it happen. Page faults are counted.
#include "apps/run/gate.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/core.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "base/counted.hpp"
#include "base/loaded_libraries.hpp"
#include "base/process.hpp"
#include "controllers/hosted_call.hpp"

namespace tandem::apps {
namespace {

constexpr char kTell[] = "tandem_gate_tell", kLoaded[] = "TANDEM_GATE_LOADED";
constexpr int kDispatch = 59;  // PR_SET_SYSCALL_USER_DISPATCH, newer than Debian's header
constexpr std::uint64_t kWarmCalls = 100;  // without locked memory: first touches of code and data
constexpr std::uint64_t kFaultyCalls = 3;  // the same: with fewer it keeps the rule
constexpr std::size_t kStackLines = 12;    // without those of the standard library's templates

Gate* told = nullptr;               // who is told
thread_local bool in_call = false;  // of a controller, in the cycle

struct RuleRow {
  const char* name;
  std::initializer_list<const char*> calls;
};
const RuleRow kRules[kGateRules] = {
    {"no allocation",
     {"malloc", "calloc", "realloc", "free", "memalign", "aligned_alloc", "posix_memalign"}},
    {"no lock",
     {"pthread_mutex_lock", "pthread_cond_wait", "pthread_cond_timedwait", "pthread_cond_clockwait",
      "pthread_rwlock_rdlock", "pthread_rwlock_wrlock", "sem_wait"}},
    {"no system call", {"nanosleep", "clock_nanosleep", "usleep", "read", "write"}},
    {"no thread", {"pthread_create", "pthread_join"}},
    {"no page fault", {}},
};

GateRule rule_of(const char* call) noexcept {
  for (std::size_t rule = 0; rule < kGateRules; ++rule) {
    for (const char* one : kRules[rule].calls)
      if (std::strcmp(one, call) == 0) return static_cast<GateRule>(rule);
  }
  return GateRule::kSystemCall;
}

/// The name of a system call that a controller is likely to make; else its number.
std::string name_of_system_call(long number) {
  constexpr std::pair<long, const char*> kNames[] = {{SYS_read, "read"},
                                                     {SYS_write, "write"},
                                                     {SYS_openat, "openat"},
                                                     {SYS_close, "close"},
                                                     {SYS_futex, "futex"},
                                                     {SYS_clock_nanosleep, "clock_nanosleep"},
                                                     {SYS_mmap, "mmap"},
                                                     {SYS_munmap, "munmap"},
                                                     {SYS_brk, "brk"},
                                                     {SYS_mprotect, "mprotect"},
                                                     {SYS_madvise, "madvise"},
                                                     {SYS_ioctl, "ioctl"},
                                                     {SYS_sendto, "sendto"},
                                                     {SYS_recvfrom, "recvfrom"},
                                                     {SYS_sendmsg, "sendmsg"},
                                                     {SYS_recvmsg, "recvmsg"},
                                                     {SYS_getrandom, "getrandom"},
                                                     {SYS_sched_yield, "sched_yield"},
                                                     {SYS_clone3, "clone3"},
                                                     {SYS_newfstatat, "newfstatat"},
                                                     {SYS_fsync, "fsync"},
                                                     {SYS_getpid, "getpid"},
                                                     {SYS_gettid, "gettid"},
                                                     {SYS_clock_gettime, "clock_gettime"}};
  const auto found = std::ranges::find(kNames, number, &std::pair<long, const char*>::first);
  return found != std::end(kNames) ? found->second : fmt::format("system call {}", number);
}

long page_faults() noexcept {
  rusage used{};
  ::getrusage(RUSAGE_THREAD, &used);
  return used.ru_minflt + used.ru_majflt;
}

/// What this process was started with.
std::vector<std::string> own_words() {
  std::string line;
  const int file = ::open("/proc/self/cmdline", O_RDONLY | O_CLOEXEC);
  std::array<char, 4096> part;
  for (ssize_t got = 0; (got = ::read(file, part.data(), part.size())) > 0;)
    line.append(part.data(), static_cast<std::size_t>(got));
  ::close(file);
  std::vector<std::string> words;
  for (std::size_t at = 0; at < line.size(); at += words.back().size() + 1)
    words.emplace_back(line.c_str() + at);
  return words;
}

std::string preload_path() {
  for (const char* place : {"../lib/tandem_gate.so", "../lib/tandem/tandem_gate.so"}) {
    const std::filesystem::path path = program_beside(place);
    std::error_code error;
    if (std::filesystem::exists(path, error)) return path.lexically_normal().string();
  }
  return {};
}

}  // namespace

Status Gate::enter_process() {
  if (::dlsym(RTLD_DEFAULT, kTell) != nullptr) {
    const char* former = std::getenv(kLoaded);
    const std::string others = former == nullptr ? "" : former;
    others.empty() ? ::unsetenv("LD_PRELOAD") : ::setenv("LD_PRELOAD", others.c_str(), 1);
    ::unsetenv(kLoaded);  // children have no gate
    return {};
  }
  const std::string traps = preload_path();
  if (traps.empty()) {
    return fail("there are no traps for a gate: tandem_gate.so is missing",
                "use a build without a sanitizer, which has traps of its own");
  }
  if (std::getenv(kLoaded) != nullptr) {
    return fail("the traps of the gate were not loaded: " + traps,
                "a program with capabilities or set-user-id loads none: use another copy of it");
  }
  // By a descriptor that stays open: the loader takes blanks and colons of a path for its ends.
  const int file = ::open(traps.c_str(), O_RDONLY);
  if (file < 0) return fail("cannot open " + traps, "make it readable");
  const std::string preloaded = "/proc/self/fd/" + std::to_string(file);
  const char* given = std::getenv("LD_PRELOAD");
  const std::string others = given == nullptr ? "" : given;
  ::setenv("LD_PRELOAD", (preloaded + (others.empty() ? "" : ":") + others).c_str(), 1);
  ::setenv(kLoaded, others.c_str(), 1);
  return std::unexpected(become("/proc/self/exe", own_words()));
}

std::unique_ptr<Gate> Gate::open() {
  prepare_call_stacks();
  std::unique_ptr<Gate> opened(new Gate);
  opened->locked_ = ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  struct sigaction action {};
  action.sa_sigaction = &on_system_call;
  action.sa_flags = SA_SIGINFO | SA_ONSTACK;
  ::sigaction(SIGSYS, &action, nullptr);
  told = opened.get();
  const auto tell = reinterpret_cast<void (*)(void (*)(const char*))>(::dlsym(RTLD_DEFAULT, kTell));
  if (tell != nullptr) tell(&on_call);
  return opened;
}

Gate::~Gate() { told = nullptr; }

void Gate::watch_system_calls() noexcept {
  no_dispatch_ = ::prctl(kDispatch, 1, 0UL, 0UL, &selector_) == 0 ? 0 : errno;
}

void Gate::enter(std::uint32_t controller, runtime::ControllerFunction function) noexcept {
  if (no_dispatch_ < 0) watch_system_calls();
  controller_ = controller;
  function_ = function;
  ++calls_;
  faults_ = page_faults();
  in_call = true;
  if (no_dispatch_ == 0) selector_ = 1;
}

void Gate::leave() noexcept {
  selector_ = 0;
  in_call = false;
  const long faults = page_faults() - faults_;
  if (faults == 0 || (!locked_ && calls_ <= kWarmCalls)) return;
  note({.rule = GateRule::kPageFault,
        .controller = static_cast<std::int32_t>(controller_),
        .function = function_,
        .call = "page fault",
        .stack = {}});
}

void Gate::stand_aside() noexcept {
  if (told != nullptr) told->selector_ = 0;
  in_call = false;
}

/// On any thread, and inside malloc.
void Gate::on_call(const char* call) {
  if (told == nullptr) return;
  if (in_call) {
    in_call = false;  // what follows is ours
    const char watched = told->selector_;
    told->selector_ = 0;
    told->note({.rule = rule_of(call),
                .controller = static_cast<std::int32_t>(told->controller_),
                .function = told->function_,
                .call = call,
                .stack = take_call_stack()});
    told->selector_ = watched;
    in_call = true;
    return;
  }
  if (*call != 'p' || rule_of(call) != GateRule::kThread) return;
  const char* const controller = hosted_controller();
  if (controller == nullptr) return;
  Note what{.rule = GateRule::kThread, .call = call, .stack = take_call_stack()};
  std::strncpy(what.named.data(), controller, what.named.size() - 1);
  told->note(what);
}

/// The call is made once more after it, and the rest of the controller's call is not watched: there
/// is one in a cycle, but never two for the same.
void Gate::on_system_call(int, siginfo_t* about, void* context) {
  if (told == nullptr) return;
  told->selector_ = 0;
  const bool ours = std::exchange(in_call, false);
  told->note({.rule = GateRule::kSystemCall,
              .controller = static_cast<std::int32_t>(told->controller_),
              .function = told->function_,
              .system_call = about->si_syscall,
              .stack = interrupted_call_stack(context)});
  in_call = ours;
#if defined(__x86_64__)
  static_cast<ucontext_t*>(context)->uc_mcontext.gregs[REG_RIP] -= 2;  // to `syscall` itself
#elif defined(__aarch64__)
  static_cast<ucontext_t*>(context)->uc_mcontext.pc -= 4;
#endif
}

void Gate::note(const Note& what) noexcept {
  while (noting_.test_and_set(std::memory_order_acquire)) {
  }
  const auto end = notes_.begin() + static_cast<std::ptrdiff_t>(noted_);
  const auto same = std::find_if(notes_.begin(), end, [&](const Note& one) {
    return one.rule == what.rule && one.controller == what.controller &&
           one.function == what.function && one.system_call == what.system_call &&
           std::ranges::equal(one.stack.view(), what.stack.view());
  });
  if (same != end) {
    ++same->count;
  } else if (noted_ < notes_.size()) {
    Note& added = notes_[noted_++];
    added = what;
    added.count = 1;
    added.first_call = calls_;
  }
  noting_.clear(std::memory_order_release);
}

namespace {

/// Where a stack comes to the controller that was called; its size: it does not.
std::size_t controller_at(std::span<const std::uintptr_t> calls) {
  const auto found = std::ranges::find_if(calls, [](std::uintptr_t call) {
    return is_defined_beside(call, "tandem_controller_plugin");
  });
  return static_cast<std::size_t>(found - calls.begin());
}

const void* own_library() { return library_of(reinterpret_cast<std::uintptr_t>(&rule_of)); }
const void* trap_library() {
  return library_of(reinterpret_cast<std::uintptr_t>(::dlsym(RTLD_DEFAULT, kTell)));
}

}  // namespace

/// Whether another note tells of it: what an interposed function, or the program itself for the
/// controller, as of standard error, asks the kernel for.
bool Gate::is_through_trap(const Note& note) const {
  if (note.system_call < 0) return false;
  const void* const traps = trap_library();
  const void* const own = own_library();
  const auto calls = note.stack.view();
  const std::size_t at = controller_at(calls);
  return std::ranges::any_of(calls,
                             [&](std::uintptr_t call) { return library_of(call) == traps; }) ||
         (at < calls.size() && std::ranges::any_of(calls.first(at), [&](std::uintptr_t call) {
            return library_of(call) == own;
          }));
}

/// Without the traps' own frames at its top, the loop's at its end, and the program's between.
GateBreach Gate::breach_of(const Note& note, const runtime::ControllerNames& names) const {
  const void* const traps = trap_library();
  const void* const own = own_library();
  const auto calls = note.stack.view();
  std::size_t begin = 0;
  for (std::size_t i = 0; i < calls.size(); ++i)
    if (library_of(calls[i]) == traps) begin = i + 1;
  const std::size_t at = controller_at(calls);
  std::size_t end = at < calls.size() ? std::max(at, begin) : begin;
  while (end < calls.size() && library_of(calls[end]) != own) ++end;
  CallStack stack;
  for (std::size_t i = begin; i < end; ++i)
    if (library_of(calls[i]) != own) stack.calls[stack.count++] = calls[i];
  std::vector<std::string> lines = describe(stack, 100);
  std::erase_if(lines, [](const std::string& line) { return line.contains(" at /usr/include/"); });
  lines.resize(std::min(lines.size(), kStackLines));
  return {
      .controller = note.controller < 0 ? std::string(note.named.data())
                                        : names.name(static_cast<std::size_t>(note.controller)),
      .function = note.controller < 0 ? "configure()" : runtime::to_string(note.function),
      .call = note.system_call < 0 ? std::string(note.call) : name_of_system_call(note.system_call),
      .count = note.count,
      .first_call = note.controller < 0 ? 0 : note.first_call,
      .stack = std::move(lines)};
}

std::optional<std::string> Gate::unwatched(GateRule rule) const {
  if (rule != GateRule::kSystemCall || no_dispatch_ <= 0) return std::nullopt;
  return fmt::format(
      "this kernel has no syscall user dispatch ({}): only reads, writes and sleeps "
      "were watched",
      std::strerror(no_dispatch_));
}

std::vector<GateResult> Gate::results(const runtime::ControllerNames& names) const {
  std::vector<GateResult> all(kGateRules);
  for (std::size_t i = 0; i < kGateRules; ++i) {
    const auto rule = static_cast<GateRule>(i);
    const auto why = unwatched(rule);
    all[i] = {.rule = kRules[i].name,
              .kept = known(!why, true),
              .note = why.value_or(""),
              .breaches = {}};
    if (rule == GateRule::kPageFault && !locked_) {
      all[i].note = fmt::format("more than {} after the first {} calls: memory could not be locked",
                                kFaultyCalls - 1, kWarmCalls);
    }
  }
  for (std::size_t i = 0; i < noted_; ++i) {
    // What an interposed function asks the kernel for is that function's doing.
    if (is_through_trap(notes_[i])) continue;
    // Memory that is not locked may have been taken from any program.
    if (notes_[i].rule == GateRule::kPageFault && !locked_ && notes_[i].count < kFaultyCalls)
      continue;
    GateResult& result = all[static_cast<std::size_t>(notes_[i].rule)];
    result.kept = false;
    GateBreach breach = breach_of(notes_[i], names);
    // One place, by whatever way of the program's own it was reached.
    const auto same = std::ranges::find_if(result.breaches, [&](const GateBreach& one) {
      return one.controller == breach.controller && one.function == breach.function &&
             one.call == breach.call && one.stack == breach.stack;
    });
    if (same == result.breaches.end()) {
      result.breaches.push_back(std::move(breach));
    } else {
      same->count += breach.count;
    }
  }
  return all;
}

bool kept(const std::vector<GateResult>& results) {
  return std::ranges::none_of(results, [](const GateResult& one) { return one.kept == false; });
}

static void figures(Figures& f, const GateBreach& breach) {
  f("controller", breach.controller);
  f("function", "`configure()`, `start()`, `update()`, …", breach.function);
  f("call", "`malloc`, `write`, `page fault`, …", breach.call);
  f("count", "of this stack", breach.count);
  f("first_call", "of all controllers' calls in the run: 1 is the first; 0: before them",
    breach.first_call);
  f("stack", "the calls that led to it, innermost first; empty of a page fault", breach.stack);
}

void figures(Figures& f, const GateResult& result) {
  f("rule", result.rule);
  f("kept", "null: it could not be watched here", result.kept);
  f("note", "why, or how it was watched; may be empty", result.note);
  f("breaches", "by stack, at most 64", result.breaches);
}

void print_gate(const std::vector<GateResult>& results, std::FILE* out) {
  Table table({"rule", "", ""});
  table.align_left();
  for (const GateResult& one : results) {
    std::string what = one.note;
    if (!one.breaches.empty()) {
      const GateBreach& first = one.breaches.front();
      what = fmt::format("{} in {}: {}", first.call, first.controller, first.function);
      if (one.breaches.size() > 1)
        what += ", and at " + counted(one.breaches.size() - 1, "more place");
    }
    table.add({one.rule, !one.kept ? "not watched" : *one.kept ? "kept" : "broken", what});
  }
  table.print(out);
  for (const GateResult& one : results) {
    for (const GateBreach& breach : one.breaches) {
      fmt::print(out, "\n{}: {} in {}: {}, {}\n", one.rule, breach.call, breach.controller,
                 breach.function,
                 breach.first_call == 0
                     ? std::string("before the first cycle")
                     : fmt::format("{}, first in call {}", counted(breach.count, "time"),
                                   breach.first_call));
      for (const std::string& line : breach.stack) fmt::print(out, "  {}\n", shown(line, 2'000));
    }
  }
}

}  // namespace tandem::apps
