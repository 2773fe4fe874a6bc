// What the master notices in OP: lost, late and doubled frames, working counters, cables, slaves.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/ethercat/master_rig.hpp"

namespace tandem::test {
namespace {

using hal::ecat::FrameFate;
using hal::ecat::LineError;
using hal::ecat::LineStatistics;
using hal::ecat::SlaveStage;

/// Three slaves in OP.
class MasterFault : public testing::Test, public MasterRig {
 public:
  MasterFault() : MasterRig(3) {}

 protected:
  void SetUp() override {
    ASSERT_TRUE(to_op()) << master->text();
    cycles(5);
    before_ = master->statistics();
  }
  [[nodiscard]] LineStatistics since() const {
    LineStatistics now = master->statistics();
    now.lost -= before_.lost;
    now.shorts -= before_.shorts;
    now.stray -= before_.stray;
    now.resent -= before_.resent;
    return now;
  }
  [[nodiscard]] bool says(const std::string& words) const {
    return master->text().find(words) != std::string::npos;
  }
  LineStatistics before_;
};

TEST_F(MasterFault, ALostFrameIsOneCycleWithoutInputs) {
  link.set_fate(FrameFate::kLoseAfter, 1);
  cycle();
  EXPECT_FALSE(cycle().complete);
  EXPECT_EQ(master->cycle().lost_in_row, 1u);
  EXPECT_TRUE(cycle().valid);
  EXPECT_EQ(master->cycle().lost_in_row, 0u);
  EXPECT_EQ(since().lost, 1u);
  cycles(20);
  EXPECT_EQ(master->text(), "");
}

TEST_F(MasterFault, ALostFrameIsReadAgainWithinItsCycle) {
  link.set_fate(FrameFate::kLoseBefore, 1);
  demand = 900;
  cycle();
  EXPECT_FALSE(master->collect());
  EXPECT_EQ(master->resend(), 1u);
  EXPECT_TRUE(master->collect());
  EXPECT_EQ(master->resend(), 0u) << "nothing is missing";
  EXPECT_TRUE(cycle().valid);
  EXPECT_EQ(since().lost, 0u);
  EXPECT_EQ(since().resent, 1u);
  EXPECT_EQ(rig.slaves[2]->target, 902);
}

TEST_F(MasterFault, ADoubledFrameIsTakenOnce) {
  link.set_fate(FrameFate::kTwice, 1);
  cycle();
  EXPECT_TRUE(cycle().valid);
  EXPECT_EQ(since().stray, 3u) << "process data, states, and a clock's difference";
  EXPECT_EQ(master->text(), "");
}

TEST_F(MasterFault, ALateFrameIsNotTakenForTheNextOne) {
  link.set_fate(FrameFate::kLate, 1);
  demand = 300;
  cycle();
  EXPECT_FALSE(cycle().complete);
  demand = 400;
  EXPECT_TRUE(cycle().valid);
  cycles(3);
  EXPECT_EQ(since().lost, 1u);
  EXPECT_GE(since().stray, 2u);
  EXPECT_EQ(canopen::get<std::int32_t>(&master->inputs(1)[2]), 401);
  EXPECT_EQ(master->text(), "");
}

TEST_F(MasterFault, AWorkingCounterThatIsShortOnceKeepsTheOldInputs) {
  const auto heard = [this] { return canopen::get<std::int32_t>(&master->inputs(0)[2]); };
  const auto next = [this] {
    ++demand;
    return cycle().valid;
  };
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(next());
  tamper.shorten = 1;
  EXPECT_TRUE(next());  // the cycle before; its own is judged with the next one
  const int old = heard();
  EXPECT_FALSE(next());
  EXPECT_TRUE(master->cycle().complete);
  EXPECT_EQ(master->cycle().counter, 8u);
  EXPECT_EQ(heard(), old);
  EXPECT_TRUE(next());
  EXPECT_EQ(heard(), old + 2);
  EXPECT_EQ(since().shorts, 1u);
  cycles(20);
  EXPECT_EQ(master->text(), "");
}

TEST_F(MasterFault, AWorkingCounterThatStaysShortLeadsToTheSlaveWithoutItsMap) {
  rig.set_fmmu(1, 1, {});
  cycles(20);
  EXPECT_EQ(master->slave(1).error(), LineError::kMappingLost);
  EXPECT_TRUE(says("slave 1 (rig1): its FMMUs were changed"));
  EXPECT_TRUE(master->slave(0).running() && master->slave(2).running());
  EXPECT_TRUE(master->cycle().valid) << "the others go on";
}

TEST_F(MasterFault, ACutCableIsNamedAndAMendedOneIsSeen) {
  rig.line->set_cable(1, false);
  cycles(200);
  EXPECT_EQ(master->error(), LineError::kCable);
  EXPECT_EQ(master->broken_cable(), 1u);
  EXPECT_TRUE(says("the cable from slave 0 (rig0) to slave 1 (rig1) is cut")) << master->text();
  EXPECT_TRUE(master->slave(0).running());
  EXPECT_EQ(master->slave(1).error(), LineError::kGone);
  EXPECT_EQ(master->slave(2).error(), LineError::kGone);
  EXPECT_TRUE(master->cycle().valid) << "the slave before it goes on";
  rig.line->set_cable(1, true);
  cycles(10);
  EXPECT_EQ(master->error(), LineError::kNone);
  EXPECT_EQ(master->mended(), 1u);
  EXPECT_FALSE(master->slave(1).running()) << "nothing moves by itself";
  EXPECT_EQ(rig.slaves[1]->slave->code(), ethercat::AlCode::kWatchdog);
  const std::uint64_t taken = rig.slaves[0]->slave->outputs_taken();
  master->restart(1, rig.now_ns);
  master->restart(2, rig.now_ns);
  ASSERT_TRUE(to_op()) << master->text();
  EXPECT_GT(rig.slaves[0]->slave->outputs_taken(), taken + 100) << "and the first one still";
  EXPECT_EQ(rig.slaves[0]->slave->state(), ethercat::AlState::kOp);
  cycles(4);
  EXPECT_EQ(master->cycle().counter, 9u);
}

TEST_F(MasterFault, ALooseContactIsNoCutCable) {
  for (int i = 0; i < 10; ++i) {
    rig.line->set_cable(1, false);
    cycles(1);
    rig.line->set_cable(1, true);
    cycles(3);
  }
  EXPECT_EQ(master->error(), LineError::kNone);
  EXPECT_EQ(since().shorts, 10u);
  EXPECT_TRUE(master->all(SlaveStage::kRunning)) << master->text();
}

TEST_F(MasterFault, ACutFirstCableIsSilence) {
  rig.line->set_cable(0, false);
  cycles(50);
  EXPECT_EQ(master->error(), LineError::kSilent);
  EXPECT_TRUE(says("the cable from the master to slave 0 (rig0) is cut")) << master->text();
  rig.line->set_cable(0, true);
  cycles(10);
  EXPECT_EQ(master->error(), LineError::kNone);
  master->restart(rig.now_ns);
  EXPECT_TRUE(to_op()) << master->text();
}

TEST_F(MasterFault, ASlaveThatRestartsIsFoundAndComesBack) {
  rig.line->set_power(2, false, rig.now_ns);
  rig.line->set_power(2, true, rig.now_ns);
  cycles(30);
  EXPECT_EQ(master->slave(2).stage(), SlaveStage::kDown);
  EXPECT_EQ(master->slave(2).error(), LineError::kGone) << "its address is gone";
  EXPECT_TRUE(master->slave(0).running() && master->slave(1).running());
  master->restart(2, rig.now_ns);
  EXPECT_TRUE(to_op()) << master->text();
}

TEST_F(MasterFault, ASlaveThatLeavesOpIsToldWithItsCode) {
  rig.slaves[1]->slave->fail(ethercat::AlState::kSafeOp, ethercat::AlCode::kSynchronisation);
  cycles(10);
  EXPECT_EQ(master->slave(1).error(), LineError::kLeftState);
  EXPECT_TRUE(says("slave 1 (rig1): is in SAFEOP: synchronisation error (AL status code 001A)"))
      << master->text();
  EXPECT_TRUE(master->slave(0).running() && master->slave(2).running());
}

TEST_F(MasterFault, TheSlavesWatchdogsAreToldAfterAPauseOfTheMaster) {
  for (int i = 0; i < 150; ++i) rig.step();
  cycles(10);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(master->slave(i).error(), LineError::kLeftState);
    const std::string text = master->slave(i).text();
    EXPECT_NE(text.find("process data watchdog: no outputs came in time"), text.npos) << text;
  }
  master->restart(rig.now_ns);
  EXPECT_TRUE(to_op()) << master->text();
}

TEST_F(MasterFault, ASecondMasterThatTakesTheSlavesIsNoticed) {
  hal::ecat::InProcessLink other_link(tamper);
  auto other = hal::ecat::LineMaster::create(other_link, std::vector(3, rig_plan()));
  ASSERT_TRUE(other.has_value());
  (*other)->restart(rig.now_ns);
  for (int i = 0; i < 40; ++i) {
    (*other)->receive(rig.now_ns);
    other_link.set_time(rig.now_ns);
    (*other)->send(rig.now_ns);
    cycle();
  }
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(master->slave(i).stage(), SlaveStage::kDown);
}

/// Makes frames another master's, and hands on the last one first.
class SharedLink final : public hal::ecat::DataLink {
 public:
  explicit SharedLink(hal::ecat::DataLink& link) : link_(&link) {}
  std::size_t send(std::span<const hal::ecat::FrameBuffer> frames) noexcept override {
    return link_->send(frames);
  }
  std::size_t receive(std::span<hal::ecat::FrameBuffer> frames) noexcept override {
    const std::size_t count = link_->receive(frames);
    if (stranger && count > 0) {
      frames[0].bytes[8] ^= 0x10;
      stranger = !once;
    }
    std::reverse(frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(count));
    return count;
  }
  [[nodiscard]] ethercat::MacAddress address() const noexcept override { return link_->address(); }
  [[nodiscard]] hal::ecat::LinkStatistics statistics() const noexcept override { return {}; }
  bool stranger = false;
  bool once = false;  ///< the next frame alone

 private:
  hal::ecat::DataLink* link_;
};

/// A master of one slave behind such a link.
struct SharedRig {
  void cycle() {
    master->receive(rig.now_ns);
    link.set_time(rig.now_ns);
    master->send(rig.now_ns);
    rig.step();
    for (auto& slave : rig.slaves) ++slave->position;
  }
  LineRig rig{1};
  hal::ecat::InProcessLink link{*rig.line};
  SharedLink shared{link};
  std::unique_ptr<hal::ecat::LineMaster> master =
      std::move(*hal::ecat::LineMaster::create(shared, {rig_plan()}));
};

TEST(MasterStranger, FramesOfAnotherMasterAreNotTakenAndTold) {
  SharedRig rig;
  rig.master->restart(0);
  for (int i = 0; i < 300; ++i) rig.cycle();
  EXPECT_EQ(rig.master->text(), "");
  rig.shared.stranger = true;
  rig.cycle();
  EXPECT_EQ(rig.master->statistics().strangers, 1u);
  EXPECT_NE(rig.master->text().find("a second master is on the wire"), std::string::npos);
}

TEST(MasterStranger, OneThatWasThereFirstKeepsItsSlaves) {
  SharedRig rig;
  rig.master->restart(0);
  rig.shared.stranger = true;
  for (int i = 0; i < 3; ++i) rig.cycle();
  EXPECT_EQ(rig.master->error(), hal::ecat::LineError::kSecondMaster);
  EXPECT_NE(rig.master->text().find("another master is at work"), std::string::npos)
      << rig.master->text();
  const std::uint64_t sent = rig.link.statistics().sent;
  for (int i = 0; i < 100; ++i) rig.cycle();
  EXPECT_EQ(rig.link.statistics().sent, sent) << "nothing more is sent";
  EXPECT_EQ(rig.rig.value<std::uint16_t>(0, ethercat::reg::kStation), 0) << "nobody was spoken to";
}

/// It ended the start after the next restart, for good (found by the fuzzer).
TEST(MasterStranger, AFrameFromBeforeARestartIsOfNoScan) {
  SharedRig rig;
  rig.master->restart(0);
  for (int i = 0; i < 300; ++i) rig.cycle();
  rig.shared.stranger = rig.shared.once = true;
  rig.master->send(rig.rig.now_ns);  // what comes of it waits to be received
  rig.master->restart(rig.rig.now_ns);
  for (int i = 0; i < 300; ++i) rig.cycle();
  EXPECT_TRUE(rig.master->all(SlaveStage::kReady)) << rig.master->text();
}

TEST(MasterStranger, AnOldFrameThatComesFirstIsNotTakenForTheCyclesOwn) {
  SharedRig rig;
  rig.master->restart(0);
  for (int i = 0; i < 300; ++i) rig.cycle();
  ASSERT_TRUE(rig.master->all(SlaveStage::kReady)) << rig.master->text();
  const auto heard = [&] { return canopen::get<std::int32_t>(&rig.master->inputs(0)[2]); };
  const int old = heard();
  rig.link.set_fate(FrameFate::kLate, 1);
  for (int i = 0; i < 3; ++i) rig.cycle();
  EXPECT_EQ(heard(), old + 3);
  EXPECT_EQ(rig.master->statistics().lost, 1u);
}

// Every frame of the start is lost, late or doubled in turn.
TEST(MasterStart, GetsOverAnyFrameThatIsLostLateOrDoubled) {
  MasterRig whole(2);
  ASSERT_TRUE(whole.to_op()) << whole.master->text();
  const auto frames = static_cast<std::uint32_t>(whole.link.statistics().sent);
  for (const FrameFate fate :
       {FrameFate::kLoseBefore, FrameFate::kLoseAfter, FrameFate::kTwice, FrameFate::kLate}) {
    for (std::uint32_t which = 0; which < frames; which += 3) {
      MasterRig rig(2);
      while (rig.link.statistics().sent < which) rig.cycle();
      rig.link.set_fate(fate, 1);
      ASSERT_TRUE(rig.to_op()) << which << ' ' << rig.master->text();
    }
  }
}

}  // namespace
}  // namespace tandem::test
