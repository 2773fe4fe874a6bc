// Data sheets through the program: ours read back equal, and `tandem eds show` of others.
#include "canopen/data_sheet.hpp"

#include <bit>

#include "canopen/objects.hpp"
#include "firmware_emu/board.hpp"
#include "firmware_emu/sensor_board.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

namespace object = canopen::object;
using canopen::DataSheet;
using canopen::DataType;
using canopen::ObjectEntry;
using canopen::SheetEntry;

constexpr int kNode = 5;
const std::string kMover = TANDEM_SOURCE_DIR "/config/drives/mover.dcf";

/// As a sheet's reader gives it: integers by their value, reals by their bits.
std::int64_t number_of(const ObjectEntry& entry) {
  switch (entry.type) {
    case DataType::kBoolean: return *static_cast<const bool*>(entry.data) ? 1 : 0;
    case DataType::kInteger8: return *static_cast<const std::int8_t*>(entry.data);
    case DataType::kInteger16: return *static_cast<const std::int16_t*>(entry.data);
    case DataType::kInteger32: return *static_cast<const std::int32_t*>(entry.data);
    case DataType::kUnsigned8: return *static_cast<const std::uint8_t*>(entry.data);
    case DataType::kUnsigned16: return *static_cast<const std::uint16_t*>(entry.data);
    default: return *static_cast<const std::uint32_t*>(entry.data);
  }
}

bool limited(const ObjectEntry& entry) {
  return entry.type != DataType::kReal32 && entry.type != DataType::kVisibleString &&
         entry.range.min > canopen::ObjectRange{}.min;
}

void expect_same(const ObjectEntry& entry, const SheetEntry& read) {
  EXPECT_EQ(read.index, entry.index);
  EXPECT_EQ(read.sub, entry.sub);
  EXPECT_EQ(read.type, static_cast<unsigned>(entry.type));
  EXPECT_EQ(read.access, entry.access);
  EXPECT_FALSE(read.name.empty());
  char nameless[8];
  std::snprintf(nameless, sizeof nameless, "%04X", static_cast<unsigned>(entry.index));
  EXPECT_FALSE(read.name.starts_with(nameless)) << read.name;
  EXPECT_EQ(read.low.has_value(), limited(entry));
  EXPECT_EQ(read.high.has_value(), limited(entry));
  if (limited(entry) && read.low && read.high) {
    EXPECT_EQ(static_cast<double>(*read.low), entry.range.min);
    EXPECT_EQ(static_cast<double>(*read.high), entry.range.max);
  }
  if (entry.type == DataType::kVisibleString) {
    EXPECT_EQ(read.text, std::string(static_cast<const char*>(entry.data), entry.size));
    return;
  }
  EXPECT_EQ(read.size(), entry.size);
  ASSERT_TRUE(read.value.has_value());
  EXPECT_EQ(read.value->of(kNode), number_of(entry)) << "after power-on";
}

/// Every entry of the dictionary, in its order, and no other.
void expect_same(const canopen::ObjectDictionary& dictionary, const DataSheet& sheet) {
  EXPECT_EQ(sheet.remarks, std::vector<std::string>{});
  ASSERT_EQ(sheet.entries.size(), dictionary.entries().size());
  for (std::size_t i = 0; i < sheet.entries.size(); ++i) {
    SCOPED_TRACE(testing::Message() << std::hex << dictionary.entries()[i].index << ":"
                                    << int{dictionary.entries()[i].sub});
    expect_same(dictionary.entries()[i], sheet.entries[i]);
  }
}

void expect_of_board(const DataSheet& sheet) {
  firmware::BoardSetup setup;
  setup.node_id = kNode;
  std::size_t axes = 0;
  while (axes < canopen::kMaxAxes &&
         sheet.has(canopen::of_axis(object::kControlword, static_cast<int>(axes)))) {
    ++axes;
  }
  setup.axes.resize(axes);
  expect_same(firmware::Board(setup).dictionary(), sheet);
}

void expect_of_sensor(const DataSheet& sheet) {
  firmware::SensorSetup setup;
  setup.node_id = kNode;
  setup.channels = static_cast<int>(sheet.value(object::kSensorChannels, 0, 0).value_or(0));
  expect_same(firmware::SensorBoard(setup).dictionary(), sheet);
}

class DataSheets : public Program {};

TEST_F(DataSheets, OfEveryBundledRobotReadBackEqual) {
  int sheets = 0, sensors = 0;
  for (const auto& entry : std::filesystem::directory_iterator(TANDEM_SOURCE_DIR "/config")) {
    if (!std::filesystem::exists(entry.path() / "robot.toml")) continue;
    const std::string name = entry.path().filename();
    const Outcome outcome =
        tandem("eds " + shell_word((entry.path() / "robot.toml").string()) + " -o " + name);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    if (!std::filesystem::exists(folder_ / name)) {  // no folder for nothing
      EXPECT_NE(outcome.out.find("nothing written"), std::string::npos) << name << outcome.out;
      continue;
    }
    for (const auto& file : std::filesystem::directory_iterator(folder_ / name)) {
      SCOPED_TRACE(file.path().string());
      const auto sheet = canopen::load_data_sheet(file.path());
      ASSERT_TRUE(sheet.has_value()) << sheet.error().to_string();
      ++sheets;
      if (sheet->has(object::kSensorChannels)) {
        ++sensors;
        expect_of_sensor(*sheet);
      } else {
        expect_of_board(*sheet);
      }
      EXPECT_EQ(sheet->vendor, canopen::kTandemVendor);
    }
  }
  EXPECT_GT(sheets, 10);
  EXPECT_GT(sensors, 1);
}

TEST_F(DataSheets, AreShownAsTheDocumentationHasThem) {
  const Outcome outcome = tandem("eds show " + shell_word(kMover));
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const std::string page = read_text(TANDEM_SOURCE_DIR "/docs/drives.md");
  EXPECT_NE(page.find("\n" + outcome.out + "```"), std::string::npos) << outcome.out;
}

TEST_F(DataSheets, AreShownToPrograms) {
  const Outcome outcome = tandem("eds show " + shell_word(kMover) + " --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["file"], kMover);
  EXPECT_EQ(json["vendor"], 0x7A4E);
  EXPECT_EQ(json["revision"], nullptr);
  EXPECT_EQ(json["device_type"], 0x60192);
  EXPECT_EQ(json["node_id"], 5);
  EXPECT_EQ(json["heartbeat_consumers"], 2);
  EXPECT_EQ(json["node_guarding"], false);
  ASSERT_EQ(json["modes"].size(), 4U);
  EXPECT_EQ(json["modes"][1]["mode"], 3);
  EXPECT_EQ(json["modes"][1]["lacks"], nlohmann::json::array({"60FF"}));
  EXPECT_EQ(json["modes"][3]["lacks"], nlohmann::json::array());
  ASSERT_EQ(json["pdos"].size(), 4U);
  EXPECT_EQ(json["pdos"][0]["cob_id"], 0x200);
  EXPECT_EQ(json["pdos"][0]["plus_node_id"], true);
  EXPECT_EQ(json["pdos"][0]["transmission"], 1) << "its ParameterValue";
  EXPECT_EQ(json["pdos"][0]["entries"], 8);
  EXPECT_EQ(json["pdos"][0]["mapping_writable"], true);
  EXPECT_EQ(json["pdos"][0]["carries"], nlohmann::json::array({"6040", "60C1:1"}));
  EXPECT_EQ(json["into_rpdo"].size(), 5U);
  EXPECT_EQ(json["units"][2]["object"], "6091:1");
  EXPECT_EQ(json["units"][2]["value"], 100);
  EXPECT_EQ(json["remarks"].size(), 2U);
}

TEST_F(DataSheets, WithoutSupportedModesShowThoseThatTheObjectsAllow) {
  write_text(folder_ / "mover.dcf", read_text(kMover));
  edit("mover.dcf", "DefaultValue=0x65\r\n", "");
  edit("mover.dcf", "Granularity=8", "Granularity=0");
  const Outcome outcome = tandem("eds show mover.dcf --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["modes_said"], false);
  ASSERT_EQ(json["modes"].size(), 3U) << json["modes"];
  EXPECT_EQ(json["modes"][0]["mode"], 1);
  EXPECT_EQ(json["modes"][1]["mode"], 4) << "6071 and 6077 are there";
  EXPECT_EQ(json["modes"][2]["mode"], 7);
  EXPECT_EQ(json["pdos"][0]["mapping_writable"], false);
  EXPECT_NE(outcome.err.find("only the drive's 6502 says which it has"), std::string::npos)
      << outcome.err;
}

TEST_F(DataSheets, ShowWhatAModeLacks) {
  write_text(folder_ / "mover.dcf", read_text(kMover));
  edit("mover.dcf", "[6061]", "[6062]");
  const std::size_t set_point = read_text(folder_ / "mover.dcf").find("[60C1sub1]");
  std::string text = read_text(folder_ / "mover.dcf");
  text.replace(text.find("PDOMapping=1", set_point), 12, "PDOMapping=0");
  write_text(folder_ / "mover.dcf", text);
  const Outcome outcome = tandem("eds show mover.dcf --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["modes"][3]["mode"], 7);
  EXPECT_EQ(json["modes"][3]["lacks"], nlohmann::json::array({"60C1:1 in an RPDO"}));
  EXPECT_EQ(json["lacks"], nlohmann::json::array({"6061"}));
  EXPECT_NE(outcome.err.find("every mode needs, and the drive lacks: 6061"), std::string::npos);
}

TEST_F(DataSheets, BeyondUseAreRefusedWithOneMessage) {
  struct Row {
    const char* arguments;
    const char* message;
  };
  write_text(folder_ / "half.dcf", read_text(kMover).substr(0, read_text(kMover).size() / 2));
  write_text(folder_ / "huge.dcf", "[1000]");
  std::filesystem::resize_file(folder_ / "huge.dcf", 100'000'000);
  write_text(folder_ / "twice.dcf", read_text(kMover) + "[1000]\nDataType=7\nAccessType=rw\n");
  for (const Row& row : std::initializer_list<Row>{
           {"eds show half.dcf", "error: half.dcf:"},
           {"eds show huge.dcf", "huge.dcf: has 100000000 bytes, and at most 4000000 are read"},
           {"eds show twice.dcf", "[1000]: is here twice with different contents"},
           {"eds show robot.toml", "robot.toml: has no section of an object, such as [1000]"},
           {"eds show nothing.eds", "nothing.eds: cannot read this file"},
           {"eds show .", "this is a folder"},
           {"eds show", "sheet is required"},
           {"eds", "robot is required"},
           {"eds robot.toml arm.toml", "'arm.toml' is one argument too many"},
           {"eds -o sheets show twice.dcf", "show excludes --output"}}) {
    const Outcome outcome = tandem(row.arguments);
    EXPECT_EQ(outcome.status, 2) << row.arguments;
    EXPECT_EQ(outcome.out, "") << row.arguments;
    EXPECT_NE(outcome.err.find(row.message), std::string::npos) << row.arguments << outcome.err;
  }
}

/// The double pendulum on EtherCAT, with a copy of its drives' file to spoil.
class SlaveFile : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    const std::filesystem::path source = TANDEM_SOURCE_DIR "/config/double_pendulum_ethercat";
    for (const char* file : {"robot.toml", "trajectory.toml"}) {
      write_text(folder_ / file, read_text(source / file));
    }
    write_text(folder_ / "drive.xml", read_text(TANDEM_SOURCE_DIR "/config/drives/line_servo.xml"));
    edit("robot.toml", "../double_pendulum/", "");
    for (int i = 0; i < 3; ++i) edit("robot.toml", "../drives/line_servo.xml", "drive.xml");
  }
  static constexpr const char* kRun = "run trajectory.toml --no-log --duration 0.2";
};

/// What `tandem eds show` remarks, and keeps the drive from being used as its file means it.
TEST_F(SlaveFile, ThatHindersTheMasterIsWarnedOfByCheckAndRun) {
  EXPECT_EQ(tandem("check trajectory.toml").err.find("drive.xml:"), std::string::npos);
  edit("drive.xml", R"(<CoE SdoInfo="1" PdoAssign="1" PdoConfig="1" />)", "");
  for (const char* command : {"check trajectory.toml", "check robot.toml", kRun}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const std::size_t at = outcome.err.find("no CoE is said (Mailbox/CoE)");
    ASSERT_NE(at, std::string::npos) << command << outcome.err;
    EXPECT_EQ(outcome.err.find("no CoE is said", at + 1), std::string::npos) << "once a file";
    EXPECT_NE(outcome.err.find("warning: drive.xml:"), std::string::npos) << outcome.err;
  }
}

/// They had been used all the same.
TEST_F(SlaveFile, PdosOfOtherSyncManagersAreNotUsed) {
  edit("drive.xml", R"(<RxPdo Sm="2">)", R"(<RxPdo Sm="3">)");
  for (const char* command : {"check trajectory.toml", kRun}) {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_NE(outcome.err.find("PDO 1600 is not used: it is of sync manager 3 (Sm), and outputs "
                               "are of 2"),
              std::string::npos)
        << outcome.err;
    EXPECT_NE(outcome.err.find("carry of axis 0 not 6040"), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(tandem("eds show drive.xml").out.find("outputs 1600"), std::string::npos);
}

/// A value for an object that the file itself makes read only.
TEST_F(SlaveFile, AnInitCmdThatTheDriveRefusesIsNamed) {
  edit("drive.xml", R"(<CoE SdoInfo="1" PdoAssign="1" PdoConfig="1" />)",
       R"(<CoE SdoInfo="1" PdoAssign="1" PdoConfig="1"><InitCmd><Transition>PS</Transition>)"
       R"(<Index>#x6502</Index><SubIndex>0</SubIndex><Data>01000000</Data></InitCmd></CoE>)");
  const Outcome outcome = tandem(kRun);
  EXPECT_EQ(outcome.status, 1) << outcome.err;
  EXPECT_NE((outcome.out + outcome.err).find("an InitCmd of drive.xml asks for it"),
            std::string::npos)
      << outcome.out << outcome.err;
}

}  // namespace
}  // namespace tandem::apps
