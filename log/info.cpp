// RunInfo to the metadata record `tandem` and back, lists as lines.
#include "log/info.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "base/bounds.hpp"

namespace tandem::log {
namespace {

constexpr std::int64_t kShortest_ns = 1'000, kLongest_ns = 10'000'000'000;  // that a period can be
constexpr const char* kOperatorsView = "of a tele-operator";

/// Lines of "name" or "name count", as many as a log may have.
std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::size_t begin = 0;
  while (begin < text.size() && lines.size() < bounds::kLogNames.most) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return lines;
}

}  // namespace

StringMap to_map(const RunInfo& info) {
  std::string joints;
  for (const std::string& joint : info.joints) joints += joint + "\n";
  std::string sensors;
  for (const SensorInfo& sensor : info.sensors) {
    sensors += sensor.name + " " + std::to_string(sensor.channels) + "\n";
  }
  StringMap map{{"version", info.version},
                {"robot", info.robot},
                {"hal", info.hal},
                {"joints", joints},
                {"sensors", sensors},
                {"seed", std::to_string(info.seed)},
                {"period_ns", std::to_string(info.period_ns)},
                {"kernel_variant", info.kernel_variant},
                {"description_hash", info.description_hash}};
  std::string controllers;
  for (const std::string& one : info.controllers) controllers += one + "\n";
  std::string parameters;
  for (const std::string& one : info.parameters) parameters += one + "\n";
  std::string active;
  for (const std::string& one : info.active) active += one + "\n";
  std::string options;
  for (const std::string& one : info.options) options += one + "\n";
  std::string plant;
  for (const std::string& one : info.plant) plant += one + "\n";
  for (const auto& [key, value] : {std::pair{"host", &info.host},
                                   {"started", &info.started},
                                   {"time_zone", &info.time_zone},
                                   {"kernel_sha256", &info.kernel_sha256},
                                   {"controllers", &std::as_const(controllers)},
                                   {"parameters", &std::as_const(parameters)},
                                   {"active_controllers", &std::as_const(active)},
                                   {"options", &std::as_const(options)},
                                   {"plant", &std::as_const(plant)},
                                   {"ground", &info.ground}}) {
    if (!value->empty()) map.emplace_back(key, *value);
  }
  if (info.part > 0) map.emplace_back("part", std::to_string(info.part));
  if (!info.branch.of.empty()) {
    map.emplace_back("branch_of", info.branch.of);
    map.emplace_back("branch_cycle", std::to_string(info.branch.cycle));
    map.emplace_back("branch_snapshot", std::to_string(info.branch.snapshot));
  }
  if (!info.reduced.empty()) map.emplace_back("reduced", info.reduced);
  if (info.operators_view) map.emplace_back("state", kOperatorsView);
  if (!info.engine.empty()) map.emplace_back("engine", info.engine);
  if (!info.integrator.empty()) map.emplace_back("integrator", info.integrator);
  return map;
}

RunInfo info_from(const StringMap& map) {
  RunInfo info;
  info.version = value_of(map, "version");
  info.robot = value_of(map, "robot");
  info.hal = value_of(map, "hal");
  info.joints = lines_of(value_of(map, "joints"));
  for (const std::string& line : lines_of(value_of(map, "sensors"))) {
    const std::size_t space = std::min(line.rfind(' '), line.size());
    const std::string count = space < line.size() ? line.substr(space + 1) : "0";
    const std::uint64_t channels = std::strtoull(count.c_str(), nullptr, 10);
    info.sensors.push_back(
        {line.substr(0, space), std::min<std::uint64_t>(channels, bounds::kLogNames.most)});
  }
  info.part = std::strtoull(value_of(map, "part").c_str(), nullptr, 10);
  info.branch = {.of = value_of(map, "branch_of"),
                 .cycle = std::strtoull(value_of(map, "branch_cycle").c_str(), nullptr, 10),
                 .snapshot = std::strtoull(value_of(map, "branch_snapshot").c_str(), nullptr, 10)};
  info.reduced = value_of(map, "reduced");
  info.seed = std::strtoull(value_of(map, "seed").c_str(), nullptr, 10);
  info.period_ns = std::strtoll(value_of(map, "period_ns").c_str(), nullptr, 10);
  if (info.period_ns < kShortest_ns || info.period_ns > kLongest_ns) info.period_ns = 0;
  info.operators_view = value_of(map, "state") == kOperatorsView;
  info.engine = value_of(map, "engine");
  info.integrator = value_of(map, "integrator");
  info.kernel_variant = value_of(map, "kernel_variant");
  info.description_hash = value_of(map, "description_hash");
  info.host = value_of(map, "host");
  info.started = value_of(map, "started");
  info.time_zone = value_of(map, "time_zone");
  info.kernel_sha256 = value_of(map, "kernel_sha256");
  info.controllers = lines_of(value_of(map, "controllers"));
  info.parameters = lines_of(value_of(map, "parameters"));
  info.active = lines_of(value_of(map, "active_controllers"));
  info.options = lines_of(value_of(map, "options"));
  info.plant = lines_of(value_of(map, "plant"));
  info.ground = value_of(map, "ground");
  return info;
}

std::string value_of(const StringMap& map, std::string_view key) {
  for (const auto& [name, value] : map) {
    if (name == key) return value;
  }
  return {};
}

}  // namespace tandem::log
