// Bags that nothing of Tandem wrote (tests/data/recordings).
#include <filesystem>

#include "tests/log_import/rig.hpp"

namespace tandem::log {
namespace {

using namespace test;

const std::string kFolder = TANDEM_SOURCE_DIR "/tests/data/recordings/";
const std::string kTime = "[time]\nperiod_s = 0.01\n[bag]\nstamp = \"header\"\n";

// As tests/log/write_bags.mjs has them.
double position(int joint, double t) { return joint == 0 ? 0.4 * std::sin(2 * t) : 0.3 - 0.1 * t; }
double velocity(int joint, double t) { return joint == 0 ? 0.8 * std::cos(2 * t) : -0.1; }
double effort(int joint, double t) { return joint == 0 ? 2 * std::cos(t) : std::sin(3 * t); }

class Bag : public Import {};

TEST_F(Bag, WithZstdAndOtherNames) {
  const std::string map = "ignore = [\"finger\"]\nallow_frozen = true\n" + kTime +
                          "[bag.names]\narm_1 = \"joint1\"\narm_2 = \"joint2\"\n";
  const ImportSummary done = imported({kFolder + "zstd.mcap"}, map);
  EXPECT_TRUE(done.bag);
  EXPECT_EQ(done.cycles, 100U);
  EXPECT_EQ(done.begin_ns, 1'700'000'000'000'000'000);
  EXPECT_EQ(done.excluded.ignored, std::vector<std::string>{"finger"});
  const TimeSeries read = table({{"position_rad", 0},
                                 {"position_rad", 1},
                                 {"velocity_rad_s", 0},
                                 {"torque_nm", 0},
                                 {"torque_nm", 1},
                                 {"age_cycles", 1}});
  for (int i = 0; i < 100; ++i) {
    const double t = i * 0.01;
    EXPECT_NEAR(read.columns[0][i], position(0, t), 1e-15);
    EXPECT_NEAR(read.columns[1][i], position(1, t), 1e-15);
    EXPECT_NEAR(read.columns[2][i], velocity(0, t), 1e-15);
    EXPECT_NEAR(read.columns[3][i], effort(0, t), 1e-15);
    EXPECT_NEAR(read.columns[4][i], effort(1, t), 1e-15);
    EXPECT_EQ(read.columns[5][i], 0.0);
  }
}

TEST_F(Bag, AsksWhatItDoesNotSay) {
  const std::string file = kFolder + "zstd.mcap";
  EXPECT_HAS(refusal({file}, kTime), "the recording's joint 'finger' is none of the robot's");
  const std::string ignored = "ignore = [\"*\"]\nallow_frozen = true\n";
  EXPECT_HAS(refusal({file}, ignored + kTime), "has no joint states of this robot");
  EXPECT_HAS(refusal({file}, ignored + kTime + "[bag.names]\narm_1 = \"joint1\"\n"),
             "lacks the robot's joint 'joint2'");
  const std::string names = "[bag.names]\narm_1 = \"joint1\"\narm_2 = \"joint2\"\n";
  EXPECT_HAS(refusal({file}, ignored + "[time]\nperiod_s = 0.01\n" + names),
             "bag.stamp: which time is a sample's: its header's stamp, or when it was logged? It "
             "was logged 1.500000 ms to 2.100000 ms after its stamp, 1.800000 ms on the median");
  EXPECT_HAS(refusal({file}, ignored + "[bag]\nstamp = \"log\"\n" + names),
             "how long is a cycle of the log?");
  EXPECT_HAS(refusal({file}, ignored + kTime + "joint_states = \"/joint_state\"\n" + names),
             "did you mean '/joint_states'?");
  EXPECT_HAS(refusal({file}, kTime + names), "finger");
  EXPECT_HAS(refusal({file}, "ignore = [\"finger\"]\n" + kTime + names),
             "velocity: never changes in 100 samples");
}

TEST_F(Bag, WithoutChunksInBigEndianFromSeveralPublishers) {
  const std::string file = kFolder + "big_endian.mcap";
  const ImportSummary done = imported({file}, kTime);
  EXPECT_EQ(done.cycles, 100U);
  EXPECT_EQ(done.fields, (std::vector<std::string>{"position_rad", "torque_nm"}));
  const TimeSeries read = table({{"position_rad", 0},
                                 {"position_rad", 1},
                                 {"torque_nm", 0},
                                 {"torque_nm", 1},
                                 {"velocity_rad_s", 0}});
  for (int i = 0; i < 100; ++i) {
    const double t = i * 0.01;
    EXPECT_NEAR(read.columns[0][i], position(0, t), 1e-15);
    EXPECT_NEAR(read.columns[1][i], position(1, t), 1e-15);
    EXPECT_NEAR(read.columns[2][i], effort(0, t), 1e-15);
    EXPECT_TRUE(std::isnan(read.columns[3][i]));
    EXPECT_TRUE(std::isnan(read.columns[4][i]));
  }
  // By log time the second joint is a microsecond later: its samples lie between.
  const ImportSummary logged =
      imported({file}, "[time]\nperiod_s = 0.01\n[bag]\nstamp = \"log\"\n");
  EXPECT_EQ(logged.begin_ns, 1'700'000'000'000'001'000);
  EXPECT_EQ(logged.cycles, 99U);
  EXPECT_NEAR(table({{"position_rad", 0}}).columns[0][1], position(0, 0.010001), 1e-8);
}

// "none of the robot's (… did you mean 'joint1'?)" was said of joint1.
TEST_F(Bag, WhoseJointWasGivenToAnotherNameSaysSo) {
  EXPECT_HAS(refusal({kFolder + "big_endian.mcap"}, kTime + "[bag.names]\nfoo = \"joint1\"\n"),
             "the recording's joint 'joint1' has the name of a joint that [bag.names] gives to "
             "another");
}

TEST_F(Bag, WithSensorsAtRatesOfTheirOwn) {
  const std::string file = kFolder + "lz4.mcap";
  const std::string ft = "[sensor.ft]\ntopic = \"/ft\"\nmeasures = \"parent_on_child\"\n";
  const std::string head = "allow_frozen = true\n" + kTime;
  EXPECT_HAS(refusal({file}, head + ft),
             "sensor.ft.frame: the messages of /ft are in the frame 'ft_frame', the robot's sensor "
             "is in that of 'link2'");
  const std::string imu = "[sensor.imu]\ntopic = \"/imu\"\n";
  const ImportSummary done = imported({file}, head + ft + "frame = \"ft_frame\"\n" + imu);
  EXPECT_EQ(done.cycles, 60U);
  const TimeSeries read = table({{"sensor", 0},
                                 {"sensor", 2},
                                 {"sensor", 4},
                                 {"sensor", 6},
                                 {"sensor", 9},
                                 {"sensor", 11},
                                 {"sensor", 14}});
  for (int i = 0; i < 59; ++i) {  // the last cycle has no IMU sample: it is held
    const double t = i * 0.01;
    EXPECT_NEAR(read.columns[0][i], -1 - t, 1e-15);
    EXPECT_NEAR(read.columns[1][i], 30 * t, 1e-14);
    EXPECT_NEAR(read.columns[2][i], -t, 1e-15);
    EXPECT_NEAR(read.columns[3][i], std::sin(t), 1e-4) << "between two samples the chord is short";
    EXPECT_NEAR(std::hypot(read.columns[3][i], read.columns[4][i]), 1.0, 1e-15);
    EXPECT_NEAR(read.columns[5][i], t, 1e-15);
    EXPECT_NEAR(read.columns[6][i], 9.8 * t, 1e-14);
  }
  EXPECT_HAS(refusal({file}, head + "[sensor.imu]\ntopic = \"/ft\"\n"),
             "the topic '/ft' has messages of geometry_msgs/msg/WrenchStamped");
  EXPECT_HAS(refusal({file}, head + "[sensor.imu]\ntopic = \"/imi\"\n"),
             "has no topic '/imi' (did you mean '/imu'?");
}

TEST_F(Bag, ThatIsCutOrDamagedIsRefused) {
  const std::string whole = text_of(kFolder + "big_endian.mcap");
  const std::string cut = write("cut.mcap", whole.substr(0, whole.size() / 2));
  EXPECT_HAS(refusal({cut}, kTime), "cut.mcap: the file is cut after");
  std::string odd = whole;
  const auto at = odd.find("joint1");
  odd[at - 1] = '\x77';  // the length of the name
  EXPECT_HAS(refusal({write("odd.mcap", odd)}, kTime), "message 1 of /joint_states:");
  EXPECT_HAS(refusal({kFolder + "big_endian.mcap", kFolder + "zstd.mcap"}, kTime),
             "the recording's joint 'finger'");
  EXPECT_HAS(refusal({kFolder + "big_endian.mcap", kFolder + "big_endian.mcap"}, kTime),
             "sample 101: time goes back");
}

}  // namespace
}  // namespace tandem::log
