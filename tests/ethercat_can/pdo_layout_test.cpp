#include "hal/ethercat-can/pdo_layout.hpp"

#include "tests/ethercat_can/rig.hpp"

namespace tandem::hal::can {
namespace {

using test::robot_config;

/// One board with `axes` axes.
RobotConfig wide_board(int axes) {
  RobotConfig robot = robot_config();
  robot.sensors.clear();
  robot.boards.resize(1);
  const JointConfig joint = robot.joints[0];
  robot.joints.clear();
  for (int a = 0; a < axes; ++a) {
    robot.joints.push_back(joint);
    robot.joints.back().name = std::string("J").append(std::to_string(a));
    robot.joints.back().axis = a;
  }
  return robot;
}

std::vector<std::pair<std::uint32_t, int>> ids_and_bytes(const NodePlan& node) {
  std::vector<std::pair<std::uint32_t, int>> out;
  for (const PdoPlan& pdo : node.pdos) out.emplace_back(pdo.cob_id, pdo.bytes);
  return out;
}

TEST(PdoLayout, TwoAxesShareFourPdos) {
  const auto layout = make_pdo_layout(robot_config());
  ASSERT_TRUE(layout);
  ASSERT_EQ(layout->nodes.size(), 4u);
  const NodePlan& node = layout->nodes[1];
  EXPECT_EQ(node.joints, (std::vector<std::size_t>{2, 3}));
  EXPECT_EQ(ids_and_bytes(node), (std::vector<std::pair<std::uint32_t, int>>{
                                     {0x20B, 27}, {0x30B, 24}, {0x18B, 32}, {0x28B, 27}}));
  EXPECT_EQ(node.pdos[3].transmission, 4) << "slow_pdo_every";
}

TEST(PdoLayout, FieldsFollowOneAnotherAxisByAxis) {
  const auto layout = make_pdo_layout(robot_config());
  ASSERT_TRUE(layout);
  std::vector<std::tuple<int, int, int, int>> fields;  // index, axis, offset, size
  for (const MappedField& f : layout->nodes[0].pdos[0].fields) {
    fields.emplace_back(f.index, f.axis, f.offset, f.size);
  }
  EXPECT_EQ(fields, (std::vector<std::tuple<int, int, int, int>>{{0x6040, 0, 0, 2},
                                                                 {0x6060, 0, 2, 1},
                                                                 {0x607A, 0, 3, 4},
                                                                 {0x60B1, 0, 7, 4},
                                                                 {0x60B2, 0, 11, 2},
                                                                 {0x6840, 1, 13, 2},
                                                                 {0x6860, 1, 15, 1},
                                                                 {0x687A, 1, 16, 4},
                                                                 {0x68B1, 1, 20, 4},
                                                                 {0x68B2, 1, 24, 2},
                                                                 {0x2051, 0, 26, 1}}));
}

TEST(PdoLayout, EightAxesTakeAllEightPdos) {
  const auto layout = make_pdo_layout(wide_board(8));
  ASSERT_TRUE(layout);
  EXPECT_EQ(ids_and_bytes(layout->nodes[0]),
            (std::vector<std::pair<std::uint32_t, int>>{{0x20A, 53},
                                                        {0x30A, 52},
                                                        {0x40A, 60},
                                                        {0x50A, 36},
                                                        {0x18A, 64},
                                                        {0x28A, 64},
                                                        {0x38A, 53},
                                                        {0x48A, 52}}));
}

TEST(PdoLayout, ASensorSendsItsChannelsEverySync) {
  RobotConfig robot = robot_config();
  robot.sensors.at(0).heartbeat_ms = 700;  // it had been 50, whatever the board's was
  const auto layout = make_pdo_layout(robot);
  ASSERT_TRUE(layout);
  const NodePlan& node = layout->nodes[3];
  EXPECT_EQ(node.heartbeat_ms, 700);
  EXPECT_EQ(node.sensor, 0);
  EXPECT_EQ(node.bus, 1u);
  EXPECT_EQ(ids_and_bytes(node), (std::vector<std::pair<std::uint32_t, int>>{{0x1A8, 24}}));
  EXPECT_EQ(node.pdos[0].fields[5].index, 0x2100);
  EXPECT_EQ(node.pdos[0].fields[5].sub, 6);
}

/// The same boards and sensor with one axis a board, in frames of 8 bytes.
TEST(PdoLayout, OnClassicCanOneAxisTakesAllEightPdos) {
  const auto layout = make_pdo_layout(test::classic_config());
  ASSERT_TRUE(layout) << layout.error().to_string();
  const NodePlan& node = layout->nodes[0];
  EXPECT_EQ(node.parts, 2);
  EXPECT_EQ(ids_and_bytes(node), (std::vector<std::pair<std::uint32_t, int>>{{0x20A, 8},
                                                                             {0x30A, 6},
                                                                             {0x40A, 8},
                                                                             {0x50A, 4},
                                                                             {0x18A, 8},
                                                                             {0x28A, 8},
                                                                             {0x38A, 8},
                                                                             {0x48A, 6}}));
  std::vector<std::vector<int>> objects;
  for (const PdoPlan& pdo : node.pdos) {
    objects.emplace_back();
    for (const MappedField& field : pdo.fields) objects.back().push_back(field.index);
  }
  EXPECT_EQ(objects, (std::vector<std::vector<int>>{{0x6040, 0x607A, 0x60B2},
                                                    {0x60B1, 0x6060, 0x2051},
                                                    {0x2012, 0x2013, 0x2010},
                                                    {0x2011},
                                                    {0x6041, 0x6064, 0x6077},
                                                    {0x606C, 0x2000},
                                                    {0x2001, 0x2002, 0x2003},
                                                    {0x2004, 0x6061, 0x603F, 0x2051}}));
}

TEST(PdoLayout, ASensorOnClassicCanSendsTwoChannelsATpdo) {
  const auto layout = make_pdo_layout(test::classic_config());
  ASSERT_TRUE(layout);
  EXPECT_EQ(ids_and_bytes(layout->nodes[3]),
            (std::vector<std::pair<std::uint32_t, int>>{{0x1A8, 8}, {0x2A8, 8}, {0x3A8, 8}}));
  EXPECT_EQ(layout->nodes[3].parts, 3);
}

TEST(PdoLayout, RefusesWhatClassicFramesCannotCarryWithTheReason) {
  RobotConfig robot = test::classic_config();
  robot.boards[1].bus = "legs";
  robot.joints[1].board = robot.boards[0].name;
  robot.joints[1].axis = 1;
  const auto two_axes = make_pdo_layout(robot);
  ASSERT_FALSE(two_axes);
  EXPECT_EQ(two_axes.error().message,
            "has 2 axes, and its bus is classic CAN: in frames of 8 bytes one axis takes all "
            "eight PDOs of a node");
  robot = test::classic_config();
  robot.sensors[0].type = SensorType::kImu;
  const auto imu = make_pdo_layout(robot);
  ASSERT_FALSE(imu);
  EXPECT_EQ(imu.error().key, "sensor 'foot'");
  EXPECT_EQ(imu.error().message, "has 10 channels, and four PDOs on a classic CAN bus carry 8");
}

TEST(PdoLayout, RefusesAxesWithAGapAndANinthAxis) {
  RobotConfig robot = robot_config();
  robot.joints[1].axis = 2;
  const auto gap = make_pdo_layout(robot);
  ASSERT_FALSE(gap);
  EXPECT_EQ(gap.error().message, "axis 1 has no joint");
  EXPECT_FALSE(make_pdo_layout(wide_board(9)));
}

}  // namespace
}  // namespace tandem::hal::can
