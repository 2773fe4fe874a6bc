// The loop's part of an owner in another process: shown each cycle, followed, and left.
// Layer: runtime.  Thread: the loop's.
#pragma once

#include <cstdint>
#include <vector>

#include "hal/remote_command.hpp"
#include "runtime/fault_response.hpp"

namespace tandem::runtime {

/// Does nothing where CycleParts::owner is empty.
class OwnerFollower {
 public:
  /// All outlive it.
  OwnerFollower(CycleNow& now, JointArbiter& arbiter, FaultResponse& response);
  ~OwnerFollower();

  /// In lockstep: blocks until the owner's command for this cycle is there, or there is something
  /// else to do.
  void await() noexcept;
  /// @return what it wants: the reset is left, until every stop of the cycle is known
  hal::RemoteCommand follow() noexcept TANDEM_RT;

 private:
  [[nodiscard]] bool is_active() const noexcept TANDEM_RT;
  void assign(bool owned) noexcept TANDEM_RT;
  void take_gains(const hal::ParameterImage& wanted) noexcept TANDEM_RT;
  [[nodiscard]] hal::PortView view() noexcept TANDEM_RT;

  CycleNow& now_;
  JointArbiter& arbiter_;
  FaultResponse& response_;
  hal::RemoteCommandPort* port_;
  std::vector<std::uint8_t> causes_;  // as it is shown them
};

}  // namespace tandem::runtime
