// The reader of EtherCAT slaves' files: what a file of a drive has, and what no file may have.
#include <string>

#include <gtest/gtest.h>

#include "canopen/data_sheet.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"

namespace tandem::canopen {
namespace {

/// Our own; the forms (arrays in "Elements", gaps of index 0, Exclude, DefaultData) are those of
/// files of drives that are sold. source: leducp/KickCAT tools/ingenia_esi.xml, ETG.2000
const std::string kSlaveFile = R"(<?xml version="1.0" encoding="utf-8"?>
<EtherCATInfo Version="1.6">
  <Vendor><Id>#x0000FFF1</Id><Name LcId="1031">Beispiel</Name><Name LcId="1033">Example</Name></Vendor>
  <Descriptions><Devices>
    <Device Physics="YY">
      <Type ProductCode="#x00000200" RevisionNo="65538">LINE-1</Type>
      <Name><![CDATA[Line servo]]></Name>
      <GroupType>Drives</GroupType>
      <Profile><ProfileNo>402</ProfileNo><AddInfo>2</AddInfo><Dictionary>
        <DataTypes>
          <DataType><Name>UDINT</Name><BitSize>32</BitSize></DataType>
          <DataType><Name>MODE</Name><BaseType>SINT</BaseType><BitSize>8</BitSize></DataType>
          <DataType><Name>DT60C2</Name><SubItem><SubIdx>0</SubIdx><Name>Count</Name><Type>USINT</Type>
            <Flags><Access>ro</Access></Flags></SubItem>
            <SubItem><SubIdx>1</SubIdx><Name>Period</Name><Type>USINT</Type><Flags><Access>rw</Access></Flags></SubItem>
            <SubItem><SubIdx>2</SubIdx><Name>Index</Name><Type>SINT</Type><Flags><Access>rw</Access></Flags></SubItem>
          </DataType>
          <DataType><Name>ARR</Name><BaseType>UDINT</BaseType><ArrayInfo><LBound>1</LBound><Elements>2</Elements></ArrayInfo></DataType>
          <DataType><Name>DT608F</Name><SubItem><SubIdx>0</SubIdx><Name>Count</Name><Type>USINT</Type></SubItem>
            <SubItem><Name>Elements</Name><Type>ARR</Type><Flags><Access>ro</Access></Flags></SubItem></DataType>
        </DataTypes>
        <Objects>
          <Object><Index>#x6060</Index><Name>Modes of operation</Name><Type>MODE</Type>
            <Info><DefaultValue>8</DefaultValue><MinValue>-4</MinValue><MaxValue>10</MaxValue></Info>
            <Flags><Access>rw</Access><PdoMapping>R</PdoMapping></Flags></Object>
          <Object><Index>#x608F</Index><Name>Encoder</Name><Type>DT608F</Type><Info>
            <SubItem><Name>Count</Name><Info><DefaultData>02</DefaultData></Info></SubItem>
            <SubItem><Name>Increments</Name><Info><DefaultData>00000400</DefaultData></Info></SubItem>
            <SubItem><Name>Revolutions</Name><Info><DefaultData>01000000</DefaultData></Info></SubItem></Info></Object>
          <Object><Index>#x60C2</Index><Name>Period</Name><Type>DT60C2</Type></Object>
          <Object><Index>#x6502</Index><Name>Modes</Name><Type>UDINT</Type>
            <Info><DefaultData>80030000</DefaultData></Info><Flags><Access>ro</Access></Flags></Object>
          <Object><Index>#x2300</Index><Name>Odd</Name><Type>UDINT</Type>
            <Info><DefaultValue>0.0</DefaultValue></Info></Object>
        </Objects>
      </Dictionary></Profile>
      <Sm StartAddress="#x1000" DefaultSize="128" ControlByte="#x26" Enable="1">MBoxOut</Sm>
      <Sm StartAddress="#x1080" DefaultSize="128" ControlByte="#x22" Enable="1">MBoxIn</Sm>
      <Sm StartAddress="#x1100" DefaultSize="8" MaxSize="64" ControlByte="#x64" Enable="1">Outputs</Sm>
      <Sm StartAddress="#x1400" DefaultSize="11" ControlByte="#x20" Enable="1">Inputs</Sm>
      <RxPdo Sm="2"><Index>#x1600</Index><Name>Csp</Name><Exclude>#x1601</Exclude>
        <Entry><Index>#x6040</Index><SubIndex>0</SubIndex><BitLen>16</BitLen><Name>Controlword</Name><DataType>UINT</DataType></Entry>
        <Entry><Index>#x607A</Index><BitLen>32</BitLen><Name>Target</Name><DataType>DINT</DataType></Entry>
        <Entry><Index>#x6060</Index><BitLen>8</BitLen><DataType>SINT</DataType></Entry>
        <Entry><Index>0</Index><BitLen>8</BitLen></Entry>
      </RxPdo>
      <RxPdo Fixed="1"><Index>#x1601</Index><Name>Other</Name>
        <Entry><Index>#x6040</Index><BitLen>16</BitLen><DataType>UINT</DataType></Entry></RxPdo>
      <TxPdo Fixed="true" Mandatory="1" Sm="3"><Index>#x1A00</Index><Name>State</Name>
        <Entry><Index>#x6041</Index><BitLen>16</BitLen><Name>Statusword</Name><DataType>UINT</DataType></Entry>
        <Entry><Index>#x6064</Index><BitLen>32</BitLen><Name>Position</Name><DataType>DINT</DataType></Entry>
        <Entry><Index>#x6061</Index><BitLen>8</BitLen><Name>Display</Name><DataType>SINT</DataType></Entry>
        <Entry><Index>#x606C</Index><BitLen>32</BitLen><Name>Velocity</Name><DataType>DINT</DataType></Entry>
      </TxPdo>
      <Mailbox><CoE SdoInfo="1" PdoAssign="1" PdoConfig="1">
        <InitCmd><Transition>PS</Transition><Index>#x6060</Index><SubIndex>0</SubIndex><Data>08</Data></InitCmd>
      </CoE></Mailbox>
      <Dc><OpMode><Name>FreeRun</Name><AssignActivate>#x0</AssignActivate></OpMode>
        <OpMode><Name>DC</Name><AssignActivate>#x300</AssignActivate></OpMode></Dc>
    </Device>
  </Devices></Descriptions>
</EtherCATInfo>)";

std::string slave_with(const std::string& old, const std::string& now) {
  std::string text = kSlaveFile;
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return at == std::string::npos ? text : text.replace(at, old.size(), now);
}

DataSheet read_slave(const std::string& text, const DeviceChoice& choice = {}) {
  auto sheet = read_data_sheet(text, "drive.xml", choice);
  EXPECT_TRUE(sheet.has_value()) << sheet.error().to_string();
  return sheet.value_or(DataSheet{});
}

std::string slave_error(const std::string& text, const DeviceChoice& choice = {}) {
  const auto sheet = read_data_sheet(text, "drive.xml", choice);
  return sheet ? "it is read" : sheet.error().to_string();
}

TEST(Esi, IsReadAsTheSheetOfASlave) {
  const DataSheet sheet = read_slave(kSlaveFile);
  EXPECT_TRUE(sheet.ethercat);
  EXPECT_EQ(sheet.vendor_name, "Example");
  EXPECT_EQ(sheet.product_name, "Line servo");
  EXPECT_EQ(sheet.vendor, 0xFFF1U);
  EXPECT_EQ(sheet.product, 0x200U);
  EXPECT_EQ(sheet.revision, 0x10002U);
  ASSERT_EQ(sheet.managers.size(), 4U);
  EXPECT_EQ(sheet.managers[2].use, "Outputs");
  EXPECT_EQ(sheet.managers[2].most_bytes, 64U);
  ASSERT_EQ(sheet.dc_modes.size(), 2U);
  EXPECT_FALSE(sheet.dc_modes[0].sync0());
  EXPECT_TRUE(sheet.dc_modes[1].sync0());
  EXPECT_FALSE(sheet.dc_modes[1].sync1());
  ASSERT_EQ(sheet.writes.size(), 1U);
  EXPECT_EQ(sheet.writes[0].index, 0x6060);
  EXPECT_EQ(sheet.mandatory, std::vector<std::uint16_t>{0x1A00});
  ASSERT_EQ(sheet.excludes.size(), 1U);
  EXPECT_EQ(sheet.value(0x1000, 0, 0), 0x20192);
}

TEST(Esi, AnIdentityThatItDoesNotSayIsNotKnown) {
  std::string file = kSlaveFile;
  for (const std::string number :
       {"#x0000FFF1", "ProductCode=\"#x00000200\"", "RevisionNo=\"65538\""}) {
    const std::string none = number.front() == '#' ? "0" : "";
    file.replace(file.find(number), number.size(), none);
  }
  const auto sheet = read_data_sheet(file, "line.xml");
  ASSERT_TRUE(sheet.has_value()) << sheet.error().to_string();
  EXPECT_FALSE(sheet->vendor.has_value());
  EXPECT_FALSE(sheet->product.has_value());
  EXPECT_FALSE(sheet->revision.has_value());
}

TEST(Esi, PdosAreMappingsAndAnAssignment) {
  const DataSheet sheet = read_slave(kSlaveFile);
  EXPECT_EQ(sheet.value(0x1C12, 0, 0), 1);
  EXPECT_EQ(sheet.value(0x1C12, 1, 0), 0x1600);
  EXPECT_EQ(sheet.value(0x1C13, 1, 0), 0x1A00);
  EXPECT_EQ(sheet.value(0x1600, 0, 0), 4);
  EXPECT_EQ(sheet.value(0x1600, 2, 0), 0x607A0020);
  EXPECT_EQ(sheet.value(0x1600, 4, 0), 8) << "a gap";
  EXPECT_EQ(sheet.find(0x1600, 1)->access, kReadWrite);
  EXPECT_NE(sheet.find(0x1600, 8), nullptr) << "room for more";
  EXPECT_EQ(sheet.value(0x1A00, 0, 0), 4);
  EXPECT_EQ(sheet.find(0x1A00, 1)->access, kRead) << "fixed";
  EXPECT_EQ(sheet.find(0x1A00, 5), nullptr);
  ASSERT_NE(sheet.find(0x6064), nullptr) << "it is in no dictionary, and in a PDO";
  EXPECT_EQ(sheet.find(0x6064)->type, 4);
  EXPECT_EQ(sheet.find(0x6064)->access, kReadTpdo);
  EXPECT_EQ(sheet.find(0x6040)->access, kWriteRpdo);
  // PdoAssign and PdoConfig say what a master may write at all.
  const DataSheet rigid =
      read_slave(slave_with("PdoAssign=\"1\" PdoConfig=\"1\"", "PdoAssign=\"0\""));
  EXPECT_EQ(rigid.find(0x1C12)->access, kRead);
  EXPECT_EQ(rigid.find(0x1600)->access, kRead);
}

TEST(Esi, TheDictionaryHasTypesRightsLimitsAndValues) {
  const DataSheet sheet = read_slave(kSlaveFile);
  const SheetEntry* mode = sheet.find(0x6060);
  ASSERT_NE(mode, nullptr);
  EXPECT_EQ(mode->type, 2) << "by BaseType";
  EXPECT_EQ(mode->access, kWriteRpdo);
  EXPECT_EQ(mode->value->number, 8);
  EXPECT_EQ(mode->low, -4);
  EXPECT_EQ(mode->high, 10);
  EXPECT_EQ(sheet.value(0x608F, 1, 0), 0x40000) << "an array's values, little-endian";
  EXPECT_EQ(sheet.value(0x608F, 2, 0), 1);
  EXPECT_EQ(sheet.find(0x60C2, 2)->type, 2);
  EXPECT_EQ(sheet.find(0x60C2, 1)->access, kReadWrite);
  EXPECT_EQ(sheet.value(0x6502, 0, 0), 0x380);
  EXPECT_FALSE(sheet.find(0x2300)->value) << "0.0 is no UDINT: unknown, and the rest is read";
  ASSERT_EQ(sheet.remarks.size(), 1U);
  EXPECT_NE(sheet.remarks[0].find("'0.0' is none of its type"), std::string::npos);
}

TEST(Esi, ThatIsWrongIsRefusedWithLineAndElement) {
  struct Row {
    std::string old, now, message;
  };
  const Row rows[] = {
      {"<Id>#x0000FFF1</Id>", "<Id>Example</Id>", "drive.xml:3: EtherCATInfo/Vendor/Id: 'Example'"},
      {"<BitLen>32</BitLen><Name>Target", "<BitLen>many</BitLen><Name>Target",
       "RxPdo/Entry/BitLen: 'many' is no number from 0 to 65535"},
      {"<BitLen>32</BitLen><Name>Target", "<Name>Target", "Entry: has no BitLen"},
      {"<Index>#x1600</Index>", "<Index>#x1A00</Index>", "expected is #x1600 to #x17FF"},
      {"<Index>#x1600</Index>", "<Index>#x11600</Index>", "is no number from 0 to 65535"},
      {"<Access>rw</Access><PdoMapping>", "<Access>sometimes</Access><PdoMapping>",
       "'sometimes' is no access"},
      {"ProductCode=\"#x00000200\"", "ProductCode=\"two\"", "ProductCode 'two' is no number"},
      {"<BaseType>SINT</BaseType>", "<BaseType>MODE</BaseType>",
       "more than 8 data types that stand for each other"},
      {"<Exclude>#x1601</Exclude>", "<Exclude>none</Exclude>", "'none' is no PDO"},
      {"</EtherCATInfo>", "", "is no well-formed XML"},
  };
  for (const Row& row : rows) {
    const std::string error = slave_error(slave_with(row.old, row.now));
    EXPECT_TRUE(error.starts_with("drive.xml:")) << error;
    EXPECT_NE(error.find(row.message), std::string::npos) << error << "\nwanted: " << row.message;
  }
}

/// source: CANopenNode/CANopenEditor Tests/minimal_project.xdd
TEST(Esi, AnotherXmlIsNamedForWhatItIs) {
  const auto of_root = [](const std::string& root) {
    return slave_error("<?xml version=\"1.0\"?>\n<" + root + "><A /></" + root + ">");
  };
  EXPECT_NE(of_root("ISO15745ProfileContainer").find("is an XDD or XDC (CiA 311)"),
            std::string::npos);
  EXPECT_NE(of_root("ISO15745ProfileContainer").find("get the EDS or DCF"), std::string::npos);
  EXPECT_NE(of_root("EtherCATConfig").find("(ENI)"), std::string::npos);
  EXPECT_NE(of_root("robot").find("(URDF)"), std::string::npos);
  EXPECT_NE(of_root("html").find("its first element is <html>"), std::string::npos);
  EXPECT_NE(
      slave_error("<EtherCATInfo><Vendor><Id>1</Id></Vendor></EtherCATInfo>").find("no device"),
      std::string::npos);
  EXPECT_NE(slave_error("\xFF\xFE<\0?").find("UTF-16"), std::string::npos);
}

TEST(Esi, OneOfSeveralDevicesIsChosen) {
  const auto more = [](const std::string& type) {
    return "</Device><Device><Type " + type + ">B</Type></Device></Devices>";
  };
  const std::string end = "</Device>\n  </Devices>";
  const std::string two = slave_with(end, more("ProductCode=\"7\" RevisionNo=\"1\""));
  const std::string error = slave_error(two);
  EXPECT_NE(error.find("has 2 devices: 0x00000200 revision 0x00010002 (Line servo), 0x00000007"),
            std::string::npos)
      << error;
  EXPECT_EQ(read_slave(two, {.product = 0x200, .revision = {}}).product_name, "Line servo");
  EXPECT_EQ(read_slave(two, {.product = 7, .revision = {}}).product, 7U);
  EXPECT_NE(slave_error(two, {.product = 9, .revision = {}}).find("no device of this product"),
            std::string::npos);
  // The newest revision of a product, unless another is named.
  const std::string newer = slave_with(end, more("ProductCode=\"#x200\" RevisionNo=\"#x20000\""));
  EXPECT_EQ(read_slave(newer).revision, 0x20000U);
  EXPECT_EQ(read_slave(newer, {.product = {}, .revision = 0x10000}).revision, 0x10002U);
}

/// As drives with exchangeable modes: PDOs and objects are a module's. source: ETG.5001
TEST(Esi, AModuleOfASlotGivesItsPdos) {
  std::string text = slave_with("<Dc>", R"(<Slots SlotPdoIncrement="16" SlotIndexIncrement="2048">
    <Slot><ModuleIdent>#x1</ModuleIdent><ModuleIdent Default="1">#x2</ModuleIdent></Slot>
    <Slot MinInstances="1"><ModuleIdent>#x2</ModuleIdent></Slot></Slots><Dc>)");
  const std::string end = "</Devices></Descriptions>";
  text.replace(text.find(end), end.size(),
               R"(</Devices><Modules><Module><Type ModuleIdent="#x2">M</Type>
    <Name>csp</Name><RxPdo Sm="2"><Index DependOnSlot="1">#x1602</Index>
    <Entry><Index DependOnSlot="1">#x60FF</Index><BitLen>32</BitLen><DataType>DINT</DataType></Entry>
    </RxPdo></Module></Modules></Descriptions>)");
  const DataSheet sheet = read_slave(text);
  EXPECT_EQ(sheet.value(0x1602, 1, 0), 0x60FF0020);
  EXPECT_EQ(sheet.value(0x1612, 1, 0), 0x68FF0020) << "the second axis";
  EXPECT_EQ(sheet.value(0x1C12, 0, 0), 3);
  EXPECT_EQ(sheet.value(0x1C12, 3, 0), 0x1612);
}

TEST(Esi, HasBounds) {
  std::string deep;
  for (int i = 0; i < 70; ++i) deep += "<A>";
  EXPECT_NE(slave_error("<EtherCATInfo>" + deep).find("64 levels of elements"), std::string::npos);
  std::string entries;
  for (int i = 0; i < 255; ++i) entries += "<Entry><Index>0</Index><BitLen>8</BitLen></Entry>";
  EXPECT_NE(slave_error(slave_with("<Entry><Index>0</Index><BitLen>8</BitLen></Entry>", entries))
                .find("more than 254 entries of a PDO"),
            std::string::npos);
  std::string pdos;
  for (int i = 0; i < 513; ++i) {
    pdos += "<TxPdo><Index>" + std::to_string(0x1A01 + i % 0x1FF) + "</Index></TxPdo>";
  }
  EXPECT_NE(slave_error(slave_with("<Mailbox>", pdos + "<Mailbox>")).find("more than 512 PDOs"),
            std::string::npos);
  EXPECT_NE(slave_error("<EtherCATInfo>" + std::string(16'000'001, ' ')).find("16000000 bytes"),
            std::string::npos);
}

}  // namespace
}  // namespace tandem::canopen
