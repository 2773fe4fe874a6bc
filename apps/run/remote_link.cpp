#include "apps/run/remote_link.hpp"

#include <fmt/core.h>

namespace tandem::apps {
namespace {

using remote::Verdict;

constexpr Verdict kVerdicts[] = {Verdict::kTaken, Verdict::kNoLease, Verdict::kOutOfOrder,
                                 Verdict::kStale, Verdict::kMalformed};

Named<std::uint64_t> counts(const remote::Server& server) {
  Named<std::uint64_t> counts;
  for (const Verdict verdict : kVerdicts)
    counts.emplace_back(to_string(verdict), server.count(verdict));
  return counts;
}

}  // namespace

Result<std::unique_ptr<remote::Server>> open_server(const WiredComposition& c, DdsRun* dds,
                                                    bool once, const DdsAdmission& admission) {
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
    for (const runtime::FaultReport& fault : cycle.faults()) {
      if (!fault.latched) continue;
      if (!text.empty()) text += "; ";
      text += fault.joint.empty() ? fault.text : fault.joint + ": " + fault.text;
    }
    return text;
  });
}

static void figures(Figures& f, const remote::Playout* playout) {
  f("starved_cycles", "in which there was no command", [&] { return playout->starved_cycles(); });
  f("holds", "how often that began", [&] { return playout->holds(); });
}

void figures(Figures& f, const remote::RemoteBackend* client) {
  f("turn_around_ns", "from sending a command to the state that shows it",
    [&] { return client->turn_around(); });
  f("missed_cycles", "of the server", [&] { return client->missed_cycles(); });
}

void figures(Figures& f, const remote::Server* server) {
  f("leases", "given", [&] { return server->lease().given(); });
  f("losses", "owners that lost the robot", [&] { return server->losses(); });
  f("commands", "counts: `taken`, `without_lease`, `out_of_order`, `stale`, `malformed`",
    [&] { return counts(*server); });
  f("playout", "with `[teleoperation]`: the robot's end", [&] { return server->playout(); });
  f("dropped", "cycles that were not published", [&] { return server->dropped(); });
  f("age_ns", "of the state that each command answers", [&] { return server->age(); });
  f("age_cycles", "the same, in cycles", [&] { return server->age_cycles(); });
}

static void figures(Figures& f, const remote::Network::Counts& messages) {
  f("sent", "messages", messages.sent);
  f("lost", messages.lost);
  f("dropped", messages.dropped);
  f("duplicated", messages.duplicated);
  f("reordered", messages.reordered);
  f("delivered", messages.delivered);
}

void figures(Figures& f, const remote::TeleFigures& link) {
  f("up", "to the robot", link.up);
  f("down", "from it", link.down);
  f("starved_cycles",
    "in which the robot had no command; null when the robot's end is another process: "
    "`remote.playout` there",
    known(link.robot_end, link.starved_cycles));
  f("holds", "how often that began", known(link.robot_end, link.holds));
  f("silent_cycles", "until the end, since a state of the robot last came", link.silent_cycles);
  f("most_silent_cycles", "the longest time without one", link.most_silent_cycles);
  f("unanswered_cycles", "until the end, since a state came that showed a newer command in force",
    link.unanswered_cycles);
  f("most_unanswered_cycles", "the longest such time", link.most_unanswered_cycles);
  f("clock_cycles", "in real time: by which the commands' numbers followed the robot's clock",
    link.clock_cycles);
  f("compared", "states that were held against their prediction", link.compared);
  f("worst_prediction_rad", "of a joint of these: the state less its prediction",
    known(link.compared > 0, link.worst_prediction_rad));
}

void add_remote_facts(const Json& run, Facts& facts) {
  const Json& remote = run["remote"];
  add_figures(facts, remote,
              {{"turn-around p50/p99/p99.9/max", "{turn_around_ns:.1f us}"},
               {"missed", "{missed_cycles} cycles of the server"},
               {"owners", "{leases}, {losses} lost"}});
  if (remote.contains("commands")) {
    std::string text;
    for (const auto& [verdict, count] : remote["commands"].items()) {
      if (count == 0 && !text.empty()) continue;
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count.get<std::uint64_t>(), verdict);
    }
    facts.add("commands", text);
  }
  add_figures(facts, remote,
              {{"without commands", "{playout.starved_cycles} cycles, {playout.holds|time}"},
               {"age of their state p50/p99/p99.9/max", "{age_ns:.1f us}"},
               {"in cycles", "{age_cycles}"}});
}

}  // namespace tandem::apps
