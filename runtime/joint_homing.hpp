// Joints whose drives have to find their place first: which they are, and what is known of them.
// Layer: runtime.  Thread: the loop's.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/drive_resets.hpp"

namespace tandem::runtime {

class JointHoming {
 public:
  /// Both outlive it.
  JointHoming(CycleNow& now, const DriveResets& resets);

  /// Begins the homing of a joint that nobody leads.
  [[nodiscard]] CycleAnswer begin(std::size_t joint) noexcept TANDEM_RT;
  /// Each cycle, again until there is nothing more: a joint whose homing has ended.
  [[nodiscard]] std::optional<std::size_t> next_ended() noexcept TANDEM_RT;

  /// As the backend said last.
  [[nodiscard]] const hal::Homing& of(std::size_t joint) const noexcept TANDEM_RT {
    return known_[joint];
  }
  [[nodiscard]] bool is_on(std::size_t joint) const noexcept TANDEM_RT {
    return known_[joint].state == hal::HomingState::kHoming;
  }
  /// Whether nothing but its homing may move the joint.
  [[nodiscard]] bool is_needed(std::size_t joint) const noexcept TANDEM_RT;
  /// Whether one of `controllers` claims such a joint.
  [[nodiscard]] bool is_needed_by(ControllerSet controllers) const noexcept TANDEM_RT;
  /// Those that have a homing.
  [[nodiscard]] std::span<const std::size_t> joints() const noexcept TANDEM_RT { return joints_; }
  void archive(Archive& ar) { ar(known_); }

 private:
  CycleNow& now_;
  const DriveResets& resets_;
  std::vector<std::size_t> joints_;
  std::vector<hal::Homing> known_;  // by joint of the robot
};

}  // namespace tandem::runtime
