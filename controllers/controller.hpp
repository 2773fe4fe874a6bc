// The plugin API: what a controller is, and how a shared library offers one. Start here to write
// a controller; example 03 is a whole one.
// Layer: controllers.  Thread: configure non-RT; start, update, stop RT.
#pragma once

#if __cplusplus < 202100L
#error "controllers are C++23: build with -std=c++23, of g++ 12 or newer"
#endif

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "base/toml_reader.hpp"
#include "controllers/controller_io.hpp"
#include "hal/cycle_time.hpp"
#include "hal/estimate.hpp"
#include "hal/image.hpp"
#include "hal/predictor.hpp"
#include "hal/robot.hpp"
#include "model/kernels.h"

namespace tandem {

/// What a controller may know and ask for when it is configured.
class ControllerSetup {
 public:
  ControllerSetup(const hal::Robot& robot_in, hal::ParameterImage& gains_in,
                  const tandem_kernels* kernels_in, std::int64_t period_ns_in,
                  TomlTable parameters_in, std::span<const double> start_position_rad_in = {},
                  const hal::EstimateImage* estimate_in = nullptr,
                  hal::Predictor* predictor_in = nullptr)
      : robot(robot_in),
        gains(gains_in),
        kernels(kernels_in),
        period_ns(period_ns_in),
        parameters(std::move(parameters_in)),
        start_position_rad(start_position_rad_in),
        estimate(estimate_in),
        predictor(predictor_in) {}

  const hal::Robot& robot;  ///< joints and their limits, sensors, sites, feet, postures
  /// Gains of the drives' loops, for hal::Devices; set those of claimed joints only, in start()
  /// and update(). They outlive the controller.
  hal::ParameterImage& gains;
  const tandem_kernels* kernels;  ///< the robot's generated model; null when it has none
  std::int64_t period_ns;         ///< the cycle's nominal period
  TomlTable parameters;           ///< [controller.parameters]; unknown keys are reported for you
  /// Where the joints stand when the controller starts, in the image's order, as the experiment
  /// says; empty: not known, as while a run goes on. Valid during configure().
  std::span<const double> start_position_rad;
  /// What is estimated of the robot, of this cycle in start() and update(): the base's state,
  /// contacts, external torques and wrenches. Null without [estimation]; outlives the controller.
  const hal::EstimateImage* estimate;
  /// Runs the robot ahead of its time; null where the run has no model of it: a real robot without
  /// [parallel]. It outlives the controller. docs/internal-model.md
  hal::Predictor* predictor;
  /// What the controller declares with the functions below; the host keeps it.
  const std::shared_ptr<ControllerIo> io = std::make_shared<ControllerIo>();

  /// Declares a parameter, and reads it of `parameters`: {.unit = "Nm/rad", .min = 0, .max = 500,
  /// .otherwise = 40, .live = true, .doc = "…"}. The name is [controller.parameters]', letters,
  /// digits and _. One without `otherwise` has to be given. One that is `live` is set between two
  /// cycles by `tandem controller set`, also while the controller runs: read it in each update().
  /// Errors go to `parameters`; the handle then has the default, or a number of no meaning.
  [[nodiscard]] Parameter parameter(std::string_view name, ParameterFacts facts) {
    return io->parameters.declare(parameters, name, std::move(facts));
  }
  /// Declares a number for each of some joints, as those that it claims: `kp_Nm_rad = 40` for all,
  /// `= [40, 40, 20]` in their order, or `= { elbow = 20 }`. Each is set by itself, too:
  /// "kp_Nm_rad.elbow". `kp_[i]` is that of the i-th of `joints`.
  /// @param joints  indices in the image
  /// @param facts   of all of them, or one for each, where range or default differ
  [[nodiscard]] std::vector<Parameter> joint_parameters(std::string_view name,
                                                        std::span<const std::size_t> joints,
                                                        const std::vector<ParameterFacts>& facts) {
    std::vector<std::string> names;
    for (const std::size_t joint : joints) names.push_back(robot.joints.at(joint).name);
    return io->parameters.declare_list(parameters, name, names, facts);
  }
  /// The same of anything that has names: {"x", "y", "z"}.
  [[nodiscard]] std::vector<Parameter> list_parameters(std::string_view name,
                                                       const std::vector<std::string>& elements,
                                                       const std::vector<ParameterFacts>& facts) {
    return io->parameters.declare_list(parameters, name, elements, facts);
  }

  /// Claims a joint (index in the image) in a mode. Two controllers that claim one joint are an
  /// error before anything moves; a joint that nobody claims is held by the loop. What a controller
  /// writes to another joint, and modes that it writes, are taken back and reported.
  void claim(std::size_t joint, hal::ControlMode mode,
             hal::InteractionMode interaction = hal::InteractionMode::kStiff) {
    claims_.push_back({joint, mode, interaction, false});
  }
  /// The same for a controller that writes the joint's mode and interaction in its updates, any
  /// that the joint can do. They begin as `mode`, stiff.
  void claim_with_modes(std::size_t joint, hal::ControlMode mode) {
    claims_.push_back({joint, mode, hal::InteractionMode::kStiff, true});
  }
  struct Claim {
    std::size_t joint;
    hal::ControlMode mode;
    hal::InteractionMode interaction;
    bool with_modes;
  };
  [[nodiscard]] std::span<const Claim> claims() const { return claims_; }

  /// Declares something that the controller wants to be told while it runs, from wherever the
  /// experiment says. A declaration that makes no sense is an error after configure().
  /// @param name  unique among the controller's: letters, digits, '_'
  [[nodiscard]] Input input(std::string name, InputKind kind, InputOptions options = {}) {
    return io->inputs.declare(std::move(name), kind, std::move(options));
  }

  /// Says that what `key` of `table` wants is reached only `time_s` after the controller's start.
  /// `tandem check` and `tandem run` warn of what is later than the end of the experiment.
  void plan(const TomlTable& table, std::string_view key, double time_s) {
    plans_.push_back({time_s, table.error_at(key, {})});
  }
  struct Plan {
    double time_s;  ///< after the start
    Error where;    ///< file, line and key; without a message
  };
  [[nodiscard]] std::span<const Plan> plans() const { return plans_; }

  // What the controller tells beside its command: docs/controllers.md#signals. What is wrong with
  // a declaration is an error of the controller's once configure() has returned.

  /// A number of the controller's own: `depth_ = setup.signal("depth", "m", "of the crouch")`.
  /// @param name  lower-case letters, digits and _; unique in the controller
  /// @param unit  "rad", "Nm"; empty: it has none
  [[nodiscard]] Signal signal(std::string name, std::string unit, std::string doc) {
    return declare_signal(std::move(name), std::move(unit), std::move(doc), 1, false);
  }
  /// `count` numbers of one unit.
  [[nodiscard]] Signal signals(std::string name, std::string unit, std::string doc,
                               std::size_t count) {
    return declare_signal(std::move(name), std::move(unit), std::move(doc), count, false);
  }
  /// A number for each joint, in the image's order; of a slide [m] and [N].
  [[nodiscard]] Signal joint_signals(std::string name, std::string unit, std::string doc) {
    return declare_signal(std::move(name), std::move(unit), std::move(doc), robot.joints.size(),
                          true);
  }
  /// Lines of text from the cycle: `log_("stance changed", foot)`.
  [[nodiscard]] TextEvents text_events() const { return TextEvents({io, &io->texts}); }
  /// A shape for viewers. @param name  unique in the controller
  [[nodiscard]] Mark mark(std::string name, hal::MarkStyle style) {
    const std::size_t made = io->marks.declare(std::move(name), std::move(style));
    return {{io, &io->marks}, made};
  }

 private:
  [[nodiscard]] Signal declare_signal(std::string name, std::string unit, std::string doc,
                                      std::size_t count, bool by_joint) {
    double* const at =
        io->signals.declare(std::move(name), std::move(unit), std::move(doc), count, by_joint);
    if (at == nullptr) return {};
    return {{io, at}, count};
  }

  std::vector<Claim> claims_;
  std::vector<Plan> plans_;
};

/// A controller. It sees state, command and time; never a driver, a clock or a thread.
class Controller {
 public:
  virtual ~Controller() = default;

  /// Reads parameters, claims joints, allocates all it will ever need.
  [[nodiscard]] virtual Status configure(ControllerSetup& setup) = 0;

  /// First cycle: seeds references from the measured state, so that nothing jumps.
  virtual void start(const hal::CycleTime& time, const hal::StateImage& state,
                     hal::CommandImage& command) noexcept TANDEM_RT = 0;

  /// Each cycle, the first included: writes the references of the claimed joints, and of no other.
  /// Modes are already set from the claims.
  /// @return kOk; kStopped when its task is done; anything else stops the robot (category 1).
  [[nodiscard]] virtual Code update(const hal::CycleTime& time, const hal::StateImage& state,
                                    hal::CommandImage& command) noexcept TANDEM_RT = 0;

  /// Whether retreat() can ever be true. `tandem check` asks, also before configure().
  [[nodiscard]] virtual bool can_retreat() const noexcept TANDEM_RT { return false; }

  /// A stop of category 2 begins: from now on update() brings the robot to a posture in which less
  /// happens when the drives are stopped, and then returns kStopped. It has the time of [faults]
  /// retreat_s for that. Not called where can_retreat() is false.
  /// @return false: it cannot, and is stopped; its joints are held
  [[nodiscard]] virtual bool retreat(const hal::CycleTime&,
                                     const hal::StateImage&) noexcept TANDEM_RT {
    return false;
  }

  /// After the last update.
  virtual void stop() noexcept TANDEM_RT {}

  /// Everything that update() depends on, for snapshots. For a prediction it is called between two
  /// cycles of a robot: it takes no heap and no lock. A controller whose members do not change
  /// after configure() says so by an empty override; one with members and without an override is
  /// named by `tandem check` and `tandem predict`.
  virtual void archive(Archive&) {}
};

/// Version of what a plugin sees: this header and those that it includes. Raised with every change
/// of them after which a plugin has to be built again. How a robot is wired is in none of them.
inline constexpr std::uint32_t kControllerInterface = 17;

/// FNV-1a of some numbers, folded to 16 bits.
[[nodiscard]] constexpr std::uint32_t hash_of(std::initializer_list<std::size_t> numbers) noexcept {
  std::uint64_t hash = 0xCBF29CE484222325U;
  for (const std::size_t number : numbers) hash = (hash ^ number) * 0x100000001B3U;
  return static_cast<std::uint32_t>((hash ^ hash >> 16 ^ hash >> 32 ^ hash >> 48) & 0xFFFFU);
}

/// The version, and below it a hash of the sizes that go with it: a change whose version nobody
/// raised, or another standard library, is found as well.
inline constexpr std::uint32_t kControllerAbi =
    kControllerInterface << 16 | hash_of({sizeof(ControllerSetup),
                                          sizeof(ControllerSetup::Claim),
                                          sizeof(hal::Robot),
                                          sizeof(hal::DrivenJoint),
                                          sizeof(hal::PassiveJoint),
                                          sizeof(hal::Follower),
                                          sizeof(hal::Sensor),
                                          sizeof(hal::Site),
                                          sizeof(hal::Foot),
                                          sizeof(hal::Posture),
                                          sizeof(model::KinematicLoop),
                                          sizeof(hal::StateImage),
                                          sizeof(hal::EstimateImage),
                                          sizeof(hal::CommandImage),
                                          sizeof(hal::ParameterImage),
                                          sizeof(hal::Prediction),
                                          sizeof(hal::CycleTime),
                                          sizeof(TomlTable),
                                          sizeof(tandem_kernels),
                                          sizeof(ControllerIo),
                                          sizeof(Signal),
                                          sizeof(TextEvents),
                                          sizeof(Mark),
                                          sizeof(hal::SignalBlock),
                                          sizeof(hal::MarkBlock),
                                          sizeof(hal::MarkInfo),
                                          sizeof(hal::TextEvent),
                                          sizeof(ParameterRow),
                                          sizeof(Parameter),
                                          sizeof(InputOptions),
                                          sizeof(InputBlock),
                                          sizeof(Input)});

/// Whether `Class` has members of its own, but no archive(): what a snapshot may lack.
template <class Class>
[[nodiscard]] consteval bool lacks_archive() noexcept {
  if constexpr (requires { &Class::archive; }) {  // not of one that is private, or overloaded
    using Inherited = void (Controller::*)(Archive&);
    return std::is_same_v<decltype(&Class::archive), Inherited> &&
           sizeof(Class) > sizeof(Controller);
  }
  return false;
}

/// What `tandem_controller_plugin()` of a shared library returns.
struct ControllerPlugin {
  std::uint32_t abi;           ///< kControllerAbi of the headers it was built with
  const char* compiler;        ///< __VERSION__ of its compiler, for the error message
  const char* name;            ///< "squat"
  const char* doc;             ///< one line for `tandem check`
  Controller* (*create)();     ///< never null
  bool lacks_archive = false;  ///< lacks_archive() of its class
};

}  // namespace tandem

/// Defines the library's entry point: `TANDEM_CONTROLLER(Squat, "squat", "One line.")`.
#define TANDEM_CONTROLLER(Class, plugin_name, plugin_doc)                             \
  extern "C" __attribute__((visibility("default"))) const ::tandem::ControllerPlugin* \
  tandem_controller_plugin() {                                                        \
    static const ::tandem::ControllerPlugin plugin{                                   \
        ::tandem::kControllerAbi,                                                     \
        __VERSION__,                                                                  \
        plugin_name,                                                                  \
        plugin_doc,                                                                   \
        []() -> ::tandem::Controller* { return new Class; },                          \
        ::tandem::lacks_archive<Class>()};                                            \
    return &plugin;                                                                   \
  }
