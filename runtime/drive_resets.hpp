// Resets of single drives: each goes on until its drive is well, or its time is over.
// Layer: runtime.  Thread: the loop's.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "runtime/cycle_now.hpp"

namespace tandem::runtime {

class DriveResets {
 public:
  explicit DriveResets(CycleNow& now);

  /// A drive is enabled only where nothing is latched that stops the robot, is held where it is,
  /// and only for a joint that no controller would move on.
  [[nodiscard]] CycleAnswer begin(std::size_t joint) noexcept TANDEM_RT;
  /// Each cycle. While the run is stopped the drive stays disabled, and its fault latched in the
  /// run. @param command  the last one
  void watch(const hal::CommandImage& command) noexcept TANDEM_RT;
  /// A stop ends all of them.
  void fail() noexcept TANDEM_RT;
  /// A reset of the whole robot takes their place.
  void forget() noexcept TANDEM_RT { std::ranges::fill(left_, std::uint64_t{0}); }

  [[nodiscard]] bool is_on(std::size_t joint) const noexcept TANDEM_RT { return left_[joint] != 0; }
  /// Whether the drive is to hear of it in this cycle. It is told once: the cause may stay.
  [[nodiscard]] bool begins(std::size_t joint) const noexcept TANDEM_RT {
    return left_[joint] == cycles_;
  }
  void archive(Archive& ar) { ar(left_); }

 private:
  void clear_fault(std::size_t joint) noexcept TANDEM_RT;

  CycleNow& now_;
  std::uint64_t cycles_;             // that one may take
  std::vector<std::uint64_t> left_;  // by joint: cycles; 0: none is under way
};

}  // namespace tandem::runtime
