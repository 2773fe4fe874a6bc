#include "dds/message_definition.hpp"

#include <gtest/gtest.h>

#include "dds/types.hpp"

namespace tandem::dds {
namespace {

TEST(MessageDefinition, OfStringHasThePublishedHash) {
  EXPECT_EQ(type<std_msgs::String>().hash,
            "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18");
  EXPECT_EQ(type<sensor_msgs::JointState>().hash,
            "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e");
}

}  // namespace
}  // namespace tandem::dds
