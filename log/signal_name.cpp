// "position_rad.elbow", "sensor.left_foot.fz_N": the element's joint or sensor, where it has one.
#include "log/signal_name.hpp"

#include <algorithm>
#include <string_view>

#include "hal/robot.hpp"
#include "hal/wire_name.hpp"

namespace tandem::log {
namespace {

/// A row of the images' tables: its count is named there, or a number.
struct Row {
  std::string_view name, count;
};

constexpr Row kFieldRows[] = {
#define TANDEM_FIELD(type, name, count, doc) {#name, #count},
#include "hal/boards_fields.inc"
#include "hal/command_fields.inc"
#include "hal/estimate_fields.inc"
#include "hal/state_fields.inc"
#include "hal/truth_fields.inc"
#undef TANDEM_FIELD
};

/// The count that the tables say: "joints"; empty of a field that is not ours.
std::string_view count_of(const hal::Field& field) {
  const std::string name = hal::wire_name(field.name);
  const auto* row = std::ranges::find_if(
      kFieldRows, [&](const Row& one) { return hal::wire_name(one.name) == name; });
  return row == std::end(kFieldRows) ? std::string_view() : row->count;
}

/// What a sensor's channels measure, by how many it has: of hal::SensorType.
constexpr std::string_view kForceTorque[] = {"fx_N", "fy_N", "fz_N", "tx_Nm", "ty_Nm", "tz_Nm"};
constexpr std::string_view kImu[] = {"qx",       "qy",       "qz",      "qw",      "wx_rad_s",
                                     "wy_rad_s", "wz_rad_s", "ax_m_s2", "ay_m_s2", "az_m_s2"};
static_assert(std::size(kForceTorque) == hal::channels_of(hal::SensorType::kForceTorque));
static_assert(std::size(kImu) == hal::channels_of(hal::SensorType::kImu));

/// "fx_N"; of a sensor that is none of ours its number.
std::string channel_name(std::size_t channels, std::size_t index) {
  if (channels == std::size(kForceTorque)) return std::string(kForceTorque[index]);
  if (channels == std::size(kImu)) return std::string(kImu[index]);
  return std::to_string(index);
}

/// Whether a robot may have one of them or more, so that one has its name or number, too.
bool is_numbered(std::string_view count) {
  constexpr std::string_view kCounts[] = {"joints", "feet",    "sensors",
                                          "loops",  "passive", "wrenches"};
  return std::ranges::find(kCounts, count) != std::end(kCounts);
}

}  // namespace

std::string_view named_by(const hal::Field& field, const RunInfo& info) {
  const std::string_view count = count_of(field);
  if (field.count == 1 && !is_numbered(count) && count != "channels") return {};
  const auto channels = [&] {
    std::size_t sum = 0;
    for (const SensorInfo& sensor : info.sensors) sum += sensor.channels;
    return sum;
  };
  if (count == "channels") return field.count == channels() ? count : std::string_view();
  if (count == "sensors") return field.count == info.sensors.size() ? count : std::string_view();
  // The count of another's field says it; a controller's signal says it itself.
  const bool signal = count.empty() && field.doc.starts_with('[');
  const bool per_joint = signal ? field.doc.find("] by joint: ") != std::string::npos
                                : count.empty() || count == "joints";
  return per_joint && field.count == info.joints.size() ? "joints" : std::string_view();
}

std::string element_name(const hal::Field& field, std::size_t index, const RunInfo& info) {
  const std::string_view by = named_by(field, info);
  if (by == "joints") return info.joints[index];
  if (by == "sensors") return info.sensors[index].name;
  for (const SensorInfo& sensor : info.sensors) {
    if (index < sensor.channels) return sensor.name + "." + channel_name(sensor.channels, index);
    index -= sensor.channels;
  }
  return {};
}

std::string signal_name(const hal::Field& field, std::size_t index, const RunInfo& info) {
  if (!named_by(field, info).empty()) return field.name + "." + element_name(field, index, info);
  if (field.count == 1 && !is_numbered(count_of(field))) return field.name;
  return field.name + "." + std::to_string(index);
}

}  // namespace tandem::log
