#include "firmware_emu/sensor_board.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "firmware_emu/setup.hpp"
#include "rt/scoped_realtime.hpp"

namespace tandem::firmware {
namespace {

using canopen::Frame;
using canopen::make_frame;

SensorSetup setup() {
  SensorSetup sensor;
  sensor.node_id = 9;
  sensor.channels = 6;
  return sensor;
}

/// A node with its channels in TPDO 1 at every SYNC, started.
struct Node {
  explicit Node(const SensorSetup& sensor) : board(sensor) {
    cycle({});
    sdo({0x23, 0x00, 0x18, 0x01, 0x89, 0x01, 0x00, 0x80});
    sdo({0x2F, 0x00, 0x18, 0x02, 0x01, 0x00, 0x00, 0x00});
    for (std::uint8_t c = 1; c <= sensor.channels; ++c) {
      sdo({0x23, 0x00, 0x1A, c, 0x20, c, 0x00, 0x21});
    }
    sdo({0x2F, 0x00, 0x1A, 0x00, static_cast<std::uint8_t>(sensor.channels), 0, 0, 0});
    sdo({0x23, 0x00, 0x18, 0x01, 0x89, 0x01, 0x00, 0x00});
    give(0x000, {1, 9});
  }
  void give(std::uint32_t id, const std::vector<std::uint8_t>& bytes) {
    const Frame frame = make_frame(id, bytes);
    const rt::ScopedRealtime cycle;
    board.receive(frame);
  }
  void sdo(const std::vector<std::uint8_t>& bytes) {
    give(0x609, bytes);
    ASSERT_EQ(board.outgoing().size(), 1U);
    EXPECT_EQ(board.outgoing()[0].data[0], 0x60);
    board.clear_outgoing();
  }
  /// @return the frames after a SYNC with this truth.
  std::vector<Frame> cycle(std::vector<double> truth) {
    truth.resize(6, 0.0);
    give(0x080, {});
    {
      const rt::ScopedRealtime cycle;
      board.step(1'000'000, truth);
    }
    std::vector<Frame> frames(board.outgoing().begin(), board.outgoing().end());
    board.clear_outgoing();
    return frames;
  }
  SensorBoard board;
};

TEST(SensorBoard, SendsItsChannelsInTheirOrderAtTheSync) {
  Node node(setup());
  const auto frames = node.cycle({1.0, -2.5, 300.0, 0.0, 0.125, -1.0e-3});
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].id, 0x189U);
  ASSERT_EQ(frames[0].length, 24);
  const std::vector<std::uint8_t> bytes(frames[0].data.begin(), frames[0].data.begin() + 24);
  const std::vector<std::uint8_t> wanted{0x00, 0x00, 0x80, 0x3F, 0x00, 0x00, 0x20, 0xC0,
                                         0x00, 0x00, 0x96, 0x43, 0x00, 0x00, 0x00, 0x00,
                                         0x00, 0x00, 0x00, 0x3E, 0x6F, 0x12, 0x83, 0xBA};
  EXPECT_EQ(bytes, wanted);
}

TEST(SensorBoard, SendsNothingWithoutASync) {
  Node node(setup());
  node.board.step(1'000'000, std::vector<double>(6, 1.0));
  EXPECT_TRUE(node.board.outgoing().empty());
}

TEST(SensorBoard, KeepsTheLastValueWhenTheTruthIsNoNumber) {
  Node node(setup());
  node.cycle({1.0, 2.0});
  node.cycle({std::numeric_limits<double>::quiet_NaN(), 3.0});
  EXPECT_EQ(node.board.channels()[0], 1.0F);
  EXPECT_EQ(node.board.channels()[1], 3.0F);
}

TEST(SensorBoard, AddsSeededNoiseAndBiasPerChannel) {
  SensorSetup sensor = setup();
  sensor.noise = {0.5, 0.0, 0.0, 0.0, 0.0, 0.1};
  sensor.bias = {0.0, 3.0, 0.0, 0.0, 0.0, 0.0};
  Node one(sensor);
  Node same(sensor);
  sensor.seed = 2;
  Node other(sensor);
  double sum = 0.0;
  double squares = 0.0;
  int equal = 0;
  for (int k = 0; k < 4000; ++k) {
    one.cycle({10.0});
    same.cycle({10.0});
    other.cycle({10.0});
    ASSERT_EQ(one.board.channels()[0], same.board.channels()[0]);
    equal += one.board.channels()[0] == other.board.channels()[0] ? 1 : 0;
    const double error = one.board.channels()[0] - 10.0;
    sum += error;
    squares += error * error;
    ASSERT_EQ(one.board.channels()[1], 3.0F);
    ASSERT_EQ(one.board.channels()[2], 0.0F);
  }
  EXPECT_NEAR(sum / 4000, 0.0, 0.04);
  EXPECT_NEAR(std::sqrt(squares / 4000), 0.5, 0.03);
  EXPECT_LT(equal, 10);
}

TEST(SensorBoard, NoiseTurnsAQuaternionAndDoesNotStretchIt) {
  SensorSetup sensor = setup();
  sensor.orients = true;
  sensor.noise.assign(6, 0.05);
  Node node(sensor);
  double squares = 0.0;
  for (int k = 0; k < 2000; ++k) {
    node.cycle({0.0, 0.0, 0.6, 0.8, 5.0});
    const auto q = node.board.channels();
    ASSERT_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1.0, 1e-6);
    squares += q[0] * q[0];
  }
  EXPECT_NEAR(std::sqrt(squares / 2000), 0.05, 0.005);
}

TEST(SensorBoard, GoesOnFromASnapshotWithTheSameNoise) {
  SensorSetup sensor = setup();
  sensor.noise.assign(6, 0.2);
  Node node(sensor);
  for (int k = 0; k < 10; ++k) node.cycle({1.0, 2.0});
  Archive saved;
  node.board.archive(saved);
  std::vector<std::vector<Frame>> first;
  for (int k = 0; k < 20; ++k) first.push_back(node.cycle({1.0, 2.0}));
  Archive load(saved.bytes());
  node.board.archive(load);
  EXPECT_TRUE(load.ok() && load.at_end());
  for (int k = 0; k < 20; ++k) EXPECT_EQ(node.cycle({1.0, 2.0}), first[k]);
}

TEST(SensorBoard, IsRefusedWithABadSetup) {
  EXPECT_TRUE(check(setup()).has_value());
  SensorSetup bad = setup();
  bad.node_id = 0;
  EXPECT_FALSE(check(bad).has_value());
  bad = setup();
  bad.channels = 17;
  EXPECT_FALSE(check(bad).has_value());
  bad = setup();
  bad.noise = {0.1};
  EXPECT_FALSE(check(bad).has_value());
  bad.noise.assign(6, -0.1);
  EXPECT_FALSE(check(bad).has_value());
  bad = setup();
  bad.bias.assign(6, std::numeric_limits<double>::infinity());
  EXPECT_FALSE(check(bad).has_value());
}

}  // namespace
}  // namespace tandem::firmware
