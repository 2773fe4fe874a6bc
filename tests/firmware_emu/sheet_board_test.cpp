// A board that stands in for another maker's drive: the dictionary of its sheet, and the modes in
// which a drive makes its own way.
#include <algorithm>
#include <iterator>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "canopen/data_sheet.hpp"
#include "firmware_emu/sheet_dictionary.hpp"
#include "tests/firmware_emu/rig.hpp"

namespace tandem::firmware::testing {
namespace {

using canopen::DataSheet;
using canopen::SheetEntry;

constexpr std::uint32_t kNoObject = 0x06020000;
constexpr std::uint32_t kReadOnly = 0x06010002;
constexpr std::uint32_t kTooHigh = 0x06090031;
constexpr int kControlword = 0x6040;

DataSheet sheet_of(const char* name) {
  auto sheet = canopen::load_data_sheet(std::string(TANDEM_SOURCE_DIR) + "/config/drives/" + name);
  if (!sheet) throw std::runtime_error(sheet.error().to_string());
  return std::move(*sheet);
}

SheetEntry number(std::uint16_t index, std::uint8_t sub, canopen::DataType type,
                  std::int64_t value) {
  return {.index = index,
          .sub = sub,
          .type = static_cast<std::uint16_t>(type),
          .access = canopen::kWriteRpdo,
          .value = canopen::SheetValue{.number = value}};
}

/// The servo's sheet, with profile modes and homing as well.
DataSheet servo_with_profiles() {
  using enum canopen::DataType;
  DataSheet sheet = sheet_of("servo.eds");
  const auto modes = std::ranges::find(sheet.entries, 0x6502, &SheetEntry::index);
  modes->value->number = 0x3AD;
  for (const SheetEntry& entry :
       {number(0x6081, 0, kUnsigned32, 400'000), number(0x6083, 0, kUnsigned32, 2'000'000),
        number(0x6084, 0, kUnsigned32, 2'000'000), number(0x6087, 0, kUnsigned32, 1'000),
        number(0x607C, 0, kInteger32, -1'000), number(0x6098, 0, kInteger8, 17),
        number(0x6099, 1, kUnsigned32, 200'000), number(0x6099, 2, kUnsigned32, 20'000),
        number(0x609A, 0, kUnsigned32, 1'000'000)}) {
    std::erase_if(sheet.entries, [&](const SheetEntry& e) {
      return e.index == entry.index && e.sub == entry.sub;
    });
    sheet.entries.push_back(entry);
  }
  std::ranges::sort(sheet.entries, {},
                    [](const SheetEntry& e) { return std::uint32_t{e.index} << 8 | e.sub; });
  return sheet;
}

BoardSetup stand_in(DataSheet sheet) {
  BoardSetup setup = board_setup();
  setup.sheet = std::make_shared<const DataSheet>(std::move(sheet));
  setup.vendor = setup.sheet->vendor.value_or(0);
  setup.product = setup.sheet->product.value_or(0);
  setup.max_pdo_bytes = 8;
  setup.axes[0].parameters.command_timeout_syncs = 0.0;
  setup.axes[0].modes = emulated_modes(*setup.sheet, 0);
  return setup;
}

/// Commands by SDO: what a hand at the bus would send.
class StandIn : public Rig {
 public:
  explicit StandIn(const BoardSetup& setup) : Rig(setup) {
    send_commands = false;
    for (TestJoint& joint : joints) joint.link_inertia = 0.2;
    step();
    nmt(1);
  }
  void word(int value, int periods = 3) {
    ASSERT_EQ(write(kControlword, 0, static_cast<std::uint16_t>(value)), 0U);
    cycles(periods);
  }
  void enable_by_sdo(int mode) {
    ASSERT_EQ(write(0x6060, 0, static_cast<std::int8_t>(mode)), 0U);
    for (const int value : {0x06, 0x07, 0x0F}) word(value);
    ASSERT_EQ(state(), canopen::DriveMachineState::kOperationEnabled);
  }
  [[nodiscard]] bool bit(int n) const { return (statusword() >> n & 1) != 0; }
  [[nodiscard]] std::int32_t position() const { return object<std::int32_t>(0x6064); }
};

TEST(SheetBoard, HasTheEntriesOfItsSheetAndNoOthers) {
  for (const char* name : {"servo.eds", "mover.dcf"}) {
    const DataSheet sheet = sheet_of(name);
    const Board board(stand_in(sheet));
    std::size_t texts = 0;
    for (const SheetEntry& entry : sheet.entries) {
      const canopen::ObjectEntry* made = board.dictionary().find(entry.index, entry.sub);
      texts += made == nullptr || made->type == canopen::DataType::kVisibleString ? 1 : 0;
      if (made == nullptr || made->type == canopen::DataType::kVisibleString) continue;
      EXPECT_EQ(made->size, entry.size()) << name << std::hex << ' ' << entry.index;
      const bool stores = entry.index == 0x1010 || entry.index == 0x1011;
      EXPECT_EQ(made->access, stores ? std::uint8_t{canopen::kRead} : entry.access)
          << name << std::hex << ' ' << entry.index;
    }
    EXPECT_LE(texts, 3U) << name;
    for (const canopen::ObjectEntry& made : board.dictionary().entries()) {
      if (made.index < 0x1000) continue;  // fillers
      EXPECT_NE(sheet.find(made.index, made.sub), nullptr) << std::hex << made.index;
    }
  }
}

TEST(SheetBoard, AnswersWithTheSheetsRightsLimitsAndValues) {
  DataSheet sheet = sheet_of("servo.eds");
  const auto limited = std::ranges::find(sheet.entries, 0x1017, &SheetEntry::index);
  limited->high = 500;
  limited->value = canopen::SheetValue{.number = 200};
  StandIn rig(stand_in(std::move(sheet)));
  EXPECT_EQ(rig.read<std::uint32_t>(0x1000, 0), 0x00020192U);
  EXPECT_EQ(rig.read<std::uint32_t>(0x1018, 1), 0xFFF1U);
  EXPECT_EQ(rig.read<std::uint16_t>(0x1017, 0), 200);
  EXPECT_EQ(rig.write(0x1000, 0, std::uint32_t{1}), kReadOnly);
  EXPECT_EQ(rig.write(0x1017, 0, std::uint16_t{501}), kTooHigh);
  EXPECT_EQ(rig.write(0x2010, 0, 1.0F), kNoObject) << "our own boards' stiffness";
  EXPECT_EQ(rig.write(0x1017, 0, std::uint16_t{500}), 0U);
  rig.nmt(0x82);  // reset communication
  rig.step();
  EXPECT_EQ(rig.read<std::uint16_t>(0x1017, 0), 200) << "its value at power-on";
}

// Sheets of real drives leave these two to the drive; our master ended its start at 0.
TEST(SheetBoard, KnowsItsProfileAndItsModesWhereTheSheetHasNoValue) {
  for (const bool zero : {false, true}) {
    DataSheet sheet = sheet_of("servo.eds");
    for (const std::uint16_t index : {std::uint16_t{0x1000}, std::uint16_t{0x6502}}) {
      const auto entry = std::ranges::find(sheet.entries, index, &SheetEntry::index);
      entry->value.reset();
      if (zero) entry->value = canopen::SheetValue{.number = 0};
    }
    const std::uint32_t modes = emulated_modes(sheet, 0);
    EXPECT_NE(modes & 0x80, 0U) << "cyclic position, whose objects it has";
    StandIn rig(stand_in(std::move(sheet)));
    EXPECT_EQ(rig.read<std::uint32_t>(0x1000, 0), 0x00020192U);
    EXPECT_EQ(rig.read<std::uint32_t>(0x6502, 0), modes);
  }
}

TEST(SheetBoard, WatchesAHeartbeatWhoseTimeAloneTheSheetLimits) {
  DataSheet sheet = sheet_of("servo.eds");
  const auto watched = std::ranges::find_if(
      sheet.entries, [](const SheetEntry& e) { return e.index == 0x1016 && e.sub == 1; });
  ASSERT_NE(watched, sheet.entries.end());
  watched->high = 0xFFFF;
  StandIn rig(stand_in(std::move(sheet)));
  EXPECT_EQ(rig.write(0x1016, 1, std::uint32_t{127U << 16 | 100U}), 0U);
}

TEST(SheetBoard, SendsThePdosThatTheSheetMapsWithoutAnySetting) {
  DataSheet sheet = sheet_of("servo.eds");
  const auto set = [&](std::uint16_t index, std::uint8_t sub, std::int64_t value) {
    std::ranges::find_if(sheet.entries, [&](const SheetEntry& e) {
      return e.index == index && e.sub == sub;
    })->value = canopen::SheetValue{.number = value};
  };
  set(0x1800, 2, 1);
  set(0x1A00, 1, 0x60410010);
  set(0x1A00, 2, 0x60640020);
  set(0x1A00, 0, 2);
  StandIn rig(stand_in(sheet));
  rig.seen.clear();
  rig.cycles(2);
  const auto sent = rig.frames_of(0x185);
  ASSERT_EQ(sent.size(), 2U);
  EXPECT_EQ(sent[0].length, 6);
}

TEST(SheetBoard, RefusesTheModesThatTheSheetHasNot) {
  StandIn rig(stand_in(sheet_of("servo.eds")));
  EXPECT_EQ(rig.write(0x6060, 0, std::int8_t{5}), 0x06090030U);
  EXPECT_EQ(rig.write(0x6060, 0, std::int8_t{-1}), 0x06090030U) << "our own boards' impedance";
  EXPECT_EQ(rig.write(0x6060, 0, std::int8_t{8}), 0U);
}

TEST(SheetBoard, CountsFromItsZeroInItsOwnDirectionThroughTheCountersEnd) {
  BoardSetup setup = stand_in(sheet_of("servo.eds"));
  setup.axes[0].reversed = true;
  setup.axes[0].zero_counts = std::numeric_limits<std::int32_t>::min() + 10;
  StandIn rig(setup);
  rig.joints[0].q = rig.joints[0].th = 0.1;
  rig.cycles(2);
  const std::int32_t counts = Rig::counts(0.1);
  const auto expected = static_cast<std::int32_t>(
      static_cast<std::uint32_t>(setup.axes[0].zero_counts) - static_cast<std::uint32_t>(counts));
  EXPECT_GT(expected, 0) << "the counter has wrapped around";
  EXPECT_NEAR(rig.position(), expected, 1);
  rig.enable_by_sdo(8);
  const auto target = static_cast<std::int32_t>(static_cast<std::uint32_t>(expected) - 5'000U);
  ASSERT_EQ(rig.write(0x607A, 0, target), 0U);
  rig.cycles(3000);
  EXPECT_NEAR(rig.joints[0].q, 0.1 + 5'000 * 2.0 * std::numbers::pi / 524288.0, 2e-3)
      << "fewer counts are a larger angle";
}

TEST(SheetBoard, InterpolatesOnlyWhileTheMasterEnablesIt) {
  StandIn rig(stand_in(sheet_of("mover.dcf")));
  rig.enable_by_sdo(7);
  EXPECT_FALSE(rig.bit(12));
  ASSERT_EQ(rig.write(0x60C1, 1, std::int32_t{20'000}), 0U);
  rig.cycles(500);
  EXPECT_NEAR(rig.joints[0].q, 0.0, 1e-3) << "bit 4 of the controlword is clear";
  rig.word(0x1F);
  EXPECT_TRUE(rig.bit(12));
  rig.cycles(3000);
  EXPECT_NEAR(rig.joints[0].q, 20'000 * 2.0 * std::numbers::pi / 524288.0, 2e-3);
}

TEST(SheetBoard, GoesToASetPointOnItsOwnProfile) {
  StandIn rig(stand_in(servo_with_profiles()));
  rig.enable_by_sdo(1);
  ASSERT_EQ(rig.write(0x607A, 0, std::int32_t{40'000}), 0U);
  rig.cycles(100);
  EXPECT_NEAR(rig.joints[0].q, 0.0, 1e-3) << "a target is no set-point yet";
  rig.word(0x1F);
  EXPECT_TRUE(rig.bit(12)) << "acknowledged";
  EXPECT_FALSE(rig.bit(10));
  // 40,000 counts at 400,000/s with 2,000,000/s^2: v^2/a = 80,000 is more, so a triangle of
  // 2 sqrt(s / a) = 0.283 s.
  int periods = 3;
  while (!rig.bit(10) && periods < 1000) rig.cycles(1), ++periods;
  EXPECT_NEAR(periods, 283, 4);
  rig.word(0x0F);
  EXPECT_FALSE(rig.bit(12));
  rig.cycles(2000);
  EXPECT_NEAR(rig.joints[0].q, 40'000 * 2.0 * std::numbers::pi / 524288.0, 2e-3);
  rig.word(0x5F);  // relative: 40,000 more
  rig.word(0x4F, 3000);
  EXPECT_NEAR(rig.joints[0].q, 80'000 * 2.0 * std::numbers::pi / 524288.0, 4e-3);
}

TEST(SheetBoard, ANewSetPointWaitsUntilTheOneBeforeIsReached) {
  StandIn rig(stand_in(servo_with_profiles()));
  rig.enable_by_sdo(1);
  ASSERT_EQ(rig.write(0x607A, 0, std::int32_t{40'000}), 0U);
  rig.word(0x1F);
  rig.word(0x0F);
  ASSERT_EQ(rig.write(0x607A, 0, std::int32_t{0}), 0U);
  rig.word(0x1F);
  rig.word(0x0F);
  EXPECT_TRUE(rig.bit(12)) << "it waits";
  rig.cycles(200);
  EXPECT_GT(rig.position(), 25'000) << "on the way to the first";
  rig.cycles(3000);
  EXPECT_FALSE(rig.bit(12));
  EXPECT_TRUE(rig.bit(10));
  EXPECT_NEAR(rig.joints[0].q, 0.0, 4e-3);
}

TEST(SheetBoard, ReachesAProfileVelocityByItsAcceleration) {
  BoardSetup setup = stand_in(servo_with_profiles());
  StandIn rig(setup);
  rig.enable_by_sdo(3);
  EXPECT_TRUE(rig.bit(12)) << "speed 0";
  ASSERT_EQ(rig.write(0x60FF, 0, std::int32_t{100'000}), 0U);
  int periods = 2;
  rig.cycles(2);
  while (!rig.bit(10) && periods < 1000) rig.cycles(1), ++periods;
  EXPECT_NEAR(periods, 50, 3);  // 100,000 / 2,000,000 s
  EXPECT_FALSE(rig.bit(12));
}

// iPOS, Pilz, Schunk and Xeryon have no 6084.
TEST(SheetBoard, WithOneOfTwoAccelerationsTakesItForBoth) {
  for (const int missing : {0x6083, 0x6084}) {
    DataSheet sheet = servo_with_profiles();
    std::erase_if(sheet.entries, [&](const SheetEntry& e) { return e.index == missing; });
    StandIn there(stand_in(sheet));
    there.enable_by_sdo(1);
    ASSERT_EQ(there.write(0x607A, 0, there.position() + 20'000), 0U);
    const std::int32_t goal = there.object<std::int32_t>(0x607A);
    there.word(0x1F);
    there.cycles(2000);
    EXPECT_TRUE(there.bit(10)) << std::hex << missing;
    EXPECT_NEAR(there.position(), goal, 500) << std::hex << missing;
    StandIn goes(stand_in(sheet));
    goes.enable_by_sdo(3);
    ASSERT_EQ(goes.write(0x60FF, 0, 100'000), 0U);
    goes.cycles(1000);
    EXPECT_TRUE(goes.bit(10)) << std::hex << missing;
    EXPECT_GT(goes.position(), 20'000) << std::hex << missing;
  }
}

TEST(SheetBoard, RampsAProfileTorqueByItsSlope) {
  StandIn rig(stand_in(servo_with_profiles()));
  rig.enable_by_sdo(4);
  ASSERT_EQ(rig.write(0x6071, 0, std::int16_t{100}), 0U);
  rig.cycles(50);
  EXPECT_FALSE(rig.bit(10));
  rig.cycles(60);
  EXPECT_TRUE(rig.bit(10));
}

TEST(SheetBoard, HomesAtTheEndOfItsRange) {
  BoardSetup setup = stand_in(servo_with_profiles());
  setup.axes[0].parameters.min_position_rad = -0.3;
  StandIn rig(setup);
  rig.enable_by_sdo(6);
  EXPECT_FALSE(rig.bit(12));
  rig.word(0x1F);
  int periods = 0;
  while (!rig.bit(10) && periods < 3000) rig.cycles(1), ++periods;
  EXPECT_TRUE(rig.bit(12)) << "homing attained";
  EXPECT_FALSE(rig.bit(13));
  EXPECT_NEAR(rig.joints[0].q, -0.3, 0.03);
  rig.cycles(500);
  EXPECT_NEAR(rig.position(), -1'000, 2'000) << "the home offset";
  EXPECT_EQ(rig.error(), 0);
}

TEST(SheetBoard, AHomingMethodThatItsSheetDoesNotListIsAHomingError) {
  BoardSetup setup = stand_in(servo_with_profiles());
  setup.axes[0].homing_methods = std::uint64_t{1} << 35;
  StandIn rig(setup);
  ASSERT_EQ(rig.write(0x6098, 0, std::int8_t{17}), 0U);
  rig.enable_by_sdo(6);
  rig.word(0x1F);
  EXPECT_TRUE(rig.bit(13));
  rig.word(0x0F);
  ASSERT_EQ(rig.write(0x6098, 0, std::int8_t{35}), 0U);
  rig.word(0x1F);
  EXPECT_TRUE(rig.bit(12));
}

TEST(SheetBoard, AHomingMethodThatItHasNotIsAHomingError) {
  StandIn rig(stand_in(servo_with_profiles()));
  ASSERT_EQ(rig.write(0x6098, 0, std::int8_t{15}), 0U);
  rig.enable_by_sdo(6);
  rig.word(0x1F);
  EXPECT_TRUE(rig.bit(13));
  EXPECT_FALSE(rig.bit(12));
  rig.word(0x0F);
  ASSERT_EQ(rig.write(0x6098, 0, std::int8_t{35}), 0U);
  rig.word(0x1F);
  EXPECT_TRUE(rig.bit(12)) << "here is home";
  EXPECT_FALSE(rig.bit(13));
  EXPECT_NEAR(rig.position(), -1'000, 2);
}

/// Nothing of it is in the sheet: a brake is the drive's own affair.
TEST(SheetBoard, ItsBrakeHoldsUntilItIsEnabledAndBeforeItIsDisabled) {
  BoardSetup setup = stand_in(sheet_of("servo.eds"));
  setup.axes[0].parameters.brake_fitted = 1.0;
  setup.axes[0].parameters.brake_release_ms = 40;
  setup.axes[0].parameters.brake_engage_ms = 30;
  StandIn rig(setup);
  ASSERT_EQ(rig.write(0x6060, 0, std::int8_t{8}), 0U);
  ASSERT_EQ(rig.write(0x605A, 0, std::int16_t{2}), 0U);
  for (const int value : {0x06, 0x07, 0x0F}) rig.word(value);
  EXPECT_EQ(rig.state(), canopen::DriveMachineState::kSwitchedOn) << "the brake opens";
  rig.cycles(45);
  EXPECT_EQ(rig.state(), canopen::DriveMachineState::kOperationEnabled);
  EXPECT_TRUE(rig.drives[0].brake_open);
  rig.word(0x02, 25);  // quick stop: at rest after 20 ms
  EXPECT_FALSE(rig.drives[0].brake_open);
  EXPECT_TRUE(rig.drives[0].enabled) << "the bridge holds until the brake does";
  rig.cycles(35);
  EXPECT_FALSE(rig.drives[0].enabled);
}

/// 300 rpm of a motor that turns 50 times as often as its joint: a tenth of a revolution a second.
TEST(SheetBoard, TellsAndTakesVelocitiesInItsOwnUnits) {
  BoardSetup setup = stand_in(servo_with_profiles());
  setup.axes[0].velocity_units_per_rev = 3000.0;
  StandIn rig(setup);
  ASSERT_EQ(rig.write(0x6083, 0, std::uint32_t{3'000}), 0U);  // in a tenth of a second
  rig.enable_by_sdo(3);
  ASSERT_EQ(rig.write(0x60FF, 0, std::int32_t{300}), 0U);
  rig.cycles(500);
  const std::int32_t from = rig.position();
  rig.cycles(100);
  const double turned = (rig.position() - from) / setup.axes[0].parameters.link_counts_per_rev;
  EXPECT_NEAR(turned, 0.01, 0.001);
  EXPECT_NEAR(rig.object<std::int32_t>(0x606C), 300, 30);
}

/// 50 revolutions of that motor per second and second are one of the joint: velocity units per
/// second would be 60 times as many.
TEST(SheetBoard, TakesAccelerationsInTheirOwnUnits) {
  BoardSetup setup = stand_in(servo_with_profiles());
  setup.axes[0].velocity_units_per_rev = 3000.0;
  setup.axes[0].acceleration_units_per_rev = 50.0;
  StandIn rig(setup);
  ASSERT_EQ(rig.write(0x6083, 0, std::uint32_t{50}), 0U);
  rig.enable_by_sdo(3);
  ASSERT_EQ(rig.write(0x60FF, 0, std::int32_t{300}), 0U);
  int periods = 2;
  rig.cycles(2);
  while (!rig.bit(10) && periods < 1000) rig.cycles(1), ++periods;
  EXPECT_NEAR(periods, 100, 3) << "0.1 rev/s at 1 rev/s^2";
}

TEST(SheetBoard, EnabledAnewItForgetsTheSetPointOfBefore) {
  StandIn rig(stand_in(servo_with_profiles()));
  rig.enable_by_sdo(1);
  ASSERT_EQ(rig.write(0x607A, 0, std::int32_t{200'000}), 0U);
  rig.word(0x1F, 150);
  rig.word(0x06, 1000);  // on its way
  const std::int32_t rest = rig.position();
  EXPECT_GT(rest, 5'000);
  EXPECT_LT(rest, 170'000);
  rig.word(0x07);
  rig.word(0x0F, 1000);
  EXPECT_NEAR(rig.position(), rest, 5'000) << "200,000 is the target of before";
}

TEST(SheetBoard, CountsByAScaleThatIsNotWhole) {
  BoardSetup setup = stand_in(servo_with_profiles());
  setup.axes[0].parameters.link_counts_per_rev = 1000.0 / 3.0;
  StandIn rig(setup);
  rig.joints[0].q = rig.joints[0].th = 100.0;
  rig.cycles(2);
  EXPECT_EQ(rig.position(), 5305) << "100 rad; with 333 counts it would be 5300";
}

/// 6064 is 0 where the joint stands at power-on, and what homing says afterwards.
TEST(SheetBoard, WithoutAnAbsoluteEncoderItCountsFromPowerOn) {
  BoardSetup setup = stand_in(servo_with_profiles());
  setup.axes[0].counts_from_power_on = true;
  setup.axes[0].reversed = true;
  StandIn rig(setup);
  rig.joints[0].q = rig.joints[0].th = 0.7;
  rig.nmt(129);
  rig.cycles(3);
  EXPECT_NEAR(rig.position(), 0, 2);
  rig.nmt(1);
  ASSERT_EQ(rig.write(0x6098, 0, std::int8_t{35}), 0U);
  rig.enable_by_sdo(6);
  rig.word(0x1F);
  EXPECT_NEAR(rig.position(), -1'000, 200);
  rig.nmt(129);
  rig.cycles(3);
  EXPECT_NEAR(rig.position(), 0, 200) << "its power was gone";
}

TEST(SheetBoard, NeedsTheObjectsOfADrive) {
  DataSheet sheet = sheet_of("servo.eds");
  ASSERT_TRUE(check_sheet(sheet, 1));
  EXPECT_FALSE(check_sheet(sheet, 2)) << "it has one axis";
  std::erase_if(sheet.entries, [](const SheetEntry& e) { return e.index == kControlword; });
  const Status without = check_sheet(sheet, 1);
  ASSERT_FALSE(without);
  EXPECT_NE(without.error().message.find("6040"), std::string::npos);
}

TEST(SheetBoard, AMappingOfWhatItLacksStartsEmptyAndIsTold) {
  DataSheet sheet = sheet_of("servo.eds");
  const auto mapped = std::ranges::find_if(
      sheet.entries, [](const SheetEntry& e) { return e.index == 0x1A00 && e.sub == 1; });
  mapped->value = canopen::SheetValue{.number = 0x5FFF0020};
  std::prev(mapped)->value = canopen::SheetValue{.number = 1};  // how many
  const Board board(stand_in(std::move(sheet)));
  EXPECT_EQ(board.dictionary().value<std::uint8_t>(0x1A00, 0), 0);
  ASSERT_FALSE(board.remarks().empty());
  EXPECT_NE(board.remarks().back().find("1A00"), std::string::npos);
}

// The fuzzer's: the start looked for the controlword in entries that the sheet had not.
TEST(SheetBoard, AMappingWithFewerEntriesThanItsNumberSaysIsNoCrash) {
  DataSheet sheet = sheet_of("servo.eds");
  std::erase_if(sheet.entries, [](const SheetEntry& e) { return e.index == 0x1600 && e.sub > 1; });
  std::ranges::find(sheet.entries, 0x1600, &SheetEntry::index)->type =
      static_cast<std::uint16_t>(canopen::DataType::kUnsigned32);  // so it is no mapping's number
  StandIn rig(stand_in(std::move(sheet)));
  ASSERT_EQ(rig.write(0x1600, 0, std::uint32_t{4}), 0U);
  rig.nmt(0x80);
  rig.nmt(1);
  EXPECT_EQ(rig.board.nmt_state(), canopen::NmtState::kOperational);
}

TEST(SheetBoard, ASnapshotInTheMiddleOfAMoveGoesOnTheSame) {
  const BoardSetup setup = stand_in(servo_with_profiles());
  StandIn rig(setup);
  rig.enable_by_sdo(1);
  ASSERT_EQ(rig.write(0x607A, 0, std::int32_t{40'000}), 0U);
  rig.word(0x1F, 50);
  Archive writing;
  rig.board.archive(writing);
  const std::vector<std::byte> saved(writing.bytes().begin(), writing.bytes().end());
  StandIn other(setup);
  other.joints = rig.joints;
  Archive reading(saved);
  other.board.archive(reading);
  ASSERT_TRUE(reading.ok());
  EXPECT_TRUE(reading.at_end());
  for (int k = 0; k < 300; ++k) {
    rig.cycles(1);
    other.cycles(1);
    ASSERT_EQ(rig.position(), other.position()) << k;
    ASSERT_EQ(rig.statusword(), other.statusword()) << k;
  }
}

}  // namespace
}  // namespace tandem::firmware::testing
