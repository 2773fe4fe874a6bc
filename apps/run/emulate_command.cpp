// `tandem emulate`: the simulated robot with emulated boards on CAN interfaces.
#include <fmt/core.h>

#include <cstdlib>
#include "apps/can/bus_watch.hpp"
#include "apps/can/can_sockets.hpp"
#include "apps/robot/kernel_build.hpp"
#include "apps/robot/wrong_kind.hpp"
#include "apps/run/commands.hpp"
#include "apps/run/emulation_studio.hpp"
#include "apps/run/inject.hpp"
#include "apps/run/task_queue.hpp"
#include "apps/text/console.hpp"
#include "apps/transport/control_socket.hpp"
#include "base/counted.hpp"
#include "hal/ethercat-can/wire_meter.hpp"
#include "hal/sim/emulator.hpp"
#include "hal/sim/line_boards.hpp"
#include "hal/sim/scenario.hpp"
#include "robot/check.hpp"
#include "robot/robot_files.hpp"
#include "rt/stop_signal.hpp"
#include "rt/thread_setup.hpp"
#include "runtime/experiment.hpp"

namespace tandem::apps {
namespace {

/// What is emulated, from a robot's file or an experiment's.
struct Subject {
  hal::RobotConfig robot;
  model::UrdfModel description;
  robot::FileTexts files;  ///< what was read
  sim::SimRobotConfig sim;
  rt::ThreadConfig thread;
};

/// A robot by itself starts in the first of its postures; an experiment says all.
std::expected<Subject, Diagnostics> read_subject(const EmulateOptions& options) {
  if (auto wrong = wrong_kind(options.file, Takes::kEither, "tandem emulate")) {
    return std::unexpected(Diagnostics{std::move(*wrong)});
  }
  Subject subject;
  if (robot::is_robot(options.file)) {
    auto robot = robot::read_complete_robot(options.file);
    if (!robot) return std::unexpected(robot.error());
    subject.robot = std::move(robot->config);
    subject.description = std::move(robot->description);
    subject.files = std::move(robot->files);
    if (!subject.robot.postures.empty()) subject.sim.posture = subject.robot.postures[0].name;
    subject.thread = {.policy = rt::SchedulingPolicy::kOther, .lock_memory = false};
  } else {
    auto experiment = runtime::read_experiment(options.file);
    if (!experiment) return std::unexpected(experiment.error());
    subject.sim = experiment->sim_robot_config();
    subject.thread = experiment->thread;
    subject.robot = std::move(experiment->robot);
    subject.description = *experiment->description;
    subject.files = std::move(experiment->files);
  }
  subject.sim.posture = options.posture.value_or(subject.sim.posture);
  subject.sim.seed = options.seed.value_or(subject.sim.seed);
  subject.sim.period_ns = options.period_ns.value_or(subject.sim.period_ns);
  if (Status done = hal::replace_interfaces(subject.robot, options.interfaces); !done) {
    return std::unexpected(Diagnostics{done.error()});
  }
  if (!options.scenario.empty()) {
    auto faults = sim::read_scenario(options.scenario, subject.robot, subject.sim.period_ns,
                                     &subject.description.tree);
    if (!faults) return std::unexpected(faults.error());
    subject.sim.faults = std::move(*faults);
  }
  return subject;
}

/// All that emulating needs; nothing is sent before it is complete.
struct Emulation {
  Subject subject;
  model::KernelLibrary kernels;
  std::unique_ptr<sim::EmulatedRobot> robot;
  std::unique_ptr<CanSockets> sockets;
  std::vector<std::unique_ptr<hal::can::WireMeter>> meters;  ///< with a studio, those of CAN
  std::unique_ptr<sim::Emulator> emulator;
  std::unique_ptr<EmulationStudio> studio;  ///< null: nobody looks
  std::uint64_t injected = 0;               ///< faults that have begun
  bool lockstep = false;
};

Diagnostics in_file(Error error, const std::string& file) {
  if (error.file.empty()) error.file = file;
  return {std::move(error)};
}

/// With a studio the frames of each bus are timed; but those of EtherCAT in lockstep, where a
/// master sends them again for as long as a step takes.
/// @return the boards' ends, by bus
std::vector<hal::can::Bus*> ends_of(Emulation& e, std::vector<hal::can::Bus*>* wires) {
  std::vector<hal::can::Bus*> ends(e.sockets->buses().begin(), e.sockets->buses().end());
  if (wires == nullptr) return ends;
  wires->resize(ends.size());
  for (std::size_t b = 0; b < ends.size(); ++b) {
    const hal::BusConfig& bus = e.subject.robot.buses[b];
    if (bus.kind == hal::BusKind::kEthercat) {
      if (!e.lockstep) (*wires)[b] = ends[b];
      continue;
    }
    const hal::can::BitRates rates{.nominal = bus.bitrate, .data = bus.data_bitrate};
    ends[b] = (*wires)[b] =
        e.meters.emplace_back(std::make_unique<hal::can::WireMeter>(*ends[b], rates)).get();
  }
  return ends;
}

Status open_studio(Emulation& e, const EmulateOptions& options, std::vector<hal::can::Bus*> wires) {
  const hal::RobotConfig& robot = e.subject.robot;
  auto studio = EmulationStudio::open(options.studio,
                                      {.config = robot,
                                       .urdf = robot::text_in(e.subject.files, robot.model.urdf),
                                       .file = options.file,
                                       .period_ns = e.subject.sim.period_ns,
                                       .lockstep = e.lockstep,
                                       .robot = *e.robot,
                                       .changes = e.subject.sim.changes.get(),
                                       .wires = std::move(wires)});
  if (!studio) return std::unexpected(studio.error());
  e.studio = std::move(*studio);
  e.emulator->watch(*e.studio);
  return {};
}

std::expected<std::unique_ptr<Emulation>, Diagnostics> compose_emulation(
    const EmulateOptions& options) {
  auto e = std::make_unique<Emulation>();
  auto subject = read_subject(options);
  if (!subject) return std::unexpected(subject.error());
  e->subject = std::move(*subject);
  e->lockstep = options.lockstep;
  const hal::RobotConfig& robot = e->subject.robot;
  const std::int64_t period_ns = e->subject.sim.period_ns;
  e->subject.sim.tree = std::make_shared<const model::Tree>(e->subject.description.tree);
  const auto joined = robot::join(robot, e->subject.description);
  if (!joined) return std::unexpected(joined.error());
  robot::Findings found = robot::check(*joined, {.plant = true,
                                                 .postures = {e->subject.sim.posture},
                                                 .period_ns = period_ns,
                                                 .simulation = e->subject.sim});
  for (Error& error : found.errors) error = in_file(std::move(error), options.file).front();
  if (!found.errors.empty()) return std::unexpected(std::move(found.errors));
  for (Error& warning : found.warnings) warning = in_file(std::move(warning), options.file).front();
  if (!options.quiet) print_warnings(found.warnings);
  auto kernels = robot::supply_kernels(*joined, options.kernel_variant,
                                       missing_kernels(options.no_build), builder(options.quiet));
  if (!kernels) return std::unexpected(in_file(kernels.error(), robot.file));
  e->kernels = std::move(*kernels);
  auto emulated = sim::EmulatedRobot::create(robot, e->kernels.get(), e->subject.sim);
  if (!emulated) return std::unexpected(in_file(emulated.error(), robot.file));
  e->robot = std::move(*emulated);
  const auto make_line = [&](std::size_t bus, hal::ecat::DataLink& link,
                             hal::can::FrameWait& wait) -> Result<std::unique_ptr<hal::can::Bus>> {
    const sim::LineBoards::Config config{.period_ns = period_ns,
                                         .seed = e->subject.sim.seed,
                                         .clock = options.lockstep ? nullptr : &wait};
    return std::make_unique<sim::LineBoards>(*e->robot, bus, link, config);
  };
  auto sockets = CanSockets::open(robot, hal::can::SocketSide::kBoards, false, make_line);
  if (!sockets) return std::unexpected(sockets.error());
  e->sockets = std::move(*sockets);
  const bool looks = options.studio.wanted;
  std::vector<hal::can::Bus*> wires;
  const std::vector<hal::can::Bus*> ends = ends_of(*e, looks ? &wires : nullptr);
  e->emulator = std::make_unique<sim::Emulator>(
      *e->robot, ends, *e->sockets,
      sim::EmulatorConfig{e->subject.sim.period_ns, options.lockstep});
  if (!looks) return e;
  if (Status open = open_studio(*e, options, std::move(wires)); !open) {
    return std::unexpected(Diagnostics{open.error()});
  }
  return e;
}

std::string interfaces_of(const hal::RobotConfig& robot) {
  std::string names;
  for (const hal::BusConfig& bus : robot.buses) {
    names += (names.empty() ? "" : ", ") + bus.interface;
  }
  return names;
}

/// How a board stopped without SYNC.
struct BoardReport : sim::BoardStop {
  std::string name;
};

void print_summary(const Emulation& e, const Json& json, std::FILE* out) {
  Facts facts;
  add_figures(facts, json,
              {{"simulated",
                "{sim_seconds:.3f s} in {steps} steps, {steps_without_sync} of them without SYNC, "
                "{slipped} slipped"},
               {"frames", "{frames_in} in, {frames_out} out, {frames_lost} lost"}});
  add_bus_facts(e.sockets->open_buses(), facts);
  if (e.robot->plant().diverged())
    facts.add("the simulation diverged", e.robot->plant().diverged_text());
  if (e.emulator->statistics().silent_steps > 0)
    add_figures(facts, json, "without SYNC at the end",
                "{silent_steps} steps; no motor drove after {safe_after_steps}, every bridge was "
                "open after {open_after_steps}");
  facts.print(out);
}

/// " of joint1", " of board leg_1"; empty of what strikes every frame.
std::string whose(const hal::InjectedFault& injected, const hal::RobotConfig& robot) {
  const auto index = static_cast<std::size_t>(injected.index);
  switch (injected.target) {
    case hal::FaultTarget::kNone: return "";
    case hal::FaultTarget::kJoint: return " of " + robot.joints[index].name;
    case hal::FaultTarget::kBoard: return " of board " + robot.boards[index].name;
    case hal::FaultTarget::kSensor: return " of sensor " + robot.sensors[index].name;
    case hal::FaultTarget::kBus: return " of bus " + robot.buses[index].name;
  }
  return "";
}

/// Faults that have begun since, and payloads that have come or gone.
void tell_injected(Emulation& e, std::FILE* out, bool quiet) {
  for (;;) {
    const hal::InjectedFault fault = e.robot->next_injected();
    if (fault.kind == hal::FaultKind::kNone) return;
    const bool carried = fault.kind == hal::FaultKind::kPayload;
    const bool dropped = carried && fault.index < 0;
    if (!dropped && !fault.over) ++e.injected;
    const std::string what =
        carried
            ? fmt::format("payload {}: {}", dropped ? "dropped" : "picked up",
                          e.robot->payload_text(static_cast<std::uint32_t>(std::abs(fault.index))))
            : fmt::format("{} {}{}", fault.over ? "ended" : "injected", to_string(fault.kind),
                          whose(fault, e.subject.robot));
    if (e.studio != nullptr) e.studio->tell(what);
    if (quiet) continue;
    fmt::print(out, "{:.3f} s: {}\n", static_cast<double>(e.emulator->time_ns()) * 1e-9, what);
    std::fflush(out);
  }
}

/// Emulates until it is asked to stop, or the plant diverges.
void emulate(Emulation& e, TaskQueue& tasks, std::FILE* out, bool quiet) {
  constexpr std::int64_t kPatienceNs = 100'000'000;
  StatusLine line(out);
  BusWatch buses(e.sockets->open_buses(), stderr);
  while (!rt::stop_requested()) {
    if (e.emulator->poll(kPatienceNs) == Code::kDiverged) return;
    tasks.run_waiting();
    tell_injected(e, out, quiet);
    if (!quiet) buses.look();
    if (quiet || !line.due()) continue;
    const sim::EmulatorStatistics& s = e.emulator->statistics();
    line.show(fmt::format("{:.1f} s simulated, {} steps ({} without SYNC), {}",
                          static_cast<double>(e.emulator->time_ns()) * 1e-9, s.steps,
                          s.steps_without_sync,
                          e.robot->all_enabled() ? "all axes enabled" : "not all axes enabled"));
  }
}

}  // namespace

static void figures(Figures& f, const BoardReport& board) {
  f("name", board.name);
  f("silent_steps", board.silent_steps);
  f("safe_after_steps", board.safe_after_steps);
  f("open_after_steps", board.open_after_steps);
}

static void figures(Figures& f, const Emulation* e) {
  const auto s = e == nullptr ? sim::EmulatorStatistics() : e->emulator->statistics();
  f("robot", [&] { return e->subject.robot.name; });
  f("lockstep", [&] { return e->lockstep; });
  f("steps", "of the boards' time", s.steps);
  f("steps_without_sync", "made by the boards' own clocks", s.steps_without_sync);
  f("slipped", "skipped because they were too many to catch up", s.slipped);
  f("sim_seconds", [&] { return static_cast<double>(e->emulator->time_ns()) * 1e-9; });
  f("silent_steps", "since the last SYNC on any bus", s.silent_steps);
  f("safe_after_steps", "of these, until no motor drove; 0: not (yet)", s.safe_after_steps);
  f("open_after_steps", "the same, until every bridge was open", s.open_after_steps);
  f("boards", "each alone, since the last SYNC on its own bus", [&] {
    std::vector<BoardReport> boards;
    for (const sim::BoardStop& stop : s.boards)
      boards.push_back({stop, e->subject.robot.boards[boards.size()].name});
    return boards;
  });
  f("injected", "faults that have begun", [&] { return e->injected; });
  f("frames_in", s.frames_in);
  f("frames_out", s.frames_out);
  f("frames_lost", s.frames_lost);
  f("buses", "as in `run`", [&] { return e->sockets->open_buses(); });
  f("all_enabled", [&] { return e->robot->all_enabled(); });
  f("diverged", [&] { return e->robot->plant().diverged(); });
}

std::vector<Figures::Row> emulate_figures() { return Figures::rows_of<const Emulation*>(); }

Exit emulate_command(const EmulateOptions& options) {
  outlive_files();
  std::FILE* out = human_output(options.json);
  if (const Status writable = check_writable(options.json); !writable)
    return refuse(writable.error());
  const auto composed = compose_emulation(options);
  if (!composed) return refuse(composed.error());
  Emulation& e = **composed;
  rt::install_stop_signals();
  const rt::ThreadReport report = rt::set_up_thread(e.subject.thread);
  if (!report.complete()) fmt::print(stderr, "note: {}\n", report.to_string());
  // Whoever asks for it needs it: its token is nowhere else.
  if (e.studio != nullptr) {
    fmt::print(out, "studio: {}\n", e.studio->address());
    std::fflush(out);
  }
  if (!options.quiet) {
    fmt::print(out, "{}: {} and {} on {}, {}; Ctrl-C ends it\n", e.subject.robot.name,
               counted(e.subject.robot.boards.size(), "board"),
               counted(e.subject.robot.sensors.size(), "sensor"), interfaces_of(e.subject.robot),
               options.lockstep ? "a step per SYNC" : "in real time");
    const bool has_line = std::ranges::any_of(e.subject.robot.buses, [](const hal::BusConfig& bus) {
      return bus.kind == hal::BusKind::kEthercat;
    });
    if (options.lockstep && has_line) {
      fmt::print(out,
                 "in lockstep its slaves answer a run's process data, and no scan: "
                 "for `tandem doctor` leave --lockstep out\n");
    }
    std::fflush(out);
  }
  TaskQueue tasks;
  ControlRegistry commands;
  commands.add({"status", ControlEffect::kReads, "steps, frames and simulated time so far"},
               [&](const Json&) { return tasks.run([&] { return figures_json(&e); }); });
  add_inject(commands, e.subject.robot, &e.subject.description.tree, e.subject.sim.period_ns,
             [&](const sim::ScenarioFault& fault) {
               const auto done = tasks.run([&]() -> Result<Json> {
                 if (Status added = injected(e.emulator->inject(fault)); !added) {
                   return std::unexpected(added.error());
                 }
                 return Json::object();
               });
               return done ? Status() : Status(std::unexpected(done.error()));
             });
  const auto socket =
      serve(commands, {.path = options.socket, .kind = "emulate", .wanted = !options.no_socket});
  emulate(e, tasks, out, options.quiet);
  if (e.studio != nullptr) {
    e.studio->finish(e.robot->plant().diverged() ? e.robot->plant().diverged_text() : "");
  }
  const Json summary = figures_json(&e);
  if (!options.quiet) print_summary(e, summary, out);
  return end_with_json(options.json, summary,
                       e.robot->plant().diverged() ? Exit::kFault : Exit::kDone);
}

}  // namespace tandem::apps
