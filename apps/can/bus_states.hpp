// How the buses of a run are: state, load, and how each node answers.
// Layer: apps/can.  Thread: made by main; json() any, beside the loop.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "apps/can/can_sockets.hpp"
#include "apps/text/figures.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/can_backend.hpp"

namespace tandem::apps {

class BusStates {
 public:
  /// @param backend  of these buses; null: there are none. All that is passed outlives this.
  BusStates(std::span<const OpenBus> buses, const hal::RobotConfig& robot, std::int64_t period_ns,
            const hal::can::CanBackend* backend);

  /// docs/json.md, `buses` of `loop.show`.
  [[nodiscard]] Json json() const;

 private:
  std::span<const OpenBus> buses_;
  const hal::RobotConfig* robot_;
  const hal::can::CanBackend* backend_;
  std::vector<double> planned_;  // by bus: what `tandem check --bus` computes
};

}  // namespace tandem::apps
