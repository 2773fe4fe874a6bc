// `tandem doctor`: prints what it finds of the machine, as a table or as JSON.
#include <fmt/core.h>

#include <algorithm>

#include "apps/machine/commands.hpp"
#include "apps/machine/doctor.hpp"
#include "apps/robot/robot_files.hpp"
#include "apps/text/console.hpp"
#include "base/counted.hpp"

namespace tandem::apps {
namespace {

Json findings_json(const std::vector<Finding>& findings) {
  Json list = Json::array();
  for (const Finding& one : findings) {
    list.push_back({{"name", one.name},
                    {"health", to_string(one.health)},
                    {"value", one.value},
                    {"why", one.why},
                    {"mend", one.mend}});
  }
  return list;
}

void print_findings(const std::vector<Finding>& findings, std::FILE* out) {
  Table table({"health", "finding", "value"});
  table.align_left();
  for (const Finding& one : findings) table.add({to_string(one.health), one.name, one.value});
  table.print(out);
  std::size_t number = 0;
  for (const Finding& one : findings) {
    if (one.health == Health::kOk) continue;
    fmt::print(out, "{}\n  {}: {}", number++ == 0 ? "\n  What to do:" : "", one.name, one.why);
    if (!one.mend.empty()) fmt::print(out, "\n    {}", one.mend);
  }
  if (number > 0) fmt::print(out, "\n");
}

void print_verdict(const std::vector<Finding>& findings, std::FILE* out) {
  const auto count = [&findings](Health health) {
    return static_cast<std::uint64_t>(std::ranges::count(findings, health, &Finding::health));
  };
  fmt::print(out, "\n  {} ok, {}, {} missing\n", count(Health::kOk),
             counted(count(Health::kWarning), "warning"), count(Health::kMissing));
}

}  // namespace

Exit doctor_command(const DoctorOptions& options) {
  if (const Status s = check_writable(options.json); !s) return refuse(s.error());
  const Machine machine(options.root);
  std::vector<Finding> findings = examine_machine(machine);
  if (!options.robot.empty()) {
    const auto robot = read_robot(options.robot);
    if (!robot) return refuse(robot.error());
    const auto is_can = [](const hal::BusConfig& bus) { return bus.kind == hal::BusKind::kCan; };
    if (std::ranges::none_of(robot->config.buses, is_can)) {
      std::erase_if(findings, [](const Finding& one) { return one.name == kCanSupport; });
    }
    const std::vector<Finding> more = examine_interfaces(machine, robot->config);
    findings.insert(findings.end(), more.begin(), more.end());
  }
  std::FILE* out = human_output(options.json);
  print_findings(findings, out);
  print_verdict(findings, out);
  const Json json{{"findings", findings_json(findings)}};
  if (const Status s = write_json(options.json, json); !s) return refuse(s.error());
  return Exit::kDone;
}

}  // namespace tandem::apps
