#include "log/data_hash.hpp"

#include <string>
#include <string_view>

#include "base/sha256.hpp"

namespace tandem::log {
namespace {

using namespace std::string_view_literals;

std::span<const std::byte> bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

TEST(DataHash, IsTheSha256OfHeadsAndDigests) {
  DataHash hash;
  hash.add(2, 0x0102030405060708, bytes("\0\1\0\0abc"sv));
  hash.add(258, -1, bytes("\0\1\0\0"sv), {});
  // The digests: `printf abc | xxh128sum`, `printf '' | xxh128sum`.
  const std::string all{
      "\2\0\x08\x07\x06\x05\x04\x03\x02\x01\0\1\0\0"
      "\x06\xb0\x5a\xb6\x73\x3a\x61\x85\x78\xaf\x5f\x94\x89\x2f\x39\x50"
      "\2\1\xff\xff\xff\xff\xff\xff\xff\xff\0\1\0\0"
      "\x99\xaa\x06\xd3\x01\x47\x98\xd8\x60\x01\xc3\x24\x46\x8d\x49\x7f"sv};
  EXPECT_EQ(hash.finish(), sha256(std::string_view(all)));
}

TEST(DataHash, TakesAMessageWithoutAHeader) {  // another program's log
  DataHash shorter, empty;
  shorter.add(0, 0, bytes("ab"));
  empty.add(0, 0, {});
  EXPECT_NE(shorter.finish(), empty.finish());
}

}  // namespace
}  // namespace tandem::log
