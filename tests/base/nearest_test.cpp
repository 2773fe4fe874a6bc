#include "base/nearest.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace tandem {
namespace {

const std::vector<std::string> kNames{"duration_s", "period_ns", "robot", "seed"};

TEST(Nearest, FindsASlipOfTheFinger) {
  EXPECT_EQ(nearest("durtaion_s", kNames), "duration_s");
  EXPECT_EQ(nearest("Robot", kNames), "robot");
}

TEST(Nearest, FindsANameThatLacksItsUnit) {
  const std::vector<std::string> keys{"com_m", "inertia_kg_m2", "mass_kg"};
  EXPECT_EQ(nearest("mass", keys), "mass_kg");
  EXPECT_EQ(nearest("inertia", keys), "inertia_kg_m2");
  EXPECT_EQ(nearest("mas_kg", std::vector<std::string>{"mas_kg_2", "mass_kg"}), "mass_kg")
      << "a slip is nearer";
}

TEST(Nearest, IsEmptyWhenNothingIsNear) {
  EXPECT_EQ(nearest("zzzzzzzz", kNames), "");
  const std::vector<std::string> words{"off", "on", "jog", "hold", "squat"};
  for (const char* other : {"foo", "wob", "nod", "xy"})
    EXPECT_EQ(nearest(other, words), "") << other;
  EXPECT_EQ(nearest("jgo", words), "jog");
  EXPECT_EQ(nearest("of", words), "off");
  EXPECT_EQ(nearest("com", std::vector<std::string>{"com_m", "mass_kg"}), "com_m");
}

// An unknown word of 100 kB had cost 1.35 s, whoever sent it.
TEST(Nearest, LooksAtNoLongNameAndAtSoManyCandidatesOnly) {
  std::vector<std::string> many(kMostLooked, "nothing_like_it");
  many.emplace_back("duration_s");
  EXPECT_EQ(nearest("durtaion_s", many), "") << "behind the last one that is looked at";
  EXPECT_EQ(nearest(std::string(kMostNamed, 'x'), std::vector{std::string(kMostNamed, 'x') + "y"}),
            std::string(kMostNamed, 'x') + "y");
  const std::string longest(kMostNamed + 1, 'x');
  EXPECT_EQ(nearest(longest, std::vector{longest}), "");
  EXPECT_EQ(nearest(std::string(50'000'000, 'x'), many), "");
  EXPECT_EQ(nearest("x", std::vector{std::string(50'000'000, 'x')}), "");
  EXPECT_EQ(suggest(longest, kNames, 2), "known: duration_s, period_ns, …");
}

// Every pair of short words, beside the distance as the textbook has it.
TEST(Nearest, MeasuresAsTheWholeTableDoes) {
  const auto table = [](const std::string& a, const std::string& b) {
    std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
    for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
    for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
      for (std::size_t j = 1; j <= b.size(); ++j) {
        d[i][j] = std::min(
            {d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0U : 1U)});
        if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
          d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
    return d[a.size()][b.size()];
  };
  std::vector<std::string> words{""};
  for (std::size_t i = 0; i < words.size() && words.size() < 3000; ++i) {
    for (const char c : {'a', 'b', 'c'}) words.push_back(words[i] + c);
  }
  const std::string name = "abcab";
  for (const std::string& word : words) {
    EXPECT_EQ(nearest(name, std::vector{word}) == word && !word.empty(), table(name, word) < 3)
        << word;
  }
}

TEST(Suggest, ListsTheKnownNamesWhenNothingIsNear) {
  EXPECT_EQ(suggest("zzzzzzzz", kNames, 2), "known: duration_s, period_ns, …");
}

}  // namespace
}  // namespace tandem
