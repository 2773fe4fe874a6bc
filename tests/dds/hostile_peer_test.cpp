// Peers that mean harm, or are broken: malformed samples, garbage, floods.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <random>
#include <vector>

#include "dds/cdr.hpp"
#include "dds/endpoint.hpp"
#include "tests/dds/fastdds.hpp"
#include "tests/dds/raw_topic.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::dds {
namespace {

using tandem::test::eventually;
using test::Bytes;

void append(Bytes& out, std::initializer_list<int> bytes) {
  for (const int byte : bytes) out.push_back(static_cast<std::byte>(byte));
}

/// An RTPS message with one sample, as if the writer of `guid` had sent it (RTPS 2.3, 9.4).
Bytes rtps_data(const dds_guid_t& guid, std::uint32_t sequence, const Bytes& payload) {
  Bytes out;
  append(out, {'R', 'T', 'P', 'S', 2, 3, 1, 15});  // version, vendor
  for (int i = 0; i < 12; ++i) append(out, {guid.v[i]});
  const std::size_t size = 20 + payload.size();
  append(out, {0x15, 0x05, static_cast<int>(size & 0xff), static_cast<int>(size >> 8)});
  append(out, {0, 0, 16, 0, 0, 0, 0, 0});  // no flags, where the payload begins, any reader
  for (int i = 12; i < 16; ++i) append(out, {guid.v[i]});
  append(out, {0, 0, 0, 0});
  for (int i = 0; i < 32; i += 8) append(out, {static_cast<int>(sequence >> i & 0xff)});
  out.insert(out.end(), payload.begin(), payload.end());
  return out;
}

/// Sends to every socket that the participants of this process may have.
class Sender {
 public:
  Sender() : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Sender() { ::close(socket_); }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  /// @param offset  10: where discovery is heard, 11: where samples are
  void send(const Bytes& message, int offset) const {
    for (int index = 0; index < 4; ++index) {
      sockaddr_in to{};
      to.sin_family = AF_INET;
      to.sin_port =
          htons(static_cast<std::uint16_t>(7400 + 250 * test::own_domain() + offset + 2 * index));
      to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      ::sendto(socket_, message.data(), message.size(), 0, reinterpret_cast<sockaddr*>(&to),
               sizeof to);
    }
  }

 private:
  int socket_;
};

class HostilePeer : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::have_fastdds()) GTEST_SKIP() << test::kNoFastDds;
    auto domain = Domain::open(test::own_config());
    ASSERT_TRUE(domain) << domain.error().to_string();
    participant_ = std::move(*Participant::open(std::move(*domain), "victim"));
  }

  [[nodiscard]] RawEndpoint reader(const Type& type, const std::string& topic,
                                   bool reliable) const {
    return std::move(*RawEndpoint::create(EndpointKind::kReader, participant_->get(), type, topic,
                                          {.reliable = reliable, .user_data = {}}));
  }

  /// The one writer that the reader is connected to, once there is one.
  static dds_guid_t writer_of(dds_entity_t reader) {
    dds_instance_handle_t handle = 0;
    EXPECT_TRUE(eventually([&] { return dds_get_matched_publications(reader, &handle, 1) == 1; }));
    dds_builtintopic_endpoint_t* told = dds_get_matched_publication_data(reader, handle);
    const dds_guid_t guid = told->key;
    dds_builtintopic_free_endpoint(told);
    return guid;
  }

  std::unique_ptr<Participant> participant_;
};

TEST_F(HostilePeer, WithMalformedSamplesIsNotHeardAndDoesNoHarm) {
  const Type& type = dds::type<sensor_msgs::JointState>();
  const RawEndpoint target = reader(type, "rt/joint_states", false);
  const RawEndpoint alive = reader(dds::type<std_msgs::String>(), "rt/alive", true);
  const test::FastDdsPeer peer({"say", "best_effort", "sensor_msgs/msg/JointState",
                                "rt/joint_states", "say", "reliable", "std_msgs/msg/String",
                                "rt/alive"});
  const dds_guid_t guid = writer_of(target.entity.get());
  ASSERT_TRUE(eventually([&] { return !test::take_bytes(target.entity.get()).empty(); }));

  const Sender sender;
  std::mt19937_64 generator(3);
  std::uint32_t sequence = 1'000'000;
  std::vector<Bytes> well;
  std::size_t malformed = 0, heard = 0;
  const auto hear = [&] {
    for (const Bytes& bytes : test::take_bytes(target.entity.get())) {
      EXPECT_TRUE(std::ranges::find(well, bytes) != well.end())
          << "a sample that nobody sent, or that is malformed";
      ++heard;
    }
  };
  const Bytes pattern = test::CdrWriter(test::pattern()).sample(*type.tree);
  well.push_back(pattern);
  for (int i = 0; i < 2000; ++i) {
    Bytes payload = pattern;
    const std::size_t word = 4 + generator() % (payload.size() / 4 - 1) * 4;
    switch (i % 4) {
      case 0: payload.resize(word); break;                                        // cut off
      case 1: std::memset(&payload[word], 0xff, 4); break;                        // a huge length
      case 2: payload[1] = static_cast<std::byte>(2 + generator() % 250); break;  // an encoding
      default: payload[word] = static_cast<std::byte>(generator());
    }
    payload.resize((payload.size() + 3) / 4 * 4);
    if (decode(*type.tree, payload)) {
      well.push_back(payload);
    } else {
      ++malformed;
    }
    sender.send(rtps_data(guid, ++sequence, payload), 11);
    if (i % 10 == 0) hear();
  }
  EXPECT_GT(malformed, 1000u);
  const std::size_t before = heard;
  EXPECT_TRUE(eventually([&] {
    sender.send(rtps_data(guid, ++sequence, pattern), 11);
    hear();
    return heard > before;
  })) << "what is well-formed is heard as before";
  test::take_bytes(alive.entity.get());
  EXPECT_TRUE(eventually([&] { return !test::take_bytes(alive.entity.get()).empty(); }));
}

TEST_F(HostilePeer, WithGarbageForMessagesDoesNoHarm) {
  const Type& type = dds::type<std_msgs::String>();
  const RawEndpoint alive = reader(type, "rt/alive", true);
  const test::FastDdsPeer peer({"say", "reliable", "std_msgs/msg/String", "rt/alive"});
  const dds_guid_t guid = writer_of(alive.entity.get());
  const Sender sender;
  std::mt19937_64 generator(4);
  const Bytes whole =
      rtps_data(guid, 2'000'000, test::CdrWriter(test::pattern()).sample(*type.tree));
  for (int i = 0; i < 3000; ++i) {
    Bytes message = whole;
    // All but who it is from: the sixteen submessages, their lengths, their flags, their content.
    for (int changes = 0; changes < 1 + i % 8; ++changes) {
      message[20 + generator() % (message.size() - 20)] = static_cast<std::byte>(generator());
    }
    message[20] = static_cast<std::byte>(generator() % 0x40);
    if (i % 5 == 0) message.resize(4 + generator() % message.size());
    if (i % 7 == 0) message.resize(8000, static_cast<std::byte>(generator()));
    sender.send(message, 10 + i % 2);
  }
  test::take_bytes(alive.entity.get());
  // A new topic: discovery works, too.
  const RawEndpoint later = reader(type, "rt/later", true);
  const test::FastDdsPeer other({"say", "reliable", "std_msgs/msg/String", "rt/later"});
  EXPECT_TRUE(eventually([&] { return !test::take_bytes(later.entity.get()).empty(); }));
}

std::size_t resident_bytes() {
  std::size_t size = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> size >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

#ifdef __has_feature
#define TANDEM_HAS_FEATURE(x) __has_feature(x)
#else
#define TANDEM_HAS_FEATURE(x) 0
#endif

TEST_F(HostilePeer, ThatFloodsTakesNoMoreMemoryThanTheDepthOfTheHistory) {
#if defined(__SANITIZE_ADDRESS__) || TANDEM_HAS_FEATURE(address_sanitizer)
  GTEST_SKIP() << "AddressSanitizer holds freed memory back";
#endif
  const Type& type = dds::type<std_msgs::String>();
  const RawEndpoint target = reader(type, "rt/flood", true);  // its depth is 10: 0.6 MB
  const test::FastDdsPeer peer({"flood", "reliable", "std_msgs/msg/String", "rt/flood"});
  // Nobody takes the samples; the number at the beginning of the last one says how many came.
  const auto flooded = [&] {
    void* samples[16]{};
    dds_sample_info_t infos[16];
    const int count = dds_read(target.entity.get(), samples, infos, 16, 16);
    if (count <= 0) return 0ul;
    const auto& last = *static_cast<const std_msgs::String*>(samples[count - 1]);
    const unsigned long number = std::stoul(last.data);
    dds_return_loan(target.entity.get(), samples, count);
    return number;
  };
  ASSERT_TRUE(eventually([&] { return flooded() > 200; }));  // buffers have their size by now
  const std::size_t before = resident_bytes();
  ASSERT_TRUE(eventually([&] { return flooded() > 4000; }));  // 240 MB
  const std::size_t after = resident_bytes();
  std::printf("%lu samples of 60 kB: resident memory from %zu to %zu MB\n", flooded(), before >> 20,
              after >> 20);
  EXPECT_LT(after, before + (48u << 20));
}

TEST_F(HostilePeer, WithAHugeSampleIsNotHeard) {
  const Type& type = dds::type<std_msgs::String>();
  const RawEndpoint target = reader(type, "rt/huge", true);
  const RawEndpoint alive = reader(type, "rt/alive", true);
  const std::size_t before = resident_bytes();
  const test::FastDdsPeer peer({"huge", "reliable", "std_msgs/msg/String", "rt/huge", "say",
                                "reliable", "std_msgs/msg/String", "rt/alive"});
  writer_of(target.entity.get());
  std::size_t heard = 0;
  EXPECT_TRUE(eventually([&] {
    heard += test::take_bytes(alive.entity.get()).size();
    return heard >= 10;
  }));
  EXPECT_TRUE(test::take_bytes(target.entity.get()).empty());
  EXPECT_LT(resident_bytes(), before + (48u << 20));
}

}  // namespace
}  // namespace tandem::dds
