// The network proxy in a run: the port for owners in other processes, and what became of it.
// Layer: apps/run.  Thread: main.
#pragma once

#include <cstdio>
#include <memory>

#include "apps/run/connection.hpp"
#include "apps/run/dds_run.hpp"
#include "apps/text/figures.hpp"
#include "apps/transport/dds_admission.hpp"
#include "hal/remote/server.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::apps {

/// The end at which owners ask; null when [remote] allows none.
/// @param once       the run ends when an owner gives the robot back
/// @param admission  of owners; outlives the server
/// Errors: Server::open()'s; lockstep in real time.
[[nodiscard]] Result<std::unique_ptr<remote::Server>> open_server(
    const WiredComposition& composition, DdsRun* dds, bool once, const DdsAdmission& admission);

/// What the server publishes of the run's faults.
void tell_faults(remote::Server& server, const runtime::RobotCycle& cycle);

// Results, of either end; null: there is none.
/// docs/json.md, `remote` and `teleoperation`
void figures(Figures& f, const remote::Server* server);
void figures(Figures& f, const remote::RemoteBackend* client);
void figures(Figures& f, const remote::TeleFigures& link);
/// Rows of `remote`, of a run's figures.
void add_remote_facts(const Json& run, Facts& facts);

}  // namespace tandem::apps
