// A slave's information memory, built and read against literal bytes.
#include "ethercat/sii.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace tandem::ethercat::sii {
namespace {

Content example() {
  return {.identity = {.vendor = 0x11223344, .product = 5, .revision = 6, .serial = 7},
          .alias = 0,
          .mailbox = {.out_start = 0x1000, .out_bytes = 128, .in_start = 0x1080, .in_bytes = 128},
          .protocols = kProtocolCoe,
          .name = "board",
          .managers = {{0x1000, 128, kControlMailboxOut, true, SyncManagerUse::kMailboxOut},
                       {0x1080, 128, kControlMailboxIn, true, SyncManagerUse::kMailboxIn},
                       {0x1100, 12, kControlOutputs, true, SyncManagerUse::kOutputs},
                       {0x1400, 16, kControlInputs, true, SyncManagerUse::kInputs}}};
}

TEST(Sii, CheckSumIsThatOfTheStandardsPolynomial) {
  // CRC-8, polynomial 07, start FF: "123456789" gives FB (a common table's check value).
  const std::vector<std::uint8_t> digits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(check_sum(digits), 0xFB);
}

TEST(Sii, HasIdentityMailboxAndCategoriesAtTheirWords) {
  const std::vector<std::uint8_t> bytes = build(example());
  const auto at = [&](std::size_t word, std::size_t count) {
    return std::vector<std::uint8_t>(bytes.begin() + static_cast<long>(2 * word),
                                     bytes.begin() + static_cast<long>(2 * word + count));
  };
  using Bytes = std::vector<std::uint8_t>;
  EXPECT_EQ(at(8, 16), (Bytes{0x44, 0x33, 0x22, 0x11, 5, 0, 0, 0, 6, 0, 0, 0, 7, 0, 0, 0}));
  EXPECT_EQ(at(0x18, 10), (Bytes{0x00, 0x10, 0x80, 0x00, 0x80, 0x10, 0x80, 0x00, 0x04, 0x00}));
  // Strings: type 10, 4 words: one string of five letters, filled up.
  EXPECT_EQ(at(0x40, 12), (Bytes{10, 0, 4, 0, 1, 5, 'b', 'o', 'a', 'r', 'd', 0}));
  // General: type 30, 16 words; then FMMU: type 40, 2 words.
  EXPECT_EQ(at(0x46, 8), (Bytes{30, 0, 16, 0, 0, 0, 0, 1}));
  EXPECT_EQ(at(0x58, 8), (Bytes{40, 0, 2, 0, 1, 2, 3, 0}));
  EXPECT_EQ(at(0x5C, 12), (Bytes{41, 0, 16, 0, 0x00, 0x10, 0x80, 0x00, 0x26, 0, 1, 1}));
  EXPECT_EQ(at(0x6A, 8), (Bytes{0x00, 0x14, 0x10, 0x00, 0x20, 0, 1, 4}));
  EXPECT_EQ(at(0x6E, 4), (Bytes{0xFF, 0xFF, 0xFF, 0xFF}));
}

TEST(Sii, WhatIsBuiltIsReadBack) {
  Content read;
  EXPECT_EQ(parse(build(example()), read), LineError::kNone);
  EXPECT_EQ(read, example());
}

TEST(Sii, OneThatIsCutAnywhereIsRefused) {
  const std::vector<std::uint8_t> whole = build(example());
  Content read;
  for (std::size_t size = 0; size + 2 < whole.size(); ++size) {  // two bytes of the end suffice
    EXPECT_NE(parse({whole.data(), size}, read), LineError::kNone) << size;
  }
}

TEST(Sii, EachKindOfErrorIsNamed) {
  Content read;
  std::vector<std::uint8_t> bytes = build(example());
  bytes[0] ^= 1;
  EXPECT_EQ(parse(bytes, read), LineError::kSiiCheckSum);
  bytes = build(example());
  bytes[0x81] = 0x7F;  // another type
  bytes[0x82] = 0xFF;  // longer than all
  EXPECT_EQ(parse(bytes, read), LineError::kSiiCategory);
  bytes = build(example());
  bytes[0x85] = 40;  // the string
  EXPECT_EQ(parse(bytes, read), LineError::kSiiContent);
  EXPECT_STREQ(to_string(LineError::kSiiTooShort), "the SII is too short");
}

TEST(Sii, EmptyMemoryOfAChipFromTheFactoryIsRefused) {
  Content read;
  EXPECT_NE(parse(std::vector<std::uint8_t>(512, 0xFF), read), LineError::kNone);
  EXPECT_NE(parse(std::vector<std::uint8_t>(512, 0x00), read), LineError::kNone);
}

}  // namespace
}  // namespace tandem::ethercat::sii
