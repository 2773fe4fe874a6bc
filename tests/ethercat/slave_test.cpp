// The emulated slave's application: states and their codes, SDOs, process data, archive.
#include "firmware_emu/slaves/slave.hpp"

#include <gtest/gtest.h>

#include "tests/ethercat/line_rig.hpp"

namespace tandem::test {
namespace {

using ethercat::CoeService;
using ethercat::kSdoAt;
namespace reg = ethercat::reg;

using StatusAndCode = std::pair<int, int>;

/// An SDO message with `data` behind its command, index and sub-index.
Bytes sdo(std::uint8_t counter, std::uint8_t command, std::uint16_t index, std::uint8_t sub,
          const Bytes& data = {}) {
  Bytes message(std::max<std::size_t>(ethercat::kSdoDataAt, kSdoAt + 4 + data.size()), 0);
  ethercat::write_coe(message, message.size(), CoeService::kSdoRequest, counter);
  ethercat::write_sdo(message, command, index, sub);
  std::ranges::copy(data, message.begin() + kSdoAt + 4);
  return message;
}

void to_preop(LineRig& rig) {
  rig.set_mailboxes(0);
  ASSERT_EQ(rig.request(0, 2), StatusAndCode(2, 0));
}

void to_op(LineRig& rig) {
  to_preop(rig);
  rig.set_process_data(0);
  ASSERT_EQ(rig.request(0, 4), StatusAndCode(4, 0));
  rig.write(0, 0x1800, Bytes(6, 0));
  rig.step();
  ASSERT_EQ(rig.request(0, 8), StatusAndCode(8, 0));
}

TEST(SlaveState, GoesUpOneStateAtATimeAndDownAtOnce) {
  LineRig rig(1);
  EXPECT_EQ(rig.request(0, 8), StatusAndCode(0x11, 0x11)) << "INIT to OP";
  EXPECT_EQ(rig.request(0, 2), StatusAndCode(0x11, 0x11)) << "the error is not acknowledged";
  EXPECT_EQ(rig.request(0, 0x11), StatusAndCode(1, 0));
  EXPECT_EQ(rig.request(0, 5), StatusAndCode(0x11, 0x12));
  EXPECT_EQ(rig.request(0, 0x13), StatusAndCode(0x11, 0x13)) << "BOOT";
  EXPECT_EQ(rig.request(0, 0x11), StatusAndCode(1, 0));
  to_op(rig);
  EXPECT_EQ(rig.request(0, 1), StatusAndCode(1, 0));
}

TEST(SlaveState, EachStateChecksItsSyncManagers) {
  LineRig rig(1);
  EXPECT_EQ(rig.request(0, 2), StatusAndCode(0x11, 0x16)) << "no mailbox";
  rig.set_mailboxes(0);
  EXPECT_EQ(rig.request(0, 0x12), StatusAndCode(2, 0));
  EXPECT_EQ(rig.request(0, 4), StatusAndCode(0x12, 0x1D)) << "no outputs";
  rig.set_process_data(0);
  rig.set_manager(0, 3, {0x2400, 8, ethercat::kControlInputs, 0, true});
  EXPECT_EQ(rig.request(0, 0x14), StatusAndCode(0x12, 0x1E)) << "inputs of another length";
  rig.set_process_data(0);
  EXPECT_EQ(rig.request(0, 0x14), StatusAndCode(4, 0));
  EXPECT_EQ(rig.request(0, 8), StatusAndCode(4, 0)) << "no outputs have come yet";
  rig.step(firmware::esc::kOpWaitNs);
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kAlStatus), 0x14) << "nor later";
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kAlCode), 0x19);
  rig.write(0, 0x1800, Bytes(6, 0));
  rig.step();
  EXPECT_EQ(rig.request(0, 0x18), StatusAndCode(8, 0));
}

/// A master that sends its first outputs and the request for OP in one go, as KickCAT does.
TEST(SlaveState, OpIsJudgedAfterTheOutputsThatCameWithIt) {
  LineRig rig(1);
  to_preop(rig);
  rig.set_process_data(0);
  ASSERT_EQ(rig.request(0, 4), StatusAndCode(4, 0));
  rig.write(0, 0x1800, Bytes(6, 0));
  EXPECT_EQ(rig.request(0, 8), StatusAndCode(8, 0));
}

/// And one that asks first, and again while it waits, as SOEM does.
TEST(SlaveState, OpWaitsForOutputsAndForSync0) {
  LineRig rig(1);
  to_preop(rig);
  rig.set_process_data(0);
  ASSERT_EQ(rig.request(0, 4), StatusAndCode(4, 0));
  const auto start = rig.value<std::uint64_t>(0, reg::kSystemTime) + 100 * kMs;
  rig.write(0, reg::kSyncStart, LineRig::bytes(start));
  rig.write(0, reg::kSync0Cycle, LineRig::bytes(std::uint32_t{1'000'000}));
  rig.write(0, reg::kSyncActivation, Bytes{3});
  EXPECT_EQ(rig.request(0, 8), StatusAndCode(4, 0));
  for (int i = 0; i < 200; ++i) {
    rig.write(0, 0x1800, Bytes(6, 0));
    if (i % 50 == 0) rig.write(0, reg::kAlControl, Bytes{8, 0});
    rig.step();
    if (i < 90) {
      EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kAlStatus), 4) << i;
    }
  }
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kAlStatus), 8);
}

/// source: ETG.1000.6; SSC's CiA 402 sample pads its PDOs to words
TEST(SlaveCoe, AGapCanBeMapped) {
  LineRig rig(1);
  to_preop(rig);
  std::uint8_t counter = 0;
  const auto write = [&](std::uint8_t command, std::uint16_t index, std::uint8_t sub,
                         const Bytes& data) {
    counter = ethercat::next_counter(counter);
    return rig.ask(0, sdo(counter, command, index, sub, data))[kSdoAt];
  };
  EXPECT_EQ(write(0x2F, 0x1C13, 0, {0}), 0x60);
  EXPECT_EQ(write(0x2F, 0x1A00, 0, {0}), 0x60);
  EXPECT_EQ(write(0x23, 0x1A00, 1, {8, 0, 0x00, 0x20}), 0x60);   // 2000, 8 bits
  EXPECT_EQ(write(0x23, 0x1A00, 2, {3, 0, 0, 0}), 0x60);         // a gap of three bits
  EXPECT_EQ(write(0x23, 0x1A00, 3, {5, 0, 0, 0}), 0x60);         // and of five
  EXPECT_EQ(write(0x23, 0x1A00, 4, {16, 0, 0x41, 0x60}), 0x60);  // 6041
  EXPECT_EQ(write(0x2F, 0x1A00, 0, {4}), 0x60);
  EXPECT_EQ(write(0x2B, 0x1C13, 1, {0x00, 0x1A}), 0x60);
  EXPECT_EQ(write(0x2F, 0x1C13, 0, {1}), 0x60);
  rig.set_manager(0, 2, {0x1800, 6, ethercat::kControlOutputs, 0, true});
  rig.set_manager(0, 3, {0x2400, 4, ethercat::kControlInputs, 0, true});
  ASSERT_EQ(rig.request(0, 4), StatusAndCode(4, 0));
  rig.slaves[0]->counter = 0x77;
  rig.step();
  EXPECT_EQ(rig.read(0, 0x2400, 4).data, (Bytes{0x77, 0, 0x50, 0x02}));
}

TEST(SlaveState, TheWatchdogLeadsBackToSafeOp) {
  LineRig rig(1);
  to_op(rig);
  for (int i = 0; i < 300; ++i) {
    rig.write(0, 0x1800, Bytes(6, 0));
    rig.step();
  }
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kAlStatus), 8);
  rig.step(99 * kMs);
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kAlStatus), 8);
  rig.step(2 * kMs);
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kAlStatus), 0x14);
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kAlCode), 0x1B);
  EXPECT_EQ(rig.read(0, reg::kWatchdogCount, 1).data, Bytes{1});
}

TEST(SlaveState, TakesItsTime) {
  auto setup = rig_setup();
  setup.state_delay_ns = 5 * kMs;
  LineRig rig(1, setup);
  rig.set_mailboxes(0);
  EXPECT_EQ(rig.request(0, 2), StatusAndCode(1, 0));
  rig.step(5 * kMs);
  EXPECT_EQ(rig.value<std::uint16_t>(0, reg::kAlStatus), 2);
}

TEST(SlaveCoe, ExpeditedTransfersHaveTheseBytes) {
  LineRig rig(1);
  to_preop(rig);
  EXPECT_EQ(rig.ask(0, sdo(1, 0x40, 0x1000, 0)),
            (Bytes{0x0A, 0, 0, 0, 0, 0x13, 0x00, 0x30, 0x43, 0x00, 0x10, 0, 0x92, 0x01, 0x02, 0}));
  EXPECT_EQ(rig.ask(0, sdo(2, 0x23, 0x2100, 0, {0, 0, 0x20, 0x40})),
            (Bytes{0x0A, 0, 0, 0, 0, 0x23, 0x00, 0x30, 0x60, 0x00, 0x21, 0, 0, 0, 0, 0}));
  EXPECT_EQ(rig.slaves[0]->gain, 2.5f);
  const Bytes number = rig.ask(0, sdo(3, 0x40, 0x1C00, 4));
  EXPECT_EQ(number[kSdoAt], 0x4F);
  EXPECT_EQ(number[kSdoAt + 4], 4);
}

TEST(SlaveCoe, ARefusalIsAnAbortWithItsCode) {
  LineRig rig(1);
  to_preop(rig);
  const auto code = [&](const Bytes& request) {
    const Bytes answer = rig.ask(0, request);
    EXPECT_EQ(answer.size(), 16u);
    if (answer.size() != 16) return 0u;
    EXPECT_EQ(answer[7], 0x20) << "as a request, as the standard says";
    EXPECT_EQ(answer[kSdoAt], 0x80);
    return canopen::get<std::uint32_t>(&answer[kSdoAt + 4]);
  };
  EXPECT_EQ(code(sdo(1, 0x40, 0x3000, 0)), 0x06020000u);
  EXPECT_EQ(code(sdo(2, 0x40, 0x1C00, 9)), 0x06090011u);
  EXPECT_EQ(code(sdo(3, 0x23, 0x1000, 0, {1, 0, 0, 0})), 0x06010002u);
  EXPECT_EQ(code(sdo(4, 0x23, 0x2100, 0, {0, 0, 0x30, 0x41})), 0x06090031u) << "11 is above 10";
  EXPECT_EQ(code(sdo(5, 0x2F, 0x2100, 0, {1})), 0x06070013u);
  EXPECT_EQ(code(sdo(6, 0x50, 0x2100, 0)), 0x06010000u) << "complete access";
  EXPECT_EQ(code(sdo(7, 0x60, 0, 0)), 0x05040001u) << "a segment of nothing";
}

TEST(SlaveCoe, ALongStringComesInSegments) {
  LineRig rig(1);
  to_preop(rig);
  Bytes answer = rig.ask(0, sdo(1, 0x40, 0x1008, 0));
  ASSERT_EQ(answer.size(), 128u);
  EXPECT_EQ(answer[kSdoAt], 0x41);
  EXPECT_EQ(canopen::get<std::uint32_t>(&answer[kSdoAt + 4]), 203u);
  std::string text(answer.begin() + ethercat::kSdoDataAt, answer.end());
  answer = rig.ask(0, sdo(2, 0x60, 0, 0));
  ASSERT_EQ(answer.size(), ethercat::kSegmentDataAt + 91);
  EXPECT_EQ(answer[kSdoAt], 0x01) << "the last one";
  text.append(answer.begin() + ethercat::kSegmentDataAt, answer.end());
  EXPECT_EQ(text, rig.slaves[0]->text);
  EXPECT_EQ(rig.ask(0, sdo(3, 0x70, 0, 0))[kSdoAt], 0x80) << "the transfer is over";
}

TEST(SlaveCoe, ANormalDownloadIsTaken) {
  LineRig rig(1);
  to_preop(rig);
  const Bytes answer = rig.ask(0, sdo(1, 0x21, 0x2100, 0, {4, 0, 0, 0, 0, 0, 0x40, 0x40}));
  EXPECT_EQ(answer[kSdoAt], 0x60);
  EXPECT_EQ(rig.slaves[0]->gain, 3.0f);
}

TEST(SlaveCoe, WhatIsNoMessageGetsAMailboxError) {
  LineRig rig(1);
  to_preop(rig);
  const auto error = [&](const Bytes& request) {
    const Bytes answer = rig.ask(0, request);
    if (answer.size() != 10 || (answer[5] & 0x0F) != 0) return -1;
    return static_cast<int>(answer[8]);
  };
  EXPECT_EQ(error({0xFF, 0xFF, 0, 0, 0, 0x13}), 8) << "longer than the mailbox";
  EXPECT_EQ(error({2, 0, 0, 0, 0, 0x12, 0, 0}), 2) << "EoE is not there";
  EXPECT_EQ(error({1, 0, 0, 0, 0, 0x33, 0}), 6);
  EXPECT_EQ(error({8, 0, 0, 0, 0, 0x43, 0, 0x20, 0x40, 0, 0x10, 0, 0, 0}), 6) << "cut";
  EXPECT_EQ(error({4, 0, 0, 0, 0, 0x53, 0, 0x50, 0, 0}), 4);
}

TEST(SlaveCoe, ARepeatedMessageIsNotTakenTwice) {
  LineRig rig(1);
  to_preop(rig);
  EXPECT_FALSE(rig.ask(0, sdo(1, 0x40, 0x1000, 0)).empty());
  EXPECT_TRUE(rig.ask(0, sdo(1, 0x40, 0x1000, 0)).empty());
  EXPECT_FALSE(rig.ask(0, sdo(2, 0x40, 0x1000, 0)).empty());
}

TEST(SlaveCoe, ALostAnswerIsGivenAgainOnRequest) {
  LineRig rig(1);
  to_preop(rig);
  const Bytes first = rig.ask(0, sdo(1, 0x40, 0x1000, 0));
  EXPECT_EQ(rig.read(0, 0x1080, 128).counter, 0);
  rig.write(0, 0x080E, {0x03});
  rig.step();
  EXPECT_EQ(rig.read(0, 0x080F, 1).data, Bytes{0x02}) << "the slave has heard it";
  const auto again = rig.read(0, 0x1080, 128);
  EXPECT_EQ(again.counter, 1);
  EXPECT_TRUE(std::equal(first.begin(), first.end(), again.data.begin()));
}

TEST(SlavePdo, TheAssignmentChangesInPreOpOnlyAndInItsOrder) {
  LineRig rig(1);
  to_preop(rig);
  std::uint8_t counter = 0;
  const auto write = [&](std::uint16_t index, std::uint8_t sub, std::uint32_t value, int bytes) {
    counter = ethercat::next_counter(counter);
    const auto command = static_cast<std::uint8_t>(0x23 | ((4 - bytes) << 2));
    const Bytes answer =
        rig.ask(0, sdo(counter, command, index, sub, LineRig::bytes<std::uint32_t>(value)));
    return answer[kSdoAt] == 0x60 ? 0u : canopen::get<std::uint32_t>(&answer[kSdoAt + 4]);
  };
  EXPECT_EQ(write(0x1600, 1, 0x60400010, 4), 0x06010000u) << "its count is not 0";
  EXPECT_EQ(write(0x1600, 0, 0, 1), 0u);
  EXPECT_EQ(write(0x1600, 1, 0x60640020, 4), 0u);
  EXPECT_EQ(write(0x1600, 0, 1, 1), 0x06040041u) << "an actual value is no demand";
  EXPECT_EQ(write(0x1600, 1, 0x60400010, 4), 0u);
  EXPECT_EQ(write(0x1600, 0, 1, 1), 0u);
  EXPECT_EQ(write(0x1C12, 0, 0, 1), 0u);
  EXPECT_EQ(write(0x1C12, 1, 0x1605, 2), 0u);
  EXPECT_EQ(write(0x1C12, 0, 1, 1), 0x06040041u) << "there is no such PDO";
  EXPECT_EQ(write(0x1C12, 1, 0x1600, 2), 0u);
  EXPECT_EQ(write(0x1C12, 0, 1, 1), 0u);
  rig.set_process_data(0);
  EXPECT_EQ(rig.request(0, 4), StatusAndCode(0x12, 0x1D)) << "two bytes now";
  rig.set_manager(0, 2, {0x1800, 2, ethercat::kControlOutputs, 0, true});
  EXPECT_EQ(rig.request(0, 0x14), StatusAndCode(4, 0));
  EXPECT_EQ(write(0x1600, 0, 0, 1), 0x08000022u) << "not in this state";
}

TEST(SlavePdo, OutputsReachTheObjectsInOpAndInputsTheMaster) {
  LineRig rig(1);
  to_preop(rig);
  rig.set_process_data(0);
  rig.request(0, 4);
  rig.write(0, 0x1800, {0x0F, 0x00, 0x78, 0x56, 0x34, 0x12});
  rig.slaves[0]->position = -2;
  rig.slaves[0]->counter = 9;
  rig.step();
  EXPECT_EQ(rig.slaves[0]->controlword, 0) << "not before OP";
  EXPECT_EQ(rig.read(0, 0x2400, 7).data, (Bytes{0x50, 0x02, 0xFE, 0xFF, 0xFF, 0xFF, 9}));
  rig.request(0, 8);
  rig.write(0, 0x1800, {0x0F, 0x00, 0x78, 0x56, 0x34, 0x12});
  rig.step();
  EXPECT_EQ(rig.slaves[0]->controlword, 0x000F);
  EXPECT_EQ(rig.slaves[0]->target, 0x12345678);
  EXPECT_EQ(rig.slaves[0]->slave->outputs_taken(), 1u);
}

TEST(Slave, IsArchivedWhole) {
  LineRig rig(2);
  to_op(rig);
  rig.line->set_cable(1, false);
  Archive saved;
  rig.line->archive(saved);
  LineRig other(2);
  Archive loaded(saved.bytes());
  other.line->archive(loaded);
  EXPECT_TRUE(loaded.ok() && loaded.at_end());
  EXPECT_EQ(other.line->reached(), 1u);
  EXPECT_EQ(other.value<std::uint16_t>(0, reg::kAlStatus), 8);
  for (LineRig* one : {&rig, &other}) {
    one->now_ns = 400 * kMs;
    one->write(0, 0x1800, {1, 0, 2, 0, 0, 0});
    one->step();
    EXPECT_EQ(one->slaves[0]->target, 2);
  }
  Archive after, after_other;
  rig.line->archive(after);
  other.line->archive(after_other);
  EXPECT_TRUE(std::ranges::equal(after.bytes(), after_other.bytes()));
}

TEST(Slave, ASetupThatCannotBeIsRefused) {
  auto setup = rig_setup();
  EXPECT_TRUE(firmware::esc::check(setup).has_value());
  setup.mailbox_bytes = 16;
  EXPECT_FALSE(firmware::esc::check(setup).has_value());
  setup = rig_setup();
  setup.outputs[0].index = 0x1A00;
  EXPECT_FALSE(firmware::esc::check(setup).has_value());
}

}  // namespace
}  // namespace tandem::test
