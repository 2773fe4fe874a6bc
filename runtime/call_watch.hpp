// Who is told of the cycle's calls into controllers.
// Layer: runtime.  Thread: the loop's.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tandem::runtime {

/// What is called of a controller.
enum class ControllerFunction : std::uint8_t { kStart, kUpdate, kRetreat, kStop, kArchive };
[[nodiscard]] constexpr const char* to_string(ControllerFunction function) noexcept {
  constexpr const char* kNames[] = {"start()", "update()", "retreat()", "stop()", "archive()"};
  return kNames[static_cast<std::size_t>(function)];
}

/// Looks at what a controller does in its calls.
class CallWatch {
 public:
  virtual ~CallWatch() = default;
  /// Right before a call.
  /// @param controller  for ControllerNames::name()
  virtual void enter(std::uint32_t controller, ControllerFunction function) noexcept = 0;
  /// Right after it.
  virtual void leave() noexcept = 0;
};

}  // namespace tandem::runtime
