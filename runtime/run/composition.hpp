// Everything that a run needs, read, checked and put together: nothing has moved yet.
// `tandem run` and Run::open() run it; `tandem check` stops here.
// Layer: runtime/run.  Thread: main.
#pragma once

#include <cstdint>
#include <expected>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "controllers/hosted_call.hpp"
#include "controllers/plugin_loader.hpp"
#include "estimation/estimator.hpp"
#include "hal/remote/operator_end.hpp"
#include "hal/remote/remote_backend.hpp"
#include "hal/sim/sim_robot.hpp"
#include "internal_model/prediction_service.hpp"
#include "model/kernel_library.hpp"
#include "robot/check.hpp"
#include "robot/kernel_supply.hpp"
#include "runtime/condition/expectations.hpp"
#include "runtime/controller_host.hpp"
#include "runtime/cycle_config.hpp"
#include "runtime/events.hpp"
#include "runtime/experiment.hpp"
#include "runtime/local_controllers.hpp"
#include "runtime/owner_controller.hpp"
#include "runtime/run/overrides.hpp"

namespace tandem::runtime {

/// What happens where a robot has no kernels.
struct KernelSupply {
  robot::MissingKernels missing = robot::MissingKernels::kBuild;
  robot::BuildKernels build = {};  ///< empty: silently
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
  Experiment experiment;         ///< overrides applied; its robot is completed
  model::KernelLibrary kernels;  ///< empty with kTolerate: then there is no more than notes
  std::unique_ptr<hal::Backend> backend;          ///< CAN's and DDS': made by who connects
  sim::SimRobot* sim = nullptr;                   ///< the robot, when it is the simulation
  const hal::can::DriveMaster* master = nullptr;  ///< the backend's, once that is there
  remote::OperatorEnd* tele = nullptr;  ///< the backend, when a link lies before the robot
  /// Controllers at the robot's end of a link, when this is it; null: there are none.
  std::unique_ptr<LocalControllers> robot_side;
  model::KernelLibrary parallel_kernels;    ///< of [parallel]; may be those of `kernels`
  std::unique_ptr<sim::SimRobot> parallel;  ///< null: there is no second robot
  sim::SimRobotConfig simulation;           ///< of the second or, without one, of the first
  std::unique_ptr<internal_model::PredictionService> predictor;  ///< null: there is no model
  remote::RemoteBackend* remote = nullptr;           ///< the robot, when another process has it
  std::unique_ptr<estimation::Estimator> estimator;  ///< null: nothing is estimated
  std::unique_ptr<ControllerHost> controllers;
  std::shared_ptr<OwnerController> owner;      ///< null: nobody may own the robot from afar
  std::size_t owner_slot = 0;                  ///< its in `controllers`
  std::unique_ptr<Expectations> expectations;  ///< null: there are none
  std::unique_ptr<Events> events;              ///< null: there are none
  std::vector<ControllerNote> notes;
  /// robot::check()'s, a category 2 that nobody can carry out, late_plans() unless the command line
  /// says how long
  Diagnostics warnings;
  robot::ClosureStudy loops;  ///< where the loops close, in a simulation
};

/// What the cycle may show of the plant: null where nothing is simulated here, or it is not wanted.
[[nodiscard]] const hal::TruthImage* truth_of(const Composition& c);

/// Why the run of what is composed and connected cannot go back in time; empty: it can.
[[nodiscard]] std::string why_no_past(const Composition& c);

/// Where the joints stand when the run starts, as far as the experiment says.
[[nodiscard]] std::vector<double> start_of(const Experiment& e);

/// The plugin of one of the experiment's controllers. Errors: load_controller()'s.
[[nodiscard]] Result<LoadedController> load_plugin(const Experiment& e, const ControllerSpec& spec);

/// Reads an experiment with all its files and composes it. Every error that can be found without
/// running is found here: experiment, robot, description, kernels, backend, plugins, parameters,
/// claims. Without kernels, which MissingKernels::kTolerate admits, the last two are not checked.
/// On errors `c` is half made. @return the errors; empty: it is whole, but for a wire's backend
[[nodiscard]] Diagnostics compose(Composition& c, const std::string& experiment,
                                  const Overrides& overrides, KernelSupply kernels = {});

/// compose() of a new one. A plugin that does not return keeps what it was given.
template <class C = Composition>
[[nodiscard]] std::expected<std::unique_ptr<C>, Diagnostics> composed(
    const std::string& experiment, const Overrides& overrides, const KernelSupply& kernels = {}) {
  auto c = std::make_unique<C>();
  Diagnostics errors = compose(*c, experiment, overrides, kernels);
  if (errors.empty()) return c;
  if (a_hosted_call_goes_on()) (void)c.release();
  return std::unexpected(std::move(errors));
}

/// How the cycle of what is connected goes; the experiment's loop becomes it.
[[nodiscard]] CycleConfig cycle_config(Composition& c, const Overrides& overrides);
/// The same of a robot that is not connected, of that pace.
[[nodiscard]] CycleConfig cycle_config(Composition& c, const Overrides& overrides, hal::Pace pace);

}  // namespace tandem::runtime
