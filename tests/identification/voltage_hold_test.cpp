// What a held voltage does to torques and accelerations, against the sequence itself.
#include "identification/voltage_hold.hpp"

#include <gtest/gtest.h>

#include "identification/samples.hpp"
#include "tests/identification/synthetic.hpp"

namespace tandem::identification {
namespace {

// Two joints with coupled inertia, driven by a constant torque and braked in proportion to speed.
TEST(VoltageHold, GivesTheLastAccelerationOfTheHoldFromTheMean) {
  Eigen::MatrixXd M(2, 2);
  M << 1.0, 0.2, 0.2, 0.5;
  const Eigen::Vector2d damping(250.0, 37.0), drive(3.0, -1.0);
  constexpr double kStep_s = 250e-6;
  const auto acceleration = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    return M.inverse() * (drive - damping.cwiseProduct(v));
  };
  Eigen::VectorXd v = Eigen::Vector2d(0.01, 0.02), last = acceleration(v);
  const Eigen::VectorXd start = v;
  for (int k = 0; k < 4; ++k) {  // kick, drift, and the other half by the predicted velocity
    const Eigen::VectorXd before = last;
    last = acceleration(v + kStep_s * before);
    v += 0.5 * kStep_s * (before + last);
  }
  const Eigen::VectorXd mean = (v - start) / (4 * kStep_s);
  const VoltageHold hold{4 * kStep_s, 4};
  EXPECT_LT((hold.sampled(M, damping, mean) - last).norm(), 1e-12 * mean.norm());
  EXPECT_NEAR(hold.lag_s(), 500e-6, 1e-12);
  EXPECT_GT((mean - last).norm(), 0.05 * mean.norm()) << "worth the trouble";
}

/// The bundled UR5e moves; its flange's sensor shows nothing.
Recording ur5e_recording(const Arm& ur5e) {
  Recording recording = synthetic_recording(ur5e.tree, wide_series(ur5e, 3), {}, 1);
  recording.sensor.assign(6, Signal(recording.rows(), 0.0));
  return recording;
}

Equations equations_of(const Arm& ur5e, const Recording& recording) {
  auto robot = make_identified_robot(ur5e.tree, ur5e.robot);
  Equations equations;
  EXPECT_TRUE(robot && add_equations(recording, 10.0, *robot, equations));
  return equations;
}

// Sensor rows of a known hold are corrected; those of an unknown one are doubted, as much.
TEST(AddEquations, DoubtWhatSixAxisSensorsShowOfAnUnknownHold) {
  const Arm ur5e = arm("ur5e");
  Recording recording = ur5e_recording(ur5e);
  const Equations none = equations_of(ur5e, recording);
  recording.unknown_hold_s = 1e-5;
  const Equations unknown = equations_of(ur5e, recording);
  recording.unknown_hold_s = 0.0;
  recording.voltage_hold_s = 1e-5;
  const Equations known = equations_of(ur5e, recording);
  auto robot = make_identified_robot(ur5e.tree, ur5e.robot);
  const Eigen::VectorXd described = robot->regressor.described();
  for (std::size_t c = 0; c < robot->regressor.channels().size(); ++c) {
    const Channel& channel = robot->regressor.channels()[c];
    const ChannelRows& rows = none.channels[c];
    EXPECT_TRUE(rows.doubt.empty());
    Eigen::VectorXd corrected(rows.rows()), doubted(rows.rows());
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      const Eigen::VectorXd change = known.channels[c].X.row(i) - rows.X.row(i);
      corrected[i] =
          change.head(described.size()).dot(described) - (known.channels[c].y[i] - rows.y[i]);
      // Three quarters of it are a 95 % interval; what it does is late by half of it.
      const double late = VoltageHold{.seconds = 1e-5}.lag_s() / 1e-5;
      doubted[i] = late * 1.96 / 0.75 * unknown.channels[c].doubt[static_cast<std::size_t>(i)];
    }
    if (channel.kind == Channel::Kind::kJoint) {
      EXPECT_GT(doubted.norm(), 0.0) << channel.name;
    } else {
      EXPECT_GT(corrected.norm(), 0.0) << channel.name;
    }
    EXPECT_LT((corrected - doubted).norm(), 0.01 * corrected.norm()) << channel.name;
  }
}

}  // namespace
}  // namespace tandem::identification
