// The double pendulum, with two sensors, and recordings of it in a folder of the test's own.
// Layer: tests.  Thread: one.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "log/import/import_log.hpp"
#include "log/log_file.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::log::test {

inline std::string text_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline constexpr char kSensors[] = R"(
[[sensor]]
name = "ft"
type = "force_torque"
bus = "arm"
node_id = 20
joint = "joint2"
link = "link2"
[[sensor]]
name = "imu"
type = "imu"
bus = "arm"
node_id = 21
link = "link1"
)";

inline hal::RobotConfig pendulum() {
  const std::string file = TANDEM_SOURCE_DIR "/config/double_pendulum/robot.toml";
  auto robot = hal::parse_robot_config(text_of(file) + kSensors, file);
  EXPECT_TRUE(robot) << robot.error().front().to_string();
  return *robot;
}

/// Imports in a folder that goes with the test.
class Import : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
    return path(name);
  }

  std::expected<ImportSummary, Diagnostics> import(const std::vector<std::string>& files,
                                                   const std::string& map) const {
    RunInfo info{.version = "test",
                 .robot = robot_.name,
                 .hal = "import",
                 .joints = {"joint1", "joint2"},
                 .sensors = {{"ft", 6}, {"imu", 10}}};
    std::filesystem::remove(path("out.mcap"));
    return import_log({files, write("map.toml", map), path("out.mcap")}, robot_, info, "");
  }
  /// That succeeds.
  ImportSummary imported(const std::vector<std::string>& files, const std::string& map) const {
    auto done = import(files, map);
    EXPECT_TRUE(done) << done.error().front().to_string();
    return done ? *done : ImportSummary{};
  }
  /// What is said of files that are refused: "FILE:LINE: KEY: message (hint)" without the folder.
  std::string refusal(const std::vector<std::string>& files, const std::string& map) const {
    auto done = import(files, map);
    EXPECT_FALSE(done);
    EXPECT_FALSE(std::filesystem::exists(path("out.mcap")));
    if (done) return {};
    std::string text = done.error().front().to_string();
    const std::string prefix = folder_.path() + "/";
    for (auto at = text.find(prefix); at != std::string::npos; at = text.find(prefix)) {
      text.erase(at, prefix.size());
    }
    return text;
  }
  TimeSeries table(const std::vector<Column>& columns,
                   const std::string& topic = "/tandem/state") const {
    const auto file = LogFile::open(path("out.mcap"));
    EXPECT_TRUE(file);
    if (!file) return {};
    auto read = file->read(topic, columns);
    EXPECT_TRUE(read) << read.error().to_string();
    return read ? *read : TimeSeries{};
  }

  tandem::test::ScratchFolder folder_;
  hal::RobotConfig robot_ = pendulum();
};

#define EXPECT_HAS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

}  // namespace tandem::log::test
