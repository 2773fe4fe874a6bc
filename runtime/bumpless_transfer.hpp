// No step in a joint's command when it changes hands: what was commanded goes over to what is.
// Layer: runtime.  Thread: made non-RT; the rest RT.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/backend.hpp"
#include "hal/image.hpp"
#include "hal/joint_capabilities.hpp"

namespace tandem::runtime {

/// In the cycle in which a joint changes hands its references go on as they were, and what the new
/// owner writes differs from them by an offset, which goes to zero. The offset of the velocity is
/// the derivative of the position's, so the two stay consistent.
///
/// - Position, from the same mode and interaction: the motion in force loses its velocity relative
///   to the new reference within kBrake_s, all joints in the same time, so their path stays. What
///   lies between its end and the new reference goes away on a minimum-jerk profile within
///   kTime_ns, or later where that would take more than half of the joint's velocity or of its
///   acceleration (within kMost_s at most).
/// - Position, from another one: the same from the measured motion, where the joint moves; else
///   position starts at the measured one anyhow (CommandLimits).
/// - Torque in the same time, stiffness and damping within kTime_ns, from the last ones. When the
///   mode or interaction changes, the torque goes over from the measured one, and in velocity mode
///   the velocity.
/// - A drive that was idle or is not enabled: none.
///
/// Whoever rests now, at the place of brake(), takes over without coming back.
class BumplessTransfer {
 public:
  static constexpr std::int64_t kTime_ns = 100'000'000;
  static constexpr double kBrake_s = 0.25;
  static constexpr double kMost_s = 2.0;

  struct Impedance {
    double stiffness_Nm_rad = 0.0;
    double damping_Nms_rad = 0.0;
  };
  /// How a joint is brought to rest.
  enum class Pace : std::uint8_t {
    kEven,  ///< within kBrake_s, or longer where its acceleration or jerk limits ask for it
    kHard,  ///< as hard as its limits allow
  };
  struct Brake {
    double from_rad = 0.0;  ///< the reference or the measured position, from where it goes on
    double way_rad = 0.0;   ///< to its rest; 0: it rests
    double speed_rad_s = 0.0;
    std::int64_t cycles = 0;
  };

  /// `joints` outlives this.
  BumplessTransfer(std::span<const hal::JointCapabilities> joints, std::int64_t period_ns);

  /// Each cycle, before anybody writes: `command` is what was sent last, but of joints that have
  /// begun to change hands.
  void watch(const hal::CommandImage& command) noexcept TANDEM_RT;
  /// `joint` changes hands in this cycle; `command` is still what was sent last, and then what the
  /// owner until now wrote. A further change in the same cycle goes on from the same.
  void begin(std::size_t joint, const hal::StateImage& state, hal::CommandImage& command,
             Pace pace = Pace::kEven) noexcept TANDEM_RT;
  /// As begin(), where the cycle before knows nothing of the reference's velocity but what
  /// `command` says.
  void begin_from(std::size_t joint, const hal::StateImage& state,
                  hal::CommandImage& command) noexcept TANDEM_RT;
  /// How the joint, which has begun to change hands, comes to rest in position control. It stays
  /// within its range.
  [[nodiscard]] Brake brake(std::size_t joint, const hal::StateImage& state, hal::ControlMode mode,
                            hal::InteractionMode interaction) const noexcept TANDEM_RT;
  /// Before the owners write: gives them back what they wrote last. Outside position control the
  /// position stays what is offered to them: what nobody writes there, nobody wants.
  void before_update(hal::CommandImage& command) const noexcept TANDEM_RT;
  /// After it: adds what is left of the offsets.
  void after_update(const hal::StateImage& state, hal::CommandImage& command) noexcept TANDEM_RT;
  /// Whether a joint has begun to change hands since after_update().
  [[nodiscard]] bool has_begun() const noexcept TANDEM_RT { return begun_ != 0; }
  /// What the owner of the joint wrote last: `command` goes over to it while an offset is left.
  [[nodiscard]] Impedance written(std::size_t joint,
                                  const hal::CommandImage& command) const noexcept TANDEM_RT;
  /// Forgets all. The references of joints that have begun to change hands are again what was sent.
  void cancel(hal::CommandImage& command) noexcept TANDEM_RT;
  /// Forgets all.
  void clear() noexcept TANDEM_RT;

  void archive(Archive& ar) { ar(joints_, before_rad_, going_, begun_); }

 private:
  static constexpr std::size_t kReferences = 5;
  using References = std::array<double, kReferences>;
  struct JointTransfer {
    References offset{};       // that fades; before it is known, the last command
    References written{};      // by the owner, without the offset
    double speed_rad_s = 0.0;  // that the brake takes away; before that is known, the last one
    std::int64_t since = 0;    // cycles
    std::int64_t left = 0;
    std::int64_t brake_cycles = 0;  // 0: nothing is taken away
    std::int64_t fade_cycles = 0;   // of the position's offset
    std::int8_t mode = 0;           // of the last command; then the one that the offset is for
    std::uint8_t interaction = 0;
    std::uint8_t known = 0;    // 1: the offset is; 2: and the owner's speed
    std::uint8_t enabled = 0;  // the drive was
    Pace pace = Pace::kEven;
    std::uint8_t padding[3] = {};
  };
  static References read(const hal::CommandImage& command, std::size_t joint) noexcept TANDEM_RT;
  static void write(hal::CommandImage& command, std::size_t joint,
                    const References& values) noexcept TANDEM_RT;
  void begin(std::size_t joint, const hal::StateImage& state, hal::CommandImage& command,
             double speed_rad_s, Pace pace) noexcept TANDEM_RT;
  [[nodiscard]] std::int64_t brake_cycles(std::size_t joint, double speed_rad_s, double room_rad,
                                          Pace pace) const noexcept TANDEM_RT;
  [[nodiscard]] std::int64_t fade_cycles(std::size_t joint,
                                         double way_rad) const noexcept TANDEM_RT;
  void find_offset(std::size_t joint, const hal::StateImage& state,
                   const hal::CommandImage& command) noexcept TANDEM_RT;
  [[nodiscard]] bool sets_out(std::size_t joint, double from_rad,
                              double speed_rad_s) const noexcept TANDEM_RT;
  void lead_from(std::size_t joint, double from_rad, double speed_rad_s, double owner_rad_s,
                 std::int64_t brake_cycles) noexcept TANDEM_RT;
  void notice_unwritten_speed(std::size_t joint, const References& first) noexcept TANDEM_RT;
  [[nodiscard]] References sum(const JointTransfer& joint) const noexcept TANDEM_RT;

  std::span<const hal::JointCapabilities> limits_;
  double period_s_;
  std::int64_t cycles_;      // that kTime is
  std::uint64_t going_ = 0;  // joints with cycles left
  std::uint64_t begun_ = 0;  // of these, whose offset is not known
  std::vector<JointTransfer> joints_;
  std::vector<double> before_rad_;  // what was sent before the last command
};

}  // namespace tandem::runtime
