// `tandem log import` from the outside: a run's own tables come back as the same numbers, and take
// the same ways.
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

const std::string kMap = csv_map("allow_frozen = true", R"([velocity]
columns = "velocity_rad_s.joint{1}"
unit = "rad/s"
[torque]
columns = "torque_nm.joint{1}"
unit = "Nm"
)");

class LogImport : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    const Outcome run = tandem("run trajectory.toml --duration 1 --quiet --json run.json");
    ASSERT_EQ(run.status, 0) << run.err;
    log_ = json("run.json")["log"]["path"];
    write_text(folder_ / "map.toml", kMap);
    ASSERT_EQ(tandem("log csv " + log_ + " --fields " + kFields + " -o run.csv").status, 0);
  }
  const std::string kFields = "position_rad,velocity_rad_s,torque_nm";
  std::string log_;
};

/// A table without its times: an import's begin at 0, a run's when something was measured.
std::string measured(const std::string& table) {
  std::istringstream in(table);
  std::string rows;
  for (std::string line; std::getline(in, line);) rows += line.substr(line.find(',')) + "\n";
  return rows;
}

TEST_F(LogImport, GivesARunsTableBackAndAReport) {
  const Outcome done =
      tandem("log import run.csv --robot robot.toml --map map.toml --json summary.json");
  ASSERT_EQ(done.status, 0) << done.err;
  const auto summary = json("summary.json");
  EXPECT_EQ(summary["log"], "runs/double_pendulum-run.mcap");
  EXPECT_EQ(summary["series"][0]["median_ns"], 1'000'000);
  ASSERT_EQ(
      tandem("log csv runs/double_pendulum-run.mcap --fields " + kFields + " -o again.csv").status,
      0);
  EXPECT_EQ(measured(read_text(folder_ / "run.csv")), measured(read_text(folder_ / "again.csv")));
  EXPECT_EQ(tandem("log diff " + log_ + " runs/double_pendulum-run.mcap").status, 1)
      << "the run's has more";
  const Outcome report = tandem("report runs/double_pendulum-run.mcap");
  EXPECT_EQ(report.status, 0) << report.err;
  const Outcome info = tandem("log info runs/double_pendulum-run.mcap");
  EXPECT_NE(info.out.find("imported_from"), std::string::npos) << info.out;
}

/// A sample in fifty is missing: each gap is one that is bridged, and all together are too many.
TEST_F(LogImport, WarnsOfSamplesThatCameLate) {
  const std::string command = "log import run.csv --robot robot.toml --map map.toml ";
  const Outcome even = tandem(command + "-o even.mcap --json even.json");
  ASSERT_EQ(even.status, 0) << even.err;
  EXPECT_EQ(json("even.json")["series"][0]["late"], 0);
  EXPECT_EQ(even.err.find("came late"), std::string::npos) << even.err;
  std::istringstream whole(read_text(folder_ / "run.csv"));
  std::string text;
  std::size_t row = 0, rows = 0, left_out = 0;
  for (std::string line; std::getline(whole, line); ++row) {
    const bool missing = row > 1 && row % 50 == 0;
    left_out += missing ? 1 : 0;
    rows += missing || row == 0 ? 0 : 1;
    if (!missing) text += line + "\n";
  }
  write_text(folder_ / "run.csv", text);
  const Outcome late = tandem(command + "-o late.mcap --json late.json");
  ASSERT_EQ(late.status, 0) << late.err;
  EXPECT_EQ(json("late.json")["series"][0]["late"], left_out);
  EXPECT_NE(late.err.find(std::to_string(left_out) + " of " + std::to_string(rows) +
                          " samples came late, more than 1.5 periods of 1 ms after the one before, "
                          "the worst after 2 ms"),
            std::string::npos)
      << late.err;
}

TEST_F(LogImport, RefusesWithStatus2AndWritesNothing) {
  edit("map.toml", "period_s = 0.001\n", "");
  const Outcome asked = tandem("log import run.csv --robot robot.toml --map map.toml -o a.mcap");
  EXPECT_EQ(asked.status, 2);
  EXPECT_NE(asked.err.find("time.period_s"), std::string::npos) << asked.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.mcap"));
  write_text(folder_ / "map.toml", kMap);
  EXPECT_EQ(tandem("log import run.csv --robot robot.toml").status, 2);
  EXPECT_EQ(tandem("log import nothing.csv --robot robot.toml --map map.toml").status, 2);
  write_text(folder_ / "there.mcap", "x");
  const Outcome there =
      tandem("log import run.csv --robot robot.toml --map map.toml -o there.mcap");
  EXPECT_EQ(there.status, 2);
  EXPECT_EQ(read_text(folder_ / "there.mcap"), "x");
}

}  // namespace
}  // namespace tandem::apps
