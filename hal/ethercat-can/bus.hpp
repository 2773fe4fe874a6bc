// One CAN bus as a protocol master or a board sees it: frames out, frames in.
// Layer: hal/ethercat-can.  Thread: RT, one at each end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/realtime.hpp"
#include "canopen/frame.hpp"

namespace tandem::hal::can {

enum class BusState : std::uint8_t {
  kActive = 0,
  kErrorPassive,  ///< still works, errors are frequent
  kBusOff,        ///< nothing is sent or received
};

/// One end of a bus. Never blocks.
class Bus {
 public:
  virtual ~Bus() = default;

  /// Hands frames over for sending, in order.
  /// @return how many were taken; the rest is dropped, and counted by the bus.
  virtual std::size_t send(std::span<const canopen::Frame> frames) noexcept TANDEM_RT = 0;
  /// Takes what has arrived, oldest first.
  /// @return how many; less than frames.size() means that nothing more is there.
  virtual std::size_t receive(std::span<canopen::Frame> frames) noexcept TANDEM_RT = 0;
  [[nodiscard]] virtual BusState state() const noexcept TANDEM_RT = 0;
};

}  // namespace tandem::hal::can
