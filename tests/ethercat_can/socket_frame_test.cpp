#include "hal/ethercat-can/socket_frame.hpp"

#include <gtest/gtest.h>
#include <linux/can/error.h>

#include <array>
#include <cstring>

namespace tandem::hal::can {
namespace {

using canopen::Frame;
using canopen::make_frame;

/// What is on the wire after the conversion: bytes 0-3 identifier, 4 length, 5 flags, 8.. data.
std::array<std::uint8_t, CANFD_MTU> bytes_of(const canfd_frame& frame) {
  std::array<std::uint8_t, CANFD_MTU> bytes;
  std::memcpy(bytes.data(), &frame, CANFD_MTU);
  return bytes;
}

canfd_frame received(std::uint32_t id, std::uint8_t length) {
  canfd_frame frame{};
  frame.can_id = id;
  frame.len = length;
  for (std::uint8_t i = 0; i < CANFD_MAX_DLEN; ++i)
    frame.data[i] = static_cast<std::uint8_t>(i + 1);
  return frame;
}

TEST(SocketFrame, WritesAClassicFrameAsTheKernelsSixteenBytes) {
  canfd_frame out = received(0x555, 64);  // rubbish from before
  const std::array<std::uint8_t, 3> data{0xAA, 0xBB, 0xCC};
  ASSERT_EQ(to_kernel(make_frame(0x605, data), false, out), 16U);
  const std::array<std::uint8_t, CANFD_MTU> expected{0x05, 0x06, 0,    0,    3,   0,
                                                     0,    0,    0xAA, 0xBB, 0xCC};
  EXPECT_EQ(bytes_of(out), expected) << "and nothing behind the data";
}

TEST(SocketFrame, WritesAnFdFrameWithItsRateSwitch) {
  canfd_frame out;
  const std::array<std::uint8_t, 10> data{1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  ASSERT_EQ(to_kernel(make_frame(0x20A, data), true, out), 72U);
  const std::array<std::uint8_t, CANFD_MTU> expected{0x0A, 0x02, 0, 0, 12, CANFD_BRS, 0, 0, 1,
                                                     2,    3,    4, 5, 6,  7,         8, 9, 10};
  EXPECT_EQ(bytes_of(out), expected);
}

TEST(SocketFrame, WritesARemoteRequestWithoutData) {
  canfd_frame out;
  Frame guard{.id = 0x705, .length = 1, .flags = canopen::kFlagRtr};
  guard.data[0] = 0xFF;
  EXPECT_EQ(to_kernel(guard, true, out), CAN_MTU);
  EXPECT_EQ(out.can_id, 0x705 | CAN_RTR_FLAG);
  EXPECT_EQ(out.len, 1);
  EXPECT_EQ(out.data[0], 0) << "a heartbeat of that node it is not";
}

TEST(SocketFrame, RefusesWhatCannotBeSent) {
  canfd_frame out;
  EXPECT_EQ(to_kernel(Frame{.id = 0x800}, true, out), 0U) << "29-bit identifier";
  EXPECT_EQ(to_kernel(Frame{.id = 1, .length = 9}, true, out), 0U) << "9 bytes, classic";
  EXPECT_EQ(to_kernel(Frame{.id = 1, .length = 9, .flags = canopen::kFlagFd}, true, out), 0U);
  EXPECT_EQ(to_kernel(Frame{.id = 1, .length = 65, .flags = canopen::kFlagFd}, true, out), 0U);
  EXPECT_EQ(to_kernel(Frame{.id = 1, .length = 8, .flags = canopen::kFlagFd}, false, out), 0U)
      << "FD on a classic bus";
  EXPECT_EQ(to_kernel(Frame{.id = 1, .flags = canopen::kFlagBrs}, true, out), 0U);
  EXPECT_EQ(to_kernel(Frame{.id = 1, .flags = canopen::kFlagRtr | canopen::kFlagFd}, true, out), 0U)
      << "CAN FD has no remote requests";
  EXPECT_EQ(to_kernel(Frame{.id = 1, .flags = canopen::kFlagError}, true, out), 0U);
}

TEST(SocketFrame, ReadsWithoutWhatStandsBehindTheData) {
  Frame out = make_frame(0x7FF, std::array<std::uint8_t, 64>{9});
  ASSERT_EQ(from_kernel(received(0x18A, 2), CAN_MTU, out), KernelFrame::kData);
  EXPECT_EQ(out, make_frame(0x18A, std::array<std::uint8_t, 2>{1, 2}));
  canfd_frame fd = received(0x28A, 12);
  fd.flags = CANFD_ESI;
  ASSERT_EQ(from_kernel(fd, CANFD_MTU, out), KernelFrame::kData);
  EXPECT_EQ(out.flags, canopen::kFlagFd) << "no rate switch; the sender's error state is dropped";
  EXPECT_EQ(out.length, 12);
  EXPECT_EQ(out.data[11], 12);
  EXPECT_EQ(out.data[12], 0);
}

TEST(SocketFrame, IgnoresWhatNoNodeSends) {
  Frame out;
  EXPECT_EQ(from_kernel(received(0x18A | CAN_EFF_FLAG, 8), CAN_MTU, out), KernelFrame::kIgnored);
  EXPECT_EQ(from_kernel(received(0x18A | CAN_RTR_FLAG, 8), CANFD_MTU, out), KernelFrame::kIgnored)
      << "CAN FD has no remote requests";
  EXPECT_EQ(from_kernel(received(0x18A, 9), CAN_MTU, out), KernelFrame::kIgnored);
  EXPECT_EQ(from_kernel(received(0x18A, 63), CANFD_MTU, out), KernelFrame::kIgnored);
  EXPECT_EQ(from_kernel(received(0x18A, 255), CANFD_MTU, out), KernelFrame::kIgnored);
  EXPECT_EQ(from_kernel(received(0x18A, 8), 12, out), KernelFrame::kIgnored) << "cut short";
}

TEST(SocketFrame, ReadsARemoteRequestWithoutData) {
  Frame out = make_frame(0x7FF, std::array<std::uint8_t, 8>{9, 9, 9, 9, 9, 9, 9, 9});
  ASSERT_EQ(from_kernel(received(0x18A | CAN_RTR_FLAG, 8), CAN_MTU, out), KernelFrame::kRemote);
  EXPECT_EQ(out, (Frame{.id = 0x18A, .length = 8, .flags = canopen::kFlagRtr}));
}

TEST(SocketFrame, GoesThereAndBackForEveryLength) {
  for (std::size_t bytes = 0; bytes <= 64; ++bytes) {
    std::array<std::uint8_t, 64> data{};
    for (std::size_t i = 0; i < bytes; ++i) data[i] = static_cast<std::uint8_t>(200 - i);
    const Frame frame = make_frame(0x123, std::span(data).first(bytes));
    canfd_frame between;
    Frame back;
    const std::size_t size = to_kernel(frame, true, between);
    ASSERT_EQ(size, bytes <= 8 ? CAN_MTU : CANFD_MTU);
    ASSERT_EQ(from_kernel(between, size, back), KernelFrame::kData);
    EXPECT_EQ(back, frame);
  }
}

ErrorReport report(std::uint32_t classes, std::uint8_t controller) {
  canfd_frame frame{};
  frame.can_id = CAN_ERR_FLAG | classes;
  frame.len = CAN_ERR_DLC;
  frame.data[1] = controller;
  Frame out;
  EXPECT_EQ(from_kernel(frame, CAN_MTU, out), KernelFrame::kError);
  return read_error_frame(frame);
}

TEST(SocketFrame, ReadsTheControllersStateFromErrorFrames) {
  EXPECT_EQ(report(CAN_ERR_BUSOFF, 0).state, BusState::kBusOff);
  EXPECT_EQ(report(CAN_ERR_RESTARTED, 0).state, BusState::kActive);
  EXPECT_EQ(report(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE).state, BusState::kErrorPassive);
  EXPECT_EQ(report(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_PASSIVE).state, BusState::kErrorPassive);
  EXPECT_EQ(report(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_WARNING).state, BusState::kActive);
  EXPECT_EQ(report(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE).state, BusState::kActive);
  EXPECT_EQ(report(CAN_ERR_CRTL | CAN_ERR_BUSOFF, CAN_ERR_CRTL_TX_PASSIVE).state,
            BusState::kBusOff);
  EXPECT_FALSE(report(CAN_ERR_PROT | CAN_ERR_BUSERROR, 0xFF).state) << "no class CRTL";
  EXPECT_FALSE(report(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW).state);
  EXPECT_TRUE(report(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW).receive_lost);
}

}  // namespace
}  // namespace tandem::hal::can
