// Runs `tandem` in a folder of its own, with copies of a robot's files that a test may spoil.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "base/quoting.hpp"

namespace tandem::apps {

inline std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

inline void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

struct Outcome {
  int status = -1;
  std::string out;
  std::string err;
};

class Program : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(TANDEM_BINARY_DIR) / "test_apps" /
              (std::string(info->test_suite_name()) + "." + info->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    const std::filesystem::path source = TANDEM_SOURCE_DIR "/config/double_pendulum";
    for (const char* file :
         {"double_pendulum.urdf", "robot.toml", "hold.toml", "trajectory.toml"}) {
      std::filesystem::copy_file(source / file, folder_ / file);
    }
  }
  void TearDown() override {
    if (!HasFailure()) std::filesystem::remove_all(folder_);
  }

  /// Runs `tandem ARGUMENTS` in the test's folder.
  Outcome tandem(const std::string& arguments, const std::string& environment = {}) const {
    const std::string command = "cd " + shell_word(folder_.string()) + " && " + environment + " " +
                                shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " " + arguments +
                                " >out.txt 2>err.txt </dev/null";
    const int raw = std::system(command.c_str());
    return {WIFEXITED(raw) ? WEXITSTATUS(raw) : -1, read_text(folder_ / "out.txt"),
            read_text(folder_ / "err.txt")};
  }

  /// Replaces the first `from` of a file, which must be there.
  void edit(const std::string& file, const std::string& from, const std::string& to) const {
    std::string text = read_text(folder_ / file);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write_text(folder_ / file, text.replace(at, from.size(), to));
  }

  [[nodiscard]] nlohmann::json json(const std::string& file) const {
    return nlohmann::json::parse(read_text(folder_ / file));
  }

  [[nodiscard]] bool has_log() const {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
      if (entry.path().extension() == ".mcap") return true;
    }
    return false;
  }

  std::filesystem::path folder_;
};

/// A map for `tandem log import` of what `tandem log csv` writes of the double pendulum's state.
/// @param top     keys before the tables
/// @param tables  after [position]
inline std::string csv_map(const std::string& top, const std::string& tables = {}) {
  return "joints = [\"joint1\", \"joint2\"]\n" + top + R"(
[time]
column = "time_s"
unit = "s"
period_s = 0.001
[position]
columns = "position_rad.joint{1}"
unit = "rad"
)" + tables;
}

}  // namespace tandem::apps
