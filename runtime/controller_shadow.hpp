// A controller that runs beside the active ones without commanding: what it wants, and how far that
// is from what is commanded.
// Layer: runtime.  Thread: made non-RT; the loop's, but for what is shown.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/seqlock.hpp"
#include "controllers/controller.hpp"
#include "hal/image.hpp"
#include "hal/text_event.hpp"

namespace tandem::runtime {

/// A reference of a joint, as commands have it: a row of kCommandReferenceRows.
enum class CommandReference : std::uint8_t { kPosition, kVelocity, kTorque, kVoltage, kCurrent };
inline constexpr std::size_t kCommandReferences = 5;
struct ReferenceRow {
  const char* name;        ///< the command's field
  const char* unit;        ///< of a joint that turns
  const char* slide_unit;  ///< of one that slides
};
inline constexpr ReferenceRow kCommandReferenceRows[kCommandReferences] = {
    {"position_rad", "rad", "m"},
    {"velocity_rad_s", "rad/s", "m/s"},
    {"torque_Nm", "Nm", "N"},
    {"voltage_V", "V", "V"},
    {"current_A", "A", "A"}};

[[nodiscard]] double value_of(CommandReference reference, const hal::CommandImage& command,
                              std::size_t joint) noexcept TANDEM_RT;

/// Which of its references a mode uses; the first is the one that leads. Idle: none.
[[nodiscard]] std::span<const CommandReference> references_of(std::int8_t mode) noexcept TANDEM_RT;

/// A claimed joint of a shadow: its references less those of the command, in the units of the
/// joint. What its mode does not use, and what nobody commands, is NaN.
struct JointDifference {
  std::array<double, kCommandReferences> now{};   ///< after the last cycle, by CommandReference
  std::array<double, kCommandReferences> most{};  ///< the largest since its start, without a sign
  std::array<double, kCommandReferences> step{};  ///< its largest change from one cycle to the next
  std::int32_t owner = -1;                        ///< slot of whose command that is; -1: nobody's
  std::int8_t mode = 0, commanded_mode = 0;       ///< hal::ControlMode
  std::uint8_t interaction = 0, commanded_interaction = 0;  ///< hal::InteractionMode
};

/// Why a shadow is none any more: a row each of controller_shadow.cpp.
enum class ShadowEnd : std::uint8_t {
  kNone,       ///< it runs, or never did
  kRequested,  ///< somebody asked for it
  kLeads,      ///< it is active now
  kStopped,    ///< the controllers were
  kDone,       ///< its task is
  kReplaced,   ///< by a new build
  kCode,       ///< its update() answered an error
  kNotFinite,  ///< a reference of it was
  kStray,      ///< it wrote what it has not claimed
  kLate,       ///< it needs more time than the cycle has
};

/// How a shadow does.
struct ShadowLook {
  std::uint64_t since = 0;   ///< cycle of its start
  std::uint64_t calls = 0;   ///< of its update()
  std::uint64_t missed = 0;  ///< cycles that had no time left for it
  std::int32_t joint = -1;   ///< of `end`; -1: none
  ShadowEnd end = ShadowEnd::kNone;
  Code code = Code::kOk;  ///< of kCode
  std::array<std::uint8_t, 2> padding{};
};
/// Whether somebody should look at why it ended.
[[nodiscard]] bool is_trouble(ShadowEnd end) noexcept TANDEM_RT;
/// "shadow ended: a reference is not finite: elbow". @param joint  of look.joint
void append_end(hal::TextEvent& to, const ShadowLook& look,
                std::string_view joint) noexcept TANDEM_RT;

/// Fields of one joint.
void copy_joint(hal::CommandImage& to, const hal::CommandImage& from,
                std::size_t joint) noexcept TANDEM_RT;

/// One controller's part as a shadow. It has all its memory from the start.
struct Shadow {
  Shadow(const hal::ImageShape& shape, std::size_t claims)
      : wants(shape), joints(claims), shown_joints(claims), shown(1) {}

  /// It starts anew in that cycle.
  void begin(std::uint64_t cycle) noexcept TANDEM_RT;
  /// Its references less those of `led`. @param owners  by joint: slots
  void compare(std::span<const ControllerSetup::Claim> claims, const hal::CommandImage& led,
               std::span<const std::int32_t> owners) noexcept TANDEM_RT;
  /// The first joint with a reference that its mode uses, and that is not finite; -1: none.
  [[nodiscard]] std::int32_t not_finite(
      std::span<const ControllerSetup::Claim> claims) const noexcept TANDEM_RT;
  /// To other threads.
  void show() noexcept TANDEM_RT;
  void archive(Archive& ar) { ar(wants, joints, look); }

  hal::CommandImage wants;              ///< its joints as it wants them, the others as commanded
  std::vector<JointDifference> joints;  ///< by claim
  ShadowLook look;
  std::int64_t took_ns = 0;  ///< its last call
  int missed_in_a_row = 0;
  Seqlock<JointDifference> shown_joints;
  Seqlock<ShadowLook> shown;
};

}  // namespace tandem::runtime
