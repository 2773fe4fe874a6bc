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
#include "runtime/controller_host.hpp"

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
  CycleLog(log::Recorder* recorder, const hal::StateImage& state, const hal::CommandImage& command,
           const hal::TruthImage* truth, const hal::EstimateImage* estimate);

  /// Channels of what a controller declared. Any thread but the loop's, before the loop has it.
  void open(HostedController& controller);

  /// For simulated time, which can wait: blocks until so many messages have room.
  void wait_for_space(std::size_t messages) {
    if (!silent()) recorder_->wait_for_space(messages);
  }
  /// @param joint  -1: none
  /// @param value  of the kinds that have one
  /// @param reported  a fault that stops nothing
  /// @param controller  whose doing it is; -1: nobody's
  /// @param met  the command that it is about
  void event(const hal::CycleTime& time, log::EventKind kind, std::int32_t joint = -1,
             std::uint32_t code = 0, float value = 0.0F, bool reported = false,
             std::int32_t controller = -1, const hal::LimitMet& met = {}) noexcept TANDEM_RT;
  void event(const hal::CycleTime& time, const hal::InjectedFault& fault) noexcept TANDEM_RT;
  /// A controller's parameter was set, or came with it.
  void event(const hal::CycleTime& time, log::EventKind kind,
             const ParameterChange& change) noexcept TANDEM_RT;
  /// What the cycle took of somebody, or of the backend, beside its images.
  void given(const hal::CycleTime& time, log::Given given) noexcept TANDEM_RT {
    if (silent()) return;
    given.cycle = time.cycle;
    given.time_ns = time.time_ns;
    recorder_->push(given);
  }
  /// A sample that has arrived.
  void input(const hal::CycleTime& time, InputPort& port) noexcept TANDEM_RT;
  void images(const hal::CycleTime& time, const hal::StateImage& state,
              const hal::CommandImage& command, const hal::TruthImage* truth,
              const hal::EstimateImage* estimate) noexcept TANDEM_RT;
  /// What a controller has in this cycle.
  void signals(const hal::CycleTime& time, const HostedController& controller) noexcept TANDEM_RT;
  void marks(const hal::CycleTime& time, const HostedController& controller) noexcept TANDEM_RT;
  void text(const hal::TextEvent& event) noexcept TANDEM_RT {
    if (!silent()) recorder_->push(event);
  }
  /// While on, cycles leave nothing: they are in the log already. Between two cycles.
  void mute(bool on) noexcept { muted_ = on; }
  /// The next cycle follows from another one than the last in the log: a file of its own begins.
  void branch(const log::Branch& from) {
    if (recorder_ != nullptr) recorder_->branch(from);
  }
  /// Messages that found no room.
  [[nodiscard]] std::uint64_t dropped() const noexcept TANDEM_RT {
    return recorder_ == nullptr ? 0 : recorder_->dropped();
  }

 private:
  [[nodiscard]] bool silent() const noexcept TANDEM_RT { return recorder_ == nullptr || muted_; }

  log::Recorder* recorder_;
  bool muted_ = false;
  int inputs_ = 0;  // that have channels
  log::Recorder::Channel state_ = 0, command_ = 0, truth_ = 0, estimate_ = 0;
};

}  // namespace tandem::runtime
