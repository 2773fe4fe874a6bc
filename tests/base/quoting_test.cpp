#include "base/quoting.hpp"

#include <gtest/gtest.h>

namespace tandem {
namespace {

TEST(Quoting, EscapesWhatEndsOrBreaksAString) {
  EXPECT_EQ(quoted_text("left knee"), R"("left knee")");
  EXPECT_EQ(quoted_text(R"(a "b" \c)"), R"("a \"b\" \\c")");
  EXPECT_EQ(quoted_text("a\n\x1F\x7F"), R"("a\u000A\u001F\u007F")");
  EXPECT_EQ(quoted_text("Hüfte"), "\"Hüfte\"");
}

TEST(Quoting, EscapesWhatMeansSomethingInXml) {
  EXPECT_EQ(xml_text("a<b> & \"c\" 'd'"), "a&lt;b&gt; &amp; &quot;c&quot; 'd'");
}

TEST(Quoting, OfAWordThatAShellWouldBreak) {
  EXPECT_EQ(shell_word("runs/coman-squat-001.mcap"), "runs/coman-squat-001.mcap");
  EXPECT_EQ(shell_word("my robot/$a.toml"), "'my robot/$a.toml'");
  EXPECT_EQ(shell_word("it's"), R"('it'\''s')");
  EXPECT_EQ(shell_word(""), "''");
}

}  // namespace
}  // namespace tandem
