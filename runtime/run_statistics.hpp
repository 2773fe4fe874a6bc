// Figures of a run, gathered in the cycle: tracking of each joint, forces on the ground, the
// base. Plain sums, no heap.
// Layer: runtime.  Thread: made non-RT; take() RT; results when the loop has stopped.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "hal/command_limits.hpp"
#include "hal/estimate.hpp"
#include "hal/image.hpp"
#include "hal/truth.hpp"

namespace tandem::runtime {

/// Reference minus measured position of one joint, over the cycles in which it had one: those in
/// position control, and those in which a controller wrote one in another mode.
struct TrackingError {
  double rms_rad = 0.0;
  double max_rad = 0.0;  ///< of the absolute value
  std::uint64_t cycles = 0;
};

/// What the joints did: torque times velocity, as measured, over the cycles in which controllers
/// ran.
struct WorkFigures {
  double done_J = 0.0;       ///< sum over the joints that drove
  double taken_J = 0.0;      ///< sum over those that braked, positive
  double max_power_W = 0.0;  ///< the largest of all joints together: braking ones count negative
};

/// From the plant's truth, over the cycles in which controllers ran and the base was free.
struct GroundFigures {
  double weight_N = 0.0;                ///< mass times gravity, as ground() was told
  double mean_vertical_force_N = 0.0;   ///< of all feet together
  double max_foot_slip_m = 0.0;         ///< horizontal way of a foot since it touched down
  std::int64_t from_ns = 0, to_ns = 0;  ///< the first and the last of those cycles
};
/// From the plant's truth, from the first cycle with controllers and a free base until the drives
/// are disabled at the end: a fall after a fault counts, too.
struct BaseFigures {
  double min_height_m = 0.0;  ///< of the base's origin above W's
  double max_height_m = 0.0;
  double final_tilt_rad = 0.0;  ///< angle between the base's z axis and W's
  double max_tilt_rad = 0.0;
};

/// The largest of one component of an estimate, and when.
struct Peak {
  double value = 0.0;
  std::int64_t time_ns = 0;  ///< nominal, of the cycle; 0 where `value` is

  void take(double other, std::int64_t at_ns) noexcept {
    if (other > value) *this = {other, at_ns};
  }
};

/// Peaks of the wrench at one [[estimation.wrench]], or on the base: norms of force and moment.
struct WrenchFigures {
  Peak force_N, moment_Nm;
};

/// What the loop estimated while the controllers ran.
struct EstimateFigures {
  std::uint64_t base_cycles = 0;  ///< in which the base's estimate had started
  /// Cycles of these with a free base and a truth; in them the largest angle between the two
  /// directions that are upwards, and error of the base's height. 0 without a truth.
  std::uint64_t compared = 0;
  double max_tilt_error_rad = 0.0;
  double max_height_error_m = 0.0;
  std::vector<double> max_external_Nm;  ///< of each joint, absolute; empty without an observer
  WrenchFigures base_wrench;            ///< external, about the base's origin; 0 on a fixed base
  std::vector<WrenchFigures> wrenches;  ///< of each declared place, in their order
  Peak unexplained_Nm;                  ///< of external torques that these wrenches do not explain
};

/// From the plant's truth: how far one closed loop was open at most, over every cycle.
struct ClosureFigures {
  double max_position_error_m = 0.0;
  double max_velocity_error_m_s = 0.0;
};

/// Lines that controllers said in the whole run, and those that were too many (TextEventSlots).
struct TextFigures {
  std::uint64_t said = 0, left_out = 0;
};

class RunStatistics {
 public:
  /// @param feet, loops  of the truth image; 0 without one.
  /// @param wrenches     of the estimate; 0 without one
  RunStatistics(std::size_t joints, std::size_t feet, std::size_t loops = 0,
                std::size_t wrenches = 0);

  /// A cycle in which the controllers ran. `truth` and `estimate` may be null; `limits` are
  /// CommandLimits' own.
  void take(const hal::StateImage& state, const hal::CommandImage& command,
            const hal::TruthImage* truth, std::span<const hal::LimitCounters> limits,
            const hal::EstimateImage* estimate = nullptr) noexcept TANDEM_RT;
  /// A cycle before the shut-down, with controllers or without. `truth` may be null.
  void take_base(const hal::TruthImage* truth) noexcept TANDEM_RT;

  /// What a controller said in a cycle.
  void take_texts(const TextFigures& more) noexcept TANDEM_RT {
    texts_.said += more.said;
    texts_.left_out += more.left_out;
  }

  [[nodiscard]] const TextFigures& texts() const noexcept { return texts_; }
  [[nodiscard]] std::vector<TrackingError> tracking() const;
  /// Per joint: cycles in which a controller's command was not what the joint was given.
  [[nodiscard]] std::vector<std::uint64_t> limited_cycles() const;
  /// Empty when no joint told its torque and velocity.
  [[nodiscard]] std::optional<WorkFigures> work(double period_s) const;
  /// Empty when there was no truth, no foot, or no cycle with a free base.
  [[nodiscard]] std::optional<GroundFigures> ground(double weight_N) const;
  [[nodiscard]] std::optional<BaseFigures> base() const;

  [[nodiscard]] EstimateFigures estimate() const;

  /// Per loop; empty when there was no truth.
  [[nodiscard]] const std::vector<ClosureFigures>& loops() const { return loops_; }

  void archive(Archive& ar);

 private:
  struct Error {
    double square_sum = 0.0;
    double max = 0.0;
    std::uint64_t count = 0;
  };
  struct Limited {
    std::uint64_t count = 0;   // of CommandLimits, in the last cycle that was taken
    std::uint64_t cycles = 0;  // in which it grew
  };
  struct FootSlip {
    double anchor_x = 0.0, anchor_y = 0.0;  // where it touched down
    std::uint64_t touching = 0;
  };
  void take_work(const hal::StateImage& state) noexcept TANDEM_RT;
  void take_ground(const hal::TruthImage& truth) noexcept TANDEM_RT;
  void take_estimate(const hal::EstimateImage& estimate,
                     const hal::TruthImage* truth) noexcept TANDEM_RT;

  std::vector<Error> errors_;
  std::vector<Limited> limited_;
  std::uint64_t cycles_ = 0;
  double driving_W_ = 0.0, braking_W_ = 0.0, max_power_W_ = 0.0;  // sums over cycles; the largest
  std::uint64_t powered_ = 0;                                     // cycles with a joint's power
  std::vector<FootSlip> feet_;
  std::vector<ClosureFigures> loops_;
  std::uint64_t base_cycles_ = 0, compared_ = 0;  // of the estimate
  double tilt_error_rad_ = 0.0, height_error_m_ = 0.0;
  std::vector<double> external_Nm_;  // of each joint: the largest
  WrenchFigures base_wrench_;
  std::vector<WrenchFigures> wrenches_;
  Peak unexplained_Nm_;
  std::uint64_t free_cycles_ = 0;
  double force_sum_N_ = 0.0, slip_m_ = 0.0;
  std::int64_t free_from_ns_ = 0, free_to_ns_ = 0;
  BaseFigures base_;
  std::uint64_t base_free_ = 0;  // it was, once
  TextFigures texts_;
};

}  // namespace tandem::runtime
