// Conditions: what they mean, what they refuse, and that a cycle may compute them.
#include "runtime/condition/condition.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "rt/scoped_realtime.hpp"
#include "runtime/condition/unit.hpp"
#include "tests/runtime/condition_robot.hpp"

namespace tandem::runtime {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct ConditionTest : test::ConditionRobot, testing::Test {
  Condition read(const std::string& text) {
    auto condition = Condition::read(text, names());
    EXPECT_TRUE(condition) << condition.error().to_string();
    return condition ? *condition : Condition();
  }
  bool holds(const std::string& text) { return read(text).holds(view()); }
  double margin(const std::string& text) { return read(text).look(view()).margin; }
  std::string refusal(const std::string& text) {
    const auto condition = Condition::read(text, names());
    return condition ? "it was taken" : condition.error().to_string();
  }
};

TEST_F(ConditionTest, ComparesQuantitiesInTheirUnits) {
  state.torque_Nm()[0] = 41.0;
  EXPECT_TRUE(holds("torque(knee) > 40Nm"));
  EXPECT_TRUE(holds("torque(knee)>=41000 mNm"));
  EXPECT_FALSE(holds("torque(knee) < 0.041kNm"));
  EXPECT_TRUE(holds("torque(knee) <= 41 Nm"));
  EXPECT_TRUE(holds("40Nm < torque(knee)"));
  state.position_rad()[0] = -0.5;
  EXPECT_TRUE(holds("position(knee) < -28.6deg"));
  EXPECT_FALSE(holds("position(knee) < -28.7deg"));
  EXPECT_TRUE(holds("- position(knee) > 28.6deg"));
  state.position_rad()[1] = 0.02;
  EXPECT_TRUE(holds("signal(state.position_rad.lift-1) == 20mm")) << "a joint that slides";
  EXPECT_TRUE(holds("time() == 10 ms and cycle() == 10"));
  EXPECT_NEAR(margin("torque(knee) > 40Nm"), 1.0, 1e-12);
  EXPECT_EQ(read("position(knee) < 1deg").unit(), "rad");
}

TEST_F(ConditionTest, KnowsEveryImageByItsPath) {
  state.torque_Nm()[0] = 41.0;
  truth.base_position_m()[2] = 0.7;
  estimate.base_position_m()[1] = -0.2;
  command.stiffness_Nm_rad()[0] = 12.0;
  state.mode()[0] = -3;
  state.fault()[1] = 0x7500;
  state.sensor_values(0)[2] = 300.0;
  state.sensor_values(1)[4] = 0.1;
  EXPECT_TRUE(holds("state.torque_Nm.knee == 41Nm")) << "as C++ has it";
  EXPECT_TRUE(holds("state.torque_nm.knee == 41Nm")) << "as studio and log have it";
  EXPECT_TRUE(holds("truth.base_position_m.2 == 0.7m"));
  EXPECT_TRUE(holds("estimate.base_position_m.1 < 0"));
  EXPECT_TRUE(holds("command.stiffness_nm_rad.knee == 12Nm/rad"));
  EXPECT_TRUE(holds("state.mode.knee == -3"));
  EXPECT_TRUE(holds("signal(state.fault.lift-1) == 29952"));
  EXPECT_TRUE(holds("sensor(sole.fz_N) == 0.3kN and state.sensor.sole.fz_N == 300N"));
  EXPECT_TRUE(holds("sensor(imu.wx_rad_s) == 0.1rad/s"));
}

TEST_F(ConditionTest, HasShortNamesForWhatASimulationKnows) {
  truth.base_position_m()[2] = 0.7;
  truth.foot_force_N()[5] = 200.0;
  truth.base_quaternion()[0] = std::sin(0.1);
  truth.base_quaternion()[3] = std::cos(0.1);
  EXPECT_TRUE(holds("height() == 700mm"));
  EXPECT_TRUE(holds("foot_force(right) == 200N and foot_force(left) == 0"));
  EXPECT_TRUE(holds("tilt() > 0.199999rad and tilt() < 0.200001rad"));
  truth.base_velocity()[4] = 2.0;
  EXPECT_TRUE(holds("truth.base_velocity.4 == 2rad/s and truth.base_velocity.2 == 0m/s"));
  estimate.base_deviation()[8] = 0.25;
  EXPECT_TRUE(holds("estimate.base_deviation.8 == 25cm and estimate.base_deviation.0 == 0rad"));
}

TEST_F(ConditionTest, JoinsByAndOrNotWithBrackets) {
  state.torque_Nm()[0] = 1.0;
  EXPECT_TRUE(holds("torque(knee) > 2Nm or torque(knee) < 2Nm and cycle() == 10"));
  EXPECT_FALSE(holds("(torque(knee) > 2Nm or torque(knee) < 2Nm) and cycle() == 9"));
  EXPECT_TRUE(holds("not torque(knee) > 2Nm and not (cycle() == 9 or cycle() == 8)"));
  state.position_rad()[0] = 0.30;
  command.position_rad()[0] = 0.32;
  EXPECT_TRUE(holds("abs(position(knee) - reference(knee)) < 0.021 rad"));
  EXPECT_FALSE(holds("abs(position(knee) - reference(knee)) < 0.019 rad"));
  EXPECT_TRUE(holds("abs(position(knee) - reference(knee) + 0.02rad) < 1e-9rad"));
  EXPECT_NEAR(margin("torque(knee) < 3Nm and torque(knee) > -1Nm"), 2.0, 1e-12);
  EXPECT_NEAR(margin("torque(knee) > 3Nm or torque(knee) > 2Nm"), -1.0, 1e-12);
  EXPECT_NEAR(margin("not torque(knee) > 3Nm"), 2.0, 1e-12);
  EXPECT_TRUE(read("torque(knee) < 3Nm and height() > 1m").mixes_units());
  EXPECT_FALSE(read("torque(knee) < 3Nm and torque(knee) > -1Nm").mixes_units());
}

TEST_F(ConditionTest, KnowsPhasesAndFaults) {
  EXPECT_TRUE(holds("phase() == running and phase() != bring-up"));
  EXPECT_FALSE(holds("fault(any)"));
  faults = std::uint64_t{1} << static_cast<unsigned>(hal::FaultCause::kTilted);
  EXPECT_TRUE(holds("fault(any) and fault(tilted) and fault(fell)"));
  EXPECT_FALSE(holds("fault(board_silent) or fault(low)"));
  EXPECT_EQ(margin("fault(fell)"), std::numeric_limits<double>::infinity());
}

TEST_F(ConditionTest, WhatNobodyMeasuredDoesNotHold) {
  for (const char* text : {"torque(knee) > -1Nm", "not torque(knee) > -1Nm",
                           "abs(torque(knee) - torque(knee)) < 1Nm", "reference(knee) == 0"}) {
    state.age_cycles()[0] = 11;
    EXPECT_FALSE(holds(text)) << text << ", older than the run";
    EXPECT_FALSE(read(text).look(view()).known);
    state.age_cycles()[0] = 0;
  }
  state.torque_Nm()[0] = kNaN;
  EXPECT_FALSE(holds("torque(knee) > -1Nm"));
  EXPECT_FALSE(holds("torque(knee) != 1Nm"));
  EXPECT_TRUE(holds("torque(knee) > 1Nm or cycle() == 10")) << "the other is known";
  EXPECT_FALSE(holds("torque(knee) > 1Nm and cycle() == 10"));
  EXPECT_FALSE(holds("not (torque(knee) > 1Nm and cycle() == 10)"));
  EXPECT_TRUE(holds("not (torque(knee) > 1Nm and cycle() == 9)"));
  state.sensor_age_cycles()[1] = 11;
  EXPECT_FALSE(holds("sensor(imu.wx_rad_s) == 0"));
  EXPECT_TRUE(holds("sensor(sole.fz_N) == 0"));
  estimate.base_valid()[0] = 0;
  EXPECT_FALSE(holds("estimate.base_position_m.2 == 0"));
  EXPECT_TRUE(holds("estimate.base_valid == 0"));
  hal::CycleView without = view();
  without.truth = nullptr;
  EXPECT_FALSE(read("height() == 0").holds(without));
}

TEST_F(ConditionTest, AControllersSignalIsThatOfThisCycle) {
  block->depth[0] = 0.1;
  block->gait[1] = 2.0;
  const Condition condition = read("squat.depth == 10cm and controller/squat.gait.1 == 2");
  EXPECT_FALSE(condition.holds(view())) << "not shown yet";
  block->publish(time.cycle, time.time_ns);
  EXPECT_TRUE(condition.holds(view()));
  at(11);
  EXPECT_FALSE(condition.holds(view())) << "its controller is stopped, or has gone";
  block->publish(time.cycle, time.time_ns);
  EXPECT_TRUE(condition.holds(view()));
  block.reset();
  EXPECT_TRUE(condition.holds(view())) << "it keeps what it reads";
}

TEST_F(ConditionTest, RefusesWithThePlaceAndTheNextStep) {
  struct Case {
    const char *text, *place, *says;
  };
  const Case cases[] = {
      {"", "character 1", "ends too early"},
      {"torqe(knee) > 1Nm", "character 1", "did you mean 'torque'"},
      {"torque(kne) > 1Nm", "character 1", "did you mean 'knee'"},
      {"torque() > 1Nm", "character 1", "which joint is not said"},
      {"torque > 1Nm", "character 1", "has no brackets"},
      {"torque(knee) > 1", "character 16", "give its unit: Nm, mNm, kNm"},
      {"torque(knee) > 1rad", "character 16", "this is in rad"},
      {"torque(knee) > 1Nmm", "character 17", "no unit 'Nmm'"},
      {"torque(knee) > position(knee)", "character 16",
       "is in rad, and what is before it is in Nm"},
      {"torque(knee) - 1rad > 0", "character 16", "is in rad"},
      {"cycle() > 3Nm", "character 11", "is in Nm"},
      {"torque(knee)", "character 13", "is compared with nothing"},
      {"torque(knee) > ", "character 16", "ends too early"},
      {"torque(knee) = 1Nm", "character 14", "is compared with nothing"},
      {"torque(knee) > 1Nm torque(knee) < 2Nm", "character 20", "join conditions"},
      {"torque(knee) > 1Nm and", "character 23", "ends too early"},
      {"and torque(knee) > 1Nm", "character 1", "is no quantity"},
      {"(torque(knee) > 1Nm", "character 20", "lacks a )"},
      {"torque(knee > 1Nm", "character 1", "close the bracket"},
      {"abs torque(knee) > 1Nm", "character 5", "abs lacks its ("},
      {"torque(knee) > 1e999Nm", "character 16", "no finite number"},
      {"torque(knee) > 1Nm)", "character 19", "one word too many"},
      {"phase() == runing", "character 12", "did you mean 'running'"},
      {"phase() > running", "character 9", "phase() == running"},
      {"phase(x) == running", "character 1", "phase() == running"},
      {"fault(fel)", "character 1", "did you mean 'fell'"},
      {"fault", "character 1", "fault(any)"},
      {"height(knee) > 1m", "character 1", "leave the brackets empty"},
      {"foot_force(lef) > 1N", "character 1", "did you mean 'left'"},
      {"sensor(imu.wx_rad) > 0", "character 1", "imu.wx_rad_s"},
      {"stat.torque_nm.knee > 0", "character 1", "did you mean 'state'"},
      {"state.torque.knee > 0", "character 1", "torque_nm"},
      {"state.torque_nm > 0", "character 1", "which joint is not said"},
      {"squat.dept > 0", "character 1", "did you mean 'depth'"},
      {"squat.gait.2 > 0", "character 1", "no element '2'"},
      {"torque(knee) > 1Nm and 3", "character 25", "is compared with nothing"},
      {"not", "character 4", "ends too early"},
      {"torque(knee) > 5 % 3", "character 16", "is a plain number"},
  };
  for (const Case& one : cases) {
    const std::string said = refusal(one.text);
    EXPECT_NE(said.find(one.place), std::string::npos) << one.text << "\n" << said;
    EXPECT_NE(said.find(one.says), std::string::npos) << one.text << "\n" << said;
  }
  const std::string deep(100, '(');
  EXPECT_NE(refusal(deep + "cycle() > 1").find("too many levels"), std::string::npos);
  std::string nots;
  for (int i = 0; i < 100; ++i) nots += "not ";
  EXPECT_NE(refusal(nots + "cycle() > 1").find("too many levels"), std::string::npos);
  EXPECT_NE(refusal(std::string(5000, '-') + "cycle() > 1").find("too long"), std::string::npos);
  std::string wide = "cycle() > 1";
  for (int i = 0; i < 200; ++i) wide += " and cycle() > 1";
  EXPECT_NE(refusal(wide).find("too long"), std::string::npos);
}

TEST_F(ConditionTest, SaysWhatARunLacks) {
  QuantityNames real = names();
  real.truth = nullptr;
  real.estimate = nullptr;
  const auto height = Condition::read("height() > 1m", real);
  ASSERT_FALSE(height);
  EXPECT_NE(height.error().to_string().find("not simulated"), std::string::npos);
  const auto torque = Condition::read("external_torque(knee) > 1Nm", real);
  ASSERT_FALSE(torque);
  EXPECT_NE(torque.error().to_string().find("[estimation]"), std::string::npos);
}

TEST_F(ConditionTest, ReadsAmountsInTheUnitOfAQuantity) {
  EXPECT_EQ(read_amount("40Nm", "Nm"), 40.0);
  EXPECT_EQ(read_amount(" -2 mm ", "m"), -0.002);
  EXPECT_EQ(read_amount("0", "Nm"), 0.0);
  EXPECT_EQ(read_amount("50%", ""), 0.5);
  for (const char* wrong : {"", "40", "40rad", "40Nm 2", "nan", "inf", "1e400Nm", "Nm", "--1Nm"})
    EXPECT_FALSE(read_amount(wrong, "Nm")) << wrong;
}

TEST_F(ConditionTest, UnitsOfEveryFieldAreKnown) {
  // A quantity's unit that the table lacks could be compared with nothing but 0.
  for (const hal::Layout* layout :
       {&state.layout(), &command.layout(), &truth.layout(), &estimate.layout()}) {
    const char* image = layout == &state.layout()     ? "state."
                        : layout == &command.layout() ? "command."
                        : layout == &truth.layout()   ? "truth."
                                                      : "estimate.";
    for (const hal::Field& field : layout->fields()) {
      if (field.count == 0 || field.name == "sensor") continue;
      for (const char* element : {"", ".0", ".knee", ".sole"}) {
        const auto found = find_quantity("", image + field.name + element, names());
        if (!found) continue;
        EXPECT_TRUE(found->unit.empty() || unit_of(found->unit))
            << field.name << " " << found->unit;
      }
    }
  }
}

TEST_F(ConditionTest, IsComputedWithoutHeapAndLocks) {
  const Condition condition = read(
      "abs(torque(knee) - 3Nm) > 1Nm and (height() == 0 or tilt() > 1rad) and not fault(any) and "
      "phase() == running and squat.depth != 0");
  block->depth[0] = 1.0;
  block->publish(time.cycle, time.time_ns);
  const rt::ScopedRealtime realtime;
  EXPECT_TRUE(condition.holds(view()));
}

}  // namespace
}  // namespace tandem::runtime
