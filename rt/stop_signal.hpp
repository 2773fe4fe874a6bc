// Signals that end the process otherwise, as Ctrl-C, and SIGUSR1 as emergency stop: flags that the
// loop looks at once per cycle. Layer: rt.  Thread: any.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"

namespace tandem::rt {

/// From now on no signal ends the process at once that somebody sends to end it: the first SIGINT,
/// SIGTERM, SIGHUP, SIGQUIT, SIGUSR2, SIGPWR or SIGSTKFLT sets the stop flag, as SIGXCPU and
/// real-time signals do; but for SIGINT and SIGTERM only where its action is the default one. A
/// second one (not of SIGXCPU, real-time signals) does what the first would have done before, so
/// that a hung program can still be ended. Within kOneSignal_ns of the first it is the same one: a
/// key that bounces, a terminal and a supervisor that both pass it on. SIGALRM, SIGVTALRM, SIGPROF,
/// SIGIO, SIGPIPE and SIGXFSZ are ignored from now on, where nobody handles them.
void install_stop_signals();
inline constexpr std::int64_t kOneSignal_ns = 200'000'000;

/// From now on the first of them does again what it would have done before: for what comes after
/// the loop, and looks at no flag.
void remove_stop_signals();

/// True once a stop was requested, by a signal or by request_stop().
[[nodiscard]] bool stop_requested() noexcept TANDEM_RT;

/// The first signal that requested it; 0: none, or request_stop() did.
[[nodiscard]] int stop_signal() noexcept;

/// Sets the flag. Safe in a signal handler.
void request_stop() noexcept;

/// Clears the flag, before the next run of the same process: its first signal is a first one again.
void clear_stop() noexcept;

/// From now on each SIGUSR1 is an emergency stop.
void install_emergency_signal();

/// Who asked for an emergency stop.
enum class EmergencyStop : std::uint8_t { kNone, kBySignal, kOnRequest };

/// The same without a signal, from any thread: for who is asked while there is no loop to pass it
/// on to.
void request_emergency_stop() noexcept;

/// Whether an emergency stop was asked for that nobody has taken yet.
[[nodiscard]] bool emergency_stop_waits() noexcept TANDEM_RT;

/// The newest emergency stop since the last call; kNone: there was none.
[[nodiscard]] EmergencyStop take_emergency_stop() noexcept TANDEM_RT;

}  // namespace tandem::rt
