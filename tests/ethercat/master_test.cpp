// The master's way from the scan to OP, and what it says when a slave is not as it should be.
#include <gtest/gtest.h>

#include "tests/ethercat/master_rig.hpp"

namespace tandem::test {
namespace {

using hal::ecat::LineError;
using hal::ecat::LineMaster;
using hal::ecat::SlaveStage;

class MasterStart : public testing::TestWithParam<std::size_t> {};

TEST_P(MasterStart, BringsEverySlaveToOpAndExchangesProcessData) {
  MasterRig rig(GetParam());
  ASSERT_TRUE(rig.to_op()) << rig.master->text();
  rig.demand = 700;
  rig.cycles(4);
  EXPECT_TRUE(rig.master->cycle().valid);
  EXPECT_EQ(rig.master->cycle().counter, 3 * GetParam());
  EXPECT_EQ(rig.master->cycle().reached, GetParam());
  for (std::size_t i = 0; i < GetParam(); ++i) {
    EXPECT_EQ(rig.rig.slaves[i]->target, 700 + static_cast<int>(i));
    EXPECT_EQ(canopen::get<std::int32_t>(&rig.master->inputs(i)[2]), 700 + static_cast<int>(i));
    EXPECT_EQ(rig.rig.slaves[i]->gain, 4.0f);
    EXPECT_EQ(rig.master->slave(i).content().name, "rig");
    EXPECT_GT(rig.rig.slaves[i]->slave->controller().sync0_pulses(), 0u);
  }
  EXPECT_EQ(rig.master->statistics().shorts, 0u);
  EXPECT_EQ(rig.master->statistics().lost, 0u);
}
INSTANTIATE_TEST_SUITE_P(Slaves, MasterStart, testing::Values(1, 3, 29));

TEST(MasterClock, MeasuresTheWayAndHoldsTheClocksTogether) {
  MasterRig rig(5);
  ASSERT_TRUE(rig.to_op()) << rig.master->text();
  rig.cycles(3000);
  const std::int64_t reference =
      rig.rig.slaves[0]->slave->controller().system_time_ns(rig.rig.now_ns);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(rig.master->slave(i).clock().delay_ns(), 300.0 * static_cast<double>(i), 25.0);
    const std::int64_t time = rig.rig.slaves[i]->slave->controller().system_time_ns(rig.rig.now_ns);
    EXPECT_LT(std::abs(time - reference), 200) << i;
    EXPECT_LT(std::abs(rig.master->slave(i).clock().difference_ns()), 200) << i;
  }
}

TEST(MasterClock, IsHandedRoundOnlyAfterTheReferenceHasItsOffset) {
  MasterRig rig(2);
  rig.tamper.record = true;
  rig.tamper.reserve(2000);
  ASSERT_TRUE(rig.to_op()) << rig.master->text();
  bool offset = false;
  int rounds = 0;
  for (std::size_t i = 0; i < rig.tamper.kept; ++i) {
    ethercat::FrameReader reader(rig.tamper.frames[i]);
    ethercat::Datagram datagram;
    while (reader.next(datagram)) {
      const bool writes = datagram.command() == ethercat::Command::kFpwr;
      offset |= writes && datagram.offset() == ethercat::reg::kTimeOffset &&
                datagram.slave() == rig.master->slave(0).station();
      if (datagram.command() != ethercat::Command::kFrmw) continue;
      ++rounds;
      ASSERT_TRUE(offset) << "frame " << i;
    }
  }
  EXPECT_GT(rounds, 100);
}

TEST(MasterStart, SlavesWithoutClocksNeedNone) {
  auto setups = MasterRig::setups(3);
  setups[0].has_dc = setups[2].has_dc = false;
  auto plan = rig_plan();
  plan.sync0_cycle_ns = 0;
  MasterRig rig(setups, plan);
  EXPECT_TRUE(rig.to_op()) << rig.master->text();
}

TEST(MasterStart, AnotherDeviceIsRefusedBeforeItIsWrittenTo) {
  auto setups = MasterRig::setups(3);
  setups[1].identity.vendor = 0x1234;
  MasterRig rig(setups, rig_plan());
  EXPECT_FALSE(rig.to_op());
  EXPECT_EQ(rig.master->slave(1).error(), LineError::kWrongIdentity);
  EXPECT_NE(rig.master->text().find("slave 1 (rig1): is another device: vendor 00001234"),
            std::string::npos)
      << rig.master->text();
  EXPECT_EQ(rig.rig.slaves[1]->gain, 1.0f);
}

TEST(MasterStart, ARefusedStateIsToldWithItsCodeInWords) {
  auto setups = MasterRig::setups(2);
  auto plan = rig_plan();
  plan.steps = {};
  plan.outputs[0].fixed = true;
  plan.outputs[0].entries = {0x60400010};  // the slave has six bytes
  MasterRig rig(setups, plan);
  EXPECT_FALSE(rig.to_op());
  EXPECT_EQ(rig.master->slave(0).error(), LineError::kRefused);
  EXPECT_NE(rig.master->text().find("refused SAFEOP: invalid output configuration (AL status code "
                                    "001D)"),
            std::string::npos)
      << rig.master->text();
}

TEST(MasterStart, ARefusedObjectIsToldWithItsAbortCode) {
  auto plan = rig_plan();
  plan.steps = {hal::ecat::coe_write(0x2100, 0, 11.0f)};
  MasterRig rig(1, plan);
  EXPECT_FALSE(rig.to_op());
  EXPECT_NE(rig.master->text().find("object 2100:00 was refused: "), std::string::npos)
      << rig.master->text();
  EXPECT_NE(rig.master->text().find("06090031"), std::string::npos);
}

TEST(MasterStart, ASlowSlaveIsWaitedForAndATooSlowOneIsNot) {
  auto setups = MasterRig::setups(1);
  setups[0].state_delay_ns = 300 * kMs;
  MasterRig slow(setups, rig_plan());
  EXPECT_TRUE(slow.to_op()) << slow.master->text();
  auto plan = rig_plan();
  plan.state_time_ns = 100 * kMs;
  MasterRig too_slow(setups, plan);
  EXPECT_FALSE(too_slow.to_op());
  EXPECT_EQ(too_slow.master->slave(0).error(), LineError::kStateTimeout);
}

TEST(MasterStart, SaysHowManySlavesAnswer) {
  MasterRig rig(3);
  rig.rig.line->set_cable(2, false);
  EXPECT_FALSE(rig.to_op());
  EXPECT_EQ(rig.master->error(), LineError::kTooFew);
  EXPECT_NE(rig.master->text().find("2 of 3 slaves answer: look at slave 2 (rig2)"),
            std::string::npos)
      << rig.master->text();
  rig.rig.line->set_cable(0, false);
  rig.master->restart(rig.rig.now_ns);
  EXPECT_FALSE(rig.to_op());
  EXPECT_EQ(rig.master->error(), LineError::kSilent);
  rig.rig.line->set_cable(0, true);
  rig.rig.line->set_cable(2, true);
  rig.master->restart(rig.rig.now_ns);
  EXPECT_TRUE(rig.to_op()) << rig.master->text();
}

TEST(MasterStart, AnImpossiblePlanIsRefused) {
  MasterRig rig(1);
  EXPECT_FALSE(LineMaster::create(rig.link, {}).has_value());
  auto plan = rig_plan();
  plan.outputs[0].entries.assign(300, 0x60400020);
  EXPECT_FALSE(LineMaster::create(rig.link, {plan}).has_value());
}

}  // namespace
}  // namespace tandem::test
