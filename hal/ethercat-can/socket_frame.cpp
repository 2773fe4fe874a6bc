// Lengths that CAN cannot have and 29-bit frames are refused here, in both directions.
#include "hal/ethercat-can/socket_frame.hpp"

#include <linux/can/error.h>

#include <algorithm>

namespace tandem::hal::can {

using canopen::Frame;

namespace {

/// Whether a data frame of this format can have this many bytes.
bool length_exists(std::size_t length, bool fd) noexcept {
  if (!fd) return length <= canopen::kClassicFrameBytes;
  return length <= canopen::kMaxFrameBytes && canopen::frame_length(length) == length;
}

}  // namespace

std::size_t to_kernel(const Frame& frame, bool fd, canfd_frame& out) noexcept TANDEM_RT {
  const bool switches = (frame.flags & canopen::kFlagBrs) != 0;
  const bool remote = (frame.flags & canopen::kFlagRtr) != 0;
  if ((frame.flags & canopen::kFlagError) != 0 || (remote && frame.fd())) return 0;
  if (frame.id > CAN_SFF_MASK || !length_exists(frame.length, frame.fd())) return 0;
  if (frame.fd() ? !fd : switches) return 0;
  out = {};
  out.can_id = frame.id;
  out.len = frame.length;
  if (remote) {
    out.can_id |= CAN_RTR_FLAG;
    return CAN_MTU;
  }
  if (switches) out.flags = CANFD_BRS;
  std::copy_n(frame.data.begin(), frame.length, out.data);
  return frame.fd() ? CANFD_MTU : CAN_MTU;
}

KernelFrame from_kernel(const canfd_frame& in, std::size_t bytes, Frame& out) noexcept TANDEM_RT {
  const bool fd = bytes == CANFD_MTU;
  if (!fd && bytes != CAN_MTU) return KernelFrame::kIgnored;
  if ((in.can_id & CAN_ERR_FLAG) != 0) return KernelFrame::kError;
  const bool remote = (in.can_id & CAN_RTR_FLAG) != 0;
  if ((in.can_id & CAN_EFF_FLAG) != 0 || (remote && fd)) return KernelFrame::kIgnored;
  if (!length_exists(in.len, fd)) return KernelFrame::kIgnored;
  out = {};
  out.id = in.can_id & CAN_SFF_MASK;
  out.length = in.len;
  if (remote) {
    out.flags = canopen::kFlagRtr;
    return KernelFrame::kRemote;
  }
  if (fd) out.flags = canopen::kFlagFd;
  if (fd && (in.flags & CANFD_BRS) != 0) out.flags |= canopen::kFlagBrs;
  std::copy_n(in.data, in.len, out.data.begin());
  return KernelFrame::kData;
}

ErrorReport read_error_frame(const canfd_frame& in) noexcept TANDEM_RT {
  constexpr int kPassive = CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE;
  constexpr int kNotPassive =
      CAN_ERR_CRTL_ACTIVE | CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING;
  ErrorReport report;
  if ((in.can_id & CAN_ERR_RESTARTED) != 0) report.state = BusState::kActive;
  if ((in.can_id & CAN_ERR_CRTL) != 0) {
    const int controller = in.data[1];
    if ((controller & kPassive) != 0) {
      report.state = BusState::kErrorPassive;
    } else if ((controller & kNotPassive) != 0) {
      report.state = BusState::kActive;
    }
    report.receive_lost = (controller & CAN_ERR_CRTL_RX_OVERFLOW) != 0;
  }
  if ((in.can_id & CAN_ERR_BUSOFF) != 0) report.state = BusState::kBusOff;
  return report;
}

}  // namespace tandem::hal::can
