#include <filesystem>
#include <fstream>

#include "tests/controllers/harness.hpp"
#include "tests/support/scratch_folder.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem {
namespace {

const test::TestRobot& panda() {
  static const test::TestRobot robot = test::load_test_robot("panda");
  return robot;
}

/// The path of a file with these rows, in a folder of this process.
std::string write_rows(const std::string& text) {
  static const test::ScratchFolder folder;
  const std::string file = folder / "path.csv";
  std::ofstream(file) << text;
  return file;
}

std::string keys(const std::string& file, const std::string& more = "") {
  return "site = 'hand'\npath = '" + file + "'\n" + more;
}

/// Position of the hand, for joints in the image's order, which is the model's here.
std::array<double, 3> hand_m(std::span<const double> q) {
  const tandem_kernels& kernels = *panda().kernels.get();
  std::vector<double> zero(kernels.nv), pose(12 * kernels.sites), motion(6 * kernels.sites);
  kernels.site_motion(q.data(), zero.data(), zero.data(), pose.data(), motion.data(),
                      motion.data());
  return {pose[9], pose[10], pose[11]};
}

TEST(ToolPath, LeadsTheSiteAlongTheFile) {
  const std::string file =
      write_rows("time_s,x_m,y_m,z_m\n0,1,0,0\n1,1.05,0,0.05\n2,1.05,-0.1,0.05\n");
  const std::vector<double> ready = panda().robot.posture("ready")->position_rad;
  test::Harness run(panda().robot, "tool_path", keys(file, "scale = 2.0\nstop_at_end = true\n"),
                    panda().kernels.get(), ready);
  ASSERT_EQ(run.problem(), "");
  std::ranges::copy(ready, run.state.position_rad().begin());
  const auto first = hand_m(ready);
  run.start();
  ASSERT_EQ(run.run(1.0), Code::kOk);
  auto now = hand_m(run.command.position_rad());
  EXPECT_NEAR(now[0] - first[0], 0.1, 2e-3) << "from where it was, twice as far";
  EXPECT_NEAR(now[2] - first[2], 0.1, 2e-3);
  EXPECT_EQ(run.run(1.1), Code::kStopped);
  now = hand_m(run.command.position_rad());
  EXPECT_NEAR(now[1] - first[1], -0.2, 2e-3);
}

TEST(ToolPath, KeepsTheJointsSpeedAndRange) {
  const std::string file = write_rows("time_s,x_m,y_m,z_m\n0,0,0,0\n0.01,0,0,0.2\n5,3,0,0\n");
  test::Harness run(panda().robot, "tool_path", keys(file), panda().kernels.get());
  ASSERT_EQ(run.problem(), "") << "where it starts is not known";
  const std::vector<double> ready = panda().robot.posture("ready")->position_rad;
  std::ranges::copy(ready, run.state.position_rad().begin());
  run.start();
  std::vector<double> before = ready;
  for (int i = 0; i < 5000; ++i) {
    ASSERT_EQ(run.step(), Code::kOk);
    for (std::size_t j = 0; j < before.size(); ++j) {
      const hal::DrivenJoint& joint = run.robot.joints[j];
      const double now = run.command.position_rad()[j];
      ASSERT_LE(std::abs(now - before[j]), joint.max_velocity_rad_s * 1e-3 + 1e-12) << i;
      ASSERT_GE(now, joint.min_position_rad);
      ASSERT_LE(now, joint.max_position_rad);
      before[j] = now;
    }
  }
}

TEST(ToolPath, RefusesAPathThatItCannotReach) {
  const std::string file = write_rows("time_s,x_m,y_m,z_m\n0,0,0,0\n5,2,0,0\n");
  test::Harness run(panda().robot, "tool_path", keys(file), panda().kernels.get(),
                    panda().robot.posture("ready")->position_rad);
  EXPECT_NE(run.problem().find("beside its path at"), std::string::npos) << run.problem();
}

TEST(ToolPath, RefusesWhatIsNoPath) {
  const std::string head = "time_s,x_m,y_m,z_m\n";
  const std::pair<std::string, std::string> cases[] = {
      {"", ":1: does not begin with the names"},
      {"t,x,y,z\n0,0,0,0\n", ":1: does not begin with the names"},
      {head + "0,0,0,0\n1,0,0\n", ":3: is not four numbers"},
      {head + "0,0,0,0\n1,0,0,0,0\n", ":3: is not four numbers"},
      {head + "0,0,0,0\n1,nan,0,0\n", ":3: is not four numbers"},
      {head + "0,0,0,0\n1,0,0,x\n", ":3: is not four numbers"},
      {head + "0.5,0,0,0\n1,0,0,0\n", ":2: the first time is not 0"},
      {head + "0,0,0,0\n0,0,0,0\n", ":3: its time is not later"},
      {head + "0,0,0,0\n1e-9,0,0,0\n", ":3: its time is less than 0.1 ms after"},
      {head + "0,0,0,0\n1e300,0,0,0\n", ":3: its time is beyond an hour"},
      {head + "0,0,0,0\n1,0,0,500\n", ":3: is more than 100 m away"},
      {head + "0,0,0,0\n", "has fewer than two places"},
  };
  for (const auto& [text, wanted] : cases) {
    test::Harness run(panda().robot, "tool_path", keys(write_rows(text)), panda().kernels.get());
    EXPECT_NE(run.problem().find(wanted), std::string::npos) << run.problem();
  }
  test::Harness none(panda().robot, "tool_path", keys("none.csv"), panda().kernels.get());
  EXPECT_NE(none.problem().find("none.csv: cannot read this file"), std::string::npos)
      << none.problem();
  test::Harness site(panda().robot, "tool_path", "site = 'foot'\npath = 'x.csv'\n",
                     panda().kernels.get());
  EXPECT_NE(site.problem().find("foot"), std::string::npos) << site.problem();
  EXPECT_NE(test::Harness(panda().robot, "tool_path", "site = 'hand'\n", panda().kernels.get())
                .problem()
                .find("path"),
            std::string::npos);
}

}  // namespace
}  // namespace tandem
