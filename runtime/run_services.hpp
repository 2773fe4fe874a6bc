// What a run can be asked for while it goes on: controllers come, go and change; joints are set.
// Start here to command a running loop from another thread.
// Layer: runtime.  Thread: any but the loop's; the loop's part is cycle_requests.cpp.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "base/seqlock.hpp"
#include "base/toml_reader.hpp"
#include "controllers/plugin_loader.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/image.hpp"
#include "runtime/controller_host.hpp"
#include "runtime/cycle_log.hpp"
#include "runtime/inbox.hpp"
#include "runtime/joint_looks.hpp"
#include "runtime/loop_asker.hpp"
#include "runtime/progress.hpp"
#include "runtime/text_history.hpp"

namespace tandem::runtime {

/// What became of a request that nothing speaks against.
struct RequestResult {
  bool done = false;  ///< false: the loop has not come to it yet, and does it in its next cycle
  std::uint64_t cycle = 0;  ///< in which it was done
  /// Phase of the run at the answer: in some phases a switch only selects who will start.
  hal::RunPhase phase = hal::RunPhase::kRunning;
  /// Not done, as time stands: the next cycle decides, whenever that is, and tells what it refuses.
  bool stands = false;
};

/// What became of a controller that was to be loaded anew.
struct Reloaded {
  RequestResult asked;
  Kept kept = Kept::kState;  ///< once it is done
  bool changed = false;      ///< its library is another than before
  /// Once it is done: what was set, or held, and did not go over, a line each with its name.
  std::vector<std::string> left{};
};

/// By what a controller was loaded, and would be loaded again.
struct LoadedAs {
  std::string library{};     ///< its path; empty: it is part of the program
  std::string parameters{};  ///< TOML
  std::string file{};        ///< where that is from
  std::string table{};       ///< the path of its parameters there
};

/// The table "controller[2].parameters" of a document; "" is all of it.
[[nodiscard]] TomlTable table_at(const TomlDocument& document, const std::string& path);

/// A loaded controller.
struct ControllerStatus {
  std::string name;
  std::string plugin;  ///< its library's path; may be empty
  bool active = false;
  bool shadow = false;         ///< it runs beside the active ones, and commands nothing
  bool done = false;           ///< it is active, and says that its task is done
  bool of_experiment = false;  ///< it came with it
  rt::Percentiles call_ns;     ///< of its calls in the cycle so far; 0: there was none
  std::uint64_t overruns = 0;  ///< late cycles that it was the reason for
  std::vector<ControllerSetup::Claim> claims;
};

/// A controller that runs as a shadow, or did.
struct ShadowStatus {
  std::string name;
  bool runs = false;
  ShadowLook look;
  std::vector<ControllerSetup::Claim> claims;
  std::vector<JointDifference> joints;  ///< by claim
  std::vector<std::string> owners;      ///< by claim: whose command that is; empty: nobody's
};

/// The signals of a loaded controller, which stay for as long as this is kept.
struct ControllerSignals {
  std::string controller;
  bool active = false;
  std::shared_ptr<const hal::SignalBlock> block;
};

/// The marks of a loaded controller that has some.
struct ControllerMarks {
  std::string controller;
  std::shared_ptr<const hal::MarkBlock> block;
};

/// An input of a loaded controller.
struct InputReport {
  std::shared_ptr<const InputPort> port;  ///< name, kind, components, source
  bool active = false;                    ///< its controller is
  InputLook look;
};

/// A sample for an input, by the components' names; of a trajectory its way-points.
struct InputRequest {
  std::vector<std::string> components{};  ///< those that are not named have what holds without one
  std::vector<double> numbers{};          ///< of each of them
  struct Point {
    double after_s = 0.0;
    std::vector<double> position_rad{};    ///< a number per joint
    std::vector<double> velocity_rad_s{};  ///< the same, of every way-point or of none
  };
  std::vector<Point> points{};
};

/// Gains to set; what is empty stays.
struct GainsRequest {
  std::optional<double> kp{}, ki{}, kd{};
};

/// A parameter to set, as it is asked for: of a list all elements, or one, "kp_Nm_rad.elbow".
struct ParameterWish {
  std::string controller, parameter;
  ParameterValue value;
};

/// A parameter of a loaded controller.
struct ParameterStatus {
  std::string name;
  std::string list{};  ///< that it is an element of; empty: it stands alone
  ParameterFacts facts;
  ParameterType type = ParameterType::kNumber;
  double otherwise = kNotGiven;  ///< its default, as `value`
  double value = kNotGiven;      ///< of a boolean 0 or 1, of a choice the word's index
};

/// Each request is judged before it reaches the loop, then done by the loop at a cycle's boundary,
/// whole or not at all. A call waits up to `patience` for that; zero: it does not wait. A loop
/// whose time stands, or which is very slow, comes to it with its next cycle, and the answer says
/// so.
///
/// Errors of all: the run shuts down or is done; kCapacity requests wait already.
class RunServices {
 public:
  using Patience = std::chrono::milliseconds;
  static constexpr Patience kPatience{1000};

  /// All outlive it. The loaded controllers get their channels of the log.
  RunServices(const hal::RobotConfig& robot, ControllerHost& host, Inbox& inbox,
              const Progress& progress, const hal::ParameterImage& gains, CycleLog& log,
              bool linked);

  /// For who asks in the thread of the loop.
  [[nodiscard]] LoopAsker& asker() noexcept { return asker_; }

  /// Loaded controllers, in the order in which they run.
  [[nodiscard]] std::vector<ControllerStatus> controllers();

  /// Configures a controller and hands it to the loop, inactive.
  /// Errors: ControllerHost::configure()'s; those of its parameters, all of them; a name that is
  /// taken; too many controllers. The run goes on as if nothing had been asked.
  [[nodiscard]] Result<RequestResult> load(const std::string& name, LoadedController plugin,
                                           const TomlDocument& parameters,
                                           Patience patience = kPatience);
  [[nodiscard]] Result<RequestResult> load(const std::string& name,
                                           std::shared_ptr<Controller> controller,
                                           const TomlDocument& parameters,
                                           Patience patience = kPatience);
  /// Takes an inactive controller from the loop and frees it.
  /// Errors: unknown (with the nearest name); active.
  [[nodiscard]] Result<RequestResult> unload(const std::string& name,
                                             Patience patience = kPatience);

  /// Errors: unknown; being reloaded.
  [[nodiscard]] Result<LoadedAs> loaded_as(const std::string& name);
  /// Loads the library of a controller as it is now, configures it with the same parameters, and
  /// puts it in the place of the former one in one cycle and without a bump, active as that was. It
  /// goes on with the former's state when its claims and the size of that are the same, and starts
  /// afresh otherwise, or when that is wanted.
  /// Errors: unknown; without a library; being reloaded already; load_controller()'s; those of
  /// load(); a joint that another active controller claims. The former one goes on then.
  [[nodiscard]] Result<Reloaded> reload(const std::string& name, bool fresh = false,
                                        Patience patience = kPatience);
  /// The same with the new one as it is given.
  [[nodiscard]] Result<Reloaded> reload(const std::string& name, ControllerSource source,
                                        bool fresh = false, Patience patience = kPatience);

  /// Stops some controllers and starts others in one cycle, all or none. Before the controllers
  /// have started, and after a stop, it sets who will start; after a reset, in the phase held, it
  /// starts them at once.
  /// Errors: unknown; named twice; stopped and not active; started and active; a joint that two
  /// would claim (both and the joint are named).
  [[nodiscard]] Result<RequestResult> switch_controllers(const std::vector<std::string>& stop,
                                                         const std::vector<std::string>& start,
                                                         Patience patience = kPatience);
  /// Starts, in one cycle and without a bump, the controllers that were active before a reset.
  /// Errors: nothing is held back; all of them were unloaded; a joint that two would claim.
  [[nodiscard]] Result<RequestResult> go_on(Patience patience = kPatience);

  /// Lets a loaded, inactive controller run beside the active ones without commanding anything.
  /// Errors: unknown; active; a shadow already; no controllers run.
  [[nodiscard]] Result<RequestResult> begin_shadow(const std::string& name,
                                                   Patience patience = kPatience);
  /// Errors: unknown; no shadow.
  [[nodiscard]] Result<RequestResult> end_shadow(const std::string& name,
                                                 Patience patience = kPatience);
  /// switch_controllers(), in the first cycle after one in which the shadows of `start` agreed with
  /// the command: in each joint that they claim in mode, interaction and, within `within` of its
  /// unit, in the reference that leads in that mode. Done means that it waits; what becomes of it,
  /// last_switch() tells. Errors: switch_controllers()'s; one to start is no shadow; another waits.
  /// @param wait_ns  of the run's time: so long it waits at most
  [[nodiscard]] Result<RequestResult> switch_when(const std::vector<std::string>& stop,
                                                  const std::vector<std::string>& start,
                                                  double within, std::int64_t wait_ns,
                                                  Patience patience = kPatience);
  /// The switch that waits does no longer. Errors: none waits.
  [[nodiscard]] Result<RequestResult> cancel_switch(Patience patience = kPatience);
  /// Another delay, jitter or loss of the declared link, in simulated time.
  /// Errors: there is no such link.
  [[nodiscard]] Result<RequestResult> set_link(const hal::LinkChange& change,
                                               Patience patience = kPatience);
  [[nodiscard]] SwitchLook last_switch() const { return host_->shadows().last_switch(); }
  /// Shadows, and those that have ended as one, in the order in which they run.
  [[nodiscard]] std::vector<ShadowStatus> shadows();

  /// Parameters of a loaded controller, in the order in which it declares them.
  /// Errors: unknown (with the nearest name).
  [[nodiscard]] Result<std::vector<ParameterStatus>> parameters(const std::string& controller);
  /// Sets live parameters of loaded controllers, active or not, between two cycles: all or none.
  /// Errors: nothing is named; more than kMostParameterChanges; an unknown controller or parameter
  /// (with the nearest name); one that is not live, of another type or length, not finite, out of
  /// range, named twice.
  [[nodiscard]] Result<RequestResult> set_parameters(const std::vector<ParameterWish>& wishes,
                                                     Patience patience = kPatience);

  /// Every joint, in the image's order.
  [[nodiscard]] std::vector<JointInfo> joints();
  /// Every sensor, in the image's order.
  [[nodiscard]] std::vector<SensorReport> sensors() const;
  /// Those of every loaded controller that has some, in the order in which they run.
  [[nodiscard]] std::vector<ControllerSignals> signals();
  [[nodiscard]] std::vector<ControllerMarks> marks();
  /// Changes when a controller comes or goes; never 0.
  [[nodiscard]] std::uint64_t loads() const noexcept { return loads_.load(); }
  /// Changes when a controller comes or goes, and when a parameter may have another value.
  [[nodiscard]] std::uint64_t parameter_version() const noexcept {
    return loads_.load() + host_->parameter_changes();
  }
  /// What controllers have said.
  [[nodiscard]] const TextHistory& texts() const noexcept { return texts_; }
  /// Mode and interaction of a joint that no active controller claims, impedance of any. A joint
  /// that has to be homed, or is being homed, is refused, here and by what follows.
  /// Errors: unknown joint; claimed (the controller is named); not while controllers run; a mode
  /// that the joint lacks; a value beyond its limit (which is named).
  [[nodiscard]] Result<RequestResult> set_joint(const std::string& joint, const JointRequest& wish,
                                                Patience patience = kPatience);
  /// Leads a joint that stands outside its position limits, and that no active controller claims,
  /// back to the nearer one, at the speed that CommandLimits allows out there.
  /// Errors: unknown joint; claimed; within its limits; not in position control; not in the phases
  /// held or running.
  [[nodiscard]] Result<RequestResult> recover(const std::string& joint,
                                              Patience patience = kPatience) {
    return ask_of_joint(CycleRequest::Kind::kRecover, joint, patience);
  }
  /// Moves a joint that no active controller claims, on a trapezoid of speed; one under way goes
  /// over into it. Without a target it brakes. Done means begun.
  /// Errors: unknown joint; claimed; a target, speed or acceleration beyond its limits (which are
  /// named); not in position control; outside its limits; not in the phases held or running.
  [[nodiscard]] Result<RequestResult> move_joint(const std::string& joint, const MoveRequest& wish,
                                                 Patience patience = kPatience);
  /// Clears the latched fault of one drive. In the phase faulted the drive stays disabled and the
  /// run stopped; else, with a fault that only warned, the joint is enabled and held where it is.
  /// Done means begun: JointStatus::resetting.
  /// Errors: unknown joint; claimed, while controllers run; its board is lost; the drives are
  /// another process'; another phase than faulted, held, settling, running.
  [[nodiscard]] Result<RequestResult> reset_joint(const std::string& joint,
                                                  Patience patience = kPatience) {
    return ask_of_joint(CycleRequest::Kind::kReset, joint, patience);
  }
  /// Lets the drive of a joint find the joint's place, as its `homing` in robot.toml says.
  /// Meanwhile nothing else moves the joint; stop it by move_joint() without a target. How it ends,
  /// joints() tells. Errors: unknown joint; it has no homing; claimed, while controllers run; its
  /// drive is in fault or not enabled; another process drives the robot; not in the phases held and
  /// running.
  [[nodiscard]] Result<RequestResult> home_joint(const std::string& joint,
                                                 Patience patience = kPatience) {
    return ask_of_joint(CycleRequest::Kind::kHome, joint, patience);
  }
  /// Gains of one of its drive's loops; they travel by SDO, within some ten cycles.
  /// Errors: unknown joint; a loop that it lacks; a gain that is negative, or no 32-bit number.
  [[nodiscard]] Result<RequestResult> set_gains(const std::string& joint, hal::PidLoop loop,
                                                const GainsRequest& wish,
                                                Patience patience = kPatience);
  /// Every input of every loaded controller, in the order in which they run.
  [[nodiscard]] std::vector<InputReport> inputs();
  /// Gives an input a sample, in the next cycle. A newer one within that cycle takes its place.
  /// @param name  the input's, or "CONTROLLER/INPUT" where several have it
  /// Errors: no such input, or several; another source feeds it; its controller is not active, or
  /// not while controllers run; a component that it lacks; a value beyond its bounds.
  [[nodiscard]] Result<RequestResult> set_input(const std::string& name, const InputRequest& wish,
                                                Patience patience = kPatience);
  /// Counts a sample that is none, as set_input() does what it refuses. Nothing without such an
  /// input.
  void refuse_input(const std::string& name, const Error& why);
  /// The inputs of the controllers that came with the experiment, which `feeder` feeds.
  [[nodiscard]] std::vector<std::shared_ptr<InputPort>> inputs_of(InputFeeder feeder);
  /// Whether whoever feeds `port` may do so now: its controller is active, controllers run, and
  /// nobody commands the robot from afar.
  [[nodiscard]] Status check_runs(const InputPort& port);

  /// The run's time in the newest cycle.
  [[nodiscard]] std::int64_t time_ns() const noexcept { return progress_->time_ns.load(); }

  /// Who commands the robot from afar; empty text: nobody. Called on any thread.
  void name_owner(std::function<std::string()> owner);

  /// From now on nothing is asked for, but for what the loop would say: each question is checked as
  /// one at any time of a run, whoever is active then. Before the first cycle of a run that nobody
  /// steps. What is loaded stays loaded.
  void ask_ahead() noexcept { asks_ahead_ = true; }
  [[nodiscard]] bool asks_ahead() const noexcept { return asks_ahead_; }

  /// Whether set_gains() would take them now; the same errors.
  [[nodiscard]] Status check_gains(const std::string& joint, hal::PidLoop loop,
                                   const GainsRequest& wish);

  /// The loop's: shows the joints, the sensors, and the gains that are in force. @rt wait-free.
  void show(std::span<const JointStatus> joints) noexcept TANDEM_RT { looks_.write(joints); }
  void show(std::span<const SensorStatus> sensors) noexcept TANDEM_RT {
    sensor_looks_.write(sensors);
  }
  void show(const hal::ParameterImage& gains) noexcept TANDEM_RT { gain_looks_.write(gains.all()); }
  void show(const hal::TextEvent& words) noexcept TANDEM_RT { texts_.write(words); }
  /// The loop's: time went back to here, and what was said after it is of another future.
  void forget_after(std::int64_t time_ns) noexcept { texts_.forget_after(time_ns); }

 private:
  using Lock = std::unique_lock<std::mutex>;

  [[nodiscard]] Result<RequestResult> load(std::unique_ptr<HostedController> controller,
                                           Patience patience);
  [[nodiscard]] Status check_name(const std::string& name);
  /// For the log, with the next cycles.
  static void tell_loaded(HostedController& controller);
  [[nodiscard]] static Status errors_of(const TomlDocument& document, const std::string& library,
                                        const char* missing = "give it with --set or --parameters",
                                        const char* unknown = "");
  [[nodiscard]] Result<HostedController*> to_reload(const std::string& name) const;
  /// Asks for what needs no more than a joint.
  [[nodiscard]] Result<RequestResult> ask_of_joint(CycleRequest::Kind kind,
                                                   const std::string& joint, Patience patience);
  [[nodiscard]] Result<RequestResult> ask(Lock& lock, CycleRequest request, Patience patience);
  void take_back(const CycleRequest& request);
  void collect();
  void free_what_left(const CycleRequest& request, const CycleAnswer& answer);
  void forget_changes(const CycleRequest& request);
  [[nodiscard]] Status add_changes(const ParameterWish& wish,
                                   std::vector<ParameterChange>& changes) const;
  [[nodiscard]] Error refusal(const CycleAnswer& answer) const;
  [[nodiscard]] Status check_phase() const;
  [[nodiscard]] Result<std::size_t> slot_of(const std::string& name) const;
  [[nodiscard]] Result<ControllerSet> set_of(const std::vector<std::string>& names) const;
  [[nodiscard]] std::string names_of(ControllerSet set) const;
  [[nodiscard]] Status check_switch(ControllerSet stop, ControllerSet start) const;
  [[nodiscard]] ControllerSet planned() const;
  [[nodiscard]] Result<RequestResult> ask_to_switch(const std::vector<std::string>& stop,
                                                    const std::vector<std::string>& start,
                                                    CycleRequest request, Patience patience);
  [[nodiscard]] Result<RequestResult> ask_of_shadow(const std::string& name, bool begins,
                                                    Patience patience);
  [[nodiscard]] Result<std::size_t> joint_of(const std::string& name) const;
  [[nodiscard]] Result<std::size_t> gains_fit(const std::string& joint, hal::PidLoop loop,
                                              const GainsRequest& wish);
  [[nodiscard]] Result<std::shared_ptr<InputPort>> input_of(const std::string& name) const;
  [[nodiscard]] Status check_runs_locked(const InputPort& port) const;
  [[nodiscard]] Result<std::size_t> joint_to_change(const std::string& name);
  [[nodiscard]] Status check_mode(std::size_t joint, const JointRequest& wish,
                                  const JointStatus& now) const;
  [[nodiscard]] Status check_unclaimed(std::size_t joint) const;
  [[nodiscard]] Status check_free_to_move(std::size_t joint) const;
  [[nodiscard]] std::vector<JointStatus> looks() const;
  [[nodiscard]] std::string controller_name(std::int32_t slot) const;

  const hal::RobotConfig* robot_;
  ControllerHost* host_;
  Inbox* inbox_;
  const Progress* progress_;
  CycleLog* log_;
  Seqlock<JointStatus> looks_;
  Seqlock<SensorStatus> sensor_looks_;
  Seqlock<hal::PidGains> gain_looks_;
  TextHistory texts_;
  std::atomic<std::uint64_t> loads_{1};
  LoopAsker asker_;
  bool asks_ahead_ = false;
  bool linked_;

  std::mutex mutex_;  // of all below, and of the asking side of inbox and host
  std::function<std::string()> owner_;
  std::uint64_t number_ = 0;                                     // of the last request
  std::map<std::uint64_t, CycleRequest> asked_;                  // not answered yet
  std::map<std::uint64_t, std::optional<CycleAnswer>> awaited_;  // that somebody waits for
  std::vector<std::unique_ptr<const std::vector<ParameterChange>>> changes_;  // of asked_
};

}  // namespace tandem::runtime
