// runtime::Run: what a program of one's own gets is what `tandem run` has.
#include "runtime/run/run.hpp"

#include "log/log_file.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class EmbeddedRun : public Program {
 protected:
  [[nodiscard]] std::string path(const std::string& file) const {
    return (folder_ / file).string();
  }
};

/// Positions and velocities, cycle by cycle.
std::vector<double> path_of(const std::string& experiment, const runtime::Overrides& overrides) {
  const auto run = runtime::Run::open(experiment, overrides);
  EXPECT_TRUE(run) << run.error().front().to_string();
  std::vector<double> path;
  for (bool goes_on = true; run && goes_on;) {
    goes_on = (*run)->step();  // the last cycle's answer is false, too
    for (const double q : (*run)->state().position_rad()) path.push_back(q);
    for (const double v : (*run)->state().velocity_rad_s()) path.push_back(v);
  }
  return path;
}

TEST_F(EmbeddedRun, HasTheBitsOfTandemRun) {
  const Outcome outcome = tandem("run trajectory.toml --duration 0.5 --seed 7 --log logs");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto name = std::filesystem::directory_iterator(folder_ / "logs")->path();
  const auto log = log::LogFile::open(name.string());
  ASSERT_TRUE(log) << log.error().to_string();
  const auto table = log->read(
      "/tandem/state",
      {{"position_rad", 0}, {"position_rad", 1}, {"velocity_rad_s", 0}, {"velocity_rad_s", 1}});
  ASSERT_TRUE(table) << table.error().to_string();
  std::vector<double> logged;
  for (std::size_t k = 0; k < table->time_s.size(); ++k) {
    for (const std::vector<double>& column : table->columns) logged.push_back(column[k]);
  }
  const std::vector<double> path =
      path_of(this->path("trajectory.toml"), {.seed = 7, .duration_s = 0.5});
  ASSERT_GE(path.size(), 4U * 500U);
  EXPECT_EQ(path.size(), logged.size());
  EXPECT_TRUE(std::equal(path.begin(), path.end(), logged.begin(), [](double a, double b) {
    return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
  }));
}

TEST_F(EmbeddedRun, SaysWhyItCannotBe) {
  const auto refused = [&](const std::string& file, const runtime::Overrides& overrides) {
    const auto run = runtime::Run::open(path(file), overrides);
    return run ? std::string() : run.error().front().to_string();
  };
  EXPECT_NE(refused("nothing.toml", {}).find("nothing.toml: cannot read"), std::string::npos);
  EXPECT_NE(refused("hold.toml", {.hal = "can"}).find("its robot is not in this process"),
            std::string::npos);
  edit("hold.toml", "plugin = \"hold\"", "plugin = \"hodl\"");
  EXPECT_NE(refused("hold.toml", {}).find("did you mean 'hold'"), std::string::npos)
      << refused("hold.toml", {});
}

}  // namespace
}  // namespace tandem::apps
