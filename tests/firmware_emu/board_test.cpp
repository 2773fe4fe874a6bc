// The board's end of the wire: literal frames, the dictionary's guards, several axes.
#include "firmware_emu/board.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "canopen/data_sheet.hpp"
#include "rig.hpp"

namespace tandem::firmware::testing {
namespace {

using canopen::DriveMachineState;
using canopen::Frame;

TEST(Board, SaysBootUpAndAnswersWhoItIs) {
  Rig rig;
  rig.step();
  ASSERT_EQ(rig.seen.size(), 1U);
  EXPECT_EQ(rig.seen[0].id, 0x705U);
  EXPECT_EQ(rig.seen[0].length, 1);
  EXPECT_EQ(rig.seen[0].data[0], 0x00);
  EXPECT_EQ(rig.read<std::uint32_t>(0x1000, 0), 0x00020192U);
  EXPECT_EQ(rig.read<std::uint32_t>(0x1018, 1), 0x7A4DU);
  EXPECT_EQ(rig.read<std::uint32_t>(0x1018, 4), 0x12345678U);
  EXPECT_EQ(rig.read<std::uint32_t>(0x6502, 0), 0x000F03A0U);
}

/// The master takes a board without a sheet at this one's word.
TEST(Board, HasWhatTheSheetOfOurBoardsSays) {
  BoardSetup setup;
  setup.axes.resize(canopen::kMaxAxes);
  const Board board(setup);
  const auto sheet = canopen::tandem_board_sheet();
  ASSERT_GT(sheet->entries.size(), 400U);
  for (const canopen::SheetEntry& entry : sheet->entries) {
    const canopen::ObjectEntry* object = board.dictionary().find(entry.index, entry.sub);
    ASSERT_NE(object, nullptr) << std::hex << entry.index << ':' << int{entry.sub};
    EXPECT_EQ(static_cast<int>(object->type), entry.type) << std::hex << entry.index;
    EXPECT_EQ(object->access, entry.access) << std::hex << entry.index << ':' << int{entry.sub};
  }
}

TEST(Board, TellsItsFirmwareVersion) {
  Rig rig;
  std::array<std::uint8_t, 64> text{};
  std::size_t length = 0;
  ASSERT_EQ(rig.board.dictionary().read(0x100A, 0, text, length), canopen::AbortCode::kNone);
  EXPECT_EQ(std::string(text.begin(), text.begin() + length), "tandem firmware 1.0");
}

TEST(Board, SendsInItsPdoWhatTheSensorsSayAtTheSync) {
  Rig rig;
  rig.start();
  rig.cycles(2);
  rig.joints[0].q = rig.joints[0].th = 0.5;
  for (int k = 0; k < 100; ++k) rig.cycle();  // the step of the position has left the velocity
  rig.joints[0].th = 0.5 + 5.0 / rig.joints[0].Ks;
  rig.seen.clear();
  rig.cycle();
  const auto frames = rig.frames_of(0x185);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].length, 16);
  const std::vector<std::uint8_t> bytes(frames[0].data.begin(), frames[0].data.begin() + 16);
  const std::vector<std::uint8_t> wanted{0x50, 0x02,               // switch on disabled, remote
                                         0xFA, 0xA2, 0x00, 0x00,   // 41722 counts
                                         0x00, 0x00, 0x00, 0x00,   // counts/s
                                         0x64, 0x00,               // 100 per mille of 50 Nm
                                         0x16, 0x05, 0x01, 0x00};  // 66838 motor counts
  EXPECT_EQ(bytes, wanted);
}

TEST(Board, TakesACommandAtTheSyncAfterIt) {
  Rig rig;
  rig.start();
  rig.send_commands = false;
  rig.cycles(2);
  const std::vector<std::uint8_t> command{0x06, 0x00, 0xFF, 0x78, 0x56, 0x34, 0x12,
                                          0xFE, 0xFF, 0xFF, 0xFF, 0x38, 0xFF};  // padded to 16
  rig.send(0x205, command);
  rig.step();
  EXPECT_EQ(rig.object<std::uint16_t>(0x6040), 0x00);
  rig.cycle();
  EXPECT_EQ(rig.object<std::uint16_t>(0x6040), 0x06);
  EXPECT_EQ(rig.object<std::int8_t>(0x6060), -1);
  EXPECT_EQ(rig.object<std::int32_t>(0x607A), 0x12345678);
  EXPECT_EQ(rig.object<std::int32_t>(0x60B1), -2);
  EXPECT_EQ(rig.object<std::int16_t>(0x60B2), -200);
  EXPECT_EQ(rig.state(), DriveMachineState::kReadyToSwitchOn);
}

TEST(Board, IgnoresAndCountsWhatIsNoDataFrame) {
  Rig rig;
  rig.start();
  rig.cycles(2);
  Frame remote;
  remote.id = 0x185;
  remote.flags = canopen::kFlagRtr;
  rig.give(remote);
  Frame too_long;
  too_long.id = 0x205;
  too_long.length = 9;
  rig.give(too_long);
  Frame no_fd;
  no_fd.id = 0x205;
  no_fd.length = 16;
  rig.give(no_fd);
  Frame beyond;
  beyond.id = 0x800;
  rig.give(beyond);
  EXPECT_EQ(rig.object<std::uint32_t>(0x2050), 4U);
  rig.send(0x3FF, {1, 2, 3});  // of somebody else
  rig.send(0x000, {77, 5});    // no NMT command
  EXPECT_EQ(rig.object<std::uint32_t>(0x2050), 4U);
  EXPECT_EQ(rig.board.nmt_state(), canopen::NmtState::kOperational);
}

TEST(Board, AnswersARemoteRequestWhereItsTpdoAllowsOne) {
  Rig rig;
  rig.start();
  rig.map(0x1801, 0x1A01, 0x285, {0x60410010, 0x60770010});
  rig.write<std::uint32_t>(0x1802, 1, 0xC0000385);
  rig.map(0x1802, 0x1A02, 0x40000385, {0x60410010});
  rig.cycles(2);
  const auto answers = [&rig](std::uint32_t id) {
    rig.seen.clear();
    rig.give({.id = id, .length = 4, .flags = canopen::kFlagRtr});
    return rig.frames_of(id);
  };
  ASSERT_EQ(answers(0x285).size(), 1U);
  EXPECT_EQ(answers(0x285)[0], canopen::make_frame(0x285, std::array<std::uint8_t, 4>{0x50, 2}));
  EXPECT_EQ(answers(0x385).size(), 0U) << "bit 30: not allowed";
  EXPECT_EQ(answers(0x185).size(), 0U) << "16 bytes travel in CAN FD, which has no requests";
  EXPECT_EQ(rig.object<std::uint32_t>(0x2050), 2U);
  rig.nmt(128);
  EXPECT_EQ(answers(0x285).size(), 0U) << "not operational";
}

TEST(Board, OnAClassicBusMapsNoMoreThanEightBytes) {
  BoardSetup setup = board_setup();
  setup.max_pdo_bytes = 8;
  Rig rig(setup);
  rig.step();
  ASSERT_EQ(rig.write<std::uint32_t>(0x1A00, 1, 0x60640020), 0U);
  ASSERT_EQ(rig.write<std::uint32_t>(0x1A00, 2, 0x606C0020), 0U);
  ASSERT_EQ(rig.write<std::uint32_t>(0x1A00, 3, 0x20000020), 0U);
  EXPECT_EQ(rig.write<std::uint8_t>(0x1A00, 0, 3), 0x06040042U);
  EXPECT_EQ(rig.write<std::uint8_t>(0x1A00, 0, 2), 0U);
}

TEST(Board, DoesNotProcessAPdoThatIsTooShort) {
  Rig rig;
  rig.start();
  rig.send_commands = false;
  rig.cycles(2);
  rig.seen.clear();
  rig.send(0x205, {0x06, 0x00, 0xFF});
  const auto emergencies = rig.frames_of(0x085);
  ASSERT_EQ(emergencies.size(), 1U);
  EXPECT_EQ(emergencies[0].data[0], 0x10);
  EXPECT_EQ(emergencies[0].data[1], 0x82);
  rig.cycles(2);
  EXPECT_EQ(rig.object<std::uint16_t>(0x6040), 0x00);
}

TEST(Board, RefusesSettingsThatAreNoNumberOrOfTheWrongSign) {
  Rig rig;
  rig.start();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const int object :
       {0x2020, 0x2021, 0x2022, 0x2023, 0x2024, 0x2030, 0x2031, 0x2026, 0x2027}) {
    const auto index = static_cast<std::uint16_t>(object);
    const float before = rig.object<float>(index, 1);
    EXPECT_EQ(rig.write(index, 1, nan), 0x06090030U) << std::hex << index;
    EXPECT_EQ(rig.write(index, 1, infinity), 0x06090030U) << std::hex << index;
    EXPECT_EQ(rig.write(index, 1, -1.0F), 0x06090032U) << std::hex << index;
    EXPECT_EQ(rig.object<float>(index, 1), before);
  }
  EXPECT_EQ(rig.write(0x2010, 0, nan), 0x06090030U);
  EXPECT_EQ(rig.write(0x2011, 0, -0.5F), 0x06090032U);
  EXPECT_EQ(rig.write<std::int16_t>(0x605A, 0, 3), 0x06090030U);
  EXPECT_EQ(rig.write<std::uint8_t>(0x2025, 0, 2), 0x06090031U);
  EXPECT_EQ(rig.write<std::int32_t>(0x607D, 1, rig.object<std::int32_t>(0x607D, 2) + 1),
            0x06090036U);
  EXPECT_EQ(rig.write<std::uint16_t>(0x6041, 0, 0), 0x06010002U);          // read-only
  EXPECT_EQ(rig.write<std::uint16_t>(0x6041 + 0x800, 0, 0), 0x06020000U);  // there is one axis
}

TEST(Board, RefusesToChangeTheMeaningOfPositionsUnderPower) {
  Rig rig;
  rig.start();
  EXPECT_EQ(rig.write<std::uint32_t>(0x608F, 1, 524288), 0U);
  rig.enable();
  EXPECT_EQ(rig.write<std::uint32_t>(0x608F, 1, 1000), 0x08000022U);
  EXPECT_EQ(rig.write<std::uint32_t>(0x2033, 0, 1000), 0x08000022U);
  EXPECT_EQ(rig.write<std::uint32_t>(0x6076, 0, 1000), 0x08000022U);
}

TEST(Board, TakesGainsAndLimitsAtRunTime) {
  Rig rig;
  rig.start();
  rig.enable();
  ASSERT_EQ(rig.write(0x2020, 1, 250.0F), 0U);
  ASSERT_EQ(rig.write(0x2030, 3, 20.0F), 0U);
  ASSERT_EQ(rig.write<std::uint16_t>(0x6072, 0, 300), 0U);  // 15 Nm, the smaller one
  rig.cycle();
  EXPECT_EQ(rig.board.axis(0).controller().config().position.kp, 250.0);
  EXPECT_DOUBLE_EQ(rig.board.axis(0).controller().config().torque_limit_Nm, 15.0);
}

TEST(Board, KeepsItsStiffnessWhenAPdoBringsNone) {
  Rig rig;
  rig.start();
  rig.nmt(128);
  rig.map(0x1401, 0x1601, 0x305, {0x20100020, 0x20110020});
  rig.nmt(1);
  rig.send(0x305, {0x00, 0x00, 0x48, 0x42, 0x00, 0x00, 0xC0, 0x3F});  // 50, 1.5
  rig.cycle();
  EXPECT_EQ(rig.object<float>(0x2010), 50.0F);
  EXPECT_EQ(rig.object<float>(0x2011), 1.5F);
  rig.send(0x305, {0x00, 0x00, 0xC0, 0x7F, 0x00, 0x00, 0x80, 0xBF});  // NaN, -1
  rig.cycle();
  EXPECT_EQ(rig.object<float>(0x2010), 50.0F);
  EXPECT_EQ(rig.object<float>(0x2011), 1.5F);
  EXPECT_EQ(rig.object<std::uint32_t>(0x2041), 2U);
}

TEST(Board, RunsSeveralAxesEachWithItsOwnFault) {
  Rig rig(board_setup(4));
  rig.start();
  rig.enable(10);
  for (int a = 0; a < 4; ++a) {
    rig.commands[a].torque_offset = static_cast<std::int16_t>(40 * a);
  }
  rig.cycles(1500);
  for (int a = 0; a < 4; ++a) {
    EXPECT_EQ(rig.state(a), DriveMachineState::kOperationEnabled);
    EXPECT_NEAR(rig.joints[a].torque(), 2.0 * a, 0.05);
  }
  rig.seen.clear();
  rig.joints[2].temperature_C = 150.0;
  rig.cycles(1200);
  EXPECT_EQ(rig.state(2), DriveMachineState::kFault);
  EXPECT_EQ(rig.error(2), 0x4310);
  EXPECT_EQ(rig.state(1), DriveMachineState::kOperationEnabled);
  EXPECT_EQ(rig.state(3), DriveMachineState::kOperationEnabled);
  const auto emergencies = rig.frames_of(0x085);
  ASSERT_EQ(emergencies.size(), 1U);
  EXPECT_EQ(emergencies[0].data[3], 2);  // the axis
}

TEST(Board, HasEveryObjectOfEveryAxis) {
  const BoardSetup setup = board_setup(canopen::kMaxAxes);
  const Board board(setup);
  for (int axis = 0; axis < canopen::kMaxAxes; ++axis) {
    for (const int index :
         {0x6007, 0x603F, 0x6040, 0x6041, 0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x6060, 0x6061,
          0x6064, 0x6065, 0x6066, 0x606C, 0x6071, 0x6072, 0x6076, 0x6077, 0x607A, 0x607D, 0x608F,
          0x60B1, 0x60B2, 0x60F4, 0x60FF, 0x6502, 0x2000, 0x2001, 0x2002, 0x2003, 0x2004, 0x2010,
          0x2011, 0x2012, 0x2013, 0x2020, 0x2021, 0x2022, 0x2023, 0x2024, 0x2025, 0x2026, 0x2027,
          0x2028, 0x2030, 0x2031, 0x2032, 0x2033, 0x2034, 0x2035, 0x2036, 0x2037, 0x2038, 0x2039,
          0x203A, 0x2040, 0x2041, 0x6087, 0x60FD, 0x60FE}) {
      const std::uint16_t at = canopen::of_axis(static_cast<std::uint16_t>(index), axis);
      EXPECT_NE(board.dictionary().find(at, 0), nullptr) << std::hex << at;
    }
  }
  EXPECT_NE(board.dictionary().find(0x1A03, 0), nullptr);  // the node's found room too
}

TEST(Board, HoldsTheVoltageBetweenItsControlPeriods) {
  BoardSetup setup = board_setup();
  setup.control_period_ns = 2'000'000;
  Rig rig(setup);
  rig.joints[0].link_inertia = 0.5;
  rig.start();
  rig.enable();
  rig.cycles(4);
  rig.commands[0].position = Rig::counts(0.1);
  int changes = 0;
  double before = rig.drives[0].voltage_V;
  for (int k = 0; k < 40; ++k) {
    rig.cycle();
    changes += rig.drives[0].voltage_V != before ? 1 : 0;
    before = rig.drives[0].voltage_V;
  }
  EXPECT_NEAR(changes, 20, 1);
}

TEST(Board, IsRefusedWithABadSetup) {
  EXPECT_TRUE(check(board_setup()).has_value());
  BoardSetup setup = board_setup();
  setup.node_id = 128;
  EXPECT_FALSE(check(setup).has_value());
  setup = board_setup(0);
  EXPECT_FALSE(check(setup).has_value());
  setup = board_setup(9);
  EXPECT_FALSE(check(setup).has_value());
  setup = board_setup(2);
  setup.axes[1].parameters.torque.kp = -0.1;
  ASSERT_FALSE(check(setup).has_value());
  EXPECT_EQ(check(setup).error().key, "axes[1]");
  setup = board_setup();
  setup.axes[0].parameters.resistance_ohm = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(check(setup).has_value());
  setup = board_setup();
  setup.axes[0].parameters.link_counts_per_rev = 0.0;
  EXPECT_FALSE(check(setup).has_value());
  setup = board_setup();
  setup.control_period_ns = 0;
  EXPECT_FALSE(check(setup).has_value());
  setup = board_setup();
  std::swap(setup.axes[0].parameters.min_position_rad, setup.axes[0].parameters.max_position_rad);
  EXPECT_FALSE(check(setup).has_value());
}

}  // namespace
}  // namespace tandem::firmware::testing
