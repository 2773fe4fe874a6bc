#include "canopen/object_dictionary.hpp"

#include <cmath>
#include <limits>

namespace tandem::canopen {
namespace {

struct Dictionary : testing::Test {
  std::int32_t position = -1;
  std::uint16_t word = 0x1234;
  float stiffness = 1.0f;
  ObjectDictionary od{8};

  void SetUp() override {
    ASSERT_TRUE(od.add(0x6064, 0, position, kReadTpdo));
    ASSERT_TRUE(od.add(0x2010, 0, stiffness, kWriteRpdo, {0.0, 100.0}));
    ASSERT_TRUE(od.add(0x6040, 0, word, kWriteRpdo));
    ASSERT_TRUE(od.add_value<std::uint8_t>(0x1018, 0, 4));
    ASSERT_TRUE(od.add_value<std::uint32_t>(0x1018, 1, 0xAABBCCDD));
    ASSERT_TRUE(od.add_value<std::uint8_t>(0x2FFF, 0, 0, kWrite));
    ASSERT_TRUE(od.add_string(0x1008, 0, "leg"));
  }
  AbortCode write(std::uint16_t index, std::uint8_t sub, std::vector<std::uint8_t> bytes) {
    return od.write(index, sub, bytes);
  }
  std::vector<int> read(std::uint16_t index, std::uint8_t sub) {
    std::array<std::uint8_t, 16> bytes{};
    std::size_t length = 0;
    EXPECT_EQ(od.read(index, sub, bytes, length), AbortCode::kNone);
    return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length)};
  }
};

TEST_F(Dictionary, ReadsVariablesLittleEndian) {
  EXPECT_EQ(read(0x6064, 0), (std::vector<int>{0xFF, 0xFF, 0xFF, 0xFF}));
  EXPECT_EQ(read(0x1018, 1), (std::vector<int>{0xDD, 0xCC, 0xBB, 0xAA}));
  EXPECT_EQ(read(0x1008, 0), (std::vector<int>{'l', 'e', 'g'}));
}

TEST_F(Dictionary, WritesVariables) {
  EXPECT_EQ(write(0x6040, 0, {0x0F, 0x01}), AbortCode::kNone);
  EXPECT_EQ(word, 0x010F);
  EXPECT_EQ(write(0x2010, 0, {0x00, 0x00, 0x20, 0x41}), AbortCode::kNone);
  EXPECT_EQ(stiffness, 10.0f);
}

TEST_F(Dictionary, RefusesWithTheStandardsAbortCodes) {
  EXPECT_EQ(write(0x6064, 0, {0, 0, 0, 0}), AbortCode::kReadOnly);
  EXPECT_EQ(write(0x7000, 0, {0}), AbortCode::kNoObject);
  EXPECT_EQ(write(0x1018, 9, {0}), AbortCode::kNoSubIndex);
  EXPECT_EQ(write(0x6040, 0, {0}), AbortCode::kTooShort);
  EXPECT_EQ(write(0x6040, 0, {0, 0, 0}), AbortCode::kTooLong);
  EXPECT_EQ(write(0x2010, 0, {0x00, 0x00, 0x80, 0xBF}), AbortCode::kTooLow);
  EXPECT_EQ(write(0x2010, 0, {0x00, 0x00, 0x80, 0x43}), AbortCode::kTooHigh);
  EXPECT_EQ(write(0x2010, 0, {0x00, 0x00, 0xC0, 0x7F}), AbortCode::kRange);  // NaN
  EXPECT_EQ(stiffness, 1.0f);
  std::array<std::uint8_t, 2> small{};
  std::size_t length = 0;
  EXPECT_EQ(od.read(0x2FFF, 0, small, length), AbortCode::kWriteOnly);
  EXPECT_EQ(od.read(0x6064, 0, small, length), AbortCode::kOutOfMemory);
}

TEST_F(Dictionary, TakesEveryFloatWhereNoRangeIsGiven) {
  float gain = 0.0f;
  ASSERT_TRUE(od.add(0x2011, 0, gain, kWriteRpdo));
  EXPECT_EQ(write(0x2011, 0, {0xFF, 0xFF, 0x7F, 0x7F}), AbortCode::kNone);
  EXPECT_EQ(gain, std::numeric_limits<float>::max());
  EXPECT_EQ(write(0x2011, 0, {0xFF, 0xFF, 0x7F, 0xFF}), AbortCode::kNone);
  EXPECT_EQ(gain, std::numeric_limits<float>::lowest());
}

TEST_F(Dictionary, RefusesTheSameEntryTwiceAndMoreThanItsCapacity) {
  EXPECT_FALSE(od.add(0x6064, 0, position, kRead));
  EXPECT_TRUE(od.add_value<std::uint8_t>(0x3000, 0, 1));
  EXPECT_FALSE(od.add_value<std::uint8_t>(0x3000, 1, 1));
}

TEST_F(Dictionary, ArchivesTheValuesThatItHolds) {
  Archive saved;
  od.archive(saved);
  ASSERT_EQ(write(0x2FFF, 0, {7}), AbortCode::kNone);
  Archive restore(saved.bytes());
  od.archive(restore);
  EXPECT_TRUE(restore.ok() && restore.at_end());
  EXPECT_EQ(od.value<std::uint8_t>(0x2FFF, 0), 0);
}

TEST(AbortCodes, AreSaidInWords) {
  EXPECT_STREQ(to_string(AbortCode::kNoObject), "object does not exist");
  EXPECT_STREQ(to_string(static_cast<AbortCode>(0x12345678)), "unknown abort code");
}

}  // namespace
}  // namespace tandem::canopen
