// Tables of text with the quirks of those that people publish.
#include <algorithm>
#include <cstdlib>
#include <numbers>

#include "tests/log_import/rig.hpp"

namespace tandem::log {
namespace {

using namespace test;

const char kPlain[] = R"(
joints = ["joint1", "joint2"]
[time]
column = "t"
unit = "s"
period_s = 0.01
[position]
columns = "q{1}"
unit = "rad"
[velocity]
columns = "dq{1}"
unit = "rad/s"
[torque]
columns = "tau{1}"
unit = "Nm"
)";

/// t, q, dq, tau of two joints, 100 Hz, with something changed in each row.
std::string plain_rows(int rows, const std::function<std::string(int, std::string)>& change = {}) {
  std::string text = "t,q1,q2,dq1,dq2,tau1,tau2\n";
  for (int i = 0; i < rows; ++i) {
    const double t = 0.01 * i;
    char row[256];
    std::snprintf(row, sizeof row, "%.2f,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g", t, std::sin(t),
                  std::cos(t), std::cos(t), -std::sin(t), 2 * t, 0.5 - t);
    text += (change ? change(i, row) : std::string(row)) + "\n";
  }
  return text;
}

class Csv : public Import {};

// It was "no column 't'", with the nearest name.
TEST_F(Csv, OfAnotherDelimiterIsToldWhichKeySaysSo) {
  std::string rows = plain_rows(5);
  std::ranges::replace(rows, ',', ';');
  EXPECT_NE(refusal({write("a.csv", rows)}, kPlain)
                .find("the recording has no column 't' (its header is one column, "
                      "'t;q1;q2;dq1;dq2;tau1;tau2': say delimiter = \"semicolon\" in [csv] of the "
                      "map)"),
            std::string::npos);
}

TEST_F(Csv, GivesItsNumbersBitForBit) {
  const ImportSummary done = imported({write("a.csv", plain_rows(50))}, kPlain);
  EXPECT_EQ(done.cycles, 50U);
  EXPECT_EQ(done.series.at(0).median_ns, 10'000'000);
  const TimeSeries read = table({{"position_rad", 0},
                                 {"position_rad", 1},
                                 {"velocity_rad_s", 1},
                                 {"torque_nm", 0},
                                 {"motor_position_rad", 0},
                                 {"age_cycles", 0}});
  ASSERT_EQ(read.time_s.size(), 50U);
  for (int i = 0; i < 50; ++i) {
    const double t = 0.01 * i;
    EXPECT_EQ(read.columns[0][i], std::sin(t));
    EXPECT_EQ(read.columns[1][i], std::cos(t));
    EXPECT_EQ(read.columns[2][i], -std::sin(t));
    EXPECT_EQ(read.columns[3][i], 2 * t);
    EXPECT_TRUE(std::isnan(read.columns[4][i])) << "nothing was recorded of it";
    EXPECT_EQ(read.columns[5][i], 0.0);
  }
}

TEST_F(Csv, AColumnIsOneNumbers) {
  const std::string file = write("a.csv", plain_rows(50));
  std::string map = kPlain;
  EXPECT_EQ(refusal({file}, map + "[current]\ncolumns = \"tau{1}\"\nunit = \"A\"\n"),
            "map.toml:16: current.columns: the column 'tau1' is used twice (a column is one "
            "number's: leave one of the two out)");
  map.replace(map.find("q{1}"), 4, "t{1}");
  map.replace(map.find("t{1}"), 4, "q{1}");
  EXPECT_HAS(
      refusal({file},
              "ignore = [\"*\"]\n" + map +
                  "[sensor.ft]\ncolumns = [\"t\", \"dq1\", \"a\", \"b\", \"c\", \"d\"]\nforce_unit "
                  "= \"N\"\nmoment_unit = \"Nm\"\nmeasures = \"child_on_parent\"\n"),
      "the column 't' is used twice");
}

// They were taken for tables, and bytes of theirs printed to the terminal.
TEST_F(Csv, OfBytesIsRefused) {
  const std::string noise("\x01\x02\x03\xFF\x00q1,\x1B[2J\n", 14);
  EXPECT_EQ(refusal({write("a.mcap", noise)}, kPlain),
            "a.mcap: is no MCAP file: it does not begin as one (give the bag's .mcap file; a table "
            "needs another ending)");
  EXPECT_EQ(refusal({write("b.mcap", "")}, "[bag]\nstamp = \"log\"\n"),
            "b.mcap: is empty (give the bag's .mcap file; a table needs another ending)");
  EXPECT_EQ(refusal({write("a.csv", "t,q1\n0," + std::string(1, '\0'))}, kPlain),
            "a.csv: is no text: byte 7 is no character (give a table in UTF-8, Latin-1 or ASCII, "
            "or a bag in "
            "MCAP)");
  EXPECT_HAS(refusal({write("c.csv", "t,q1\x1B[2J\n")}, kPlain), "is no text: byte 4");
}

TEST_F(Csv, IsTheSameLogTwice) {
  const std::string file = write("a.csv", plain_rows(50));
  const ImportSummary first = imported({file}, kPlain);
  EXPECT_EQ(imported({file}, kPlain).log.data_sha256, first.log.data_sha256);
}

TEST_F(Csv, UnitsScalesAndJointOrderAreTheMaps) {
  const std::string map = R"(
joints = ["joint2", "joint1"]
[time]
column = "ms"
unit = "ms"
period_s = 0.01
[position]
columns = ["a", "b"]
unit = ["deg", "raw"]
scale = [1.0, 0.001]
offset = [0.5, 0.0]
[velocity]
columns = ["va", "vb"]
unit = "rpm"
[torque]
columns = ["ia", "ib"]
unit = "raw"
scale = [14.87, -13.26]
[motor_position]
columns = ["ca", "cb"]
unit = "raw"
counts_per_turn = [4096]
)";
  imported({write("a.csv",
                  "\xEF\xBB\xBF ms ; a;b;va;vb;ia;ib;ca;cb\r\n"
                  "1000;90;500;60;-60;1;2;4096;-1024\r\n"
                  "1010;91;501;61;-61;2;3;4097;-1025\r\n")},
           map + "[csv]\ndelimiter = \"semicolon\"\n");
  const TimeSeries read = table({{"position_rad", 0},
                                 {"position_rad", 1},
                                 {"velocity_rad_s", 0},
                                 {"velocity_rad_s", 1},
                                 {"torque_nm", 0},
                                 {"torque_nm", 1},
                                 {"motor_position_rad", 1},
                                 {"motor_position_rad", 0}});
  constexpr double kPi = std::numbers::pi;
  const std::vector<double> expected{0.5,    kPi / 2 + 0.5, -2 * kPi, 2 * kPi,
                                     -26.52, 14.87,         2 * kPi,  -kPi / 2};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(read.columns[i][0], expected[i], 1e-14) << i;
  }
  EXPECT_EQ(read.time_s[0], 0.0);
}

// Degrees, swapped columns and an opposite sign were imported without a word.
TEST_F(Csv, AVelocityIsTheRateOfItsPosition) {
  const std::string file = write("a.csv", plain_rows(200));
  const auto with = [](const std::string& line, const std::string& by) {
    std::string map = kPlain;
    return map.replace(map.find(line), line.size(), by);
  };
  EXPECT_HAS(refusal({file}, with("unit = \"rad/s\"", "unit = \"deg/s\"")),
             "a.csv: dq1: the velocity of 'joint1' (column dq1) is 0.0175 times the rate of its "
             "position (column q1) (are units, signs and the order of the columns right in "
             "map.toml?");
  EXPECT_HAS(refusal({file}, with("unit = \"rad/s\"", "unit = \"rad/s\"\nscale = [1.0, -1.0]")),
             "the velocity of 'joint2' (column dq2) is -1 times the rate");
  EXPECT_HAS(refusal({file}, with("\"q{1}\"", "[\"q2\", \"q1\"]")),
             "the velocity of 'joint1' (column dq1)");
}

// Both were imported, and identified with confidence.
TEST_F(Csv, AWrappedPositionAndAnImpossibleTorqueAreRefused) {
  const auto at = [](int row, const std::string& text) {
    return plain_rows(50, [=](int i, std::string line) { return i == row ? text : line; });
  };
  EXPECT_HAS(
      refusal({write("a.csv", at(30, "0.30,-5.9877,0.955,0.955,-0.3,0.6,0.2"))}, kPlain),
      "a.csv:32: rows: q1 leaps by 6.274 rad, a turn: 'joint1' does not (its number was kept "
      "within a turn: say unwrap = true in [position] of map.toml");
  EXPECT_HAS(refusal({write("b.csv", at(30, "0.30,0.2955,0.955,0.955,-0.3,1e30,0.2"))}, kPlain),
             "b.csv:32: rows: tau1 is 1e+30 Nm; 'joint1' has ");
}

/// Columns of the UR10e files: t, q(6), dq(6), i(6), i_desired(6), torque_desired(6), no header.
TEST_F(Csv, WithoutHeaderNamesItsColumnsByNumber) {
  std::string text;
  for (int i = 0; i < 20; ++i) {
    char row[200];
    std::snprintf(row, sizeof row, "%.4f %g %g  %g %g\t%g %g 7 7\n", 0.008 * i, 0.001 * i,
                  -0.002 * i, 0.125 + 1e-5 * i, -0.25 + 1e-5 * i, 0.5 * i, 0.25 * i);
    text += row;
  }
  const std::string map = R"(
joints = ["joint1", "joint2"]
ignore = ["c8", "c9"]
[csv]
header = false
delimiter = "blank"
[time]
column = "c1"
unit = "s"
period_s = 0.008
[position]
columns = ["c2", "c3"]
unit = "rad"
[velocity]
columns = ["c4", "c5"]
unit = "rad/s"
[current]
columns = ["c6", "c7"]
unit = "A"
)";
  const ImportSummary done = imported({write("30sec_12harm.txt", text)}, map);
  EXPECT_EQ(done.cycles, 20U);
  EXPECT_EQ(done.excluded.ignored, (std::vector<std::string>{"c8", "c9"}));
  EXPECT_NEAR(table({{"current_a", 1}}).columns[0][4], 1.0, 1e-12);
}

/// The Panda's recordings: q, dq and torque in files of their own, a row each millisecond, no time.
TEST_F(Csv, FilesSideBySideWithoutTimeAreRows) {
  std::string q, tau;
  for (int i = 0; i < 30; ++i) {
    q += std::to_string(0.01 * i) + "," + std::to_string(1 - 0.01 * i) + "\n";
    tau += std::to_string(2.0 * i) + "," + std::to_string(3.0 - i) + "\n";
  }
  const std::string map = R"(
joints = ["joint1", "joint2"]
[csv]
header = false
[time]
by_rows = true
period_s = 0.001
[position]
columns = "q.c{1}"
unit = "rad"
[torque]
columns = "tau.c{1}"
unit = "Nm"
)";
  const auto files = std::vector{write("q.csv", q), write("tau.csv", tau)};
  EXPECT_EQ(imported(files, map).cycles, 30U);
  const TimeSeries read = table({{"torque_nm", 1}});
  EXPECT_EQ(read.columns[0][10], -7.0);
  EXPECT_NEAR(read.time_s[10], 0.010, 1e-15);
  EXPECT_HAS(refusal({files[0], write("tau.csv", tau + "1,2\n")}, map),
             "different numbers of rows");
}

TEST_F(Csv, CommentsDecimalCommasAndATrailingDelimiterAreRead) {
  const std::string map = R"(
joints = ["joint1", "joint2"]
[csv]
delimiter = "semicolon"
decimal_comma = true
comment = "%"
skip_lines = 1
[time]
column = "Time"
unit = "us"
period_s = 0.001
[position]
columns = ["left hip", "right hip"]
unit = "deg"
)";
  imported({write("a.csv",
                  "exported by a program\n% comment\n\"Time\";\"left hip\";\"right hip\";\n"
                  "0;0,5;+1,5e1;\n1000;0,6;16;\n\n2000;0,7;17;\n")},
           map);
  EXPECT_NEAR(table({{"position_rad", 1}}).columns[0][1], 16 * std::numbers::pi / 180, 1e-15);
}

TEST_F(Csv, IsPutOnTheCyclesOfTheLog) {
  // Jittered, 100 Hz, of a straight line: at every millisecond the line comes out.
  std::string text = "t,q1,q2\n";
  for (int i = 0; i < 40; ++i) {
    const double t = 1e9 + 0.01 * i + (i % 3 == 1 ? 0.002 : 0.0);
    char row[100];
    std::snprintf(row, sizeof row, "%.6f,%.17g,%.17g\n", t, t - 1e9, 5 - 2 * (t - 1e9));
    text += row;
  }
  const std::string map = R"(
joints = ["joint1", "joint2"]
[time]
column = "t"
unit = "s"
period_s = 0.001
[position]
columns = "q{1}"
unit = "rad"
)";
  const std::string file = write("a.csv", text);
  const ImportSummary linear = imported({file}, map);
  EXPECT_EQ(linear.begin_ns, 1'000'000'000'000'000'000);
  TimeSeries read = table({{"position_rad", 0}, {"position_rad", 1}});
  ASSERT_EQ(read.time_s.size(), 391U);
  for (std::size_t i = 0; i < read.time_s.size(); ++i) {
    EXPECT_NEAR(read.columns[0][i], 0.001 * static_cast<double>(i), 2e-7);
    EXPECT_NEAR(read.columns[1][i], 5 - 0.002 * static_cast<double>(i), 4e-7);
  }
  std::string held = map;
  held.insert(held.find("[position]"), "sampling = \"previous\"\n");
  imported({file}, held);
  read = table({{"position_rad", 0}, {"age_cycles", 0}});
  EXPECT_EQ(read.columns[1][11], 11.0) << "its sample is of time 0";
  EXPECT_EQ(read.columns[1][12], 0.0);
  EXPECT_EQ(read.columns[0][11], 0.0);
}

TEST_F(Csv, CommandsSensorsAndMissingJointsAreDeclared) {
  robot_.joints[0].max_position_rad = 20.0;
  const std::string map = R"(
joints = ["joint1"]
[missing_joints]
joint2 = 0.25
[time]
column = "t"
unit = "s"
period_s = 0.01
[position]
columns = ["q"]
unit = "rad"
[command]
mode = "position"
[command.position]
columns = ["r"]
unit = "rad"
[sensor.imu]
columns = ["w", "x", "y", "z", "gx", "gy", "gz", "ax", "ay", "az"]
orientation = "wxyz"
rate_unit = "deg/s"
force_unit = "g"
[sensor.ft]
columns = ["fx", "fy", "fz", "mx", "my", "mz"]
measures = "parent_on_child"
force_unit = "N"
moment_unit = "mNm"
)";
  std::string text = "t,q,r,w,x,y,z,gx,gy,gz,ax,ay,az,fx,fy,fz,mx,my,mz\n";
  for (int i = 0; i < 20; ++i) {
    const std::string s = std::to_string(i);
    text += std::to_string(0.01 * i) + "," + s + ",0.5,1,0,0,0,180," + s + "," + s + "," + s + "," +
            s + ",1," + s + "," + s + ",-300," + s + "," + s + ",1000\n";
  }
  const std::string file = write("a.csv", text);
  const std::string frozen = refusal({file}, map);
  EXPECT_HAS(frozen, "a.csv: fz: never changes in 20 samples");
  const ImportSummary done = imported({file}, "allow_frozen = true\n" + map);
  EXPECT_EQ(done.missing, std::vector<std::string>{"joint2"});
  TimeSeries read = table({{"position_rad", 1},
                           {"sensor", 2},
                           {"sensor", 5},
                           {"sensor", 9},
                           {"sensor", 10},
                           {"sensor", 15}});
  const std::vector<double> expected{0.25, 300.0, -1.0, 1.0, std::numbers::pi, 9.80665};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(read.columns[i][3], expected[i], 1e-15) << i;
  }
  read = table({{"position_rad", 0}, {"mode", 0}, {"position_rad", 1}}, "/tandem/command");
  EXPECT_EQ(read.columns[0][3], 0.5);
  EXPECT_EQ(read.columns[1][3], 1.0);
  EXPECT_TRUE(std::isnan(read.columns[2][3]));
}

TEST_F(Csv, TroubleIsAnErrorWithItsLineOrCounted) {
  struct Case {
    const char* kind;
    std::function<std::string(int, std::string)> change;
    const char* refusal;
    std::uint64_t cycles, left_out;
  };
  const auto replace = [](int at, std::string (*by)(std::string)) {
    return [=](int i, std::string row) { return i == at ? by(std::move(row)) : row; };
  };
  const std::vector<Case> cases{
      {"invalid",
       replace(
           7,
           [](std::string row) { return row.substr(0, 5) + "nan" + row.substr(row.find(',', 5)); }),
       "a.csv:9: q1: this cell is empty or not finite", 50, 1},
      {"ragged", replace(7, [](std::string row) { return row + ",1"; }),
       "a.csv:9: has 8 cells, the others have 7", 50, 1},
      {"duplicates", replace(7, [](std::string row) { return "0.06" + row.substr(4); }),
       "a.csv:9: rows: this time was there before", 50, 1},
      {"backwards", replace(7, [](std::string row) { return "0.02" + row.substr(4); }),
       "a.csv:9: rows: time goes back by 0.040000 s", 50, 1},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(one.kind);
    const std::string file = write("a.csv", plain_rows(50, one.change));
    EXPECT_HAS(refusal({file}, kPlain), one.refusal);
    const ImportSummary done =
        imported({file}, "exclude = [\"" + std::string(one.kind) + "\"]" + kPlain);
    EXPECT_EQ(done.cycles, one.cycles) << "the cycle without a row lies between its neighbours";
    const Exclusions& out = done.excluded;
    EXPECT_EQ(out.invalid + out.ragged + out.duplicates + out.backwards, one.left_out);
    const auto log = LogFile::open(path("out.mcap"));
    EXPECT_EQ(value_of(log->result(), "excluded_" + std::string(one.kind)), "1");
  }
}

TEST_F(Csv, AGapIsAnErrorOrMissingCyclesWithAnEvent) {
  const std::string file = write("a.csv", plain_rows(50, [](int i, std::string row) {
                                   return i > 20 && i < 30 ? std::string() : row;
                                 }));
  EXPECT_HAS(refusal({file}, kPlain), "a.csv:32: rows: nothing was recorded for 0.100000 s");
  const ImportSummary done = imported({file}, std::string("exclude = [\"gaps\"]") + kPlain);
  EXPECT_EQ(done.cycles, 41U);
  EXPECT_EQ(done.excluded.gaps, 1U);
  EXPECT_EQ(done.excluded.gap_cycles, 9U);
  const auto events = LogFile::open(path("out.mcap"))->events();
  ASSERT_EQ(events->size(), 1U);
  EXPECT_EQ(events->front().text, "gap in the recording: 9 cycles missing");
  EXPECT_EQ(events->front().event.cycle, 30U);
}

TEST_F(Csv, AFrozenColumnIsAnErrorOrLeftOut) {
  const std::string file = write("a.csv", plain_rows(50, [](int, std::string row) {
                                   return row.substr(0, row.rfind(',')) + ",0.125";
                                 }));
  EXPECT_HAS(refusal({file}, kPlain), "a.csv: tau2: never changes in 50 samples");
  imported({file}, std::string("allow_frozen = true") + kPlain);
  EXPECT_EQ(table({{"torque_nm", 1}}).columns[0][3], 0.125);
  const ImportSummary done = imported({file}, std::string("exclude = [\"frozen\"]") + kPlain);
  EXPECT_EQ(done.excluded.frozen, std::vector<std::string>{"tau2"});
  EXPECT_TRUE(std::isnan(table({{"torque_nm", 1}}).columns[0][3]));
}

TEST_F(Csv, WhatIsAmbiguousIsAskedForByName) {
  const std::string file = write("a.csv", plain_rows(50));
  const auto without = [](const std::string& line, const std::string& by = {}) {
    std::string map = kPlain;
    const auto at = map.find(line);
    EXPECT_NE(at, std::string::npos);
    return map.replace(at, line.size(), by);
  };
  EXPECT_HAS(refusal({file}, without("period_s = 0.01\n")),
             "map.toml: time.period_s: is missing: how long is a cycle of the log? The recording "
             "has a sample every 0.010000 s (0.010000 s to 0.010000 s)");
  EXPECT_HAS(refusal({file}, without("unit = \"rad\"\n")), "position.unit");
  EXPECT_HAS(refusal({file}, without("unit = \"s\"\n")), "time.unit");
  EXPECT_HAS(refusal({file}, without("joints = [\"joint1\", \"joint2\"]")),
             "joints: is missing: which joints do the columns belong to?");
  EXPECT_HAS(refusal({file}, without("\"joint2\"]", "\"joint3\"]")),
             "has no joint 'joint3' (known: joint1, joint2)");
  EXPECT_HAS(refusal({file}, without("\"joint1\", \"joint2\"", "\"joint1\", \"joint1\"")),
             "names 'joint1' twice");
  EXPECT_HAS(refusal({file}, without("unit = \"rad\"", "unit = \"mm\"")),
             "is mm, but the joint 'joint1' turns");
  EXPECT_HAS(refusal({file}, without("\"dq{1}\"", "\"dp{1}\"")),
             "velocity.columns: the recording has no column 'dp1' (did you mean 'dq1'?");
  const std::string torque = "[torque]\ncolumns = \"tau{1}\"\nunit = \"Nm\"\n";
  EXPECT_HAS(refusal({file}, without(torque)),
             "a.csv: the map does not say what these columns are: 'tau1', 'tau2'");
  EXPECT_EQ(imported({file}, "ignore = [\"*\"]" + without(torque)).excluded.ignored.size(), 2U);
  EXPECT_HAS(refusal({file}, "ignore = [\"tau3\"]" + without(torque)), "no column 'tau3' is left");
}

/// Degrees that are called rad, seconds that are called ms: no log of nonsense.
TEST_F(Csv, ImpossibleNumbersAreRefused) {
  robot_.joints[0].min_position_rad = -1.5;
  robot_.joints[0].max_position_rad = 1.5;
  const auto shifted = [](double by) {
    return plain_rows(50, [by](int i, std::string row) {
      return i == 7 ? "0.07," + std::to_string(by) + row.substr(row.find(',', 5)) : row;
    });
  };
  EXPECT_EQ(imported({write("a.csv", shifted(2.0))}, kPlain).cycles, 50U) << "half a range beyond";
  EXPECT_HAS(refusal({write("a.csv", shifted(57.0))}, kPlain),
             "a.csv:9: rows: q1 is 57 rad; 'joint1' moves from -1.5 to 1.5 rad");
  EXPECT_HAS(refusal({write("a.csv", shifted(1e30))}, kPlain), "a.csv:9: rows: q1 is 1e+30 rad");
  const std::string file = write("a.csv", plain_rows(50));
  const auto with = [](const std::string& line, const std::string& by) {
    std::string map = kPlain;
    return map.replace(map.find(line), line.size(), by);
  };
  EXPECT_HAS(refusal({file}, with("unit = \"s\"", "unit = \"ms\"")),
             "time.period_s: a cycle of the log is 0.010000 s, and 'q1' has a sample");
  EXPECT_HAS(refusal({file}, with("period_s = 0.01", "period_s = 10.0")), "time.period_s");
  EXPECT_HAS(refusal({file}, with("period_s = 0.01", "period_s = 1e-6")), "time.period_s");
}

TEST_F(Csv, OfOtherKindsIsRefusedWithWhatToDo) {
  EXPECT_HAS(refusal({write("a.db3", "SQLite format 3\0")}, kPlain), "is a bag in SQLite");
  EXPECT_HAS(refusal({write("a.bag", "#ROSBAG V2.0\n")}, kPlain), "mcap convert");
  EXPECT_HAS(refusal({path("nowhere.csv")}, kPlain), "nowhere.csv: cannot read this file");
  EXPECT_HAS(refusal({folder_.path()}, kPlain), "is a folder");
  EXPECT_HAS(refusal({write("a.csv", "")}, kPlain), "has no rows");
  EXPECT_HAS(refusal({write("a.csv", "t,q1,q2,dq1,dq2,tau1,tau2\n")}, kPlain),
             "less than two samples");
  EXPECT_HAS(refusal({write("a.csv", plain_rows(5,
                                                [](int i, std::string row) {
                                                  return i == 3 ? "0.03,one" +
                                                                      row.substr(row.find(',', 5))
                                                                : row;
                                                }))},
                     kPlain),
             "a.csv:5: q1: 'one' is no number");
}

}  // namespace
}  // namespace tandem::log
