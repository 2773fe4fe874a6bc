#include "log/signal_name.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "hal/homing.hpp"
#include "hal/image.hpp"

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

// They were "sensor.left_foot.0" to ".5", and nothing said what those are.
TEST(SignalName, OfASensorsChannelSaysWhatItMeasures) {
  const RunInfo info{
      .robot = "two", .joints = {"a"}, .sensors = {{"foot", 6}, {"imu", 10}, {"odd", 2}}};
  const auto name = [&](std::size_t i) { return signal_name(field("sensor", 18), i, info); };
  EXPECT_EQ(name(0), "sensor.foot.fx_N");
  EXPECT_EQ(name(5), "sensor.foot.tz_Nm");
  EXPECT_EQ(name(6), "sensor.imu.qx");
  EXPECT_EQ(name(12), "sensor.imu.wz_rad_s");
  EXPECT_EQ(name(13), "sensor.imu.ax_m_s2");
  EXPECT_EQ(name(17), "sensor.odd.1");
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

// A log has the numbers alone: nothing said what they are.
TEST(LogPage, SaysWhatTheNumbersOfAStateMean) {
  std::ifstream file(TANDEM_SOURCE_DIR "/docs/log.md");
  const std::string page((std::istreambuf_iterator<char>(file)), {});
  const auto row = [&](const std::string& name) {
    const auto at = page.find("| `" + name + "` | 0 ");
    return at == std::string::npos ? "" : page.substr(at, page.find('\n', at) - at);
  };
  const auto expect = [&](const char* name, int number, const char* word) {
    EXPECT_NE(row(name).find(std::to_string(number) + " " + word), std::string::npos)
        << name << ": " << number << " " << word;
  };
  for (int i = 0; i <= 5; ++i) expect("mode", i, to_string(static_cast<hal::ControlMode>(i)));
  for (int i = 0; i <= 1; ++i)
    expect("interaction", i, to_string(static_cast<hal::InteractionMode>(i)));
  for (int i = 0; i <= 8; ++i) expect("drive_state", i, to_string(static_cast<hal::DriveState>(i)));
  for (int i = 0; i <= 3; ++i) expect("homing", i, to_string(static_cast<hal::HomingState>(i)));
}

}  // namespace
}  // namespace tandem::log
