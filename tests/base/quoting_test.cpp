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

TEST(Quoting, ShowsWhatATerminalWouldObey) {
  EXPECT_EQ(harmless("a\x1b[2J\r\x7f\tb\n"), "a\\u001b[2J\\u000d\\u007f\tb\n");
  EXPECT_EQ(harmless("\u009b2J \u202eevil\u2066 a\u200bb \ufeff \u2028"),
            "\\u009b2J \\u202eevil\\u2066 a\\u200bb \\ufeff \\u2028");
  EXPECT_EQ(harmless("\xff\xc3 \xed\xa0\x80 \xe2\x82"), "\\xff\\xc3 \\xed\\xa0\\x80 \\xe2\\x82");
  EXPECT_EQ(harmless("\U000E0041"), "\\udb40\\udc41");
  const std::string kept = "Knie ä 中 … ─ █ 🤖 \"\\";
  EXPECT_EQ(harmless(kept), kept);
}

TEST(Quoting, ShowsANameInOneLineAndNotForEver) {
  EXPECT_EQ(shown("a\nerror: b\tc"), "a\\nerror: b\\u0009c");
  EXPECT_EQ(shown("äöü", 3), "äöü");
  EXPECT_EQ(shown("äöüx", 3), "äöü…");
  EXPECT_EQ(shown(std::string(1'000'000, 'a')).size(), bounds::kShown.most + 3);
}

}  // namespace
}  // namespace tandem
