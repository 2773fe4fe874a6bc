// The robot's end of a noisy link: turns commands that come late, twice or not at all into
// references without steps.
// Layer: hal/remote.  Thread: made non-RT; the rest RT.
#pragma once

#include <cstdint>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/image.hpp"
#include "hal/robot.hpp"

namespace tandem::remote {

/// Brings the references of `command` nearer to those of `goal`: positions, velocities, torques.
/// @param share  of the difference that is left
void move_towards(hal::CommandImage& command, const hal::CommandImage& goal,
                  double share) noexcept TANDEM_RT;

/// Plays each command a fixed number of cycles after the one that it was given in.
class Playout {
 public:
  /// @param delay_cycles  from a command to its effect; of commands that take longer nothing is
  /// used
  /// @param brake_cycles  in which references come to rest when commands end
  Playout(const hal::Robot& robot, std::uint64_t delay_cycles, std::uint64_t brake_cycles,
          std::int64_t period_ns);

  /// Starts at `command`, which is in force.
  void start(std::uint64_t cycle, const hal::CommandImage& command) noexcept TANDEM_RT;
  /// A command of cycle command.cycle() has arrived at `cycle`. Too late or known: nothing happens.
  void take(std::uint64_t cycle, const hal::CommandImage& command) noexcept TANDEM_RT;
  /// The references of `cycle`; each cycle once, in order.
  void play(std::uint64_t cycle, hal::CommandImage& out) noexcept TANDEM_RT;

  /// The cycle whose command was played last; while starved that of the last command there was.
  [[nodiscard]] std::uint64_t source_cycle() const noexcept { return source_; }
  [[nodiscard]] bool starved() const noexcept { return starved_; }
  [[nodiscard]] std::uint64_t starved_cycles() const noexcept { return starved_cycles_; }
  [[nodiscard]] std::uint64_t holds() const noexcept { return holds_; }
  void archive(Archive& ar);

 private:
  void brake(hal::CommandImage& out) noexcept TANDEM_RT;
  void bridge(std::uint64_t wanted, std::uint64_t next) noexcept TANDEM_RT;
  void begin_return(const hal::CommandImage& out) noexcept TANDEM_RT;
  void return_to(hal::CommandImage& out) noexcept TANDEM_RT;
  [[nodiscard]] bool has(std::uint64_t cycle) const noexcept {
    return given_[cycle % given_.size()] == cycle + 1;
  }
  [[nodiscard]] const hal::CommandImage& at(std::uint64_t cycle) const noexcept {
    return buffer_[cycle % buffer_.size()];
  }

  std::uint64_t delay_, brake_cycles_;
  double period_s_;
  std::vector<double> max_velocity_;       // (joints) rad/s or m/s
  std::vector<hal::CommandImage> buffer_;  // by cycle
  std::vector<std::uint64_t> given_;       // cycle + 1 of each place; 0: empty
  hal::CommandImage last_;                 // that was played
  std::uint64_t newest_ = 0, source_ = 0;
  bool starved_ = false;
  std::uint64_t braked_ = 0;            // cycles since the commands ended
  std::vector<double> brake_velocity_;  // (joints) when they did
  std::vector<double> offset_;          // (joints) of the references when they came again
  std::uint64_t returned_ = 0, return_cycles_ = 0;
  std::uint64_t starved_cycles_ = 0, holds_ = 0;
};

}  // namespace tandem::remote
