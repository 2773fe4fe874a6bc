#include "base/process.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>

#include "tests/support/scratch_folder.hpp"

namespace tandem {
namespace {

class Process : public testing::Test {
 protected:
  [[nodiscard]] std::string said() const {
    std::ifstream in(output_);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  /// Its exit status.
  int run(std::vector<std::string> command, int input = -1) {
    const Result<pid_t> child = spawn({.command = std::move(command),
                                       .output = output_,
                                       .directory = folder_.path(),
                                       .input = input});
    return child ? wait_for(*child) : -2;
  }
  const test::ScratchFolder folder_;
  const std::string output_ = folder_ / "output";
};

TEST_F(Process, OfALibraryIsTheProgramThatItStandsFor) {
  const std::string own = program_file();
  EXPECT_NE(own.find("base_test"), std::string::npos);
  stand_for_program("/opt/tandem/bin/tandem");
  EXPECT_EQ(program_file(), "/opt/tandem/bin/tandem");
  EXPECT_EQ(program_beside("tandem-tools"), "/opt/tandem/bin/tandem-tools");
  stand_for_program({});
  EXPECT_EQ(program_file(), own);
}

TEST_F(Process, GetsItsWordsAsTheyAre) {
  EXPECT_EQ(run({"printf", "%s|", "a b", "$HOME", "`id`", ""}), 0);
  EXPECT_EQ(said(), "a b|$HOME|`id`||");
}

TEST_F(Process, WorksInItsFolderAndBothOutputsAreInTheFile) {
  EXPECT_EQ(run({"sh", "-c", "pwd; echo wrong >&2; exit 3"}), 3);
  EXPECT_EQ(said(), folder_.path() + "\nwrong\n");
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
