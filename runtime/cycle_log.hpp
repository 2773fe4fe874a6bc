// A run's images and events, as the log gets them.
// Layer: runtime.  Thread: made non-RT; the rest RT.
#pragma once

#include <string_view>

#include "base/realtime.hpp"
#include "hal/cycle_time.hpp"
#include "hal/estimate.hpp"
#include "hal/fault_kind.hpp"
#include "hal/image.hpp"
#include "hal/truth.hpp"
#include "log/recorder.hpp"

namespace tandem::runtime {

/// The channels of state, command, truth and estimate, and the events. Without a recorder it does
/// nothing.
class CycleLog {
 public:
  /// Adds its channels and starts the recorder. The layouts are those of the images shown.
  /// @param recorder  null: nothing is logged. Outlives it.
  /// @param truth, estimate  null: there is none
  CycleLog(log::Recorder* recorder, const hal::StateImage& state, const hal::CommandImage& command,
           const hal::TruthImage* truth, const hal::EstimateImage* estimate);

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
  /// A controller's parameter was set. @param name  "squat.link_damping_Nms_rad"
  void event(const hal::CycleTime& time, std::string_view name, double value) noexcept TANDEM_RT;
  void images(const hal::CycleTime& time, const hal::StateImage& state,
              const hal::CommandImage& command, const hal::TruthImage* truth,
              const hal::EstimateImage* estimate) noexcept TANDEM_RT;
  /// Messages that found no room.
  [[nodiscard]] std::uint64_t dropped() const noexcept TANDEM_RT {
    return recorder_ == nullptr ? 0 : recorder_->dropped();
  }

 private:
  log::Recorder* recorder_;
  log::Recorder::Channel state_ = 0, command_ = 0, truth_ = 0, estimate_ = 0;
};

}  // namespace tandem::runtime
