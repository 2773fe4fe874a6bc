// Tests hold in folders of any name and for any user: what their sources may not say.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>

namespace {

namespace fs = std::filesystem;

/// Fails for each place in the tests' sources that is like `pattern`.
void expect_none(const std::string& pattern, const std::string& instead) {
  const std::regex wrong(pattern);
  int sources = 0;
  for (const auto& entry : fs::recursive_directory_iterator(TANDEM_SOURCE_DIR "/tests")) {
    if (entry.path().extension() != ".cpp" && entry.path().extension() != ".hpp") continue;
    std::ostringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    ++sources;
    const std::string all = text.str();
    for (std::sregex_iterator one(all.begin(), all.end(), wrong), end; one != end; ++one) {
      const auto lines = std::count(all.begin(), all.begin() + one->position(), '\n');
      ADD_FAILURE() << entry.path().string() << ":" << lines + 1 << ": " << one->str()
                    << "\ninstead: " << instead;
    }
  }
  EXPECT_GT(sources, 300);
}

// An apostrophe in a folder's name ends the quotes.
TEST(Surroundings, OfATestReachAShellAsWords) {
  expect_none("'\"\\s*\\+?\\s*(TANDEM_(SOURCE|BINARY)_DIR|folder_?\\.string\\(\\))",
              "shell_word(path), of base/quoting.hpp");
}

// .ci/run runs as root what an ordinary user skips for this reason, and knows it by the words.
TEST(Surroundings, ThatOnlyRootHasAreAskedForInOneForm) {
  expect_none("geteuid\\(\\) != 0[^;]*\\)\\s*\\{?\\s*GTEST_SKIP\\(\\) << \"",
              "GTEST_SKIP() << needs_root(…), of tests/support/needs_root.hpp");
}

}  // namespace
