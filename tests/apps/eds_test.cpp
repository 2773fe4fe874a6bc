// `tandem eds`: data sheets that a strict reader takes.
#include <map>
#include <set>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

using Section = std::map<std::string, std::string>;
using Sheet = std::map<std::string, Section>;

/// [section] and key=value lines and nothing else; a section or key twice is an error.
Sheet read_sheet(const std::filesystem::path& file) {
  Sheet sheet;
  std::istringstream text(read_text(file));
  Section* section = nullptr;
  for (std::string line; std::getline(text, line);) {
    if (line.empty()) continue;
    if (line.front() == '[' && line.back() == ']') {
      const auto [at, fresh] = sheet.emplace(line.substr(1, line.size() - 2), Section{});
      EXPECT_TRUE(fresh) << line << " comes twice";
      section = &at->second;
      continue;
    }
    const std::size_t equals = line.find('=');
    if (section == nullptr || equals == std::string::npos || equals == 0) {
      ADD_FAILURE() << file << ": not a line of a data sheet: " << line;
      continue;
    }
    const bool fresh = section->emplace(line.substr(0, equals), line.substr(equals + 1)).second;
    EXPECT_TRUE(fresh) << line << " comes twice";
  }
  return sheet;
}

void expect_variable(const std::string& name, const Section& section) {
  static const std::set<std::string> kAccess{"ro", "wo", "rw", "rwr", "rww", "const"};
  for (const char* key :
       {"ParameterName", "DataType", "AccessType", "DefaultValue", "PDOMapping"}) {
    EXPECT_TRUE(section.contains(key)) << name << " lacks " << key;
  }
  EXPECT_TRUE(kAccess.contains(section.at("AccessType"))) << name;
  EXPECT_TRUE(section.at("PDOMapping") == "0" || section.at("PDOMapping") == "1") << name;
}

/// Every object that the lists name is there with all its subs, and nothing else is.
void expect_complete(const Sheet& sheet) {
  std::set<std::string> expected{"FileInfo", "DeviceInfo", "DummyUsage", "Comments"};
  for (const char* list : {"MandatoryObjects", "OptionalObjects", "ManufacturerObjects"}) {
    ASSERT_TRUE(sheet.contains(list)) << list;
    expected.insert(list);
    const Section& objects = sheet.at(list);
    const int count = std::stoi(objects.at("SupportedObjects"));
    EXPECT_EQ(static_cast<std::size_t>(count), objects.size() - 1) << list;
    for (int i = 1; i <= count; ++i) {
      const std::string name = objects.at(std::to_string(i)).substr(2);
      EXPECT_EQ(name >= "2000" && name < "6000", std::string_view(list) == "ManufacturerObjects")
          << name;
      ASSERT_TRUE(sheet.contains(name)) << name;
      expected.insert(name);
      const Section& object = sheet.at(name);
      if (object.at("ObjectType") == "0x7") {
        expect_variable(name, object);
        continue;
      }
      std::size_t subs = 0;
      for (const auto& [section, values] : sheet) {
        if (!section.starts_with(name + "sub")) continue;
        expected.insert(section);
        expect_variable(section, values);
        ++subs;
      }
      EXPECT_EQ(std::to_string(subs), object.at("SubNumber")) << name;
      EXPECT_TRUE(sheet.contains(name + "sub0")) << name;
    }
  }
  for (const auto& [section, values] : sheet) {
    EXPECT_TRUE(expected.contains(section)) << "no list names [" << section << "]";
  }
}

class Eds : public Program {};

TEST_F(Eds, OfABoardHasItsDictionaryAfterPowerOn) {
  const Outcome outcome = tandem("eds robot.toml -o sheets --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  ASSERT_EQ(json.size(), 1U);
  EXPECT_EQ(json[0]["file"], "sheets/board_2_axes_fd.eds");
  EXPECT_EQ(json[0]["nodes"], nlohmann::json::array({"board_1"}));
  const Sheet sheet = read_sheet(folder_ / "sheets/board_2_axes_fd.eds");
  expect_complete(sheet);
  EXPECT_EQ(sheet.at("FileInfo").at("FileName"), "board_2_axes_fd.eds");
  EXPECT_EQ(sheet.at("DeviceInfo").at("VendorNumber"), "0x00007A4D");
  // CiA 306: values after power-on, when no PDO is in use or carries anything.
  EXPECT_EQ(sheet.at("1400sub1").at("DefaultValue"), "$NODEID+0x80000200");
  EXPECT_EQ(sheet.at("1801sub1").at("DefaultValue"), "$NODEID+0xC0000280");
  EXPECT_EQ(sheet.at("1801sub2").at("DefaultValue"), "255");
  EXPECT_EQ(sheet.at("1600sub0").at("DefaultValue"), "0");
  EXPECT_EQ(sheet.at("6840").at("ParameterName"), "Controlword, axis 1");
  EXPECT_EQ(sheet.at("6040").at("AccessType"), "rww");
  EXPECT_EQ(sheet.at("6041").at("AccessType"), "ro");
  EXPECT_EQ(sheet.at("2020sub1").at("DataType"), "0x0008");
}

TEST_F(Eds, OfClassicBoardsAndOfSensorsAreTypesOfTheirOwn) {
  const Outcome classic =
      tandem("eds " + shell_word(TANDEM_SOURCE_DIR "/config/double_pendulum_classic/robot.toml") +
             " -o classic");
  ASSERT_EQ(classic.status, 0) << classic.err;
  expect_complete(read_sheet(folder_ / "classic/board_1_axis_classic.eds"));
  const Outcome coman =
      tandem("eds " + shell_word(TANDEM_SOURCE_DIR "/config/coman/robot.toml") + " -o coman");
  ASSERT_EQ(coman.status, 0) << coman.err;
  for (const char* name : {"board_2_axes_fd.eds", "force_torque_fd.eds", "imu_fd.eds"}) {
    ASSERT_TRUE(std::filesystem::exists(folder_ / "coman" / name)) << name << coman.out;
    expect_complete(read_sheet(folder_ / "coman" / name));
  }
}

TEST_F(Eds, OfASecondKindOfATypeIsNumberedTwo) {
  std::filesystem::copy_file(TANDEM_SOURCE_DIR "/config/double_pendulum_classic/robot.toml",
                             folder_ / "classic.toml");
  edit("classic.toml", "../double_pendulum/", "");
  edit("classic.toml", "slow_pdo_every = 4", "slow_pdo_every = 8\nproduct_code = 0x403");
  const Outcome outcome = tandem("eds classic.toml -o sheets --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  ASSERT_EQ(json.size(), 2U) << outcome.out;
  EXPECT_EQ(json[0]["file"], "sheets/board_1_axis_classic.eds");
  EXPECT_EQ(json[1]["file"], "sheets/board_1_axis_classic_2.eds");
  EXPECT_EQ(json[1]["nodes"], nlohmann::json::array({"board_2"}));
  const Sheet second = read_sheet(folder_ / "sheets/board_1_axis_classic_2.eds");
  EXPECT_EQ(second.at("FileInfo").at("FileName"), "board_1_axis_classic_2.eds");
}

TEST_F(Eds, SaysWhatIsWrongWithTheRobot) {
  edit("robot.toml", "fd = true", "fd = false");
  const Outcome outcome = tandem("eds robot.toml");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("board 'board_1': has 2 axes, and its bus is classic CAN"),
            std::string::npos)
      << outcome.err;
}

}  // namespace
}  // namespace tandem::apps
