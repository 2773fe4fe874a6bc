// Faults on purpose: when each begins and ends, and what it does to the frames that pass.
// Layer: hal/sim.  Thread: add() between cycles; the rest the emulated robot's.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/realtime.hpp"
#include "canopen/frame.hpp"
#include "hal/fault_kind.hpp"

namespace tandem {
class Archive;
}

namespace tandem::sim {

/// Which way a frame goes. A fault may act on both.
enum class FrameDirection : std::uint8_t { kToBoards = 1, kToMaster = 2, kBoth = 3 };

/// What a fault's time counts from.
enum class FaultFrom : std::uint8_t {
  kPowerOn,  ///< the first SYNC
  kEnabled,  ///< the first time that every axis is in Operation Enabled
};

enum class EncoderSide : std::uint8_t { kLink, kMotor };

/// A push's course from its begin to its end; the force that is given is its greatest.
enum class PushShape : std::uint8_t {
  kStep,      ///< all of it at once
  kHalfSine,  ///< sin(pi s), s from 0 to 1
  kTriangle,  ///< up to the middle and down again
};

/// One fault, its target by index in the robot's configuration. Plain data without padding.
struct ScenarioFault {
  std::int64_t start_ns = 0;      ///< after `from`
  std::int64_t duration_ns = -1;  ///< -1: for good
  std::int64_t ramp_ns = 0;       ///< in which a sag or a temperature is reached
  double value = 0.0;  ///< jump [rad, or m of a slide], supply [V], winding [degC], payload [kg]
  double probability = 1.0;           ///< that a selected frame is struck
  std::uint64_t seed = 0;             ///< of what is random in it
  std::array<double, 3> force_N{};    ///< in W, or in the body with `turns`
  std::array<double, 3> torque_Nm{};  ///< beside it, in the same frame
  std::array<double, 3> point_m{};    ///< where it acts, in the body's frame (its joint's);
                                      ///< a payload: in the link's
  /// A payload's: xx xy xz yy yz zz about its center of mass, along the link's axes.
  std::array<double, 6> inertia_kg_m2{};
  std::int32_t bus = -1;  ///< -1: any
  std::int32_t board = -1;
  std::int32_t sensor = -1;
  std::int32_t joint = -1;    ///< of a payload: that moves its link; -1: none of the image
  std::uint32_t node_id = 0;  ///< frames whose COB-ID carries it; 0: any
  std::uint32_t cob_id = 0;
  std::uint32_t cob_mask = 0;  ///< bits of the COB-ID that have to agree; 0: any
  std::uint32_t count = 0;     ///< most frames that are struck; 0: no limit
  std::uint32_t steps = 1;     ///< that a frame is delayed
  std::uint32_t bits = 1;      ///< that are flipped in a frame
  std::int32_t length = -1;    ///< that a frame gets; -1: its own
  std::uint32_t number = 0;    ///< product code, revision; of a payload and a push: which row of
                               ///< the experiment, from 1, 0: none of them
  hal::FaultKind kind = hal::FaultKind::kNone;
  FaultFrom from = FaultFrom::kPowerOn;
  FrameDirection direction = FrameDirection::kBoth;
  EncoderSide encoder = EncoderSide::kLink;
  std::int32_t link = -1;  ///< of the description's tree; a push: -1: the joint's
  PushShape shape = PushShape::kStep;
  std::uint8_t turns = 0;  ///< 1: a push turns with the body
  std::array<std::uint8_t, 6> reserved{};
};
static_assert(sizeof(ScenarioFault) == 232);

/// As the loop sees it: what it strikes, the narrowest that it names.
[[nodiscard]] constexpr hal::InjectedFault injected(const ScenarioFault& fault) noexcept {
  using hal::FaultTarget;
  if (fault.kind == hal::FaultKind::kPush && fault.number != 0)
    return {.kind = fault.kind, .index = static_cast<std::int32_t>(fault.number)};
  if (fault.joint >= 0) return {fault.kind, FaultTarget::kJoint, fault.joint};
  if (fault.board >= 0) return {fault.kind, FaultTarget::kBoard, fault.board};
  if (fault.sensor >= 0) return {fault.kind, FaultTarget::kSensor, fault.sensor};
  if (fault.bus >= 0) return {fault.kind, FaultTarget::kBus, fault.bus};
  return {.kind = fault.kind};
}

[[nodiscard]] constexpr bool is_frame_fault(hal::FaultKind kind) noexcept {
  return kind >= hal::FaultKind::kFrameDrop && kind <= hal::FaultKind::kFrameReorder;
}

/// A fault with where it stands.
struct FaultSlot {
  ScenarioFault fault;
  std::uint64_t random = 0;  ///< its generator's state
  std::uint32_t struck = 0;  ///< frames
  std::uint8_t active = 0;
  std::uint8_t began = 0;  ///< in this step
  std::uint8_t ended = 0;  ///< in this step
  std::uint8_t acted = 0;  ///< ever
  std::uint8_t told = 0;   ///< 1: next_begun() gave it; 2: next_over(), too
  std::array<std::uint8_t, 7> reserved{};
};
static_assert(sizeof(FaultSlot) == 256);

/// ```
/// faults.begin_step(time_ns, enabled_ns);
/// for (const FaultSlot& slot : faults.slots()) …      // what acts on boards, joints and supply
/// while (faults.next_due(direction, bus, frame)) …    // frames that were late
/// faults.pass(direction, bus, frame, out);            // each frame: none, one or several
/// ```
/// Deterministic: what is random comes from a generator per fault, seeded by the run's seed, the
/// fault's and its number.
class FaultInjection {
 public:
  static constexpr std::size_t kMostFaults = 64;
  static constexpr std::size_t kMostHeld = 256;     ///< frames; beyond it a frame is not delayed
  static constexpr std::size_t kMostFramesOut = 8;  ///< that one pass() gives

  explicit FaultInjection(std::uint64_t seed) noexcept : seed_(seed) {}

  /// How many may still be added: a push that is over makes room.
  [[nodiscard]] std::size_t room() const noexcept TANDEM_RT;
  /// @return false: there is no room
  [[nodiscard]] bool add(const ScenarioFault& fault) noexcept TANDEM_RT;

  /// Begins and ends faults: those whose time has come act on the whole step to `time_ns`.
  /// @param time_ns     since the first SYNC
  /// @param enabled_ns  when every axis was enabled, on the same clock; below 0: not yet
  void begin_step(std::int64_t time_ns, std::int64_t enabled_ns) noexcept TANDEM_RT;

  /// False as long as nothing was ever injected: nothing needs to be asked.
  [[nodiscard]] bool any() const noexcept { return count_ > 0; }
  [[nodiscard]] std::span<const FaultSlot> slots() const noexcept {
    return {slots_.data(), count_};
  }

  /// What becomes of one frame, in `out`: at most kMostFramesOut.
  void pass(FrameDirection direction, std::size_t bus, const canopen::Frame& frame,
            canopen::FrameSink& out) noexcept TANDEM_RT;
  /// What happens to an Ethernet frame of an EtherCAT bus: kFrameDrop, kFrameDelay (it comes with
  /// the next cycle's), kFrameDuplicate, or kNone.
  [[nodiscard]] hal::FaultKind fate(FrameDirection direction, std::size_t bus) noexcept TANDEM_RT;
  /// The next delayed frame whose step has come.
  [[nodiscard]] bool next_due(FrameDirection direction, std::size_t bus,
                              canopen::Frame& frame) noexcept TANDEM_RT;

  /// The next fault that has begun and was not given yet; null: none.
  [[nodiscard]] const FaultSlot* next_begun() noexcept TANDEM_RT;
  /// The next payload or push that is over after next_begun() gave it; null: none.
  [[nodiscard]] const FaultSlot* next_over() noexcept TANDEM_RT;
  /// The fault of a slot that one of these gave: on any thread that knows of it.
  [[nodiscard]] const ScenarioFault& fault(std::size_t slot) const noexcept {
    return slots_[std::min(slot, kMostFaults - 1)].fault;
  }

  void archive(Archive& ar);
  /// After archive() has read another one's: these slots are as in `own`, and none has acted in
  /// either. @param alone  there are no others
  void come_later(const FaultInjection& own, std::span<const std::size_t> slots, bool alone);

 private:
  struct Held {
    std::uint64_t due = 0;  ///< step
    std::uint32_t bus = 0;
    std::uint32_t slot = 0;
    FrameDirection direction = FrameDirection::kToBoards;
    std::array<std::uint8_t, 7> reserved{};
    canopen::Frame frame;
  };
  static_assert(sizeof(Held) == 96);

  [[nodiscard]] std::size_t free_slot() const noexcept TANDEM_RT;
  [[nodiscard]] bool strikes(FaultSlot& slot) noexcept;
  [[nodiscard]] bool hold(std::size_t slot, std::uint64_t due, FrameDirection direction,
                          std::size_t bus, const canopen::Frame& frame) noexcept;
  void take_held(std::size_t index, canopen::Frame& frame) noexcept;
  [[nodiscard]] std::size_t held_by(std::size_t slot, FrameDirection direction,
                                    std::size_t bus) const noexcept;

  std::array<FaultSlot, kMostFaults> slots_{};
  std::size_t count_ = 0;
  std::array<Held, kMostHeld> held_{};
  std::size_t held_count_ = 0;
  std::uint64_t step_ = 0;
  std::uint64_t seed_;
};

}  // namespace tandem::sim
