// What the doctor says of the slaves behind an EtherCAT interface.
#include <unistd.h>

#include "apps/can/interface_lock.hpp"
#include "tests/apps/machine_tree.hpp"

namespace tandem::apps {
namespace {

using hal::ecat::LineSurvey;

/// A line of two boards and a survey of it in which all is well; a test spoils one thing of it.
class DoctorLine : public MachineTree {
 protected:
  void SetUp() override {
    MachineTree::SetUp();
    robot_.buses = {{.name = "line", .interface = "eth1", .kind = hal::BusKind::kEthercat}};
    // The place is the node's id, not the order in the file.
    for (int node = 2; node >= 1; --node) {
      hal::BoardConfig board;
      board.name = "board_" + std::to_string(node);
      board.bus = "line";
      board.node_id = node;
      board.vendor_id = 0x10;
      board.product_code = 0x20 + static_cast<std::uint32_t>(node);
      board.revision = 0x00030002;
      robot_.boards.push_back(board);
    }
    survey_.found = 2;
    survey_.states = 1;
    survey_.asked = 1000;
    survey_.slaves = {{.identified = true,
                       .identity = {.vendor = 0x10, .product = 0x21, .revision = 0x00030002},
                       .has_clock = true},
                      {.identified = true,
                       .identity = {.vendor = 0x10, .product = 0x22, .revision = 0x00030004},
                       .has_clock = true,
                       .samples = 200,
                       .delay_ns = 310,
                       .difference_ns = 25,
                       .jitter_ns = 6.4}};
  }
  [[nodiscard]] DoctorResult judge() const {
    return judge_line(robot_, robot_.buses[0], {}, survey_);
  }
  void expect(const std::string& name, Health health, const std::string& value,
              const std::string& mend) const {
    const DoctorResult line = judge();
    const Finding& one = named(line.findings, name);
    EXPECT_EQ(to_string(one.health), std::string(to_string(health))) << name;
    EXPECT_NE(one.value.find(value), std::string::npos) << one.value;
    EXPECT_NE(one.mend.find(mend), std::string::npos) << one.mend;
  }

  hal::RobotConfig robot_;
  LineSurvey survey_;
};

TEST_F(DoctorLine, NamesAMemoryWhoseCheckSumIsWrong) {
  survey_.slaves[1].settings_right = false;
  expect("eth1 identities", Health::kMissing, "slave 1 (board_2): wrong check sum",
         "its maker's tool");
}

TEST_F(DoctorLine, FindsNothingWrongWithAGoodOne) {
  const DoctorResult line = judge();
  for (const Finding& one : line.findings) {
    EXPECT_EQ(to_string(one.health), std::string("ok")) << one.name << ": " << one.why;
  }
  expect("eth1 slaves", Health::kOk, "2 of 2", "");
  expect("eth1 clocks", Health::kOk, "within 25 ns of slave 0 (board_1), jitter 6 ns", "");
  expect("eth1 delay", Health::kOk, "310 ns", "");
  ASSERT_EQ(line.clocks.size(), 1U);
  EXPECT_EQ(line.clocks[0].name, "board_2");
  EXPECT_EQ(line.clocks[0].slave, 1U);
}

TEST_F(DoctorLine, NamesAnotherMaster) {
  survey_ = {};
  survey_.strangers = 7;
  expect("eth1 master", Health::kMissing, "another one sent 7 frames", "end the other program");
  EXPECT_EQ(judge().findings.size(), 1U) << "nothing else was looked at";
}

TEST_F(DoctorLine, NamesTheFirstSlaveThatIsNotThere) {
  survey_.found = 1;
  survey_.slaves.pop_back();
  expect("eth1 slaves", Health::kMissing, "1 of 2", "cable");
  EXPECT_NE(named(judge().findings, "eth1 slaves").why.find("slave 1 (board_2)"),
            std::string::npos);
  survey_.found = 0;
  survey_.slaves.clear();
  expect("eth1 slaves", Health::kMissing, "0 of 2", "slave 0 (board_1)");
  expect("eth1 slaves", Health::kMissing, "0 of 2", "leave --lockstep out");
  survey_.found = 5;
  expect("eth1 slaves", Health::kMissing, "5 of 2", "robot.toml");
}

TEST_F(DoctorLine, NamesTheFirstSlaveThatIsAnother) {
  std::swap(survey_.slaves[0].identity, survey_.slaves[1].identity);
  expect("eth1 identities", Health::kMissing,
         "slave 0 (board_1): vendor 00000010, product 00000022", "order");
  std::swap(survey_.slaves[0].identity, survey_.slaves[1].identity);
  survey_.slaves[1].identity.revision = 0x00030001;
  expect("eth1 identities", Health::kMissing, "slave 1 (board_2)", "robot.toml");
  survey_.slaves[1].identified = false;
  expect("eth1 identities", Health::kMissing, "slave 1 (board_2): none", "switch it off");
  expect("eth1 identities", Health::kMissing, "slave 1", "leave --lockstep out");
}

TEST_F(DoctorLine, EmulatedSlavesStandForAnyMakersButForNoOtherProduct) {
  for (auto& slave : survey_.slaves) slave.identity.vendor = ethercat::sii::kNobodysVendor;
  expect("eth1 identities", Health::kOk, "emulated", "");
  survey_.slaves[1].identity.product = 0x99;
  expect("eth1 identities", Health::kMissing, "slave 1", "");
}

TEST_F(DoctorLine, WarnsOfClocksThatAreOffOrNotMeasured) {
  survey_.slaves[1].difference_ns = 1500;
  expect("eth1 clocks", Health::kWarning, "within 1500 ns", "slave 1 (board_2)");
  survey_.slaves[1].samples = 0;
  expect("eth1 clocks", Health::kMissing, "slave 1 (board_2) was not heard", "ethtool");
  survey_.states = 3;
  expect("eth1 states", Health::kWarning, "INIT", "off and on");
  EXPECT_TRUE(judge().clocks.empty());
  survey_.states = 1;
  survey_.reference = 2;
  expect("eth1 clocks", Health::kWarning, "none", "");
  survey_.repeated = 11;
  expect("eth1 losses", Health::kWarning, "11 of 1000 questions", "ethtool");
  survey_.repeated = 10;
  expect("eth1 losses", Health::kOk, "10 of 1000", "");
}

TEST_F(DoctorLine, SendsNothingWhileARunHasTheInterface) {
  robot_.buses[0].interface = "doctor" + std::to_string(::getpid());
  const auto held = InterfaceLock::take(robot_.buses[0].interface, hal::can::SocketSide::kMaster);
  ASSERT_TRUE(held);
  const DoctorResult line = look_at_line(robot_, robot_.buses[0]);
  ASSERT_EQ(line.findings.size(), 1U);
  const Finding& one = line.findings[0];
  EXPECT_EQ(one.name, robot_.buses[0].interface + " master");
  EXPECT_EQ(to_string(one.health), std::string("missing"));
  EXPECT_NE(one.why.find(std::to_string(::getpid())), std::string::npos) << one.why;
}

}  // namespace
}  // namespace tandem::apps
