// Every experiment that is bundled, saved and restored with its controllers, estimator and link.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/runtime/bundled_run.hpp"

namespace tandem::runtime {
namespace {

/// "coman/squat", and so on: all but robots, drives' data sheets, and studies of experiments.
std::vector<std::string> bundled_experiments() {
  std::vector<std::string> found;
  const std::filesystem::path root = TANDEM_SOURCE_DIR "/config";
  for (const auto& folder : std::filesystem::directory_iterator(root)) {
    const std::string robot = folder.path().filename().string();
    if (!folder.is_directory() || robot == "drives" || robot == "studies") continue;
    for (const auto& file : std::filesystem::directory_iterator(folder.path())) {
      const std::string name = file.path().stem().string();
      if (file.path().extension() == ".toml" && !name.starts_with("robot")) {
        found.push_back(robot + "/" + name);
      }
    }
  }
  std::ranges::sort(found);
  return found;
}

/// After the controllers' start; `make test-all` wants more.
int cycles() {
  const char* text = std::getenv("TANDEM_SNAPSHOT_CYCLES");
  return text == nullptr ? 10 : std::stoi(text);
}

std::vector<std::byte> saved(BundledRun& run) {
  auto bytes = run.cycle->save();
  EXPECT_TRUE(bytes) << bytes.error().to_string();
  return bytes ? std::move(*bytes) : std::vector<std::byte>();
}

/// Restores `before`, which is the same when it is saved again, and goes on to `after`.
void expect_goes_on(BundledRun& run, const std::vector<std::byte>& before,
                    const std::vector<std::byte>& after) {
  const Status restored = run.cycle->restore(before);
  ASSERT_TRUE(restored) << restored.error().to_string();
  EXPECT_TRUE(saved(run) == before);
  run.steps(cycles());
  EXPECT_TRUE(saved(run) == after);
}

void expect_same_again(const std::string& robot, const std::string& name) {
  BundledRun run(robot, name);
  const bool owned =
      run.experiment->remote.command.value_or(RemoteAccess::kOff) != RemoteAccess::kOff;
  EXPECT_EQ(run.run->why_no_past(), owned ? "another process may own its robot" : "");
  EXPECT_EQ(run.cycle->unarchived(), "");
  run.run_to(RunPhase::kRunning);
  run.steps(cycles());
  const auto before = saved(run);
  run.steps(cycles());
  const auto after = saved(run);
  EXPECT_FALSE(before == after);
  expect_goes_on(run, before, after);
  BundledRun fresh(robot, name);
  expect_goes_on(fresh, before, after);
}

TEST(Snapshots, OfEveryExperimentAreTheSameAfterSaveRestoreSave) {
  const std::vector<std::string> all = bundled_experiments();
  EXPECT_GE(all.size(), 40U);
  for (const std::string& one : all) {
    SCOPED_TRACE(one);
    const std::size_t slash = one.find('/');
    expect_same_again(one.substr(0, slash), one.substr(slash + 1));
  }
}

}  // namespace
}  // namespace tandem::runtime
