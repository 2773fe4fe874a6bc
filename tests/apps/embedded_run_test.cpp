// runtime::Run: what a program of one's own gets is what `tandem run` has.
#include "runtime/run/run.hpp"

#include <chrono>
#include <cmath>
#include <future>
#include <map>

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

TEST_F(EmbeddedRun, HasTheSecondRobotOfParallel) {
  write_text(path("trajectory.toml"), read_text(path("trajectory.toml")) + "\n[parallel]\n");
  const auto run = runtime::Run::open(path("trajectory.toml"), {.duration_s = 0.5});
  ASSERT_TRUE(run) << run.error().front().to_string();
  while ((*run)->step()) {
  }
  ASSERT_NE((*run)->parallel(), nullptr);
  EXPECT_EQ((*run)->parallel()->finish().cycles, (*run)->cycle().loop().cycles);
  EXPECT_GT((*run)->parallel()->differences().cycles(), 500U);
  EXPECT_EQ((*run)->parallel()->differences().unequal(), 0U);
}

TEST_F(EmbeddedRun, PredictsWhatItDoes) {
  const auto run = runtime::Run::open(path("trajectory.toml"));
  ASSERT_TRUE(run) << run.error().front().to_string();
  std::map<std::uint64_t, double> references;
  const auto step = [&] {
    ASSERT_TRUE((*run)->step());
    references[(*run)->state().cycle()[0]] = (*run)->command().position_rad()[1];
  };
  while ((*run)->cycle().running_cycles() < 300) step();
  auto asked =
      std::async(std::launch::async, [&] { return (*run)->predictions()->predict(50'000'000); });
  while (asked.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) step();
  const auto answer = asked.get();
  ASSERT_TRUE(answer) << answer.error().to_string();
  const hal::Prediction& p = answer->prediction;
  ASSERT_EQ(p.cycles, 50U);
  while (references.rbegin()->first < p.first_cycle + p.cycles) step();
  for (std::size_t i = 0; i < p.cycles; ++i) {
    EXPECT_EQ(p.row(p.reference_rad, i)[1], references.at(p.first_cycle + i)) << i;
  }
}

/// Leaves every joint as it is, and counts.
struct Counting final : Controller {
  Status configure(ControllerSetup&) override { return {}; }
  void start(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {}
  Code update(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {
    ++updates;
    return Code::kOk;
  }
  int updates = 0;
};

TEST_F(EmbeddedRun, RunsWhatItsProgramChangesAndAdds) {
  const auto run = runtime::Run::open(path("hold.toml"), {.change = [](runtime::Experiment& e) {
                                        e.duration_s = 0.2;
                                        e.controllers.clear();
                                      }});
  ASSERT_TRUE(run) << run.error().front().to_string();
  const auto own = std::make_shared<Counting>();
  ASSERT_TRUE((*run)->controllers().add("own", own, TomlDocument::parse("", "own")->root()));
  while ((*run)->step()) {
  }
  EXPECT_EQ((*run)->cycle().running_cycles(), 200U);
  EXPECT_EQ(own->updates, 200);
}

/// Draws something in a frame.
struct Drawing final : Controller {
  explicit Drawing(std::string where) : frame(std::move(where)) {}
  Status configure(ControllerSetup& setup) override {
    (void)setup.mark("push", {.frame = frame});
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {}
  Code update(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {
    return Code::kOk;
  }
  std::string frame;
};

TEST_F(EmbeddedRun, KnowsTheFramesThatMarksMayBeIn) {
  const auto run = runtime::Run::open(path("hold.toml"));
  ASSERT_TRUE(run) << run.error().front().to_string();
  int number = 0;
  const auto add = [&](const char* frame) {
    const Status added = (*run)->controllers().add("draws" + std::to_string(++number),
                                                   std::make_shared<Drawing>(frame),
                                                   TomlDocument::parse("", "own")->root());
    return added ? "" : added.error().to_string();
  };
  for (const char* frame : {"base_link", "link2", "tip", "odom"}) EXPECT_EQ(add(frame), "");
  const std::string said = add("lnik2");
  EXPECT_NE(said.find("its mark 'push' is in the frame 'lnik2'"), std::string::npos) << said;
  EXPECT_NE(said.find("did you mean 'link2'"), std::string::npos) << said;
}

TEST_F(EmbeddedRun, RunsTheRobotThatItsProgramConnects) {
  const auto run =
      runtime::Run::open(path("hold.toml"), {.duration_s = 0.1, .hal = "can", .lockstep = true}, {},
                         [](runtime::Composition& c) -> Diagnostics {
                           auto made = sim::SimRobot::create(c.experiment.robot, c.kernels.get(),
                                                             c.experiment.sim_robot_config());
                           if (!made) return {made.error()};
                           c.backend = std::move(*made);
                           return {};
                         });
  ASSERT_TRUE(run) << run.error().front().to_string();
  EXPECT_FALSE((*run)->is_simulated());
  while ((*run)->step()) {
  }
  EXPECT_EQ((*run)->cycle().running_cycles(), 100U);
}

TEST_F(EmbeddedRun, SaysWhyItCannotBe) {
  const auto refused = [&](const std::string& file, const runtime::Overrides& overrides) {
    const auto run = runtime::Run::open(path(file), overrides);
    return run ? std::string() : run.error().front().to_string();
  };
  EXPECT_NE(refused("nothing.toml", {}).find("nothing.toml: cannot read"), std::string::npos);
  EXPECT_NE(refused("hold.toml", {.hal = "can"}).find("its robot is not in this process"),
            std::string::npos);
  EXPECT_NE(refused("hold.toml", {.hal = "cam"}).find("one of sim, can"), std::string::npos);
  EXPECT_NE(refused("hold.toml", {.on_fault = "go on"}).find("one of end, wait"),
            std::string::npos);
  for (const double s : {0.0, -1.0, 1e7, -runtime::kEndless_s, std::nan("")}) {
    EXPECT_NE(refused("hold.toml", {.duration_s = s}).find("duration_s: "), std::string::npos) << s;
  }
  edit("hold.toml", "plugin = \"hold\"", "plugin = \"hodl\"");
  EXPECT_NE(refused("hold.toml", {}).find("did you mean 'hold'"), std::string::npos)
      << refused("hold.toml", {});
}

}  // namespace
}  // namespace tandem::apps
