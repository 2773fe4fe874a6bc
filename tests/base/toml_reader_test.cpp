#include "base/toml_reader.hpp"

namespace tandem {
namespace {

TomlDocument parse(std::string_view text) {
  return TomlDocument::parse(text, "robot.toml").value();
}

TEST(TomlReader, ReadsWhatIsThere) {
  const TomlDocument document = parse("mass_kg = 2.5\nname = 'x'\n[a]\nlist = [1, 2.0]\n");
  TomlTable root = document.root();
  EXPECT_EQ(root.number("mass_kg", kPositive), 2.5);
  EXPECT_EQ(root.text("name"), "x");
  TomlTable a = root.table("a");
  EXPECT_EQ(a.numbers("list", 2), (std::vector<double>{1.0, 2.0}));
  a.finish();
  root.finish();
  EXPECT_TRUE(document.diagnostics().empty());
}

TEST(TomlReader, NamesFileLineAndDottedKeyOfAnUnknownKey) {
  const TomlDocument document = parse("[run]\nduration_s = 1\ndurtion = 2\n");
  TomlTable root = document.root();
  TomlTable run = root.table("run");
  EXPECT_EQ(run.number("duration_s"), 1.0);
  run.finish();
  ASSERT_EQ(document.diagnostics().size(), 1U);
  const Error& error = document.diagnostics().front();
  EXPECT_EQ(error.file, "robot.toml");
  EXPECT_EQ(error.line, 3);
  EXPECT_EQ(error.key, "run.durtion");
  EXPECT_EQ(error.hint, "did you mean 'duration_s'?");
}

TEST(TomlReader, RefusesNumbersThatAreNotFiniteOrOutOfRange) {
  const TomlDocument document = parse("a = nan\nb = inf\nc = -1\nd = 0\ne = 'text'\n");
  TomlTable root = document.root();
  (void)root.number("a");
  (void)root.number("b");
  (void)root.number("c", kNotNegative);
  (void)root.number("d", kPositive);
  (void)root.number("e");
  (void)root.number("missing");
  ASSERT_EQ(document.diagnostics().size(), 6U);
  EXPECT_EQ(document.diagnostics()[0].message, "must be finite");
  EXPECT_EQ(document.diagnostics()[2].message, "-1 is out of range");
  EXPECT_EQ(document.diagnostics()[3].hint, "must be greater than 0");
  EXPECT_EQ(document.diagnostics()[5].message, "this key is missing");
}

TEST(TomlReader, TakesNumbersBetweenTheSmallestAndTheLargestSize) {
  const TomlDocument document = parse("a = 1e-30\nb = -1e30\nc = 9e-31\nd = -1.1e30\n");
  TomlTable root = document.root();
  EXPECT_EQ(root.number("a"), 1e-30);
  EXPECT_EQ(root.number("b"), -1e30);
  EXPECT_TRUE(document.diagnostics().empty());
  (void)root.number("c");
  (void)root.number("d");
  ASSERT_EQ(document.diagnostics().size(), 2U);
  for (const Error& error : document.diagnostics()) {
    EXPECT_EQ(error.hint, "give 0, or a size of 1e-30 to 1e30") << error.key;
  }
}

// duration_s = 1e300 was advised a size up to 1e30, and its range ends at 1e6.
TEST(TomlReader, NamesTheRangeOfAKeyOfAnythingThatIsTooLarge) {
  const TomlDocument document = parse("duration_s = 1e300\n");
  TomlTable root = document.root();
  (void)root.number("duration_s", {0.0, 1e6, true});
  ASSERT_EQ(document.diagnostics().size(), 1U);
  EXPECT_EQ(document.diagnostics()[0].hint, "must be greater than 0 and at most 1e+06");
}

TEST(TomlReader, RefusesIntegersThatNoDoubleHolds) {
  const TomlDocument document = parse(
      "kp = 9007199254740993\nlist = [1, 9007199254740993]\n"
      "exact = 9007199254740992\n");
  TomlTable root = document.root();
  (void)root.number("kp");
  (void)root.numbers("list", 2);
  EXPECT_EQ(root.number("exact"), 9007199254740992.0);
  ASSERT_EQ(document.diagnostics().size(), 2U);
  for (const Error& error : document.diagnostics()) {
    EXPECT_EQ(error.message, "no double is exactly this integer");
  }
}

TEST(TomlReader, TakesWhatATableLacksFromItsDefaults) {
  const TomlDocument document = parse("[defaults]\na = 1\nb = -2\n[t]\na = 3\n[u]\nb = 4\nc = 5\n");
  TomlTable root = document.root();
  TomlTable defaults = root.table("defaults");
  defaults.make_partial();
  EXPECT_EQ(defaults.number("c"), 0.0);
  for (const char* name : {"t", "u"}) {
    TomlTable table = root.table(name);
    table.inherit(defaults);
    EXPECT_EQ(table.number("a"), name[0] == 't' ? 3.0 : 1.0);
    (void)table.number("b", kPositive);
    EXPECT_EQ(table.has("c"), name[0] == 'u');
    (void)table.number("c");
    table.finish();
  }
  ASSERT_EQ(document.diagnostics().size(), 2U);
  EXPECT_EQ(document.diagnostics()[0].key, "defaults.b");
  EXPECT_EQ(document.diagnostics()[0].line, 3);
  EXPECT_EQ(document.diagnostics()[1].key, "t.c");
  EXPECT_EQ(document.diagnostics()[1].hint, "add it to the table, or to [defaults] for all");
}

// "add it to the table" sent its reader to the manual for what may stand there.
TEST(TomlReader, ListsTheChoicesOfAMissingKey) {
  const TomlDocument document = parse("[time]\n");
  TomlTable root = document.root();
  TomlTable time = root.table("time");
  EXPECT_EQ(time.choice("unit", {"s", "ms"}), "");
  ASSERT_EQ(document.diagnostics().size(), 1U);
  EXPECT_EQ(document.diagnostics()[0].hint, "add it to the table: s, ms");
}

TEST(TomlReader, ReportsAFaultOfTheDefaultsOnce) {
  const TomlDocument document = parse("[defaults]\nb = -2\n[t]\n[u]\n");
  TomlTable root = document.root();
  for (const char* name : {"t", "u"}) {
    TomlTable table = root.table(name);
    table.inherit(root.table("defaults"));
    (void)table.number("b", kPositive);
  }
  EXPECT_EQ(document.diagnostics().size(), 1U);
}

TEST(TomlReader, GivesTheLineOfASyntaxError) {
  const auto document = TomlDocument::parse("a = 1\nb = = 2\n", "x.toml");
  ASSERT_FALSE(document.has_value());
  EXPECT_EQ(document.error().line, 2);
}

TEST(TomlReader, QuotesAWordThatStandsWithoutQuotes) {
  const auto word = TomlDocument::parse("a = 1\nplugin = hold  # stays\nb = 2\n", "x.toml");
  ASSERT_FALSE(word.has_value());
  EXPECT_EQ(word.error().line, 2);
  EXPECT_EQ(word.error().hint, "a text stands in quotes: plugin = \"hold\"");
  const auto list = TomlDocument::parse("joints = [a, b]\n", "x.toml");
  ASSERT_FALSE(list.has_value());
  EXPECT_EQ(list.error().hint, "correct the syntax at this line");
}

// A seed of twenty digits was to have its syntax corrected.
TEST(TomlReader, SaysHowLargeAnIntegerMayBe) {
  const auto document = TomlDocument::parse("a = 1\nseed = 99999999999999999999\n", "x.toml");
  ASSERT_FALSE(document.has_value());
  EXPECT_EQ(document.error().line, 2);
  EXPECT_EQ(document.error().hint, "an integer is at most 9223372036854775807");
}

TEST(TomlReader, TakesAnEmptyTextForNoChoiceOnce) {
  const TomlDocument document = parse("a = ''\n");
  EXPECT_EQ(document.root().choice_or("a", "one", {"one", "two"}), "one");
  ASSERT_EQ(document.diagnostics().size(), 1U);
  EXPECT_EQ(document.diagnostics()[0].to_string(),
            "robot.toml:1: a: must not be empty (known: one, two)");
}

TEST(TomlReader, NamesAFileThatIsNotThere) {
  const auto document = TomlDocument::load("no/such/file.toml");
  ASSERT_FALSE(document.has_value());
  EXPECT_EQ(document.error().file, "no/such/file.toml");
}

TEST(TomlReader, AMissingTableIsOneErrorOnly) {
  const TomlDocument document = parse("x = 1\n");
  TomlTable root = document.root();
  EXPECT_EQ(root.integer("x", 0, 5), 1);
  TomlTable missing = root.table("model");
  (void)missing.number("mass");
  EXPECT_EQ(document.diagnostics().size(), 1U);
}

TEST(TomlReader, GivesEveryValueByItsKeyForComparing) {
  const TomlDocument document = parse(
      "whole = 12\nreal = 12.0\nthird = 0.1\nyes = true\ntext = 'a \"b\"'\nempty = []\n"
      "list = [1, [2.50, 'c']]\n[a.b]\nday = 2026-11-25\n[[row]]\nx = 1\n[[row]]\nx = 1e-3\n");
  const std::map<std::string, std::string> expected{
      {"whole", "12"},           {"real", "12"},
      {"third", "0.1"},          {"yes", "true"},
      {"empty", "[]"},           {"text", "\"a \\\"b\\\"\""},
      {"a.b.day", "2026-11-25"}, {"row[0].x", "1"},
      {"row[1].x", "0.001"},     {"list", "[1, [2.5, \"c\"]]"}};
  EXPECT_EQ(document.root().values(), expected);
}

/// As other errors do, which are found when the file has been read.
TEST(TomlReader, CallsAnEntryOfAListByItsNameWhereItHasOneOfItsOwn) {
  const TomlDocument document = parse(
      "[[joint]]\nname = 'hip'\nx = 1\n[[joint.part]]\nname = 'a'\ny = 1\n[[joint]]\nx = 1\n"
      "[[joint]]\nname = 'twin'\nx = 1\n[[joint]]\nname = 'twin'\nx = 1\n[[joint]]\nname = "
      "\"\\u001b\"\nx = 1\n[[joint]]\nname = 3\nx = 1\n[[run]]\nplugin = 'hold'\nx = "
      "1\n[[run]]\nplugin "
      "= 'a/b.so'\nx = 1\n");
  TomlTable root = document.root();
  for (const char* list : {"joint", "run"}) {
    for (TomlTable& entry : root.tables(list, "plugin")) {
      entry.error("x", "is wrong");
      EXPECT_TRUE(entry.has_errors());
      EXPECT_TRUE(entry.has_errors("x"));
      for (TomlTable& part : entry.tables("part")) part.error("y", "is wrong", "");
    }
  }
  std::vector<std::string> keys;
  for (const Error& error : document.diagnostics()) keys.push_back(error.key);
  EXPECT_EQ(keys, (std::vector<std::string>{"joint.hip.x", "joint.hip.part.a.y", "joint[1].x",
                                            "joint[2].x", "joint[3].x", "joint[4].x", "joint[5].x",
                                            "run.hold.x", "run[1].x"}));
}

TEST(TomlReader, KnowsNoNameOfAnEntryAndNoWayOutOfXmlByItself) {
  const TomlDocument document = parse("[[run]]\nplugin = 'hold'\n");
  TomlTable root = document.root();
  EXPECT_EQ(root.tables("run").at(0).error_at("plugin", "").key, "run[0].plugin");
  EXPECT_EQ(TomlDocument::parse("<robot/>", "x.urdf").error().hint, "");
  EXPECT_EQ(TomlDocument::parse("<robot/>", "x.urdf", "import it").error().hint, "import it");
}

TEST(TomlReader, AKeyRequiredOfAnOptionalTableIsAnErrorAtTheTableAbove) {
  const TomlDocument document = parse("x = 1\n[controller]\nplugin = 'squat'\n");
  TomlTable root = document.root();
  TomlTable parameters = root.table("controller").table_or_empty("parameters");
  (void)parameters.number("depth_m");
  ASSERT_EQ(document.diagnostics().size(), 1U);
  EXPECT_EQ(document.diagnostics()[0].line, 2);
  EXPECT_EQ(document.diagnostics()[0].key, "controller.parameters.depth_m");
}

// 0.4 was shown as 0.40000000000000002.
TEST(TomlReader, GivesATableAsJsonWithTheShortestNumbers) {
  const TomlDocument document = parse(
      "ask = { loss = 0.4, most = 1e300, whole = 200.0, count = 3, text = \"a \\\"b\\\"\\n\", "
      "  list = [0.1, -2.5], not = nan, far = -inf, deep = { yes = true, \"k\\\"ey\" = [] } }\n");
  TomlTable root = document.root();
  EXPECT_EQ(root.json("ask"),
            R"({"count": 3, "deep": {"k\"ey": [], "yes": true}, "far": "-Infinity", )"
            R"("list": [0.1, -2.5], "loss": 0.4, "most": 1e+300, "not": "NaN", )"
            R"("text": "a \"b\"\n", "whole": 200.0})");
}

}  // namespace
}  // namespace tandem
