// What a condition can name: every number of a run's images and of its controllers' signals.
// Layer: runtime/condition.  Thread: found non-RT; read() the loop's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/cycle_observer.hpp"
#include "hal/robot.hpp"
#include "log/info.hpp"

namespace tandem::runtime {

/// Where a number is in a cycle.
struct Quantity {
  enum class Of : std::uint8_t { kState, kCommand, kTruth, kEstimate, kSignals, kLoop };
  /// Who says whether it has been measured.
  enum class Known : std::uint8_t {
    kAlways,
    kByAge,   ///< the element of the state's ages at `known_at`
    kByFlag,  ///< the byte of its own image at `known_at`
  };

  Of of = Of::kState;
  hal::FieldType type = hal::FieldType::kF64;
  Known known = Known::kAlways;
  bool tilt = false;  ///< the angle of the quaternion that begins here to the vertical
  std::size_t offset = 0;
  std::size_t length = sizeof(double);  ///< bytes that are read there
  std::size_t known_at = 0;
  double factor = 1.0;                            ///< from the image's unit to `unit`
  std::string unit;                               ///< of read(), SI: "rad"; empty: it has none
  std::shared_ptr<const hal::SignalBlock> block;  ///< kSignals

  /// In this cycle. NaN when nobody has measured it yet: a sample that is older than the run, an
  /// estimate that has not started, an image that is not there, a controller that wrote nothing in
  /// this cycle because it is stopped or has gone.
  /// @rt no heap, no lock
  [[nodiscard]] double read(const hal::CycleView& view) const noexcept TANDEM_RT;
};

/// A controller's signals, by its name.
struct NamedSignals {
  std::string controller;
  std::shared_ptr<const hal::SignalBlock> block;
};

/// What the names of a run mean. Nothing of it is kept, but the signals' blocks.
struct QuantityNames {
  const hal::Robot& robot;
  const hal::Layout& state;
  const hal::Layout& command;
  const hal::Layout* truth = nullptr;     ///< null: the robot is not simulated
  const hal::Layout* estimate = nullptr;  ///< null: nothing is estimated
  std::vector<NamedSignals> signals{};    ///< of every loaded controller that has some
};

/// A quantity by its short name and argument: `torque(LKneeSag)`, `height()`; or by its path, as
/// the studio and the log have it: `state.torque_nm.LKneeSag`, `controller/squat.depth`, also
/// `squat.depth`; `signal(PATH)` is the same for names with other characters.
/// @param function  "torque"; empty: `argument` is a path
/// Errors: an unknown name, with the nearest; an image that the run lacks.
[[nodiscard]] Result<Quantity> find_quantity(std::string_view function, std::string_view argument,
                                             const QuantityNames& names);

/// Names of the robot's parts, as log::signal_name() takes them.
[[nodiscard]] log::RunInfo names_in_log(const hal::Robot& robot);

/// A short name, for help and docs.
struct QuantityWords {
  std::string_view call;   ///< "torque(JOINT)"
  std::string_view words;  ///< "state.torque_nm: the spring's on the link"
};
[[nodiscard]] std::vector<QuantityWords> quantity_words();

}  // namespace tandem::runtime
