#include "log/compression.hpp"

namespace tandem::log {
namespace {

Bytes sample(std::size_t size) {
  Bytes data(size);
  for (std::size_t i = 0; i < size; ++i) data[i] = static_cast<std::byte>((i * i) >> 7);
  return data;
}

class EveryCompression : public testing::TestWithParam<Compression> {};

TEST_P(EveryCompression, GivesBackWhatItTook) {
  for (const std::size_t size : {0U, 1U, 1000U, 5'000'000U}) {
    const Bytes data = sample(size);
    Bytes packed;
    Bytes back;
    compress(GetParam(), data, packed);
    const Status done = decompress(GetParam(), packed, size, back);
    ASSERT_TRUE(done) << done.error().to_string();
    EXPECT_TRUE(back == data) << size;
  }
}

TEST_P(EveryCompression, RefusesCutAndWronglySizedData) {
  const Bytes data = sample(10'000);
  Bytes packed;
  Bytes back;
  compress(GetParam(), data, packed);
  EXPECT_FALSE(decompress(GetParam(), std::span(packed).first(packed.size() / 2), 10'000, back));
  EXPECT_FALSE(decompress(GetParam(), packed, 9'999, back));
  EXPECT_FALSE(decompress(GetParam(), packed, std::uint64_t{1} << 40, back));
  Bytes room;  // a chunk of 200 bytes took a GiB of memory before its content was looked at
  EXPECT_FALSE(decompress(GetParam(), std::span(packed).first(200), std::uint64_t{1} << 30, room));
  EXPECT_LT(room.capacity(), std::size_t{1} << 24);
}

INSTANTIATE_TEST_SUITE_P(All, EveryCompression,
                         testing::Values(Compression::kNone, Compression::kLz4,
                                         Compression::kZstd));

TEST(Compression, KnowsMcapsNames) {
  EXPECT_EQ(compression_of("lz4"), Compression::kLz4);
  EXPECT_EQ(compression_of(""), Compression::kNone);
  EXPECT_FALSE(compression_of("brotli"));
}

}  // namespace
}  // namespace tandem::log
