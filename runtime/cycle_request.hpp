// What another thread asks the loop to do at a cycle's boundary, and what the loop answers.
// Layer: runtime.  Thread: plain data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "controllers/live_parameter.hpp"
#include "hal/backend.hpp"
#include "hal/image.hpp"

namespace tandem::runtime {

struct HostedController;

/// Controllers that may be loaded at a time; the bits of a set of them.
inline constexpr std::size_t kMostControllers = 32;
using ControllerSet = std::uint32_t;
[[nodiscard]] constexpr ControllerSet only(std::size_t slot) { return ControllerSet{1} << slot; }

/// A parameter of a controller to be set.
struct ParameterChange {
  std::size_t slot = 0;
  ParameterRow* parameter = nullptr;  ///< of what is in the slot
  double value = 0.0;                 ///< it fits
  std::string name{};                 ///< "squat.link_damping_Nms_rad", for the log
};

/// What to set of a joint. What is negative or NaN stays.
struct JointRequest {
  static constexpr double kAsItIs = std::numeric_limits<double>::quiet_NaN();

  double stiffness_Nm_rad = kAsItIs;
  double damping_Nms_rad = kAsItIs;
  std::int32_t mode = -1;         ///< hal::ControlMode
  std::int32_t interaction = -1;  ///< hal::InteractionMode

  [[nodiscard]] bool switches() const noexcept { return mode >= 0 || interaction >= 0; }
  /// Whether it asks for a mode in which the drive drives.
  [[nodiscard]] bool drives() const noexcept { return mode > 0 || interaction >= 0; }
};

/// Where a joint is to go, on a trapezoid of speed. NaN: hal::PositionControl's own.
struct MoveRequest {
  static constexpr double kDefault = std::numeric_limits<double>::quiet_NaN();

  double target_rad = kDefault;  ///< NaN: it brakes, and stays where it comes to rest
  double speed_rad_s = kDefault;
  double acceleration_rad_s2 = kDefault;
};

/// That a request sets at most, each element of a list counted: each is an event of its cycle.
inline constexpr std::size_t kMostParameterChanges = 64;

struct CycleRequest {
  enum class Kind : std::uint32_t {
    kInsert,      ///< `controller` into `slot`
    kRemove,      ///< what is in `slot`
    kReplace,     ///< what is in `slot`, by `controller`
    kSwitch,      ///< the controllers of `stop` and `start`
    kShadow,      ///< what is in `slot` runs as a shadow
    kEndShadow,   ///< it does no longer
    kSwitchWhen,  ///< as kSwitch, once they agree `within`, up to `cycles` later; of none: the one
                  ///< that waits does no longer
    kGoOn,        ///< the controllers that a reset holds back
    kJoint,       ///< `wish` of `joint`
    kGains,       ///< `gains` of `joint` and `loop`
    kRecover,     ///< `joint`, back to its limits
    kMove,        ///< `joint`, as `move` says
    kReset,       ///< the drive of `joint`
    kHome,        ///< `joint`, as its configuration says
    kSet,         ///< `changes`
    kLink,        ///< `link`
  };
  std::uint64_t number = 0;  ///< its answer's
  Kind kind = Kind::kSwitch;
  std::uint32_t slot = 0;
  std::uint32_t start = 0, stop = 0;  ///< a bit per slot
  double within = 0.0;
  std::uint64_t cycles = 0;
  std::uint32_t joint = 0;
  hal::PidLoop loop = hal::PidLoop::kPosition;
  HostedController* controller = nullptr;
  JointRequest wish{};
  hal::PidGains gains{};  ///< NaN: stays
  MoveRequest move{};
  hal::LinkChange link{};
  const std::vector<ParameterChange>* changes = nullptr;  ///< the asking side's, until the answer
};

/// Why the loop did not do it: a row each in runtime/refusals.inc. Nothing has changed then.
enum class RejectReason : std::uint32_t {
  kNone,  ///< it is done
#define TANDEM_REFUSAL(name, words, hint) name,
#include "runtime/refusals.inc"
#undef TANDEM_REFUSAL
};

struct CycleAnswer {
  std::uint64_t number = 0;  ///< the request's
  std::uint64_t cycle = 0;   ///< in which it was done
  RejectReason reason = RejectReason::kNone;
  std::int32_t joint = -1;
  std::int32_t one = -1, other = -1;  ///< slots
};

}  // namespace tandem::runtime
