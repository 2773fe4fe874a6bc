// Drives of other makers on a line: what their files say of PDOs is what the master uses, and the
// emulated slave has it as such drives do.
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "ethercat/datagram.hpp"
#include "ethercat/mailbox.hpp"
#include "ethercat/registers.hpp"
#include "hal/ethercat-can/drive_use.hpp"
#include "hal/ethercat-can/line/loopback_link.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"
#include "hal/sim/line_boards.hpp"
#include "tests/sim/swing_loop.hpp"
#include "tests/sim/swing_robot.hpp"

namespace tandem::sim {
namespace {

using canopen::DataSheet;
using hal::can::PdoPlan;
using tandem::test::line_swing_robot;
using tandem::test::SwingLoop;

std::string entry(const char* index, int bits, const char* type) {
  return fmt::format("<Entry><Index>#x{}</Index><BitLen>{}</BitLen><DataType>{}</DataType></Entry>",
                     index, bits, type);
}
const std::string kControl = entry("6040", 16, "UINT");
const std::string kTarget = entry("607A", 32, "DINT");
const std::string kMode = entry("6060", 8, "SINT");
const std::string kStatus = entry("6041", 16, "UINT");
const std::string kPosition = entry("6064", 32, "DINT");
const std::string kDisplay = entry("6061", 8, "SINT");
const std::string kVelocity = entry("606C", 32, "DINT");
const std::string kGap = "<Entry><Index>0</Index><BitLen>8</BitLen></Entry>";

std::string pdo(const char* kind, const char* index, const std::string& attributes,
                const std::string& entries) {
  return fmt::format("<{0} {2}><Index>#x{1}</Index>{3}</{0}>", kind, index, attributes, entries);
}

/// A drive of the modes 8 to 10 with these PDOs. Own text. source: ETG.2000
DataSheet drive(const std::string& pdos, const std::string& coe = "PdoAssign=\"1\" PdoConfig=\"1\"",
                const std::string& more = "") {
  const std::string text = fmt::format(
      R"(<EtherCATInfo><Vendor><Id>#xFFF1</Id></Vendor><Descriptions><Devices><Device>
<Type ProductCode="#x200" RevisionNo="#x10000">D</Type><Name>Drive</Name>
<Profile><ProfileNo>402</ProfileNo><AddInfo>2</AddInfo><Dictionary><DataTypes /><Objects>
<Object><Index>#x6060</Index><Type>SINT</Type><Flags><Access>rw</Access></Flags></Object>
<Object><Index>#x6502</Index><Type>UDINT</Type><Info><DefaultValue>#x380</DefaultValue></Info></Object>
{}</Objects></Dictionary></Profile>
<Sm StartAddress="#x1800">Outputs</Sm>{}<Mailbox><CoE {}/></Mailbox>
<Dc><OpMode><Name>DC</Name><AssignActivate>#x300</AssignActivate></OpMode></Dc>
</Device></Devices></Descriptions></EtherCATInfo>)",
      more, pdos, coe);
  auto sheet = canopen::read_data_sheet(text, "drive.xml");
  EXPECT_TRUE(sheet.has_value()) << sheet.error().to_string();
  return sheet.value_or(DataSheet{});
}

hal::RobotConfig with(DataSheet sheet) {
  hal::RobotConfig robot = line_swing_robot();
  robot.boards[0].eds = "drive.xml";
  sheet.file = "drive.xml";
  robot.boards[0].sheet = std::make_shared<const DataSheet>(std::move(sheet));
  return robot;
}

std::vector<PdoPlan> plan_of(const hal::RobotConfig& robot) {
  const auto layout = hal::can::make_pdo_layout(robot);
  EXPECT_TRUE(layout.has_value()) << layout.error().to_string();
  return layout ? layout->nodes[0].pdos : std::vector<PdoPlan>{};
}

/// The whole way: mailboxes, assignment, OP, enabled; then a sine. @return where the joint went
std::vector<double> path_of(hal::RobotConfig robot) {
  robot.joints[0].torque_noise_Nm = 0.0;
  SwingLoop loop(robot);
  loop.bring_up();
  loop.run(1500);  // at rest
  const double from = loop.state.position_rad()[0];
  std::vector<double> positions;
  for (int i = 0; i < 400; ++i) {
    loop.command.position_rad()[0] = from - 0.1 * std::sin(0.01 * i);
    loop.step();
    positions.push_back(loop.state.position_rad()[0] - from);
    EXPECT_EQ(loop.state.age_cycles()[0], 0U);
  }
  return positions;
}

/// As one of our own boards does in its place: the same motor hears the same targets.
void expect_follows(const hal::RobotConfig& robot) {
  const std::vector<double> own = path_of(line_swing_robot());
  const std::vector<double> path = path_of(robot);
  double most = 0.0;
  double worst = 0.0;
  for (std::size_t i = 0; i < own.size(); ++i) {
    most = std::max(most, std::abs(own[i]));
    worst = std::max(worst, std::abs(own[i] - path[i]));
  }
  EXPECT_GT(most, 0.03);
  EXPECT_LT(worst, 1e-4) << "a cycle later it would be 1e-3";
}

/// SOEM's and KickCAT's examples: their own program maps these, and the sheet has no 14xx and 18xx.
TEST(LineDrive, PdosThatCanBeMappedTakeAllInOne) {
  const auto robot =
      with(drive(pdo("RxPdo", "1600", "Sm=\"2\"", kControl + kTarget + kMode) +
                 pdo("TxPdo", "1A00", "Sm=\"3\"", kStatus + kPosition + kDisplay + kVelocity)));
  const auto pdos = plan_of(robot);
  ASSERT_EQ(pdos.size(), 2U);
  EXPECT_TRUE(pdos[0].mapping_written);
  EXPECT_EQ(pdos[1].bytes, 11) << "more than a frame of classic CAN";
  expect_follows(robot);
}

/// A program of one's own on SOES: no dictionary that tells modes, a clock or sync managers.
/// source: OpenEtherCATsociety/SOEM samples, which map 6040 607A 6060
TEST(LineDrive, TheFewObjectsOfAProgramOfOnesOwnAreEnough) {
  DataSheet sheet = drive(pdo("RxPdo", "1600", "Fixed=\"1\" Sm=\"2\"", kControl + kTarget + kMode) +
                          pdo("TxPdo", "1A00", "Fixed=\"1\" Sm=\"3\"", kStatus + kPosition));
  std::erase_if(sheet.entries, [](const canopen::SheetEntry& e) {
    return e.index == 0x6502 || e.index == 0x1C12 || e.index == 0x1C13;
  });
  sheet.managers.clear();
  sheet.dc_modes.clear();
  expect_follows(with(std::move(sheet)));
}

TEST(LineDrive, AFixedPdoOfElevenBytesIsTakenAsItIs) {
  const auto robot = with(drive(
      pdo("RxPdo", "1701", "Fixed=\"1\" Sm=\"2\"", kControl + kTarget + kMode + kGap) +
      pdo("TxPdo", "1B01", "Fixed=\"1\" Sm=\"3\"", kStatus + kPosition + kDisplay + kVelocity)));
  const auto pdos = plan_of(robot);
  ASSERT_EQ(pdos.size(), 2U);
  EXPECT_EQ(hal::can::mapping_object(pdos[0]), 0x1701);
  EXPECT_EQ(pdos[0].entries.size(), 4U) << "with its gap";
  EXPECT_EQ(pdos[0].bytes, 7);
  EXPECT_EQ(hal::can::mapping_object(pdos[1]), 0x1B01);
  EXPECT_EQ(pdos[1].bytes, 11);
  expect_follows(robot);
}

/// The assignment cannot be written: all that it has is the process data, in its order.
TEST(LineDrive, AnAssignmentThatStaysIsUsedWhole) {
  const auto robot = with(
      drive(pdo("RxPdo", "1605", "Fixed=\"1\" Sm=\"2\"", entry("60FE", 32, "UDINT")) +
                pdo("RxPdo", "1600", "Fixed=\"1\" Sm=\"2\"", kControl + kTarget + kMode) +
                pdo("RxPdo", "1601", "Fixed=\"1\"", kControl + kTarget + kMode) +
                pdo("TxPdo", "1A05", "Fixed=\"1\" Sm=\"3\"", entry("60FD", 32, "UDINT") + kGap) +
                pdo("TxPdo", "1A00", "Fixed=\"1\" Sm=\"3\"", kStatus + kPosition) +
                pdo("TxPdo", "1A01", "Fixed=\"1\" Sm=\"3\"", kDisplay + kVelocity),
            "PdoAssign=\"0\""));
  const auto pdos = plan_of(robot);
  std::vector<int> objects;
  for (const PdoPlan& one : pdos) objects.push_back(hal::can::mapping_object(one));
  EXPECT_EQ(objects, (std::vector{0x1605, 0x1600, 0x1A05, 0x1A00, 0x1A01}));
  expect_follows(robot);
}

/// An output that nobody commands rests at the sheet's value, or at a 0 that asks for nothing. Max
/// torque 0 would leave the drive without any.
TEST(LineDrive, AnOutputOfUnknownValueIsRefusedWithItsName) {
  const std::string pdos = pdo("RxPdo", "1600", "Fixed=\"1\" Sm=\"2\"",
                               kControl + kTarget + kMode + kGap + entry("6072", 16, "UINT") +
                                   entry("60B8", 16, "UINT")) +
                           pdo("TxPdo", "1A00", "Fixed=\"1\" Sm=\"3\"", kStatus + kPosition);
  const auto layout = hal::can::make_pdo_layout(with(drive(pdos)));
  ASSERT_FALSE(layout.has_value());
  EXPECT_NE(layout.error().to_string().find("1600 is not used: 6072:00 has no value"),
            std::string::npos)
      << layout.error().to_string();
  const std::string known =
      "<Object><Index>#x6072</Index><Type>UINT</Type><Info><DefaultValue>1000</DefaultValue></Info>"
      "<Flags><Access>rw</Access></Flags></Object>";
  expect_follows(with(drive(pdos, "PdoAssign=\"1\"", known)));
}

/// Each object that a drive is switched on, seen and moved by, in a PDO with another length than
/// the dictionary's, or than a master needs where there is none: such a drive had been enabled, and
/// got no target.
TEST(LineDrive, AnObjectInAnotherLengthIsRefusedWithItsEntryAndBothLengths) {
  const auto refusal = [](const std::string& outputs, const std::string& inputs,
                          const std::string& dictionary) {
    const auto layout = hal::can::make_pdo_layout(
        with(drive(pdo("RxPdo", "1600", "Fixed=\"1\" Sm=\"2\"", outputs) +
                       pdo("TxPdo", "1A00", "Fixed=\"1\" Sm=\"3\"", inputs),
                   "PdoAssign=\"1\"", dictionary)));
    return layout ? "it is taken" : layout.error().to_string();
  };
  const auto object = [](const char* index, const char* type, const char* map) {
    return fmt::format(
        "<Object><Index>#x{}</Index><Type>{}</Type><Flags><Access>rw</Access><PdoMapping>{}"
        "</PdoMapping></Flags></Object>",
        index, type, map);
  };
  struct Row {
    std::string outputs, inputs, dictionary, said;
  };
  const std::string outputs = kControl + kTarget + kMode;
  const std::string inputs = kStatus + kPosition;
  for (const Row& row : {
           Row{kControl + entry("607A", 16, "INT") + kMode, inputs, object("607A", "DINT", "R"),
               "[1600sub2] maps 607A:00, which has 32 bits, with 16"},
           Row{kControl + kTarget + kMode, inputs, object("607A", "INT", "R"),
               "607A (it has 16 bits, and 32 are needed)"},
           Row{kControl + entry("607A", 16, "INT") + kMode, inputs, "",
               "607A (it has 16 bits, and 32 are needed)"},
           Row{kControl + entry("607A", 16, "DINT") + kMode, inputs, "",
               "[1600sub2] maps 607A:00, which has 32 bits, with 16"},
           Row{entry("6040", 8, "USINT") + kTarget + kMode, inputs, object("6040", "UINT", "R"),
               "[1600sub1] maps 6040:00, which has 16 bits, with 8"},
           Row{kControl + kTarget + entry("6060", 16, "INT"), inputs, object("6060", "SINT", "R"),
               "1600 is not used: 6060:00 has 8 bits, and is there with 16"},
           Row{outputs, entry("6041", 8, "USINT") + kPosition, object("6041", "UINT", "T"),
               "carry of axis 0 not 6041 ([1A00sub1] maps 6041:00, which has 16 bits, with 8)"},
           Row{outputs, entry("6041", 8, "USINT") + kPosition, "",
               "carry of axis 0 not 6041 (it has 8 bits, and 16 are needed) (`tandem eds"},
           Row{outputs, kStatus + entry("6064", 16, "INT"), "",
               "carry of axis 0 not 6064 (it has 16 bits, and 32 are needed) (`tandem eds"},
           Row{outputs, kStatus, "",
               "carry of axis 0 not 6064 (the sheet does not have it) (`tandem eds"},
       }) {
    const std::string error = refusal(row.outputs, row.inputs, row.dictionary);
    EXPECT_NE(error.find(row.said), std::string::npos) << error << "\nwanted: " << row.said;
    EXPECT_EQ(error.find("COB-ID"), std::string::npos) << "a slave's PDOs have none: " << error;
  }
  EXPECT_EQ(refusal(outputs, inputs, object("607A", "DINT", "R")), "it is taken");
}

/// The mode that the drive is switched on in has its target; the others are not promised.
TEST(LineDrive, AModeWhoseTargetIsNotThereIsLeftOutAndWarnedOf) {
  const std::string speed = entry("60FF", 32, "DINT");
  const std::string in = pdo("TxPdo", "1A00", "Fixed=\"1\" Sm=\"3\"", kStatus + kPosition);
  // Two PDOs that exclude each other: one has the one target, one the other.
  const auto apart =
      with(drive(pdo("RxPdo", "1600", "Fixed=\"1\" Sm=\"2\"",
                     "<Exclude>#x1601</Exclude>" + kControl + kMode + kTarget) +
                 pdo("RxPdo", "1601", "Fixed=\"1\"", kControl + kMode + speed) + in));
  const auto layout = hal::can::make_pdo_layout(apart);
  ASSERT_TRUE(layout.has_value()) << layout.error().to_string();
  EXPECT_EQ(layout->nodes[0].abilities[0].position, canopen::Mode::kCsp);
  EXPECT_EQ(layout->nodes[0].abilities[0].velocity, canopen::Mode::kNone);
  const auto texts = [](const hal::RobotConfig& robot) {
    std::string all;
    const auto warnings = hal::can::drive_warnings(robot);
    EXPECT_TRUE(warnings.has_value()) << warnings.error().to_string();
    for (const Error& one : warnings.value_or(Diagnostics{})) all += one.to_string() + "\n";
    return all;
  };
  EXPECT_NE(texts(apart).find("no PDO that is used has a target of mode 9"), std::string::npos)
      << texts(apart);
  // In another length: the sheet's abilities know already, and the mapping is named.
  const auto narrow = with(drive(pdo("RxPdo", "1600", "Fixed=\"1\" Sm=\"2\"",
                                     kControl + kMode + kTarget + entry("60FF", 16, "DINT")) +
                                 in));
  EXPECT_NE(texts(narrow).find("[1600sub4] maps 60FF:00, which has 32 bits, with 16"),
            std::string::npos)
      << texts(narrow);
}

/// Makers' files write what no PDO has and no dictionary tells; the stand-in had lacked it.
TEST(LineDrive, WhatAnInitCmdWritesIsThere) {
  const auto command = [](const char* index, const char* sub, const char* data) {
    return fmt::format(
        "<InitCmd><Transition>PS</Transition><Index>#x{}</Index><SubIndex>{}</SubIndex>"
        "<Data>{}</Data></InitCmd>",
        index, sub, data);
  };
  const DataSheet sheet =
      drive(pdo("RxPdo", "1600", "Fixed=\"1\" Sm=\"2\"", kControl + kTarget + kMode) +
                pdo("TxPdo", "1A00", "Fixed=\"1\" Sm=\"3\"", kStatus + kPosition),
            "PdoAssign=\"1\">" + command("60C2", "1", "01") + command("2100", "1", "0102") +
                command("2101", "0", "01020304") + "</CoE><FoE");
  ASSERT_EQ(sheet.writes.size(), 3U);
  EXPECT_EQ(sheet.value(0x2100, 1, 0), 0x0201) << "little-endian";
  ASSERT_NE(sheet.find(0x2101), nullptr);
  EXPECT_EQ(sheet.find(0x2101)->size(), 4);
  expect_follows(with(sheet));
}

/// The default PDO and another one exclude each other.
TEST(LineDrive, PdosThatExcludeEachOtherAreNotUsedTogether) {
  const std::string first = pdo("RxPdo", "1600", "Fixed=\"1\" Sm=\"2\"",
                                "<Exclude>#x1601</Exclude>" + kControl + kTarget);
  const std::string second = pdo("RxPdo", "1601", "Fixed=\"1\"", kControl + kTarget + kMode);
  const auto pdos = plan_of(with(
      drive(first + second + pdo("TxPdo", "1A00", "Fixed=\"1\" Sm=\"3\"", kStatus + kPosition))));
  ASSERT_EQ(pdos.size(), 2U);
  EXPECT_EQ(hal::can::mapping_object(pdos[0]), 0x1601) << "it carries the most";
}

TEST(LineDrive, NoAdviceSpeaksOfFrames) {
  const auto robot = with(drive(
      pdo("RxPdo", "1600", "Sm=\"2\"", kControl + kTarget + kMode) +
      pdo("TxPdo", "1A00", "Fixed=\"1\" Sm=\"3\"", kStatus + kPosition + kDisplay + kVelocity)));
  const auto warnings = hal::can::drive_warnings(robot);
  ASSERT_TRUE(warnings.has_value());
  for (const Error& warning : *warnings) {
    EXPECT_EQ(warning.to_string().find("bits"), std::string::npos) << warning.to_string();
  }
  // Without a PDO that has a target, no word of CAN FD either.
  const auto none = hal::can::make_pdo_layout(
      with(drive(pdo("RxPdo", "1600", "Fixed=\"1\" Sm=\"2\"", kControl) +
                 pdo("TxPdo", "1A00", "Fixed=\"1\" Sm=\"3\"", kStatus + kPosition))));
  ASSERT_FALSE(none.has_value());
  EXPECT_EQ(none.error().to_string().find("fd"), std::string::npos) << none.error().to_string();
}

/// A master that reads first what is there, as SOEM's slaveinfo does: nothing of ours asks for it.
class Reader {
 public:
  explicit Reader(const hal::RobotConfig& robot) {
    auto made = EmulatedRobot::create(robot, tandem::test::swing_kernels(2), {.posture = "up"});
    EXPECT_TRUE(made.has_value()) << made.error().to_string();
    emulated_ = std::move(*made);
    boards_ = std::make_unique<LineBoards>(*emulated_, 0, cable_.slaves(),
                                           LineBoards::Config{.period_ns = kMs, .clock = &clock_});
  }
  /// One datagram to the first slave. @return the working counter; `data` is what came back
  int pass(ethercat::Command command, std::uint16_t at, std::vector<std::uint8_t>& data) {
    hal::ecat::FrameBuffer out;
    ethercat::FrameWriter writer;
    writer.begin(out.bytes, {0x00, 0x11, 0x22, 0x33, 0x44, 0x55});
    const auto address = ethercat::register_address(ethercat::at_position(0), at);
    std::ranges::copy(data, writer.add(command, 1, address, data.size()).begin());
    out.size = writer.finish();
    EXPECT_EQ(cable_.master().send({&out, 1}), 1U);
    std::array<canopen::Frame, 8> frames;
    clock_.now += 10 * kMs;  // an idle line is served when it is silent
    (void)boards_->receive(frames);
    boards_->end_step();
    std::array<hal::ecat::FrameBuffer, 4> back;
    if (cable_.master().receive(back) == 0) return -1;
    ethercat::FrameReader reader(back[0].frame());
    ethercat::Datagram datagram;
    if (!reader.next(datagram)) return -1;
    data.assign(datagram.data().begin(), datagram.data().end());
    return datagram.working_counter();
  }
  int write(std::uint16_t at, std::vector<std::uint8_t> data) {
    return pass(ethercat::Command::kApwr, at, data);
  }
  std::vector<std::uint8_t> read(std::uint16_t at, std::size_t size) {
    std::vector<std::uint8_t> data(size);
    (void)pass(ethercat::Command::kAprd, at, data);
    return data;
  }
  void set_manager(int number, const ethercat::SyncManager& manager) {
    std::vector<std::uint8_t> out(ethercat::kSyncManagerBytes);
    ethercat::put_sync_manager(out.data(), manager);
    write(static_cast<std::uint16_t>(ethercat::reg::kSyncManager + 8 * number), out);
  }
  int request(std::uint8_t state) {
    write(ethercat::reg::kAlControl, {state, 0});
    return read(ethercat::reg::kAlStatus, 1)[0];
  }
  std::uint32_t upload(std::uint16_t index, std::uint8_t sub) {
    std::vector<std::uint8_t> message(128);
    counter_ = ethercat::next_counter(counter_);
    ethercat::write_coe(message, ethercat::kSdoDataAt, ethercat::CoeService::kSdoRequest, counter_);
    ethercat::write_sdo(message, ethercat::sdo::kUploadRequest, index, sub);
    EXPECT_EQ(write(0x1000, message), 1);
    const std::vector<std::uint8_t> answer = read(0x1080, 128);
    EXPECT_NE(answer[ethercat::kSdoAt], ethercat::sdo::kAbort) << std::hex << index;
    return canopen::get<std::uint32_t>(&answer[ethercat::kSdoAt + 4]) &
           (answer[ethercat::kSdoAt] == 0x4F ? 0xFFU : 0xFFFF'FFFFU);
  }
  /// Bits that 1C12 or 1C13 assign.
  std::size_t bits(std::uint16_t assignment) {
    std::size_t sum = 0;
    const std::uint32_t pdos = upload(assignment, 0);
    for (std::uint32_t i = 1; i <= pdos; ++i) {
      const auto pdo = static_cast<std::uint16_t>(upload(assignment, static_cast<std::uint8_t>(i)));
      const std::uint32_t count = upload(pdo, 0);
      for (std::uint32_t n = 1; n <= count; ++n) {
        sum += upload(pdo, static_cast<std::uint8_t>(n)) & 0xFF;
      }
    }
    return sum;
  }

 private:
  static constexpr std::int64_t kMs = 1'000'000;
  class Clock final : public hal::can::FrameWait {
   public:
    [[nodiscard]] std::int64_t now_ns() noexcept override { return now; }
    void wait(std::int64_t, int) noexcept override {}
    std::int64_t now = kMs;
  };
  Clock clock_;
  std::unique_ptr<EmulatedRobot> emulated_;
  hal::ecat::LoopbackLink cable_;
  std::unique_ptr<LineBoards> boards_;
  std::uint8_t counter_ = 0;
};

TEST(LineDrive, AMasterThatAsksForNoMappingFindsTheDefaultOne) {
  const auto check = [](const hal::RobotConfig& robot, std::size_t outputs, std::size_t inputs) {
    Reader master(robot);
    master.set_manager(0, {0x1000, 128, ethercat::kControlMailboxOut, 0, true});
    master.set_manager(1, {0x1080, 128, ethercat::kControlMailboxIn, 0, true});
    ASSERT_EQ(master.request(2), 2);
    EXPECT_EQ(master.bits(0x1C12), 8 * outputs);
    EXPECT_EQ(master.bits(0x1C13), 8 * inputs);
    const auto bytes = [](std::size_t n) { return static_cast<std::uint16_t>(n); };
    master.set_manager(2, {0x1800, bytes(outputs), ethercat::kControlOutputs, 0, true});
    master.set_manager(3, {0x2400, bytes(inputs), ethercat::kControlInputs, 0, true});
    ASSERT_EQ(master.request(4), 4);
    EXPECT_EQ(master.write(0x1800, std::vector<std::uint8_t>(outputs)), 1);
    EXPECT_EQ(master.request(8), 8);
  };
  check(line_swing_robot(), 8,
        14);  // our own board: 6040 607A 6060 and a gap, 6041 6064 606C 6077 6061 …
  check(with(drive(pdo("RxPdo", "1600", "Fixed=\"1\" Sm=\"2\"", kControl + kTarget + kMode + kGap) +
                   pdo("TxPdo", "1A00", "Fixed=\"1\" Sm=\"3\"",
                       kStatus + kPosition + kDisplay + kVelocity))),
        8, 11);
}

}  // namespace
}  // namespace tandem::sim
