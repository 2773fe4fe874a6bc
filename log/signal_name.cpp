// "position_rad.elbow", "sensor.left_foot.2": the element's joint or sensor, where it has one.
#include "log/signal_name.hpp"

namespace tandem::log {

std::string signal_name(const hal::Field& field, std::size_t index, const RunInfo& info) {
  if (field.count == 1) return field.name;
  if (field.name == "sensor") {
    std::size_t first = 0;
    for (const SensorInfo& sensor : info.sensors) {
      if (index < first + sensor.channels) {
        return "sensor." + sensor.name + "." + std::to_string(index - first);
      }
      first += sensor.channels;
    }
  }
  if (field.count == info.joints.size()) return field.name + "." + info.joints[index];
  return field.name + "." + std::to_string(index);
}

}  // namespace tandem::log
