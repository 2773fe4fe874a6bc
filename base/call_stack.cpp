// Stacks by libgcc's unwinder; names and lines by libbacktrace, which is g++'s own and takes no
// heap.
#include "base/call_stack.hpp"

#include <backtrace.h>
#include <cxxabi.h>
#include <dlfcn.h>
#include <sys/wait.h>
#include <ucontext.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace tandem {
namespace {

constexpr std::size_t kMostLines = 16;

/// The unwinder alone has it, and reads nothing by it.
backtrace_state* unwinder = nullptr;

void ignore(void*, const char*, int) {}

int add(void* data, std::uintptr_t pc) {
  auto& stack = *static_cast<CallStack*>(data);
  if (pc + 1 == 0 || stack.count == stack.calls.size()) return 1;  // the end of a thread is -1
  stack.calls[stack.count++] = pc;
  return 0;
}

const char* base_name(const char* path) {
  const char* slash = std::strrchr(path, '/');
  return slash == nullptr ? path : slash + 1;
}

struct CallPlaceView {
  std::uintptr_t call;
  const char *function, *file;  // null: unknown
  int line;
};

/// Leaves "<…>" of what a template is made with, where the whole name is long; in place, and a name
/// of which no bracket is left open. What is longer still is cut off.
void shorten(char* name) {
  constexpr std::size_t kLong = 120, kMost = 240;
  constexpr char kLeftOut[] = "<…>";
  if (std::strlen(name) <= kLong) return;
  char* to = name;
  for (const char* from = name; *from != '\0'; ++from) {
    const bool opens =
        *from == '<' && std::isalnum(static_cast<unsigned char>(to > name ? to[-1] : ' ')) != 0;
    const bool is_operator = to - name >= 8 && std::strncmp(to - 8, "operator", 8) == 0;
    const char* end = from;
    for (int depth = 0; opens && !is_operator && *end != '\0'; ++end) {
      if (*end == '<') ++depth;
      if (*end == '>' && end[-1] != '-' && --depth == 0) break;
    }
    if (end - from < static_cast<std::ptrdiff_t>(sizeof kLeftOut) || *end == '\0') {
      *to++ = *from;
      continue;
    }
    to = static_cast<char*>(std::memcpy(to, kLeftOut, sizeof kLeftOut - 1)) + sizeof kLeftOut - 1;
    from = end;
  }
  *to = '\0';
  if (to - name > static_cast<std::ptrdiff_t>(kMost)) std::strcpy(name + kMost, "...");
}

/// Prints calls line by line without the heap, but for demangling.
struct Printer {
  backtrace_state* state;
  bool demangles;
  std::size_t most;
  void (*put)(void* to, const char* line, const CallPlaceView& place);
  void* to;
  std::uintptr_t pc = 0;
  std::size_t lines = 0;

  void call(std::uintptr_t at) {
    pc = at;
    const std::size_t before = lines;
    ::backtrace_pcinfo(state, pc, &on_line, &ignore, this);
    if (lines == before) ::backtrace_syminfo(state, pc, &on_symbol, &ignore, this);
    if (lines == before) line(nullptr, 0, nullptr);
  }
  static int on_line(void* self, std::uintptr_t, const char* file, int number, const char* name) {
    if (file == nullptr && name == nullptr) return 0;
    static_cast<Printer*>(self)->line(file, number, name);
    return 0;
  }
  static void on_symbol(void* self, std::uintptr_t, const char* name, std::uintptr_t,
                        std::uintptr_t) {
    static_cast<Printer*>(self)->line(nullptr, 0, name);
  }
  void line(const char* file, int number, const char* name) {
    if (lines++ >= most) return;
    Dl_info where{};
    const bool placed = ::dladdr(reinterpret_cast<void*>(pc), &where) != 0;
    if (name == nullptr && placed) name = where.dli_sname;
    char* clear = nullptr;
    if (demangles && name != nullptr) clear = abi::__cxa_demangle(name, nullptr, nullptr, nullptr);
    char place[1024] = "", library[512] = "", text[4096];
    if (file != nullptr) std::snprintf(place, sizeof place, " at %s:%d", file, number);
    if (placed && where.dli_fname != nullptr) {
      std::snprintf(
          library, sizeof library, " (%s+0x%zx)", base_name(where.dli_fname),
          static_cast<std::size_t>(pc - reinterpret_cast<std::uintptr_t>(where.dli_fbase)));
    }
    if (clear != nullptr) {
      shorten(clear);
      name = clear;
    }
    std::snprintf(text, sizeof text, "%.2000s%s%s", name != nullptr ? name : "?", place, library);
    put(to, text, {pc, name, file, number});
    std::free(clear);
  }
};

void print(const CallStack& stack, bool demangles, std::size_t most,
           void (*put)(void*, const char*, const CallPlaceView&), void* to) {
  // A new one each time: it knows the libraries that are loaded when it is first asked.
  Printer printer{::backtrace_create_state(nullptr, 1, &ignore, nullptr), demangles, most, put, to};
  for (const std::uintptr_t pc : stack.view()) {
    if (printer.lines >= most) break;
    printer.call(pc);
  }
}

struct Output {
  int fd;
  const char* title;  // null: it is written

  void say(const char* text) const { (void)!::write(fd, text, std::strlen(text)); }
  static void put(void* self, const char* line, const CallPlaceView&) {
    auto& out = *static_cast<Output*>(self);
    if (out.title != nullptr) {
      out.say(out.title);
      out.say("\n");
      out.title = nullptr;
    }
    out.say("  ");
    out.say(line);
    out.say("\n");
  }
};

/// Whether the child ended well within some 2 s.
bool ended_well(pid_t child) {
  for (int i = 0; i < 250; ++i) {
    int status = 0;
    const pid_t ended = ::waitpid(child, &status, WNOHANG);
    if (ended != 0) return ended == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
    constexpr timespec kLook{.tv_sec = 0, .tv_nsec = 10'000'000};
    ::nanosleep(&kLook, nullptr);
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  return false;
}

struct Registers {
  std::uintptr_t pc = 0, caller = 0;  // the caller: 0 where it is not known
};

Registers registers_of(const void* context) noexcept {
  const mcontext_t& m = static_cast<const ucontext_t*>(context)->uc_mcontext;
#if defined(__x86_64__)
  Registers found{.pc = static_cast<std::uintptr_t>(m.gregs[REG_RIP])};
  if (found.pc == 0)  // the call has just pushed where it came from
    found.caller = *reinterpret_cast<const std::uintptr_t*>(m.gregs[REG_RSP]);
  return found;
#elif defined(__aarch64__)
  return {.pc = m.pc, .caller = m.regs[30]};
#else
  (void)m;
  return {};
#endif
}

}  // namespace

void prepare_call_stacks() {
  if (unwinder == nullptr) unwinder = ::backtrace_create_state(nullptr, 1, &ignore, nullptr);
  (void)take_call_stack();  // loads the unwinder's library
}

CallStack take_call_stack(std::size_t skip) noexcept {
  CallStack stack;
  ::backtrace_simple(unwinder, static_cast<int>(skip + 1), &add, &ignore, &stack);
  return stack;
}

CallStack interrupted_call_stack(const void* context) noexcept {
  const Registers at = registers_of(context);
  CallStack all = take_call_stack();
  const auto own = all.view();
  const auto first = std::ranges::find_if(
      own, [&](std::uintptr_t pc) { return at.pc != 0 && (pc == at.pc || pc + 1 == at.pc); });
  if (first == own.end()) return {.calls = {at.pc != 0 ? at.pc : at.caller - 1}, .count = 1};
  CallStack stack;
  stack.count = static_cast<std::size_t>(own.end() - first);
  std::ranges::copy(first, own.end(), stack.calls.begin());
  return stack;
}

const void* library_of(std::uintptr_t call) noexcept {
  Dl_info where{};
  return ::dladdr(reinterpret_cast<void*>(call), &where) != 0 ? where.dli_fbase : nullptr;
}

std::vector<std::string> describe(const CallStack& stack, std::size_t most) {
  std::vector<std::string> lines;
  print(
      stack, true, most,
      [](void* to, const char* line, const CallPlaceView&) {
        static_cast<std::vector<std::string>*>(to)->emplace_back(line);
      },
      &lines);
  return lines;
}

std::vector<CallPlace> places_of(const CallStack& stack) {
  std::vector<CallPlace> places;
  print(
      stack, true, stack.calls.size(),
      [](void* to, const char*, const CallPlaceView& at) {
        static_cast<std::vector<CallPlace>*>(to)->push_back(
            {at.call, at.function == nullptr ? "" : at.function, at.file == nullptr ? "" : at.file,
             at.line});
      },
      &places);
  return places;
}

bool run_in_child(void (*work)(void*), void* with) noexcept {
  const pid_t child = ::_Fork();
  if (child != 0) return child > 0 && ended_well(child);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGALRM}) {
    std::signal(signal, SIG_DFL);
  }
  ::alarm(2);
  work(with);
  ::_exit(0);
}

void write_call_stack(int fd, const char* title, const CallStack& stack) noexcept {
  Output out{fd, title};
  struct Job {
    const CallStack& stack;
    Output& out;
  } job{stack, out};
  const auto named = [](void* with) {
    auto& of = *static_cast<Job*>(with);
    print(of.stack, true, kMostLines, &Output::put, &of.out);
  };
  if (run_in_child(named, &job)) return;
  print(stack, false, kMostLines, &Output::put, &out);
}

}  // namespace tandem
