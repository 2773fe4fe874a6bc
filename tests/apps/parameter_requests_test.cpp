// Parameters of controllers of a running `tandem run`.
#include <cmath>

#include "tests/apps/controllers_run.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::apps {
namespace {

TEST_F(Controllers, ParametersAreShownAndSetByAnotherProcess) {
  begin("");
  EXPECT_EQ(asked("controller load hold --name rest --set 'link_damping_Nms_rad = 0.5' --set "
                  "'joints = [\"joint2\"]'")["done"],
            true);
  const auto shown = asked("controller show rest")["controllers"];
  ASSERT_EQ(shown.size(), 1U);
  EXPECT_EQ(shown[0]["claims"][0]["joint"], "joint2");
  nlohmann::json damping;
  for (const auto& one : shown[0]["parameters"])
    if (one["name"] == "link_damping_Nms_rad") damping = one;
  EXPECT_EQ(damping["value"], 0.5);
  EXPECT_EQ(damping["default"], 0.0);
  EXPECT_EQ(damping["min"], 0.0);
  EXPECT_EQ(damping["max"], nullptr);
  EXPECT_EQ(damping["unit"], "Nms/rad");
  EXPECT_EQ(damping["live"], true);
  expect(to_run("controller show rest").out, "duration_s");

  const auto set = asked("controller set rest link_damping_Nms_rad=1.25");
  EXPECT_EQ(set["done"], true);
  EXPECT_GT(set["cycle"].get<int>(), 0);
  EXPECT_EQ(set["values"]["rest.link_damping_Nms_rad"], 1.25);
  expect(to_run("controller set rest 'link_damping_Nms_rad = 1.5'").out,
         "rest.link_damping_Nms_rad  1.5");
  expect(refused("controller set rest link_damping_Nms_rad=-1"),
         "rest.link_damping_Nms_rad: -1 is out of range (give 0 Nms/rad or more)");
  expect(refused("controller set rest link_damping_Nms_rad=inf"), "is a number, not 'inf'");
  expect(refused("controller set rest link_damping=2"), "did you mean 'link_damping_Nms_rad'?");
  expect(refused("controller set rest duration_s=2"), "rest.duration_s: is not live");
  expect(refused("controller set rset duration_s=2"), "did you mean 'rest'?");
  expect(refused("controller show rset"), "did you mean 'rest'?");
  expect(refused("controller set rest link_damping_Nms_rad=2 duration_s=2"), "is not live");
  expect(refused("controller set rest link_damping_Nms_rad"), "is not NAME=VALUE");
  expect(refused("controller set rest link_damping_Nms_rad=1 link_damping_Nms_rad=2"),
         "is named twice");
  const auto each = nlohmann::json::parse(
      to_run("ask '{\"do\": \"controller.set\", \"each\": true, \"parameters\": "
             "{\"rest.link_damping_Nms_rad\": 3, \"hold.nothing\": 1, \"nobody\": 1}}'")
          .out,
      nullptr, false)["results"];
  EXPECT_EQ(each["rest.link_damping_Nms_rad"], "");
  EXPECT_NE(each["hold.nothing"].dump().find("has no such parameter"), std::string::npos);
  EXPECT_NE(each["nobody"].dump().find("names no controller"), std::string::npos);
  const auto after = asked("controller show rest");
  for (const auto& one : after["controllers"][0]["parameters"]) {
    if (one["name"] == "link_damping_Nms_rad") damping = one;
  }
  EXPECT_EQ(damping["value"], 3.0);
  EXPECT_EQ(end(), 0);
}

TEST_F(Controllers, HaveListsOfParametersByJoint) {
  begin("");
  EXPECT_EQ(asked("controller load gravity_compensation --name weigh --set "
                  "'damping_Nms_rad = [0.2, 0.15]'")["done"],
            true);
  nlohmann::json damping;
  const auto answer = asked("controller show weigh");
  for (const auto& one : answer["controllers"][0]["parameters"])
    if (one["name"] == "damping_Nms_rad") damping = one;
  EXPECT_EQ(damping["type"], "numbers");
  EXPECT_EQ(damping["elements"], nlohmann::json({"joint1", "joint2"}));
  EXPECT_EQ(damping["value"], nlohmann::json({0.2, 0.15}));
  EXPECT_EQ(damping["default"], nlohmann::json({0.1, 0.1}));
  EXPECT_EQ(damping["min"], nlohmann::json({0.0, 0.0}));
  const std::string shown = to_run("controller show weigh").out;
  expect(shown, "damping_Nms_rad.joint2  0.15");
  expect(shown, "stiffness_Nm_rad        1.2");
  expect(shown, "elements)");

  EXPECT_EQ(asked("controller set weigh damping_Nms_rad=0.05")["values"]["weigh.damping_Nms_rad"],
            nlohmann::json({0.05, 0.05}));
  EXPECT_EQ(asked("controller set weigh damping_Nms_rad.joint2=0.125")["values"],
            nlohmann::json({{"weigh.damping_Nms_rad.joint2", 0.125}}));
  expect(to_run("controller set weigh 'damping_Nms_rad=[0.125, 0]'").out,
         "weigh.damping_Nms_rad  0.125, 0");
  expect(
      refused("controller set weigh 'damping_Nms_rad=[0.1, 0, 0]'"),
      "weigh.damping_Nms_rad: has 2 elements, not 3 (give one number for all, or one for each of "
      "joint1, joint2)");
  expect(refused("controller set weigh 'damping_Nms_rad=[0.1, -1]'"),
         "weigh.damping_Nms_rad.joint2: -1 is out of range");
  expect(refused("controller set weigh 'damping_Nms_rad=[0.1, true]'"),
         "other things than numbers");
  expect(refused("controller set weigh 'damping_Nms_rad=[0.1, 0'"), "is a number, not '[0.1, 0'");
  expect(refused("controller set weigh damping_Nms_rad.joint3=0"), "has no such parameter");
  expect(refused("controller set weigh damping_Nms_rad=0 damping_Nms_rad.joint1=0.1"),
         "weigh.damping_Nms_rad.joint1: is named twice");
  expect(refused("controller load gravity_compensation --name x --set 'damping_Nms_rad = [1]'"),
         "damping_Nms_rad: has 1 numbers");
  expect(to_run("ask '{\"do\": \"controller.set\", \"parameters\": "
                "{\"weigh.damping_Nms_rad.joint1\": 0.0625}}'")
             .out,
         "0.0625");
  EXPECT_EQ(end(), 0);
}

TEST_F(Controllers, HaveTheirParametersInTheLogAndInItsReport) {
  log_flags_ = "--log runs";
  begin("");
  ASSERT_EQ(to_run("controller load gravity_compensation --name weigh --set ramp_s=2").status, 0);
  ASSERT_EQ(to_run("controller load hold --name soft --set 'interaction = \"compliant\"'").status,
            0);
  ASSERT_EQ(asked("controller set hold link_damping_Nms_rad=0.5")["done"], true);
  ASSERT_EQ(asked("controller set hold link_damping_Nms_rad=0.25")["done"], true);
  EXPECT_EQ(end(), 0);
  const std::string log = "runs/double_pendulum-hold-001.mcap";
  const std::string info = tandem("log info " + log).out;
  expect(info, "hold.link_damping_Nms_rad = 0\n");
  expect(info, "hold.interaction = stiff\n");
  const std::string events = tandem("log csv " + log + " --topic event").out;
  expect(events, "parameter loaded: weigh.ramp_s = 2\"");
  expect(events, "parameter loaded: weigh.damping_Nms_rad.joint2 = 0.1\"");
  expect(events, "parameter loaded: soft.interaction = compliant\"");
  expect(events, "parameter set: hold.link_damping_Nms_rad = 0.25\"");
  ASSERT_EQ(tandem("report " + log + " -o page").status, 0);
  const std::string page = read_text(folder_ / "page/report.html");
  expect(page, "Parameters");
  const std::size_t row = page.find("hold.link_damping_Nms_rad");
  ASSERT_NE(row, std::string::npos);
  expect(page.substr(row, 200), "0.25 at ");
  expect(page.substr(row, 200), ">2<");
  expect(page, "weigh.ramp_s");
}

TEST_F(Controllers, ManyParametersInOneRequestAreRefusedAndTheRunGoesOn) {
  begin("");
  for (const auto& [count, why] : {std::pair{10'000, "an object of more than 1000 keys"},
                                   {1'000, "sets 1000 parameters at once (set at most 64)"}}) {
    nlohmann::json question{{"do", "controller.set"}, {"name", "hold"}};
    for (int i = 0; i < count; ++i) question["parameters"][std::to_string(i)] = 1;
    for (const bool each : {false, true}) {
      question["each"] = each;
      write_text(folder_ / "many.json", question.dump());
      const Outcome said = to_run("ask \"$(cat many.json)\"");  // not more than 128 kB
      EXPECT_NE(said.status, 0);
      expect(said.out + said.err, why);
    }
  }
  EXPECT_EQ(asked("controller set hold link_damping_Nms_rad=1")["done"], true);
  EXPECT_EQ(end(), 0);
}

}  // namespace
}  // namespace tandem::apps
