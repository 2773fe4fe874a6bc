#include "base/file_name.hpp"

#include <gtest/gtest.h>

namespace tandem {
namespace {

TEST(ShownName, HasNothingThatATerminalObeys) {
  for (const char* name : {"hold", "of joint 1", "a,b", "Knie links \u00e4", "\u4e2d"})
    EXPECT_EQ(shown_name_problem(name), "") << name;
  EXPECT_EQ(shown_name_problem("a\033[2J"), "has control characters");
  EXPECT_EQ(shown_name_problem("a\nb"), "has control characters");
  EXPECT_EQ(shown_name_problem("a\u009b2J"), "has control characters");
  EXPECT_EQ(shown_name_problem("a\xc2"), "is not UTF-8");
  EXPECT_EQ(shown_name_problem(""), "is empty");
  EXPECT_EQ(shown_name_problem(std::string(65, 'a')), "is longer than 64 characters");
}

TEST(FileName, LettersDigitsAndThreeSignsAreAllowed) {
  for (const char* name : {"coman", "Walk-Man_2.0", "7", "_x", "a..b"}) {
    EXPECT_EQ(file_name_problem(name), "") << name;
  }
  EXPECT_EQ(file_name_problem(std::string(kLongestFileName, 'a')), "");
}

TEST(FileName, WhatLeadsElsewhereOrHidesIsRefused) {
  for (const char* name : {"", "../../x", "a/b", "..", ".hidden", "-o", "two words", "é", "a\nb"}) {
    EXPECT_NE(file_name_problem(name), "") << name;
  }
  EXPECT_NE(file_name_problem(std::string(kLongestFileName + 1, 'a')), "");
  EXPECT_NE(file_name_problem(std::string_view("a\0b", 3)), "");
}

TEST(InterfaceName, HasFifteenCharactersAtMost) {
  for (const char* name : {"can0", "eth0.100", "enp0s31f6", "a23456789012345"}) {
    EXPECT_EQ(interface_name_problem(name), "") << name;
  }
  for (const char* name : {"", "a234567890123456", "can 0", "a/b", "eth0:1", ".", "..", "a\n"}) {
    EXPECT_NE(interface_name_problem(name), "") << name;
  }
}

TEST(TopicName, LettersDigitsAndUnderscoresAreAllowed) {
  for (const char* name : {"imu", "_1", "Left_Foot_2"}) EXPECT_EQ(topic_name_problem(name), "");
  for (const char* name : {"", "a/1", "a-1", "a.1", "1a", "a b", "é"}) {
    EXPECT_NE(topic_name_problem(name), "") << name;
    if (*name == 0) continue;
    EXPECT_EQ(topic_name_problem(topic_token(name)), "") << name;
  }
  EXPECT_NE(topic_name_problem(std::string(kLongestFileName + 1, 'a')), "");
  EXPECT_EQ(topic_token("a/1"), "a_1");
  EXPECT_EQ(topic_token("2nd"), "_2nd");  // not that of "3nd"
  EXPECT_EQ(topic_name_hint("a.b"), "use letters, digits and _, no digit first: name = \"a_b\"");
}

}  // namespace
}  // namespace tandem
