// Tables that cannot be read as they are, columns that are slower than others, and joints that
// follow others: what is refused says what to do, and what needs no word is read.
#include <cstdlib>
#include <functional>
#include <tuple>

#include "tests/log_import/rig.hpp"

namespace tandem::log {
namespace {

using namespace test;

using CellText = std::function<std::string(int)>;

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

double q1(int i) { return std::sin(0.01 * i); }
double q2(int i) { return std::cos(0.01 * i); }

std::string map_in(const std::string& unit, const std::string& more = {},
                   const std::string& tables = {}) {
  return more + "joints = [\"joint1\", \"joint2\"]\n[time]\ncolumn = \"t\"\nunit = \"" + unit +
         "\"\nperiod_s = 0.01\n[position]\ncolumns = \"q{1}\"\nunit = \"rad\"\n" + tables;
}

class TableTrouble : public Import {
 protected:
  /// Rows of a time, the two joints and more.
  std::string table(int count, const CellText& time, const std::string& names = {},
                    const CellText& more = {}) const {
    std::string text = "t,q1,q2" + names + "\n";
    for (int i = 0; i < count; ++i)
      text += time(i) + "," + number(q1(i)) + "," + number(q2(i)) + (more ? more(i) : "") + "\n";
    return write("a.csv", text);
  }
};

/// Two cells that say the row's number.
std::string row_of(int i) { return "," + std::to_string(i) + "," + std::to_string(i + 1); }

std::string seconds(int i) { return number(0.01 * i); }

/// A clock's time, 10 ms a row from noon on.
std::string clock_of(int i, const std::string& before, const std::string& after,
                     const std::string& colon = ":") {
  char text[40];
  std::snprintf(text, sizeof text, "12%s00%s%02d.%02d", colon.c_str(), colon.c_str(), i / 100,
                i % 100);
  return before + text + after;
}

constexpr std::int64_t kNoon_ns = 1'798'113'600'000'000'000;  // date -u -d 2026-12-24T12:00Z +%s

// Each was "no date of ISO 8601"; the basic form is one.
TEST_F(TableTrouble, DatesOfTheBasicFormAndOfUtcAreRead) {
  for (const auto& [before, after, colon] :
       std::initializer_list<std::tuple<const char*, const char*, const char*>>{
           {"20261224T", "Z", ""},
           {"20261224T", "", ""},
           {"20261224 ", "+0000", ""},
           {"2026-12-24 ", " UTC", ":"},
           {"2026-12-24T", "GMT", ":"}}) {
    const auto time = [&](int i) { return clock_of(i, before, after, colon); };
    const std::string file = table(150, time);
    EXPECT_EQ(imported({file}, map_in("iso")).begin_ns, kNoon_ns) << time(0);
    EXPECT_HAS(refusal({file}, map_in("s")), "this time is a date (say unit = \"iso\"");
  }
  for (const char* no : {"2026122T120000Z", "20261324T120000Z", "20261224T12000Z", "20261224T",
                         "20261224T12:00:00Z", "20261224120000"})
    EXPECT_HAS(refusal({table(20, [no](int) { return no; })}, map_in("iso")), "is no date") << no;
}

// The advice was exclude = ["invalid"], and followed it left nothing: "has less than two samples".
TEST_F(TableTrouble, TimesThatNobodyCanReadAreRefusedAtTheFirstRowWithWhatToDo) {
  struct Case {
    const char *before, *after, *said;
  };
  for (const Case& one : {Case{"", "", "'12:00:00.00' is a time without a date (put the date"},
                          Case{"2026-12-24 ", " CET", "names the zone 'CET', which has"},
                          Case{"2026-12-24T", "CET", "names the zone 'CET', which has"},
                          Case{"2026-12-24 ", " PM", "is a time of a 12-hour clock (write"}}) {
    const std::string file = table(50, [&](int i) { return clock_of(i, one.before, one.after); });
    for (const char* exclude : {"", "exclude = [\"invalid\"]\n"}) {
      const std::string said = refusal({file}, map_in("iso", exclude));
      EXPECT_HAS(said, one.said);
      EXPECT_HAS(said, "a.csv:2: t: ");
      EXPECT_EQ(said.find("exclude"), std::string::npos) << said;
      EXPECT_HAS(refusal({file}, map_in("s", exclude)), one.said);
    }
  }
}

TEST_F(TableTrouble, TheCommandsOfTheRefusalsMakeTablesThatAreRead) {
  const auto rewritten = [&](const std::string& file) {
    const std::string said = refusal({file}, map_in("iso"));
    const std::size_t at = said.find("sed ");
    EXPECT_NE(at, std::string::npos) << said;
    const std::string command = said.substr(at, said.find(" FILE > NEW") - at) + " '" + file +
                                "' > '" + path("new.csv") + "'";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    return imported({path("new.csv")}, map_in("iso")).begin_ns;
  };
  EXPECT_EQ(rewritten(table(50, [](int i) { return clock_of(i, "2026-12-24 ", " CET"); })),
            kNoon_ns - 3'600'000'000'000);
  EXPECT_EQ(rewritten(table(50, [](int i) { return clock_of(i, "", ""); })) % 86'400'000'000'000,
            43'200'000'000'000);
}

TEST_F(TableTrouble, WhereEveryRowFailsLeavingRowsOutIsNoAdvice) {
  const std::string invalid = "exclude = [\"invalid\"]\n", ragged = "exclude = [\"ragged\"]\n";
  const std::string words = table(20, [](int i) { return "row" + std::to_string(i); });
  for (const std::string& exclude : {std::string(), invalid})
    EXPECT_HAS(refusal({words}, map_in("s", exclude)),
               "a.csv:2: t: this time is no number (no row has one: are column and unit");
  const std::string one = table(20, [](int i) { return i == 3 ? "x" : seconds(i); });
  EXPECT_HAS(refusal({one}, map_in("s")),
             "a.csv:5: t: this time is no number (mend the file, or "
             "leave such rows out by exclude = [\"invalid\"])");
  EXPECT_EQ(imported({one}, map_in("s", invalid)).excluded.invalid, 1U);
  const std::string late = table(20, [](int i) { return i < 15 ? seconds(i) : "x"; });
  EXPECT_HAS(refusal({late}, map_in("s")), "exclude = [\"invalid\"]");
  const std::string torque = "[torque]\ncolumns = [\"u1\", \"u2\"]\nunit = \"Nm\"\n";
  const std::string empty = table(20, seconds, ",u1,u2", [](int) { return ",,1"; });
  EXPECT_HAS(refusal({empty}, map_in("s", invalid, "[csv]\nsparse = false\n" + torque)),
             "a.csv:2: u1: this cell is empty or not finite (no row is without such a cell");
  const std::string wide = table(20, seconds, "", [](int) { return ",1,2"; });
  EXPECT_HAS(refusal({wide}, map_in("s", ragged)),
             "a.csv:2: has 5 cells, the others have 3 (no row has as many");
}

// "the recording has a sample every 1.000000 s (are [time] unit and period_s right?)", of
// temperatures beside positions, and nothing in the map helped.
TEST_F(TableTrouble, ASlowColumnHasItsOwnTimesAndKeepsNothingBack) {
  const std::string temperature = "[temperature]\ncolumns = [\"T1\", \"T2\"]\nunit = \"C\"\n";
  const auto slow = [](int i) {
    return i >= 50 && i <= 350 && i % 100 == 50 ? row_of(i) : std::string(",,");
  };
  const std::string file = table(501, seconds, ",T1,T2", slow);
  for (const std::string& csv : {std::string(), std::string("[csv]\nsparse = true\n")}) {
    const ImportSummary done = imported({file}, map_in("s", {}, temperature + csv));
    EXPECT_EQ(done.cycles, 501U) << "those of the positions";
    ASSERT_EQ(done.series.size(), 2U);
    EXPECT_EQ(done.series[1].name, "column T1 and 1 other");
    EXPECT_EQ(done.series[1].rows, 4U);
    EXPECT_EQ(done.series[1].median_ns, 1'000'000'000);
    const TimeSeries read = Import::table({{"position_rad", 0}, {"temperature_c", 0}});
    const auto& warm = read.columns[1];
    ASSERT_EQ(warm.size(), 501U);
    EXPECT_NEAR(read.columns[0][500], q1(500), 1e-12);
    EXPECT_TRUE(std::isnan(warm[49])) << "before its first sample";
    EXPECT_EQ(warm[50], 50.0);
    EXPECT_NEAR(warm[100], 100.0, 1e-9) << "on the line between two";
    EXPECT_EQ(warm[350], 350.0);
  }
}

TEST_F(TableTrouble, ASlowColumnHasItsOwnGaps) {
  const std::string temperature = "[temperature]\ncolumns = [\"T1\", \"T2\"]\nunit = \"C\"\n";
  const auto slow = [](int i) { return i % 100 == 0 ? row_of(i) : std::string(",,"); };
  const std::string file = table(501, seconds, ",T1,T2", slow);
  std::string map = map_in("s", {}, temperature);
  map.replace(map.find("period_s"), 0, "max_gap_s = 0.05\n");
  EXPECT_EQ(imported({file}, map).cycles, 501U) << "max_gap_s is of the positions";
  const std::string once =
      table(501, seconds, ",T1,T2", [](int i) { return i == 7 ? row_of(i) : std::string(",,"); });
  EXPECT_EQ(imported({once}, map).cycles, 501U);
  EXPECT_EQ(Import::table({{"temperature_c", 1}}).columns[0][7], 8.0);
  const auto pause = [](int i) {
    return i % 10 == 0 && (i < 100 || i > 300) ? row_of(i) : std::string(",,");
  };
  const std::string gap = table(501, seconds, ",T1,T2", pause);
  EXPECT_HAS(refusal({gap}, map_in("s", {}, temperature)), "nothing was recorded for 2.2");
  const ImportSummary done = imported({gap}, map_in("s", "exclude = [\"gaps\"]\n", temperature));
  EXPECT_EQ(done.cycles, 501U) << "the positions have none";
  EXPECT_TRUE(std::isnan(Import::table({{"temperature_c", 0}}).columns[0][200]));
}

TEST_F(TableTrouble, APeriodThatIsNotThePositionsNamesTheirColumn) {
  const std::string file = table(50, [](int i) { return std::to_string(i); });
  EXPECT_HAS(refusal({file}, map_in("s")),
             "map.toml: time.period_s: a cycle of the log is 0.010000 s, and 'q1' has a sample "
             "every 1.000000 s");
}

// "the robot has no joint 'finger' (did you mean …?)", and beside it another joint's unit was said
// to be wrong. Tandem's own /joint_states has them.
TEST_F(TableTrouble, ColumnsOfJointsThatFollowAreKnownAndNotUsed) {
  robot_.followers = {{"finger", 1, 1.0, 0.0}};
  const std::string file =
      table(100, seconds, ",finger", [](int i) { return "," + number(0.001 * i); });
  const ImportSummary bare = imported({file}, map_in("s"));
  EXPECT_EQ(bare.excluded.ignored, std::vector<std::string>{"finger"});
  const auto listed = [](const std::string& joints, const std::string& columns,
                         const std::string& unit) {
    return "joints = [" + joints + "]\n[time]\ncolumn = \"t\"\nunit = \"s\"\nperiod_s = 0.01\n" +
           "[position]\ncolumns = [" + columns + "]\nunit = " + unit + "\n";
  };
  const ImportSummary done =
      imported({file}, listed("\"joint1\", \"finger\", \"joint2\"", "\"q1\", \"finger\", \"q2\"",
                              "[\"rad\", \"m\", \"rad\"]\nscale = [1, 7, 2]"));
  EXPECT_EQ(done.excluded.ignored, std::vector<std::string>{"finger"});
  EXPECT_NEAR(Import::table({{"position_rad", 1}}).columns[0][50], 2.0 * q2(50), 1e-12)
      << "each number stays with its joint";
  EXPECT_HAS(refusal({file}, listed("\"joint1\", \"finger\", \"joint2\"",
                                    "\"q1\", \"fingr\", \"q2\"", "[\"rad\", \"m\", \"rad\"]")),
             "the recording has no column 'fingr' (did you mean 'finger'?)");
  EXPECT_HAS(refusal({file}, "[missing_joints]\nfinger = 0.1\n"),
             "missing_joints.finger: the joint 'finger' follows 'joint2' (mimic)");
  // One misspelt joint is one error, whatever the units are.
  const auto wrong =
      import({file}, listed("\"joint1\", \"joint2\", \"fingr\"", "\"q1\", \"q2\", \"finger\"",
                            "[\"rad\", \"rad\", \"m\"]"));
  ASSERT_FALSE(wrong);
  ASSERT_EQ(wrong.error().size(), 1U) << wrong.error()[1].to_string();
  EXPECT_HAS(wrong.error()[0].to_string(), "the robot has no joint 'fingr'");
}

// "has more than 4096 columns", or "no column 't' (did you mean '['?)".
TEST_F(TableTrouble, JsonAndArchivesAreCalledWhatTheyAre) {
  std::string list, lines;
  for (int i = 0; i < 30; ++i) {
    const std::string one =
        "{\"t\": " + seconds(i) + ", \"q1\": " + number(q1(i)) + ", \"q2\": " + number(q2(i)) + "}";
    list += (i == 0 ? "[\n " : ",\n ") + one;
    lines += one + "\n";
  }
  for (const std::string& text :
       {list + "]\n", lines, "\n" + lines, std::string("[[0, 1, 2], [1, 1, 2]]\n")})
    EXPECT_HAS(refusal({write("a.json", text)}, map_in("s")), "a.json: is JSON, and no table (");
  EXPECT_HAS(refusal({write("a.xlsx", "PK\x03\x04 and so on")}, map_in("s")),
             "a.xlsx: is a ZIP archive, as spreadsheets");
  const std::string bracketed = "[t],[q1],[q2]\n0,1,1\n";
  EXPECT_HAS(refusal({write("b.csv", bracketed)}, map_in("s")), "has no column 't'");
}

}  // namespace
}  // namespace tandem::log
