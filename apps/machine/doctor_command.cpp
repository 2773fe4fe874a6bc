// `tandem doctor`: prints what it finds of the machine, as a table or as JSON.
#include <fmt/core.h>

#include <algorithm>

#include "apps/can/can_sockets.hpp"
#include "apps/machine/commands.hpp"
#include "apps/machine/doctor.hpp"
#include "apps/text/console.hpp"
#include "base/counted.hpp"
#include "robot/robot_files.hpp"

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

Json clocks_json(const std::vector<ClockFinding>& clocks) {
  Json list = Json::array();
  for (const ClockFinding& one : clocks) {
    list.push_back({{"bus", one.bus},
                    {"slave", one.slave},
                    {"name", one.name},
                    {"delay_ns", one.delay_ns},
                    {"difference_ns", one.difference_ns},
                    {"jitter_ns", one.jitter_ns}});
  }
  return list;
}

/// Looks at the slaves behind each EtherCAT interface that frames can be sent on.
void look_at_lines(const hal::RobotConfig& robot, std::vector<Finding>& findings,
                   std::vector<ClockFinding>& clocks) {
  for (const hal::BusConfig& bus : robot.buses) {
    if (bus.kind != hal::BusKind::kEthercat) continue;
    const bool bad = std::ranges::any_of(findings, [&bus](const Finding& one) {
      return one.health == Health::kMissing &&
             (one.name == bus.interface || one.name.starts_with(bus.interface + " "));
    });
    if (bad) continue;
    const LineFindings line = look_at_line(robot, bus);
    findings.insert(findings.end(), line.findings.begin(), line.findings.end());
    clocks.insert(clocks.end(), line.clocks.begin(), line.clocks.end());
  }
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
  std::vector<ClockFinding> clocks;
  if (options.robot.empty() && !options.interfaces.empty()) {
    return refuse(fail("--interface replaces those of a robot, and none is named",
                       "tandem doctor ROBOT.toml --interface " + options.interfaces.front())
                      .error());
  }
  if (!options.robot.empty()) {
    auto robot = robot::read_robot(options.robot);
    if (!robot) return refuse(robot.error());
    if (Status done = replace_interfaces(robot->config, options.interfaces); !done) {
      return refuse(done.error());
    }
    const auto is_can = [](const hal::BusConfig& bus) { return bus.kind == hal::BusKind::kCan; };
    if (std::ranges::none_of(robot->config.buses, is_can)) {
      std::erase_if(findings, [](const Finding& one) { return one.name == kCanSupport; });
    }
    const std::vector<Finding> more = examine_interfaces(machine, robot->config);
    findings.insert(findings.end(), more.begin(), more.end());
    if (options.root == "/") look_at_lines(robot->config, findings, clocks);
  }
  std::FILE* out = human_output(options.json);
  print_findings(findings, out);
  print_verdict(findings, out);
  Json json{{"findings", findings_json(findings)}};
  json["clocks"] = clocks_json(clocks);
  if (const Status s = write_json(options.json, json); !s) return refuse(s.error());
  return Exit::kDone;
}

}  // namespace tandem::apps
