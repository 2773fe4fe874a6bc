#include "base/counted.hpp"

#include <gtest/gtest.h>

namespace tandem {
namespace {

TEST(Counted, OneIsSingularAndAllElseIsPlural) {
  EXPECT_EQ(counted(0, "joint"), "0 joints");
  EXPECT_EQ(counted(1, "joint"), "1 joint");
  EXPECT_EQ(counted(29, "joint"), "29 joints");
  EXPECT_EQ(counted(1, "foot", "feet"), "1 foot");
  EXPECT_EQ(counted(4, "foot", "feet"), "4 feet");
}

}  // namespace
}  // namespace tandem
