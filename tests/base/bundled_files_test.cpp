// Names of bundled files, as this build has them: those of the sources.
#include "base/bundled_files.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/support/scratch_folder.hpp"

namespace tandem {
namespace {

namespace fs = std::filesystem;

const fs::path kConfig = TANDEM_SOURCE_DIR "/config";

/// In a working directory that has a config/ of its own, with `far` an experiment in it.
class BundledFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    was_ = fs::current_path();
    fs::create_directories(folder_ / "config/coman");
    std::ofstream(folder_ / "config/coman/far.toml") << "robot = \"robot.toml\"\n";
    fs::current_path(folder_.path());
  }
  void TearDown() override { fs::current_path(was_); }

  /// That `given` means this file of the sources.
  static void means(const std::string& given, Bundled kind, const std::string& file) {
    const Result<std::string> found = named_file(given, kind);
    ASSERT_TRUE(found) << given << ": " << found.error().to_string();
    EXPECT_TRUE(fs::equivalent(*found, kConfig / file)) << given << ": " << *found;
  }
  static void stays(const std::string& given) {
    const Result<std::string> found = named_file(given, Bundled::kExperiment);
    ASSERT_TRUE(found) << given << ": " << found.error().to_string();
    EXPECT_EQ(*found, given);
  }
  static void is_refused(const std::string& given, Bundled kind, const std::string& words) {
    const Result<std::string> found = named_file(given, kind);
    ASSERT_FALSE(found) << given << ": " << *found;
    EXPECT_NE(found.error().to_string().find(words), std::string::npos)
        << found.error().to_string();
  }

  test::ScratchFolder folder_;
  fs::path was_;
};

TEST_F(BundledFiles, AreFoundByName) {
  means("coman", Bundled::kRobot, "coman/robot.toml");
  means("coman/robot_hands", Bundled::kRobot, "coman/robot_hands.toml");
  means("coman/squat", Bundled::kExperiment, "coman/squat.toml");
  means("coman/squat.toml", Bundled::kExperiment, "coman/squat.toml");
  means("coman", Bundled::kRobotOrExperiment, "coman/robot.toml");
  means("suite", Bundled::kTests, "suite");
  means("suite/coman_push", Bundled::kTests, "suite/coman_push.toml");
  means("studies/coman_push", Bundled::kStudy, "studies/coman_push.toml");
  means("coman/faults/board_dies", Bundled::kScenario, "coman/faults/board_dies.toml");
}

// A path means what it meant, and a file of the working directory goes before a name.
TEST_F(BundledFiles, DoNotStandInForAPath) {
  for (const char* path : {"", "/coman", "./coman", "../coman", "coman/", "coman/../coman/squat",
                           "nobodys.toml", "config/coman/nobodys.toml"})
    stays(path);
  fs::create_directories("coman");
  std::ofstream("coman/squat") << "";
  stays("coman/squat");
  stays("coman");
}

TEST_F(BundledFiles, OfTheWorkingDirectoryComeFirst) {
  EXPECT_EQ(named_file("coman/far", Bundled::kExperiment), "config/coman/far.toml");
}

TEST_F(BundledFiles, ThatAreMisspeltAreRefusedWithTheNearest) {
  is_refused("coman/sqaut", Bundled::kExperiment,
             "no bundled experiment 'coman/sqaut' (did you mean 'coman/squat'?");
  is_refused("comna", Bundled::kRobot, "no bundled robot 'comna' (did you mean 'coman'?");
  is_refused("studies/coman_psuh", Bundled::kStudy, "did you mean 'studies/coman_push'?");
  is_refused("config/coman/squat.toml", Bundled::kExperiment,
             "say the name of the bundled experiment: coman/squat");
  is_refused("config/coman/robot.toml", Bundled::kRobot, "the bundled robot: coman");
  // The robot that there is has these; where there is none, a path is asked for.
  is_refused("panda/xxxxxxxxxx", Bundled::kExperiment, "known: panda/hand, panda/hold");
  is_refused("zzzzzzzzzzzz", Bundled::kRobot, "or give the path of its file");
}

TEST_F(BundledFiles, AreListedByKind) {
  const auto has = [](Bundled kind, const std::string& name) {
    const std::vector<std::string> names = bundled_names(kind);
    return std::ranges::count(names, name) == 1;
  };
  EXPECT_TRUE(has(Bundled::kRobot, "coman"));
  EXPECT_TRUE(has(Bundled::kRobot, "coman/robot_hands"));
  EXPECT_FALSE(has(Bundled::kRobot, "coman/squat"));
  EXPECT_TRUE(has(Bundled::kExperiment, "coman/squat"));
  EXPECT_TRUE(has(Bundled::kExperiment, "coman/far"));
  EXPECT_FALSE(has(Bundled::kExperiment, "coman"));
  EXPECT_TRUE(has(Bundled::kRobotOrExperiment, "coman"));
  EXPECT_TRUE(has(Bundled::kStudy, "studies/coman_push"));
  EXPECT_TRUE(has(Bundled::kScenario, "coman/faults/board_dies"));
  EXPECT_TRUE(has(Bundled::kTests, "suite"));
  for (const std::string& name : bundled_names(Bundled::kExperiment))
    EXPECT_TRUE(named_file(name, Bundled::kExperiment)) << name;
}

}  // namespace
}  // namespace tandem
