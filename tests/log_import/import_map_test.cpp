// Each error of a map names its key.
#include "tests/log_import/rig.hpp"

namespace tandem::log {
namespace {

using namespace test;

std::string errors_of(const std::string& text, bool bag = false) {
  const auto map = parse_import_map(text, "map.toml", pendulum(), bag);
  std::string all;
  if (map) return all;
  for (const Error& error : map.error()) all += error.to_string() + "\n";
  return all;
}

const std::string kWhole = R"(
joints = ["joint1", "joint2"]
[time]
column = "t"
unit = "s"
[position]
columns = "q{1}"
unit = "rad"
)";

TEST(ImportMap, IsStrict) {
  EXPECT_EQ(errors_of(kWhole), "");
  EXPECT_HAS(errors_of(kWhole + "colums = 3\n"), "position.colums: unknown key");
  EXPECT_HAS(errors_of("joint = []\n" + kWhole), "joint: unknown key");
  EXPECT_HAS(errors_of("exclude = [\"gap\"]\n" + kWhole),
             "no such trouble as 'gap' (did you mean 'gaps'?");
  EXPECT_HAS(errors_of(kWhole + "[torque]\ncolumns = [\"a\"]\nunit = \"Nm\"\n"),
             "torque.columns: has 1 columns for 2 joints");
  EXPECT_HAS(errors_of(kWhole + "[torque]\ncolumns = \"a\"\nunit = \"Nm\"\n"),
             "no list and no pattern");
  EXPECT_HAS(errors_of(kWhole + "[torque]\ncolumns = \"a{1}\"\nunit = \"A\"\n"), "torque.unit");
  EXPECT_HAS(errors_of(kWhole + "[torque]\ncolumns = \"a{1}\"\nunit = \"raw\"\n"),
             "torque.scale: is missing: the unit is raw");
  EXPECT_HAS(errors_of(kWhole + "[sensor.ftt]\n"), "has no sensor 'ftt' (did you mean 'ft'?");
  EXPECT_HAS(errors_of(kWhole + "[sensor.ft]\ncolumns = \"f{1}\"\nforce_unit = \"N\"\n"
                                "moment_unit = \"Nm\"\n"),
             "sensor.ft.measures");
  EXPECT_HAS(errors_of(kWhole + "[csv]\ndecimal_comma = true\n"), "csv.decimal_comma");
  EXPECT_HAS(errors_of(kWhole + "[bag]\nstamp = \"log\"\n"), "bag");
  EXPECT_HAS(errors_of("[time]\nby_rows = true\n" + kWhole.substr(0, kWhole.find("[time]"))),
             "time.period_s: is missing");
  EXPECT_HAS(errors_of(kWhole + "[command]\nmode = \"position\"\n[command.temperature]\n"),
             "command.temperature");
}

/// The file was blamed for it: "tau1: never changes".
TEST(ImportMap, RefusesAScaleOfNothing) {
  EXPECT_HAS(errors_of(kWhole + "scale = [0]\n"), "position.scale: is 0");
  EXPECT_HAS(errors_of(kWhole + "scale = [1, 0]\n"), "position.scale: is 0");
  EXPECT_HAS(errors_of(kWhole + "counts_per_turn = [0]\n"), "position.counts_per_turn: is 0");
}

/// A key that is only looked for, not read, is known all the same.
TEST(ImportMap, SuggestsTheKeyThatIsMeant) {
  std::string map = kWhole;
  map.replace(map.find("unit"), 0, "peroid_s = 0.01\n");
  EXPECT_HAS(errors_of(map), "did you mean 'period_s'?");
}

/// One mistake is one error.
TEST(ImportMap, SaysWhatIsWrongOnce) {
  std::string map = kWhole;
  map.replace(map.find("joint2"), 6, "joint3");
  const std::string misspelt = errors_of(map);
  EXPECT_HAS(misspelt, "has no joint 'joint3'");
  EXPECT_EQ(misspelt.find("twice"), std::string::npos) << misspelt;
  EXPECT_EQ(misspelt.find("lacks"), std::string::npos) << misspelt;
  map = kWhole;
  map.replace(map.find("\"q{1}\""), 6, "[\"q1\", \"q1\"]");
  EXPECT_HAS(errors_of(map), "position.columns: names 'q1' twice");
  EXPECT_HAS(errors_of("[time]\ncolumn = \"t\"\n", true), "this recording is a bag");
}

TEST(ImportMap, OfABagNeedsNoColumns) {
  EXPECT_EQ(errors_of("", true), "");
  EXPECT_HAS(errors_of("[current]\nunit = \"A\"\n", true), "current");
  EXPECT_HAS(errors_of("[bag.names]\na = \"joint1\"\nb = \"joint1\"\n", true), "bag.names.b");
  EXPECT_HAS(errors_of("[bag.names]\na = \"joint9\"\n", true), "bag.names.a");
  EXPECT_HAS(errors_of("[sensor.ft]\nmeasures = \"child_on_parent\"\n", true), "sensor.ft.topic");
}

}  // namespace
}  // namespace tandem::log
