// Where a thread is: its calls, also from a signal handler; their functions, files and lines.
// Layer: base.  Thread: any.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

struct backtrace_state;

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
/// Those of the code that a signal interrupted; in its handler.
/// @param context  the handler's third argument
CallStack interrupted_call_stack(const void* context) noexcept;
/// Those of code that crashed. A child reads them, as a stack that was written over leads anywhere:
/// what it had come to is there. After a call of what is no code the caller is all that is known.
CallStack crashed_call_stack(const void* context) noexcept;

/// Where the library (or the program) begins that a call is in; null: nowhere. No lock.
[[nodiscard]] const void* library_of(std::uintptr_t call) noexcept;

/// A line for each call, "update() at nod.cpp:31 (nod.so+0x12a0)"; inlined ones have their own.
/// Code without debug information (-g) shows the function and the library only, if that.
/// @param most  lines
[[nodiscard]] std::vector<std::string> describe(const CallStack& stack, std::size_t most = 16);

/// A call, or one that was inlined into it, as the debug information has it. Texts live as long as
/// the PlaceReader.
struct CallPlaceView {
  std::uintptr_t call = 0;
  const char* function = nullptr;  ///< as the linker has it; null: unknown
  const char* file = nullptr;      ///< null: unknown
  int line = 0;
};

/// Reads debug information and symbols of the libraries that calls are in, of each once, and of no
/// others: those of the C library alone, where they are installed, cost 60 ms of a processor.
/// Takes no heap, but is no work for a signal handler: for a child of it.
class PlaceReader {
 public:
  /// @param leaves_files_open  one for each library: for a child that ends soon. Else the program
  ///                           is read together with each library, as that closes its file
  explicit PlaceReader(bool leaves_files_open) : leaves_files_open_(leaves_files_open) {}
  using Visit = void (*)(void* to, const CallPlaceView& place);
  /// Inlined ones innermost first. At least one, if with the address alone.
  void read(std::uintptr_t call, Visit visit, void* to) noexcept;

 private:
  struct Library {
    const void* base;
    backtrace_state* state;
  };
  bool leaves_files_open_;
  std::array<Library, 32> libraries_{};
  std::size_t count_ = 0;
};
/// The same by the dynamic symbols alone, which cost nothing; takes the dynamic linker's lock.
[[nodiscard]] CallPlaceView symbol_of(std::uintptr_t call) noexcept;

/// "Nod::update(…)" of the linker's name, cut where it is long; on the heap. Empty: it is none.
/// @param to  a byte more than kLongestClearName at least
inline constexpr std::size_t kLongestClearName = 255;
void write_clear_name(const char* name, std::span<char> to);

/// "FUNCTION at FILE:LINE (LIBRARY+0x12a0)", what is unknown left out; without the heap.
/// @param place  its function as it is to be shown
void write_place(const CallPlaceView& place, std::span<char> to) noexcept;
/// "LIBRARY+0x12a0"; empty: it is nowhere. No heap, no lock.
void write_offset(std::uintptr_t call, std::span<char> to) noexcept;

}  // namespace tandem
