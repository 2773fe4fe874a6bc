// The picture of `tandem top` by itself: widths, words for what is old, order, filter.
#include <gtest/gtest.h>

#include "apps/clients/top_picture.hpp"
#include "apps/clients/top_screen.hpp"
#include "apps/text/columns.hpp"

namespace tandem::apps {
namespace {

Json joint_named(const std::string& name, double position) {
  return {{"joint", name},
          {"slides", false},
          {"controller", "a_controller_with_a_long_name"},
          {"mode", "position"},
          {"mode_in_force", "position"},
          {"commanded_position_rad", 0.5},
          {"moving", false},
          {"position_rad", position},
          {"velocity_rad_s", -12.3456},
          {"torque_Nm", 123.456},
          {"min_position_rad", -1.0},
          {"max_position_rad", 1.0},
          {"current_A", 3.25},
          {"temperature_C", 48.6},
          {"fault", 0},
          {"age_cycles", 0},
          {"feedback", "fresh"}};
}

TopLook a_look() {
  TopLook look;
  look.loop = {
      {"robot", "big"},
      {"hal", "can"},
      {"period_ns", 1'000'000},
      {"overruns", 1},
      {"cycle_ns", {{"p50", 41'000}, {"p99", 88'000}, {"p999", 90'000}, {"max", 213'000}}},
      {"bus_ns", {{"p50", 300'000}, {"p99", 310'000}, {"p999", 320'000}, {"max", 330'000}}},
      {"buses",
       {{{"interface", "can0"}, {"status", ""}},
        {{"interface", "can1"}, {"status", "interface can1 is down: ip link"}}}}};
  look.clock = {{"clock", "real"}, {"phase", "running"}, {"time_s", 12.5},
                {"paused", false}, {"rate", 1.0},        {"realtime_factor", nullptr}};
  look.controllers = {
      {"controllers",
       {{{"name", "squat"},
         {"active", true},
         {"overruns", 2},
         {"claims", Json::array()},
         {"call_ns", {{"p50", 12'000}, {"p99", 30'000}, {"p999", 30'000}, {"max", 40'000}}}}}}};
  look.joints["joints"] = Json::array();
  for (int i = 0; i < 29; ++i)
    look.joints["joints"].push_back(joint_named("Joint_number_" + std::to_string(i), 0.01 * i));
  look.faults = {{"phase", "running"}, {"faults", Json::array()}};
  return look;
}

Json& joint_at(TopLook& look, std::size_t index) { return look.joints["joints"][index]; }

std::string text_of(const TopLook& look, const TopView& view) {
  std::string text;
  for (const TopLine& line : top_lines(look, view)) text += line.text + "\n";
  return text;
}

/// The line that has the words; empty: there is none.
TopLine line_with(const TopLook& look, const TopView& view, const std::string& words) {
  for (const TopLine& line : top_lines(look, view))
    if (line.text.find(words) != std::string::npos) return line;
  return {};
}

TEST(TopPicture, IsNeverWiderOrHigherThanItsScreen) {
  TopLook look = a_look();
  joint_at(look, 3)["joint"] = "Gelenk_mit_ä_und_ö_und_noch_viel_mehr_dahinter";
  joint_at(look, 4)["slides"] = true;
  joint_at(look, 5)["position_rad"] = -1234567.891;
  look.faults["faults"].push_back({{"latched", true}, {"cause", std::string(300, 'x')}});
  for (std::size_t width = 1; width < 220; ++width) {
    for (const std::size_t height : {1U, 2U, 9U, 24U, 60U}) {
      for (const bool help : {false, true}) {
        const auto lines = top_lines(look, {.width = width, .height = height, .help = help});
        EXPECT_LE(lines.size(), height);
        for (const TopLine& line : lines)
          ASSERT_LE(columns_of(line.text), width) << width << " x " << height << ": " << line.text;
      }
    }
  }
}

TEST(TopPicture, ShrinksColumnsAndLeavesTheLeastNeededOut) {
  const TopLook look = a_look();
  const std::string wide = text_of(look, {.width = 200});
  for (const char* words :
       {"position [rad]", "reference [rad]", "o is, | should be", "velocity [rad/s]", "torque [Nm]",
        "current [A]", "winding [C]", "Joint_number_28", "a_controller_with_a_long_name", "-12.35",
        "123.46", "3.25", "49"}) {
    EXPECT_NE(wide.find(words), std::string::npos) << words << "\n" << wide;
  }
  const std::string narrow = text_of(look, {.width = 80});
  for (const char* words : {"pos rad", "ref rad", "rad/s", "Nm", " A ", " C ", "sample", "fresh"}) {
    EXPECT_NE(narrow.find(words), std::string::npos) << words << "\n" << narrow;
  }
  const std::string least = text_of(look, {.width = 36});
  EXPECT_NE(least.find("fresh"), std::string::npos) << least;
  EXPECT_EQ(least.find("rad/s"), std::string::npos) << least;
}

TEST(TopPicture, SaysInWordsWhatIsOldOrLostAndDimsIt) {
  TopLook look = a_look();
  joint_at(look, 0)["age_cycles"] = 3;
  joint_at(look, 0)["feedback"] = "old";
  joint_at(look, 1)["age_cycles"] = 523;
  joint_at(look, 1)["feedback"] = "lost";
  joint_at(look, 2)["feedback"] = "sensor_fault";
  joint_at(look, 3)["position_rad"] = nullptr;
  joint_at(look, 4)["fault"] = 0x4310;
  struct Case {
    const char* joint;
    const char* wide;
    const char* narrow;
    TopStyle style;
  };
  for (const Case& one : {Case{"r_0 ", "3 cycles old", "3 old", TopStyle::kDim},
                          Case{"r_1 ", "LOST, 523 cycles old", "LOST", TopStyle::kDim},
                          Case{"r_2 ", "SENSOR FAULT", "SENSOR", TopStyle::kDim},
                          Case{"r_3 ", "never", "never", TopStyle::kDim},
                          Case{"r_4 ", "FAULT 0x4310", "FAULT", TopStyle::kAlarm}}) {
    const TopLine wide = line_with(look, {.width = 200}, one.joint);
    EXPECT_TRUE(wide.text.ends_with(one.wide)) << wide.text;
    EXPECT_EQ(wide.style, one.style) << wide.text;
    const TopLine narrow = line_with(look, {.width = 78}, one.joint);
    EXPECT_TRUE(narrow.text.ends_with(one.narrow)) << narrow.text;
  }
  const TopLine old = line_with(look, {.old_s = 2.34}, "NO ANSWER");
  EXPECT_EQ(old.text, "NO ANSWER for 2.3 s: what is shown is old");
  EXPECT_EQ(line_with(look, {.old_s = 2.34}, "er_9 ").style, TopStyle::kDim);
  EXPECT_EQ(line_with(look, {.old_s = 0.5}, "NO ANSWER").text, "");
  const TopView colours{.dims = true, .colours = true}, none{.dims = true};
  EXPECT_EQ(painted({"words", TopStyle::kAlarm}, colours), "\x1b[1;31mwords\x1b[0m");
  EXPECT_EQ(painted({"words", TopStyle::kAlarm}, none), "\x1b[1mwords\x1b[0m");
  EXPECT_EQ(painted({"words", TopStyle::kDim}, none), "\x1b[2mwords\x1b[0m");
  EXPECT_EQ(painted({"words", TopStyle::kAlarm}, {}), "words");
}

TEST(TopPicture, DrawsPositionAndReferenceBetweenTheLimits) {
  TopLook look = a_look();
  look.joints["joints"].erase(look.joints["joints"].begin() + 5, look.joints["joints"].end());
  const auto bar = [&](std::size_t index, const Json& position, const Json& reference) {
    joint_at(look, index)["position_rad"] = position;
    joint_at(look, index)["commanded_position_rad"] = reference;
    const std::string text =
        line_with(look, {.width = 300}, "er_" + std::to_string(index) + " ").text;
    return text.substr(text.find('['), text.find(']') - text.find('[') + 1);
  };
  EXPECT_EQ(bar(0, -1.0, 1.0), "[o--------------------|]");
  EXPECT_EQ(bar(1, 1.0, 1.0), "[---------------------#]");
  EXPECT_EQ(bar(2, -1.2, nullptr), "[<---------------------]");
  EXPECT_EQ(bar(3, 1.2, -7.0), "[|-------------------->]");
  joint_at(look, 4)["min_position_rad"] = joint_at(look, 4)["max_position_rad"] = nullptr;
  EXPECT_NE(line_with(look, {.width = 300}, "er_4 ").text.find("no limits"), std::string::npos);
}

TEST(TopPicture, HasNoSignBeforeWhatRoundsToZero) {
  TopLook look = a_look();
  for (Json& joint : look.joints["joints"]) {
    for (const char* key : {"position_rad", "commanded_position_rad"}) joint[key] = -0.0004;
    for (const char* key : {"velocity_rad_s", "torque_Nm", "current_A"}) joint[key] = -0.004;
    joint["temperature_C"] = -0.4;
  }
  const std::string text = text_of(look, {});
  EXPECT_NE(text.find(" 0.000"), std::string::npos) << text;
  EXPECT_EQ(text.find("-0"), std::string::npos) << text;
  joint_at(look, 0)["position_rad"] = -0.0006;
  EXPECT_NE(text_of(look, {}).find("-0.001"), std::string::npos);
}

TEST(TopPicture, ShowsUnitsOfSlidesAmongJointsThatTurn) {
  TopLook look = a_look();
  joint_at(look, 0)["slides"] = true;
  joint_at(look, 0)["position_rad"] = 0.25;
  const std::string line = line_with(look, {.width = 300}, "er_0 ").text;
  for (const char* words : {" 0.250m ", " -12.35m/s ", " 123.46N "})
    EXPECT_NE(line.find(words), std::string::npos) << words << "\n" << line;
  for (Json& joint : look.joints["joints"]) joint["slides"] = true;
  EXPECT_NE(text_of(look, {.width = 300}).find("position [m]"), std::string::npos);
}

TEST(TopPicture, SaysWhatTheDriveDoesWhereItWasAskedForOtherThings) {
  TopLook look = a_look();
  joint_at(look, 0)["mode_in_force"] = "idle";
  joint_at(look, 1)["controller"] = "";
  joint_at(look, 1)["moving"] = true;
  EXPECT_NE(line_with(look, {.width = 300}, "er_0 ").text.find("idle, asked position"),
            std::string::npos);
  EXPECT_NE(line_with(look, {.width = 80}, "r_0 ").text.find("idle/pos"), std::string::npos);
  EXPECT_NE(line_with(look, {.width = 300}, "er_1 ").text.find("by hand"), std::string::npos);
}

TEST(TopPicture, NamesBusesFaultsAndTheirWayOut) {
  TopLook look = a_look();
  std::string text = text_of(look, {});
  for (const char* words :
       {"big  running  12.500 s  real time\n", "cycle of 1000 us: 41 p50, 88 p99, 213 max us",
        "1 overrun\n", "bus: can0 well, can1 NOT WELL; answers after 300 p50",
        "BUS can1: interface can1 is down: ip link",
        "controller squat: active, 0 joints, a call 12 p50, 30 p99, 40 max us, 2 overruns"}) {
    EXPECT_NE(text.find(words), std::string::npos) << words << "\n" << text;
  }
  EXPECT_EQ(text.find("way out"), std::string::npos);
  for (int i = 0; i < 5; ++i) {
    look.faults["faults"].push_back({{"time_s", 1.5 + i},
                                     {"joint", "Joint_number_1"},
                                     {"cause", "\x1b[31mhot"},
                                     {"reaction", "stop, torque off"},
                                     {"latched", i != 4}});
  }
  struct Way {
    const char* phase;
    const char* words;
  };
  for (const Way& one : {Way{"faulted", "way out: remove the cause, then tandem fault reset\n"},
                         Way{"running", "tandem joint reset JOINT"},
                         Way{"resetting", "way out: a reset is under way"},
                         Way{"retreating", "on its way to a safe posture"},
                         Way{"shut-down", "way out: the run ends"}}) {
    look.faults["phase"] = one.phase;
    text = text_of(look, {});
    EXPECT_NE(text.find(one.words), std::string::npos) << text;
  }
  EXPECT_NE(text.find("FAULT at 1.500 s: Joint_number_1: \\u001b[31mhot (stop, torque off)"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("FAULT: 1 more are latched: tandem fault show"), std::string::npos) << text;
  EXPECT_EQ(text.find('\x1b'), std::string::npos) << "a name of others writes on the terminal";
}

TEST(TopPicture, SortsFiltersAndScrolls) {
  TopLook look = a_look();
  joint_at(look, 7)["torque_Nm"] = -900.0;
  joint_at(look, 8)["torque_Nm"] = nullptr;
  TopView view{.width = 80, .height = 20};
  const auto first = [&] { return top_joints(look, view).front()["joint"].get<std::string>(); };
  for (const char* sorted : {"name", "error", "velocity", "torque"}) {
    EXPECT_TRUE(view.press("s"));
    EXPECT_STREQ(to_string(view.sort), sorted);
  }
  EXPECT_EQ(first(), "Joint_number_7");
  EXPECT_EQ(top_joints(look, view).back()["joint"], "Joint_number_8");
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(view.press("s"));
  EXPECT_EQ(view.sort, TopSort::kRobot);
  for (const std::string& key : keys_of("/NUMBER_1q\x7f\r")) EXPECT_TRUE(view.press(key));
  EXPECT_EQ(view.filter, "NUMBER_1");
  EXPECT_EQ(top_joints(look, view).size(), 11U);
  EXPECT_TRUE(view.press("\x1b"));
  EXPECT_NE(text_of(look, view).find("29 joints, 1-"), std::string::npos) << text_of(look, view);
  for (const std::string& key : keys_of("\x1b[B\x1b[B\x1bOA\x1b[6~")) EXPECT_TRUE(view.press(key));
  EXPECT_EQ(view.first, 11U);
  EXPECT_EQ(line_with(look, view, "r_0 ").text, "");
  for (int i = 0; i < 9; ++i) EXPECT_TRUE(view.press("\x1b[6~"));
  EXPECT_NE(text_of(look, view).find("…_28 "), std::string::npos) << "scrolled past the last";
  for (const std::string& key : keys_of("/nobody\n")) EXPECT_TRUE(view.press(key));
  EXPECT_NE(text_of(look, view).find("no joint's name has 'nobody'"), std::string::npos);
  EXPECT_FALSE(view.press("q"));
}

}  // namespace
}  // namespace tandem::apps
