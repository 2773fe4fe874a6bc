// A CANopen frame that travels along a line in a datagram NOP, which slaves pass on untouched: what
// a master in lockstep and an emulated robot have to say of the robot's past.
// Layer: hal/ethercat-can/line.  Thread: RT.
#pragma once

#include <algorithm>
#include <optional>

#include "canopen/bytes.hpp"
#include "canopen/frame.hpp"
#include "hal/ethercat-can/line/link.hpp"

namespace tandem::hal::ecat {

/// Bytes of the datagram: COB-ID (4), length (1), data (8).
inline constexpr std::size_t kNopFrameBytes = 5 + canopen::kClassicFrameBytes;

/// @pre frame.length <= kClassicFrameBytes
inline void make_nop_frame(const canopen::Frame& frame, const ethercat::MacAddress& source,
                           FrameBuffer& out) noexcept TANDEM_RT {
  ethercat::FrameWriter writer;
  writer.begin(out.bytes, source);
  const auto data = writer.add(ethercat::Command::kNop, 0, 0, kNopFrameBytes);
  canopen::put(data.data(), frame.id);
  data[4] = frame.length;
  std::copy_n(frame.data.begin(), canopen::kClassicFrameBytes, data.begin() + 5);
  out.size = writer.finish();
}

/// Empty: it is another one.
[[nodiscard]] inline std::optional<canopen::Frame> parse_nop_frame(
    FrameBuffer& in) noexcept TANDEM_RT {
  ethercat::FrameReader reader(in.frame());
  ethercat::Datagram datagram;
  if (!reader.next(datagram) || datagram.command() != ethercat::Command::kNop) return std::nullopt;
  const auto data = datagram.data();
  if (data.size() != kNopFrameBytes || data[4] > canopen::kClassicFrameBytes) return std::nullopt;
  canopen::Frame frame;
  frame.id = canopen::get<std::uint32_t>(data.data());
  frame.length = data[4];
  std::copy_n(data.begin() + 5, canopen::kClassicFrameBytes, frame.data.begin());
  return frame;
}

}  // namespace tandem::hal::ecat
