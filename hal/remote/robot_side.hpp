// Control that stays at the robot's end of a link: balance, whatever happens to the operator's
// commands.
// Layer: hal/remote.  Thread: the loop's.
#pragma once

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/cycle_time.hpp"
#include "hal/image.hpp"

namespace tandem::remote {

class RobotSide {
 public:
  virtual ~RobotSide() = default;
  /// The link begins to work. @param state  of the robot, now
  virtual void start(const hal::CycleTime& time, const hal::StateImage& state,
                     hal::CommandImage& command) noexcept TANDEM_RT = 0;
  /// Replaces the operator's references of its own joints.
  /// @return kOk, else the robot is stopped (category 1)
  [[nodiscard]] virtual Code update(const hal::CycleTime& time, const hal::StateImage& state,
                                    hal::CommandImage& command) noexcept TANDEM_RT = 0;
  virtual void archive(Archive& ar) = 0;
};

}  // namespace tandem::remote
