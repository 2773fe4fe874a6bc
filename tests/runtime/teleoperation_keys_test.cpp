// [teleoperation]: what it means, and what is refused.
#include <gtest/gtest.h>

#include "runtime/teleoperation.hpp"

namespace tandem::runtime {
namespace {

/// The first error of a table's text; empty: there is none.
std::string error_of(const std::string& text) {
  const auto document = TomlDocument::parse("[teleoperation]\n" + text, "x.toml");
  if (!document) return document.error().to_string();
  TomlTable root = document->root();
  (void)read_teleoperation(root);
  return document->diagnostics().empty() ? "" : document->diagnostics().front().to_string();
}

Teleoperation read(const std::string& text) {
  const auto document = TomlDocument::parse("[teleoperation]\n" + text, "x.toml");
  TomlTable root = document->root();
  auto read = read_teleoperation(root);
  EXPECT_TRUE(document->diagnostics().empty());
  return *read;
}

TEST(TeleoperationKeys, AreAbsentWithoutTheTable) {
  const auto document = TomlDocument::parse("seed = 1\n", "x.toml");
  TomlTable root = document->root();
  EXPECT_FALSE(read_teleoperation(root));
}

TEST(TeleoperationKeys, HaveTheirDefaults) {
  const Teleoperation one = read("[teleoperation.up]\ndelay_s = 0.25\njitter_s = 0.01\n");
  EXPECT_TRUE(one.link.predict);
  EXPECT_EQ(one.link.playout_ns, 310'000'000) << "delay, four jitters, 20 ms";
  EXPECT_EQ(one.link.brake_ns, 250'000'000);
  EXPECT_FALSE(one.real);
  EXPECT_EQ(playout_cycles(one, 1'000'000), 310U);
  EXPECT_EQ(one.link.down, (remote::NetworkConfig{.limit = 10'000}));
  EXPECT_TRUE(one.robot_controllers.empty());
}

TEST(TeleoperationKeys, AreRead) {
  const Teleoperation one = read(R"(predict = false
link = "real"
playout_s = 0.5
[[teleoperation.outage]]
from_s = 2.0
to_s = 3.5
[[teleoperation.robot_controller]]
plugin = "hold"
[teleoperation.down]
loss_model = "gilbert_elliott"
to_bad = 0.1
distribution = "pareto"
keeps_order = true
)");
  EXPECT_FALSE(one.link.predict);
  EXPECT_TRUE(one.real);
  EXPECT_EQ(one.link.playout_ns, 500'000'000);
  ASSERT_EQ(one.link.outages.size(), 1U);
  EXPECT_EQ(one.link.outages[0].to_ns, 3'500'000'000);
  ASSERT_EQ(one.robot_controllers.size(), 1U);
  EXPECT_EQ(one.robot_controllers[0].name, "hold");
  EXPECT_EQ(one.link.down.to_good, 0.9);
  EXPECT_EQ(one.link.down.distribution, remote::DelayDistribution::kPareto);
  EXPECT_TRUE(one.link.down.keeps_order);
}

TEST(TeleoperationKeys, RobotControllersAreComparedByWhatTheyMean) {
  const auto values = [](const std::string& parameters) {
    return robot_controller_values(
        read("[[teleoperation.robot_controller]]\nplugin = \"./lib/balance.so\"\nname = \"legs\"\n"
             "[teleoperation.robot_controller.parameters]\n" +
             parameters));
  };
  const std::map<std::string, std::string> expected{
      {"legs", "\"balance\""}, {"legs.joints", "[\"a\", \"b\"]"}, {"legs.stiff_Nm_rad", "12"}};
  EXPECT_EQ(values("joints = [\"a\", \"b\"]\nstiff_Nm_rad = 12.0\n"), expected);
  EXPECT_EQ(values("stiff_Nm_rad = 12   # as before\njoints = [ \"a\",\n \"b\" ]\n"), expected);
  EXPECT_NE(values("joints = [\"b\", \"a\"]\nstiff_Nm_rad = 12.0\n"), expected);
  EXPECT_TRUE(robot_controller_values(read("")).empty());
}

TEST(TeleoperationKeys, WrongOnesAreNamed) {
  const auto expect = [](const std::string& text, const std::string& part) {
    const std::string error = error_of(text);
    EXPECT_NE(error.find(part), std::string::npos) << error;
  };
  expect("predicts = true\n", "x.toml:2: teleoperation.predicts: unknown key");
  expect("playout_s = 0.1\n[teleoperation.up]\ndelay_s = 0.25\n", "none would come in time");
  expect("[teleoperation.up]\nloss = 1.2\n", "teleoperation.up.loss");
  expect("[teleoperation.up]\ndelay_ms = 3\n", "teleoperation.up.delay_ms: unknown key");
  expect("[teleoperation.up]\nloss_model = \"gilbert\"\n", "did you mean");
  expect("[teleoperation.down]\nloss_model = \"markov\"\n", "teleoperation.down.p13");
  expect("[teleoperation.down]\nloss_model = \"markov\"\nloss = 0.1\np13 = 0.1\n",
         "teleoperation.down.loss: unknown key");
  expect("[teleoperation.down]\nreorder = 0.1\n", "needs a delay");
  expect("[[teleoperation.outage]]\nfrom_s = 2.0\nto_s = 1.0\n", "to_s");
  expect("[[teleoperation.robot_controller]]\nname = \"x\"\n", "plugin");
}

}  // namespace
}  // namespace tandem::runtime
