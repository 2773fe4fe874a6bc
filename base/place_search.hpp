// Where a crash was: noted at once, and then looked for in the debug information, by a child of the
// process.
// Layer: base.  Thread: see each.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>

#include "base/call_stack.hpp"
#include "base/own_child.hpp"

namespace tandem {

/// Where in its author's code something crashed. Without debug information the file is empty, and
/// the line 0; the function may be empty, too.
struct CrashPlace {
  std::string function, file;
  int line = 0;
  std::string offset;  ///< "nod.so+0x12a0"; always there, unless the call is nowhere
  /// " in FUNCTION (nod.so+0x12a0)", or what of that is known.
  [[nodiscard]] std::string in_function() const;
};

/// The places of one stack: a crash has no second.
class PlaceSearch {
 public:
  /// Before the crash. Takes 100 kB that children share.
  PlaceSearch();
  PlaceSearch(const PlaceSearch&) = delete;
  PlaceSearch& operator=(const PlaceSearch&) = delete;

  /// The thread that crashed, in its signal handler: what needs no debug information.
  /// @param is_authors  whether a call is in the author's library; safe in a signal handler
  /// @return false: a stack was noted before
  bool note(const CallStack& stack, bool (*is_authors)(std::uintptr_t call)) noexcept;
  /// " at nod.so+0x12a0" of the author's innermost call, without any of the innermost of all; may
  /// be empty. After note().
  [[nodiscard]] const char* noted() const noexcept { return noted_.data(); }
  /// The same thread then: looks for files and lines in a child, the author's library first. What
  /// the child has found out is there, even when it does not come to its end.
  void look(const ChildTime& time) noexcept;
  /// A line for each call, at most 16, below a title. No heap.
  void write(int fd, const char* title) const noexcept;
  /// The same thread's last: others may end the process now.
  void end() noexcept { over_.store(true, std::memory_order_release); }

  // Any thread, after note(); a place that was not found yet has its offset alone.
  [[nodiscard]] bool is_noted() const noexcept { return is_noted_.load(std::memory_order_acquire); }
  [[nodiscard]] bool is_over() const noexcept { return over_.load(std::memory_order_acquire); }
  /// The innermost call of the author's library, and of its own files if one is: a template of
  /// /usr/include is not what its author wrote. Without any the innermost call of all.
  [[nodiscard]] CrashPlace place() const;

 private:
  /// A call, or one that was inlined into it.
  struct Line {
    std::uintptr_t call;
    std::array<char, 512> name, file;
    std::array<char, kLongestClearName + 1> clear_name;  // empty: not made yet, or it is none
    int number;
    std::atomic<std::int32_t> next;  // after it, of the same call; -1: none

    [[nodiscard]] CallPlaceView view() const noexcept;
  };
  struct Shared;
  static void look_in_child(void* self);
  void add(std::size_t call, const CallPlaceView& place) noexcept;
  template <class Use>
  void each_line(const Use& use) const;

  Shared* shared_ = nullptr;  // null: there is no memory for it
  CallStack stack_;
  std::array<bool, std::tuple_size_v<decltype(CallStack::calls)>> is_authors_{};
  std::size_t inner_ =
      0;  // calls up to the program's outermost: what is further out starts threads
  std::array<char, 256> noted_{};
  std::atomic<bool> begun_{false}, is_noted_{false}, over_{false};
};

}  // namespace tandem
