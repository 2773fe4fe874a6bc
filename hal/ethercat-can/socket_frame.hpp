// Our frame <-> the kernel's struct canfd_frame, and what the kernel's error frames say. Pure.
// Layer: hal/ethercat-can.  Thread: any.
#pragma once

#include <linux/can.h>

#include <cstddef>
#include <cstdint>
#include <optional>

#include "base/realtime.hpp"
#include "canopen/frame.hpp"
#include "hal/ethercat-can/bus.hpp"

namespace tandem::hal::can {

/// Writes `frame` as the kernel takes it; bytes beyond its length are zero.
/// @param fd  the bus carries FD frames
/// @return the bytes to hand over: CAN_MTU (classic) or CANFD_MTU; 0 when the frame cannot be sent:
///         an identifier above 7FF, a length that does not exist in its format, an FD frame on a
///         classic bus, bit-rate switch without FD, a remote request of CAN FD, an error frame.
[[nodiscard]] std::size_t to_kernel(const canopen::Frame& frame, bool fd,
                                    canfd_frame& out) noexcept TANDEM_RT;

enum class KernelFrame : std::uint8_t {
  kData,     ///< `out` is filled
  kError,    ///< read_error_frame() says more
  kRemote,   ///< a remote request: `out` is filled, without data
  kIgnored,  ///< 29-bit identifier, wrong size or length
};

/// Reads what the kernel gave.
/// @param bytes  that it wrote: a classic frame is shorter than an FD frame
/// @param out    written when the answer is kData or kRemote
[[nodiscard]] KernelFrame from_kernel(const canfd_frame& in, std::size_t bytes,
                                      canopen::Frame& out) noexcept TANDEM_RT;

/// What an error frame says beyond that there was an error.
struct ErrorReport {
  std::optional<BusState> state;  ///< kActive, kErrorPassive or kBusOff, when it has changed
  bool receive_lost = false;      ///< the controller's own buffer has overrun
};
/// @pre from_kernel() answered kError
[[nodiscard]] ErrorReport read_error_frame(const canfd_frame& in) noexcept TANDEM_RT;

}  // namespace tandem::hal::can
