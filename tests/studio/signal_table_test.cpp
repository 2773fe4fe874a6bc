// Names, ids and numbers of a run's images.
#include "studio/signal_table.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "hal/signal_block.hpp"
#include "log/signal_name.hpp"

namespace tandem::studio {
namespace {

log::RunInfo two_joints() {
  log::RunInfo info;
  info.joints = {"hip", "knee"};
  info.sensors = {{"sole", 6}};
  return info;
}

hal::ImageShape two_joints_shape() { return {.joints = 2, .sensor_channels = {6}}; }

TEST(StudioSignals, AreNamedAsInTheLog) {
  const hal::StateImage state(two_joints_shape());
  const hal::CommandImage command(two_joints_shape());
  SignalTable table(two_joints());
  ASSERT_TRUE(table.add("state", state.layout()));
  ASSERT_TRUE(table.add("command", command.layout()));
  SignalId id = 0;
  for (const auto& [name, layout] :
       {std::pair("state", &state.layout()), std::pair("command", &command.layout())}) {
    for (const hal::Field& field : layout->fields()) {
      for (std::size_t i = 0; i < field.count; ++i, ++id) {
        EXPECT_EQ(table.name(id),
                  std::string(name) + "." + log::signal_name(field, i, two_joints()));
      }
    }
  }
  EXPECT_EQ(table.size(), id);
  EXPECT_EQ(table.name(id), "");
  const SourceField& position = table.sources()[0].fields[2];
  EXPECT_EQ(position.name, "position_rad");
  EXPECT_EQ(position.unit, "rad or m");
  EXPECT_EQ(position.doc, "link side, positive about the joint's +axis");
  EXPECT_EQ(position.elements, (std::vector<std::string>{"hip", "knee"}));
}

TEST(StudioSignals, ConvertEveryTypeOfNumber) {
  hal::StateImage state(two_joints_shape());
  state.cycle()[0] = 77;
  state.time_ns()[0] = -5;
  state.position_rad()[1] = 0.25;
  state.sensor()[5] = -3.5;
  state.fault()[0] = 0x8611;
  state.statusword()[1] = 0x1237;
  state.mode()[0] = -2;
  state.drive_state()[1] = 5;
  SignalTable table(two_joints());
  ASSERT_TRUE(table.add("state", state.layout()));
  std::vector<float> row(table.size(), -1.0F);
  table.convert(0, state.bytes(), row);
  const auto value = [&](const std::string& name) {
    for (SignalId id = 0; id < table.size(); ++id) {
      if (table.name(id) == "state." + name) return row[id];
    }
    ADD_FAILURE() << name;
    return 0.0F;
  };
  EXPECT_EQ(value("cycle"), 77.0F);
  EXPECT_EQ(value("time_ns"), -5.0F);
  EXPECT_EQ(value("position_rad.knee"), 0.25F);
  EXPECT_EQ(value("sensor.sole.tz_Nm"), -3.5F);
  EXPECT_EQ(value("fault.hip"), 34321.0F);
  EXPECT_EQ(value("statusword.knee"), 4663.0F);
  EXPECT_EQ(value("mode.hip"), -2.0F);
  EXPECT_EQ(value("drive_state.knee"), 5.0F);
}

hal::Layout layout_of(std::size_t count) {
  hal::SignalBlock block;
  EXPECT_NE(block.declare("error", "rad", "of the knee", count, count == 2), nullptr);
  EXPECT_TRUE(block.close());
  return block.layout();
}

TEST(StudioSignals, HaveTheirIdsAgainWhenTheSameControllerComesBack) {
  SignalTable table(two_joints());
  const auto first = table.add("controller/a", layout_of(2));
  const std::size_t size = table.size();
  ASSERT_TRUE(first);
  EXPECT_EQ(table.name(2), "controller/a.error.hip");
  table.remove(*first);
  EXPECT_FALSE(table.sources()[0].there);
  const auto again = table.add("controller/a", layout_of(2));
  ASSERT_TRUE(again);
  EXPECT_EQ(*again, *first);
  EXPECT_EQ(table.size(), size);
  table.remove(*again);
  const auto other = table.add("controller/a", layout_of(3));
  ASSERT_TRUE(other);
  EXPECT_NE(*other, *first) << "an id is never another number's";
  EXPECT_EQ(table.sources()[*other].first, size);
}

TEST(StudioSignals, AreRefusedWhereThereAreTooMany) {
  SignalTable table(two_joints());
  Result<std::size_t> added = 0U;
  for (std::size_t i = 0; i < 200 && added; ++i)
    added = table.add("c" + std::to_string(i), layout_of(400));
  ASSERT_FALSE(added);
  EXPECT_LE(table.size(), kMostSignals);
}

}  // namespace
}  // namespace tandem::studio
