#include "apps/run/remote_link.hpp"

#include <fmt/core.h>

#include "base/counted.hpp"

namespace tandem::apps {
namespace {

using remote::Verdict;

constexpr Verdict kVerdicts[] = {Verdict::kTaken, Verdict::kNoLease, Verdict::kOutOfOrder,
                                 Verdict::kStale, Verdict::kMalformed};

std::string microseconds(const rt::Histogram& histogram) {
  const rt::Percentiles p = histogram.percentiles();
  const auto us = [](std::int64_t ns) { return static_cast<double>(ns) * 1e-3; };
  return fmt::format("{:.1f} / {:.1f} / {:.1f} / {:.1f} us", us(p.p50), us(p.p99), us(p.p999),
                     us(p.max));
}

std::string counts(const remote::Server& server) {
  std::string text;
  for (const Verdict verdict : kVerdicts) {
    const std::uint64_t count = server.count(verdict);
    if (count == 0 && verdict != Verdict::kTaken) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, to_string(verdict));
  }
  return text;
}

}  // namespace

Result<std::unique_ptr<remote::Server>> open_server(const Composition& c, DdsRun* dds, bool once,
                                                    const DdsAdmission& admission) {
  if (c.owner == nullptr || dds == nullptr) return nullptr;
  const runtime::Experiment& e = c.experiment;
  if (e.remote.lockstep && c.backend->pace() != hal::Pace::kSimulatedClock) {
    return fail("a robot in real time cannot wait for its owner's commands",
                "leave --lockstep out");
  }
  std::optional<remote::PlayoutConfig> playout;
  std::uint64_t max_age = e.remote.max_age_cycles;
  if (e.teleoperation && !e.remote.lockstep) {
    const double period_s = static_cast<double>(e.loop.period_ns) * 1e-9;
    playout = {.delay_cycles = runtime::playout_cycles(*e.teleoperation, e.loop.period_ns),
               .brake_cycles = static_cast<std::uint64_t>(
                   static_cast<double>(e.teleoperation->link.brake_ns) * 1e-9 / period_s)};
    // An owner is as long away as its lease allows: until then play-out holds.
    max_age = std::max(max_age, playout->delay_cycles + static_cast<std::uint64_t>(
                                                            e.remote.lease_timeout_s / period_s));
  }
  const hal::Robot robot = hal::robot_of(e.robot);
  return remote::Server::open(
      dds->participant(), robot, hal::initial_parameters(e.robot),
      remote::identity_of(robot, c.kernels->description_hash, e.loop.period_ns),
      {.lockstep = e.remote.lockstep,
       .ends_with_owner = once,
       .lease_timeout_s = e.remote.lease_timeout_s,
       .max_age_cycles = max_age,
       .lockstep_timeout_s = e.remote.lockstep_timeout_s,
       .on_lost = e.remote.on_lost,
       .playout = playout,
       .robot_controllers = c.robot_side == nullptr
                                ? std::map<std::string, std::string>{}
                                : runtime::robot_controller_values(*e.teleoperation),
       .admits = [&admission](const remote::Sender& who) { return admission.admits(who); }});
}

void tell_faults(remote::Server& server, const runtime::RobotCycle& cycle) {
  server.set_status([&cycle] {
    std::string text;
    for (const runtime::Fault& fault : cycle.faults()) {
      if (!fault.latched) continue;
      if (!text.empty()) text += "; ";
      text += fault.joint.empty() ? fault.text : fault.joint + ": " + fault.text;
    }
    return text;
  });
}

Json remote_json(const remote::Server* server, const remote::RemoteBackend* client) {
  if (client != nullptr) {
    return {{"turn_around_ns", percentiles_json(client->turn_around())},
            {"missed_cycles", client->missed_cycles()}};
  }
  if (server == nullptr) return nullptr;
  Json commands = Json::object();
  for (const Verdict verdict : kVerdicts) commands[to_string(verdict)] = server->count(verdict);
  Json playout = nullptr;
  if (server->playout() != nullptr) {
    playout = {{"starved_cycles", server->playout()->starved_cycles()},
               {"holds", server->playout()->holds()}};
  }
  return {{"leases", server->lease().given()},
          {"losses", server->losses()},
          {"commands", commands},
          {"playout", playout},
          {"dropped", server->dropped()},
          {"age_ns", percentiles_json(server->age())},
          {"age_cycles", percentiles_json(server->age_cycles())}};
}

void add_remote_facts(const remote::Server* server, const remote::RemoteBackend* client,
                      Facts& facts) {
  if (client != nullptr) {
    if (client->turn_around().count() > 0) {
      facts.add("turn-around p50/p99/p99.9/max", microseconds(client->turn_around()));
    }
    facts.add("missed", fmt::format("{} cycles of the server", client->missed_cycles()));
  }
  if (server == nullptr) return;
  facts.add("owners", fmt::format("{}, {} lost", server->lease().given(), server->losses()));
  facts.add("commands", counts(*server));
  if (server->playout() != nullptr) {
    facts.add("without commands", fmt::format("{} cycles, {}", server->playout()->starved_cycles(),
                                              counted(server->playout()->holds(), "time")));
  }
  if (server->age().count() == 0) return;
  facts.add("age of their state p50/p99/p99.9/max", microseconds(server->age()));
  const rt::Percentiles p = server->age_cycles().percentiles();
  facts.add("in cycles", fmt::format("{} / {} / {} / {}", p.p50, p.p99, p.p999, p.max));
}

}  // namespace tandem::apps
