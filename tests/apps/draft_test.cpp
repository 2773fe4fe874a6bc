// Drafts by themselves; what commands leave of theirs: half_made_test.cpp.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "apps/text/draft.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

void write(const std::string& file) { std::ofstream(file) << "text"; }

// `tandem excite` passes on what a run of its draft says, and named a file that is gone by then.
TEST(Draft, NamesWhatWasMeantWhereverAMessageNamesIt) {
  const tandem::test::ScratchFolder folder;
  const std::string final = folder / "excite.toml";
  const Draft draft = Draft::file(final);
  ASSERT_NE(draft.path(), final);
  const Error named = draft.placed(
      Error{.message = "the gentlest ended with: error: " + draft.path() + ":7: no such key",
            .hint = "see " + draft.path() + " or " + draft.path(),
            .file = draft.path(),
            .key = {}});
  EXPECT_EQ(named.message, "the gentlest ended with: error: " + final + ":7: no such key");
  EXPECT_EQ(named.hint, "see " + final + " or " + final);
  EXPECT_EQ(named.file, final);
  EXPECT_EQ(draft.placed("another.toml"), "another.toml");
}

// An interrupt between the making of a draft and its being known to the handler left it behind.
TEST(Draft, AnInterruptAtAnyTimeLeavesNothing) {
  const tandem::test::ScratchFolder folder;
  for (int i = 0; i < 200; ++i) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      ::close(STDERR_FILENO);
      for (;;) (void)Draft::folder(folder / "found");
    }
    ::usleep(static_cast<useconds_t>(500 + 37 * i % 1000));
    ASSERT_EQ(::kill(child, SIGINT), 0);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    for (const auto& left : fs::directory_iterator(folder / ""))
      FAIL() << left.path() << " is left, interrupt " << i;
  }
}

// A process that was killed may have had our number.
TEST(Draft, IsNotMixedWithWhatIsLeftOfAnEarlierProcessOfItsNumber) {
  const tandem::test::ScratchFolder folder;
  std::string path;
  {
    const Result<Draft> draft = Draft::folder(folder / "page");
    ASSERT_TRUE(draft);
    path = draft->path();
  }
  fs::create_directories(path);
  write(path + "/left");
  Result<Draft> draft = Draft::folder(folder / "page");
  ASSERT_TRUE(draft);
  EXPECT_EQ(draft->path(), path);
  write(path + "/new");
  ASSERT_TRUE(draft->place());
  EXPECT_TRUE(fs::exists(folder / "page/new"));
  EXPECT_FALSE(fs::exists(folder / "page/left"));
}

TEST(Draft, OfAFolderThatIsThereNowRemovesWhatIsLeftFromBefore) {
  const tandem::test::ScratchFolder folder;
  const std::string gone = ".new-4194305";  // more than Linux gives
  for (const std::string& left : {"page" + gone, "page/" + gone, "other" + gone})
    fs::create_directories(folder / left);
  const Result<Draft> draft = Draft::folder(folder / "page/");
  ASSERT_TRUE(draft);
  EXPECT_FALSE(fs::exists(folder / ("page" + gone)));
  EXPECT_FALSE(fs::exists(folder / ("page/" + gone)));
  EXPECT_TRUE(fs::exists(folder / ("other" + gone)));
}

// A run's report stayed for ever: the next run has another number.
TEST(Draft, OfANumberedNameRemovesThoseOfOtherNumbersWhoseWriterIsGone) {
  const tandem::test::ScratchFolder folder;
  const std::string gone = ".new-4194305", other = ".new-4194306";  // more than Linux gives
  const std::vector<std::string> stay{"squat-1.new-1",          "squat-004" + other,
                                      "squat-a" + gone,         "squats-001" + gone,
                                      "squat-001" + gone + "x", "squat-001"};
  const std::vector<std::string> left{"squat-001" + gone, "squat-17" + gone, "squat-" + gone};
  for (const auto* names : {&stay, &left})
    for (const std::string& one : *names) fs::create_directories(folder / one);
  // Its writer is none of ours to see, as in a container.
  const int written = ::open((folder / stay[1]).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  ASSERT_EQ(::flock(written, LOCK_SH), 0);
  const Result<Draft> draft = Draft::folder(folder / "squat-003", Draft::Removes::kAnyNumber);
  ASSERT_TRUE(draft);
  for (const std::string& one : stay) EXPECT_TRUE(fs::exists(folder / one)) << one;
  for (const std::string& one : left) EXPECT_FALSE(fs::exists(folder / one)) << one;
  const int ours = ::open(draft->path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  EXPECT_NE(::flock(ours, LOCK_EX | LOCK_NB), 0) << "a draft is locked while it is written";
  ::close(ours);
  ::close(written);
}

}  // namespace
}  // namespace tandem::apps
