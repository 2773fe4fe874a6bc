// Everything that a run needs, read, checked and put together: nothing has moved yet.
// `tandem run` runs it; `tandem check` stops here.
// Layer: apps/run.  Thread: main.
#pragma once

#include <cstdint>
#include <expected>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/can/can_sockets.hpp"
#include "apps/robot/kernel_supply.hpp"
#include "apps/text/console.hpp"
#include "base/result.hpp"
#include "controllers/plugin_loader.hpp"
#include "dds/domain.hpp"
#include "dds/participant.hpp"
#include "estimation/estimator.hpp"
#include "hal/ethercat-can/frame_record.hpp"
#include "hal/remote/operator_end.hpp"
#include "hal/remote/remote_backend.hpp"
#include "hal/sim/sim_robot.hpp"
#include "internal_model/prediction_service.hpp"
#include "model/kernel_library.hpp"
#include "robot/check.hpp"
#include "runtime/controller_host.hpp"
#include "runtime/experiment.hpp"
#include "runtime/local_controllers.hpp"
#include "runtime/owner_controller.hpp"

namespace tandem::apps {

/// What the command line says instead of the experiment.
struct Overrides {
  std::optional<std::uint64_t> seed = std::nullopt;
  std::optional<double> duration_s = std::nullopt;
  std::string kernel_variant = {};
  MissingKernels missing_kernels = MissingKernels::kRefuse;
  std::optional<runtime::BackendKind> backend = std::nullopt;
  std::string wire = {};                     ///< with kWire: "can", "ethercat"
  bool lockstep = false;                     ///< true: whatever the experiment says
  std::vector<std::string> interfaces = {};  ///< "can0=vcan0"
  std::string scenario = {};                 ///< faults to inject into the simulation
  std::optional<std::uint32_t> delay_cycles = std::nullopt;
  bool serves = false;  ///< no controllers of its own, and no end
  std::optional<bool> dds = std::nullopt;
  std::optional<int> domain = std::nullopt;  ///< of DDS
};

/// A controller as `check` lists it.
struct ControllerNote {
  std::string name;
  std::string doc;             ///< its plugin's one line
  bool active = true;          ///< from the start
  bool retreats = false;       ///< it can, in a stop of category 2
  bool lacks_archive = false;  ///< it has members and no archive(): predictions may be wrong
};

struct Composition {
  runtime::Experiment experiment;       ///< overrides applied; its robot is completed
  model::KernelLibrary kernels;         ///< empty with kTolerate: then there is no more than notes
  std::unique_ptr<CanSockets> sockets;  ///< of the CAN backend
  std::unique_ptr<hal::can::FrameRecord> frames;  ///< of the CAN backend, when it was asked for
  std::unique_ptr<dds::Participant> participant;  ///< of the DDS backend
  std::unique_ptr<hal::Backend> backend;          ///< CAN's and DDS' only after connect()
  sim::SimRobot* sim = nullptr;                   ///< the robot, when it is the simulation
  const hal::can::DriveMaster* master = nullptr;  ///< the backend's, once that is there
  remote::OperatorEnd* tele = nullptr;  ///< the backend, when a link lies before the robot
  /// Controllers at the robot's end of a link, when this is it; null: there are none.
  std::unique_ptr<runtime::LocalControllers> robot_side;
  model::KernelLibrary parallel_kernels;    ///< of [parallel]; may be those of `kernels`
  std::unique_ptr<sim::SimRobot> parallel;  ///< null: there is no second robot
  sim::SimRobotConfig simulation;           ///< of the second or, without one, of the first
  std::unique_ptr<internal_model::PredictionService> predictor;  ///< null: there is no model
  remote::RemoteBackend* remote = nullptr;           ///< the robot, when another process has it
  std::unique_ptr<estimation::Estimator> estimator;  ///< null: nothing is estimated
  std::unique_ptr<runtime::ControllerHost> controllers;
  std::shared_ptr<runtime::OwnerController> owner;  ///< null: nobody may own the robot from afar
  std::size_t owner_slot = 0;                       ///< its in `controllers`
  std::vector<ControllerNote> notes;
  /// robot::check()'s, a category 2 that nobody can carry out, late_plans() unless the command line
  /// says how long
  Diagnostics warnings;
  robot::LoopStudy loops;  ///< where the loops close, in a simulation

  /// Empty without a CAN backend.
  [[nodiscard]] std::span<const OpenBus> open_buses() const {
    if (sockets == nullptr) return {};
    return sockets->open_buses();
  }
};

/// Where the joints stand when the run starts, as far as the experiment says.
[[nodiscard]] std::vector<double> start_of(const runtime::Experiment& e);

/// The plugin of one of the experiment's controllers. Errors: load_controller()'s.
[[nodiscard]] Result<LoadedController> load_plugin(const runtime::Experiment& e,
                                                   const runtime::ControllerSpec& spec);

/// "EtherCAT" when the robot has no other bus, else "CAN".
[[nodiscard]] std::string wire_name(const hal::RobotConfig& robot);

/// "sim", "can", "can lockstep", "ethercat", "dds", "dds lockstep", for logs and summaries.
[[nodiscard]] std::string hal_name(const runtime::Experiment& e);

/// The keys `engine` and `engine_version` of JSON; null where no plant is in this process.
void add_engine_json(const runtime::Experiment& e, Json& json);

/// Reads an experiment with all its files and composes it. Every error that can be found without
/// running is found here: experiment, robot, description, kernels, backend, plugins, parameters,
/// claims. Without kernels, which MissingKernels::kTolerate admits, the last two are not checked.
[[nodiscard]] std::expected<std::unique_ptr<Composition>, Diagnostics> compose(
    const std::string& experiment, const Overrides& overrides);

/// Opens the CAN interfaces and makes the CAN backend, or finds the server of the DDS backend and
/// gets its robot; the simulation has nothing to connect.
/// @param record_frames  file that every frame is written to; empty: none
/// Errors: CanSockets::open()'s; a record that cannot be made, or without a bus; Domain::open()'s,
/// RemoteBackend::connect()'s.
[[nodiscard]] Diagnostics connect(Composition& composition, const std::string& record_frames);

}  // namespace tandem::apps
