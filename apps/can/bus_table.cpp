#include "apps/can/bus_table.hpp"

#include <fmt/core.h>

#include "hal/ethercat-can/bus_load.hpp"

namespace tandem::apps {
namespace {

using hal::can::BusLoad;
using hal::can::BusLoadRow;

constexpr double kMega = 1e6;

const char* kind_name(BusLoadRow::Kind kind) {
  switch (kind) {
    case BusLoadRow::Kind::kUrgent: return "urgent";
    case BusLoadRow::Kind::kMean: return "mean";
    case BusLoadRow::Kind::kOnChange: return "on_change";
  }
  return "";
}

/// With the period that it is a load of.
struct BusRow {
  BusLoadRow row;
  double period_us = 0.0;
};

std::string rates(const BusLoad& load) {
  const double nominal = static_cast<double>(load.rates.nominal) / kMega;
  const bool two = load.kind == hal::BusKind::kCan && load.fd;
  const std::string data =
      two ? fmt::format(" and {:g}", static_cast<double>(load.rates.data) / kMega) : "";
  return fmt::format("{}, {:g}{} Mbit/s", hal::can::wire_name(load.kind, load.fd), nominal, data);
}

std::string percent(double share) { return fmt::format("{:.1f} %", 100.0 * share); }

void print(const BusLoad& load, std::FILE* out) {
  fmt::print(out, "bus {} ({}), worst case in a cycle of {:g} us\n", load.bus, rates(load),
             load.period_us());
  Table table({"", "frames", "bits", "us", "load"});
  for (const BusLoadRow& row : load.rows) {
    const bool counts = row.kind != BusLoadRow::Kind::kOnChange;
    table.add({row.what + (counts ? "" : ", if all changed"), fmt::format("{:.2f}", row.frames),
               fmt::format("{:.0f}", row.bits), fmt::format("{:.1f}", row.time_us),
               (counts ? "" : "+ ") + percent(row.time_us / load.period_us())});
  }
  table.add({"urgent", "", "", fmt::format("{:.1f}", load.urgent_us),
             percent(load.urgent_us / load.period_us()) + " of 100 %"});
  table.add({"all", "", "", fmt::format("{:.1f}", load.load * load.period_us()),
             fmt::format("{} of {:g} %", percent(load.load), 100.0 * load.max_load)});
  table.print(out);
  fmt::print(out, "{}\n\n", load.fits() ? "fits" : "does not fit; " + load.remedy);
}

}  // namespace

static void figures(Figures& f, const BusRow& row) {
  f("what", row.row.what);
  f("kind", "`urgent`, `mean`, `on_change`", kind_name(row.row.kind));
  f("frames", "per cycle, as the next three", row.row.frames);
  f("bits", row.row.bits);
  f("time_us", row.row.time_us);
  f("load", "a share of the cycle", row.row.time_us / row.period_us);
}

void figures(Figures& f, const BusLoad& load) {
  std::vector<BusRow> rows;
  for (const BusLoadRow& row : load.rows) rows.push_back({row, load.period_us()});
  f("bus", load.bus);
  f("kind", "`can`, `ethercat`", load.kind == hal::BusKind::kCan ? "can" : "ethercat");
  f("fd", load.kind == hal::BusKind::kCan && load.fd);
  f("bitrate", load.rates.nominal);
  f("data_bitrate", load.rates.data);
  f("period_us", load.period_us());
  f("rows", "one kind of traffic each: [wire.md](wire.md#bus-load)", rows);
  f("urgent_us", "what every cycle must carry", load.urgent_us);
  f("load", "a share", load.load);
  f("load_if_all_changed", "a share, with every slow command in every cycle", load.most_load);
  f("max_load", "of robot.toml", load.max_load);
  f("ok", load.fits());
  f("remedy", "empty when it fits", load.remedy);
}

Diagnostics show_buses(const hal::RobotConfig& robot, std::int64_t period_ns, std::FILE* out,
                       Json& json) {
  json = Json::array();
  const auto loads = hal::can::bus_loads(robot, period_ns);
  if (!loads) {
    Error error = loads.error();
    error.file = robot.file;
    return {error};
  }
  for (const BusLoad& load : *loads) {
    print(load, out);
    json.push_back(figures_json(load));
  }
  return {};
}

}  // namespace tandem::apps
