// Our decoder and definitions against Cyclone DDS with idlc's types, and against literal bytes.
#include "dds/cdr.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/dds/raw_topic.hpp"
#include "tests/support/dds_domain.hpp"

namespace tandem::dds {
namespace {

using test::Bytes;
using test::CdrWriter;

Bytes bytes(std::initializer_list<int> values) {
  Bytes out;
  for (const int value : values) out.push_back(static_cast<std::byte>(value));
  return out;
}

const MessageDefinition& definition(const char* name) { return *find_definition(name); }

class CdrOfEveryType : public testing::Test {
 protected:
  void SetUp() override {
    auto domain = Domain::open(test::own_config());
    ASSERT_TRUE(domain) << domain.error().to_string();
    participant_ = std::move(*Participant::open(std::move(*domain), "codec"));
  }
  std::unique_ptr<Participant> participant_;
};

TEST_F(CdrOfEveryType, IsTheSameByItsDefinitionAndByItsIdl) {
  std::mt19937_64 generator(1);
  const test::Filling random{.next = [&] { return generator() % 1'000'000; },
                             .elements = [&] { return generator() % 4; }};
  for (const Type& type : types()) {
    const test::Codec codec(*participant_, type);
    for (int i = 0; i < 20; ++i) {
      const Bytes sent = CdrWriter(random).sample(*type.tree);
      const auto sample = codec.sample(sent);
      ASSERT_TRUE(sample) << type.ros_name;
      EXPECT_EQ(codec.bytes(*sample), sent) << type.ros_name;
      const auto value = decode(*type.tree, sent);
      EXPECT_TRUE(value) << value.error().to_string();
    }
  }
}

TEST_F(CdrOfEveryType, IsWrittenAsCycloneDdsDoes) {
  std::mt19937_64 generator(2);
  const test::Filling random{.next = [&] { return generator() % 1'000'000; },
                             .elements = [&] { return generator() % 4; }};
  for (const Type& type : types()) {
    EXPECT_EQ(structure_bytes(*type.tree), type.descriptor->m_size) << type.ros_name;
    const test::Codec codec(*participant_, type);
    for (int i = 0; i < 20; ++i) {
      const Bytes sent = CdrWriter(random).sample(*type.tree);
      const auto sample = codec.sample(sent);
      ASSERT_TRUE(sample) << type.ros_name;
      const std::string ours = encode(*type.tree, sample->get());
      const auto theirs = codec.bytes(*sample);
      ASSERT_EQ(ours, std::string(reinterpret_cast<const char*>(theirs.data()), theirs.size()))
          << type.ros_name;
    }
  }
}

TEST(Cdr, OfAJointStateHasItsValues) {
  const Bytes sent = bytes({0, 1, 0, 0,                                        // little endian
                            1, 0, 0, 0, 2,   0, 0,    0,                       // stamp
                            2, 0, 0, 0, 'w', 0, 0,    0,                       // frame_id, padding
                            1, 0, 0, 0, 4,   0, 0,    0,    'h', 'i', 'p', 0,  // name
                            1, 0, 0, 0,                                        // position
                            0, 0, 0, 0, 0,   0, 0xf8, 0xbf,                    // -1.5
                            0, 0, 0, 0, 0,   0, 0,    0});  // no velocity, no effort
  const auto value = decode(definition("sensor_msgs/msg/JointState"), sent);
  ASSERT_TRUE(value) << value.error().to_string();
  const Value* stamp = find(*find(*value, "header"), "stamp");
  EXPECT_EQ(std::get<std::int64_t>(find(*stamp, "sec")->of), 1);
  EXPECT_EQ(std::get<std::uint64_t>(find(*stamp, "nanosec")->of), 2u);
  EXPECT_EQ(std::get<std::string>(find(*find(*value, "header"), "frame_id")->of), "w");
  const auto& names = std::get<Value::List>(find(*value, "name")->of);
  ASSERT_EQ(names.size(), 1u);
  EXPECT_EQ(std::get<std::string>(names[0].of), "hip");
  const auto& positions = std::get<Value::List>(find(*value, "position")->of);
  ASSERT_EQ(positions.size(), 1u);
  EXPECT_EQ(std::get<double>(positions[0].of), -1.5);
  EXPECT_TRUE(std::get<Value::List>(find(*value, "effort")->of).empty());
  EXPECT_EQ(find(*value, "torque"), nullptr);
}

TEST(Cdr, MayBeBigEndian) {
  const auto value =
      decode(definition("rosgraph_msgs/msg/Clock"), bytes({0, 0, 0, 0, 0, 0, 1, 2, 0, 0, 0, 3}));
  ASSERT_TRUE(value);
  EXPECT_EQ(std::get<std::int64_t>(find(*find(*value, "clock"), "sec")->of), 258);
}

TEST(Cdr, OfARequestBeginsWithWhoAskedAndItsNumber) {
  const auto value = decode(definition("std_srvs/srv/Trigger_Request"),
                            bytes({0, 1, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0, 0}));
  ASSERT_TRUE(value) << value.error().to_string();
  EXPECT_EQ(std::get<std::uint64_t>(find(*value, "request_guid")->of), 7u);
  EXPECT_EQ(std::get<std::int64_t>(find(*value, "request_sequence")->of), 9);
}

TEST(Cdr, OfABoolIsOneForTrue) {
  for (const int byte : {0, 1}) {
    const auto value = decode(definition("std_srvs/srv/Trigger_Response"),
                              bytes({0, 1, 0, 0, 0, 0,    0, 0, 0, 0, 0, 0, 0, 0, 0,
                                     0, 0, 0, 0, 0, byte, 0, 0, 0, 1, 0, 0, 0, 0}));
    ASSERT_TRUE(value) << value.error().to_string();
    EXPECT_EQ(std::get<bool>(find(*value, "success")->of), byte == 1);
  }
}

struct Malformed {
  const char* type;
  Bytes bytes;
  const char* reason;
};

TEST(Cdr, IsRefusedWithTheReasonWhenItIsMalformed) {
  const char* string = "std_msgs/msg/String";
  const Malformed all[] = {
      {string, bytes({0, 1}), "too early"},
      {string, bytes({0, 3, 0, 0, 1, 0, 0, 0, 0}), "not plain CDR"},
      {string, bytes({0, 1, 0, 0, 1, 0}), "too early"},
      {string, bytes({0, 1, 0, 0, 0, 0, 0, 0}), "does not end"},
      {string, bytes({0, 1, 0, 0, 2, 0, 0, 0, 'a', 'b'}), "does not end"},
      {string, bytes({0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 'a', 0}), "does not end"},
      {string, bytes({0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0}), "follow its end"},
      {"tf2_msgs/msg/TFMessage", bytes({0, 1, 0, 0, 0xff, 0xff, 0xff, 0x7f}), "more elements"},
      {"std_srvs/srv/Trigger_Response", bytes({0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
                                               0, 0, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 0}),
       "neither 0 nor 1"},
  };
  for (const Malformed& one : all) {
    const auto value = decode(definition(one.type), one.bytes);
    ASSERT_FALSE(value) << one.reason;
    EXPECT_NE(value.error().message.find(one.reason), std::string::npos) << value.error().message;
    EXPECT_NE(value.error().message.find(one.type), std::string::npos) << value.error().message;
  }
}

/// What Cyclone DDS lets through to a reader, our decoder understands, and the other way round.
/// Only bytes beyond the end are passed over by Cyclone DDS.
TEST_F(CdrOfEveryType, IsMalformedForBothOrForNeither) {
  std::mt19937_64 generator(2);
  const test::Filling few{.next = [&] { return generator() % 100; },
                          .elements = [&] { return generator() % 3; }};
  std::size_t refused = 0, taken = 0;
  for (const Type& type : types()) {
    const test::Codec codec(*participant_, type);
    for (int i = 0; i < 300; ++i) {
      Bytes mutated = CdrWriter(few).sample(*type.tree);
      const std::size_t at = 4 + generator() % (mutated.size() - 4);
      if (i % 3 == 0) {
        mutated.resize(at / 4 * 4);
      } else {
        mutated[at] = static_cast<std::byte>(generator());
      }
      const auto value = decode(*type.tree, mutated);
      if (!value && value.error().message.ends_with("follow its end")) continue;
      ddsi_serdata* accepted = codec.accept(mutated);
      EXPECT_EQ(accepted != nullptr, value.has_value())
          << type.ros_name << " " << i << ": " << (value ? "" : value.error().message);
      (value ? taken : refused) += 1;
      if (accepted != nullptr) ddsi_serdata_unref(accepted);
    }
  }
  EXPECT_GT(refused, 1000u);
  EXPECT_GT(taken, 1000u);
}

}  // namespace
}  // namespace tandem::dds
