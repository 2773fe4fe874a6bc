// A controller's crash in a process that is another program's, such as Python: it is said whose it
// is, the log is closed, and the process ends by that signal.
// Layer: runtime/run.  Thread: that of whoever is in the run; its handler any.
#pragma once

#include <semaphore.h>
#include <signal.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <functional>
#include <string>
#include <thread>

#include "base/call_stack.hpp"
#include "runtime/call_watch.hpp"
#include "runtime/run/run.hpp"

namespace tandem::runtime {

/// What is known of a run when it crashes.
class CrashScene final : public CallWatch {
 public:
  /// @param last  called before the process ends, with "controller lazy crashed in update():
  ///              segmentation fault (SIGSEGV) at lazy.so+0x12a0", on a thread of its own, which
  ///              waits from now on; empty: there is nothing to do
  explicit CrashScene(std::function<void(const char* what)> last = {});
  ~CrashScene() override;
  CrashScene(const CrashScene&) = delete;
  CrashScene& operator=(const CrashScene&) = delete;

  /// Watches this run from now on, which outlives the last guard.
  void look_at(Run& run);

  // CallWatch, in the cycle.
  void enter(std::uint32_t controller, ControllerFunction function) noexcept override;
  void leave() noexcept override;

  // For the handlers.

  /// Whether a controller is called now, or the cycle is in its own code.
  [[nodiscard]] bool in_cycle() const noexcept;
  /// Says what happened, with the calls, and lets `last` do its work.
  /// @param how  "crashed"
  /// @param why  "segmentation fault (SIGSEGV)"; empty: `how` says it all
  void tell(const char* how, const char* why, const CallStack& stack) noexcept;

 private:
  static constexpr std::int64_t kNobody = -1;

  Run* run_ = nullptr;
  std::int64_t controller_ = kNobody;  // that is called
  ControllerFunction function_ = ControllerFunction::kUpdate;
  std::array<char, 512> what_{};
  std::function<void(const char*)> last_;
  sem_t wake_{};
  std::atomic<bool> ends_{false}, done_{false};
  std::thread thread_;  // last: it uses the others
};

/// While one lives, its scene reports SIGSEGV and the like that come on its thread in a cycle of
/// the run. Then the former handler gets the signal, and the process ends by it. The same holds on
/// threads that open and configure controllers, whose names are in the report. All other signals go
/// to the former handler alone. The last guard of the process installs that handler again.
class CrashGuard {
 public:
  /// @param scene  outlives it
  /// @param hosts  controllers may be loaded meanwhile
  explicit CrashGuard(CrashScene& scene, bool hosts = false);
  ~CrashGuard();
  CrashGuard(const CrashGuard&) = delete;
  CrashGuard& operator=(const CrashGuard&) = delete;

 private:
  std::size_t place_;
  bool hosts_;
  stack_t stack_before_{};
  bool has_stack_;
};

}  // namespace tandem::runtime
