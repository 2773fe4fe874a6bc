// What ended or disturbed a run, noted in the cycle without heap.
// Layer: runtime.  Thread: RT to note, any to read afterwards.
#pragma once

#include <cstdint>
#include <string>

#include "base/realtime.hpp"

namespace tandem::runtime {

enum class FaultSource : std::uint8_t {
  kDrive,       ///< a drive reports an error; `code` is its CiA 402 error code
  kJointLost,   ///< no feedback of a joint for too long; `code` is its age in cycles
  kSensorLost,  ///< the same of a sensor
  kBackend,     ///< read, write or the backend as a whole; `code` is a Code
  kController,  ///< a controller gave up; `code` is a Code
  kCommand,     ///< a controller's command was not finite
  kOverrun,     ///< too many late cycles
  kBringUp,     ///< the drives were not enabled in time
};

struct FaultRecord {
  std::uint64_t cycle = 0;
  std::int64_t time_ns = 0;
  std::int32_t index = -1;  ///< joint, sensor or controller, as the source says
  std::uint32_t code = 0;
  FaultSource source = FaultSource::kBackend;
  std::uint8_t padding[7] = {};
};

/// A fault as the result tells it.
struct Fault {
  std::uint64_t cycle = 0;
  double time_s = 0.0;
  std::string joint;  ///< joint, sensor or controller; empty when the robot as a whole
  std::string text;   ///< one sentence, without `joint`
};

}  // namespace tandem::runtime
