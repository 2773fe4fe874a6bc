// What another thread asks the loop to do at a cycle's boundary, and what the loop answers.
// Layer: runtime.  Thread: the asking side one at a time (RunServices' mutex); the loop's is RT.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

#include "base/realtime.hpp"
#include "base/spsc_ring.hpp"
#include "hal/image.hpp"

namespace tandem::runtime {

struct HostedController;

/// What to set of a joint. What is negative or NaN stays.
struct JointRequest {
  static constexpr double kAsItIs = std::numeric_limits<double>::quiet_NaN();

  double stiffness_Nm_rad = kAsItIs;
  double damping_Nms_rad = kAsItIs;
  std::int32_t mode = -1;         ///< hal::ControlMode
  std::int32_t interaction = -1;  ///< hal::InteractionMode
};

struct LoopRequest {
  enum class Kind : std::uint32_t {
    kInsert,   ///< `controller` into `slot`
    kRemove,   ///< what is in `slot`
    kSwitch,   ///< the controllers of `stop` and `start`
    kGoOn,     ///< the controllers that a reset holds back
    kJoint,    ///< `wish` of `joint`
    kGains,    ///< `gains` of `joint` and `loop`
    kRecover,  ///< `joint`, back to its limits
  };
  std::uint64_t number = 0;  ///< its answer's
  Kind kind = Kind::kSwitch;
  std::uint32_t slot = 0;
  std::uint32_t start = 0, stop = 0;  ///< a bit per slot
  std::uint32_t joint = 0;
  hal::PidLoop loop = hal::PidLoop::kPosition;
  HostedController* controller = nullptr;
  JointRequest wish{};
  hal::PidGains gains{};
};

/// Why the loop did not do it. Nothing has changed then.
enum class RejectReason : std::uint32_t {
  kNone,        ///< it is done
  kEnding,      ///< the run shuts down
  kNotRunning,  ///< joints are held in this phase
  kConflict,    ///< `joint` would be claimed by `one` and `other`
  kGone,        ///< there is no such controller any more
  kActive,      ///< `one` is active, or is not, as asked for already
  kClaimed,     ///< `joint` is `one`'s
  kIncapable,   ///< `joint` lacks the mode
  kWithin,      ///< `joint` is within its limits
  kOtherMode,   ///< `joint` is not in position control
  kNotEnabled,  ///< nothing moves in this phase
  kNotHeld,     ///< no reset holds controllers back
  kRecovering,  ///< `joint`, which `one` claims, is on its way back to its limits
};

struct LoopAnswer {
  std::uint64_t number = 0;  ///< the request's
  std::uint64_t cycle = 0;   ///< in which it was done
  RejectReason refusal = RejectReason::kNone;
  std::int32_t joint = -1;
  std::int32_t one = -1, other = -1;  ///< slots
};

/// Two rings. A request waits until the loop takes it, in the order in which they were made.
class LoopMailbox {
 public:
  static constexpr std::size_t kCapacity = 16;  ///< requests that wait

  // The asking side's.
  /// False when the loop has not taken the last kCapacity requests.
  [[nodiscard]] bool ask(const LoopRequest& request) noexcept { return put(requests_, request); }
  /// The next answer, if there is one.
  [[nodiscard]] std::optional<LoopAnswer> take_answer() noexcept {
    return take<LoopAnswer>(answers_);
  }

  // The loop's.
  [[nodiscard]] std::optional<LoopRequest> take() noexcept TANDEM_RT {
    return take<LoopRequest>(requests_);
  }
  void answer(const LoopAnswer& answer) noexcept TANDEM_RT { (void)put(answers_, answer); }

 private:
  template <class T>
  static bool put(SpscRing& ring, const T& value) noexcept TANDEM_RT {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::span<std::byte> slot = ring.begin_push();
    if (slot.empty()) return false;
    std::memcpy(slot.data(), &value, sizeof value);
    ring.end_push();
    return true;
  }
  template <class T>
  static std::optional<T> take(SpscRing& ring) noexcept TANDEM_RT {
    const std::span<const std::byte> slot = ring.front();
    if (slot.empty()) return std::nullopt;
    T value;
    std::memcpy(&value, slot.data(), sizeof value);
    ring.pop();
    return value;
  }

  SpscRing requests_{sizeof(LoopRequest), kCapacity};
  // Every request that waits has room for its answer, and so have those that nobody awaits.
  SpscRing answers_{sizeof(LoopAnswer), 8 * kCapacity};
};

}  // namespace tandem::runtime
