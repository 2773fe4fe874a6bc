// What a robot's cyclic traffic asks of each of its buses, against what the wire can carry.
// Layer: hal/ethercat-can.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/frame_time.hpp"

namespace tandem::hal::can {

/// One kind of traffic, per cycle of the loop, at worst-case length.
struct BusLoadRow {
  enum class Kind : std::uint8_t {
    kUrgent,    ///< of every cycle
    kMean,      ///< now and then: the mean per cycle
    kOnChange,  ///< what it would be if it came every cycle; does not count
  };
  std::string what;
  Kind kind = Kind::kUrgent;
  double frames = 0.0;
  double bits = 0.0;  ///< at both rates
  double time_us = 0.0;
};

/// One bus at one period.
struct BusLoad {
  std::string bus;
  BusKind kind = BusKind::kCan;
  bool fd = true;
  BitRates rates;
  std::int64_t period_ns = 0;
  double max_load = 0.0;  ///< of the configuration, a share
  std::vector<BusLoadRow> rows;
  double urgent_us = 0.0;  ///< what every cycle must carry
  double load = 0.0;       ///< mean share of the wire's time; slow commands are left out
  double most_load = 0.0;  ///< the same with every slow command in every cycle
  std::string remedy;      ///< what would fit, computed; empty when it fits as it is

  [[nodiscard]] double period_us() const { return static_cast<double>(period_ns) * 1e-3; }
  /// Whether a real bus carries it: what is urgent within the period, and the mean load.
  [[nodiscard]] bool fits() const { return urgent_us <= period_us() && load <= max_load; }
};

/// "CAN FD", "classic CAN", "EtherCAT".
[[nodiscard]] std::string wire_name(BusKind kind, bool fd);

/// Every [[bus]], in the configuration's order. docs/wire.md says what is counted.
/// Errors: those of make_pdo_layout().
[[nodiscard]] Result<std::vector<BusLoad>> bus_loads(const RobotConfig& robot,
                                                     std::int64_t period_ns);

/// An error for each bus that cannot carry its traffic at this period, with the arithmetic and
/// what would fit; or the layout's error.
[[nodiscard]] Diagnostics check_bus_load(const RobotConfig& robot, std::int64_t period_ns);

}  // namespace tandem::hal::can
