// Against the well-formed and the ill-formed sequences of the Unicode Standard, table 3-7.
#include "base/utf8.hpp"

#include <gtest/gtest.h>

#include <string>

namespace tandem {
namespace {

TEST(Utf8, IsEveryWellFormedSequence) {
  for (const std::string text : {"", "arm", "\xC3\xBC", "\xE0\xA0\x80", "\xED\x9F\xBF",
                                 "\xEE\x80\x80", "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"}) {
    EXPECT_TRUE(is_utf8(text)) << text;
    EXPECT_TRUE(is_utf8(text + "x" + text)) << text;
  }
}

TEST(Utf8, IsNothingElse) {
  for (const std::string text :
       {"\xFC", "\x80", "\xC3", "\xC0\xAF", "\xC1\xBF", "\xE0\x9F\xBF", "\xED\xA0\x80",
        "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xE2\x82", "\xC3x"}) {
    EXPECT_FALSE(is_utf8(text)) << text;
    EXPECT_FALSE(is_utf8("arm" + text)) << text;
  }
}

TEST(Utf8, IsCutBetweenTwoCharacters) {
  EXPECT_EQ(whole_characters("a<…>b", 20), "a<…>b");
  EXPECT_EQ(whole_characters("a<…>b", 6), "a<…>");
  EXPECT_EQ(whole_characters("a<…>b", 5), "a<…");
  for (const std::size_t inside : {2U, 3U, 4U}) EXPECT_EQ(whole_characters("a<…>b", inside), "a<");
  EXPECT_EQ(whole_characters("\xF0\x90\x80\x80", 3), "");
  EXPECT_EQ(whole_characters("\x80\x80\x80\x80\x80\x80", 4).size(), 4U) << "it has no characters";
  EXPECT_EQ(whole_characters("ü", 0), "");
}

}  // namespace
}  // namespace tandem
