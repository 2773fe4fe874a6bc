// The gate of `tandem run --gate` and `tandem controller check`: what a controller does in its
// calls that has no place in a cycle, each with its stack. Layer: apps/run.  Thread: opened and
// reported by main; watches the loop's.
#pragma once

#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/text/figures.hpp"
#include "base/call_stack.hpp"
#include "base/result.hpp"
#include "runtime/call_watch.hpp"
#include "runtime/controller_times.hpp"

namespace tandem::apps {

/// What a controller does not do in its calls of the cycle; a thread it never makes.
enum class GateRule : std::uint8_t { kAllocation, kLock, kSystemCall, kThread, kPageFault };
inline constexpr std::size_t kGateRules = 5;

/// One rule broken at one place.
struct GateBreach {
  std::string controller;
  std::string function;  ///< "update()"
  std::string call;      ///< "malloc"
  std::uint64_t count = 0;
  std::uint64_t first_call = 0;    ///< of the controller's function: 1 is its first
  std::vector<std::string> stack;  ///< innermost first; of page faults empty
};

/// A rule, and what became of it.
struct GateResult {
  std::string rule;          ///< "no allocation"
  std::optional<bool> kept;  ///< empty: it could not be watched here
  std::string note;          ///< why, or how it was
  std::vector<GateBreach> breaches;
};

/// Whether every rule that could be watched was kept.
[[nodiscard]] bool kept(const std::vector<GateResult>& results);
void figures(Figures& f, const GateResult& result);
/// A line for each rule; below them each breach with its stack.
void print_gate(const std::vector<GateResult>& results, std::FILE* out);

class Gate final : public runtime::CallWatch {
 public:
  /// The process starts once more with the traps loaded, if they are not; then returns never.
  /// Before anything is read or opened. Errors: there are no traps in this build, or they cannot be
  /// loaded.
  [[nodiscard]] static Status enter_process();
  /// After enter_process(); one at a time. Locks memory, as a run on a robot does, if it may.
  [[nodiscard]] static std::unique_ptr<Gate> open();
  ~Gate() override;
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;

  void enter(std::uint32_t controller, runtime::ControllerFunction function) noexcept override;
  void leave() noexcept override;

  /// What the calling thread does from now on is no controller's: it has crashed. Safe in a signal
  /// handler.
  static void stand_aside() noexcept;

  /// When the loop has stopped.
  [[nodiscard]] std::vector<GateResult> results(const runtime::ControllerNames& names) const;

 private:
  /// As it is noted, without heap.
  struct Note {
    GateRule rule{};
    std::int32_t controller = -1;  // -1: `named`, in configure()
    runtime::ControllerFunction function{};
    std::array<char, 64> named{};
    const char* call = "";
    long system_call = -1;
    std::uint64_t count = 0, first_call = 0;
    CallStack stack;
  };
  Gate() = default;
  static void on_call(const char* call);
  static void on_system_call(int signal, siginfo_t* about, void* context);
  void watch_system_calls() noexcept;
  void note(const Note& what) noexcept;
  [[nodiscard]] bool is_through_trap(const Note& note) const;
  [[nodiscard]] GateBreach breach_of(const Note& note, const runtime::ControllerNames& names) const;
  [[nodiscard]] std::optional<std::string> unwatched(GateRule rule) const;

  bool locked_ = false;
  int no_dispatch_ = -1;          // -1: not asked for yet; 0: system calls are watched; errno
  volatile char selector_ = 0;    // the kernel reads it at each system call of the loop's thread
  std::uint32_t controller_ = 0;  // of the call that goes on
  runtime::ControllerFunction function_{};
  std::uint64_t calls_ = 0;  // so far
  long faults_ = 0;          // of the thread, before the call
  std::atomic_flag noting_;
  std::array<Note, 64> notes_{};
  std::size_t noted_ = 0;
};

}  // namespace tandem::apps
