// Where a thread is: its calls with function, file and line, also from a signal handler.
// Layer: base.  Thread: any.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tandem {

/// Addresses of calls, innermost first.
struct CallStack {
  std::array<std::uintptr_t, 32> calls{};
  std::size_t count = 0;

  [[nodiscard]] std::span<const std::uintptr_t> view() const noexcept {
    return {calls.data(), count};
  }
};

/// Loads what the functions below need; once, before a handler or a trap may call them.
void prepare_call_stacks();

/// The calling thread's calls, without this one and the `skip` innermost others.
/// Safe in a signal handler, and inside malloc: no heap, no lock but the dynamic linker's.
[[gnu::noinline]] CallStack take_call_stack(std::size_t skip = 0) noexcept;
/// Those of the code that a signal interrupted; in its handler. After a call of nothing (address 0)
/// the caller is all that is known.
/// @param context  the handler's third argument
CallStack interrupted_call_stack(const void* context) noexcept;

/// Where the library (or the program) begins that a call is in; null: nowhere.
[[nodiscard]] const void* library_of(std::uintptr_t call) noexcept;

/// A line for each call, "update() at nod.cpp:31 (nod.so+0x12a0)"; inlined ones have their own.
/// Code without debug information (-g) shows the function and the library only, if that.
/// @param most  lines
[[nodiscard]] std::vector<std::string> describe(const CallStack& stack, std::size_t most = 16);

/// A call as its debug information has it; without that no file and no line.
struct CallPlace {
  std::uintptr_t call = 0;
  std::string function;  ///< "Nod::update(…)"; may be empty
  std::string file;
  int line = 0;  ///< 0: unknown
};

/// The place of each call, inlined ones too, innermost first.
[[nodiscard]] std::vector<CallPlace> places_of(const CallStack& stack);

/// work(with) in a child of this process, which writes what it finds out. Safe in a signal handler,
/// whatever `work` is: a child that crashes, or takes more than 2 s, is no more.
/// @return whether it came to its end
bool run_in_child(void (*work)(void* with), void* with) noexcept;

/// Writes the same as describe() to a descriptor, indented, below a line `title`. Safe in a signal
/// handler: names are read in a child of this process, and after 2 s without.
void write_call_stack(int fd, const char* title, const CallStack& stack) noexcept;

}  // namespace tandem
