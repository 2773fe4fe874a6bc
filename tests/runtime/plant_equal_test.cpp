// A plant with changes is the plant of a robot that is described so: by the kernels of the
// described robot, and by those of the other one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "hal/sim/emulated_robot.hpp"
#include "hal/sim/scenario.hpp"
#include "hal/sim/setup.hpp"
#include "model/interpreted_kernels.hpp"
#include "runtime/experiment.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::runtime {
namespace {

struct Subject {
  const char* robot;
  const char* posture;
  const char* changes;
  double moved;  ///< at least, by the changes [rad or m]: else nothing is compared
};
std::ostream& operator<<(std::ostream& out, const Subject& s) { return out << s.robot; }

// Rigid drives and a fixed base; springs, a floating base, soles and closed brakes; closed loops.
const Subject kSubjects[] = {
    {"panda", "ready",
     "[sim.link.panda_link5]\nmass_kg = 6.0\n"
     "[sim.joint.panda_joint4]\ninertia_kg_m2 = 0.9\nfriction_Nm = 2.0\n"
     "[[sim.payload]]\nname = 'box'\nsite = 'hand'\nmass_kg = 1.6\ncom_m = [0.02, 0.0, 0.12]\n"
     "inertia_kg_m2 = [0.004, 0.001, 0.0, 0.004, 0.0, 0.003]\n",
     1e-3},
    {"coman", "stand",
     "[sim.link.DWYTorso]\nmass_kg = 9.0\n[sim.joint.LKneeSag]\nspring_Nm_rad = 300.0\n"
     "[[sim.payload]]\nname = 'rucksack'\nlink = 'Waist'\nmass_kg = 3.0\ncom_m = [-0.1, 0, 0.1]\n",
     1e-4},
    {"four_bar", "ready", "[sim.link.coupler]\nmass_kg = 3.0\ncom_m = [0.1, 0.02, 0.0]\n", 1e-4},
};

class PlantEqual : public testing::TestWithParam<Subject> {
 protected:
  [[nodiscard]] Experiment read(const std::string& changes) const {
    std::ofstream(folder_ / "x.toml")
        << "robot = \"" TANDEM_SOURCE_DIR "/config/" << GetParam().robot
        << "/robot.toml\"\nduration_s = 1.0\nposture = '" << GetParam().posture
        << "'\n[[controller]]\nplugin = 'hold'\n[sim]\nhoist.enabled = false\n"
        << changes;
    auto e = read_experiment(folder_ / "x.toml");
    if (!e) throw std::runtime_error(e.error().front().to_string());
    return std::move(*e);
  }
  [[nodiscard]] static std::string carrier() {
    const std::string robot = GetParam().robot;
    return robot == "coman" ? "Waist" : robot == "panda" ? "panda_hand" : "coupler";
  }
  const test::ScratchFolder folder_;
};

/// q and v after 0.1 s in which no drive is on.
std::vector<double> state_after(const hal::RobotConfig& robot, const model::Tree& tree,
                                const sim::SimRobotConfig& config) {
  const auto mechanism = model::make_mechanism(tree, sim::model_spec(robot));
  EXPECT_TRUE(mechanism);
  const model::InterpretedKernels kernels(*mechanism, robot.name);
  auto made = sim::EmulatedRobot::create(robot, kernels.get(), config);
  if (!made) throw std::runtime_error(made.error().to_string());
  for (int k = 0; k <= 100; ++k) EXPECT_EQ((*made)->step(k * 1'000'000), Code::kOk);
  const sim::Plant& plant = (*made)->plant();
  std::vector<double> state(plant.q(), plant.q() + kernels.get()->nq);
  state.insert(state.end(), plant.v(), plant.v() + kernels.get()->nv);
  return state;
}

double difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = a.size() == b.size() ? 0.0 : NAN;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

TEST_P(PlantEqual, MovesAsTheRobotThatIsDescribedSo) {
  const Experiment e = read(GetParam().changes);
  ASSERT_NE(e.plant, nullptr);
  const sim::SimRobotConfig changed = e.sim_robot_config();
  sim::SimRobotConfig other = changed;
  other.changes = nullptr;
  const std::vector<double> unchanged = state_after(e.robot, *e.tree(), other);
  other.tree = std::make_shared<const model::Tree>(e.plant->tree);
  const std::vector<double> wanted = state_after(e.plant->robot, e.plant->tree, other);
  const std::vector<double> found = state_after(e.robot, *e.tree(), changed);
  std::printf("%s: moved by %.2g, differs by %.2g\n", GetParam().robot,
              difference(wanted, unchanged), difference(found, wanted));
  EXPECT_LT(difference(found, wanted), 1e-9);
  EXPECT_GT(difference(wanted, unchanged), GetParam().moved);
}

// What comes after 20 ms and goes after 60 ms: as the one that is there between them.
TEST_P(PlantEqual, CarriesFromAStepToAStep) {
  const std::string link = carrier();
  const std::string box = "[[sim.payload]]\nname = 'box'\nlink = '" + link + "'\nmass_kg = 1.0\n";
  const auto after = [&](const std::string& changes) {
    const Experiment e = read(changes);
    return state_after(e.robot, *e.tree(), e.sim_robot_config());
  };
  const std::vector<double> always = after(box), never = after("");
  EXPECT_LT(difference(after(box + "until_s = 10.0\n"), always), 1e-9);
  EXPECT_EQ(after(box + "from_s = 10.0\n"), never);  // to the bit
  const std::vector<double> between = after(box + "from_s = 0.02\nuntil_s = 0.06\n");
  EXPECT_GT(difference(between, always), 1e-5);
  EXPECT_GT(difference(between, never), 1e-5);
}

// The same by a scenario, to the bit.
TEST_P(PlantEqual, CarriesWhatAScenarioSays) {
  const Experiment e = read("[[sim.payload]]\nname = 'box'\nlink = '" + carrier() +
                            "'\nmass_kg = 1.0\ncom_m = [0.1, 0, 0]\nfrom_s = 0.02\n"
                            "until_s = 0.06\n");
  const std::vector<double> wanted = state_after(e.robot, *e.tree(), e.sim_robot_config());
  sim::SimRobotConfig config = e.sim_robot_config();
  config.changes = nullptr;
  const std::string text = "[[fault]]\nkind = 'payload'\nlink = '" + carrier() +
                           "'\nmass_kg = 1.0\ncom_m = [0.1, 0, 0]\nat_s = 0.02\nfor_s = 0.04\n";
  const auto faults =
      sim::parse_scenario(text, "s.toml", e.robot, e.loop.period_ns, e.tree().get());
  ASSERT_TRUE(faults) << faults.error().front().to_string();
  config.faults = *faults;
  EXPECT_EQ(state_after(e.robot, *e.tree(), config), wanted);
  const auto unknown =
      sim::parse_scenario("[[fault]]\nkind = 'payload'\nlink = 'nowhere'\nmass_kg = 1.0\n",
                          "s.toml", e.robot, e.loop.period_ns, e.tree().get());
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().front().to_string().find("s.toml:3"), std::string::npos);
}

// Bodies of other engines keep their masses, which only what is there from the start changes.
TEST_P(PlantEqual, IsRefusedOfAnotherEngineWhereItComesOrGoes) {
  const Experiment e = read("[[sim.payload]]\nname = 'box'\nlink = '" + carrier() +
                            "'\nmass_kg = 1.0\nfrom_s = 1.0\n");
  sim::SimRobotConfig config = e.sim_robot_config();
  config.engine = "mujoco";
  const model::InterpretedKernels kernels(
      *model::make_mechanism(*e.tree(), sim::model_spec(e.robot)), e.robot.name);
  const auto made = sim::EmulatedRobot::create(e.robot, kernels.get(), config);
  ASSERT_FALSE(made);
  EXPECT_NE(made.error().to_string().find("sim.payload"), std::string::npos)
      << made.error().to_string();
}

INSTANTIATE_TEST_SUITE_P(Robots, PlantEqual, testing::ValuesIn(kSubjects),
                         [](const auto& test) { return std::string(test.param.robot); });

}  // namespace
}  // namespace tandem::runtime
