// Stacks by libgcc's unwinder; names and lines by libbacktrace, which is g++'s own and takes no
// heap.
#include "base/call_stack.hpp"

#include <backtrace.h>
#include <cxxabi.h>
#include <dlfcn.h>
#include <link.h>
#include <sys/mman.h>
#include <ucontext.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string_view>

#include "base/own_child.hpp"
#include "base/utf8.hpp"

/// What libbacktrace is given for dl_iterate_phdr() (base/CMakeLists.txt).
extern "C" int tandem_iterate_libraries(int (*visit)(dl_phdr_info*, std::size_t, void*),
                                        void* data);

namespace tandem {
namespace {

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
  if (to - name > static_cast<std::ptrdiff_t>(kMost))
    std::strcpy(name + whole_characters(name, kMost).size(), "...");
}

/// The function by the library's symbols; null: unknown.
const char* symbol_of(backtrace_state* state, std::uintptr_t call) noexcept {
  const char* found = nullptr;
  ::backtrace_syminfo(
      state, call,
      [](void* to, std::uintptr_t, const char* name, std::uintptr_t, std::uintptr_t) {
        *static_cast<const char**>(to) = name;
      },
      &ignore, &found);
  return found;
}

/// What the reader of debug information is shown.
struct Shown {
  std::uintptr_t address = 0;  // of a call in the library; 0: all libraries
  bool program = false;        // that, too
};
thread_local Shown shown_library;

bool is_in(const dl_phdr_info& library, std::uintptr_t address) noexcept {
  const std::span parts(library.dlpi_phdr, library.dlpi_phnum);
  return std::ranges::any_of(parts, [&](const auto& part) {
    return part.p_type == PT_LOAD && address - (library.dlpi_addr + part.p_vaddr) < part.p_memsz;
  });
}

void append(std::span<char>& room, std::string_view text) noexcept {
  const std::string_view fits = whole_characters(text, room.size() - 1);
  std::ranges::copy(fits, room.begin());
  room[fits.size()] = '\0';
  room = room.subspan(fits.size());
}

std::uintptr_t pc_of(const void* context) noexcept {
  const mcontext_t& m = static_cast<const ucontext_t*>(context)->uc_mcontext;
#if defined(__x86_64__)
  return static_cast<std::uintptr_t>(m.gregs[REG_RIP]);
#elif defined(__aarch64__)
  return m.pc;
#else
  (void)m;
  return 0;
#endif
}

/// Who called what is no code: the call has just left where it came from.
std::uintptr_t caller_of(const void* context) noexcept {
  const mcontext_t& m = static_cast<const ucontext_t*>(context)->uc_mcontext;
#if defined(__x86_64__)
  return *reinterpret_cast<const std::uintptr_t*>(m.gregs[REG_RSP]);
#elif defined(__aarch64__)
  return m.regs[30];
#else
  (void)m;
  return 0;
#endif
}

/// What a child reads of the interrupted code's stack, which may lead anywhere: it may crash. In
/// memory that the child shares.
struct Interrupted {
  CallStack all;  // from the handler on
  std::uintptr_t caller = 0;
};
Interrupted* interrupted = nullptr;  // null: there is no memory for it

/// The calls of the code at `pc`, without those of its handler.
CallStack from(std::uintptr_t pc, const CallStack& all) noexcept {
  CallStack stack{.calls = {pc}, .count = 1};
  const auto calls = all.view();
  const auto first = std::ranges::find_if(
      calls, [&](std::uintptr_t call) { return call == pc || call + 1 == pc; });
  if (first == calls.end()) return stack;
  stack.count = static_cast<std::size_t>(calls.end() - first);
  std::ranges::copy(first, calls.end(), stack.calls.begin());
  return stack;
}

void read_stack(void* context) {
  if (library_of(pc_of(context)) == nullptr) interrupted->caller = caller_of(context);
  ::backtrace_simple(unwinder, 0, &add, &ignore, &interrupted->all);
}

}  // namespace
}  // namespace tandem

extern "C" int tandem_iterate_libraries(int (*visit)(dl_phdr_info*, std::size_t, void*),
                                        void* data) {
  struct Job {
    int (*visit)(dl_phdr_info*, std::size_t, void*);
    void* data;
  } job{visit, data};
  return ::dl_iterate_phdr(
      [](dl_phdr_info* library, std::size_t size, void* self) {
        const auto& of = *static_cast<const Job*>(self);
        const tandem::Shown& shown = tandem::shown_library;
        const bool is_program = library->dlpi_name == nullptr || *library->dlpi_name == '\0';
        const bool is_shown = shown.address == 0 || (is_program && shown.program) ||
                              tandem::is_in(*library, shown.address);
        return is_shown ? of.visit(library, size, of.data) : 0;
      },
      &job);
}

namespace tandem {

void prepare_call_stacks() {
  if (unwinder == nullptr) unwinder = ::backtrace_create_state(nullptr, 1, &ignore, nullptr);
  if (interrupted == nullptr) {
    void* const memory = ::mmap(nullptr, sizeof(Interrupted), PROT_READ | PROT_WRITE,
                                MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory != MAP_FAILED) interrupted = new (memory) Interrupted;
  }
  (void)take_call_stack();  // loads the unwinder's library
}

CallStack take_call_stack(std::size_t skip) noexcept {
  CallStack stack;
  ::backtrace_simple(unwinder, static_cast<int>(skip + 1), &add, &ignore, &stack);
  return stack;
}

CallStack interrupted_call_stack(const void* context) noexcept {
  return from(pc_of(context), take_call_stack());
}

CallStack crashed_call_stack(const void* context) noexcept {
  const std::uintptr_t pc = pc_of(context);
  if (interrupted == nullptr) return {.calls = {pc}, .count = 1};
  *interrupted = {};
  (void)run_in_child(&read_stack, const_cast<void*>(context));
  const std::uintptr_t caller = interrupted->caller;
  if (library_of(caller) != nullptr) return {.calls = {caller - 1}, .count = 1};
  return from(pc, interrupted->all);
}

// The linker's lock may be held for ever, where a library does not return from its initialisers.
const void* library_of(std::uintptr_t call) noexcept {
  dl_find_object where{};
  return ::_dl_find_object(reinterpret_cast<void*>(call), &where) == 0 ? where.dlfo_map_start
                                                                       : nullptr;
}

CallPlaceView symbol_of(std::uintptr_t call) noexcept {
  Dl_info where{};
  const bool placed = ::dladdr(reinterpret_cast<void*>(call), &where) != 0;
  return {.call = call, .function = placed ? where.dli_sname : nullptr};
}

void PlaceReader::read(std::uintptr_t call, Visit visit, void* to) noexcept {
  const void* const base = library_of(call);
  const std::span<Library> known(libraries_.data(), count_);
  auto at = std::ranges::find(known, base, &Library::base);
  if (at == known.end()) {
    if (count_ < libraries_.size()) ++count_;
    libraries_[count_ - 1] = {base, ::backtrace_create_state(nullptr, 1, &ignore, nullptr)};
    at = known.begin() + static_cast<std::ptrdiff_t>(count_ - 1);
  }
  struct Job {
    std::uintptr_t call;
    Visit visit;
    void* to;
    backtrace_state* state;
    bool any = false;
  } job{call, visit, to, at->state};
  shown_library = {call, !leaves_files_open_};
  ::backtrace_pcinfo(
      at->state, call,
      [](void* self, std::uintptr_t, const char* file, int line, const char* name) {
        auto& of = *static_cast<Job*>(self);
        if (file == nullptr && name == nullptr) return 0;
        of.any = true;
        if (name == nullptr) name = symbol_of(of.state, of.call);  // clang's -g1 has lines alone
        of.visit(of.to, {of.call, name, file, line});
        return 0;
      },
      &ignore, &job);
  if (!job.any) {
    const char* const name = symbol_of(at->state, call);
    job.any = name != nullptr;
    if (job.any) visit(to, {.call = call, .function = name});
  }
  shown_library = {};
  if (!job.any) visit(to, symbol_of(call));
}

void write_clear_name(const char* name, std::span<char> to) {
  char* clear = abi::__cxa_demangle(name, nullptr, nullptr, nullptr);
  to.front() = '\0';
  if (clear == nullptr) return;
  shorten(clear);
  append(to, clear);
  std::free(clear);
}

void write_offset(std::uintptr_t call, std::span<char> to) noexcept {
  dl_find_object where{};
  to.front() = '\0';
  if (::_dl_find_object(reinterpret_cast<void*>(call), &where) != 0) return;
  const char* const path = where.dlfo_link_map->l_name;
  char offset[24];
  std::snprintf(
      offset, sizeof offset, "+0x%zx",
      static_cast<std::size_t>(call - reinterpret_cast<std::uintptr_t>(where.dlfo_map_start)));
  append(to, *path == '\0' ? program_invocation_short_name : base_name(path));
  append(to, offset);
}

void write_place(const CallPlaceView& place, std::span<char> to) noexcept {
  char offset[512], line[16];
  write_offset(place.call, offset);
  std::snprintf(line, sizeof line, ":%d", place.line);
  append(to, whole_characters(place.function == nullptr ? "?" : place.function, 2000));
  if (place.file != nullptr) {
    append(to, " at ");
    append(to, whole_characters(place.file, 1000));
    append(to, line);
  }
  if (*offset == '\0') return;
  append(to, " (");
  append(to, offset);
  append(to, ")");
}

std::vector<std::string> describe(const CallStack& stack, std::size_t most) {
  std::vector<std::string> lines;
  PlaceReader reader(false);
  for (const std::uintptr_t call : stack.view()) {
    reader.read(
        call,
        [](void* to, const CallPlaceView& at) {
          CallPlaceView place = at;
          char clear[kLongestClearName + 1] = "", line[4096];
          if (place.function != nullptr) write_clear_name(place.function, clear);
          if (*clear != '\0') place.function = clear;
          write_place(place, line);
          static_cast<std::vector<std::string>*>(to)->emplace_back(line);
        },
        &lines);
    if (lines.size() >= most) break;
  }
  lines.resize(std::min(lines.size(), most));
  return lines;
}

}  // namespace tandem
