#include "apps/run/connection.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "apps/clients/dds_client.hpp"
#include "hal/ethercat-can/can_backend.hpp"
#include "hal/ethercat-can/line_bus.hpp"
#include "hal/sim/engine_loader.hpp"
#include "rt/stop_signal.hpp"
#include "runtime/run/operator_link.hpp"
#include "runtime/run/run_log.hpp"

namespace tandem::apps {

std::string length_text(const runtime::Experiment& e) {
  if (e.endless()) return "until it is stopped";
  return fmt::format("{:.3f} s", static_cast<double>(e.cycles() * e.loop.period_ns) * 1e-9);
}

void figures(Figures& f, const runtime::Experiment* e) {
  const auto here = [e] { return e->hal.backend == runtime::BackendKind::kSim; };
  f("engine", "`[sim] engine`; null where no plant is in this process",
    [&] { return known(here(), e->sim.engine); });
  f("engine_version", "null of Tandem's own", [&] {
    const std::string version = here() ? sim::engine_version(e->sim.engine) : "";
    return known(!version.empty(), version);
  });
  f("integrator",
    "[of the plant](simulation.md#integrators), in words; null where no plant is in this process",
    [&] { return known(here(), runtime::integrator_name(*e)); });
  f("substep_ns", "its step; null the same", [&] { return known(here(), e->sim.substep_ns); });
  f("plant",
    "[what of the simulated robot](simulation.md#the-plant-is-not-the-model) is other than its "
    "files say, a text each; null: nothing",
    [&] {
      const bool other = here() && e->plant != nullptr;
      return known(other, other ? e->plant->differences : std::vector<std::string>());
    });
}

namespace {

/// The robot of a server in the experiment's domain.
Diagnostics connect_remote(WiredComposition& c) {
  const runtime::Experiment& e = c.experiment;
  auto domain = dds::Domain::open(e.dds);
  if (!domain) return {domain.error()};
  auto participant = dds::Participant::open(std::move(*domain), "tandem_owner");
  if (!participant) return {participant.error()};
  c.participant = std::move(*participant);
  const hal::Robot robot = hal::robot_of(e.robot);
  const bool own_pace = e.teleoperation && !e.hal.lockstep;
  remote::RobotEnd robot_end;  // in lockstep it is in this process
  if (own_pace) {
    robot_end = {.playout_cycles = runtime::playout_cycles(*e.teleoperation, e.loop.period_ns) + 1,
                 .controllers = runtime::robot_controller_values(*e.teleoperation)};
  }
  auto backend = remote::RemoteBackend::connect(
      *c.participant, robot,
      remote::identity_of(robot, c.kernels->description_hash, e.loop.period_ns),
      {.name = fmt::format("tandem run {}, process {}",
                           std::filesystem::path(e.file).filename().string(), ::getpid()),
       .lockstep = e.hal.lockstep,
       .own_pace = own_pace,
       .robot_end = robot_end,
       .before_asking = [&c] { have_admitted(*c.participant); },
       .interrupted = [] { return rt::stop_requested(); },
       .error_text = [](std::uint32_t code) { return hal::can::DriveMaster::error_text(code); }});
  if (!backend) return {backend.error()};
  c.remote = backend->get();
  if (own_pace) return runtime::operate_live(c, std::move(*backend));
  c.backend = std::move(*backend);
  return runtime::put_link_between(c);
}

}  // namespace

Diagnostics connect(WiredComposition& c, const std::string& record_frames) {
  const runtime::Experiment& e = c.experiment;
  if (e.hal.backend == runtime::BackendKind::kDds && record_frames.empty()) {
    return connect_remote(c);
  }
  if (e.hal.backend != runtime::BackendKind::kWire) {
    if (record_frames.empty()) return {};
    return {fail("--record-frames: a robot in this process has no bus to record",
                 "add --hal can, and start tandem emulate")
                .error()};
  }
  const auto make_line = [&e](std::size_t bus, hal::ecat::DataLink& link,
                              hal::can::FrameWait&) -> Result<std::unique_ptr<hal::can::Bus>> {
    auto made = hal::can::LineBus::create(
        e.robot, bus, link, {.period_ns = e.loop.period_ns, .lockstep = e.hal.lockstep});
    if (!made) return std::unexpected(made.error());
    return std::move(*made);
  };
  auto sockets =
      CanSockets::open(e.robot, hal::can::SocketSide::kMaster, !e.hal.lockstep, make_line);
  if (!sockets) return sockets.error();
  if (Diagnostics others = listen_for_masters(e.robot, e.loop.period_ns); !others.empty()) {
    return others;
  }
  c.sockets = std::move(*sockets);
  const auto ends = c.sockets->buses();
  std::vector<hal::can::Bus*> buses(ends.begin(), ends.end());
  if (!record_frames.empty()) {
    auto record = hal::can::FrameRecord::open(record_frames);
    if (!record) return {record.error()};
    c.frames = std::move(*record);
    for (std::size_t b = 0; b < buses.size(); ++b) {
      buses[b] = &c.frames->watch(*buses[b], e.robot.buses[b].interface);
    }
  }
  auto backend = hal::can::CanBackend::create(
      e.robot, buses, *c.sockets,
      {.lockstep = e.hal.lockstep, .answer_window = e.hal.answer_window});
  if (!backend) return {backend.error()};
  c.can = backend->get();
  c.master = &c.can->master();
  c.backend = std::move(*backend);
  return {};
}

void disconnect(WiredComposition& c) {
  if (c.experiment.hal.backend == runtime::BackendKind::kSim) return;
  c.backend.reset();  // before what it uses
  c.can = nullptr;
  c.master = nullptr;
  c.remote = nullptr;
  c.frames.reset();
  c.sockets.reset();
  c.participant.reset();
}

}  // namespace tandem::apps
