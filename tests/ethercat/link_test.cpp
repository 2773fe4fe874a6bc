// Links: in process with lost, late and doubled frames, and a raw socket over a virtual cable.
#include <gtest/gtest.h>

#include <linux/capability.h>
#include <poll.h>
#include <sys/syscall.h>

#include <array>
#include <cstdlib>

#include "hal/ethercat-can/line/in_process_link.hpp"
#include "hal/ethercat-can/line/packet_link.hpp"
#include "tests/ethercat/line_rig.hpp"
#include "tests/ethercat/own_network.hpp"
#include "tests/support/needs_root.hpp"

namespace tandem::test {
namespace {

using hal::ecat::FrameBuffer;
using hal::ecat::FrameFate;
using hal::ecat::InProcessLink;
using hal::ecat::PacketLink;

/// A frame that counts slaves, marked with `index`.
FrameBuffer count_slaves(std::uint8_t index) {
  FrameBuffer frame;
  ethercat::FrameWriter writer;
  writer.begin(frame.bytes, kMaster);
  (void)writer.add(ethercat::Command::kBrd, index, 0, 1);
  frame.size = writer.finish();
  return frame;
}

/// Index and working counter of each frame that has come.
std::vector<std::pair<int, int>> come(hal::ecat::DataLink& link) {
  std::vector<std::pair<int, int>> all;
  std::vector<FrameBuffer> frames(8);
  const std::size_t count = link.receive(frames);
  for (std::size_t i = 0; i < count; ++i) {
    ethercat::FrameReader reader(frames[i].frame());
    ethercat::Datagram datagram;
    if (reader.next(datagram)) all.emplace_back(datagram.index(), datagram.working_counter());
  }
  return all;
}

TEST(LinkStatistics, CountBytesOfWire) {
  EXPECT_EQ(ethercat::wire_bytes(1514), 1538U);
  EXPECT_EQ(ethercat::wire_bytes(61), 85U);
  EXPECT_EQ(ethercat::wire_bytes(28), 84U) << "the shortest frame";
  LineRig rig(1);
  InProcessLink link(*rig.line);
  const std::array<FrameBuffer, 2> frames{count_slaves(0), count_slaves(1)};
  (void)link.send(frames);
  EXPECT_EQ(link.statistics().sent_bytes, 168U);
  EXPECT_EQ(link.statistics().received_bytes, 0U);
  std::array<FrameBuffer, 4> came;
  EXPECT_EQ(link.receive(came), 2U);
  EXPECT_EQ(link.statistics().received_bytes, 168U);
}

/// Takes away every right of root from this process.
void drop_rights() {
  __user_cap_header_struct header{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  std::array<__user_cap_data_struct, 2> none{};
  EXPECT_EQ(::syscall(SYS_capset, &header, none.data()), 0);
}

/// Waits for `count` frames; fewer when no more come.
std::vector<FrameBuffer> await(PacketLink& link, std::size_t count) {
  std::vector<FrameBuffer> frames(count + 8);
  std::size_t taken = 0;
  pollfd ready{.fd = link.descriptor(), .events = POLLIN, .revents = 0};
  while (taken < count && ::poll(&ready, 1, 10'000) == 1) {
    taken += link.receive(std::span(frames).subspan(taken));
  }
  frames.resize(taken);
  return frames;
}

using Came = std::vector<std::pair<int, int>>;

TEST(InProcessLink, PassesFramesThroughTheSlavesAtOnce) {
  LineRig rig(3);
  InProcessLink link(*rig.line);
  const std::array frames{count_slaves(1), count_slaves(2)};
  EXPECT_EQ(link.send(frames), 2u);
  EXPECT_EQ(come(link), (Came{{1, 3}, {2, 3}}));
  EXPECT_EQ(come(link), Came{});
  EXPECT_EQ(link.statistics().received, 2u);
}

TEST(InProcessLink, DoesToFramesWhatATestSays) {
  LineRig rig(1);
  InProcessLink link(*rig.line);
  const auto send = [&](std::uint8_t index) {
    const std::array frame{count_slaves(index)};
    link.send(frame);
  };
  link.set_fate(FrameFate::kLoseBefore, 1);
  send(1);
  send(2);
  link.set_fate(FrameFate::kLoseAfter, 1);
  send(3);
  link.set_fate(FrameFate::kTwice, 1);
  send(4);
  link.set_fate(FrameFate::kLate, 1);
  send(5);
  send(6);
  EXPECT_EQ(come(link), (Came{{2, 1}, {4, 1}, {4, 1}, {6, 1}, {5, 1}}));
}

TEST(PacketLink, NamesAnInterfaceThatIsNotThere) {
  const auto link = PacketLink::open("no_such_card");
  ASSERT_FALSE(link.has_value());
  const std::string text = link.error().to_string();
  EXPECT_NE(text.find("no_such_card"), std::string::npos) << text;
  EXPECT_TRUE(text.find("no such interface") != std::string::npos ||
              text.find("CAP_NET_RAW") != std::string::npos)
      << text;
  EXPECT_FALSE(PacketLink::open("a_name_that_is_too_long").has_value());
}

TEST(PacketLink, SaysWhatIsMissing) {
  const int status = in_own_network([] {
    const auto text = [](const char* interface) {
      const auto link = PacketLink::open(interface);
      return link ? std::string("open") : link.error().to_string();
    };
    EXPECT_NE(text("nothing").find("nothing: there is no such interface"), std::string::npos);
    EXPECT_NE(text("lo").find("lo: is no Ethernet interface"), std::string::npos);
    EXPECT_EQ(std::system("ip link set ecat_s down"), 0);
    EXPECT_NE(text(kSlaveEnd).find("ecat_s: is down (sudo ip link set ecat_s up)"),
              std::string::npos);
    EXPECT_NE(text(kMasterEnd).find("ecat_m: has no link"), std::string::npos);
    drop_rights();
    EXPECT_NE(text(kMasterEnd).find("CAP_NET_RAW"), std::string::npos) << text(kMasterEnd);
  });
  if (status == kNoNetwork) GTEST_SKIP() << needs_root("a network of its own");
  EXPECT_EQ(status, 0);
}

TEST(PacketLink, CarriesManyFramesOverACable) {
  const int status = in_own_network([] {
    auto master = PacketLink::open(kMasterEnd);
    auto slaves = PacketLink::open(kSlaveEnd);
    ASSERT_TRUE(master && slaves);
    LineRig rig(2);
    std::vector<FrameBuffer> frames(40);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      frames[i] = count_slaves(static_cast<std::uint8_t>(i));
    }
    EXPECT_EQ((*master)->send(frames), 40u);
    std::vector<FrameBuffer> passing = await(**slaves, 40);
    ASSERT_EQ(passing.size(), 40u);
    for (FrameBuffer& frame : passing) EXPECT_TRUE(rig.line->pass(frame.frame(), 0));
    EXPECT_EQ((*slaves)->send(passing), 40u);
    std::vector<FrameBuffer> back = await(**master, 40);
    ASSERT_EQ(back.size(), 40u) << "its own frames do not come back to it";
    EXPECT_EQ(back[39].bytes[17], 39);
    EXPECT_EQ(back[39].bytes[6] & ethercat::kProcessedMark, ethercat::kProcessedMark);
    EXPECT_EQ((*master)->address()[0] & ethercat::kProcessedMark, 0);
  });
  if (status == kNoNetwork) GTEST_SKIP() << needs_root("a network of its own");
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace tandem::test
