// The master's SDO client against an emulated slave, with frames lost at every place.
#include "hal/ethercat-can/line/coe_client.hpp"

#include <gtest/gtest.h>

#include "hal/ethercat-can/line/in_process_link.hpp"
#include "hal/ethercat-can/line/slave_plan.hpp"
#include "tests/ethercat/line_rig.hpp"

namespace tandem::test {
namespace {

using canopen::AbortCode;
using hal::ecat::CoeClient;
using hal::ecat::FrameFate;

/// Lays an emergency before the answer, the next time that the mailbox is read.
class EmergencyFirst final : public ethercat::Medium {
 public:
  explicit EmergencyFirst(ethercat::Medium& slaves) : slaves_(&slaves) {}
  bool pass(std::span<std::uint8_t> frame, std::int64_t now_ns) noexcept override {
    ethercat::FrameReader reader(frame);
    ethercat::Datagram datagram;
    while (wanted && reader.next(datagram)) {
      const bool reads = datagram.command() == ethercat::Command::kFprd;
      if (!reads || datagram.offset() != 0x1080 || datagram.data().size() != 128) continue;
      std::uint8_t* command = datagram.data().data() - ethercat::kDatagramHeaderBytes;
      *command = 0;  // NOP: the answer stays in the mailbox
      const bool back = slaves_->pass(frame, now_ns);
      *command = static_cast<std::uint8_t>(ethercat::Command::kFprd);
      constexpr std::array<std::uint8_t, 16> kEmergency{10,   0,    0,    0, 0, 0x13, 0x00, 0x10,
                                                        0x11, 0x86, 0x20, 1, 2, 3,    4,    5};
      std::ranges::copy(kEmergency, datagram.data().begin());
      datagram.add_working_counter(1);
      wanted = false;
      return back;
    }
    return slaves_->pass(frame, now_ns);
  }
  bool wanted = false;

 private:
  ethercat::Medium* slaves_;
};

/// One slave in PREOP, and a client with frames of its own.
class CoeRig {
 public:
  CoeRig() : rig(1), emergencies(*rig.line), link(emergencies), batch_(8), exchange(1) {
    rig.write(0, ethercat::reg::kStation, {0x01, 0x10});
    rig.set_mailboxes(0);
    EXPECT_EQ(rig.request(0, 2), (std::pair{2, 0}));
    client.reset(0x1001, {0x1000, 128, 0x1080, 128});
  }

  void cycle() {
    std::vector<hal::ecat::FrameBuffer> frames(8);
    const std::size_t count = link.receive(frames);
    for (std::size_t i = 0; i < count; ++i) {
      ethercat::FrameReader reader(frames[i].frame());
      ethercat::Datagram datagram;
      while (reader.next(datagram)) (void)exchange.take(datagram);
    }
    exchange.age(rig.now_ns);
    client.process(rig.now_ns, exchange, 0);
    batch_.begin(link.address());
    exchange.collect(batch_, rig.now_ns);
    sent += batch_.size();
    link.set_time(rig.now_ns);
    link.send(batch_.finish());
    rig.step();
  }
  CoeClient::Status finish() {
    for (int i = 0; i < 3000 && client.busy(); ++i) cycle();
    return client.status();
  }

  LineRig rig;
  EmergencyFirst emergencies;
  hal::ecat::InProcessLink link;
  hal::ecat::FrameBatch batch_;
  hal::ecat::Exchange exchange;
  CoeClient client;
  std::size_t sent = 0;
};

std::string text_of(const CoeClient& client) {
  return {client.value().begin(), client.value().end()};
}

TEST(CoeClient, ReadsAndWritesAValueInOneMessage) {
  CoeRig rig;
  rig.client.upload(0x1000, 0);
  ASSERT_EQ(rig.finish(), CoeClient::Status::kDone);
  EXPECT_EQ(Bytes(rig.client.value().begin(), rig.client.value().end()),
            (Bytes{0x92, 0x01, 0x02, 0x00}));
  rig.client.download(0x2100, 0, LineRig::bytes(2.5f));
  ASSERT_EQ(rig.finish(), CoeClient::Status::kDone);
  EXPECT_EQ(rig.rig.slaves[0]->gain, 2.5f);
}

TEST(CoeClient, ReadsALongStringInSegments) {
  CoeRig rig;
  rig.client.upload(0x1008, 0);
  ASSERT_EQ(rig.finish(), CoeClient::Status::kDone);
  EXPECT_EQ(text_of(rig.client), rig.rig.slaves[0]->text);
}

TEST(CoeClient, SaysWhyTheSlaveRefused) {
  CoeRig rig;
  rig.client.upload(0x3000, 0);
  EXPECT_EQ(rig.finish(), CoeClient::Status::kAborted);
  EXPECT_EQ(rig.client.abort_code(), AbortCode::kNoObject);
  const Bytes longer(300, 1);  // in segments
  rig.client.download(0x2100, 0, longer);
  EXPECT_EQ(rig.finish(), CoeClient::Status::kAborted);
  EXPECT_EQ(rig.client.abort_code(), AbortCode::kTooLong);
}

TEST(CoeClient, GivesASlaveUpThatDoesNotAnswer) {
  CoeRig rig;
  rig.rig.line->set_cable(0, false);
  rig.client.upload(0x1000, 0);
  EXPECT_EQ(rig.finish(), CoeClient::Status::kAborted);
  EXPECT_EQ(rig.client.abort_code(), AbortCode::kTimeout);
}

// Whichever frame is lost, on its way there or back, doubled or late: the value arrives.
TEST(CoeClient, GetsOverAnyFrameThatIsLostLateOrDoubled) {
  CoeRig whole;
  whole.client.upload(0x1008, 0);
  ASSERT_EQ(whole.finish(), CoeClient::Status::kDone);
  ASSERT_GE(whole.sent, 6u);  // two requests, each written, looked for and read
  for (const FrameFate fate :
       {FrameFate::kLoseBefore, FrameFate::kLoseAfter, FrameFate::kTwice, FrameFate::kLate}) {
    for (std::size_t which = 0; which < whole.sent; ++which) {
      CoeRig rig;
      rig.client.upload(0x1008, 0);
      while (rig.sent < which) rig.cycle();
      rig.link.set_fate(fate, 1);
      ASSERT_EQ(rig.finish(), CoeClient::Status::kDone) << which;
      EXPECT_EQ(text_of(rig.client), rig.rig.slaves[0]->text) << which;
    }
  }
}

TEST(SlavePlan, PdosAreMappedInTheOrderThatSlavesAskFor) {
  hal::ecat::SlavePlan plan;
  plan.outputs = {{.index = 0x1600, .entries = {0x60400010, 0x607A0020}}};
  plan.inputs = {{.index = 0x1A00, .entries = {0x60410010}, .fixed = true}};
  std::vector<std::pair<int, int>> order;
  for (const hal::ecat::CoeStep& step : hal::ecat::make_steps(plan)) {
    order.emplace_back(step.index << 8 | step.sub, step.bytes[0]);
  }
  EXPECT_EQ(order, (std::vector<std::pair<int, int>>{{0x1C1200, 0},
                                                     {0x160000, 0},
                                                     {0x160001, 0x10},
                                                     {0x160002, 0x20},
                                                     {0x160000, 2},
                                                     {0x1C1201, 0x00},
                                                     {0x1C1200, 1},
                                                     {0x1C1300, 0},
                                                     {0x1C1301, 0x00},
                                                     {0x1C1300, 1}}));
}

TEST(SlavePlan, AnIdentityMayHaveALaterMinorRevisionAndAnySerialNumber) {
  hal::ecat::SlavePlan plan;
  plan.identity = {.vendor = 1, .product = 2, .revision = 0x00030004};
  EXPECT_TRUE(matches(plan, {1, 2, 0x00030005, 9}));
  EXPECT_FALSE(matches(plan, {1, 2, 0x00030003, 9}));
  EXPECT_FALSE(matches(plan, {1, 2, 0x00040004, 9}));
  EXPECT_FALSE(matches(plan, {1, 3, 0x00030004, 9}));
  EXPECT_FALSE(matches(plan, {5, 2, 0x00030004, 9}));
  plan.identity.serial = 8;
  EXPECT_FALSE(matches(plan, {1, 2, 0x00030004, 9}));
}

TEST(CoeClient, KeepsTheEmergencyThatLayBeforeTheAnswer) {
  CoeRig rig;
  rig.client.upload(0x1000, 0);
  ASSERT_EQ(rig.finish(), CoeClient::Status::kDone);
  EXPECT_EQ(rig.client.emergencies(), 0u);
  rig.emergencies.wanted = true;
  rig.client.upload(0x1000, 0);
  ASSERT_EQ(rig.finish(), CoeClient::Status::kDone);
  EXPECT_EQ(canopen::get<std::uint32_t>(rig.client.value().data()), 0x00020192u);
  EXPECT_EQ(rig.client.emergencies(), 1u);
  EXPECT_EQ(Bytes(rig.client.emergency().begin(), rig.client.emergency().end()),
            (Bytes{0x11, 0x86, 0x20, 1, 2, 3, 4, 5}));
}

}  // namespace
}  // namespace tandem::test
