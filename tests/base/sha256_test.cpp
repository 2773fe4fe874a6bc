#include "base/sha256.hpp"

namespace tandem {
namespace {

std::span<const std::byte> bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

TEST(Sha256, GivesTheStandardsExamples) {  // FIPS 180-4, examples
  EXPECT_EQ(sha256(bytes("abc")),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST(Sha256, DependsOnTheBytesNotOnThePieces) {
  Sha256 pieces;
  pieces.update(bytes("a"));
  pieces.update(bytes("bc"));
  EXPECT_EQ(pieces.finish(), sha256(bytes("abc")));
}

}  // namespace
}  // namespace tandem
