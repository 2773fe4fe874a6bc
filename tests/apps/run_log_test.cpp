// What the log of a run says about itself.
#include "apps/run/run_log.hpp"

#include "log/log_file.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class RunLog : public Program {};

// The files were read again, by name, when the log began: it had what stood there by then.
TEST_F(RunLog, HasTheFilesThatAreRun) {
  const std::vector<std::string> names{"hold.toml", "robot.toml", "double_pendulum.urdf"};
  std::vector<std::string> texts;
  for (const std::string& name : names) texts.push_back(read_text(folder_ / name));
  auto composition = runtime::composed<WiredComposition>((folder_ / "hold.toml").string(), {});
  ASSERT_TRUE(composition) << composition.error().front().to_string();
  for (const std::string& name : names) write_text(folder_ / name, "another by now\n");
  auto recorder = open_log(**composition, (folder_ / "runs").string());
  ASSERT_TRUE(recorder) << recorder.error().to_string();
  (*recorder)->start();
  const log::RecordingResult result = (*recorder)->close();
  const auto file = log::LogFile::open(result.path);
  ASSERT_TRUE(file) << file.error().to_string();
  const auto& configuration = file->info().configuration;
  ASSERT_EQ(configuration.size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_TRUE(configuration[i].first.ends_with(names[i])) << configuration[i].first;
    EXPECT_EQ(configuration[i].second, texts[i]);
  }
}

}  // namespace
}  // namespace tandem::apps
