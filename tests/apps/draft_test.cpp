// Drafts by themselves; what commands leave of theirs: half_made_test.cpp.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

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

}  // namespace
}  // namespace tandem::apps
