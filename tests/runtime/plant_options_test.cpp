#include "runtime/plant_options.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "hal/config/ground_keys.hpp"
#include "hal/sim/payload.hpp"
#include "runtime/experiment.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::runtime {
namespace {

class PlantOptions : public testing::Test {
 protected:
  /// An experiment with one of the bundled robots.
  [[nodiscard]] std::expected<Experiment, Diagnostics> read(const std::string& text,
                                                            const std::string& robot = "panda") {
    std::ofstream(folder_ / "x.toml")
        << "robot = \"" TANDEM_SOURCE_DIR "/config/" << robot << "/robot.toml\"\nduration_s = 1.0\n"
        << (robot == "coman" ? "posture = 'stand'\n" : "") << "[[controller]]\nplugin = 'hold'\n"
        << text;
    return read_experiment(folder_ / "x.toml");
  }
  [[nodiscard]] std::string errors_of(const std::string& text, const std::string& robot = "panda") {
    const auto e = read(text, robot);
    return e ? "" : to_string(e.error());
  }
  static std::string to_string(const Diagnostics& errors) {
    std::string all;
    for (const Error& error : errors) all += error.to_string() + "\n";
    return all;
  }
  const test::ScratchFolder folder_;
};

TEST_F(PlantOptions, AreNothingWithoutTheirKeys) {
  const auto e = read("[sim]\nnoise = true\n");
  ASSERT_TRUE(e) << to_string(e.error());
  EXPECT_EQ(e->plant, nullptr);
  EXPECT_EQ(e->sim_robot_config().changes, nullptr);
}

// A log has the ground's tables: who reads them gets the same ground, to the bit.
TEST_F(PlantOptions, SayTheGroundSoThatALogHasIt) {
  const auto e = read(
      "[[sim.patch]]\nname = 'ice \"1\"'\nx_m = [0.1, 2]\ny_m = [-1, 1]\nsliding_friction = 0.05\n"
      "[[sim.ground]]\nname = 'ramp'\nshape = 'slope'\nslope_deg = 7.3\ntowards_deg = 30\n"
      "x_m = [0.5, 3]\ny_m = [-1, 1.5]\nedge_m = 0.3\n"
      "[[sim.ground]]\nname = 'hill'\nshape = 'bump'\nheight_m = 0.1\nx_m = [0, 1]\ny_m = [0, 1]\n"
      "[[sim.shake]]\nname = 'quake'\nalong = 'y'\namplitude_m = 0.02\nfrequency_Hz = 1.7\n"
      "from_s = 0.3\n",
      "coman");
  ASSERT_TRUE(e) << to_string(e.error());
  ASSERT_NE(e->plant, nullptr);
  hal::ContactConfig logged = e->robot.contact;
  const Status read_again = hal::read_ground(e->plant->ground, "run.mcap", logged);
  ASSERT_TRUE(read_again) << read_again.error().to_string();
  const hal::ContactConfig& ground = e->plant->robot.contact;
  for (double x = -1.0; x < 4.0; x += 0.173) {
    for (double y = -2.0; y < 2.0; y += 0.191)
      ASSERT_EQ(logged.terrain.at(x, y).height_m, ground.terrain.at(x, y).height_m);
  }
  for (double t = 0.0; t < 3.0; t += 0.07)
    ASSERT_EQ(logged.terrain.motion_at(t).position_m, ground.terrain.motion_at(t).position_m);
  ASSERT_EQ(logged.patches.size(), 1U);
  EXPECT_EQ(logged.patches[0].name, "ice \"1\"");
  EXPECT_EQ(logged.patches[0].sliding_friction, 0.05);
  const Status wrong =
      hal::read_ground("[[ground]]\nname = 'x'\nshape = 'cave'\n", "run.mcap", logged);
  ASSERT_FALSE(wrong);
  EXPECT_EQ(logged.patches.size(), 1U) << "as it was";
}

TEST_F(PlantOptions, ChangeThePlantAndLeaveTheRobot) {
  const auto e = read(
      "[sim.link.panda_link7]\nmass_kg = 2.0\n"
      "[sim.joint.panda_joint2]\nfriction_Nm = 3.0\ninertia_kg_m2 = 0.7\nzero_error_rad = 0.01\n"
      "[[sim.payload]]\nname = 'tool'\nlink = 'panda_hand'\nmass_kg = 0.5\ncom_m = [0, 0, 0.1]\n"
      "[[sim.payload]]\nname = 'box'\nsite = 'hand'\nmass_kg = 1.6\nfrom_s = 0.2\nuntil_s = 0.5\n");
  ASSERT_TRUE(e) << to_string(e.error());
  ASSERT_NE(e->plant, nullptr);
  const sim::PlantChanges& plant = *e->plant;
  const model::Tree& described = e->description->tree;
  const auto mass = [](const model::Tree& tree, const char* link) {
    return tree.links[static_cast<std::size_t>(tree.link_index(link))].inertia.mass_kg;
  };
  EXPECT_EQ(mass(plant.tree, "panda_link7"), 2.0);
  EXPECT_NE(mass(described, "panda_link7"), 2.0);
  EXPECT_NEAR(mass(plant.tree, "panda_hand"), mass(described, "panda_hand") + 0.5, 1e-12);
  EXPECT_EQ(mass(plant.tree, "panda_link3"), mass(described, "panda_link3"));
  const hal::JointConfig& joint = plant.robot.joints[1];
  EXPECT_EQ(plant.robot.actuator_of(joint).friction_Nm, 3.0);
  EXPECT_EQ(plant.robot.actuator_of(joint).inertia_kg_m2, 0.7);
  EXPECT_EQ(plant.robot.actuator_of(plant.robot.joints[0]).friction_Nm,
            0.0);  // the same [actuator]
  EXPECT_EQ(e->robot.actuator_of(e->robot.joints[1]).inertia_kg_m2, 0.5);
  EXPECT_EQ(plant.zero_error_rad, (std::vector<double>{0, 0.01, 0, 0, 0, 0, 0}));
  ASSERT_EQ(plant.carried.size(), 1u);
  EXPECT_EQ(plant.carried[0].start_ns, 200'000'000);
  EXPECT_EQ(plant.carried[0].duration_ns, 300'000'000);
  EXPECT_EQ(plant.carried[0].link, described.link_index("panda_hand"));
  EXPECT_EQ(e->robot.joints[static_cast<std::size_t>(plant.carried[0].joint)].name, "panda_joint7");
}

TEST_F(PlantOptions, NameWhatTheyChange) {
  const auto e = read(
      "[sim.link.panda_link7]\nmass_kg = 2.0\n[sim.joint.panda_joint2]\nfriction_Nm = 3.0\n"
      "[[sim.payload]]\nname = 'tool'\nlink = 'panda_hand'\nmass_kg = 0.5\n"
      "[[sim.payload]]\nname = 'box'\nsite = 'hand'\nmass_kg = 1.6\nuntil_s = 0.5\n");
  ASSERT_TRUE(e) << to_string(e.error());
  EXPECT_EQ(e->plant->differences,
            (std::vector<std::string>{
                "link panda_link7: mass_kg = 2", "joint panda_joint2: friction_Nm = 3",
                "payload tool, 0.5 kg on panda_hand, from the start",
                "payload box, 1.6 kg on panda_hand, from the start to 0.5 s"}));
  ASSERT_EQ(e->plant->kept.size(), 1u);
  EXPECT_EQ(e->plant->payloads[e->plant->kept[0].number - 1], "tool, 0.5 kg on panda_hand");
  EXPECT_EQ(e->plant->payloads[e->plant->carried[0].number - 1], "box, 1.6 kg on panda_hand");
}

// They were to be "repaired", by a command that refuses an experiment; or had no key; or did
// nothing.
TEST_F(PlantOptions, AreRefusedByTheirKeysWithHintsThatHelp) {
  const std::string inertia =
      errors_of("[sim.link.panda_link4]\ninertia_kg_m2 = [1, 0, 0, 0.1, 0, 0.1]\n");
  EXPECT_NE(inertia.find("sim.link.panda_link4.inertia_kg_m2: "), std::string::npos) << inertia;
  EXPECT_EQ(inertia.find("repair"), std::string::npos) << inertia;
  const std::string far = errors_of("[sim.link.panda_link4]\ncom_m = [100, 0, 0]\n");
  EXPECT_NE(far.find("sim.link.panda_link4.com_m: "), std::string::npos) << far;
  for (const std::string key : {"spring_Nm_rad", "spring_damping_Nms_rad"}) {
    const std::string rigid = errors_of("[sim.joint.panda_joint4]\n" + key + " = 10\n");
    EXPECT_NE(rigid.find("sim.joint.panda_joint4." + key + ": changes nothing"), std::string::npos)
        << rigid;
    EXPECT_EQ(errors_of("[sim.joint.LKneeSag]\n" + key + " = 10\n", "coman"), "");
  }
}

// What stands at a turned site is the same as what stands at its link, turned.
TEST_F(PlantOptions, TakeASitesNumbersInItsOwnFrame) {
  const auto e = read(
      "[[sim.payload]]\nname = 'box'\nsite = 'l_sole'\nmass_kg = 1.0\ncom_m = [0.1, 0, 0]\n"
      "inertia_kg_m2 = [0.01, 0, 0, 0.02, 0, 0.03]\nfrom_s = 0.1\n",
      "coman");
  ASSERT_TRUE(e) << to_string(e.error());
  const auto site = std::ranges::find(e->robot.model.sites, "l_sole", &hal::SiteConfig::name);
  ASSERT_NE(site, e->robot.model.sites.end());
  const model::Inertia load = sim::load_of(e->plant->carried[0]).in_link;
  EXPECT_NEAR(load.about_com_kg_m2.trace(), 0.06, 1e-15);
  EXPECT_NEAR((load.com_m - Eigen::Vector3d(site->xyz_m.data())).norm(), 0.1, 1e-12);
}

struct Wrong {
  const char* text;
  std::vector<const char*> said;  ///< place, key, reason, help
};
const Wrong kWrong[] = {
    {"[sim.link.panda_hnd]\nmass_kg = 1.0\n",
     {"x.toml:5", "sim.link.panda_hnd", "no link", "panda_hand"}},
    {"[sim.link.panda_link7]\nmass_kg = -1.0\n", {"x.toml:6", "mass_kg", "-1"}},
    {"[sim.link.panda_link7]\nmass_kg = nan\n", {"x.toml:6", "mass_kg"}},
    {"[sim.link.panda_link7]\n", {"x.toml:5", "sim.link.panda_link7", "gives nothing"}},
    {"[sim.link.panda_link7]\nmas_kg = 1.0\n", {"x.toml:6", "mas_kg", "mass_kg"}},
    {"[sim.link.panda_link5]\ninertia_kg_m2 = [0.1, 0, 0, 0.1, 0, 0.5]\n",
     {"x.toml:6", "sim.link.panda_link5.inertia_kg_m2", "triangle"}},
    {"[sim.link.panda_link5]\ninertia_kg_m2 = [0.1, 0, 0, -0.1, 0, 0.1]\n",
     {"x.toml:6", "sim.link.panda_link5.inertia_kg_m2", "positive definite"}},
    {"[sim.link]\nmass_kg = 1.0\n", {"x.toml:6", "sim.link"}},
    {"[sim.joint.panda_joint9]\nfriction_Nm = 1.0\n",
     {"x.toml:5", "sim.joint.panda_joint9", "no joint", "panda_joint"}},
    {"[sim.joint.panda_joint2]\n", {"x.toml:5", "sim.joint.panda_joint2", "changes nothing"}},
    {"[sim.joint.panda_joint2]\nfriction_Nm = -1.0\n", {"x.toml:6", "friction_Nm", "-1"}},
    {"[sim.joint.panda_joint2]\ninertia_kg_m2 = 0.0\n", {"x.toml:6", "inertia_kg_m2"}},
    {"[sim.joint.panda_joint2]\nbacklash_rad = 0.1\n", {"x.toml:6", "backlash_rad"}},
    {"[sim.joint.panda_joint2]\nzero_error_rad = inf\n", {"x.toml:6", "zero_error_rad"}},
    {"[[sim.patch]]\nname = 'a'\nx_m = [0, 1]\ny_m = [0, 1]\n", {"x.toml:5", "changes nothing"}},
    {"[[sim.ground]]\nname = 'a'\nshape = 'slop'\nslope_deg = 3\n", {"x.toml:7", "slope"}},
    {"[[sim.ground]]\nname = 'a'\nshape = 'slope'\n", {"x.toml:5", "slope_deg"}},
    {"[[sim.ground]]\nname = 'a'\nshape = 'step'\nheight_m = 0.1\n", {"x.toml:5", "no rectangle"}},
    {"[[sim.ground]]\nname = 'a'\nshape = 'step'\nheight_m = 0.1\nx_m = [1, 0]\ny_m = [0, 1]\n",
     {"x.toml:9", "ends where it begins"}},
    {"[[sim.ground]]\nname = 'a'\nshape = 'bump'\nheight_m = 0.1\nx_m = [0, 1]\ny_m = [0, 1]\n"
     "edge_m = 0.1\n",
     {"x.toml:11", "another shape"}},
    {"[[sim.shake]]\nname = 'a'\nalong = 'x'\namplitude_m = 0.1\nfrequency_Hz = 1\nfor_s = 1\n",
     {"x.toml:10", "two periods"}},
    {"[[sim.payload]]\nname = 'a'\nlink = 'panda_hnd'\nmass_kg = 1.0\n",
     {"x.toml:7", "link", "panda_hand"}},
    {"[[sim.payload]]\nname = 'a'\nsite = 'hnd'\nmass_kg = 1.0\n", {"x.toml:7", "site", "hand"}},
    {"[[sim.payload]]\nname = 'a'\nmass_kg = 1.0\n", {"x.toml:5", "link"}},
    {"[[sim.payload]]\nname = 'a'\nlink = 'panda_hand'\nsite = 'hand'\nmass_kg = 1.0\n",
     {"x.toml:8", "one place"}},
    {"[[sim.payload]]\nname = 'a'\nlink = 'panda_hand'\n", {"x.toml:5", "mass_kg"}},
    {"[[sim.payload]]\nlink = 'panda_hand'\nmass_kg = 1.0\n", {"x.toml:5", "name"}},
    {"[[sim.payload]]\nname = 'a'\nlink = 'panda_hand'\nmass_kg = 0.0\n", {"x.toml:8", "mass_kg"}},
    {"[[sim.payload]]\nname = 'a'\nlink = 'panda_hand'\nmass_kg = -1.6\n", {"x.toml:8", "mass_kg"}},
    {"[[sim.payload]]\nname = 'a'\nlink = 'panda_hand'\nmass_kg = 1.0\ncom_m = [0, nan, 0]\n",
     {"x.toml:9", "com_m"}},
    {"[[sim.payload]]\nname = 'a'\nlink = 'panda_hand'\nmass_kg = 1.0\ncom_m = [0, 0]\n",
     {"x.toml:9", "com_m"}},
    {"[[sim.payload]]\nname = 'a'\nlink = 'panda_hand'\nmass_kg = 1.0\n"
     "inertia_kg_m2 = [0.1, 0, 0, 0.1, 0, 0.5]\n",
     {"x.toml:9", "inertia_kg_m2", "triangle"}},
    {"[[sim.payload]]\nname = 'a'\nlink = 'panda_link0'\nmass_kg = 1.0\n",
     {"x.toml:7", "fixed to the world"}},
    {"[[sim.payload]]\nname = 'a'\nlink = 'panda_hand'\nmass_kg = 1.0\nfrom_s = 2.0\nuntil_s = "
     "1.0\n",
     {"x.toml:10", "until_s", "before it is picked up"}},
    {"[[sim.payload]]\nname = 'a'\nlink = 'panda_hand'\nmass_kg = 1.0\n"
     "[[sim.payload]]\nname = 'a'\nlink = 'panda_hand'\nmass_kg = 2.0\n",
     {"x.toml:10", "name", "two payloads are called 'a'"}},
};

TEST_F(PlantOptions, SayWhatIsWrongAndWhere) {
  for (const Wrong& wrong : kWrong) {
    const std::string errors = errors_of(wrong.text);
    EXPECT_FALSE(errors.empty()) << wrong.text;
    for (const char* said : wrong.said)
      EXPECT_NE(errors.find(said), std::string::npos) << wrong.text << errors << said;
  }
}

TEST_F(PlantOptions, RefuseALinkWhoseJointCarriesNothingThen) {
  const std::string errors = errors_of("[sim.link.link2]\nmass_kg = 0.0\n", "double_pendulum");
  EXPECT_NE(errors.find("sim.link"), std::string::npos) << errors;
}

}  // namespace
}  // namespace tandem::runtime
