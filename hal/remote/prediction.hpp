// What an operator sees of a robot far away: its twin, corrected by the states that arrive.
// Layer: hal/remote.  Thread: made non-RT; the rest the loop's.
#pragma once

#include <cstdint>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/image.hpp"

namespace tandem::remote {

/// The twin is under every command at once, the robot under the same one later. What the twin was
/// under a command is kept until the state of the robot comes in which that command was due. The
/// difference of the two passes a low pass, and is added to the twin from then on. Commands are
/// known by their numbers, which grow.
class TwinCorrection {
 public:
  /// @param past_commands  of which the twin's states are kept; states of the robot under older
  /// ones correct nothing
  /// @param correction_ns  time constant of the low pass
  TwinCorrection(std::size_t joints, std::uint64_t past_commands, std::int64_t correction_ns,
                 std::int64_t period_ns);

  /// Nothing is kept, and nothing is corrected yet.
  void start() noexcept TANDEM_RT;
  /// Positions and torques of the robot are what they are, whatever the twin's.
  void assume(const hal::StateImage& robot, const hal::StateImage& twin) noexcept TANDEM_RT;
  /// The twin's state before it is given the command of this number.
  void keep(std::uint64_t number, const hal::StateImage& twin) noexcept TANDEM_RT;
  /// A state of the robot has come, which the command `number` was due at.
  /// Nothing happens when the twin's state under it is not kept.
  /// @param passed  cycles of the robot since the state that came before
  void correct(const hal::StateImage& arrived, std::uint64_t number,
               std::uint64_t passed) noexcept TANDEM_RT;
  /// Adds the correction to the twin's positions, velocities and torques in `state`, and shows the
  /// faults and drive states of the state that came last.
  void show(const hal::StateImage& arrived, hal::StateImage& state) const noexcept TANDEM_RT;

  [[nodiscard]] std::uint64_t compared() const noexcept { return compared_; }
  [[nodiscard]] double worst_rad() const noexcept { return worst_rad_; }
  void archive(Archive& ar) { ar(compared_, kept_, past_, correction_, worst_rad_); }

 private:
  [[nodiscard]] double* past(std::uint64_t number) noexcept {
    return &past_[number % past_commands_ * 3 * joints_];
  }

  std::size_t joints_;
  std::uint64_t past_commands_;
  std::int64_t correction_ns_, period_ns_;
  std::uint64_t compared_ = 0;
  std::vector<std::uint64_t> kept_;  // 1 + the number of the command that each place is of
  std::vector<double> past_;         // the twin's positions, velocities, torques by command
  std::vector<double> correction_;   // the same, added to the twin
  double worst_rad_ = 0.0;
};

}  // namespace tandem::remote
