// `tandem doctor`: prints what it finds of the machine, as a table or as JSON.
#include <fmt/core.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "apps/can/can_sockets.hpp"
#include "apps/machine/commands.hpp"
#include "apps/machine/doctor.hpp"
#include "apps/machine/doctor_fix.hpp"
#include "apps/text/console.hpp"
#include "base/counted.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {

static void figures(Figures& f, const Finding& one) {
  f("name", one.name);
  f("health", "`ok`, `warning`, `missing`", std::string(to_string(one.health)));
  f("value", "as found", one.value);
  f("why", "what it means; empty when all is well", one.why);
  f("mend", "the command that fixes it; empty when there is none", one.mend);
}

static void figures(Figures& f, const ClockFinding& one) {
  f("bus", one.bus);
  f("slave", "its place, from 0", one.slave);
  f("name", one.name);
  f("delay_ns", "of a frame from the reference clock, one way", one.delay_ns);
  f("difference_ns", "the largest, without its sign", one.difference_ns);
  f("jitter_ns", "standard deviation of the difference", one.jitter_ns);
}

void figures(Figures& f, const DoctorResult& result) {
  f("findings", result.findings);
  f("clocks", "of each EtherCAT slave whose clock was measured and that follows another",
    result.clocks);
}

namespace {

/// Looks at the slaves behind each EtherCAT interface that frames can be sent on.
void look_at_lines(const hal::RobotConfig& robot, DoctorResult& result) {
  std::vector<Finding>& findings = result.findings;
  for (const hal::BusConfig& bus : robot.buses) {
    if (bus.kind != hal::BusKind::kEthercat) continue;
    const bool bad = std::ranges::any_of(findings, [&bus](const Finding& one) {
      return one.health == Health::kMissing &&
             (one.name == bus.interface || one.name.starts_with(bus.interface + " "));
    });
    if (bad) continue;
    const DoctorResult line = look_at_line(robot, bus);
    findings.insert(findings.end(), line.findings.begin(), line.findings.end());
    result.clocks.insert(result.clocks.end(), line.clocks.begin(), line.clocks.end());
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
  DoctorResult result{.findings = examine_machine(machine), .clocks = {}};
  std::vector<Finding>& findings = result.findings;
  if (options.robot.empty() && !options.interfaces.empty()) {
    return refuse(fail("--interface replaces those of a robot, and none is named",
                       "tandem doctor ROBOT.toml --interface " + options.interfaces.front())
                      .error());
  }
  std::optional<hal::RobotConfig> known;
  if (!options.robot.empty()) {
    auto robot = robot::read_robot(options.robot);
    if (!robot) return refuse(robot.error());
    if (Status done = hal::replace_interfaces(robot->config, options.interfaces); !done) {
      return refuse(done.error());
    }
    const auto is_can = [](const hal::BusConfig& bus) { return bus.kind == hal::BusKind::kCan; };
    if (std::ranges::none_of(robot->config.buses, is_can)) {
      std::erase_if(findings, [](const Finding& one) { return one.name == kCanSupport; });
    }
    const std::vector<Finding> more = examine_interfaces(machine, robot->config);
    findings.insert(findings.end(), more.begin(), more.end());
    if (options.root == "/") look_at_lines(robot->config, result);
    known = std::move(robot->config);
  }
  std::FILE* out = human_output(options.json);
  print_findings(findings, out);
  print_verdict(findings, out);
  if (!options.fix.empty()) {
    const Fixes fixes = fixes_of(machine, findings, known ? &*known : nullptr);
    if (const Status written = write_fixes(options.fix, fixes); !written)
      return refuse(written.error());
    fmt::print(out, "\n  {} in {}, nothing was changed: see {}/README.md\n",
               counted(fixes.files.size(), "file"), options.fix, options.fix);
  }
  return end_with_json(options.json, figures_json(result));
}

}  // namespace tandem::apps
