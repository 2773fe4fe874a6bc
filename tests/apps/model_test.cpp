// `tandem model`: libraries that are built once, and their figures.
#include <unistd.h>

#include <map>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class Model : public Program {};

TEST_F(Model, BuildsALibraryAndLeavesItAloneTheSecondTime) {
  ASSERT_EQ(tandem("model build robot.toml -o kernels.so").status, 0);
  ASSERT_TRUE(std::filesystem::exists(folder_ / "kernels.so"));
  const auto built = std::filesystem::last_write_time(folder_ / "kernels.so");
  const Outcome again = tandem("model build robot.toml -o kernels.so");
  EXPECT_EQ(again.status, 0);
  EXPECT_NE(again.out.find("up to date"), std::string::npos) << again.out;
  EXPECT_EQ(std::filesystem::last_write_time(folder_ / "kernels.so"), built);
}

TEST_F(Model, AUsersOwnRobotRunsFromTheCacheFolder) {
  edit("robot.toml", "base = \"fixed\"", "base = \"fixed\"\nderivatives = true");
  const std::string cache = "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache");
  ASSERT_EQ(tandem("model build robot.toml", cache).status, 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "cache/tandem/models"));
  const Outcome run = tandem("run hold.toml --duration 0.05 --no-log", cache);
  EXPECT_EQ(run.status, 0) << run.err;
  // Operations and code of forward dynamics' derivatives are both with the kernels they call.
  ASSERT_EQ(tandem("model info robot.toml --json info.json", cache).status, 0);
  const nlohmann::json kernels = json("info.json")["kernels"];
  for (const char* key : {"add", "mul", "text_bytes"}) {
    const auto of = [&](const char* kernel) { return kernels[kernel][key].get<int>(); };
    EXPECT_GT(of("forward_dynamics_derivatives"),
              of("forward_dynamics") + of("inverse_dynamics_derivatives"))
        << key;
  }
}

// What a computer without a compiler has: the library of another one, and PATH with no programs.
TEST_F(Model, ALibraryThatIsBroughtAlongNeedsNoCompiler) {
  edit("robot.toml", "base = \"fixed\"", "base = \"fixed\"\nderivatives = true");
  for (const char* folder : {"brought", "made/"}) {
    std::filesystem::create_directory(folder_ / "brought");
    ASSERT_EQ(tandem(std::string("model build robot.toml -o ") + folder).status, 0) << folder;
    std::filesystem::permissions(folder_ / folder, std::filesystem::perms(0755));
  }
  std::string name;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "brought"))
    if (entry.path().extension() == ".so") name = entry.path().filename();
  EXPECT_TRUE(name.starts_with("double_pendulum-") && name.ends_with("_kernels.so")) << name;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "made" / name));
  const std::string bare =
      "env PATH=/nonexistent XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache");
  const std::string run = "run hold.toml --duration 0.05 --no-log --no-socket -q --no-build";
  const Outcome lacks = tandem(run, bare);
  EXPECT_EQ(lacks.status, 2);
  EXPECT_NE(lacks.err.find("model build"), std::string::npos) << lacks.err;
  const Outcome has = tandem(run, bare + " TANDEM_MODELS=nowhere:brought");
  EXPECT_EQ(has.status, 0) << has.err;
  // It was passed over in silence: the error was that another robot's library is another one's.
  std::filesystem::permissions(folder_ / "brought" / name, std::filesystem::perms(0777));
  const Outcome open = tandem(run, bare + " TANDEM_MODELS=brought");
  EXPECT_EQ(open.status, 2);
  EXPECT_NE(open.err.find(name), std::string::npos) << open.err;
  EXPECT_NE(open.err.find("may be changed by everybody"), std::string::npos) << open.err;
  std::filesystem::permissions(folder_ / "brought" / name, std::filesystem::perms(0755));
  edit("double_pendulum.urdf", "<mass value=\"", "<mass value=\"1");
  const Outcome other = tandem(run, bare + " TANDEM_MODELS=brought");
  EXPECT_EQ(other.status, 2);
  EXPECT_NE(other.err.find("kernel"), std::string::npos) << other.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "cache"));
}

// A run has no -o.
TEST_F(Model, WithoutACacheFolderEachCommandSaysWhatItTakes) {
  edit("robot.toml", "base = \"fixed\"", "base = \"fixed\"\nderivatives = true");
  const std::string without = "env -u HOME -u XDG_CACHE_HOME";
  const Outcome run = tandem("run hold.toml --duration 0.05 --no-log", without);
  EXPECT_EQ(run.status, 2);
  EXPECT_NE(run.err.find("(set one of them to an absolute path)"), std::string::npos) << run.err;
  const Outcome build = tandem("model build robot.toml", without);
  EXPECT_EQ(build.status, 2);
  EXPECT_NE(build.err.find("(set one of them to an absolute path, or name the library with -o)"),
            std::string::npos)
      << build.err;
}

/// Kernel libraries in the cache folder of a test.
std::ptrdiff_t libraries_in(const std::filesystem::path& folder) {
  std::ptrdiff_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    count += entry.path().extension() == ".so" ? 1 : 0;
  }
  return count;
}

TEST_F(Model, TwoRobotsOfOneNameHaveTheirKernelsSideBySide) {
  const std::string cache = "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache");
  edit("robot.toml", "inertia_kg_m2 = 0.002", "inertia_kg_m2 = 0.003");
  const std::string other = read_text(folder_ / "robot.toml");
  ASSERT_EQ(tandem("model build robot.toml", cache).status, 0);
  edit("robot.toml", "inertia_kg_m2 = 0.003", "inertia_kg_m2 = 0.004");
  ASSERT_EQ(tandem("model build robot.toml", cache).status, 0);
  EXPECT_EQ(libraries_in(folder_ / "cache/tandem/models"), 2);
  EXPECT_EQ(tandem("model info robot.toml", cache).status, 0);
  write_text(folder_ / "robot.toml", other);
  const Outcome again = tandem("model build robot.toml", cache);
  EXPECT_NE(again.out.find("up to date"), std::string::npos) << again.out;
  const Outcome run = tandem("run hold.toml --duration 0.05 --no-log", cache);
  EXPECT_EQ(run.status, 0) << run.err;
}

TEST_F(Model, WithoutAHomeThereIsNoFolderForKernelsToLoad) {
  edit("robot.toml", "inertia_kg_m2 = 0.002", "inertia_kg_m2 = 0.003");
  for (const std::string environment : {"env -u HOME -u XDG_CACHE_HOME", "env HOME=tmp"}) {
    const Outcome outcome = tandem("model build robot.toml", environment);
    EXPECT_EQ(outcome.status, 2);
    for (const std::string text : {"HOME", "XDG_CACHE_HOME", "-o"}) {
      EXPECT_NE(outcome.err.find(text), std::string::npos) << text << "\nin: " << outcome.err;
    }
  }
  // Nor is there one for ccache, if the kernels are compiled with it.
  const Outcome named =
      tandem("model build robot.toml -o kernels.so", "env -u HOME CCACHE_DIR=/proc/none");
  EXPECT_EQ(named.status, 0) << named.err;
}

/// A robot of one's own: no library in the build folder fits it.
class MissingKernels : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    edit("robot.toml", "inertia_kg_m2 = 0.002", "inertia_kg_m2 = 0.0025");
    cache_ = "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache");
  }
  std::string cache_;
};

TEST_F(MissingKernels, AreBuiltByARunOnce) {
  const std::string run = "run hold.toml --duration 0.05 --no-log --json -";
  const Outcome first = tandem(run, cache_);
  ASSERT_EQ(first.status, 0) << first.err;
  EXPECT_TRUE(nlohmann::json::accept(first.out)) << first.out;
  EXPECT_NE(first.err.find("compiling the robot's dynamics, once"), std::string::npos) << first.err;
  EXPECT_NE(first.err.find(" 50 %"), std::string::npos) << first.err;
  EXPECT_EQ(first.err.find('\r'), std::string::npos) << "no terminal, no line to redraw";
  EXPECT_NE(first.err.find("files compiled in"), std::string::npos) << first.err;
  const Outcome second = tandem(run, cache_);
  EXPECT_EQ(second.status, 0) << second.err;
  EXPECT_EQ(second.err.find("compiled"), std::string::npos) << second.err;
}

TEST_F(MissingKernels, AreNoErrorForCheckWhichTellsOfThem) {
  for (const std::string file : {"hold.toml", "robot.toml"}) {
    const Outcome outcome = tandem("check " + file + " --json check.json", cache_);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("none yet: `tandem run` builds them"), std::string::npos)
        << outcome.out;
    EXPECT_NE(outcome.out.find("tandem model build"), std::string::npos) << outcome.out;
    EXPECT_EQ(json("check.json")["kernels"], "");
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "cache"));
}

TEST_F(MissingKernels, AreBuiltOnceByRunsSideBySide) {
  const std::string run = "run hold.toml --duration 0.05 --log ";
  const std::string other = "cd " + shell_word(folder_.string()) + " && " + cache_ + " " +
                            shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " " + run;
  const Outcome both = tandem(run + "a --json a.json & " + other + "b --json b.json; wait", cache_);
  EXPECT_EQ(both.status, 0) << both.err;
  EXPECT_EQ(json("a.json")["log"]["data_sha256"], json("b.json")["log"]["data_sha256"]);
  EXPECT_EQ(libraries_in(folder_ / "cache/tandem/models"), 1);
}

TEST_F(Model, InfoCountsOperationsAndMachineCode) {
  const Outcome outcome = tandem("model info robot.toml --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["robot"], "double_pendulum");
  EXPECT_EQ(json["joints"], 2);
  EXPECT_EQ(json["nv"], 2);
  EXPECT_GT(json["mass_kg"].get<double>(), 0.0);
  for (const std::string kernel : {"forward_dynamics", "inverse_dynamics", "mass_matrix"}) {
    const auto& k = json["kernels"][kernel];
    EXPECT_GT(k["add"].get<int>(), 0) << kernel;
    EXPECT_GT(k["mul"].get<int>(), 0) << kernel;
    EXPECT_TRUE(k.contains("div") && k.contains("sqrt") && k.contains("sincos")) << kernel;
    EXPECT_EQ(k["pairs"], 0) << kernel << ": it has no limbs";
    EXPECT_GT(k["text_bytes"].get<int>(), 50) << kernel;
    EXPECT_LT(k["text_bytes"].get<int>(), 10'000) << kernel;
  }
}

TEST_F(Model, InfoTellsWhatRightAnglesOfFewDigitsCost) {
  edit("double_pendulum.urdf", "<origin xyz=\"0.0060872 0 0.035\" rpy=\"0 0 0\"",
       "<origin xyz=\"0.0060872 0 0.035\" rpy=\"0 1.5708 0\"");
  edit("robot.toml", "base = \"fixed\"", "base = \"fixed\"\nright_angles = \"exact\"");
  const std::string cache = "XDG_CACHE_HOME=" + shell_word(folder_.string() + "/cache");
  ASSERT_EQ(tandem("model build robot.toml", cache).status, 0);
  const Outcome outcome = tandem("model info robot.toml --json -", cache);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto angles = nlohmann::json::parse(outcome.out)["right_angles"];
  EXPECT_EQ(angles["count"], 1);
  EXPECT_EQ(angles["exact"], true);
  EXPECT_NEAR(angles["worst_rad"].get<double>(), 3.673e-6, 1e-9);
  EXPECT_LT(angles["operations_exact"].get<int>(), angles["operations_as_written"].get<int>());
  EXPECT_GT(angles["displacement_m"].get<double>(), 1e-8);
  EXPECT_LT(angles["displacement_m"].get<double>(), 1e-5);
}

TEST_F(Model, InfoTellsOfAVariantByName) {
  const Outcome outcome = tandem("model info robot.toml --kernel-variant baseline --json -");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["kernel_variant"], "baseline");
}

/// What is in a folder, by its path there.
std::map<std::string, std::string> files_in(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files[entry.path().lexically_relative(folder).string()] = read_text(entry.path());
  }
  return files;
}

// What is in the files: tests/scaffold/moveit_test.cpp.
TEST_F(Model, WritesAPackageForRos2Once) {
  const Outcome made = tandem("model ros2 robot.toml");
  ASSERT_EQ(made.status, 0) << made.err;
  for (const char* part : {"double_pendulum_moveit_config: 12 files in double_pendulum_moveit",
                           "moved by trajectory/follow_joint_trajectory",
                           "ros2 launch double_pendulum_moveit_config moveit.launch.py"})
    EXPECT_NE(made.out.find(part), std::string::npos) << made.out;
  const std::filesystem::path folder = folder_ / "double_pendulum_moveit_config";
  const auto files = files_in(folder);
  for (const char* name :
       {"package.xml", "CMakeLists.txt", ".setup_assistant", "launch/moveit.launch.py",
        "config/double_pendulum.urdf", "config/double_pendulum.srdf", "config/kinematics.yaml",
        "config/joint_limits.yaml", "config/moveit_controllers.yaml"})
    EXPECT_TRUE(files.contains(name)) << name;
  EXPECT_EQ(files.at("config/double_pendulum.urdf"), read_text(folder_ / "double_pendulum.urdf"));

  // What is there stays, whoever wrote it.
  write_text(folder / "config/joint_limits.yaml", "mine");
  const Outcome again = tandem("model ros2 robot.toml");
  EXPECT_EQ(again.status, 2);
  EXPECT_NE(again.err.find("double_pendulum_moveit_config: this exists already"), std::string::npos)
      << again.err;
  EXPECT_EQ(read_text(folder / "config/joint_limits.yaml"), "mine");
  write_text(folder_ / "a file", "mine");
  EXPECT_EQ(tandem("model ros2 robot.toml -o 'a file'").status, 2);
  EXPECT_EQ(read_text(folder_ / "a file"), "mine");

  const Outcome named = tandem("model ros2 robot.toml -o 'ws/möve it' --controller swing");
  ASSERT_EQ(named.status, 0) << named.err;
  EXPECT_NE(read_text(folder_ / "ws/möve it/config/moveit_controllers.yaml").find("\"swing\""),
            std::string::npos);
}

TEST_F(Model, RefusesRos2WhatItCannotWrite) {
  for (const auto& [arguments, said] :
       {std::pair<std::string, std::string>{"robot.toml --controller a/b",
                                            "--controller: the controller's name 'a/b'"},
        {"robot.toml --controller ''", "name a controller"},
        {"robot.toml -o ''", "name a folder"},
        {"hold.toml", "hold.toml: this is an experiment, and a robot is needed"},
        {"four_bar", "the robot closes kinematic loops"},
        {"ur5", "ur5e"}}) {
    const Outcome refused = tandem("model ros2 " + arguments);
    EXPECT_EQ(refused.status, 2) << arguments;
    EXPECT_NE(refused.err.find(said), std::string::npos) << arguments << ": " << refused.err;
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder_))
    EXPECT_FALSE(entry.is_directory()) << entry.path();
  std::filesystem::create_directory(folder_ / "locked");
  if (::geteuid() != 0) {
    std::filesystem::permissions(folder_ / "locked", std::filesystem::perms::owner_read |
                                                         std::filesystem::perms::owner_exec);
    EXPECT_EQ(tandem("model ros2 robot.toml -o locked/p").status, 2);
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "locked/p"));
}

}  // namespace
}  // namespace tandem::apps
