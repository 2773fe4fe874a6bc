#include "base/process.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace tandem {
namespace {

namespace fs = std::filesystem;

class Process : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  [[nodiscard]] std::string said() const {
    std::ifstream in(output_);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  /// Its exit status.
  int run(std::vector<std::string> command, int input = -1) {
    const Result<pid_t> child = spawn(
        {.command = std::move(command), .output = output_, .directory = folder_, .input = input});
    return child ? wait_for(*child) : -2;
  }
  const std::string folder_ = testing::TempDir() + "process of a test";  // by all, at once
  const std::string output_ = testing::TempDir() + "process_" +
                              testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(Process, GetsItsWordsAsTheyAre) {
  EXPECT_EQ(run({"printf", "%s|", "a b", "$HOME", "`id`", ""}), 0);
  EXPECT_EQ(said(), "a b|$HOME|`id`||");
}

TEST_F(Process, WorksInItsFolderAndBothOutputsAreInTheFile) {
  EXPECT_EQ(run({"sh", "-c", "basename \"$PWD\"; echo wrong >&2; exit 3"}), 3);
  EXPECT_EQ(said(), "process of a test\nwrong\n");
}

TEST_F(Process, HasAnEmptyInputOrTheOneThatIsGiven) {
  EXPECT_EQ(run({"cat"}), 0);
  EXPECT_EQ(said(), "");
  std::ofstream(output_ + "_in") << "text";
  const int input = ::open((output_ + "_in").c_str(), O_RDONLY | O_CLOEXEC);
  EXPECT_EQ(run({"cat"}, input), 0);
  ::close(input);
  EXPECT_EQ(said(), "text");
}

TEST_F(Process, ThatASignalEndsSaysWhich) {
  EXPECT_EQ(run({"sh", "-c", "kill -TERM $$"}), 128 + SIGTERM);
}

TEST_F(Process, ThatCannotBeStartedIsAnError) {
  const Result<pid_t> child = spawn({.command = {"no such program"}, .output = output_});
  ASSERT_FALSE(child.has_value());
  EXPECT_EQ(child.error().message,
            "no such program could not be started: No such file or directory");
  EXPECT_EQ(wait_for(::getpid()), -1);
}

TEST_F(Process, ExistsInThePathOrAsAFile) {
  EXPECT_TRUE(program_exists("sh"));
  EXPECT_TRUE(program_exists("/bin/sh"));
  EXPECT_FALSE(program_exists("no such program"));
  EXPECT_FALSE(program_exists(output_ + "-not"));
}

}  // namespace
}  // namespace tandem
