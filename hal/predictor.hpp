// What will happen, asked from within the cycle: the simulation run ahead of the robot.
// Layer: hal.  Thread: prepare() non-RT, before the run; the rest the loop's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"

namespace tandem::hal {

/// Longest horizon of a prediction.
inline constexpr std::int64_t kMostHorizon_ns = 10'000'000'000;

/// Why a prediction has no more cycles.
enum class PredictionEnd : std::uint8_t {
  kHorizon,    ///< as many as were asked for
  kRunOver,    ///< the run would be over, by its time or by a fault
  kDiverged,   ///< the simulation left the plausible range
  kCancelled,  ///< the run ended, or a newer one was asked for
};
[[nodiscard]] constexpr const char* to_string(PredictionEnd end) noexcept {
  switch (end) {
    case PredictionEnd::kHorizon: return "horizon";
    case PredictionEnd::kRunOver: return "run over";
    case PredictionEnd::kDiverged: return "diverged";
    case PredictionEnd::kCancelled: return "cancelled";
  }
  return "?";
}

/// A trajectory, one row a cycle. Row i is cycle first_cycle + i. Link side; m and N of a prismatic
/// joint. Joints are in the image's order.
struct Prediction {
  std::uint64_t first_cycle = 0;  ///< the first that had not happened when it was asked for
  std::int64_t period_ns = 1'000'000;
  std::size_t joints = 0;
  std::size_t cycles = 0;  ///< rows; the vectors may be longer
  PredictionEnd end = PredictionEnd::kHorizon;
  std::vector<double> reference_rad;  ///< [cycles * joints], as it goes to the drives
  std::vector<double> position_rad;   ///< [cycles * joints]
  std::vector<double> torque_Nm;      ///< [cycles * joints]
  std::vector<double> base;  ///< [cycles * 7]: position in W [m], quaternion x y z w, base to W
  double cpu_s = 0.0;        ///< that running ahead took on its thread
  double wall_s = 0.0;       ///< from the snapshot to the end

  /// A joint's row in one of the vectors: `row(position_rad, i)[joint]`.
  [[nodiscard]] const double* row(const std::vector<double>& of, std::size_t cycle) const noexcept {
    return of.data() + cycle * joints;
  }
};

/// Runs the robot ahead of its time on another thread: from a snapshot between two cycles, with
/// the controllers as they are then, on the simulated robot, or on the internal model beside a real
/// one ([parallel]). The robot's own cycle goes on meanwhile.
///
/// In simulated time the loop stands until the answer is there: it is asked for in update() of one
/// cycle and there in that of the next, whatever the machine's load, so that runs stay a function
/// of configuration and seed. On a clock the answer is there when it is there.
class Predictor {
 public:
  virtual ~Predictor() = default;

  /// In configure(): allocates for horizons up to that.
  /// Errors: a horizon of less than a cycle or more than kMostHorizon_ns.
  [[nodiscard]] virtual Status prepare(std::int64_t horizon_ns) = 0;

  /// Asks for the horizon from the end of this cycle. One that has not been answered yet is
  /// cancelled. A controller that is itself part of a prediction is not answered.
  /// @return false: nothing that long was prepared. @rt wait-free.
  virtual bool ask(std::int64_t horizon_ns) noexcept TANDEM_RT = 0;

  /// The newest answer, until the next call; null: there is none yet. @rt wait-free.
  [[nodiscard]] virtual const Prediction* newest() noexcept TANDEM_RT = 0;
};

}  // namespace tandem::hal
