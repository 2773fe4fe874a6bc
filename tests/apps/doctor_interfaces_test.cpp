// The doctor's look at CAN interfaces, from what `ip -details -json link show` prints.
#include "tests/apps/machine_tree.hpp"

namespace tandem::apps {
namespace {

/// A controller as it should be; a test spoils one thing of it.
constexpr char kGood[] = R"([{
  "ifname": "lo", "flags": ["LOOPBACK","UP"], "mtu": 65536, "txqlen": 1000, "link_type": "loopback"
},{
  "ifname": "can0", "flags": ["NOARP","UP","LOWER_UP","ECHO"], "mtu": 72, "txqlen": 100,
  "operstate": "UP", "link_type": "can",
  "linkinfo": { "info_kind": "can", "info_data": {
    "ctrlmode": ["FD"], "state": "ERROR-ACTIVE", "berr_counter": { "tx": 0, "rx": 0 },
    "restart_ms": 100,
    "bittiming": { "bitrate": 1000000, "sample_point": "0.750" },
    "data_bittiming": { "bitrate": 8000000, "sample_point": "0.700" }
  } }
}])";

class DoctorInterfaces : public MachineTree {
 protected:
  void SetUp() override {
    MachineTree::SetUp();
    robot_.buses = {{.name = "leg", .interface = "can0"}};
    for (int node = 1; node <= 6; ++node) {
      hal::BoardConfig board;
      board.bus = "leg";
      board.node_id = node;
      robot_.boards.push_back(board);
    }
  }
  /// The good interface with the first `from` replaced.
  [[nodiscard]] std::vector<Finding> with(const std::string& from, const std::string& to) const {
    std::string text = kGood;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    write("/ip.json", text.replace(at, from.size(), to));
    return examine_interfaces(machine(), robot_);
  }
  void expect(const std::vector<Finding>& findings, const std::string& name, Health health,
              const std::string& value, const std::string& mend) const {
    const Finding& one = named(findings, name);
    EXPECT_EQ(to_string(one.health), std::string(to_string(health))) << name;
    EXPECT_NE(one.value.find(value), std::string::npos) << one.value;
    EXPECT_NE(one.mend.find(mend), std::string::npos) << one.mend;
  }

  hal::RobotConfig robot_;
};

TEST_F(DoctorInterfaces, FindsNothingWrongWithAGoodOne) {
  const auto findings = with("can0", "can0");
  EXPECT_EQ(findings.size(), 7U);
  for (const Finding& one : findings) {
    EXPECT_EQ(to_string(one.health), std::string("ok")) << one.name << ": " << one.why;
    EXPECT_TRUE(one.mend.empty()) << one.mend;
  }
}

TEST_F(DoctorInterfaces, MissesTheOneThatRobotTomlNames) {
  expect(with("can0", "can7"), "can0", Health::kMissing, "no such interface",
         "type can bitrate 1000000 restart-ms 100 dbitrate 8000000 fd on");
}

TEST_F(DoctorInterfaces, RefusesWhatIsNoCan) {
  const auto findings = with(R"("link_type": "can")", R"("link_type": "ether")");
  EXPECT_EQ(findings.size(), 1U);
  expect(findings, "can0 type", Health::kMissing, "can", "robot.toml");
}

TEST_F(DoctorInterfaces, WantsItUp) {
  expect(with(R"("NOARP","UP","LOWER_UP")", R"("NOARP")"), "can0 state", Health::kMissing, "down",
         "ip link set can0 up");
}

TEST_F(DoctorInterfaces, TellsTheControllersState) {
  expect(with("ERROR-ACTIVE", "BUS-OFF"), "can0 state", Health::kMissing, "BUS-OFF",
         "type can restart");
  expect(with("ERROR-ACTIVE", "ERROR-PASSIVE"), "can0 state", Health::kWarning, "ERROR-PASSIVE",
         "candump -e");
}

TEST_F(DoctorInterfaces, WantsFdWhereRobotTomlHasIt) {
  expect(with(R"("mtu": 72)", R"("mtu": 16)"), "can0 frames", Health::kMissing, "classic", "fd on");
  robot_.buses[0].fd = false;
  expect(with(R"("mtu": 72)", R"("mtu": 16)"), "can0 frames", Health::kOk, "classic", "");
  expect(with(R"("mtu": 72)", R"("mtu": 8)"), "can0 frames", Health::kMissing, "", "");
}

TEST_F(DoctorInterfaces, WantsAQueueForTheFramesOfACycle) {
  expect(with(R"("mtu": 72, "txqlen": 100)", R"("mtu": 72, "txqlen": 10)"), "can0 queue",
         Health::kWarning, "10 frames", "ip link set can0 txqueuelen 100");
  expect(with(R"("mtu": 72, "txqlen": 100)", R"("mtu": 72, "txqlen": 20)"), "can0 queue",
         Health::kOk, "20", "");
  expect(with(R"("mtu": 72, "txqlen": 100)", R"("mtu": 72, "txqlen": 19)"), "can0 queue",
         Health::kWarning, "19", "");
}

TEST_F(DoctorInterfaces, ComparesTheBitRatesWithRobotToml) {
  expect(with("\"bitrate\": 1000000", "\"bitrate\": 500000"), "can0 bit rate", Health::kMissing,
         "500000", "bitrate 1000000");
  expect(with("8000000", "5000000"), "can0 data rate", Health::kMissing, "5000000",
         "dbitrate 8000000");
  expect(with(R"("bittiming": { "bitrate": 1000000, "sample_point": "0.750" },)", ""),
         "can0 bit rate", Health::kMissing, "not set", "bitrate 1000000");
}

TEST_F(DoctorInterfaces, WantsARestartAfterBusOff) {
  expect(with(R"("restart_ms": 100)", R"("restart_ms": 0)"), "can0 restart", Health::kWarning,
         "by hand", "restart-ms 100");
}

TEST_F(DoctorInterfaces, AsksNoBitRateOfAVirtualOne) {
  const auto findings = with(R"("info_kind": "can")", R"("info_kind": "vcan")");
  EXPECT_EQ(findings.size(), 4U);
  expect(findings, "can0 type", Health::kOk, "vcan: virtual, no bit rate", "");
}

TEST_F(DoctorInterfaces, SaysWhenIpTellsNothing) {
  const auto findings = examine_interfaces(machine(), robot_);
  ASSERT_EQ(findings.size(), 1U);
  expect(findings, "CAN interfaces", Health::kWarning, "unknown", "apt-get install iproute2");
}

/// The interface of an EtherCAT line.
TEST_F(DoctorInterfaces, WantsALinkForALine) {
  robot_.buses = {{.name = "leg", .interface = "eth1", .kind = hal::BusKind::kEthercat}};
  const std::string good = R"([{"ifname": "eth1", "flags": ["UP"], "mtu": 1500,
                                "operstate": "UP", "link_type": "ether"}])";
  const auto look = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    write("/ip.json", text.replace(text.find(from), from.size(), to));
    return examine_interfaces(machine(), robot_);
  };
  expect(look("UP", "UP"), "eth1 link", Health::kOk, "up", "");
  expect(look(R"("UP"])", R"("BROADCAST"])"), "eth1 link", Health::kMissing, "down",
         "ip link set eth1 up");
  expect(look(R"("operstate": "UP")", R"("operstate": "DOWN")"), "eth1 link", Health::kMissing,
         "DOWN", "the first slave");
  expect(look("ether", "can"), "eth1 type", Health::kMissing, "can", "another interface");
  expect(look("1500", "576"), "eth1 frames", Health::kMissing, "576", "mtu 1500");
  expect(look("eth1", "eth2"), "eth1", Health::kMissing, "no such interface", "--interface");
}

}  // namespace
}  // namespace tandem::apps
