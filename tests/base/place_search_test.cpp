// Where something crashed: as it is noted, and as it is found.
#include "base/place_search.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <string>

#include "base/utf8.hpp"

namespace tandem {
namespace {

[[gnu::noinline]] CallStack stack_of_test() {
  prepare_call_stacks();
  return take_call_stack();
}

bool nobodys(std::uintptr_t) { return false; }

TEST(PlaceSearch, HasTheOffsetAtOnceAndTheFunctionLater) {
  PlaceSearch search;
  const CallStack stack = stack_of_test();
  ASSERT_TRUE(search.note(stack, &nobodys));
  EXPECT_FALSE(search.note(stack, &nobodys)) << "it has one";
  EXPECT_TRUE(std::string(search.noted()).starts_with(" at base_test+0x")) << search.noted();
  EXPECT_EQ(search.place().offset, std::string(search.noted()).substr(4));
  search.look({});
  const CrashPlace found = search.place();
  EXPECT_NE(found.function.find("stack_of_test()"), std::string::npos) << found.function;
  EXPECT_EQ(found.in_function(), " in " + found.function + " (" + found.offset + ")");
}

TEST(PlaceSearch, ChoosesTheAuthorsInnermostCall) {
  static CallStack stack;
  stack = stack_of_test();
  PlaceSearch search;
  ASSERT_TRUE(search.note(stack, [](std::uintptr_t call) { return call == stack.calls[1]; }));
  const std::string offset = search.noted();
  search.look({});
  EXPECT_EQ(" at " + search.place().offset, offset);
  EXPECT_NE(search.place().function.find("ChoosesTheAuthors"), std::string::npos)
      << search.place().function;
}

TEST(PlaceSearch, WritesALineForEachCall) {
  PlaceSearch search;
  ASSERT_TRUE(search.note(stack_of_test(), &nobodys));
  search.look({});
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  search.write(ends[1], "title:");
  ::close(ends[1]);
  std::string text(20'000, ' ');
  text.resize(static_cast<std::size_t>(::read(ends[0], text.data(), text.size())));
  ::close(ends[0]);
  EXPECT_TRUE(text.starts_with("title:\n  tandem::(anonymous namespace)::stack_of_test()")) << text;
  EXPECT_NE(text.find("\n  main"), std::string::npos) << text;
}

// The cut had fallen into the middle of the sign for what is left out.
TEST(ClearNames, AreCutBetweenTwoCharacters) {
  for (std::size_t prefix = 1; prefix < 10; ++prefix) {
    std::string name = "_ZN" + std::to_string(prefix) + std::string(prefix, 'x');
    for (int i = 0; i < 60; ++i) name += "1aIdE";  // a<double>
    name += "1fEv";
    std::array<char, kLongestClearName + 1> clear{};
    write_clear_name(name.c_str(), clear);
    const std::string text = clear.data();
    EXPECT_TRUE(text.starts_with("x")) << text;
    EXPECT_TRUE(text.ends_with("...")) << text;
    EXPECT_NE(text.find("a<…>"), std::string::npos) << text;
    EXPECT_TRUE(is_utf8(text)) << text;
  }
}

}  // namespace
}  // namespace tandem
