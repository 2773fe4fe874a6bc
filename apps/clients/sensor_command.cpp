// tandem sensor list: what it asks a running run, and its answer.
#include <fmt/core.h>

#include <string>
#include <utility>
#include <vector>

#include "apps/clients/asked.hpp"
#include "apps/clients/named.hpp"
#include "apps/text/console.hpp"

namespace tandem::apps {
namespace {

/// "0.1  -2  308", or what there is instead of a sample.
std::string values_of(const Json& sensor, const char* key) {
  if (!sensor.value("valid", false)) return "-";
  std::string text;
  for (const Json& value : sensor[key]) {
    text += text.empty() ? "" : "  ";
    text += value.is_number() ? fmt::format("{:.4g}", value.get<double>()) : "-";
  }
  return text;
}

std::string age_of(const Json& sensor) {
  const auto cycles = sensor.value("age_cycles", 0U);
  if (!sensor.value("valid", false)) return fmt::format("no sample for {} cycles", cycles);
  return cycles == 0 ? "fresh" : fmt::format("{} cycles", cycles);
}

void print_sensors(const Json& sensors) {
  if (sensors.empty()) return fmt::print("the robot has no sensors\n");
  Table table({"sensor", "joint", "frame", "measures", "x y z (w)", "sample"});
  table.align_left();
  for (const Json& sensor : sensors) {
    std::vector<std::string> row{sensor.value("sensor", ""), sensor.value("joint", ""),
                                 sensor.value("link", "")};
    std::string age = age_of(sensor);
    for (const auto& [key, what] : {std::pair{"force_N", "force [N]"},
                                    {"torque_Nm", "torque [Nm]"},
                                    {"orientation_xyzw", "orientation"},
                                    {"angular_velocity_rad_s", "rate [rad/s]"},
                                    {"specific_force_m_s2", "specific force [m/s2]"}}) {
      if (!sensor.contains(key)) continue;
      row.insert(row.end(), {what, values_of(sensor, key), std::exchange(age, "")});
      table.add(std::exchange(row, {"", "", ""}));
    }
  }
  table.print(stdout);
}

}  // namespace

Result<Exit> tell_sensors(Asked& asked) {
  const Result<Json> some = named(asked.answer["sensors"], "sensor", asked.texts("sensors"));
  if (!some) return std::unexpected(some.error());
  asked.answer["sensors"] = *some;
  if (asked.prints()) print_sensors(*some);
  return Exit::kDone;
}

}  // namespace tandem::apps
