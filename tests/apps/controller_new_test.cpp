// `tandem controller new`, and what its project makes: built, tested and run as its user does it.
#include "tests/apps/program.hpp"
#include "tests/support/socket_path.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

class ControllerNew : public Program {
 protected:
  void expect(const std::string& text, const std::string& part) const {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
  /// What a shell prints that stands in the test's folder, and its status.
  [[nodiscard]] Outcome shell(const std::string& command) const {
    const std::string whole = "cd " + shell_word(folder_.string()) +
                              " && export CXX=" + shell_word(TANDEM_COMPILER) + " && (" + command +
                              ") >out.txt 2>&1 </dev/null";
    const int raw = std::system(whole.c_str());
    return {WIFEXITED(raw) ? WEXITSTATUS(raw) : -1, read_text(folder_ / "out.txt"), ""};
  }
  /// While the made controller runs. Its numbers were read once: `set` found no parameter.
  void set_its_gain(const std::string& tandem) const {
    const std::string to = " --socket " + tandem::test::socket_path();
    const Outcome set =
        shell("cd nod && { " + tandem + " run nod.toml --rate 20 --duration 2000 --no-log -q" + to +
              " & } && for i in $(seq 600); do " + tandem + " controller set nod kp_1_s2=40" + to +
              " && break; sleep 0.05; done; " + tandem + " controller show nod" + to +
              "; kill -INT $!; wait $!");
    EXPECT_EQ(set.status, 130) << set.out;
    for (const char* part : {"nod.kp_1_s2  40", "amplitude_rad", "period_s", "0.01 to 1000"})
      expect(set.out, part);
  }
  /// The two commands, with the program of `prefix`; then the same with a wrong sign.
  void make_and_spoil(const std::string& prefix) const {
    const Outcome made = shell(shell_word(prefix + "/bin/tandem") + " controller new nod");
    ASSERT_EQ(made.status, 0) << made.out;
    expect(made.out, "cd nod && cmake --workflow --preset run");
    const Outcome run = shell("cd nod && cmake --workflow --preset run");
    ASSERT_EQ(run.status, 0) << run.out;
    expect(run.out, "100% tests passed, 0 tests failed out of 3");
    expect(run.out, "joint2");
    const fs::path log = folder_ / "nod/runs/double_pendulum-nod-001.mcap";
    EXPECT_TRUE(fs::is_regular_file(log)) << run.out;
    set_its_gain(shell_word(prefix + "/bin/tandem"));
    edit("nod/nod.cpp", "(target_rad - reference_rad_)", "(reference_rad_ - target_rad)");
    const Outcome wrong = shell("cd nod && cmake --workflow --preset run");
    EXPECT_NE(wrong.status, 0);
    expect(wrong.out, "starts_where_the_joint_is ........   Passed");
    expect(wrong.out, "arrives_at_the_target (Failed)");
    expect(wrong.out, "runs_on_the_robot (Failed)");
  }
};

// With the build folder's program the guide my-controller.md does the same.
TEST_F(ControllerNew, MovesARobotOfAnInstallation) {
  const std::string prefix = (folder_ / "prefix").string();
  const fs::path manifest = fs::path(TANDEM_BINARY_DIR) / "install_manifest.txt";
  std::error_code ignored;
  fs::remove(manifest, ignored);  // of who installed last, who may be root
  const Outcome installed =
      shell("cmake --install " + shell_word(TANDEM_BINARY_DIR) + " --prefix " + shell_word(prefix));
  fs::remove(manifest, ignored);
  ASSERT_EQ(installed.status, 0) << installed.out;
  make_and_spoil(prefix);
}

/// find_package() sets a build type for its own scope alone.
TEST_F(ControllerNew, IsBuiltWithOptimisationWhereNothingSaysSo) {
  write_text(folder_ / "mine.cpp", "");
  write_text(folder_ / "CMakeLists.txt", R"(cmake_minimum_required(VERSION 3.25)
project(mine LANGUAGES CXX)
function(find)
  find_package(tandem REQUIRED)
endfunction()
find()
tandem_add_controller(mine SOURCES mine.cpp)
)");
  const Outcome configured =
      shell("cmake -S . -B build -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -Dtandem_DIR=" +
            shell_word(TANDEM_BINARY_DIR "/package"));
  ASSERT_EQ(configured.status, 0) << configured.out;
  const std::string commands = read_text(folder_ / "build/compile_commands.json");
  expect(commands, " -O2 ");
#ifndef __clang__
  expect(commands, " -fno-gnu-unique ");
#endif
}

TEST_F(ControllerNew, ChoosesAJointThatDoesNotCarryTheRobot) {
  const Outcome made = tandem("controller new wave --robot coman -o a/b");
  ASSERT_EQ(made.status, 0) << made.err;
  const std::string text = read_text(folder_ / "a/b/wave.toml");
  expect(text, "posture = ");
  EXPECT_EQ(text.find("Knee"), std::string::npos) << text;
  EXPECT_EQ(text.find("Ank"), std::string::npos) << text;
  expect(read_text(folder_ / "a/b/wave.cpp"), "class WaveController : public");
  const Outcome own = tandem("controller new my_arm --robot robot.toml");
  ASSERT_EQ(own.status, 0) << own.err;
  expect(read_text(folder_ / "my_arm/my_arm.cpp"), "class MyArmController");
}

TEST_F(ControllerNew, RefusesWhatItCannotWriteAndWritesNothing) {
  write_text(folder_ / "file", "mine\n");
  fs::create_directory(folder_ / "folder");
  const std::pair<const char*, const char*> wrong[]{
      {"", "name is required"},
      {"2nd", "the controller's name '2nd' begins with a digit"},
      {"my-arm", "the controller's name 'my-arm'"},
      {"../arm", "the controller's name '../arm'"},
      {"'a b'", "the controller's name 'a b'"},
      {"''", "the controller's name ''"},
      {"class", "is a word of C++"},
      {"file", "file: this exists already"},
      {"folder", "folder: this exists already"},
      {"nod -o folder", "folder: this exists already"},
      {"nod --robot comna", "there is no bundled robot 'comna' (did you mean 'coman'?"},
      {"nod --robot hold.toml", "hold.toml"},
      {"nod --robot ''", "name a robot"},
      {"nod -o file/nod", "file"}};
  for (const auto& [words, message] : wrong) {
    const Outcome outcome = tandem(std::string("controller new ") + words);
    EXPECT_EQ(outcome.status, 2) << words << outcome.out;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << words << ": " << outcome.err;
    EXPECT_FALSE(fs::exists(folder_ / "nod")) << words;
  }
  EXPECT_EQ(read_text(folder_ / "file"), "mine\n");
  EXPECT_TRUE(fs::is_empty(folder_ / "folder"));
  std::size_t others = 0;
  for (const auto& one : fs::directory_iterator(folder_)) {
    const std::string name = one.path().filename().string();
    others += name.find(".new") != std::string::npos || name == "2nd" || name == "class" ? 1U : 0U;
  }
  EXPECT_EQ(others, 0U);
}

}  // namespace
}  // namespace tandem::apps
