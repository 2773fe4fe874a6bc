#include "runtime/run_statistics.hpp"

#include <cmath>

namespace tandem::runtime {
namespace {

constexpr auto kPosition = static_cast<std::int8_t>(hal::ControlMode::kPosition);

class RunStatisticsOfTwo : public testing::Test {
 protected:
  void take(double wanted, double measured) {
    command_.mode()[0] = kPosition;
    command_.position_rad()[0] = wanted;
    state_.position_rad()[0] = measured;
    statistics_.take(state_, command_, unfollowed_, &truth_, limits_);
    statistics_.take_base(&truth_);
  }
  void foot(std::size_t index, double x, double force_N) {
    truth_.foot_position_m()[3 * index] = x;
    truth_.foot_force_N()[3 * index + 2] = force_N;
  }

  hal::StateImage state_{{.joints = 2, .sensor_channels = {}}};
  hal::CommandImage command_{{.joints = 2, .sensor_channels = {}}};
  std::vector<std::uint8_t> unfollowed_{0, 0};
  hal::TruthImage truth_{2, 2};
  std::vector<hal::LimitCounters> limits_{2};
  RunStatistics statistics_{2, 2};
};

TEST_F(RunStatisticsOfTwo, CountTheCyclesInWhichACommandWasLimited) {
  limits_[1].too_fast = 7;  // before the controllers ran
  take(0.0, 0.0);
  take(0.0, 0.0);
  EXPECT_EQ(statistics_.limited_cycles(), (std::vector<std::uint64_t>{0, 0}));
  for (int i = 0; i < 3; ++i) {
    ++limits_[1].too_fast;
    limits_[1].out_of_range += 2;
    take(0.0, 0.0);
  }
  limits_[0].not_finite = 1;
  take(0.0, 0.0);
  EXPECT_EQ(statistics_.limited_cycles(), (std::vector<std::uint64_t>{1, 3}));
}

TEST_F(RunStatisticsOfTwo, GivesRmsAndMaximumOfTheTrackingError) {
  take(0.0, 0.3);
  take(0.0, -0.4);
  const auto tracking = statistics_.tracking();
  EXPECT_DOUBLE_EQ(tracking[0].rms_rad, std::sqrt((0.09 + 0.16) / 2.0));
  EXPECT_DOUBLE_EQ(tracking[0].max_rad, 0.4);
  EXPECT_EQ(tracking[1].rms_rad, 0.0);  // never in position control
}

TEST_F(RunStatisticsOfTwo, GiveNoTrackingErrorWhereNobodyWroteAReference) {
  command_.mode()[1] = static_cast<std::int8_t>(hal::ControlMode::kTorque);
  command_.position_rad()[1] = 0.5;  // left over from who held the joint
  take(0.0, 0.0);
  EXPECT_EQ(statistics_.tracking()[1].cycles, 0U);
  unfollowed_[1] = 1;
  take(0.0, 0.0);
  EXPECT_EQ(statistics_.tracking()[1].cycles, 1U);
  EXPECT_DOUBLE_EQ(statistics_.tracking()[1].max_rad, 0.5);
}

TEST_F(RunStatisticsOfTwo, SumTheWorkOfJointsThatDriveAndOfThoseThatBrake) {
  EXPECT_FALSE(statistics_.work(1e-3));
  const auto power = [&](std::size_t joint, double torque_Nm, double velocity_rad_s) {
    state_.torque_Nm()[joint] = torque_Nm;
    state_.velocity_rad_s()[joint] = velocity_rad_s;
  };
  power(0, std::nan(""), 3.0);
  power(1, std::nan(""), 3.0);
  take(0.0, 0.0);
  EXPECT_FALSE(statistics_.work(1e-3));  // no drive tells its torque
  power(0, 2.0, 3.0);
  take(0.0, 0.0);
  power(1, -1.0, 4.0);
  take(0.0, 0.0);
  const auto work = statistics_.work(0.5);
  ASSERT_TRUE(work);
  EXPECT_DOUBLE_EQ(work->done_J, 2.0 * 6.0 * 0.5);
  EXPECT_DOUBLE_EQ(work->taken_J, 4.0 * 0.5);
  EXPECT_DOUBLE_EQ(work->max_power_W, 6.0);
}

TEST_F(RunStatisticsOfTwo, KeepTheLargestWrenchOfEachPlaceAndItsTime) {
  hal::EstimateImage estimate({.joints = 2, .wrenches = 2});
  RunStatistics statistics(2, 2, 0, 2);
  const auto at = [&](std::int64_t time_ns, double force_x_N, double moment_z_Nm, double rest_Nm) {
    estimate.time_ns()[0] = time_ns;
    estimate.external_force_N()[3] = force_x_N;
    estimate.external_moment_Nm()[5] = moment_z_Nm;
    estimate.unexplained_torque_Nm()[0] = rest_Nm;
    statistics.take(state_, command_, unfollowed_, nullptr, limits_, &estimate);
  };
  estimate.external_force_N()[4] = 4.0;
  at(1, 0.0, 0.5, 0.1);
  at(2, -3.0, 0.2, 0.3);
  at(3, 1.0, -0.7, 0.2);
  const EstimateFigures figures = statistics.estimate();
  ASSERT_EQ(figures.wrenches.size(), 2U);
  EXPECT_EQ(figures.wrenches[0].force_N.value, 0.0);
  EXPECT_DOUBLE_EQ(figures.wrenches[1].force_N.value, 5.0);
  EXPECT_EQ(figures.wrenches[1].force_N.time_ns, 2);
  EXPECT_DOUBLE_EQ(figures.wrenches[1].moment_Nm.value, 0.7);
  EXPECT_EQ(figures.wrenches[1].moment_Nm.time_ns, 3);
  EXPECT_DOUBLE_EQ(figures.unexplained_Nm.value, 0.3);
}

TEST_F(RunStatisticsOfTwo, GivesTheMeanForceOfBothFeetOnceTheBaseIsFree) {
  truth_.base_quaternion()[3] = 1.0;
  truth_.hoist_share()[0] = 0.5;
  foot(0, 0.0, 1000.0);
  take(0, 0);
  EXPECT_FALSE(statistics_.ground(1.0));
  truth_.hoist_share()[0] = 0.0;
  foot(0, 0.0, 100.0);
  foot(1, 0.0, 200.0);
  take(0, 0);
  foot(0, 0.0, 150.0);
  take(0, 0);
  EXPECT_DOUBLE_EQ(statistics_.ground(320.0)->mean_vertical_force_N, 325.0);
  EXPECT_EQ(statistics_.ground(320.0)->weight_N, 320.0);
}

TEST_F(RunStatisticsOfTwo, KeepsTheWorstErrorOfEachLoop) {
  hal::TruthImage truth(2, 0, 2, 1);
  ASSERT_EQ(truth.loops(), 2u);
  ASSERT_EQ(truth.passive(), 1u);
  ASSERT_EQ(truth_.loops(), 0u);
  RunStatistics statistics(2, 0, 2);
  for (const double error : {1e-9, 3e-9, 2e-9}) {
    truth.loop_position_error_m()[1] = error;
    truth.loop_velocity_error_m_s()[0] = 2.0 * error;
    statistics.take(state_, command_, unfollowed_, &truth, {});
  }
  EXPECT_EQ(statistics.loops()[0].max_position_error_m, 0.0);
  EXPECT_EQ(statistics.loops()[0].max_velocity_error_m_s, 6e-9);
  EXPECT_EQ(statistics.loops()[1].max_position_error_m, 3e-9);
}

TEST_F(RunStatisticsOfTwo, MeasuresSlipFromWhereAFootTouchedDown) {
  foot(0, 0.10, 50.0);
  take(0, 0);
  foot(0, 0.12, 50.0);
  take(0, 0);
  EXPECT_NEAR(statistics_.ground(1)->max_foot_slip_m, 0.02, 1e-15);
  foot(0, 0.50, 0.0);  // a step through the air
  take(0, 0);
  foot(0, 0.60, 50.0);
  take(0, 0);
  EXPECT_NEAR(statistics_.ground(1)->max_foot_slip_m, 0.02, 1e-15);
}

TEST_F(RunStatisticsOfTwo, GivesTheBasesHeightsAndItsLastTilt) {
  const double angle = 0.2;  // about x
  truth_.base_quaternion()[3] = 1.0;
  for (const double height : {0.9, 0.7, 0.8}) {
    truth_.base_position_m()[2] = height;
    take(0, 0);
  }
  truth_.base_quaternion()[0] = std::sin(angle / 2);
  truth_.base_quaternion()[3] = std::cos(angle / 2);
  take(0, 0);
  const auto base = statistics_.base();
  ASSERT_TRUE(base);
  EXPECT_EQ(base->min_height_m, 0.7);
  EXPECT_EQ(base->max_height_m, 0.9);
  EXPECT_NEAR(base->final_tilt_rad, angle, 1e-15);
  EXPECT_NEAR(base->max_tilt_rad, angle, 1e-15);
}

TEST_F(RunStatisticsOfTwo, SeesTheBaseFallWhenNoControllerRunsAnyMore) {
  truth_.base_quaternion()[3] = 1.0;
  truth_.base_position_m()[2] = 0.8;
  take(0, 0);
  truth_.base_quaternion()[0] = std::sin(0.8);
  truth_.base_quaternion()[3] = std::cos(0.8);
  truth_.base_position_m()[2] = 0.1;
  statistics_.take_base(&truth_);
  EXPECT_EQ(statistics_.base()->min_height_m, 0.1);
  EXPECT_NEAR(statistics_.base()->final_tilt_rad, 1.6, 1e-12);
  truth_.hoist_share()[0] = 1.0;  // what hangs from a hoist has not fallen
  truth_.base_position_m()[2] = 0.05;
  statistics_.take_base(&truth_);
  statistics_.take_base(nullptr);
  EXPECT_EQ(statistics_.base()->min_height_m, 0.1);
}

/// Against the truth, whatever the yaw, which no sensor tells.
TEST_F(RunStatisticsOfTwo, GivesTheEstimatesWorstErrorsOfTiltAndHeight) {
  hal::EstimateImage estimate({.base = 1, .feet = 2, .joints = 2});
  const auto take_both = [&](double yaw, double tilt, double height_m) {
    truth_.base_quaternion()[3] = 1.0;
    truth_.base_position_m()[2] = 0.5;
    const auto q = estimate.base_quaternion();  // a turn about z after one about x
    q[0] = std::cos(yaw / 2) * std::sin(tilt / 2);
    q[1] = std::sin(yaw / 2) * std::sin(tilt / 2);
    q[2] = std::sin(yaw / 2) * std::cos(tilt / 2);
    q[3] = std::cos(yaw / 2) * std::cos(tilt / 2);
    estimate.base_position_m()[2] = height_m;
    statistics_.take(state_, command_, unfollowed_, &truth_, limits_, &estimate);
  };
  estimate.external_torque_Nm()[1] = -3.0;
  take_both(0.0, 1.0, 9.0);
  EXPECT_EQ(statistics_.estimate().base_cycles, 0U) << "it has not started";
  EXPECT_EQ(statistics_.estimate().max_external_Nm[1], 3.0);
  estimate.external_base_wrench()[1] = -4.0;
  estimate.external_base_wrench()[2] = 3.0;
  estimate.external_base_wrench()[5] = -2.0;
  estimate.time_ns()[0] = 7;
  estimate.base_valid()[0] = 1;
  take_both(1.2, 0.01, 0.498);
  take_both(2.5, 0.02, 0.501);
  truth_.hoist_share()[0] = 0.5;
  take_both(0.0, 1.0, 9.0);
  const EstimateFigures figures = statistics_.estimate();
  EXPECT_EQ(figures.base_cycles, 3U);
  EXPECT_EQ(figures.compared, 2U) << "not on the hoist";
  EXPECT_NEAR(figures.max_tilt_error_rad, 0.02, 1e-12);
  EXPECT_NEAR(figures.max_height_error_m, 0.002, 1e-15);
  EXPECT_DOUBLE_EQ(figures.base_wrench.force_N.value, 5.0);
  EXPECT_DOUBLE_EQ(figures.base_wrench.moment_Nm.value, 2.0);
  EXPECT_EQ(figures.base_wrench.force_N.time_ns, 7);
}

}  // namespace
}  // namespace tandem::runtime
