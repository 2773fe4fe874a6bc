// What others ask of the loop (cycle_request.hpp): done and answered once a cycle.
// Layer: runtime.  Thread: the loop's.
#pragma once

#include <string_view>

#include "runtime/cycle_request.hpp"
#include "runtime/fault_response.hpp"

namespace tandem::runtime {

class RunServices;

/// The requests of a run: joins what carries them out. All outlive it.
struct CycleRequests {
  CycleNow& now;
  DriveResets& resets;
  JointHoming& homing;
  JointArbiter& arbiter;
  WaitingControllers& waiting;
  const FaultResponse& response;
  RunServices& services;

  /// Those that wait, in their order, after every stop of the cycle.
  void carry_out() noexcept TANDEM_RT;
  /// After them, also where nobody is heard: the switch that waits for its shadows.
  void carry_out_waiting() noexcept TANDEM_RT;
};

/// "joint.move": as `tandem ask` calls it.
[[nodiscard]] std::string_view asked_as(CycleRequest::Kind kind) noexcept TANDEM_RT;

}  // namespace tandem::runtime
