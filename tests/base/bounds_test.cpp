#include "base/bounds.hpp"

#include <algorithm>
#include <fstream>
#include <random>
#include <sstream>

#include "base/toml_reader.hpp"
#include "tests/support/little_room.hpp"

namespace tandem {
namespace {

std::string repeated(const std::string& one, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += one;
  return text;
}

Error refused(const std::string& text) {
  const auto document = TomlDocument::parse(text, "robot.toml");
  return document ? Error{} : document.error();
}

TEST(Bounds, OfTomlRefuseDepthAtItsLine) {
  const std::string levels = "has more than 32 levels of tables and lists";
  const std::string deep = repeated("a.", 60'000) + "a";
  for (const std::string& text :
       {deep + " = 1", "[" + deep + "]", "[[" + deep + "]]", "x = {" + deep + " = 1}",
        "x = " + repeated("[", 60'000), "x = " + repeated("{a = ", 60'000),
        repeated("\"a\" . ", 60'000) + "a = 1", repeated("'a'.", 60'000) + "a = 1",
        "[" + repeated("a.", 20) + "a]\nb = {" + repeated("c.", 20) + "c = 1}"}) {
    const Error error = refused("# one\n" + text + "\n");
    EXPECT_EQ(error.message, levels) << text.substr(0, 40);
    EXPECT_EQ(error.file, "robot.toml");
    EXPECT_EQ(error.line, text.find('\n') == std::string::npos ? 2 : 3);
  }
}

TEST(Bounds, OfTomlRefuseLengthAndCount) {
  EXPECT_EQ(refused(std::string(300, 'k') + " = 1").message,
            "has more than 256 characters in a key or number");
  EXPECT_EQ(refused("k = '" + std::string(70'000, 'x') + "'").message,
            "has more than 65536 bytes in a text");
  EXPECT_EQ(refused("k = [" + repeated("1,", 200'001) + "]").message,
            "has more than 200000 values");
}

TEST(Bounds, OfTomlLeaveWhatAnExperimentHas) {
  EXPECT_EQ(
      refused("# a.a.a.a " + repeated("a.", 100) +
              "\n"
              "k = '''" +
              repeated("[a.b]\n", 100) + "'''\n" + "m = [" + repeated("[0.1, 0.2, 0.3],\n", 1'000) +
              "]\n" + "[actuator.'a.b.c'.d]\nt = \"" + repeated("\\\"[.", 100) + "\"\n")
          .to_string(),
      "");
}

/// The deepest key, table or list, without a function that calls itself.
bool within(const TomlTable& root) {
  for (const auto& [key, value] : root.values()) {
    const auto levels = std::ranges::count_if(key, [](char c) { return c == '.' || c == '['; });
    if (levels > 40) return false;
  }
  return true;
}

/// Whatever the parser takes is as shallow as the scan says: both read the same language.
TEST(Bounds, OfTomlHoldForWhateverTheParserTakes) {
  const std::vector<std::string> words{"a",
                                       ".",
                                       "=",
                                       "[",
                                       "]",
                                       "{",
                                       "}",
                                       "\n",
                                       ",",
                                       "\"",
                                       "'",
                                       "\"\"\"",
                                       "'''",
                                       "\\",
                                       "#",
                                       " ",
                                       "1",
                                       "1.5",
                                       "b.c.d.e.f.g.h",
                                       " = 1\n",
                                       "[[",
                                       "]]\n",
                                       "\r\n",
                                       "a = [",
                                       "\n["};
  std::mt19937 random(7);
  int taken = 0;
  for (int i = 0; i < 60'000; ++i) {
    std::string text;
    for (std::size_t n = 1 + random() % 24; n > 0; --n) text += words[random() % words.size()];
    const auto document = TomlDocument::parse(text, "random.toml");
    if (!document) continue;
    ++taken;
    EXPECT_TRUE(within(document->root())) << text;
  }
  EXPECT_GT(taken, 500);
}

TEST(Bounds, LetNoDeepOrEndlessTextEndTheProcess) {
  const std::string deep = repeated("a.", 60'000) + "a = 1";
  const std::string endless = "k = [" + repeated("{a=1},", 3'000'000) + "]";
  EXPECT_IN_LITTLE_ROOM(refused(deep).line == 1);
  EXPECT_IN_LITTLE_ROOM(refused(endless).line == 1);
}

TEST(Bounds, OfErrorsListSomeAndCountTheRest) {
  std::string text;
  for (int i = 0; i < 25'000; ++i) text += "unknown_" + std::to_string(i) + " = 1\n";
  const auto document = TomlDocument::parse(text, "many.toml");
  ASSERT_TRUE(document) << document.error().to_string();
  TomlTable root = document->root();
  (void)root.number_or("known", 0.0);
  root.finish();
  const Diagnostics& errors = document->diagnostics();
  ASSERT_EQ(errors.size(), bounds::kErrors.most + 1);
  EXPECT_EQ(errors.back().message, "24950 more are not listed");
  EXPECT_EQ(errors.back().file, "many.toml");
}

TEST(Bounds, OfListsOfTablesAreOneError) {
  const auto document = TomlDocument::parse(repeated("[[site]]\nname = 'a'\n", 1'001), "many.toml");
  ASSERT_TRUE(document);
  EXPECT_TRUE(document->root().tables("site").empty());
  ASSERT_EQ(document->diagnostics().size(), 1U);
  EXPECT_EQ(document->diagnostics().front().to_string(),
            "many.toml:1: site: has more than 1000 tables [[NAME]] of a name (no more is read)");
}

/// The page has every figure, in the table's order.
TEST(Bounds, AreThoseOfTheirPage) {
  std::ifstream in(std::string(TANDEM_SOURCE_DIR) + "/docs/bounds.md");
  const std::string page((std::istreambuf_iterator<char>(in)), {});
  std::size_t at = 0;
  for (const Bound& one : kBounds) {
    std::ostringstream row;
    row << "| " << one.of << " | " << one.most << " | " << one.unit << " |\n";
    const std::size_t found = page.find(row.str(), at);
    EXPECT_NE(found, std::string::npos) << "docs/bounds.md lacks, or has elsewhere: " << row.str();
    if (found != std::string::npos) at = found;
  }
}

}  // namespace
}  // namespace tandem
