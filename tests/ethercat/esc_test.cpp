// The emulated controller: addressing, working counters, sync managers, FMMUs, information memory.
#include <gtest/gtest.h>

#include "tests/ethercat/line_rig.hpp"

namespace tandem::test {
namespace {

using ethercat::Command;
using ethercat::register_address;
namespace reg = ethercat::reg;

TEST(EscAddressing, ABroadcastReadCountsTheSlavesAndOrsTheirData) {
  LineRig rig(3);
  const auto answer = rig.pass(Command::kBrd, register_address(0, reg::kType), {0x40});
  EXPECT_EQ(answer.counter, 3);
  EXPECT_EQ(answer.slave, 3) << "every slave counts the position up";
  EXPECT_EQ(answer.data, Bytes{0x51});
}

TEST(EscAddressing, PositionReachesExactlyOneSlave) {
  LineRig rig(3);
  EXPECT_EQ(rig.write(1, reg::kStation, {0x02, 0x10}), 1);
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kStation), 0);
  EXPECT_EQ(rig.value<std::uint16_t>(1, reg::kStation), 0x1002);
  EXPECT_EQ(rig.read(3, reg::kStation, 2).counter, 0) << "there is no fourth";
}

TEST(EscAddressing, StationAddressAndAliasReachTheirSlave) {
  LineRig rig(3);
  for (std::uint16_t i = 0; i < 3; ++i) {
    rig.write(i, reg::kStation,
              LineRig::bytes<std::uint16_t>(static_cast<std::uint16_t>(0x1001 + i)));
  }
  EXPECT_EQ(rig.pass(Command::kFpwr, register_address(0x1003, reg::kRam), {7}).counter, 1);
  EXPECT_EQ(rig.read(2, reg::kRam, 1).data, Bytes{7});
  EXPECT_EQ(rig.pass(Command::kFprd, register_address(0x1009, reg::kRam), {0}).counter, 0);
}

TEST(EscAddressing, ReadWriteCountsThreeAndReturnsTheOldValue) {
  LineRig rig(2);
  rig.write(0, reg::kRam, {1});
  const auto answer = rig.pass(Command::kAprw, register_address(0, reg::kRam), {2});
  EXPECT_EQ(answer.counter, 3);
  EXPECT_EQ(answer.data, Bytes{1});
  EXPECT_EQ(rig.read(0, reg::kRam, 1).data, Bytes{2});
  EXPECT_EQ(rig.pass(Command::kBrw, register_address(0, reg::kRam), {4}).counter, 6);
}

TEST(EscAddressing, ReadMultipleWriteCarriesOneSlavesValueToThoseBehind) {
  LineRig rig(3);
  rig.write(1, reg::kRam, {9});
  EXPECT_EQ(rig.pass(Command::kArmw, register_address(0xFFFF, reg::kRam), {5}).counter, 3);
  EXPECT_EQ(rig.read(0, reg::kRam, 1).data, Bytes{5}) << "it was written on the way there";
  EXPECT_EQ(rig.read(1, reg::kRam, 1).data, Bytes{9});
  EXPECT_EQ(rig.read(2, reg::kRam, 1).data, Bytes{9});
}

TEST(EscAddressing, NothingAndUnknownMemoryDoNotCount) {
  LineRig rig(1);
  EXPECT_EQ(rig.pass(Command::kNop, 0, {1}).counter, 0);
  EXPECT_EQ(rig.read(0, 0x2FFF, 2).counter, 0);
  EXPECT_EQ(rig.write(0, reg::kAlStatus, {8, 0}), 0) << "the state cannot be written";
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kAlStatus), 1);
}

TEST(EscLine, MarksTheSourceAndLeavesOtherFramesAlone) {
  LineRig rig(1);
  Bytes frame(60, 0);
  const Bytes before = frame;
  EXPECT_TRUE(rig.line->pass(frame, 0));
  EXPECT_EQ(frame, before);
  EXPECT_EQ(rig.line->malformed(), 1u);
}

TEST(EscLine, ACutCableTurnsFramesBackAndShowsAtThePort) {
  LineRig rig(3);
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kDlStatus) & 0x0F30, 0x0A30);
  EXPECT_EQ(rig.value<std::uint16_t>(2, reg::kDlStatus) & 0x0F30, 0x0610) << "the last one";
  rig.line->set_cable(2, false);
  EXPECT_EQ(rig.pass(Command::kBrd, 0, {0}).counter, 2);
  EXPECT_EQ(rig.value<std::uint16_t>(1, reg::kDlStatus) & 0x0F30, 0x0610);
  EXPECT_EQ(rig.read(1, reg::kLostLinks + 1, 1).data, Bytes{1});
  rig.line->set_cable(2, true);
  EXPECT_EQ(rig.pass(Command::kBrd, 0, {0}).counter, 3);
  rig.line->set_cable(0, false);
  EXPECT_FALSE(rig.pass(Command::kBrd, 0, {0}).back);
}

TEST(EscLine, PowerOnBeginsFromTheStart) {
  LineRig rig(2);
  rig.write(1, reg::kStation, {0x02, 0x10});
  rig.line->set_power(1, false, rig.now_ns);
  EXPECT_EQ(rig.pass(Command::kBrd, 0, {0}).counter, 1);
  rig.line->set_power(1, true, rig.now_ns);
  EXPECT_EQ(rig.value<std::uint16_t>(1, reg::kStation), 0);
}

TEST(EscSyncManager, AMailboxTakesOneMessageAndRefusesTheNext) {
  LineRig rig(1);
  rig.set_mailboxes(0);
  EXPECT_EQ(rig.read(0, 0x1000, 128).counter, 0) << "only the slave reads it";
  EXPECT_EQ(rig.write(0, 0x1000, Bytes(64, 1)), 1) << "begun";
  EXPECT_EQ(rig.read(0, 0x0805, 1).data, Bytes{0});
  EXPECT_EQ(rig.write(0, 0x1040, Bytes(64, 2)), 1) << "and ended";
  EXPECT_EQ(rig.read(0, 0x0805, 1).data, Bytes{8});
  EXPECT_EQ(rig.send_mail(0, {3}), 0) << "full";
  rig.set_mailboxes(0);
  EXPECT_EQ(rig.write(0, 0x1040, Bytes(64, 2)), 0) << "it was not begun";
}

TEST(EscSyncManager, AnEmptyMailboxIsNotRead) {
  LineRig rig(1);
  rig.set_mailboxes(0);
  EXPECT_EQ(rig.read(0, 0x1080, 128).counter, 0);
  ASSERT_TRUE(rig.slaves[0]->slave->controller().post_mailbox(Bytes{5, 6}));
  EXPECT_FALSE(rig.slaves[0]->slave->controller().post_mailbox(Bytes{7})) << "not read yet";
  EXPECT_EQ(rig.read(0, 0x080D, 1).data, Bytes{8});
  const auto answer = rig.read(0, 0x1080, 128);
  EXPECT_EQ(answer.counter, 1);
  EXPECT_EQ(answer.data[1], 6);
  EXPECT_EQ(rig.read(0, 0x1080, 128).counter, 0) << "it is empty again";
}

TEST(EscSyncManager, ProcessDataHasOneDirection) {
  LineRig rig(1);
  rig.set_process_data(0);
  EXPECT_EQ(rig.write(0, 0x1800, Bytes(6, 1)), 1);
  EXPECT_EQ(rig.read(0, 0x1800, 6).counter, 0);
  EXPECT_EQ(rig.write(0, 0x2400, Bytes(7, 1)), 0);
  EXPECT_EQ(rig.read(0, 0x2400, 7).counter, 1);
}

TEST(EscFmmu, LogicalReadAndWriteReachTheMemoryOfEachSlave) {
  LineRig rig(2);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto at = static_cast<std::uint32_t>(0x10000 + 4 * i);
    rig.set_fmmu(i, 0,
                 {.logical = at, .length = 2, .physical = 0x1800, .writes = true, .active = true});
    rig.set_fmmu(
        i, 1, {.logical = at + 2, .length = 2, .physical = 0x2400, .reads = true, .active = true});
    rig.write(i, 0x2400, {static_cast<std::uint8_t>(0xA0 + i), 0xB0});
  }
  const auto answer = rig.pass(Command::kLrw, 0x10000, {1, 2, 0, 0, 3, 4, 0, 0});
  EXPECT_EQ(answer.counter, 6);
  EXPECT_EQ(answer.data, (Bytes{1, 2, 0xA0, 0xB0, 3, 4, 0xA1, 0xB0}));
  EXPECT_EQ(rig.read(1, 0x1800, 2).data, (Bytes{3, 4}));
  EXPECT_EQ(rig.pass(Command::kLrd, 0x10000, Bytes(4, 0)).counter, 1) << "the first one's only";
  EXPECT_EQ(rig.pass(Command::kLwr, 0x10000, Bytes(8, 0)).counter, 2);
  EXPECT_EQ(rig.pass(Command::kLrd, 0x20000, Bytes(4, 0)).counter, 0);
}

TEST(EscFmmu, BitsAreMappedWithoutTouchingTheirNeighbours) {
  LineRig rig(1);
  // Logical bits 3 to 9 from 0x100 on, to physical bits from 2 of 0x1800 on.
  const ethercat::Fmmu fmmu{.logical = 0x100,
                            .length = 2,
                            .first_bit = 3,
                            .last_bit = 1,
                            .physical = 0x1800,
                            .physical_bit = 2,
                            .reads = true,
                            .writes = true,
                            .active = true};
  rig.set_fmmu(0, 0, fmmu);
  rig.write(0, 0x1800, {0xFF, 0xFF});
  EXPECT_EQ(rig.pass(Command::kLwr, 0x100, {0x00, 0x00}).counter, 1);
  EXPECT_EQ(rig.read(0, 0x1800, 2).data, (Bytes{0x03, 0xFE}));
  rig.write(0, 0x1800, {0x00, 0x00});
  rig.pass(Command::kLwr, 0x100, {0xFF, 0xFF});
  EXPECT_EQ(rig.read(0, 0x1800, 2).data, (Bytes{0xFC, 0x01}));
  const auto answer = rig.pass(Command::kLrd, 0x100, {0x00, 0x00});
  EXPECT_EQ(answer.data, (Bytes{0xF8, 0x03}));
}

TEST(EscSii, IsReadEightBytesAtATimeAfterItWasBusy) {
  LineRig rig(1);
  rig.write(0, reg::kSiiControl, {0x00, 0x01, 8, 0, 0, 0});
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kSiiControl) & ethercat::kSiiBusy, ethercat::kSiiBusy);
  rig.step();
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kSiiControl), ethercat::kSiiReads8Bytes);
  EXPECT_EQ(rig.read(0, reg::kSiiData, 8).data, (Bytes{0x57, 0x7E, 0x57, 0x7E, 0x11, 0, 0, 0}));
  rig.write(0, reg::kSiiControl, {0x01, 0x02, 8, 0, 0, 0});
  rig.step();
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kSiiControl) & ethercat::kSiiRefused,
            ethercat::kSiiRefused);
  rig.write(0, reg::kSiiControl, {0x00, 0x01, 0xFF, 0xFF, 0xFF, 0xFF});
  rig.step();
  EXPECT_EQ(rig.read(0, reg::kSiiData, 2).data, (Bytes{0xFF, 0xFF})) << "behind its end";
}

}  // namespace
}  // namespace tandem::test
