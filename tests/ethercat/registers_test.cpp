// Sync managers, FMMUs and mailbox headers against literal bytes; states and codes in words.
#include "ethercat/registers.hpp"

#include <gtest/gtest.h>

#include <array>

#include "ethercat/mailbox.hpp"

namespace tandem::ethercat {
namespace {

TEST(Registers, ASyncManagerHasItsEightBytes) {
  std::array<std::uint8_t, kSyncManagerBytes> bytes{};
  put_sync_manager(bytes.data(),
                   {.start = 0x1100, .length = 12, .control = kControlOutputs, .active = true});
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 8>{0x00, 0x11, 0x0C, 0x00, 0x64, 0x00, 0x01, 0x00}));
  bytes[5] = 0x08;
  const SyncManager read = get_sync_manager(bytes.data());
  EXPECT_EQ(read.start, 0x1100);
  EXPECT_EQ(read.length, 12);
  EXPECT_TRUE(read.written() && read.watched() && read.active && !read.mailbox());
  EXPECT_EQ(read.status & kMailboxFull, kMailboxFull);
  EXPECT_TRUE((SyncManager{.control = kControlMailboxOut}.mailbox()));
  EXPECT_FALSE((SyncManager{.control = kControlMailboxIn}.written()));
}

TEST(Registers, AnFmmuHasItsSixteenBytes) {
  std::array<std::uint8_t, kFmmuBytes> bytes{};
  put_fmmu(bytes.data(), {.logical = 0x00010002,
                          .length = 3,
                          .first_bit = 1,
                          .last_bit = 6,
                          .physical = 0x1400,
                          .physical_bit = 2,
                          .reads = true,
                          .active = true});
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 16>{2, 0, 1, 0, 3, 0, 1, 6, 0x00, 0x14, 2, 1, 1}));
  const Fmmu read = get_fmmu(bytes.data());
  EXPECT_EQ(read.logical, 0x00010002u);
  EXPECT_EQ(read.last_bit, 6);
  EXPECT_TRUE(read.reads && !read.writes && read.active);
}

TEST(Registers, PortsHaveTheirBitsInTheStatus) {
  EXPECT_EQ(link_bit(0), 0x0010);
  EXPECT_EQ(link_bit(1), 0x0020);
  EXPECT_EQ(closed_bit(0), 0x0100);
  EXPECT_EQ(open_bit(0), 0x0200);
  EXPECT_EQ(closed_bit(1), 0x0400);
  EXPECT_EQ(open_bit(1), 0x0800);
}

TEST(Registers, StatesAndCodesAreTold) {
  EXPECT_STREQ(to_string(AlState::kSafeOp), "SAFEOP");
  EXPECT_STREQ(to_string(static_cast<AlState>(5)), "no state");
  EXPECT_STREQ(to_string(AlCode::kInvalidChange), "invalid requested state change");
  EXPECT_STREQ(to_string(static_cast<AlCode>(0x1B)),
               "process data watchdog: no outputs came in time");
  EXPECT_STREQ(to_string(static_cast<AlCode>(0x9999)), "unknown code");
}

TEST(Mailbox, AnExpeditedDownloadHasTheseBytes) {
  std::array<std::uint8_t, 16> bytes{};
  write_coe(bytes, bytes.size(), CoeService::kSdoRequest, 3);
  write_sdo(bytes, sdo::kDownloadRequest | sdo::expedited(1), 0x1C12, 0);
  bytes[kSdoAt + 4] = 1;
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 16>{0x0A, 0, 0, 0, 0, 0x33, 0x00, 0x20, 0x2F, 0x12,
                                                 0x1C, 0, 1, 0, 0, 0}));
  MailboxHeader header;
  ASSERT_TRUE(read_mailbox(bytes, header));
  EXPECT_EQ(header.length, 10);
  EXPECT_EQ(header.type, MailboxType::kCoe);
  EXPECT_EQ(header.counter, 3);
  EXPECT_EQ(coe_service(bytes), CoeService::kSdoRequest);
  bytes[0] = 0x0B;
  EXPECT_FALSE(read_mailbox(bytes, header));
}

TEST(Mailbox, SegmentsSayHowMuchOfThemIsUsed) {
  EXPECT_EQ(sdo::segment(7, false, false), 0x00);
  EXPECT_EQ(sdo::segment(3, true, true), 0x19);
  EXPECT_EQ(sdo::segment(100, false, true), 0x01);
  EXPECT_EQ(sdo::segment_bytes(0x19, 7), 3u);
  EXPECT_EQ(sdo::segment_bytes(0x01, 100), 100u);
  EXPECT_EQ(sdo::segment_bytes(0x00, 2), 2u);
  EXPECT_EQ(sdo::expedited_bytes(0x2F), 1u);
  EXPECT_EQ(sdo::expedited_bytes(0x22), 4u);
  EXPECT_EQ(next_counter(7), 1);
  EXPECT_EQ(next_counter(0), 1);
}

}  // namespace
}  // namespace tandem::ethercat
