// The contract between the loop and whatever stands for the robot.
// Layer: hal.  Thread: the loop's, but for status_text() and fault_text(); made non-RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/cycle_time.hpp"
#include "hal/fault_kind.hpp"
#include "hal/homing.hpp"
#include "hal/image.hpp"
#include "hal/outside.hpp"
#include "hal/stop_category.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal {

/// Who paces the cycle.
enum class Pace : std::uint8_t {
  kWallClock,       ///< the loop sleeps to absolute wall-clock times
  kSimulatedClock,  ///< time is the count of cycles; the loop may run at any speed
  kBus,             ///< exchange() returns when the robot's cycle comes round
};

/// Where a backend stands between power-on and power-off.
enum class Phase : std::uint8_t {
  kBringUp,      ///< nodes are being configured and drives enabled, at first or by reset()
  kOperational,  ///< every axis follows the command
  kFault,        ///< latched; `status_text()` says the cause
};

/// What becomes other of the declared link to a robot far away. NaN: it stays.
struct LinkChange {
  static constexpr double kStays = std::numeric_limits<double>::quiet_NaN();

  double delay_s = kStays, jitter_s = kStays;
  double loss = kStays;         ///< a share of 1, at random
  bool up = true, down = true;  ///< of commands, of states
};

/// What of a state another process keeps.
struct KeptElsewhere {
  std::uint32_t number = 0;  ///< by which it is gone back to; 0: nothing is elsewhere
  std::uint32_t padding = 0;
  std::uint64_t bytes = 0;  ///< that it takes there
};

/// A robot: simulated, emulated behind a bus, or real.
class Backend {
 public:
  virtual ~Backend() = default;

  [[nodiscard]] virtual Pace pace() const noexcept = 0;
  [[nodiscard]] virtual Phase phase() const noexcept = 0;
  /// The cause of Phase::kFault, or what bring-up waits for ("LHip (node 3): waiting for …").
  [[nodiscard]] virtual std::string status_text() const = 0;

  /// Whether exchange() waits for somebody else's answers, which is no work of the cycle's own.
  [[nodiscard]] virtual bool waits_for_bus() const noexcept { return false; }

  /// First call of every cycle, the only one that may block: starts the exchange with the robot
  /// (SYNC goes out) and waits until the answers are there, or the time for them is over. A robot
  /// in this process has nothing to wait for.
  virtual void exchange(const CycleTime& /*time*/) noexcept {}

  /// Advances to cycle `time.cycle` and fills `state` from the robot's answers.
  /// A joint whose sample did not arrive keeps the last one and raises its age.
  /// @return kOk, kTimeout, kBusOff, kDiverged (simulation only), kFault.
  /// @rt no allocation, lock or throw; bounded by the number of nodes.
  [[nodiscard]] virtual Code read(const CycleTime& time, StateImage& state) noexcept TANDEM_RT = 0;

  /// Sends the command that takes effect at the next SYNC. Ignored during bring-up.
  /// @pre `command` has passed the command limits: finite and in range.
  [[nodiscard]] virtual Code write(const CommandImage& command,
                                   const ParameterImage& parameters) noexcept TANDEM_RT = 0;

  /// Why `joint` is in fault. @pre its fault code is not 0
  [[nodiscard]] virtual FaultCause fault_cause(std::size_t /*joint*/) const noexcept TANDEM_RT {
    return FaultCause::kDrive;
  }
  /// A cause and its joint's fault code in words: "following error (0x8611)". Any thread.
  [[nodiscard]] virtual std::string fault_text(FaultCause cause, std::uint32_t code) const;

  /// Latches a stop of every joint, kept until reset(): write() has no effect and phase() is kFault
  /// from now on. Of several the hardest is carried out; kWarn changes nothing. During bring-up it
  /// ends it. The drives hear of it in this cycle. A joint's own fault needs no call: the backend
  /// carries out its category by itself.
  virtual void stop(StopCategory category) noexcept TANDEM_RT = 0;
  /// Clears what stop() latched and what is latched in drives and nodes; then every joint is
  /// enabled at its measured position. phase() is kBringUp meanwhile, kOperational when every joint
  /// follows the command again, kFault when a cause is still there.
  virtual void reset() noexcept TANDEM_RT = 0;

  /// Whether CommandImage::fault_reset clears the fault of that joint alone.
  [[nodiscard]] virtual bool resets_one_joint() const noexcept TANDEM_RT { return true; }

  /// Begins the homing of `joint`, whose command is idle from now on until it has ended. Then it is
  /// held where it stands until its command is another one. A fault and a stop end it.
  /// @return false: the joint has no homing, is not enabled, or is another process' to home
  virtual bool home(std::size_t /*joint*/) noexcept TANDEM_RT { return false; }
  /// Halts it where it is; the joint is not homed then.
  virtual void stop_homing(std::size_t /*joint*/) noexcept TANDEM_RT {}
  /// What is known of the joint's place. A reset of faults changes nothing about it; a board that
  /// has lost its power does.
  [[nodiscard]] virtual Homing homing(std::size_t /*joint*/) const noexcept TANDEM_RT { return {}; }

  /// Asks the drives to stop and disable, category 1 (0 when that is latched): called each cycle
  /// until it answers true.
  [[nodiscard]] virtual bool shut_down() noexcept TANDEM_RT = 0;

  /// The controllers' last command, before the first shut_down(), where they were done in that very
  /// cycle. For a robot that another loop drives: it carries it out. Without this call that loop
  /// brings the joints to rest by itself, from the command before.
  virtual void last_command(const CommandImage& /*command*/) noexcept TANDEM_RT {}
  /// The command that the robot follows before it follows this loop's: that of the loop that owns
  /// it, to go on from. False: there is no such loop.
  [[nodiscard]] virtual bool command_in_force(CommandImage& /*command*/) const noexcept TANDEM_RT {
    return false;
  }
  /// Cycles of the robot's time that have gone by unseen just before this exchange().
  [[nodiscard]] virtual std::uint64_t missed() const noexcept TANDEM_RT { return 0; }

  /// By how much the next cycle should begin later [ns], so that the loop keeps its place in the
  /// time of a wire that has a clock. On the wall clock only.
  [[nodiscard]] virtual std::int64_t clock_shift_ns() const noexcept TANDEM_RT { return 0; }
  /// Loss on the link to a robot far away. A robot without one is heard in each cycle: kNone.
  [[nodiscard]] virtual FaultCause link_loss() const noexcept TANDEM_RT {
    return FaultCause::kNone;
  }
  /// Another declared link from now on, in simulated time. @return false: there is none
  virtual bool set_link(const LinkChange& /*change*/) noexcept TANDEM_RT { return false; }
  /// The next fault that was injected and has begun since, for the log; kNone: no more. A robot
  /// that is not in this process reports nothing.
  [[nodiscard]] virtual InjectedFault next_injected() noexcept TANDEM_RT { return {}; }

  /// Who takes something of other threads does so by this from now on; it outlives the cycles.
  virtual void heed(Outside& /*outside*/) noexcept {}

  /// Between two cycles: what other threads have given for the next one is dropped.
  /// @return how much
  virtual std::size_t forget_waiting() noexcept { return 0; }

  /// Writes or reads everything that the next read() depends on. Simulation only: a backend
  /// whose robot cannot be rewound answers false.
  [[nodiscard]] virtual bool archive(Archive& ar) = 0;

  // What of that state is in another process. Between two cycles; each may block, and takes heap.

  /// Has it kept, before archive() writes the rest.
  /// Errors: the other process does not answer, or cannot.
  [[nodiscard]] virtual Result<KeptElsewhere> keep() { return KeptElsewhere{}; }
  /// Before archive() reads the rest. Errors: keep()'s, and then nothing has changed; it is not
  /// kept.
  [[nodiscard]] virtual Status go_back(const KeptElsewhere& /*kept*/) { return {}; }
  /// It is gone back to no more.
  virtual void forget(const KeptElsewhere& /*kept*/) noexcept {}
};

}  // namespace tandem::hal
