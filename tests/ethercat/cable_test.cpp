// Master and slaves at two ends of a virtual cable: the same bytes as in process.
#include <gtest/gtest.h>
#include <poll.h>

#include <utility>

#include "base/own_system_call.hpp"
#include "hal/ethercat-can/line/packet_link.hpp"
#include "tests/ethercat/master_rig.hpp"
#include "tests/ethercat/own_network.hpp"
#include "tests/support/needs_root.hpp"

namespace tandem::test {
namespace {

using hal::ecat::FrameBuffer;
using hal::ecat::PacketLink;

/// Carries each frame over the cable to the slaves and back before it returns.
class CableLink final : public hal::ecat::DataLink {
 public:
  CableLink(PacketLink& near, PacketLink& far, ethercat::Medium& slaves)
      : near_(&near), far_(&far), slaves_(&slaves), frames_(64) {}
  std::size_t send(std::span<const FrameBuffer> frames) noexcept override {
    TANDEM_OWN_SYSTEM_CALL;  // the other end of the cable is here too, which is no part of a cycle
    const std::size_t sent = near_->send(frames);
    const std::size_t count = await(*far_, sent);
    EXPECT_EQ(count, frames.size());
    for (std::size_t i = 0; i < count; ++i) {
      // The sender's address is the only difference to a frame in process.
      std::fill_n(&frames_[i].bytes[6], 6, std::uint8_t{0});
      frames_[i].bytes[11] = 1;
      EXPECT_TRUE(slaves_->pass(frames_[i].frame(), now_ns));
      std::ranges::copy(near_->address(), &frames_[i].bytes[6]);
      frames_[i].bytes[6] |= ethercat::kProcessedMark;
    }
    EXPECT_EQ(far_->send(std::span(frames_).first(count)), count);
    waiting_ = await(*near_, count);
    return sent;
  }
  std::size_t receive(std::span<FrameBuffer> frames) noexcept override {
    std::copy_n(frames_.begin(), waiting_, frames.begin());
    return std::exchange(waiting_, 0);
  }
  [[nodiscard]] ethercat::MacAddress address() const noexcept override { return near_->address(); }
  [[nodiscard]] hal::ecat::LinkStatistics statistics() const noexcept override {
    return near_->statistics();
  }
  std::int64_t now_ns = 0;

 private:
  std::size_t await(PacketLink& end, std::size_t count) {
    std::size_t taken = 0;
    pollfd ready{.fd = end.descriptor(), .events = POLLIN, .revents = 0};
    while (taken < count && ::poll(&ready, 1, 10'000) == 1) {
      taken += end.receive(std::span(frames_).subspan(taken, count - taken));
    }
    return taken;
  }
  PacketLink* near_;
  PacketLink* far_;
  ethercat::Medium* slaves_;
  std::vector<FrameBuffer> frames_;
  std::size_t waiting_ = 0;
};

/// A start and 50 cycles; every frame as it came to the slaves and as it left them.
template <class SetTime>
std::vector<Bytes> run(LineRig& rig, Tamper& tamper, hal::ecat::DataLink& link, SetTime set_time) {
  tamper.record = true;
  tamper.reserve(10'000);
  auto master = std::move(*hal::ecat::LineMaster::create(link, std::vector(3, rig_plan())));
  master->restart(0);
  for (int after = 0; after < 50 && rig.now_ns < 3000 * kMs;) {
    master->receive(rig.now_ns);
    set_time(rig.now_ns);
    if (master->all(hal::ecat::SlaveStage::kReady)) master->start(rig.now_ns);
    if (master->all(hal::ecat::SlaveStage::kRunning)) ++after;
    canopen::put(&master->outputs(1)[2], static_cast<std::int32_t>(rig.now_ns / kMs));
    master->send(rig.now_ns);
    rig.step();
  }
  EXPECT_TRUE(master->all(hal::ecat::SlaveStage::kRunning)) << master->text();
  tamper.frames.resize(tamper.kept);
  return tamper.frames;
}

TEST(Cable, CarriesTheSameBytesAsInProcess) {
  const int status = in_own_network([] {
    auto near = PacketLink::open(kMasterEnd);
    auto far = PacketLink::open(kSlaveEnd);
    ASSERT_TRUE(near && far);
    LineRig apart(MasterRig::setups(3)), together(MasterRig::setups(3));
    Tamper over_cable(*apart.line), in_process(*together.line);
    CableLink cable(**near, **far, over_cable);
    hal::ecat::InProcessLink link(in_process);
    const auto there = run(apart, over_cable, cable, [&](std::int64_t t) { cable.now_ns = t; });
    const auto here = run(together, in_process, link, [&](std::int64_t t) { link.set_time(t); });
    EXPECT_GT(here.size(), 500u);
    EXPECT_EQ(there, here);
  });
  if (status == kNoNetwork) GTEST_SKIP() << needs_root("a network of its own");
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace tandem::test
