// Values that are set instead of those of a TOML text.
#include "base/toml_setting.hpp"

#include <gtest/gtest.h>

#include "base/toml_reader.hpp"

namespace tandem {
namespace {

constexpr const char* kText = R"(# Ä comment
robot = "../coman/robot.toml"
place = { x = 1 }

[hal]
delay = 2 # cycles

[sim.link.torso]
mass_kg = 3.5

[[push]]
name = "äh, a bump"
impulse_Ns = [-3.0, 0, 0.5]
[push.deep]
x = 1

[[push]]
name = "second"
)";

std::string set(const std::vector<std::string>& texts, const std::string& file = kText) {
  std::vector<TomlSetting> settings;
  for (const std::string& text : texts) {
    auto one = read_setting(text);
    if (!one) return one.error().to_string();
    settings.push_back(std::move(*one));
  }
  const auto out = with_settings(file, settings);
  return out ? out->text : out.error().to_string();
}

/// The value at a path of what the texts make of kText.
std::string value(const std::vector<std::string>& texts, const std::string& path) {
  const auto document = TomlDocument::parse(set(texts), "file.toml");
  if (!document) return document.error().to_string();
  const auto values = document->root().values();
  const auto it = values.find(path);
  return it == values.end() ? "none" : it->second;
}

TEST(TomlSetting, ReplacesTheValueAndNothingElse) {
  std::string wanted = kText;
  wanted.replace(wanted.find("-3.0"), 4, "-6");
  wanted.replace(wanted.find("2 # cycles"), 1, "7");
  EXPECT_EQ(set({"push[0].impulse_Ns[0]=-6", "hal.delay = 7 # not this"}), wanted);
}

TEST(TomlSetting, FindsEntriesByNameAndValuesBehindOtherLetters) {
  EXPECT_EQ(value({"push.\"äh, a bump\".impulse_Ns[2]=1e3"}, "push[0].impulse_Ns"),
            "[-3, 0, 1000]");
  EXPECT_EQ(value({"push.second.name=third"}, "push[1].name"), "\"third\"");
  EXPECT_EQ(value({"place.x=[1, 2]"}, "place.x"), "[1, 2]");
}

TEST(TomlSetting, AddsWhatATableLacks) {
  EXPECT_EQ(value({"seed=4"}, "seed"), "4");
  EXPECT_EQ(value({"hal.backend=can"}, "hal.backend"), "\"can\"");
  EXPECT_EQ(value({"place.y=2"}, "place.y"), "2");
  EXPECT_EQ(value({"place.y=2"}, "place.x"), "1");
  EXPECT_EQ(value({"push[0].for_s=0.5"}, "push[0].for_s"), "0.5");
  EXPECT_EQ(value({"push[0].deep.y=3"}, "push[0].deep.y"), "3");
  EXPECT_EQ(value({"push[1].more.deep=3"}, "push[1].more.deep"), "3");
  EXPECT_EQ(value({"sim.noise=false"}, "sim.noise"), "false");
  EXPECT_EQ(value({"sim.noise=false"}, "sim.link.torso.mass_kg"), "3.5");
  EXPECT_EQ(value({"log.viewers=false", "log.file_MB=2"}, "log.viewers"), "false");
  EXPECT_EQ(value({"log.viewers=false", "log.file_MB=2"}, "log.file_MB"), "2");
}

TEST(TomlSetting, SaysWhatAPathShouldHaveBeen) {
  EXPECT_EQ(set({"push[2].at_s=1"}),
            "--set push[2].at_s=1: push has 2 entries (they count from 0)");
  EXPECT_EQ(set({"push.secnd.at_s=1"}),
            "--set push.secnd.at_s=1: push has no entry 'secnd' (did you mean 'second'?)");
  EXPECT_EQ(set({"sim.lnk.torso.mass_kg=1"}),
            "--set sim.lnk.torso.mass_kg=1: there is no sim.lnk (did you mean 'link'?)");
  EXPECT_EQ(set({"hal=1"}),
            "--set hal=1: hal is table, not a value (set a key of it: known: delay)");
  EXPECT_EQ(set({"robot.x.y=1"}),
            "--set robot.x.y=1: robot is a value, and has no 'x' below it (set robot itself)");
  EXPECT_EQ(set({"a..b=1"}),
            "--set a..b=1: 'a..b' is no path of a key (write it as "
            "push[0].impulse_Ns[0], or sim.link.torso.mass_kg)");
  EXPECT_EQ(set({"push.a bump.at_s=1"}),
            "--set push.a bump.at_s=1: 'push.a bump.at_s' is no path of a key (put a name with "
            "blanks into quotes: push.\"a bump\".at_s)");
  EXPECT_EQ(set({"hal.delay=[1"}),
            "--set hal.delay=[1: is no value of TOML in one line (a number, "
            "true, false, \"text\" in quotes or a list in brackets)");
  EXPECT_EQ(set({"hal.delay=1\n[evil]"}).substr(0, 6), "--set ");
}

/// Reads kText with settings from a document; the errors of its keys.
Diagnostics read(const std::vector<std::string>& texts) {
  std::vector<TomlSetting> settings;
  for (const std::string& text : texts) settings.push_back(read_setting(text).value());
  const auto document = TomlDocument::parse(kText, "file.toml", "", settings);
  TomlTable hal = document->root().table("hal");
  (void)hal.integer("delay", 0, 10);
  hal.finish();
  for (TomlTable& push : document->root().tables("push")) (void)push.number_or("at_s", 0.0);
  for (TomlTable& push : document->root().tables("push")) push.error("name", "is bad");
  return document->diagnostics();
}

TEST(TomlSetting, IsNamedByErrorsAndMovesNoLine) {
  const Diagnostics wrong = read({"hal.delay=70", "hal.dely=2", "seed=4", "push[1].at_s=x"});
  ASSERT_EQ(wrong.size(), 5U);
  EXPECT_EQ(wrong[0].to_string(),
            "--set hal.delay=70: hal.delay: 70 is out of range (must be 0 to 10)");
  EXPECT_EQ(wrong[1].to_string(),
            "--set hal.dely=2: hal.dely: unknown key (did you mean 'delay'?)");
  EXPECT_EQ(wrong[2].file, "--set push[1].at_s=x");
  EXPECT_EQ(wrong[3].to_string(), "file.toml:12: push.äh, a bump.name: is bad");
  EXPECT_EQ(wrong[4].line, 18);
}

TEST(TomlSetting, GoesToAnotherFileBelowItsKey) {
  std::vector<TomlSetting> all = {read_setting("robot.gains.leg.kp=1").value(),
                                  read_setting("robot=\"other.toml\"").value()};
  const auto below = take_below("robot", all);
  ASSERT_EQ(below.size(), 1U);
  EXPECT_EQ(below[0].key, "gains.leg.kp");
  EXPECT_EQ(below[0].said, "--set robot.gains.leg.kp=1");
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].key, "robot");
}

}  // namespace
}  // namespace tandem
