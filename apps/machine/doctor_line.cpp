// The doctor's look at the slaves behind an EtherCAT interface.
#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "apps/can/interface_lock.hpp"
#include "apps/machine/doctor.hpp"
#include "canopen/data_sheet.hpp"
#include "canopen/objects.hpp"
#include "hal/ethercat-can/line/packet_link.hpp"
#include "hal/ethercat-can/line/slave_master.hpp"
#include "hal/ethercat-can/socket_can_bus.hpp"
#include "rt/clock.hpp"

namespace tandem::apps {
namespace {

using ethercat::sii::Identity;
using hal::ecat::LineSurvey;
using hal::ecat::SlavePlan;
using hal::ecat::SurveyedSlave;

/// A node and what its SII should say, as the drive master asks its object 1018.
struct Expected {
  int node_id = 0;
  SlavePlan plan;
};

Identity identity_of(const hal::BoardConfig& board) {
  const canopen::DataSheet& sheet = *board.sheet;
  return {.vendor = board.vendor_id.value_or(sheet.vendor.value_or(0)),
          .product = board.product_code.value_or(sheet.product.value_or(0)),
          .revision = board.revision.value_or(sheet.revision.value_or(0))};
}

/// The nodes of a bus by their place in the line.
std::vector<SlavePlan> expected_on(const hal::RobotConfig& robot, const std::string& bus) {
  std::vector<Expected> nodes;
  for (const hal::BoardConfig& board : robot.boards) {
    if (board.bus != bus) continue;
    nodes.push_back({board.node_id, {.name = board.name, .identity = identity_of(board)}});
  }
  for (const hal::SensorConfig& sensor : robot.sensors) {
    if (sensor.bus != bus) continue;
    nodes.push_back(
        {sensor.node_id,
         {.name = sensor.name,
          .identity = {.vendor = canopen::kTandemVendor, .product = canopen::kSensorProduct}}});
  }
  std::ranges::sort(nodes, {}, &Expected::node_id);
  std::vector<SlavePlan> plans;
  for (Expected& node : nodes) plans.push_back(std::move(node.plan));
  return plans;
}

std::string text_of(const Identity& identity) {
  return fmt::format("vendor {:08X}, product {:08X}, revision {:08X}", identity.vendor,
                     identity.product, identity.revision);
}

/// Where what is looked at may be a program.
constexpr const char* kLockstep =
    "; `tandem emulate --lockstep` answers a run alone: leave --lockstep out";

std::string slave_text(std::size_t slave, const std::string& name) {
  return fmt::format("slave {} ({})", slave, name);
}

Finding masters(const hal::BusConfig& bus, const hal::ecat::SurveyTiming& timing,
                const LineSurvey& survey) {
  const std::string name = bus.interface + " master";
  if (survey.strangers == 0) {
    return {name,
            Health::kOk,
            fmt::format("no other heard in {} ms", timing.listen_ns / 1'000'000),
            {},
            {}};
  }
  return {name, Health::kMissing, fmt::format("another one sent {} frames", survey.strangers),
          "two masters would take the slaves from each other; nothing more was looked at",
          "end the other program, or take its cable off"};
}

Finding slaves(const hal::BusConfig& bus, const std::vector<SlavePlan>& plans,
               const LineSurvey& survey) {
  Finding finding{bus.interface + " slaves",
                  Health::kOk,
                  fmt::format("{} of {} answer", survey.found, plans.size()),
                  {},
                  {}};
  if (survey.found == plans.size()) return finding;
  finding.health = Health::kMissing;
  if (survey.found == 0) {
    finding.why = "no frame comes back";
    finding.mend =
        "look at the cable to " + slave_text(0, plans.front().name) + " and its power" + kLockstep;
  } else if (survey.found < plans.size()) {
    const std::string first = slave_text(survey.found, plans[survey.found].name);
    finding.why = first + " is the first that no frame reaches";
    finding.mend = "look at the cable to it and its power";
  } else {
    finding.why = fmt::format("robot.toml has {} on bus {}", plans.size(), bus.name);
    finding.mend = "add them to robot.toml, or take them off the line";
  }
  return finding;
}

/// The first slave that is not robot.toml's.
Finding identities(const hal::BusConfig& bus, const std::vector<SlavePlan>& plans,
                   const LineSurvey& survey) {
  const std::string name = bus.interface + " identities";
  bool emulated = false;
  for (std::size_t i = 0; i < std::min(plans.size(), survey.slaves.size()); ++i) {
    const SurveyedSlave& slave = survey.slaves[i];
    const std::string who = slave_text(i, plans[i].name);
    if (!slave.identified) {
      return {
          name, Health::kMissing, who + ": none", "its information memory cannot be read",
          std::string("switch it off and on; its maker's tool writes the memory anew") + kLockstep};
    }
    if (!slave.settings_right) {
      return {name, Health::kMissing, who + ": wrong check sum",
              "its information memory (SII) is damaged, and a run refuses the slave",
              "its maker's tool writes the memory anew"};
    }
    Identity found = slave.identity;
    if (found.vendor == ethercat::sii::kNobodysVendor) {  // test equipment stands for any maker's
      emulated = true;
      found.vendor = plans[i].identity.vendor;
    }
    if (matches(plans[i], found)) continue;
    return {name, Health::kMissing, who + ": " + text_of(slave.identity),
            "robot.toml or its data sheet has " + text_of(plans[i].identity) + " there (0: any)",
            "put the slaves into robot.toml's order, or correct robot.toml"};
  }
  return {name,
          Health::kOk,
          emulated ? "as in robot.toml; emulated slaves" : "as in robot.toml",
          {},
          {}};
}

Finding states(const hal::BusConfig& bus) {
  return {bus.interface + " states", Health::kWarning, "not all slaves are in INIT",
          "a master left them so; the clocks are not measured, as outputs may depend on them",
          "switch the slaves off and on, or end the run that left them"};
}

/// How far the clocks are from slave `reference`. `silent`: a slave whose clock did not answer.
Finding worst_clock(const hal::BusConfig& bus, const hal::ecat::SurveyTiming& timing,
                    const std::vector<ClockFinding>& clocks, const std::string& reference,
                    const std::string& silent) {
  const ClockFinding& worst = *std::ranges::max_element(clocks, {}, &ClockFinding::difference_ns);
  const std::string slave = slave_text(worst.slave, worst.name);
  Finding finding{bus.interface + " clocks",
                  Health::kOk,
                  fmt::format("within {} ns of {}, jitter {:.0f} ns: worst {}; {} cycles of {} us",
                              worst.difference_ns, reference, worst.jitter_ns, slave, timing.cycles,
                              timing.period_ns / 1000),
                  {},
                  {}};
  if (!silent.empty()) {
    finding.health = Health::kMissing;
    finding.value = silent + " was not heard";
    finding.why = "frames are lost, or its clock cannot be read";
    finding.mend = "look at the cables: ethtool -S " + bus.interface;
  } else if (worst.difference_ns > hal::ecat::SlaveClock::kSettledNs) {
    finding.health = Health::kWarning;
    finding.why =
        fmt::format("a run waits until a clock is within {} ns", hal::ecat::SlaveClock::kSettledNs);
    finding.mend = "replace " + slave + " or the cable before it";
  }
  return finding;
}

/// All clocks, and of them the worst.
void clocks(const hal::BusConfig& bus, const std::vector<SlavePlan>& plans,
            const hal::ecat::SurveyTiming& timing, const LineSurvey& survey, DoctorResult& out) {
  const std::size_t count = std::min(plans.size(), survey.slaves.size());
  const std::string name = bus.interface + " clocks";
  if (survey.reference >= count) {
    out.findings.push_back({name,
                            Health::kWarning,
                            "none",
                            "no slave has a distributed clock: they sample when a frame comes",
                            {}});
    return;
  }
  std::string silent;
  for (std::size_t i = 0; i < count; ++i) {
    const SurveyedSlave& slave = survey.slaves[i];
    if (i == survey.reference || !slave.has_clock) continue;
    if (slave.samples == 0 && silent.empty()) silent = slave_text(i, plans[i].name);
    out.clocks.push_back({.bus = bus.name,
                          .slave = i,
                          .name = plans[i].name,
                          .delay_ns = slave.delay_ns,
                          .difference_ns = slave.difference_ns,
                          .jitter_ns = slave.jitter_ns});
  }
  const std::string reference = slave_text(survey.reference, plans[survey.reference].name);
  if (out.clocks.empty()) {
    out.findings.push_back({name, Health::kOk, "only that of " + reference, {}, {}});
    return;
  }
  out.findings.push_back(worst_clock(bus, timing, out.clocks, reference, silent));
  const ClockFinding& last = *std::ranges::max_element(out.clocks, {}, &ClockFinding::delay_ns);
  out.findings.push_back({bus.interface + " delay",
                          Health::kOk,
                          fmt::format("{} ns from {} to {}", last.delay_ns, reference,
                                      slave_text(last.slave, last.name)),
                          {},
                          {}});
}

/// A machine that is busy answers late now and then; cables lose more.
Finding losses(const hal::BusConfig& bus, const LineSurvey& survey) {
  Finding finding{bus.interface + " losses",
                  Health::kOk,
                  fmt::format("{} of {} questions asked again", survey.repeated, survey.asked),
                  {},
                  {}};
  if (100 * survey.repeated <= survey.asked) return finding;
  finding.health = Health::kWarning;
  finding.why = "answers are lost or take longer than 5 ms: the cables, or this machine's load";
  finding.mend = "ethtool -S " + bus.interface;
  return finding;
}

}  // namespace

DoctorResult judge_line(const hal::RobotConfig& robot, const hal::BusConfig& bus,
                        const hal::ecat::SurveyTiming& timing, const LineSurvey& survey) {
  DoctorResult out;
  const std::vector<SlavePlan> plans = expected_on(robot, bus.name);
  out.findings.push_back(masters(bus, timing, survey));
  if (survey.strangers != 0 || plans.empty()) return out;
  out.findings.push_back(slaves(bus, plans, survey));
  if (survey.found == 0) return out;
  out.findings.push_back(identities(bus, plans, survey));
  if (survey.states != std::to_underlying(ethercat::AlState::kInit)) {
    out.findings.push_back(states(bus));
  } else {
    clocks(bus, plans, timing, survey, out);
  }
  out.findings.push_back(losses(bus, survey));
  return out;
}

DoctorResult look_at_line(const hal::RobotConfig& robot, const hal::BusConfig& bus) {
  const auto refused = [&bus](const char* what, const Error& error) {
    return DoctorResult{{{bus.interface + " " + what, Health::kMissing, "not looked at",
                          error.message, error.hint}},
                        {}};
  };
  const auto lock = InterfaceLock::take(bus.interface, hal::can::SocketSide::kMaster);
  if (!lock) return refused("master", lock.error());
  const auto link = hal::ecat::PacketLink::open(bus.interface);
  if (!link) return refused("line", link.error());
  rt::WallClock clock;
  const hal::ecat::SurveyWait wait = [&](std::int64_t at_most_ns) {
    const std::array sockets{(*link)->descriptor()};
    if (at_most_ns > 0) (void)hal::can::wait_for_frames(sockets, at_most_ns);
    return clock.now_ns();
  };
  const hal::ecat::SurveyTiming timing;
  return judge_line(robot, bus, timing, survey_line(**link, timing, wait));
}

}  // namespace tandem::apps
