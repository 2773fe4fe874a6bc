// Is this machine fit for real time? Each finding with what was found and what mends it.
// Layer: apps/machine.  Thread: main.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/machine/machine.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::apps {

enum class Health : std::uint8_t {
  kOk,
  kWarning,  ///< works, with worse latencies or less room
  kMissing,  ///< a run on a robot will lack it
};
[[nodiscard]] const char* to_string(Health health);

/// The name of the finding about CAN in the kernel.
inline constexpr char kCanSupport[] = "kernel's CAN";

struct Finding {
  std::string name;  ///< "kernel"
  Health health = Health::kOk;
  std::string value;  ///< as found
  std::string why;    ///< what it means; empty when all is well
  std::string mend;   ///< the command that mends it; empty when there is none or nothing to mend
};

/// Kernel, CPUs, interrupts, limits of the user, memory: what no configuration is needed for.
[[nodiscard]] std::vector<Finding> examine_machine(const Machine& machine);

/// The CAN interfaces of a robot's buses: there, up, as fast as robot.toml says, with room to queue
/// a cycle's frames, brought back after bus-off.
[[nodiscard]] std::vector<Finding> examine_interfaces(const Machine& machine,
                                                      const hal::RobotConfig& robot);

}  // namespace tandem::apps
