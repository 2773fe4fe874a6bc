// `[sim] engine`: who moved the bodies is told wherever a run is described, and what an engine does
// not do is refused before anything is compiled.
#include <algorithm>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

bool installed(const std::string& engine) {
  return std::filesystem::exists(TANDEM_BINARY_DIR "/lib/engines/" + engine + ".so");
}

class EngineChoice : public Program {
 protected:
  void choose(const std::string& engine, const std::string& more = "") const {
    write_text(folder_ / "hold.toml",
               read_text(folder_ / "hold.toml") + "\n[sim]\nengine = \"" + engine + "\"\n" + more);
  }
};

TEST_F(EngineChoice, IsToldByCheckRunLogAndReport) {
  if (!installed("mujoco")) GTEST_SKIP() << "MuJoCo is not installed";
  choose("mujoco");
  const Outcome check = tandem("check hold.toml --json check.json");
  ASSERT_EQ(check.status, 0) << check.err;
  const std::string version = json("check.json")["engine_version"];
  EXPECT_EQ(json("check.json")["engine"], "mujoco");
  const std::string name = "mujoco " + version;
  EXPECT_NE(check.out.find(name + "\n"), std::string::npos) << check.out;
  EXPECT_NE(check.out.find("semi-implicit Euler, order 1, 250 us steps"), std::string::npos)
      << check.out;
  const Outcome run = tandem("run hold.toml --duration 0.05 --report --json run.json");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(json("run.json")["engine"], "mujoco");
  EXPECT_EQ(json("run.json")["engine_version"], version);
  EXPECT_NE(run.out.find(name + "\n"), std::string::npos) << run.out;
  const std::string log = json("run.json")["log"]["path"];
  const Outcome info = tandem("log info " + log + " --json info.json");
  EXPECT_NE(info.out.find(name + "\n"), std::string::npos) << info.err << info.out;
  EXPECT_EQ(json("info.json")["metadata"]["engine"], name);
  const std::filesystem::path page =
      std::filesystem::path(log).replace_extension("") / "report.html";
  EXPECT_NE(read_text(folder_ / page).find(name), std::string::npos) << page;
}

TEST_F(EngineChoice, OfOursHasNoVersionOfItsOwn) {
  ASSERT_EQ(tandem("run hold.toml --duration 0.05 --json run.json").status, 0);
  EXPECT_EQ(json("run.json")["engine"], "tandem");
  EXPECT_TRUE(json("run.json")["engine_version"].is_null());
  const std::string log = json("run.json")["log"]["path"];
  ASSERT_EQ(tandem("log info " + log + " --json info.json").status, 0);
  EXPECT_FALSE(json("info.json")["metadata"].contains("engine"));
}

// `tandem check` alone said them.
TEST_F(EngineChoice, IntegratorAndStepAreToldByRunLogAndReport) {
  const std::string integrators[][3] = {
      {"", "leapfrog", "250"},
      {"[sim]\nintegrator = \"rk4\"\nsubstep_ns = 125000\n", "Runge-Kutta 4", "125"}};
  const std::string plain = read_text(folder_ / "hold.toml");
  for (const auto& [more, name, step_us] : integrators) {
    write_text(folder_ / "hold.toml", plain + more);
    const std::string text = name + ", " + step_us + " us steps";
    EXPECT_NE(tandem("check hold.toml --json check.json").out.find(text + "\n"), std::string::npos);
    EXPECT_EQ(json("check.json")["integrator"], name);
    const Outcome run = tandem("run hold.toml --duration 0.05 --report --json run.json");
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_NE(run.out.find(text + "\n"), std::string::npos) << run.out;
    EXPECT_EQ(json("run.json")["integrator"], name);
    EXPECT_EQ(json("run.json")["substep_ns"], 1000 * std::stoi(step_us));
    const std::string log = json("run.json")["log"]["path"];
    const Outcome info = tandem("log info " + log + " --json info.json");
    EXPECT_NE(info.out.find(text + "\n"), std::string::npos) << info.out;
    EXPECT_EQ(json("info.json")["metadata"]["integrator"], text);
    const std::filesystem::path page =
        std::filesystem::path(log).replace_extension("") / "report.html";
    EXPECT_NE(read_text(folder_ / page).find(text), std::string::npos) << page;
  }
}

TEST_F(EngineChoice, WithOneCoefficientOfFrictionIsWarnedOf) {
  if (!installed("mujoco")) GTEST_SKIP() << "MuJoCo is not installed";
  const std::string coman = TANDEM_SOURCE_DIR "/config/coman/";
  write_text(folder_ / "stand.toml", "robot = \"" + coman +
                                         "robot.toml\"\nposture = \"stand\"\nduration_s = 1\n"
                                         "[[controller]]\nplugin = \"hold\"\n");
  EXPECT_EQ(tandem("check stand.toml").err.find("coefficient"), std::string::npos);
  write_text(folder_ / "stand.toml",
             read_text(folder_ / "stand.toml") + "[sim]\nengine = \"mujoco\"\n");
  const Outcome check = tandem("check stand.toml");
  EXPECT_EQ(check.status, 0) << check.err;
  EXPECT_NE(check.err.find("stand.toml:7: sim.engine: the engine 'mujoco' has one coefficient of "
                           "friction, static_friction = 0.9: sliding_friction = 0.8 is not used"),
            std::string::npos)
      << check.err;
}

/// A robot of one's own, without kernels.
class EngineRefusal : public EngineChoice {
 protected:
  void expect_refused(const std::string& expected) const {
    const std::string cache = "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache");
    for (const std::string command : {"check", "run", "emulate"}) {
      const Outcome outcome = tandem(command + " hold.toml", cache);
      EXPECT_EQ(outcome.status, 2) << command;
      EXPECT_EQ(outcome.err.find("error: hold.toml"), 0U) << command << ": " << outcome.err;
      EXPECT_NE(outcome.err.find(expected), std::string::npos) << command << ": " << outcome.err;
      EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << command << ": " << outcome.err;
    }
    EXPECT_FALSE(std::filesystem::exists(folder_ / "cache")) << "nothing was compiled";
  }
};

TEST_F(EngineRefusal, OfAClosedLoopComesBeforeKernelsAreBuilt) {
  for (const char* file : {"robot.toml", "four_bar.urdf", "hold.toml"}) {
    std::filesystem::copy_file(TANDEM_SOURCE_DIR "/config/four_bar/" + std::string(file),
                               folder_ / file, std::filesystem::copy_options::overwrite_existing);
  }
  edit("four_bar.urdf", "mass value=\"", "mass value=\"1");
  choose("mujoco");
  expect_refused(
      "sim.engine: the engine 'mujoco' cannot close the loop 'pin' (set engine = \"tandem\": only "
      "Tandem's own does closed loops)");
}

TEST_F(EngineRefusal, OfAnEngineThatIsNotInstalledComesBeforeKernelsAreBuilt) {
  edit("double_pendulum.urdf", "mass value=\"", "mass value=\"1");
  const std::string plain = read_text(folder_ / "hold.toml");
  int missing = 0;
  for (const std::string engine : {"dart", "bullet", "ode", "simbody", "mujoco"}) {
    if (installed(engine)) continue;
    ++missing;
    write_text(folder_ / "hold.toml", plain);
    choose(engine);
    expect_refused("sim.engine: the engine '" + engine + "' is not installed");
  }
  if (missing == 0) GTEST_SKIP() << "every engine is installed";
}

TEST_F(EngineRefusal, OfAnIntegratorComesBeforeKernelsAreBuilt) {
  edit("double_pendulum.urdf", "mass value=\"", "mass value=\"1");
  if (!installed("ode"))
    GTEST_SKIP() << "in make test-all: ODE is not installed (scripts/install-dependencies engines)";
  choose("ode", "integrator = \"rk4\"\n");
  expect_refused("sim.integrator: the engine 'ode' has no rk4");
}

}  // namespace
}  // namespace tandem::apps
