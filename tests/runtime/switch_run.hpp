// A run with three controllers that is asked for changes between two steps, so that the cycle in
// which they are made is known.
#pragma once

#include "tests/runtime/loop_run.hpp"

namespace tandem::runtime::test {

using Names = std::vector<std::string>;

inline TomlDocument document_of(const std::string& text = "") {
  return *TomlDocument::parse(text, "parameters");
}

/// Three joints. "left" has 0 and 1, "right" 1 and 2, "wrist" 2. Only "left" is active at first.
struct SwitchRun : JointRun {
  explicit SwitchRun(std::uint64_t running_cycles = 2000, std::uint64_t settle_cycles = 0) {
    begin({.running_cycles = running_cycles, .settle_cycles = settle_cycles});
  }
  /// Into the motion.
  void run() { steps(100); }
  [[nodiscard]] Result<RequestResult> change(const Names& stop, const Names& start) const {
    return services().switch_controllers(stop, start, kNow);
  }
  [[nodiscard]] Names active() const {
    Names names;
    for (const ControllerStatus& one : services().controllers()) {
      if (one.active) names.push_back(one.name);
    }
    return names;
  }

  Sine* left = add_sine({0, 1}, "left");
  Sine* right = add_sine({1, 2}, "right", false);
  Sine* wrist = add_sine({2}, "wrist", false);
};

}  // namespace tandem::runtime::test
