// What of a recording is left out, and what of it is not.
#include "identification/recording.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "identification/identify.hpp"
#include "log/recorder.hpp"
#include "tests/identification/synthetic.hpp"
#include "tests/support/little_room.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::identification {
namespace {

const Arm& panda() {
  static const Arm one = arm("panda");
  return one;
}

Recording good() {
  Reality reality;
  reality.torque_quantum_Nm = 0.087;
  reality.position_quantum_rad = 6e-6;
  reality.duration_s = 20.0;
  return synthetic_recording(panda().tree, wide_series(panda(), 3), reality, 1);
}

std::size_t missing(const Signal& signal) {
  return static_cast<std::size_t>(
      std::ranges::count_if(signal, [](double value) { return std::isnan(value); }));
}

TEST(Recording, LeavesNothingOutOfAGoodOne) {
  Recording recording = good();
  bridge_holes(recording);
  exclude_frozen(recording, panda().robot);
  exclude_clipped(recording, panda().robot);
  EXPECT_TRUE(recording.remarks.empty()) << recording.remarks.front();
  for (std::size_t j = 0; j < 7; ++j) EXPECT_EQ(missing(recording.torque_Nm[j]), 0U);
}

TEST(Recording, BridgesShortHolesAndLeavesLongOnes) {
  Recording recording = good();
  const Signal before = recording.position_rad[2];
  for (const std::size_t at : {1000U, 1001U, 1002U, 1003U, 1004U})
    recording.position_rad[2][at] = NAN;
  for (std::size_t at = 3000; at < 3100; ++at) recording.position_rad[2][at] = NAN;
  bridge_holes(recording);
  EXPECT_EQ(missing(recording.position_rad[2]), 100U);
  EXPECT_NEAR(recording.position_rad[2][1002], before[1002], 1e-4);
}

TEST(Recording, LeavesOutAFrozenEncoderAndAFrozenTorque) {
  Recording recording = good();
  for (std::size_t at = 2000; at < 3000; ++at) {
    recording.position_rad[3][at] = recording.position_rad[3][2000];
    recording.torque_Nm[5][at] = recording.torque_Nm[5][2000];
  }
  exclude_frozen(recording, panda().robot);
  ASSERT_EQ(recording.remarks.size(), 2U);
  EXPECT_NE(recording.remarks[0].find("joint 'panda_joint4': its position stands still"),
            std::string::npos);
  EXPECT_NE(recording.remarks[1].find("joint 'panda_joint6': its torque stands still"),
            std::string::npos);
  EXPECT_GE(missing(recording.position_rad[3]), 1000U);
  EXPECT_GE(missing(recording.torque_Nm[5]), 1000U);
}

// Logs of other programs have no reference, and often no motor's position.
TEST(Recording, LeavesOutAFrozenEncoderThatNothingElseContradicts) {
  for (const std::size_t every : {1U, 2U}) {
    Recording recording = good();
    for (std::size_t j = 0; j < 7; ++j) {
      std::ranges::fill(recording.reference_rad[j], NAN);
      std::ranges::fill(recording.motor_position_rad[j], NAN);
    }
    if (every == 2) {  // 4 ms
      recording.period_s *= 2.0;
      for (auto* signals : {&recording.position_rad, &recording.torque_Nm, &recording.reference_rad,
                            &recording.motor_position_rad, &recording.current_A}) {
        for (Signal& one : *signals) {
          for (std::size_t k = 0; 2 * k < one.size(); ++k) one[k] = one[2 * k];
          one.resize((one.size() + 1) / 2);
        }
      }
      for (std::size_t k = 0; 2 * k < recording.time_s.size(); ++k)
        recording.time_s[k] = recording.time_s[2 * k];
      recording.time_s.resize((recording.time_s.size() + 1) / 2);
    }
    Signal& position = recording.position_rad[1];
    const std::size_t length = 200 / every;  // 0.4 s
    for (std::size_t at = 2000 / every; at < 2000 / every + length; ++at)
      position[at] = position[2000 / every];
    for (auto* signals : {&recording.position_rad, &recording.torque_Nm})
      for (std::size_t at = 4000 / every; at < 4000 / every + length; ++at)
        (*signals)[3][at] = (*signals)[3][4000 / every];
    exclude_frozen(recording, panda().robot);
    for (const std::size_t j : {1U, 3U}) {
      EXPECT_GE(missing(recording.position_rad[j]), length) << j << " of " << every;
      EXPECT_LT(missing(recording.position_rad[j]), length + 3) << j << " of " << every;
    }
    ASSERT_EQ(recording.remarks.size(), 2U);
    EXPECT_NE(recording.remarks[0].find("joint 'panda_joint2': its position stands still"),
              std::string::npos)
        << recording.remarks[0];
  }
}

TEST(Recording, KeepsAJointThatRestsAndStartsAgain) {
  Recording recording = good();
  for (std::size_t j = 0; j < 7; ++j) std::ranges::fill(recording.reference_rad[j], NAN);
  // 3 s of a motion, 2 s of rest, 3 s of motion: braked and started with 2 rad/s^2.
  for (std::size_t at = 0; at < recording.rows(); ++at) {
    const double t = recording.time_s[at];
    const double to = std::min(0.0, t - 3.0), from = std::max(0.0, t - 5.0);
    const double q = 1.0 - to * to + from * from;
    recording.position_rad[2][at] = 6e-6 * std::round(q / 6e-6);
    recording.motor_position_rad[2][at] = NAN;
  }
  exclude_frozen(recording, panda().robot);
  EXPECT_EQ(missing(recording.position_rad[2]), 0U);
}

TEST(Recording, LeavesOutATorqueThatIsCutOff) {
  Recording recording = good();
  double most = 0.0;
  for (const double one : recording.torque_Nm[1]) most = std::max(most, one);
  ASSERT_GT(most, 5.0);
  for (double& one : recording.torque_Nm[1]) one = std::min(one, 0.6 * most);
  exclude_clipped(recording, panda().robot);
  ASSERT_EQ(recording.remarks.size(), 1U);
  EXPECT_NE(recording.remarks[0].find("joint 'panda_joint2': its torque is cut off"),
            std::string::npos);
  EXPECT_EQ(std::ranges::count(recording.torque_Nm[1], 0.6 * most), 0);
}

// It may begin at the limit, and leave it for a short while only.
TEST(Recording, LeavesOutATorqueThatIsCutOffForMostOfTheTime) {
  for (const double sign : {1.0, -1.0}) {
    Recording recording = good();
    Signal& torque = recording.torque_Nm[1];
    Signal sorted = torque;
    std::ranges::sort(sorted);
    const double low = sorted[sorted.size() / 5], high = sorted[sorted.size() * 3 / 5];
    for (double& one : torque) one = sign * std::clamp(one, low, high);
    exclude_clipped(recording, panda().robot);
    ASSERT_EQ(recording.remarks.size(), 1U);
    EXPECT_LT(std::ranges::count(torque, sign * low) + std::ranges::count(torque, sign * high),
              100);
  }
}

TEST(Recording, GivesTheSameResultWithWhatLiesLeftOut) {
  Recording recording = good();
  double most = 0.0;
  for (const double one : recording.torque_Nm[1]) most = std::max(most, one);
  for (double& one : recording.torque_Nm[1]) one = std::min(one, 0.8 * most);
  exclude_clipped(recording, panda().robot);
  const auto result = identify({recording}, panda().robot, panda().tree);
  ASSERT_TRUE(result) << result.error().to_string();
  EXPECT_LT(result->joints[1].rms_Nm, 0.05);
  ASSERT_FALSE(result->remarks.empty());
}

// Their held-out parts had been one curve.
TEST(Recording, OfSeveralKnowWhereEachOnesHeldOutPartBegins) {
  const auto result = identify({good(), good()}, panda().robot, panda().tree);
  ASSERT_TRUE(result) << result.error().to_string();
  const JointResult& joint = result->joints[1];
  ASSERT_EQ(joint.first_of_log.size(), 2U);
  EXPECT_EQ(joint.first_of_log[0], 0U);
  EXPECT_EQ(joint.first_of_log[1], joint.time_s.size() / 2);
  EXPECT_LT(joint.time_s[joint.first_of_log[1]], joint.time_s[joint.first_of_log[1] - 1]);
}

TEST(Recording, OfNumbersThatAreNoneGivesTheSameResultWithoutThem) {
  Recording whole = good(), holed = good();
  for (std::size_t at = 4000; at < 4200; ++at) {
    holed.position_rad[1][at] = NAN;
    holed.torque_Nm[4][at] = INFINITY;
  }
  for (const std::size_t at : {7000U, 7001U}) holed.torque_Nm[0][at] = NAN;
  bridge_holes(holed);
  const auto want = identify({whole}, panda().robot, panda().tree);
  const auto got = identify({holed}, panda().robot, panda().tree);
  ASSERT_TRUE(want && got);
  EXPECT_LT(got->usable_s, want->usable_s);
  for (std::size_t i = 0; i < got->base.size(); ++i) {
    EXPECT_NEAR(got->base[i].estimate.value, want->base[i].estimate.value,
                2.0 * got->base[i].estimate.ci95 + 1e-6)
        << got->base[i].name;
  }
}

TEST(Recording, UndoesTheHoldsOfASlowPdo) {
  Signal held, smooth;
  for (int i = 0; i < 400; ++i) smooth.push_back(std::sin(0.02 * i));
  for (std::size_t i = 0; i < 400; ++i) held.push_back(smooth[i < 3 ? 0 : 3 + 4 * ((i - 3) / 4)]);
  undo_holds(held);
  for (std::size_t i = 10; i < 390; ++i) EXPECT_NEAR(held[i], smooth[i], 2e-3) << i;
  const Signal copy = smooth;
  undo_holds(smooth);
  EXPECT_EQ(smooth, copy);
}

// Parameters of a robot that never moved were said to be known: 59 of 69.
TEST(Recording, OfATeleOperatorIsNoMeasurement) {
  const tandem::test::ScratchFolder folder;
  const std::string path = folder / "operator.mcap";
  log::RunInfo info{.robot = "panda", .hal = "dds", .period_ns = 1'000'000, .operators_view = true};
  auto recorder = log::Recorder::open(path, info, {});
  ASSERT_TRUE(recorder);
  hal::StateImage state(panda().robot.shape());
  (void)(*recorder)->add_channel("/tandem/state", "tandem/msg/State", state.layout());
  (*recorder)->start();
  ASSERT_EQ((*recorder)->close().error, "");
  const auto read = read_recording(path, panda().robot);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("what a tele-operator saw"), std::string::npos);
}

/// A log of the Panda standing still, `samples` of them.
void write_still(const std::string& path, std::int64_t period_ns, std::int64_t apart_ns,
                 int samples) {
  log::RunInfo info{.robot = "panda", .hal = "import", .period_ns = period_ns};
  for (const auto& joint : panda().robot.joints) info.joints.push_back(joint.name);
  for (const auto& sensor : panda().robot.sensors)
    info.sensors.push_back({sensor.name, sensor.channels()});
  auto recorder = log::Recorder::open(path, info, {});
  ASSERT_TRUE(recorder);
  hal::StateImage state(panda().robot.shape());
  const auto channel =
      (*recorder)->add_channel("/tandem/state", "tandem/msg/State", state.layout());
  (*recorder)->start();
  for (int i = 0; i < samples; ++i) {
    (*recorder)->wait_for_space(1);
    (*recorder)->push(channel, i * apart_ns, state.bytes());
  }
  ASSERT_EQ((*recorder)->close().error, "");
}

/// A grid of 1 ns took 8 GB.
TEST(Recording, TakesNoMoreMemoryThanItsSamplesWhateverItsPeriodIsSaidToBe) {
  const tandem::test::ScratchFolder folder;
  const std::string path = folder / "log.mcap";
  for (const std::int64_t period_ns : {1L, 0L, -5L, 1'000'000'000'000L}) {
    write_still(path, period_ns, 1'000'000, 2'000);
    const auto by_its_times = [&] {
      const auto read = read_recording(path, panda().robot);
      return read ? read->rows() == 2'000 && std::abs(read->period_s - 1e-3) < 1e-9
                  : read.error().message.find("never valid") != std::string::npos;
    };
    EXPECT_IN_LITTLE_ROOM(by_its_times()) << period_ns;
  }
  write_still(path, 20'000, 10'000'000, 2'000);
  EXPECT_IN_LITTLE_ROOM(read_recording(path, panda().robot).error().message ==
                        "2000 samples lie over more than 32000 periods of 2e-05 s");
}

// Two logs that were joined: the second begins at its own time 0.
TEST(Recording, OfTimeThatGoesBackIsOneError) {
  const tandem::test::ScratchFolder folder;
  const std::string path = folder / "joined.mcap";
  log::RunInfo info{.robot = "panda", .hal = "import", .period_ns = 1'000'000};
  for (const auto& joint : panda().robot.joints) info.joints.push_back(joint.name);
  for (const auto& sensor : panda().robot.sensors) {
    info.sensors.push_back({sensor.name, sensor.channels()});
  }
  auto recorder = log::Recorder::open(path, info, {});
  ASSERT_TRUE(recorder);
  hal::StateImage state(panda().robot.shape());
  const auto channel =
      (*recorder)->add_channel("/tandem/state", "tandem/msg/State", state.layout());
  (*recorder)->start();
  for (int i = 0; i < 400; ++i) {
    (*recorder)->wait_for_space(1);
    (*recorder)->push(channel, (i % 250) * 1'000'000, state.bytes());
  }
  ASSERT_EQ((*recorder)->close().error, "");
  const auto read = read_recording(path, panda().robot);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().file, path);
  EXPECT_EQ(read.error().message, "time goes backwards in sample 250: 0.000000 s after 0.249000 s");
  EXPECT_NE(read.error().hint.find("two were joined"), std::string::npos);
}

}  // namespace
}  // namespace tandem::identification
