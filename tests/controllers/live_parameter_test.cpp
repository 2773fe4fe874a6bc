// What a controller declares of its parameters, and what a file may give for them.
#include "controllers/live_parameter.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tandem {
namespace {

/// Declares one parameter "x" that the file gives as `line`.
struct Declared {
  Declared(const std::string& line, ParameterFacts facts, const std::string& name = "x")
      : document(*TomlDocument::parse("\n" + line + "\n", "e.toml")) {
    TomlTable table = document.root();
    parameter = parameters.declare(table, name, std::move(facts));
    table.finish();
  }
  [[nodiscard]] std::string problem() const {
    return document.diagnostics().empty() ? "" : document.diagnostics().front().to_string();
  }

  TomlDocument document;
  Parameters parameters;
  Parameter parameter;
};

TEST(LiveParameter, HasWhatTheFileGivesOrItsDefault) {
  EXPECT_EQ(Declared("x = 2.5", {.min = 0, .max = 5, .otherwise = 1}).parameter, 2.5);
  EXPECT_EQ(Declared("", {.min = 0, .max = 5, .otherwise = 1}).parameter, 1.0);
  EXPECT_EQ(Declared("x = 3", {.max = 5, .whole = true}).parameter, 3.0);
  EXPECT_EQ(Declared("", {.whole = true, .otherwise = 7}).parameter, 7.0);
  EXPECT_TRUE(Declared("x = true", {.otherwise = false}).parameter.on());
  EXPECT_FALSE(Declared("", {.otherwise = false}).parameter.on());
  EXPECT_TRUE(Declared("x = 'b'", {.choices = {"a", "b"}, .otherwise = "a"}).parameter.is("b"));
  EXPECT_TRUE(Declared("", {.choices = {"a", "b"}, .otherwise = "a"}).parameter.is("a"));
  EXPECT_FALSE(Declared("", {.otherwise = kNotGiven}).parameter.given());
  EXPECT_TRUE(Declared("x = 0", {.otherwise = kNotGiven}).parameter.given());
  EXPECT_TRUE(std::isnan(Parameter())) << "one that nobody declared shows in every result";
  EXPECT_FALSE(Parameter().changed());
}

TEST(LiveParameter, NamesFileLineKeyAndRangeOfWhatIsWrong) {
  EXPECT_EQ(Declared("x = 6", {.min = 0, .max = 5, .otherwise = 1}).problem(),
            "e.toml:2: x: 6 is out of range (must be at least 0 and at most 5)");
  EXPECT_EQ(Declared("x = 0", {.min = 0, .above_min = true, .otherwise = 1}).problem(),
            "e.toml:2: x: 0 is out of range (must be greater than 0)");
  EXPECT_EQ(Declared("x = nan", {.otherwise = 1}).problem().substr(0, 14), "e.toml:2: x: m");
  EXPECT_EQ(Declared("x = 'a'", {.otherwise = 1}).problem(),
            "e.toml:2: x: must be a number, not string");
  EXPECT_EQ(Declared("x = 1.5", {.whole = true, .otherwise = 1}).problem(),
            "e.toml:2: x: must be an integer, not floating-point");
  EXPECT_NE(Declared("x = 1", {.otherwise = true}).problem(), "");
  EXPECT_NE(Declared("x = 'c'", {.choices = {"a", "b"}, .otherwise = "a"}).problem(), "");
  EXPECT_NE(Declared("", {.min = 0}).problem().find("x: this key is missing"), std::string::npos);
  EXPECT_NE(Declared("y = 1", {.otherwise = 1}).problem().find("y: unknown key"),
            std::string::npos);
}

TEST(LiveParameter, ThatIsDeclaredWronglyIsAnErrorOfTheController) {
  const auto wrong = [](ParameterFacts facts, const char* name = "x") {
    return Declared("", std::move(facts), name).problem();
  };
  EXPECT_EQ(wrong({.min = 0, .max = 5, .otherwise = 6}),
            "e.toml:1: x: has a default outside its range (correct the controller)");
  EXPECT_NE(wrong({.min = 0, .above_min = true, .otherwise = 0}), "");
  EXPECT_NE(wrong({.min = 5, .max = 0}), "");
  EXPECT_NE(wrong({.min = std::nan("")}), "");
  EXPECT_NE(wrong({.otherwise = "word"}), "");
  EXPECT_NE(wrong({.choices = {"a"}, .otherwise = "b"}), "");
  EXPECT_NE(wrong({.choices = {"a"}, .otherwise = 0}), "");
  for (const char* name : {"", "a b", "a.b", "1a", "ä"})
    EXPECT_NE(wrong({.otherwise = 1}, name), "");
}

TEST(LiveParameter, IsDeclaredOnceAndNotTooOften) {
  Declared one("x = 2", {.otherwise = 1});
  TomlTable table = one.document.root();
  EXPECT_EQ(one.parameters.declare(table, "x", {.otherwise = 9}), 2.0);
  EXPECT_EQ(one.problem(),
            "e.toml:2: x: the controller declares this parameter twice (declare it once)");
  Declared many("", {.otherwise = 1});
  TomlTable its = many.document.root();
  for (std::size_t i = 1; i < Parameters::kMost; ++i)
    (void)many.parameters.declare(its, "p" + std::to_string(i), {.otherwise = 1});
  EXPECT_EQ(many.problem(), "");
  (void)many.parameters.declare(its, "more", {.otherwise = 1});
  EXPECT_NE(many.problem().find("more than 256"), std::string::npos);
}

TEST(LiveParameter, IsArchivedWithWhetherItsChangeWasSeen) {
  Declared one("", {.otherwise = 1, .live = true});
  const auto bytes = [&] {
    Archive ar;
    ar(one.parameters);
    return std::vector<std::byte>(ar.bytes().begin(), ar.bytes().end());
  };
  one.parameters.set(one.parameters.rows().front(), 0.1);
  EXPECT_TRUE(one.parameter.changed());
  const auto set = bytes();
  one.parameters.seen();
  EXPECT_FALSE(one.parameter.changed());
  const auto seen = bytes();
  one.parameters.set(one.parameters.rows().front(), 0.2);
  for (const auto& [from, changed] : {std::pair{set, true}, {seen, false}}) {
    Archive ar{std::span<const std::byte>(from)};
    ar(one.parameters);
    EXPECT_TRUE(ar.ok() && ar.at_end());
    EXPECT_EQ(one.parameter, 0.1);
    EXPECT_EQ(one.parameter.changed(), changed);
    EXPECT_EQ(bytes(), from);
  }
}

}  // namespace
}  // namespace tandem
