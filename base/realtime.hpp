// Marks and codes of the real-time path.
// Layer: base.  Thread: any.
#pragma once

#include <cstdint>

/// Declares that a function may run in the cycle: no heap, lock, throw or blocking call.
/// clang's RealtimeSanitizer and -Wfunction-effects check it; g++ does not know the attribute.
/// Written after the parameter list: `void update() noexcept TANDEM_RT;`
#if defined(__clang__) && __clang_major__ >= 20
#define TANDEM_RT [[clang::nonblocking]]
#else
#define TANDEM_RT
#endif

namespace tandem {

/// What a call on the real-time path answers. One byte, never thrown.
enum class Code : std::uint8_t {
  kOk = 0,
  kTimeout,     ///< a node or the bus missed the deadline
  kBusOff,      ///< the bus cannot be used
  kQueueFull,   ///< dropped, and counted
  kNotFinite,   ///< a NaN or infinity was met and not passed on
  kOutOfRange,  ///< a value beyond its limit was met
  kFault,       ///< a drive, the plant or a controller is in fault; the state says which
  kDiverged,    ///< an integration step left the finite or plausible range
  kStopped,     ///< the component asks for the end of the run
};

/// The code's name without the `k`, for messages ("Timeout").
[[nodiscard]] const char* to_string(Code code) noexcept;

}  // namespace tandem
