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
  EXPECT_NE(many.problem().find("more than 1024"), std::string::npos);
}

/// Declares a list "kp" of the joints a, b.c and d that the file gives as `line`.
struct DeclaredList {
  using Names = std::vector<std::string>;

  DeclaredList(const std::string& line, const std::vector<ParameterFacts>& facts,
               const Names& names = {"a", "b.c", "d"}, const std::string& name = "kp")
      : document(*TomlDocument::parse("\n" + line + "\n", "e.toml")) {
    TomlTable table = document.root();
    kp = parameters.declare_list(table, name, names, facts);
    table.finish();
  }
  [[nodiscard]] std::vector<double> values() const { return {kp.begin(), kp.end()}; }
  [[nodiscard]] std::string problem() const {
    return document.diagnostics().empty() ? "" : document.diagnostics().front().to_string();
  }

  TomlDocument document;
  Parameters parameters;
  std::vector<Parameter> kp;
};

TEST(ParameterList, HasOneNumberForAllOneForEachOrThoseThatAreNamed) {
  using Values = std::vector<double>;
  const std::vector<ParameterFacts> facts{{.min = 0, .max = 500, .otherwise = 10, .live = true}};
  const auto values = [&](const std::string& line) {
    const DeclaredList list(line, facts);
    EXPECT_EQ(list.problem(), "") << line;
    return list.values();
  };
  EXPECT_EQ(values(""), Values({10, 10, 10}));
  EXPECT_EQ(values("kp = 40"), Values({40, 40, 40}));
  EXPECT_EQ(values("kp = [40, 40.5, 20]"), Values({40, 40.5, 20}));
  EXPECT_EQ(values("kp = { 'b.c' = 30 }"), Values({10, 30, 10}));
  EXPECT_EQ(values("[kp]\na = 1\nd = 2"), Values({1, 10, 2}));

  const DeclaredList own("", {{.max = 1, .otherwise = 0.5}, {.otherwise = 2}, {.otherwise = 3}});
  EXPECT_EQ(own.problem(), "");
  EXPECT_EQ(own.values(), Values({0.5, 2, 3}));
  DeclaredList list("kp = 40", facts);
  auto& rows = list.parameters.rows();
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[1].name, "kp.b.c");
  EXPECT_EQ(rows[1].element(), "b.c");
  EXPECT_EQ(rows[1].list, "kp");
  list.parameters.set(rows[1], 7);
  EXPECT_EQ(list.values(), Values({40, 7, 40}));
  EXPECT_TRUE(list.kp[1].changed());
  EXPECT_FALSE(list.kp[0].changed());
  EXPECT_FALSE(DeclaredList("", {{.otherwise = kNotGiven}}).kp[0].given());
}

TEST(ParameterList, NamesFileLineKeyAndElementOfWhatIsWrong) {
  const std::vector<ParameterFacts> facts{{.min = 0, .max = 500, .otherwise = 10}};
  const auto wrong = [&](const std::string& line) { return DeclaredList(line, facts).problem(); };
  EXPECT_EQ(wrong("kp = [40, 40]"),
            "e.toml:2: kp: has 2 numbers (give one for all, or one for each of a, b.c, d)");
  EXPECT_NE(wrong("kp = []"), "");
  EXPECT_NE(wrong("kp = [40, 40, 40, 40]"), "");
  EXPECT_EQ(wrong("kp = [40, 501, 40]"),
            "e.toml:2: kp: b.c: 501 is out of range (must be at least 0 and at most 500)");
  EXPECT_NE(wrong("kp = -1"), "");
  EXPECT_NE(wrong("kp = nan"), "");
  EXPECT_NE(wrong("kp = [40, inf, 40]"), "");
  EXPECT_NE(wrong("kp = [40, 'much', 40]"), "");
  EXPECT_NE(wrong("kp = 'much'"), "");
  EXPECT_NE(wrong("kp = true"), "");
  EXPECT_NE(wrong("kp = { a = 501 }").find("e.toml:2: kp: a: 501"), std::string::npos);
  EXPECT_NE(wrong("kp = { aa = 1 }").find("kp.aa: unknown key"), std::string::npos);
  EXPECT_NE(DeclaredList("", {{.min = 0}}).problem().find("kp: this key is missing"),
            std::string::npos);
  EXPECT_NE(DeclaredList("kp = { a = 1 }", {{.min = 0}}).problem(), "") << "b.c and d are required";
  EXPECT_NE(DeclaredList("kp = [1, 2.5, 3]", {{.whole = true, .otherwise = 1}}).problem(), "");
}

TEST(ParameterList, ThatIsDeclaredWronglyIsAnErrorOfTheController) {
  const auto wrong = [](const std::vector<ParameterFacts>& facts, const char* name = "kp") {
    return DeclaredList("", facts, {"a", "b.c", "d"}, name).problem();
  };
  EXPECT_EQ(wrong({{.min = 0, .max = 5, .otherwise = 6}}),
            "e.toml:1: kp: has a default outside its range (correct the controller)");
  EXPECT_NE(wrong({{.otherwise = 1}, {.otherwise = 1}}), "");
  EXPECT_NE(wrong({}), "");
  EXPECT_NE(wrong({{.otherwise = true}}), "");
  EXPECT_NE(wrong({{.choices = {"x"}, .otherwise = "x"}}), "");
  EXPECT_NE(wrong({{.otherwise = 1}}, "k p"), "");
  const std::vector<ParameterFacts> one{{.otherwise = 1}};
  EXPECT_NE(DeclaredList("", one, {"a", "a"}).problem(), "");
  EXPECT_NE(DeclaredList("", one, {"a", ""}).problem(), "");
  EXPECT_EQ(DeclaredList("kp = 1", one, {}).problem(), "") << "of no joints";
  DeclaredList twice("", one);
  TomlTable table = twice.document.root();
  EXPECT_EQ(twice.parameters.declare_list(table, "kp", {"e"}, one).size(), 1U);
  EXPECT_NE(twice.problem().find("declares this parameter twice"), std::string::npos);
  DeclaredList many("", one, DeclaredList::Names(Parameters::kMost + 1, "x"));
  EXPECT_NE(many.problem().find("more than 1024"), std::string::npos);
  EXPECT_EQ(many.kp.size(), Parameters::kMost + 1) << "handles that are no numbers, and harmless";
  EXPECT_TRUE(std::isnan(many.kp.back()));
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
