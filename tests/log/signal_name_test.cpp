#include "log/signal_name.hpp"

namespace tandem::log {
namespace {

hal::Field field(const char* name, std::size_t count) {
  hal::Layout layout;
  layout.add(name, hal::FieldType::kF64, count, "");
  return layout.fields().front();
}

// The base's velocity has as many numbers as a robot with six joints has joints.
TEST(SignalName, NamesAJointOnlyWhereThereIsOneNumberOfEach) {
  const RunInfo six{.robot = "arm", .joints = {"a", "b", "c", "d", "e", "f"}, .sensors = {}};
  EXPECT_EQ(signal_name(field("position_rad", 6), 2, six), "position_rad.c");
  EXPECT_EQ(signal_name(field("base_velocity", 6), 2, six), "base_velocity.2");
  EXPECT_EQ(signal_name(field("foot_force_N", 6), 5, six), "foot_force_N.5");
  EXPECT_EQ(signal_name(field("foot_force_n", 6), 5, six), "foot_force_n.5") << "as logs have it";
  EXPECT_EQ(signal_name(field("of_another_program", 6), 5, six), "of_another_program.f");
  const RunInfo three{.robot = "leg", .joints = {"a", "b", "c"}, .sensors = {}};
  EXPECT_EQ(signal_name(field("base_position_m", 3), 0, three), "base_position_m.0");
}

// Scripts that read columns by joint broke on a gripper.
TEST(SignalName, OfOneJointIsAsThatOfMany) {
  const RunInfo one{.robot = "gripper", .joints = {"finger"}, .sensors = {{"wrist", 6}}};
  EXPECT_EQ(signal_name(field("position_rad", 1), 0, one), "position_rad.finger");
  EXPECT_EQ(signal_name(field("torque_nm", 1), 0, one), "torque_nm.finger");
  EXPECT_EQ(signal_name(field("sensor_age_cycles", 1), 0, one), "sensor_age_cycles.wrist");
  EXPECT_EQ(signal_name(field("cycle", 1), 0, one), "cycle");
  EXPECT_EQ(signal_name(field("innovation", 1), 0, one), "innovation");
  EXPECT_EQ(signal_name(field("of_another_program", 1), 0, one), "of_another_program");
}

}  // namespace
}  // namespace tandem::log
