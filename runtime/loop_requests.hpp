// What others ask of the loop (loop_request.hpp): done and answered once a cycle.
// Layer: runtime.  Thread: the loop's.
#pragma once

#include "runtime/fault_response.hpp"
#include "runtime/inbox.hpp"

namespace tandem::runtime {

class LoopRequests {
 public:
  /// All outlive it.
  LoopRequests(CycleNow& now, Inbox& inbox, DriveResets& resets, JointHoming& homing,
               JointArbiter& arbiter, WaitingControllers& waiting, const FaultResponse& response)
      : now_(now),
        inbox_(inbox),
        resets_(resets),
        homing_(homing),
        arbiter_(arbiter),
        waiting_(waiting),
        response_(response) {}

  /// Those that wait, in their order, after every stop of the cycle.
  void carry_out() noexcept TANDEM_RT;

 private:
  [[nodiscard]] LoopAnswer carry_out(const LoopRequest& request) noexcept TANDEM_RT;
  [[nodiscard]] LoopAnswer remove(std::size_t slot) noexcept TANDEM_RT;
  [[nodiscard]] LoopAnswer switch_over(const LoopRequest& request) noexcept TANDEM_RT;
  [[nodiscard]] LoopAnswer move(const LoopRequest& request) noexcept TANDEM_RT;
  void set_gains(const LoopRequest& request) noexcept TANDEM_RT;
  void log(const LoopRequest& request) noexcept TANDEM_RT;

  CycleNow& now_;
  Inbox& inbox_;
  DriveResets& resets_;
  JointHoming& homing_;
  JointArbiter& arbiter_;
  WaitingControllers& waiting_;
  const FaultResponse& response_;
};

}  // namespace tandem::runtime
