// Where the loop meets an owner of its robot in another process: it shows each cycle, and follows.
// Layer: hal.  Thread: the loop's; each call says what it may do.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "base/realtime.hpp"
#include "hal/backend.hpp"
#include "hal/image.hpp"
#include "hal/run_phase.hpp"
#include "hal/stop_category.hpp"

namespace tandem::hal {

/// A cycle as it is before its controllers run. References are good during the call.
struct PortView {
  CycleTime time;
  RunPhase phase;
  Code read_code;         ///< of the backend's read()
  StopCategory reaction;  ///< the hardest stop that is latched; kWarn: none
  const StateImage& state;
  const CommandImage& command;           ///< of the last cycle: what the joints follow
  std::span<const std::uint8_t> causes;  ///< (n) FaultCause of every joint in fault
};

/// What the owner wants in a cycle. Pointers are good until the next exchange().
struct RemoteCommand {
  bool live = false;      ///< `command` is to be followed
  bool done = false;      ///< it gives the robot back; live: with `command` as its last
  bool ends_run = false;  ///< with `done`: nobody else is waited for
  FaultCause loss = FaultCause::kNone;         ///< why the owner lost the robot, reported once
  StopCategory on_loss = StopCategory::kWarn;  ///< with `loss`: kWarn holds every joint
  StopCategory stop = StopCategory::kWarn;     ///< asked for since the last exchange()
  bool reset = false;                          ///< asked for since the last exchange()
  std::uint64_t reset_cycle = 0;  ///< with it: the cycle that the owner had seen when it asked
  const CommandImage* command = nullptr;
  const ParameterImage* gains = nullptr;  ///< null: as they were
};

class RemoteCommandPort {
 public:
  virtual ~RemoteCommandPort() = default;

  /// In lockstep each cycle waits for the command that was computed from it: the loop calls send()
  /// and wait_until_ns() then, outside of its real-time part.
  [[nodiscard]] virtual bool lockstep() const noexcept = 0;
  /// Lockstep: shows the cycle. May block.
  virtual void send(const PortView& view) noexcept = 0;
  /// Lockstep: 0 when the cycle has nothing to wait for (any more), else when to ask again at the
  /// latest, on CLOCK_MONOTONIC. May block.
  [[nodiscard]] virtual std::int64_t wait_until_ns(const PortView& view) noexcept = 0;

  /// Once per cycle: shows it when that was not done by send(), and takes the newest command.
  /// @rt wait-free
  [[nodiscard]] virtual RemoteCommand exchange(const PortView& view) noexcept TANDEM_RT = 0;

  /// `ring` is called on another thread whenever wait_until_ns() may have another answer. An empty
  /// one ends that: it is not called any more afterwards.
  virtual void on_news(std::function<void()> ring) = 0;
};

}  // namespace tandem::hal
