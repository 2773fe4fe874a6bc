// "position_rad.elbow", "sensor.left_foot.2": the element's joint or sensor, where it has one.
#include "log/signal_name.hpp"

#include <algorithm>
#include <string_view>

#include "hal/wire_name.hpp"

namespace tandem::log {
namespace {

/// A row of the images' tables: its count is named there, or a number.
struct Row {
  std::string_view name, count;
};

constexpr Row kRows[] = {
#define TANDEM_FIELD(type, name, count, doc) {#name, #count},
#include "hal/command_fields.inc"
#include "hal/estimate_fields.inc"
#include "hal/state_fields.inc"
#include "hal/truth_fields.inc"
#undef TANDEM_FIELD
};

/// Whether the field has one element per joint. Of a field that is not ours its count says it.
bool is_per_joint(const hal::Field& field, const RunInfo& info) {
  if (field.count != info.joints.size()) return false;
  const std::string name = hal::wire_name(field.name);
  const auto* row =
      std::ranges::find_if(kRows, [&](const Row& one) { return hal::wire_name(one.name) == name; });
  return row == std::end(kRows) || row->count == "joints";
}

}  // namespace

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
  if (is_per_joint(field, info)) return field.name + "." + info.joints[index];
  return field.name + "." + std::to_string(index);
}

}  // namespace tandem::log
