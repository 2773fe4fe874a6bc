// Is this machine fit for real time? Each finding with what was found and what mends it.
// Layer: apps/machine.  Thread: main.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/machine/machine.hpp"
#include "apps/text/figures.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/line/line_survey.hpp"

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

/// How well one slave's clock follows the line's reference.
struct ClockFinding {
  std::string bus;
  std::size_t slave = 0;  ///< place in the line, 0 the first
  std::string name;       ///< in robot.toml
  std::uint32_t delay_ns = 0;
  std::int64_t difference_ns = 0;  ///< the largest, without its sign
  double jitter_ns = 0.0;          ///< standard deviation
};

/// The slaves behind an interface, and their clocks.
struct DoctorResult {
  std::vector<Finding> findings;
  std::vector<ClockFinding> clocks;
};
void figures(Figures& f, const DoctorResult& result);

/// What a survey says about the bus: another master, slaves that are not there or are others than
/// robot.toml's, clocks that do not follow.
/// @param bus  an EtherCAT one of `robot`
[[nodiscard]] DoctorResult judge_line(const hal::RobotConfig& robot, const hal::BusConfig& bus,
                                      const hal::ecat::SurveyTiming& timing,
                                      const hal::ecat::LineSurvey& survey);

/// Surveys the line behind the bus' interface; moves nothing, and sends nothing while another
/// master is at work.
[[nodiscard]] DoctorResult look_at_line(const hal::RobotConfig& robot, const hal::BusConfig& bus);

}  // namespace tandem::apps
