// A machine of files that a test writes.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "apps/machine/doctor.hpp"
#include "apps/machine/machine.hpp"

namespace tandem::apps {

class MachineTree : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "tandem_machine_XXXXXX";
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    root_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  void write(const std::string& path, const std::string& text) const {
    const std::filesystem::path file = root_.string() + path;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text << "\n";
  }
  void write_cpu(int cpu, const std::string& path, const std::string& text) const {
    write("/sys/devices/system/cpu/cpu" + std::to_string(cpu) + path, text);
  }
  [[nodiscard]] Machine machine() const { return Machine(root_.string()); }

  static const Finding& named(const std::vector<Finding>& findings, const std::string& name) {
    static const Finding none{"none of that name", Health::kOk, {}, {}, {}};
    const auto it = std::ranges::find(findings, name, &Finding::name);
    EXPECT_NE(it, findings.end()) << name;
    return it == findings.end() ? none : *it;
  }

  std::filesystem::path root_;
};

}  // namespace tandem::apps
