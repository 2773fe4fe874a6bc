// No step in a joint's command when it changes hands: what was commanded goes over to what is.
// Layer: runtime.  Thread: made non-RT; the rest RT.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/backend.hpp"
#include "hal/image.hpp"

namespace tandem::runtime {

/// In the cycle in which a joint changes hands its command is the last one again, and what the new
/// owner writes differs from it by an offset, which falls to zero within kTime on a
/// minimum-jerk profile.
///
/// - The same mode and interaction: the offsets of position, velocity, torque, stiffness, damping.
/// - Another one: torque goes over from the measured torque, velocity from the measured velocity;
///   position starts at the measured one anyhow (CommandLimits).
/// - A drive that was idle or is not enabled: none.
class BumplessTransfer {
 public:
  static constexpr std::int64_t kTime_ns = 100'000'000;

  struct Impedance {
    double stiffness_Nm_rad = 0.0;
    double damping_Nms_rad = 0.0;
  };

  BumplessTransfer(std::size_t joints, std::int64_t period_ns);

  /// `joint` changes hands in this cycle; `command` is still what was sent last, and then what the
  /// owner until now wrote.
  void begin(std::size_t joint, const hal::StateImage& state,
             hal::CommandImage& command) noexcept TANDEM_RT;
  /// Before the owners write: gives them back what they wrote last.
  void before_update(hal::CommandImage& command) const noexcept TANDEM_RT;
  /// After it: adds what is left of the offsets.
  void after_update(const hal::StateImage& state, hal::CommandImage& command) noexcept TANDEM_RT;
  /// What the owner of the joint wrote last: `command` goes over to it while an offset is left.
  [[nodiscard]] Impedance written(std::size_t joint,
                                  const hal::CommandImage& command) const noexcept TANDEM_RT;
  /// Forgets all.
  void clear() noexcept TANDEM_RT;

  void archive(Archive& ar) { ar(joints_, going_); }

 private:
  static constexpr std::size_t kReferences = 5;
  using References = std::array<double, kReferences>;
  struct Joint {
    References offset{};    // of the new command to the last one; before it is known, the last one
    References written{};   // by the owner, without the offset
    std::int64_t left = 0;  // cycles
    std::int8_t mode = 0;   // of the last command
    std::uint8_t interaction = 0;
    std::uint8_t known = 0;    // the offsets are
    std::uint8_t enabled = 0;  // the drive was
    std::uint8_t padding[4] = {};
  };
  static References read(const hal::CommandImage& command, std::size_t joint) noexcept TANDEM_RT;
  static void write(hal::CommandImage& command, std::size_t joint,
                    const References& values) noexcept TANDEM_RT;
  void find_offset(Joint& joint, std::size_t index, const hal::StateImage& state,
                   const hal::CommandImage& command) const noexcept TANDEM_RT;

  std::int64_t cycles_;      // that kTime is
  std::uint64_t going_ = 0;  // joints with cycles left
  std::vector<Joint> joints_;
};

}  // namespace tandem::runtime
