// tandem excite and tandem identify from the command line: a robot whose description is wrong is
// simulated, found, and simulated again. TANDEM_IDENTIFY_ALL=1: a humanoid, too, and an arm 100
// times.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>

#include "apps/tools/identified_files.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class Identify : public Program {
 protected:
  /// Excites and runs `robot`, whose files are in the test's folder.
  void record(const std::string& robot, const std::string& more = {}) const {
    const Outcome excited =
        tandem("excite " + robot + " --out excite.toml --json excite.json " + more);
    ASSERT_EQ(excited.status, 0) << excited.err;
    const Outcome run = tandem("run excite.toml --quiet --log logs");
    ASSERT_EQ(run.status, 0) << run.err;
  }
  [[nodiscard]] std::string log(const std::string& folder = "logs") const {
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / folder))
      if (entry.path().extension() == ".mcap")
        return folder + "/" + entry.path().filename().string();
    return {};
  }
};

TEST_F(Identify, FindsWhatTheDescriptionGotWrongAndWritesARobotThatRuns) {
  edit("robot.toml", "damping_Nms_rad = 0.17", "damping_Nms_rad = 0.17\nfriction_Nm = 0.04");
  record("robot.toml");
  edit("robot.toml", "friction_Nm = 0.04\n", "");
  EXPECT_LT(json("excite.json")["condition_number"].get<double>(), 200.0);
  // The description to start from has another mass, and a centre of mass that is elsewhere.
  std::filesystem::copy_file(folder_ / "robot.toml", folder_ / "wrong.toml");
  std::filesystem::copy_file(folder_ / "double_pendulum.urdf", folder_ / "wrong.urdf");
  edit("wrong.toml", "urdf = \"double_pendulum.urdf\"", "urdf = \"wrong.urdf\"");
  edit("wrong.urdf", "value=\"0.33238\"", "value=\"0.43238\"");
  edit("wrong.urdf", "xyz=\"-0.0050107 1.9371e-10 0.10088\"",
       "xyz=\"-0.0050107 1.9371e-10 0.12088\"");
  const Outcome found =
      tandem("identify " + log() + " --robot wrong.toml --out found --json found.json");
  ASSERT_EQ(found.status, 0) << found.err;
  const nlohmann::json result = json("found.json");
  EXPECT_EQ(result["links"].size(), 3U);
  EXPECT_EQ(result["joints"].size(), 2U);
  for (const auto& [name, joint] : result["joints"].items()) {
    EXPECT_LT(joint["relative_error"].get<double>(), 0.05) << name;
    EXPECT_NEAR(joint["viscous_Nms_rad"].get<double>(), 0.17 - 0.16, 0.01) << name;
    EXPECT_NEAR(joint["coulomb_Nm"].get<double>(), 0.04, 0.004) << name;
  }
  // JSON alone said that an arm's torques do not show its total mass.
  EXPECT_FALSE(result["total_mass_kg"]["identifiable"].get<bool>());
  for (const std::string& text : {found.out, read_text(folder_ / "found/report.html")})
    EXPECT_NE(text.find(" kg, not known: these data do not show it"), std::string::npos) << text;
  // The moment about joint2 is what the torques show, whatever link it is put down to.
  const auto& link = result["links"]["link2"];
  const double moment =
      link["mass_kg"]["value"].get<double>() * link["com_m"]["value"][2].get<double>();
  EXPECT_NEAR(moment, 0.33238 * 0.10088, 0.02 * 0.0335);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "found/report.html"));
  // robot.toml has the drives' friction with the back-EMF's, and their rotors.
  const std::string robot = read_text(folder_ / "found/robot.toml");
  const auto number = [&](const std::string& key) {
    const std::size_t at = robot.find("\n" + key + " = ");
    return at == std::string::npos ? 0.0 : std::stod(robot.substr(at + key.size() + 4));
  };
  EXPECT_NEAR(number("damping_Nms_rad"), 0.17, 0.01);
  EXPECT_NEAR(number("friction_Nm"), 0.04, 0.004);
  EXPECT_NEAR(number("inertia_kg_m2"), 0.002, 1e-5);
  // Measured, simulated as described, simulated with what was found: three curves of one run.
  const Outcome again = tandem("run found/excite.toml --quiet --duration 8 --log again");
  ASSERT_EQ(again.status, 0) << again.err;
  edit("excite.toml", "robot = \"robot.toml\"", "robot = \"wrong.toml\"");
  ASSERT_EQ(tandem("run excite.toml --quiet --duration 8 --log described").status, 0);
  const Outcome report =
      tandem("report " + log() + " " + log("described") + " " + log("again") + " -o three");
  ASSERT_EQ(report.status, 0) << report.err;
  for (const char* folder : {"logs", "described", "again"}) {
    const std::string name = std::filesystem::path(log(folder)).stem().string();
    EXPECT_NE(read_text(folder_ / "three/report.html").find(name), std::string::npos) << name;
  }
  EXPECT_NE(read_text(folder_ / "found/robot.toml").find("name = \"double_pendulum_identified\""),
            std::string::npos);
}

/// How often the intervals of `result` held the arm that made its log, per base parameter: the
/// description is exact, and friction on the link's side is none.
void count_held(const nlohmann::json& result, std::map<std::string, int>& held) {
  for (const auto& one : result["base_parameters"]) {
    const double off = one["value"].get<double>() - one["described"].get<double>();
    held[one["name"]] += std::abs(off) <= one["ci95"].get<double>() ? 1 : 0;
  }
}

// Whose sampled torques are not the mean of their cycle: rotors came out 0.6 % too large, which six
// intervals did not hold.
TEST_F(Identify, HoldsTheTruthOfASimulatedArm) {
  for (const char* file : {"robot.toml", "panda.urdf"}) {
    std::filesystem::copy_file(std::filesystem::path(TANDEM_SOURCE_DIR "/config/panda") / file,
                               folder_ / file, std::filesystem::copy_options::overwrite_existing);
  }
  record("robot.toml");
  std::map<std::string, int> held;
  ASSERT_EQ(tandem("identify " + log() + " --robot robot.toml --out found --json a.json").status,
            0);
  const nlohmann::json exact = json("a.json");
  count_held(exact, held);
  EXPECT_EQ(held.size(), 69U);
  for (const auto& [name, times] : held) EXPECT_EQ(times, 1) << name;
  for (const auto& [joint, rotor] : {std::pair{"panda_joint4", 0.5}, {"panda_joint7", 0.1}}) {
    EXPECT_NEAR(exact["joints"][joint]["rotor_inertia_kg_m2"].get<double>(), rotor, 1e-3 * rotor);
    EXPECT_EQ(exact["joints"][joint]["rotor_from"], "data");
  }
  if (std::getenv("TANDEM_IDENTIFY_ALL") == nullptr) return;
  edit("robot.toml", "rated_torque_Nm = 87.0", "rated_torque_Nm = 87.0\ntorque_noise_Nm = 0.1");
  edit("robot.toml", "rated_torque_Nm = 12.0", "rated_torque_Nm = 12.0\ntorque_noise_Nm = 0.1");
  held.clear();
  constexpr int kSeeds = 100;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    std::filesystem::remove_all(folder_ / "noisy");
    const std::string of = std::to_string(seed);
    ASSERT_EQ(tandem("run excite.toml --quiet --log noisy --seed " + of).status, 0);
    ASSERT_EQ(
        tandem("identify " + log("noisy") + " --robot robot.toml --out found --json a.json").status,
        0);
    count_held(json("a.json"), held);
  }
  int all = 0;
  for (const auto& [name, times] : held) {
    EXPECT_GE(times, 90) << name;
    all += times;
  }
  std::printf("simulated arm, 100 seeds: inside %.1f %%\n",
              1.0 * all / static_cast<double>(held.size()));
}

const std::string kMap = csv_map(R"(exclude = ["invalid"])", R"([torque]
columns = "torque_nm.joint{1}"
unit = "Nm"
)");

TEST_F(Identify, GivesForATableOfTheLogWhatTheLogGives) {
  record("robot.toml");
  write_text(folder_ / "map.toml", kMap);
  ASSERT_EQ(tandem("log csv " + log() + " --fields position_rad,torque_nm -o run.csv").status, 0);
  const Outcome imported =
      tandem("log import run.csv --robot robot.toml --map map.toml -o imported.mcap");
  ASSERT_EQ(imported.status, 0) << imported.err;
  for (const std::string& from : {log(), std::string("imported.mcap")}) {
    const Outcome found = tandem("identify " + from + " --robot robot.toml --out found --json " +
                                 (from == "imported.mcap" ? "b.json" : "a.json"));
    ASSERT_EQ(found.status, 0) << found.err;
  }
  const auto a = json("a.json")["base_parameters"], b = json("b.json")["base_parameters"];
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const std::string name = a[i]["name"];
    // How long a voltage was held is known of a run of ours only, and it looks like rotor inertia:
    // the interval of an import allows for it.
    if (name.find("rotor") != std::string::npos) {
      EXPECT_GT(b[i]["ci95"], 3e-5) << name;
    }
    if (!a[i]["identifiable"].get<bool>()) continue;
    EXPECT_NEAR(a[i]["value"].get<double>(), b[i]["value"].get<double>(),
                a[i]["ci95"].get<double>() + b[i]["ci95"].get<double>())
        << name;
  }
}

// The intervals of one log that was given twice were 0.7 of its own.
TEST_F(Identify, OfOneLogTwiceIsOneError) {
  ASSERT_EQ(tandem("run trajectory.toml --quiet --duration 8 --log logs").status, 0);
  const Outcome twice =
      tandem("identify " + log() + " " + log() + " --robot robot.toml --out found");
  EXPECT_EQ(twice.status, 2);
  EXPECT_NE(twice.err.find("has the same data as"), std::string::npos) << twice.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "found"));
}

// A robot of 13 kg instead of 17 was written, without a word of the signs.
TEST_F(Identify, OfTorquesOfTheOtherSignSaysSo) {
  record("robot.toml");
  std::string map = kMap;
  ASSERT_EQ(tandem("log csv " + log() + " --fields position_rad,torque_nm -o run.csv").status, 0);
  const std::size_t torque = map.find("[torque]");
  map.insert(map.find('\n', torque) + 1, "scale = [-1]\n");
  write_text(folder_ / "map.toml", map);
  const Outcome imported =
      tandem("log import run.csv --robot robot.toml --map map.toml -o in.mcap");
  ASSERT_EQ(imported.status, 0) << imported.err;
  const Outcome found = tandem("identify in.mcap --robot robot.toml --out found");
  ASSERT_EQ(found.status, 0) << found.err;
  EXPECT_NE(found.err.find("of 2 of 2 joints the torques are about the opposite"),
            std::string::npos)
      << found.err;
}

// It was written between quotes as it is: no TOML.
TEST_F(Identify, ExcitesJointsWithQuotesInTheirNames) {
  edit("double_pendulum.urdf", "joint name=\"joint1\"", "joint name=\"joint&quot;1\"");
  for (const char* key : {"joints = [", "names = ["})
    edit("robot.toml", key + std::string("\"joint1\""), key + std::string("'joint\"1'"));
  edit("robot.toml", "joint1 = 0.5", "'joint\"1' = 0.5");
  const Outcome excited = tandem("excite robot.toml --out e.toml --tries 2");
  ASSERT_EQ(excited.status, 0) << excited.err;
  const Outcome check = tandem("check e.toml");
  EXPECT_EQ(check.status, 0) << check.err;
}

TEST_F(Identify, DestroysNoFileThatItDidNotWrite) {
  const std::string robot = read_text(folder_ / "robot.toml");
  const std::string urdf = read_text(folder_ / "double_pendulum.urdf");
  const std::string trajectory = read_text(folder_ / "trajectory.toml");
  for (const std::string file : {"robot.toml", "trajectory.toml"}) {
    const Outcome excited = tandem("excite robot.toml --out " + file);
    EXPECT_EQ(excited.status, 2) << file;
    EXPECT_NE(excited.err.find("it is no experiment of `tandem excite`: it would be lost"),
              std::string::npos)
        << excited.err;
  }
  record("robot.toml");
  record("robot.toml");  // its own experiment is written again
  std::filesystem::create_directories(folder_ / "mine");
  write_text(folder_ / "mine/report.html", "<title>mine</title>");
  for (const std::string folder : {".", "mine"}) {
    const Outcome found = tandem("identify " + log() + " --robot robot.toml --out " + folder);
    EXPECT_EQ(found.status, 2) << folder;
    EXPECT_NE(found.err.find("it would be lost"), std::string::npos) << found.err;
  }
  EXPECT_EQ(read_text(folder_ / "robot.toml"), robot);
  EXPECT_EQ(read_text(folder_ / "double_pendulum.urdf"), urdf);
  EXPECT_EQ(read_text(folder_ / "trajectory.toml"), trajectory);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "mine/robot.toml"));
  for (const char* again : {"once", "twice"}) {
    const Outcome found = tandem("identify " + log() + " --robot robot.toml --out found");
    EXPECT_EQ(found.status, 0) << again << found.err;
  }
  // A folder of its own is no place for what is found from it, either.
  const Outcome onto = tandem("identify " + log() + " --robot found/robot.toml --out found");
  EXPECT_EQ(onto.status, 2);
  EXPECT_NE(onto.err.find("describes the robot that is identified"), std::string::npos) << onto.err;
}

TEST_F(Identify, TellsProgramsWhatItTellsPeople) {
  record("robot.toml");
  write_text(folder_ / "map.toml", kMap);
  ASSERT_EQ(tandem("log csv " + log() + " --fields position_rad,torque_nm -o run.csv").status, 0);
  std::istringstream rows(read_text(folder_ / "run.csv"));
  std::string line, edited;
  std::getline(rows, line);
  edited = line + "\n";
  while (std::getline(rows, line)) {  // joint2 never says more than a tenth of what it may need
    std::size_t comma = line.rfind(',');
    const double torque = std::min(0.1, std::strtod(line.c_str() + comma + 1, nullptr));
    edited += line.substr(0, comma + 1) + std::to_string(torque) + "\n";
  }
  write_text(folder_ / "run.csv", edited);
  const Outcome imported =
      tandem("log import run.csv --robot robot.toml --map map.toml -o bad.mcap");
  ASSERT_EQ(imported.status, 0) << imported.err;
  const Outcome found =
      tandem("identify bad.mcap --robot robot.toml --out found --json found.json");
  ASSERT_EQ(found.status, 0) << found.err;
  const nlohmann::json result = json("found.json");
  ASSERT_GE(result["left_out"].size(), 1U) << found.err;
  EXPECT_EQ(result["left_out"][0]["log"], "bad.mcap");
  EXPECT_EQ(result["left_out"][0]["what"], "joint 'joint2': its torque is cut off at a limit");
  EXPECT_GT(result["left_out"][0]["sum_s"].get<double>(), 0.1);
  EXPECT_GT(result["left_out"][0]["first_end_s"].get<double>(),
            result["left_out"][0]["first_begin_s"].get<double>());
  for (const char* kind : {"notes", "warnings"}) {
    const std::string word = kind == std::string("notes") ? "note: " : "warning: ";
    for (const std::string text : result[kind])
      EXPECT_NE(found.err.find(word + text), std::string::npos) << text << found.err;
  }
  EXPECT_GE(result["notes"].size(), 1U);
  EXPECT_GT(result["total_mass_kg"]["described"].get<double>(), 0.3);
  EXPECT_GT(result["total_mass_kg"]["ci95"].get<double>(), 0.0);
  for (const auto& [name, joint] : result["joints"].items()) {
    for (const auto& [key, interval] : joint["ci95"].items())
      EXPECT_EQ(interval.is_null(), joint[key].is_null()) << name << "." << key;
  }
  EXPECT_GT(result["joints"]["joint1"]["ci95"]["coulomb_Nm"].get<double>(), 0.0);
}

// The description lacks 1 kg of the torso, and has its centre of mass elsewhere; the robot's
// sensors are noisy.
TEST_F(Identify, FindsTheTorsoOfAHumanoidThatStands) {
  if (std::getenv("TANDEM_IDENTIFY_ALL") == nullptr)
    GTEST_SKIP() << "in make test-all: TANDEM_IDENTIFY_ALL=1, takes a minute";
  for (const char* file : {"robot.toml", "coman.urdf"}) {
    std::filesystem::copy_file(std::filesystem::path(TANDEM_SOURCE_DIR "/config/coman") / file,
                               folder_ / file, std::filesystem::copy_options::overwrite_existing);
  }
  edit("robot.toml", "following_error_rad = 0.35",
       "following_error_rad = 0.35\ntorque_noise_Nm = 0.05");
  edit("robot.toml", "rated_torque_Nm = 10.0", "rated_torque_Nm = 10.0\ntorque_noise_Nm = 0.005");
  for (const char* joint : {"LAnkSag", "RAnkSag"}) {
    edit("robot.toml", std::string("joint = \"") + joint + "\"",
         std::string("noise = [0.5, 0.5, 0.5, 0.02, 0.02, 0.02]\njoint = \"") + joint + "\"");
  }
  edit("robot.toml", "type = \"imu\"",
       "type = \"imu\"\nnoise = [0, 0, 0, 0, 0.005, 0.005, 0.005, 0.05, 0.05, 0.05]");
  record("robot.toml", "--hung");
  record("robot.toml", "--period 12 --share 0.5");
  edit("coman.urdf", "6.3617175", "5.3617175");
  edit("coman.urdf", "-0.0358501 1.8286043e-05 0.117557148", "-0.0158501 0.010018286 0.097557148");
  edit("coman.urdf", "ixx=\"0.0038979546\"", "ixx=\"0.0058469319\"");  // RThighLowLeg's inertia,
  edit("coman.urdf", "iyy=\"0.0039360845\"", "iyy=\"0.0059041268\"");  // 1.5 times too large
  const Outcome found = tandem(
      "identify logs/coman-excite-001.mcap logs/coman-excite-002.mcap --robot robot.toml "
      "--out found --json found.json");
  ASSERT_EQ(found.status, 0) << found.err;
  EXPECT_NE(found.err.find("the total mass moves"), std::string::npos) << found.err;
  const auto torso = json("found.json")["links"]["DWYTorso"];
  EXPECT_NEAR(torso["mass_kg"]["value"].get<double>(), 6.3617175, 0.01 * 6.3617175);
  const double com_m[] = {-0.0358501, 1.8286043e-05, 0.117557148};
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(torso["com_m"]["value"][k].get<double>(), com_m[k], 0.002) << k;
  EXPECT_TRUE(torso["mass_kg"]["identifiable"].get<bool>());
  EXPECT_TRUE(torso["com_m"]["identifiable"].get<bool>());
  // A thigh's inertia shows only together with that of its neighbours: of the link by itself it is
  // inside its interval, and the combinations are known, unlike the description's.
  const auto thigh = json("found.json")["links"]["RThighLowLeg"]["inertia_kg_m2"];
  const double truth[] = {0.0038979546, 1.7802399e-06, 2.6403262e-05,
                          0.0039360845, 4.522711e-05,  0.00090218711};
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_NEAR(thigh["value"][k].get<double>(), truth[k], thigh["ci95"][k].get<double>()) << k;
  }
  EXPECT_EQ(thigh["seen"], "in sums");
  const auto sums = json("found.json")["links"]["RThighLowLeg"]["base_parameters"];
  EXPECT_NE(std::ranges::find(sums, "RHipMot.iyy_kg_m2"), sums.end());
  std::size_t seen = 0;
  const auto base = json("found.json")["base_parameters"];
  for (const auto& one : base) {
    const auto& terms = one["terms"];
    const double excess = 0.0019489773 * terms.value("RThighLowLeg.ixx_kg_m2", 0.0) +
                          0.0019680423 * terms.value("RThighLowLeg.iyy_kg_m2", 0.0);
    if (terms.contains("DWYTorso.mass_kg") || one["ci95"].get<double>() > std::abs(excess))
      continue;
    ++seen;
    EXPECT_TRUE(one["identifiable"].get<bool>()) << one;
    EXPECT_NEAR(one["value"].get<double>(), one["described"].get<double>() - excess,
                one["ci95"].get<double>())
        << one;
  }
  EXPECT_GE(seen, 1U);
  // A drive behind a spring: its rotor, and its friction with the back-EMF's.
  const std::string robot = read_text(folder_ / "found/robot.toml");
  const std::size_t at = robot.find("\ninertia_kg_m2 = ", robot.find("[actuator.soft_leg]"));
  ASSERT_NE(at, std::string::npos);
  EXPECT_NEAR(std::stod(robot.substr(at + 17)), 0.1387, 0.02 * 0.1387);
  // What was found runs the same experiment, and lies beside the others in one report.
  ASSERT_EQ(tandem("run found/excite.toml --quiet --duration 3 --log again").status, 0);
  ASSERT_EQ(tandem("run excite.toml --quiet --duration 3 --log described").status, 0);
  const Outcome report = tandem("report logs/coman-excite-002.mcap " + log("described") + " " +
                                log("again") + " -o three");
  ASSERT_EQ(report.status, 0) << report.err;
}

// What stands or hangs on soft springs sways: whatever the seed, what is written runs through.
TEST_F(Identify, WritesHumanoidsExperimentsThatRunThrough) {
  if (std::getenv("TANDEM_IDENTIFY_ALL") == nullptr)
    GTEST_SKIP() << "in make test-all: TANDEM_IDENTIFY_ALL=1, takes minutes";
  const std::string coman = shell_word(TANDEM_SOURCE_DIR "/config/coman/robot.toml");
  for (int seed = 1; seed <= 10; ++seed) {
    for (const char* how : {"", "--hung"}) {
      if (*how != 0 && seed > 3) continue;
      const Outcome excited =
          tandem("excite " + coman + " --out e.toml " + how + " --seed " + std::to_string(seed));
      ASSERT_EQ(excited.status, 0) << seed << how << excited.err;
      const Outcome run = tandem("run e.toml --quiet --no-log");
      EXPECT_EQ(run.status, 0) << seed << how << run.err;
    }
  }
}

// A run's own log is a bag of ROS 2, too: of sensor_msgs/JointState, 50 times a second. In the
// description to start from, link2 is a third too heavy.
TEST_F(Identify, TakesAnImportedBag) {
  record("robot.toml");
  write_text(folder_ / "bag.toml", "[time]\nperiod_s = 0.02\n[bag]\nstamp = \"header\"\n");
  const Outcome imported = tandem("log import " + log() +
                                  " --robot robot.toml --map bag.toml -o in.mcap --json in.json");
  ASSERT_EQ(imported.status, 0) << imported.err;
  EXPECT_EQ(json("in.json")["format"], "mcap");
  EXPECT_EQ(json("in.json")["series"][0]["median_ns"], 20'000'000);
  std::filesystem::copy_file(folder_ / "robot.toml", folder_ / "wrong.toml");
  std::filesystem::copy_file(folder_ / "double_pendulum.urdf", folder_ / "wrong.urdf");
  edit("wrong.toml", "urdf = \"double_pendulum.urdf\"", "urdf = \"wrong.urdf\"");
  edit("wrong.urdf", "value=\"0.33238\"", "value=\"0.43238\"");
  const Outcome found = tandem("identify in.mcap --robot wrong.toml --out found --json found.json");
  ASSERT_EQ(found.status, 0) << found.err;
  const nlohmann::json result = json("found.json");
  for (const auto& [name, joint] : result["joints"].items()) {
    EXPECT_LT(joint["relative_error"].get<double>(), 0.05) << name;
    EXPECT_LT(joint["relative_error"].get<double>(),
              0.5 * joint["described_relative_error"].get<double>())
        << name;
  }
  const auto& mass = result["links"]["link2"]["mass_kg"];
  EXPECT_NEAR(mass["value"].get<double>(), 0.33238, mass["ci95"].get<double>());
}

// Importing refuses it; a log in which it happened all the same was joined, or is damaged.
TEST_F(Identify, OfTimeThatGoesBackIsOneError) {
  ASSERT_EQ(tandem("run trajectory.toml --quiet --duration 2 --log logs").status, 0);
  write_text(folder_ / "map.toml", kMap);
  ASSERT_EQ(tandem("log csv " + log() + " --fields position_rad,torque_nm -o run.csv").status, 0);
  std::istringstream rows(read_text(folder_ / "run.csv"));
  std::string line, joined;
  std::size_t count = 0;
  while (std::getline(rows, line) && ++count < 500) joined += line + "\n";
  std::istringstream again(joined);
  std::getline(again, line);
  while (std::getline(again, line)) joined += line + "\n";
  write_text(folder_ / "run.csv", joined);
  const Outcome imported =
      tandem("log import run.csv --robot robot.toml --map map.toml -o bad.mcap");
  EXPECT_EQ(imported.status, 2);
  EXPECT_NE(imported.err.find("run.csv:500: rows: time goes back"), std::string::npos)
      << imported.err;
  EXPECT_EQ(std::ranges::count(imported.err, '\n'), 1) << imported.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "bad.mcap"));
}

TEST_F(Identify, OfAnotherRobotsLogIsOneError) {
  ASSERT_EQ(tandem("run trajectory.toml --quiet --duration 1 --log logs").status, 0);
  const Outcome other = tandem("identify " + log() + " --robot " +
                               shell_word(TANDEM_SOURCE_DIR "/config/panda/robot.toml") +
                               " --out found --json found.json");
  EXPECT_EQ(other.status, 2);
  EXPECT_NE(other.err.find("this log is of another robot: it has no joint 'panda_joint1'"),
            std::string::npos)
      << other.err;
  EXPECT_FALSE(json("found.json")["ok"].get<bool>());
}

TEST_F(Identify, OfAShortLogIsOneError) {
  ASSERT_EQ(tandem("run trajectory.toml --quiet --duration 1 --log logs").status, 0);
  const Outcome result = tandem("identify " + log() + " --robot robot.toml --out found");
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.err.find("too short to identify anything"), std::string::npos) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "found")) << "no folder for nothing";
}

TEST_F(Identify, OfARobotThatStandsIsOneError) {
  ASSERT_EQ(tandem("run hold.toml --quiet --duration 12 --log logs").status, 0);
  const Outcome result = tandem("identify " + log() + " --robot robot.toml --out found");
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.err.find("the joints hardly move: nothing can be said of their masses"),
            std::string::npos)
      << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "found/robot.toml"));
}

TEST_F(Identify, OfALogWithoutTorquesSaysSo) {
  ASSERT_EQ(tandem("run trajectory.toml --quiet --duration 12 --log logs").status, 0);
  const std::string map = kMap;
  write_text(folder_ / "map.toml", map.substr(0, map.find("[torque]")));
  ASSERT_EQ(tandem("log csv " + log() + " --fields position_rad -o run.csv").status, 0);
  const Outcome imported =
      tandem("log import run.csv --robot robot.toml --map map.toml -o bare.mcap");
  ASSERT_EQ(imported.status, 0) << imported.err;
  const Outcome result = tandem("identify bare.mcap --robot robot.toml --out found");
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.err.find("the log has no torque of any joint"), std::string::npos) << result.err;
}

TEST_F(Identify, SaysWhatMakesALogOrItsIntervalsDoubtful) {
  record("robot.toml");
  const std::string whole = log();
  const auto size = std::filesystem::file_size(folder_ / whole);
  std::filesystem::copy_file(folder_ / whole, folder_ / "cut.mcap");
  std::filesystem::resize_file(folder_ / "cut.mcap", size * 4 / 5);
  const Outcome cut = tandem("identify cut.mcap --robot robot.toml --out found");
  ASSERT_EQ(cut.status, 0) << cut.err;
  EXPECT_NE(cut.err.find("note: the log is cut after"), std::string::npos) << cut.err;
  EXPECT_EQ(cut.err.find("the intervals"), std::string::npos) << cut.err;
  const Outcome sharp = tandem("identify " + whole + " --robot robot.toml --out found --cutoff 50");
  ASSERT_EQ(sharp.status, 0) << sharp.err;
  EXPECT_EQ(sharp.err.find("the log is cut"), std::string::npos) << sharp.err;
  EXPECT_NE(sharp.err.find("warning: the intervals were checked with a cut-off of 10 Hz only"),
            std::string::npos)
      << sharp.err;
  write_text(folder_ / "map.toml", kMap);
  ASSERT_EQ(tandem("log csv " + whole + " --fields position_rad,torque_nm -o run.csv").status, 0);
  ASSERT_EQ(tandem("log import run.csv --robot robot.toml --map map.toml -o in.mcap").status, 0);
  const Outcome imported = tandem("identify in.mcap --robot robot.toml --out found");
  ASSERT_EQ(imported.status, 0) << imported.err;
  EXPECT_NE(imported.err.find("for how long a motor's voltage was held"), std::string::npos)
      << imported.err;
}

TEST_F(Identify, RefusesToExciteForTooShort) {
  const Outcome excited = tandem("excite robot.toml --out e.toml --periods 1 --period 2");
  EXPECT_EQ(excited.status, 2);
  EXPECT_NE(excited.err.find("too short for `tandem identify`: 1 period of 2 s"), std::string::npos)
      << excited.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "e.toml"));
  // The shortest one that is written is long enough.
  const Outcome shortest = tandem("excite robot.toml --out e.toml --periods 1 --period 6.1");
  ASSERT_EQ(shortest.status, 0) << shortest.err;
  ASSERT_EQ(tandem("run e.toml --quiet --log logs").status, 0);
  const Outcome found = tandem("identify " + log() + " --robot robot.toml --out found");
  EXPECT_EQ(found.status, 0) << found.err;
}

TEST_F(Identify, IsRefusedWhereLoopsAreClosed) {
  const Outcome result = tandem(
      "excite " + shell_word(TANDEM_SOURCE_DIR "/config/four_bar/robot.toml") + " --out e.toml");
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.err.find("closed loops and passive joints cannot be identified"),
            std::string::npos)
      << result.err;
}

// What a sensor behind the rotor sees of friction is not the motor's: it was written as if it were.
TEST(ActuatorFigures, KeepTheMotorsFrictionThatTorquesBehindTheRotorsDoNotShow) {
  const auto robot = hal::read_robot_config(TANDEM_SOURCE_DIR "/config/double_pendulum/robot.toml");
  ASSERT_TRUE(robot);
  identification::Identification result;
  result.joints.resize(robot->joints.size());
  for (auto& joint : result.joints) joint.viscous_Nms_rad = {0.25, 0.01, true};
  const auto at_motors = actuator_figures(*robot, result);
  ASSERT_EQ(at_motors.size(), 1U);
  ASSERT_TRUE(at_motors[0].damping_Nms_rad);
  EXPECT_GT(*at_motors[0].damping_Nms_rad, 0.25) << "with the back-EMF's share";
  for (auto& joint : result.joints) joint.behind_rotor = true;
  EXPECT_FALSE(actuator_figures(*robot, result)[0].damping_Nms_rad) << "as described";
}

}  // namespace
}  // namespace tandem::apps
