#include "runtime/run_identity.hpp"

#include <gtest/gtest.h>

#include <array>

namespace tandem::runtime {
namespace {

RunIdentity identity(std::string_view robot, std::string_view seed) {
  RunIdentity all;
  all.add("robot", robot);
  all.add("seed", seed);
  return all;
}

TEST(RunIdentity, NamesTheFirstPartThatIsNotTheSame) {
  const RunIdentity own = identity("arm", "1");
  EXPECT_EQ(own.difference(identity("arm", "1")), "");
  EXPECT_EQ(own.difference(identity("arm", "2")), "seed");
  EXPECT_EQ(own.difference(identity("leg", "2")), "robot");
  EXPECT_EQ(own.difference({}), "robot");
  EXPECT_EQ(RunIdentity().difference(own), "robot");
}

TEST(RunIdentity, TellsPiecesFromTheirSum) {
  RunIdentity one, other;
  one.add("a", "xy");
  one.add("a", "z");
  other.add("a", "x");
  other.add("a", "yz");
  EXPECT_EQ(one.difference(other), "a");
}

TEST(RunIdentity, IsReadAsItWasWrittenAndFromBytesOfAnybody) {
  RunIdentity own = identity("arm", "1");
  own.add(std::string(200, 'n'), "a name that is too long is cut");
  Archive saved;
  saved(own);
  RunIdentity read;
  Archive back(saved.bytes());
  back(read);
  EXPECT_TRUE(back.ok() && back.at_end());
  EXPECT_EQ(own.difference(read), "");
  for (const std::uint8_t byte : std::array<std::uint8_t, 3>{0x00, 0x7F, 0xFF}) {
    std::array<std::byte, 24> bytes{};
    bytes.fill(std::byte{byte});
    Archive bad(bytes);
    bad(read);
    EXPECT_NE(own.difference(read), "");
  }
}

}  // namespace
}  // namespace tandem::runtime
