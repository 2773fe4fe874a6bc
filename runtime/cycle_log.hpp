// A run's images and events, as the log gets them.
// Layer: runtime.  Thread: made non-RT; the rest RT.
#pragma once

#include "base/realtime.hpp"
#include "hal/cycle_time.hpp"
#include "hal/estimate.hpp"
#include "hal/fault_kind.hpp"
#include "hal/image.hpp"
#include "hal/truth.hpp"
#include "log/recorder.hpp"

namespace tandem::runtime {

class ControllerHost;
class InputPort;
struct HostedController;

/// The channels of state, command, truth, estimate and inputs, and the events. Without a recorder
/// it does nothing.
class CycleLog {
 public:
  /// Adds its channels and starts the recorder. The layouts are those of the images shown.
  /// @param recorder  null: nothing is logged. Outlives it.
  /// @param truth, estimate  null: there is none
  /// @param controllers  a channel of each input of those that are loaded
  CycleLog(log::Recorder* recorder, const hal::StateImage& state, const hal::CommandImage& command,
           const hal::TruthImage* truth, const hal::EstimateImage* estimate,
           ControllerHost& controllers);

  /// For simulated time, which can wait: blocks until so many messages have room.
  void wait_for_space(std::size_t messages) {
    if (recorder_ != nullptr) recorder_->wait_for_space(messages);
  }
  /// @param joint  -1: none
  /// @param value  of the kinds that have one
  /// @param reported  a fault that stops nothing
  void event(const hal::CycleTime& time, log::EventKind kind, std::int32_t joint = -1,
             std::uint32_t code = 0, float value = 0.0F, bool reported = false) noexcept TANDEM_RT;
  void event(const hal::CycleTime& time, const hal::InjectedFault& fault) noexcept TANDEM_RT;
  /// Channels of the inputs of a controller that is loaded while the run goes on. From one thread
  /// at a time, before the loop has it. False: one of them is too large.
  [[nodiscard]] bool add(const HostedController& controller);
  /// A sample that has arrived.
  void input(const hal::CycleTime& time, InputPort& port) noexcept TANDEM_RT;
  void images(const hal::CycleTime& time, const hal::StateImage& state,
              const hal::CommandImage& command, const hal::TruthImage* truth,
              const hal::EstimateImage* estimate) noexcept TANDEM_RT;
  /// Messages that found no room.
  [[nodiscard]] std::uint64_t dropped() const noexcept TANDEM_RT {
    return recorder_ == nullptr ? 0 : recorder_->dropped();
  }

 private:
  log::Recorder* recorder_;
  int inputs_ = 0;  // that have channels
  log::Recorder::Channel state_ = 0, command_ = 0, truth_ = 0, estimate_ = 0;
};

}  // namespace tandem::runtime
