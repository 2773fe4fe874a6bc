// Tables as plotters, instruments and spreadsheets write them.
#include <numbers>

#include "base/bounds.hpp"
#include "log/import/csv_rows.hpp"
#include "tests/log_import/rig.hpp"

namespace tandem::log {
namespace {

using namespace test;

std::string map_of(const std::string& unit = "s", const std::string& position = "unit = \"rad\"",
                   const std::string& more = {}) {
  return more + "joints = [\"joint1\", \"joint2\"]\n[time]\ncolumn = \"t\"\nunit = \"" + unit +
         "\"\nperiod_s = 0.01\n[position]\ncolumns = \"q{1}\"\n" + position + "\n";
}

class StrangeTable : public Import {
 protected:
  /// "t,q1,q2" rows.
  std::string rows(int count, const std::function<std::string(int)>& of) const {
    std::string text = "t,q1,q2\n";
    for (int i = 0; i < count; ++i) text += of(i) + "\n";
    return write("a.csv", text);
  }
};

std::string row(const char* format, auto... values) {
  char text[256];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

// Every row was refused, or left out. source: PlotJuggler/plotjuggler-ros-plugins #93
TEST_F(StrangeTable, OfEmptyCellsHasASeriesForEachColumn) {
  const auto of = [](int i) {
    return i % 2 == 0 ? row("%.3f,%.17g,", 0.005 * i, std::sin(0.005 * i))
                      : row("%.3f,,%.17g", 0.005 * i, std::cos(0.005 * i));
  };
  const std::string file = rows(101, of);
  for (const char* more : {"", "exclude = [\"invalid\"]\n"}) {
    const ImportSummary done = imported({file}, map_of("s", "unit = \"rad\"", more));
    EXPECT_EQ(done.cycles, 50U) << "from the first time of q2 to its last";
    EXPECT_EQ(done.excluded.invalid, 0U);
    ASSERT_EQ(done.series.size(), 2U);
    EXPECT_EQ(done.series[0].rows, 51U);
    EXPECT_EQ(done.series[1].name, "column q2");
    ASSERT_EQ(done.notes.size(), 1U);
    const TimeSeries read = table({{"position_rad", 0}, {"position_rad", 1}});
    for (int i = 0; i < 50; ++i) {
      const double t = 0.005 + 0.01 * i;
      EXPECT_NEAR(read.columns[0][i], std::sin(t), 2e-5) << "on the line between two samples";
      EXPECT_EQ(read.columns[1][i], std::cos(0.005 * (2 * i + 1)));
    }
  }
}

TEST_F(StrangeTable, OfFewEmptyCellsAsksWhatTheyAre) {
  const auto of = [](int i) {
    return i == 7 ? row("%.2f,%.17g,", 0.01 * i, std::sin(0.01 * i))
                  : row("%.2f,%.17g,%.17g", 0.01 * i, std::sin(0.01 * i), std::cos(0.01 * i));
  };
  const std::string file = rows(50, of);
  EXPECT_HAS(refusal({file}, map_of()), "a.csv:9: q2: this cell is empty or not finite");
  EXPECT_HAS(refusal({file}, map_of()), "sparse = true in [csv]");
  const ImportSummary done = imported({file}, map_of() + "[csv]\nsparse = true\n");
  EXPECT_EQ(done.series.at(0).rows, 50U);
  EXPECT_EQ(done.series.at(1).rows, 49U);
  EXPECT_HAS(
      refusal({rows(50, [](int i) { return row("%.2f,%.3f,", 0.01 * i, 0.01 * i); })}, map_of()),
      "a.csv: q2: has no number");
}

// "has no column 'q1 [°]' (did you mean 'q1 [\xb0]'?)": neither read nor refused.
// source: Weidmueller's and Lenze's exports in libedssharp #70, PlotJuggler #509
TEST_F(StrangeTable, InLatin1IsRead) {
  std::string text = "t,q1 [\xB0],q2 [\xB0]\n";
  for (int i = 0; i < 20; ++i) text += row("%.2f,%d,%d\n", 0.01 * i, i, 2 * i);
  const std::string file = write("a.csv", text);
  std::string map = map_of("s", "unit = \"deg\"");
  map.replace(map.find("q{1}"), 4, "q{1} [°]");
  const ImportSummary done = imported({file}, map);
  EXPECT_EQ(done.notes, std::vector<std::string>{file + " is no UTF-8: taken for Latin-1"});
  EXPECT_NEAR(table({{"position_rad", 1}}).columns[0][9], 18 * std::numbers::pi / 180, 1e-15);
  EXPECT_HAS(refusal({write("b.csv", std::string("\xFF\xFEt\0,\0", 6))}, map),
             "b.csv: is in UTF-16 (convert it: iconv -f UTF-16 -t UTF-8");
}

// source: facontidavide/PlotJuggler #1110
TEST_F(StrangeTable, WhoseTimesAreDatesIsRead) {
  const auto of = [](int i) {
    return row("2024-02-29T23:59:%02d.%03dZ,%.3f,%.3f", 59 - (i < 50 ? 1 : 0),
               (i * 10 + 500) % 1000, 0.01 * i, 0.02 * i);
  };
  const std::string file = rows(100, of);
  EXPECT_HAS(refusal({file}, map_of()),
             "a.csv:2: t: this time is a date (say unit = \"iso\" in [time] of the map)");
  const ImportSummary done = imported({file}, map_of("iso"));
  EXPECT_EQ(done.cycles, 100U);
  EXPECT_EQ(done.begin_ns, 1'709'251'198'500'000'000);  // date -u -d 2024-02-29T23:59:58.5Z +%s
  EXPECT_HAS(refusal({rows(20, [](int i) { return row("%d,1,2", i); })}, map_of("iso")),
             "a.csv:2: t: this time is no date of ISO 8601, such as 2026-11-26T22:02:12.5Z");
}

// "is no date" was all that was said, and nothing of which of the two it is.
TEST_F(StrangeTable, OfDatesWithSlashesIsRefusedWithTheCommandThatRewritesThem) {
  const auto of = [](int i) {
    return row("3/11/2026 12:00:00.%02d,%.17g,%.17g", i, std::sin(0.01 * i), std::cos(0.01 * i));
  };
  const std::string file = rows(99, of);
  for (const char* unit : {"iso", "s"})
    EXPECT_HAS(refusal({file}, map_of(unit)),
               "a.csv:2: t: '3/11/2026 12:00:00.00' is no date that");
  const std::string said = refusal({file}, map_of("iso"));
  const std::string new_file = write("new.csv", "");
  std::vector<std::int64_t> begins;
  for (std::size_t at = said.find("sed -E '"); at != std::string::npos;
       at = said.find("sed -E '", at + 1)) {
    const std::string command = said.substr(at, said.find(" FILE > NEW", at) - at);
    ASSERT_EQ(std::system((command + " '" + file + "' > '" + new_file + "'").c_str()), 0)
        << command;
    begins.push_back(imported({new_file}, map_of("iso")).begin_ns);
  }
  EXPECT_EQ(begins,
            (std::vector{*date_time_ns("2026-11-03T12:00Z"), *date_time_ns("2026-03-11T12:00Z")}));
}

// source: file.csv.gz, which every logging program can write; it was "decompress it: gunzip"
TEST_F(StrangeTable, InGzipIsRead) {
  const auto of = [](int i) {
    return row("%.2f,%.17g,%.17g", 0.01 * i, std::sin(0.01 * i), std::cos(0.01 * i));
  };
  const std::string file = rows(5000, of);
  ASSERT_EQ(std::system(("gzip -nk '" + file + "' && head -c 2000 '" + file + ".gz' > '" + file +
                         ".cut.gz' && gzip -c '" + file + ".gz' > '" + file + ".twice.gz'")
                            .c_str()),
            0);
  const ImportSummary plain = imported({file}, map_of());
  const ImportSummary done = imported({file + ".gz"}, map_of());
  EXPECT_EQ(done.cycles, 5000U);
  EXPECT_EQ(done.cycles, plain.cycles);
  EXPECT_HAS(refusal({file + ".cut.gz"}, map_of()), "its compressed data are damaged or cut");
  EXPECT_HAS(refusal({file + ".twice.gz"}, map_of()), "is compressed twice");
  // Members one after the other, as appending programs leave them; far more than it is.
  ASSERT_EQ(std::system(("cd '" + path("") +
                         "' && head -n 100 a.csv | gzip > m.gz && tail -n +101 a.csv | "
                         "gzip >> m.gz && head -c 300000000 /dev/zero | gzip > zeros.gz")
                            .c_str()),
            0);
  EXPECT_EQ(imported({path("m.gz")}, map_of()).cycles, 5000U);
  EXPECT_HAS(refusal({path("zeros.gz")}, map_of()), "zeros.gz: has more than 500 times its size");
}

TEST(IsoTime, IsReadAsPeopleWriteIt) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  constexpr std::int64_t kNoon = 1'700'049'600 * kSecond;  // date -u -d 2023-11-15T12:00:00Z +%s
  for (const char* text :
       {"2023-11-15T12:00:00Z", "2023-11-15 12:00:00", "2023-11-15T12:00", "2023-11-15t12:00:00z",
        "2023-11-15T13:00:00+01:00", "2023-11-15 06:30:00.000 -0530", "2023-11-15T14:00+02",
        "2023/11/15 12:00:00", "15.11.2023 12:00:00", "15.11.2023 12:00",
        "15.11.2023T13:00:00.0+01:00"}) {
    EXPECT_EQ(date_time_ns(text), kNoon) << text;
  }
  EXPECT_EQ(date_time_ns("2023-11-15T12:00:00.123456789Z"), kNoon + 123'456'789);
  EXPECT_EQ(date_time_ns("2023-11-15T12:00:00,5"), kNoon + 500'000'000);
  EXPECT_EQ(date_time_ns("2023-11-15T12:00:00.1234567899999"), kNoon + 123'456'789);
  EXPECT_EQ(date_time_ns("5.1.2024 00:00"), date_time_ns("2024-01-05T00:00Z"));
  EXPECT_EQ(date_time_ns("1969-12-31T23:59:59.5Z"), -500'000'000);
  for (const char* text :
       {"", "1.5", "2023-11-15", "2023-02-30T12:00:00Z", "2023-11-15T25:00:00Z", "15.13.2023 12:00",
        "15.11.23 12:00", "11/15/2023 12:00", "2023-11-15T12:00:00Zx", "2023-11-15T12:00:00+",
        "99999-11-15T12:00:00", "2023-11-15T12:0a"}) {
    EXPECT_FALSE(date_time_ns(text)) << text;
  }
}

// "unwrap it" was the advice, and nothing in Tandem did. source: vedderb/bldc #319
TEST_F(StrangeTable, AnglesWithinATurnGoOn) {
  const auto wrapped = [](double angle) { return angle - 360 * std::floor(angle / 360); };
  const auto of = [&](int i) {
    return row("%.2f,%.9g,%.9g", 0.01 * i, wrapped(-30 + 1.5 * i), wrapped(20 - 2.0 * i));
  };
  const std::string file = rows(100, of);
  EXPECT_HAS(refusal({file}, map_of("s", "unit = \"deg\"")),
             "its number was kept within a turn: say unwrap = true in [position] of ");
  imported({file}, map_of("s", "unit = \"deg\"\nunwrap = true"));
  const TimeSeries read = table({{"position_rad", 0}, {"position_rad", 1}});
  constexpr double kDegree = std::numbers::pi / 180;
  for (int i = 0; i < 100; ++i) {
    EXPECT_NEAR(read.columns[0][i], (-30 + 1.5 * i) * kDegree, 1e-8) << "330 deg is -30 deg here";
    EXPECT_NEAR(read.columns[1][i], (20 - 2.0 * i) * kDegree, 1e-8);
  }
}

// Limits that nobody knows made every position NaN.
TEST_F(StrangeTable, AnglesOfAJointWithoutLimitsGoOn) {
  robot_.joints[0].min_position_rad = robot_.joints[0].max_position_rad =
      std::numeric_limits<double>::quiet_NaN();
  robot_.joints[1].min_position_rad = -std::numeric_limits<double>::infinity();
  robot_.joints[1].max_position_rad = std::numeric_limits<double>::infinity();
  const auto of = [](int i) {
    return row("%.2f,%.9g,%.9g", 0.01 * i, std::remainder(0.05 * i, 2 * std::numbers::pi),
               std::remainder(-0.05 * i, 2 * std::numbers::pi));
  };
  imported({rows(100, of)}, map_of("s", "unit = \"rad\"\nunwrap = true"));
  const TimeSeries read = table({{"position_rad", 0}, {"position_rad", 1}});
  EXPECT_NEAR(read.columns[0][99], 0.05 * 99, 1e-8);
  EXPECT_NEAR(read.columns[1][99], -0.05 * 99, 1e-8);
}

TEST_F(StrangeTable, OfMoreColumnsThanAnyProgramWritesIsRefused) {
  const auto header = [](std::size_t columns) {
    std::string text = "t";
    for (std::size_t i = 1; i < columns; ++i) text += ",c" + std::to_string(i);
    return text + "\n";
  };
  EXPECT_TRUE(CsvRows::open(header(bounds::kCsvColumns.most), "a.csv", {}));
  EXPECT_EQ(CsvRows::open(header(bounds::kCsvColumns.most + 1), "a.csv", {}).error().to_string(),
            "a.csv:1: has more than 4096 columns (no more is read)");
}

TEST_F(StrangeTable, OfFarMoreCyclesThanSamplesIsRefused) {
  const auto of = [](int i) {
    return row("%.2f,%.3f,%.3f", i < 11 ? 0.01 * i : 2000.0, 0.01 * i, 0.02 * i);
  };
  const std::string gap = "max_gap_s = 1e5\n[position]";
  std::string map = map_of();
  map.replace(map.find("[position]"), 10, gap);
  EXPECT_HAS(refusal({rows(12, of)}, map),
             "the recording has 200001 cycles of 0.010000 s for 12 samples");
}

}  // namespace
}  // namespace tandem::log
