// A composed run of the command line: with its CAN interfaces, or its robot's server.
// Layer: apps/run.  Thread: main.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "apps/can/can_sockets.hpp"
#include "apps/text/figures.hpp"
#include "dds/domain.hpp"
#include "dds/participant.hpp"
#include "hal/ethercat-can/can_backend.hpp"
#include "hal/ethercat-can/frame_record.hpp"
#include "runtime/run/composition.hpp"
#include "runtime/run/run_log.hpp"

namespace tandem::apps {

using runtime::ControllerNote;
using runtime::hal_name;
using runtime::wire_name;

/// What a backend speaks over.
struct Wires {
  std::unique_ptr<CanSockets> sockets;            ///< of the CAN backend
  std::unique_ptr<hal::can::FrameRecord> frames;  ///< of the CAN backend, when it was asked for
  const hal::can::CanBackend* can = nullptr;      ///< the composition's backend, where it is that
  std::unique_ptr<dds::Participant> participant;  ///< of the DDS backend

  /// Empty without a CAN backend.
  [[nodiscard]] std::span<const OpenBus> open_buses() const {
    if (sockets == nullptr) return {};
    return sockets->open_buses();
  }
};

/// The wires come first, for they outlive the backend: it says goodbye over them.
struct WiredComposition : Wires, runtime::Composition {};

/// How long it runs: "5.000 s", "until it is stopped".
[[nodiscard]] std::string length_text(const runtime::Experiment& e);

/// Who moves the bodies, and how: `engine` and so on.
void figures(Figures& f, const runtime::Experiment* e);

/// Opens the CAN interfaces and makes the CAN backend, or finds the server of the DDS backend and
/// gets its robot; the simulation has nothing to connect.
/// @param record_frames  file that every frame is written to; empty: none
/// Errors: CanSockets::open()'s; a record that cannot be made, or without a bus; Domain::open()'s,
/// RemoteBackend::connect()'s.
[[nodiscard]] Diagnostics connect(WiredComposition& composition, const std::string& record_frames);
/// Gives up what connect() has opened, also where it failed half way: it can be called again.
void disconnect(WiredComposition& composition);

}  // namespace tandem::apps
