// The reader of data sheets: what sheets of real drives have, and what no sheet may have.
#include "canopen/data_sheet.hpp"

#include <bit>
#include <filesystem>
#include <fstream>

#include "canopen/object_dictionary.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::canopen {
namespace {

/// A whole sheet of four objects.
const std::string kSheet = R"([FileInfo]
FileName=drive.eds
Description=A drive of our own
[DeviceInfo]
VendorName=Nobody
VendorNumber=0x7A4E
ProductName=Mover
ProductNumber=17
RevisionNumber=0x20001
BaudRate_125=0
BaudRate_500=1
BaudRate_1000=1
Granularity=8
LSS_Supported=1
[DummyUsage]
Dummy0001=0
Dummy0005=1
[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018
[OptionalObjects]
SupportedObjects=1
1=0x6040
[ManufacturerObjects]
SupportedObjects=0
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00020192
PDOMapping=0
[1001]
ParameterName=Error register
ObjectType=0x7
DataType=0x0005
AccessType=ro
PDOMapping=1
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=Highest sub-index
ObjectType=0x7
DataType=0x0005
AccessType=const
DefaultValue=1
[1018sub1]
ParameterName=Vendor
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x7A4E
[6040]
ParameterName=Controlword
ObjectType=0x7
DataType=0x0006
AccessType=rww
PDOMapping=1
)";

std::string with(std::string text, const std::string& old, const std::string& now) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return at == std::string::npos ? text : text.replace(at, old.size(), now);
}

/// The sheet with one more object, which nothing lists.
std::string plus(const std::string& object) { return kSheet + object; }

/// A variable [2000] with these lines.
std::string variable(const std::string& lines) {
  return plus("[2000]\nParameterName=Probe\nObjectType=0x7\n" + lines);
}

DataSheet read(const std::string& text) {
  auto sheet = read_data_sheet(text, "drive.eds");
  EXPECT_TRUE(sheet.has_value()) << sheet.error().to_string() << "\n" << text.substr(0, 2000);
  return sheet.value_or(DataSheet{});
}

std::string remarks(const DataSheet& sheet) {
  std::string all;
  for (const std::string& remark : sheet.remarks) all += remark + "\n";
  return all;
}

/// [1A00] with a value and more of sub 0, and so many entries.
std::string mapping(int count, const std::string& of_count, int entries, const std::string& entry) {
  const auto sub = [](int number, const std::string& type, const std::string& value) {
    return "[1A00sub" + std::to_string(number) + "]\nParameterName=S\nDataType=" + type +
           "\nAccessType=rw\nDefaultValue=" + value + "\n";
  };
  std::string text = "[1A00]\nObjectType=9\nSubNumber=" + std::to_string(entries + 1) + "\n" +
                     sub(0, "5", std::to_string(count)) + of_count;
  for (int i = 1; i <= entries; ++i) text += sub(i, "7", entry);
  return plus(text);
}

/// What is wrong with `text`: the error as a user reads it.
std::string refusal(const std::string& text) {
  const auto sheet = read_data_sheet(text, "drive.eds");
  return sheet.has_value() ? "no error" : sheet.error().to_string();
}

TEST(DataSheet, SaysWhatTheDeviceIs) {
  const DataSheet sheet = read(kSheet);
  EXPECT_EQ(sheet.file, "drive.eds");
  EXPECT_EQ(sheet.vendor_name, "Nobody");
  EXPECT_EQ(sheet.product_name, "Mover");
  EXPECT_EQ(sheet.description, "A drive of our own");
  EXPECT_EQ(sheet.vendor, 0x7A4EU);
  EXPECT_EQ(sheet.product, 17U);
  EXPECT_EQ(sheet.revision, 0x20001U);
  EXPECT_EQ(sheet.bit_rates_kbit_s, (std::vector{500, 1000}));
  EXPECT_EQ(sheet.granularity, 8);
  EXPECT_EQ(sheet.dummies, (std::vector<std::uint16_t>{5}));
  EXPECT_TRUE(sheet.lss);
  EXPECT_FALSE(sheet.node_id.has_value());
  EXPECT_EQ(sheet.remarks, std::vector<std::string>{});
}

TEST(DataSheet, HasItsEntriesSorted) {
  const DataSheet sheet = read(kSheet);
  ASSERT_EQ(sheet.entries.size(), 5U);
  const SheetEntry* vendor = sheet.find(0x1018, 1);
  ASSERT_NE(vendor, nullptr);
  EXPECT_EQ(vendor->name, "Vendor");
  EXPECT_EQ(vendor->type, 7);
  EXPECT_EQ(vendor->size(), 4);
  EXPECT_EQ(vendor->access, kRead);
  EXPECT_EQ(vendor->line, 51);
  EXPECT_TRUE(sheet.find(0x1018, 0)->constant);
  EXPECT_EQ(sheet.find(0x6040)->access, kRead | kWrite | kMapRpdo);
  EXPECT_EQ(sheet.find(0x1001)->access, kRead | kMapTpdo);
  EXPECT_EQ(sheet.find(0x1018, 2), nullptr);
  EXPECT_TRUE(sheet.has(0x1018));
  EXPECT_FALSE(sheet.has(0x1017));
  EXPECT_EQ(sheet.value(0x1000, 0, 5), 0x20192);
  EXPECT_EQ(sheet.value(0x6040, 0, 5), std::nullopt) << "no DefaultValue";
}

TEST(DataSheet, TakesEveryWayToWriteANumber) {
  struct Row {
    const char* type;
    const char* text;
    std::int64_t expected;  // of node 5
    bool remarked = false;
  };
  for (const Row& row : std::initializer_list<Row>{
           {"0x0007", "$NODEID+0x180", 0x185},
           {"0x0007", "$NodeID + 0x180", 0x185},
           {"0x0007", "0x180+$NODEID", 0x185},
           {"0x0007", "0x180 + $nodeid", 0x185},
           {"0x0005", "$NODEID", 5},
           {"0x0007", "$NODEID+0xC0000280", 0xC0000285},
           {"0x0007", "0x80000300", 0x80000300},
           {"0x0007", "4294967295", 4294967295},
           {"7", "0xdeadBEEF", 0xDEADBEEF},
           {"0x07", "0X10", 16},
           {"0x0001", "1", 1},
           {"0x0005", "0x02", 2},
           {"0x0005", "0x0002", 2},
           {"0x0005", "2 ; two", 2},
           {"0x0002", "-5", -5},
           {"0x0002", "+5", 5},
           {"0x0002", "0xFB", -5},
           {"0x0003", "0x8000", -32768},
           {"0x0004", "-2147483648", -2147483648},
           {"0x0010", "0xFFFFFF", -1},
           {"0x0016", "0xFFFFFF", 0xFFFFFF},
           {"0x001B", "0xFFFFFFFFFFFFFFFF", -1},  // a bit pattern
           {"0x0015", "-9223372036854775808", std::numeric_limits<std::int64_t>::min()},
           {"0x0003", "65535", -1, true},
           {"0x0006", "-1", 65535, true},
           {"0x0006", "010", 8, true},
           {"0x0006", "003", 3},
           {"0x0006", "09", 9, true},
           {"0x0008", "0.5", 0x3F000000},
           {"0x0008", "-2e3", 0xC4FA0000},
           {"0x0008", "0x3F000000", 0x3F000000},
           {"0x0011", "0.5", 0x3FE0000000000000},
       }) {
    const DataSheet sheet = read(variable(std::string("DataType=") + row.type +
                                          "\nAccessType=rw\nDefaultValue=" + row.text + "\n"));
    EXPECT_EQ(sheet.value(0x2000, 0, 5), row.expected) << row.text;
    EXPECT_EQ(remarks(sheet).find("is taken as") != std::string::npos, row.remarked)
        << row.text << ": " << remarks(sheet);
  }
}

TEST(DataSheet, RefusesWhatIsNoNumberOfItsType) {
  struct Row {
    const char* type;
    const char* text;
    const char* message;
  };
  for (const Row& row : std::initializer_list<Row>{
           {"0x0005", "256",
            "'256' does not fit the DataType (expected is a whole number from 0 "
            "to 255, or $NODEID plus one)"},
           {"0x0002", "-129",
            "does not fit the DataType (expected is a whole number from -128 to "
            "127, or $NODEID plus one)"},
           {"0x0003", "0x10000", "does not fit"},
           {"0x0007", "-2147483649", "does not fit"},
           {"0x0007", "18446744073709551616", "is no number"},
           {"0x0007", "0x", "is no number"},
           {"0x0007", "0x12G", "is no number"},
           {"0x0007", "--5", "is no number"},
           {"0x0007", "12 13", "is no number"},
           {"0x0007", "$NODEID-5", "is no number"},
           {"0x0007", "$NODEID+", "is no number"},
           {"0x0007", "$NODEID+$NODEID", "is no number"},
           {"0x0007", "$NODE", "is no number"},
           {"0x0008", "nan", "is no number (expected is a number, such as 0.25)"},
           {"0x0008", "0,5", "is no number"},
           {"0x0008", "1e39", "does not fit"},
           {"0x0008", "0x100000000", "does not fit"},
       }) {
    const std::string lines =
        std::string("DataType=") + row.type + "\nAccessType=rw\nDefaultValue=" + row.text + "\n";
    const std::string error = refusal(with(variable(lines), "[2000]", "[6071]"));
    EXPECT_TRUE(error.starts_with("drive.eds:68: [6071] DefaultValue: '")) << error;
    EXPECT_NE(error.find(row.message), std::string::npos) << row.text << ": " << error;
  }
}

TEST(DataSheet, MapsWhatAccessAndPdoMappingAllow) {
  struct Row {
    const char* access;
    int mapped;
    int unmapped;
  };
  for (const Row& row : std::initializer_list<Row>{
           {"ro", kRead | kMapTpdo, kRead},
           {"const", kRead | kMapTpdo, kRead},
           {"wo", kWrite | kMapRpdo, kWrite},
           {"rw", kReadWrite | kMapRpdo | kMapTpdo, kReadWrite},
           {"RW", kReadWrite | kMapRpdo | kMapTpdo, kReadWrite},
           {"rwr", kReadWrite | kMapTpdo, kReadWrite},
           {"rww", kReadWrite | kMapRpdo, kReadWrite},
       }) {
    const std::string lines = std::string("DataType=5\nAccessType=") + row.access;
    EXPECT_EQ(read(variable(lines + "\nPDOMapping=0x1\n")).find(0x2000)->access, row.mapped)
        << row.access;
    EXPECT_EQ(read(variable(lines + "\nPDOMapping=0x0\n")).find(0x2000)->access, row.unmapped);
    EXPECT_EQ(read(variable(lines + "\n")).find(0x2000)->access, row.unmapped);
  }
}

TEST(DataSheet, TakesTypesOfNoNumberAsText) {
  struct Row {
    const char* type;
    int size;
  };
  for (const Row& row : std::initializer_list<Row>{{"0x0009", 0},
                                                   {"0x000A", 0},
                                                   {"0x000B", 0},
                                                   {"0x000F", 0},
                                                   {"0x000C", 6},
                                                   {"0x0045", 0}}) {
    const DataSheet sheet = read(variable(std::string("DataType=") + row.type +
                                          "\nAccessType=const\nDefaultValue=Axis 1; x\n"));
    EXPECT_EQ(sheet.find(0x2000)->text, "Axis 1; x") << row.type;
    EXPECT_EQ(sheet.find(0x2000)->size(), row.size) << row.type;
    EXPECT_EQ(sheet.find(0x2000)->value, std::nullopt);
  }
}

TEST(DataSheet, TakesTheParameterValueOfADcfFirst) {
  const std::string lines = "DataType=5\nAccessType=rw\nDefaultValue=1\nParameterValue=";
  EXPECT_EQ(read(variable(lines + "2\n")).value(0x2000, 0, 1), 2);
  EXPECT_EQ(read(variable(lines + "\n")).value(0x2000, 0, 1), 1) << "an empty one says nothing";
  EXPECT_EQ(read(variable("DataType=5\nAccessType=rw\nDefaultValue=\n")).value(0x2000, 0, 1),
            std::nullopt);
}

TEST(DataSheet, TakesTheCommissioningOfADcf) {
  for (const char* name : {"DeviceComissioning", "DeviceCommissioning"}) {
    const DataSheet sheet = read(plus(std::string("[") + name + "]\nNodeID=0x0A\nBaudrate=500\n"));
    EXPECT_EQ(sheet.node_id, 10) << name;
    EXPECT_EQ(sheet.bit_rate_kbit_s, 500) << name;
  }
  const DataSheet blank = read(plus("[DeviceComissioning]\nNodeID=255\nBaudrate=\n"));
  EXPECT_EQ(blank.node_id, std::nullopt);
  EXPECT_EQ(remarks(blank), "line 64: NodeID 255 is none from 1 to 127: left out\n");
}

TEST(DataSheet, TakesCommentsLineEndsAndBlanks) {
  std::string dos = "\xEF\xBB\xBF; a comment\n#DefaultValue=3\n\n" + kSheet;
  dos = with(dos, "AccessType=rww", "#AccessType=ro\nAccessType = rww ");
  dos = with(dos, "[1018sub1]", "  [ 1018SUB01 ]  ; the vendor");
  for (std::size_t at = 0; (at = dos.find('\n', at)) != std::string::npos; at += 2) {
    dos.replace(at, 1, "\r\n");
  }
  dos += '\x1A';
  const DataSheet sheet = read(dos);
  EXPECT_EQ(remarks(sheet), "");
  EXPECT_EQ(sheet.find(0x6040)->access, kRead | kWrite | kMapRpdo);
  EXPECT_EQ(sheet.value(0x1018, 1, 1), 0x7A4E);
}

TEST(DataSheet, TakesGapsAndHexadecimalSubIndices) {
  const std::string sub = "\nParameterName=S\nDataType=5\nAccessType=rw\n";
  const DataSheet sheet = read(plus("[1011]\nObjectType=8\nSubNumber=3\n[1011sub0]" + sub +
                                    "DefaultValue=4\n[1011sub1]" + sub + "[1011sub4]" + sub +
                                    "[1600]\nObjectType=9\nSubNumber=3\nDataType=0x21\n" +
                                    "[1600sub0]" + sub + "[1600subA]" + sub + "[1600Sub10]" + sub));
  EXPECT_EQ(remarks(sheet), "defined, but not listed: 1011, 1600\n");
  EXPECT_NE(sheet.find(0x1011, 4), nullptr);
  EXPECT_EQ(sheet.find(0x1011, 2), nullptr);
  EXPECT_NE(sheet.find(0x1600, 10), nullptr);
  EXPECT_NE(sheet.find(0x1600, 16), nullptr);
}

TEST(DataSheet, TakesObjectsThatAreNotWrittenOut) {
  const DataSheet sheet =
      read(plus("[1016]\nParameterName=Consumer\nObjectType=8\nDataType=7\nAccessType=rw\n"
                "CompactSubObj=3\nDefaultValue=9\n[1016Value]\nNrOfEntries=1\n2=0x7F0064\n"
                "[1016Name]\nNrOfEntries=1\n3=Third\n"));
  EXPECT_EQ(sheet.value(0x1016, 0, 1), 3);
  EXPECT_EQ(sheet.value(0x1016, 1, 1), 9);
  EXPECT_EQ(sheet.value(0x1016, 2, 1), 0x7F0064);
  EXPECT_EQ(sheet.find(0x1016, 3)->name, "Third");
  EXPECT_EQ(sheet.find(0x1016, 2)->name, "Consumer 2");
  EXPECT_EQ(sheet.find(0x1016, 2)->access, kReadWrite);
  EXPECT_EQ(sheet.find(0x1016, 4), nullptr);
}

TEST(DataSheet, TakesNamesOfWindows) {
  const DataSheet sheet =
      read(with(kSheet, "ParameterName=Controlword", "ParameterName=\xB5m \x1B[31m"));
  EXPECT_EQ(sheet.find(0x6040)->name, "\xC2\xB5m  [31m") << "Latin-1; nothing moves a terminal";
}

TEST(DataSheet, RemarksWhatContradictsItself) {
  const std::string sub = "\nParameterName=S\nDataType=5\nAccessType=rw\n";
  struct Row {
    std::string text;
    const char* remark;
  };
  for (const Row& row : std::initializer_list<Row>{
           {with(kSheet, "1=0x6040", "1=0x6040\n2=0x6406"), "listed, but not defined: 6406"},
           {with(kSheet, "1=0x6040", "1=0x6040\n2=0x6040"), "6040 is listed twice"},
           {with(kSheet, "SupportedObjects=1", "SupportedObjects=7"),
            "line 23: [OptionalObjects] SupportedObjects is '7'; listed are 1"},
           {with(kSheet, "[ManufacturerObjects]\nSupportedObjects=0\n", ""),
            "there is no section [ManufacturerObjects]"},
           {with(kSheet, "SubNumber=2", "SubNumber=5"),
            "line 41: [1018] SubNumber is 5; the sheet has 2 sub-indices"},
           {with(kSheet, "VendorNumber=0x7A4E", "VendorNumber=101"),
            "1018:1 is 31310, and VendorNumber is 101"},
           {with(kSheet, "Granularity=8", "NrOfRXPDO=4"),
            "NrOfRXPDO is 4, and there are 0 from 1400"},
           {with(kSheet, "BaudRate_500=1", "BaudRate_500=yes"),
            "BaudRate_500: 'yes' is no number from 0 to 4294967295: left out"},
           {with(kSheet, "[FileInfo]\n", "[FileInfo]\nnonsense\n"),
            "line 2: is neither [section] nor key=value"},
           {"A=1\n" + kSheet, "line 1: stands before the first section"},
           {with(kSheet, "FileName=drive.eds", "FileName=drive.eds\nFILENAME=drive.eds"),
            "line 3: the key 'FILENAME' comes again"},
           {plus("[2000sub1]" + sub), "line 63: [2000sub1] has no section of its object"},
           {plus("[2000]\nObjectType=9\nSubNumber=0\n[2001]" + sub), "[2000] has no sub-indices"},
           {plus("[2000]" + sub + "[2000sub1]" + sub), "[2000] is a variable and has sub-indices"},
           {variable("AccessType=rw\n[2001]" + sub), "line 63: [2000] has no DataType"},
           {variable("DataType=5\n[2001]" + sub), "[2000] has no AccessType: taken as read only"},
           {variable("DataType=5\nAccessType=rw\nHighLimit=256\n"),
            "HighLimit: '256' is no limit of this DataType: left out"},
           {plus("[2000]" + sub + "[2000]" + sub), "line 67: [2000] comes again"},
           {mapping(9, "HighLimit=8\n", 9, "0x60400010"),
            "line 66: [1A00] maps 9 objects, and has room for 8"},
           {mapping(65, "", 2, "0x60400001"), "[1A00] maps 65 objects, and has room for 64"},
           {mapping(3, "", 2, "0x60400010"), "[1A00] maps 3 objects, and defines 2"},
           {mapping(7, "", 7, "0x60400010"),
            "line 66: [1A00] maps 112 bits, and a frame has at most 64; one of CAN FD 512"},
           {mapping(1, "", 1, "0x77770010"),
            "[1A00sub1] maps 7777:00, which the sheet does not define"},
           {mapping(1, "", 1, "0x10180140"), "[1A00sub1] maps 1018:01, which has 32 bits, with 64"},
           {mapping(1, "", 1, "0x10180110"), "[1A00sub1] maps 1018:01, which has 32 bits, with 16"},
           {mapping(3, "", 3, "0x604000FF"), "[1A00] maps 765 bits, and a frame has at most 64\n"},
       }) {
    const auto sheet = read_data_sheet(row.text, "drive.eds");
    ASSERT_TRUE(sheet.has_value()) << row.remark << sheet.error().to_string();
    EXPECT_NE(remarks(*sheet).find(row.remark), std::string::npos) << row.remark << "\nis not in\n"
                                                                   << remarks(*sheet);
  }
}

TEST(DataSheet, CountsTheRemarksBeyondAHundred) {
  std::string text = kSheet;
  for (int i = 0; i < 150; ++i) text += "nonsense\n";
  const DataSheet sheet = read(text);
  ASSERT_EQ(sheet.remarks.size(), 101U);
  EXPECT_EQ(sheet.remarks.back(), "and 50 more");
}

TEST(DataSheet, RefusesWithFileLineSectionAndKey) {
  struct Row {
    std::string text;
    const char* message;
  };
  for (const Row& row : std::initializer_list<Row>{
           {"", "drive.eds: has no section of an object, such as [1000]: it is no data sheet"},
           {"[model]\nurdf = \"arm.urdf\"\nurdf = 2\n[[bus]]\n", "it is no data sheet"},
           {std::string("[1000]\0\n", 8), "drive.eds: has a zero byte"},
           {"PK\x03\x04 drive", "drive.eds: is a ZIP archive (unpack it, and name"},
           {"\x1F\x8B\x08", "drive.eds: is a gzip archive"},
           {"%PDF-1.4\n", "drive.eds: is a PDF, and no data sheet for programs (ask the maker"},
           {with(kSheet, "ObjectType=0x9", "ObjectType=0x1"),
            "drive.eds:43: [1018] ObjectType: '0x1' is no type of object (expected is 0x7"},
           {with(kSheet, "ObjectType=0x9", "ObjectType=record"),
            "drive.eds:43: [1018] ObjectType: 'record' is no such number"},
           {with(kSheet, "AccessType=rww", "AccessType=read"),
            "drive.eds:61: [6040] AccessType: 'read' is no access (expected is ro, wo, rw"},
           {with(kSheet, "DataType=0x0006", "DataType=UNSIGNED16"),
            "drive.eds:60: [6040] DataType: 'UNSIGNED16' is no such number"},
           {with(kSheet, "PDOMapping=1\n[1018]", "PDOMapping=maybe\n[1018]"),
            "drive.eds:40: [1001] PDOMapping: 'maybe' is no such number"},
           {with(kSheet, "SubNumber=2", "SubNumber=two"), "[1018] SubNumber: 'two'"},
           {with(kSheet, "2=0x1001", "2=error register"),
            "drive.eds:21: [MandatoryObjects] 2: 'error register' is no object's index"},
           {with(kSheet, "[1001]", "[1001"),
            "drive.eds:35: [1000]: a section's name has no closing bracket"},
           {with(variable("DataType=5\nAccessType=rw\nLowLimit=none\n"), "[2000]", "[6071]"),
            "drive.eds:68: [6071] LowLimit: 'none' is no number"},
           {plus("[6040]\nDataType=0x0007\nAccessType=ro\n"),
            "drive.eds:63: [6040]: is here twice with different contents, first in line 57"},
           {plus("[1018Sub01]\nDataType=0x0006\nAccessType=ro\n"),
            "[1018Sub01]: is here twice with different contents, first in line 51"},
           {with(kSheet, "AccessType=rww", "AccessType=rww\n\xB5=1\n\xB5=2"),
            "drive.eds:63: [6040] \xC2\xB5: is here twice, as '1' in line 62 and as '2'"},
           {with(kSheet, "AccessType=rww", "AccessType=rww\naccesstype=ro"),
            "drive.eds:62: [6040] accesstype: is here twice, as 'rww' in line 61 and as "
            "'ro'"},
       }) {
    const std::string error = refusal(row.text);
    EXPECT_NE(error.find(row.message), std::string::npos) << row.message << "\n" << error;
  }
}

// source: robincornelius/libedssharp #219; UniMelbHumanRoboticsLab/CANOpenRobotController
TEST(DataSheet, RemarksOnWhatIsWrongWithAnObjectThatNobodyNeeds) {
  struct Row {
    const char* lines;
    const char* remark;
    bool stays = true;  ///< without a type or an access it is no entry
  };
  for (const Row& row : std::initializer_list<Row>{
           {"DataType=7\nAccessType=wo\nDefaultValue=0.0\n",
            "line 68: [2000] DefaultValue: '0.0' is no number: left out"},
           {"DataType=5\nAccessType=rw\nDefaultValue=256\n", "'256' does not fit the DataType"},
           {"DataType=5\nAccessType=rw\nHighLimit=many\n", "HighLimit: 'many' is no number"},
           {"DataType=5\nAccessType=user\nDefaultValue=3\n", "AccessType: 'user' is no access",
            false},
           {"DataType=BYTE\nAccessType=ro\nDefaultValue=3\n", "DataType: 'BYTE' is no such number",
            false},
       }) {
    const DataSheet sheet = read(variable(row.lines));
    EXPECT_NE(remarks(sheet).find(row.remark), std::string::npos) << remarks(sheet);
    EXPECT_EQ(sheet.has(0x2000), row.stays);
    EXPECT_TRUE(sheet.has(0x6040)) << "the rest is there";
  }
  const DataSheet odd = read(variable("DataType=7\nAccessType=wo\nDefaultValue=0.0\n"));
  EXPECT_FALSE(odd.value(0x2000, 0, 5).has_value()) << "unknown";
  EXPECT_EQ(odd.find(0x2000)->access, kWrite);
}

// source: robincornelius/libedssharp #219 (an editor that writes C's suffixes)
TEST(DataSheet, TakesNumbersWithTheSuffixesOfC) {
  for (const char* text :
       {"0x1234567890ABCDEFLL", "0x1234567890ABCDEFull", "0x1234567890ABCDEFL"}) {
    const DataSheet sheet = read(
        with(variable(std::string("DataType=0x1B\nAccessType=rw\nDefaultValue=") + text + "\n"),
             "[2000]", "[6071]"));
    EXPECT_EQ(sheet.value(0x6071, 0, 5), 0x1234567890ABCDEF) << text;
  }
  const DataSheet small = read(variable("DataType=6\nAccessType=rw\nDefaultValue=25u\n"));
  EXPECT_EQ(small.value(0x2000, 0, 5), 25);
}

TEST(DataSheet, NoticesWhereverItIsCutOff) {
  const DataSheet whole = read(kSheet);
  int refused = 0;
  // Behind the last object's AccessType nothing is left that it must have.
  const std::size_t end = kSheet.find("PDOMapping=1", kSheet.find("[6040]"));
  for (std::size_t size = 0; size < end; ++size) {
    const auto sheet = read_data_sheet(kSheet.substr(0, size), "drive.eds");
    refused += sheet.has_value() ? 0 : 1;
    if (sheet.has_value() && sheet->remarks.empty()) {
      EXPECT_EQ(sheet->entries.size(), whole.entries.size()) << kSheet.substr(0, size);
    }
  }
  EXPECT_GT(refused, 700);
  EXPECT_NE(refusal(kSheet.substr(0, end - 20)).find("the file ends in the middle of"),
            std::string::npos);
}

TEST(DataSheet, RefusesASheetThatLacksMuchOfWhatItLists) {
  std::string list = "SupportedObjects=6\n1=0x6040\n";
  for (int i = 2; i <= 6; ++i) list += std::to_string(i) + "=0x604" + std::to_string(i) + "\n";
  const std::string error = refusal(with(kSheet, "SupportedObjects=1\n1=0x6040\n", list));
  EXPECT_NE(error.find("drive.eds:23: [OptionalObjects]: 5 of 9 listed objects are not defined: "
                       "6042, 6043, 6044, 6045, 6046 (the file seems to be cut off"),
            std::string::npos)
      << error;
}

TEST(DataSheet, HasALimitOnItsSize) {
  const std::string sheet = kSheet + "[Comments]\n";
  std::string text = sheet + std::string(kMaxSheetBytes - sheet.size(), '\n');
  EXPECT_TRUE(read_data_sheet(text, "drive.eds").has_value());
  text += '\n';
  EXPECT_NE(refusal(text).find("drive.eds: has 4000001 bytes, and a data sheet may have 4000000"),
            std::string::npos);
  std::string arrays = kSheet;
  for (int index = 0x3000; index < 0x3000 + 400; ++index) {
    char name[8];
    std::snprintf(name, sizeof name, "%04X", static_cast<unsigned>(index));
    arrays +=
        std::string("[") + name + "]\nObjectType=8\nDataType=5\nAccessType=rw\nCompactSubObj=254\n";
  }
  EXPECT_NE(refusal(arrays).find("the sheet has more than 100000 entries"), std::string::npos);
}

TEST(DataSheet, OfAFileThatIsNoneIsAnError) {
  const test::ScratchFolder folder;
  const std::string file = folder / "drive.eds";
  EXPECT_EQ(load_data_sheet(file).error().message, "cannot read this file");
  EXPECT_EQ(load_data_sheet(folder.path()).error().message, "this is a folder");
  EXPECT_EQ(load_data_sheet("/dev/zero").error().message, "this is no regular file");
  std::ofstream(file) << kSheet;
  EXPECT_EQ(load_data_sheet(file)->entries.size(), 5U);
  std::filesystem::resize_file(file, 100'000'000);  // takes no place on the disk
  EXPECT_EQ(load_data_sheet(file).error().message,
            "has 100000000 bytes, and at most 4000000 are read");
}

}  // namespace
}  // namespace tandem::canopen
