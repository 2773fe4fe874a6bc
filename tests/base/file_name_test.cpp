#include "base/file_name.hpp"

#include <gtest/gtest.h>

namespace tandem {
namespace {

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

}  // namespace
}  // namespace tandem
