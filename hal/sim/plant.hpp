// The simulated body: generated multibody dynamics, actuators, ground contact and hoist, advanced
// in fixed sub-steps. Start here to read the simulation; docs/simulation.md has the equations.
// Layer: hal/sim.  Thread: create non-RT; the rest RT.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/actuator.hpp"
#include "hal/sim/added_inertia.hpp"
#include "hal/sim/body_contact.hpp"
#include "hal/sim/closure_forces.hpp"
#include "hal/sim/contact.hpp"
#include "hal/sim/end_stops.hpp"
#include "hal/sim/engine_loader.hpp"
#include "hal/sim/flight_momentum.hpp"
#include "hal/sim/hoist.hpp"
#include "hal/sim/light_joints.hpp"
#include "hal/sim/plant_state.hpp"
#include "hal/sim/push.hpp"
#include "model/kernels.h"
#include "model/sines.hpp"

namespace tandem::sim {

enum class Integrator : std::uint8_t {
  kLeapfrog,     ///< order 2, one evaluation a sub-step: see docs/simulation.md
  kRungeKutta4,  ///< order 4, four evaluations a sub-step
};

/// The sub-step in units of u, which hal/sim/stability.hpp limits.
[[nodiscard]] constexpr double step_stretch(Integrator integrator) noexcept {
  return integrator == Integrator::kRungeKutta4 ? 2.6 : 2.0;
}
/// So many times as much a damper counts there whose velocity the leapfrog predicts: it is stable
/// in half the sub-step.
inline constexpr double kPredictedDamper = 2.0;

/// One joint of the plant, in the process image's order.
struct PlantJoint {
  std::string name;  ///< of the kernels' joint
  hal::ActuatorConfig actuator;
  double position_rad = 0.0;     ///< at the start
  double damping_Nms_rad = 0.0;  ///< of the joint itself, on the link side
  std::optional<hal::BrakeConfig> brake = {};
  double added_armature_kg_m2 = 0.0;  ///< to the kernels'
};

struct PlantConfig {
  const tandem_kernels* kernels = nullptr;
  /// kOwnEngine, or who else moves the bodies and holds the soles up; then with `robot` and `tree`.
  std::string engine = kOwnEngine;
  std::vector<PlantJoint> joints;
  hal::ContactConfig contact;
  double base_height_m = 0.0;  ///< of the floating base at the start, upright at x = y = 0
  Integrator integrator = Integrator::kLeapfrog;
  std::int64_t substep_ns = 250'000;
  /// Start held: the base by a hoist, every joint whose bridge is off by a brake, until release().
  bool held = false;
  std::int64_t release_ns = 1'000'000'000;  ///< how long the hoist takes to let the base down
  double lift_m = 0.0;  ///< above base_height_m; not 0: the hoist never lets the base down
  std::vector<hal::PassiveConfig> passive;  ///< the kernels' joints without an actuator
  std::vector<model::KinematicLoop> loops;
  /// Where joints end: of the kernels' joints, any of them. A passive joint whose loop starts it
  /// beyond its end ends there.
  std::vector<JointRange> ranges;
  /// What links other than soles touch the ground with; nothing without the description.
  const hal::RobotConfig* robot = nullptr;
  const model::Tree* tree = nullptr;
  /// The same tree with the masses that the plant has, where the kernels' are other ones.
  const model::Tree* actual = nullptr;
  std::vector<Load> carried = {};  ///< at the start; another engine carries nothing
  double rate_limit = 1000.0;      ///< any |v| beyond it [rad/s or m/s] counts as diverged
};

/// What the encoders and the power stage of one joint see. Link side, about the joint's +axis.
struct JointReading {
  double position_rad, velocity_rad_s;
  double motor_position_rad, motor_velocity_rad_s;
  double torque_Nm;  ///< on the link: the spring's, or a rigid drive's (J th'' not taken off)
  double current_A, voltage_V, temperature_C;
};

/// Its state: PlantState, temperatures of windings (in Actuators), anchors of the contact points
/// (in Contact), how far the hoist is released (in Hoist).
///
/// Inputs, held over a sub-step: voltage, bridge and brake of every joint. Joints are numbered
/// as in PlantConfig; inside, and in q() and v(), they stand in the kernels' order, the passive
/// ones (whose motor's state is that of the link) among them.
///
/// Loops: the state lies on the closed loops, to ClosureForces' bound, after every sub-step.
///
/// With another engine that one moves q and v, by its own integrator and with its own ground under
/// the soles; vdot and the soles' wrenches are means over the last sub-step then. It allocates.
class Plant {
 public:
  /// Errors: kernels of another ABI, a joint the kernels lack or that has no [[joint]], a foot
  /// that is no wrench site, a bad actuator or contact, a sub-step that is not positive, a loop
  /// that the passive joints cannot close from the start's posture; those of make_engine().
  [[nodiscard]] static Result<Plant> create(const PlantConfig& config);

  /// What joint `joint`'s drive applies from now on.
  void set_drive(std::size_t joint, double voltage_V, bool bridge_on) noexcept TANDEM_RT;
  /// Current in the coil of its brake, or none: it obeys after its time. Without a brake nothing.
  void set_brake_coil(std::size_t joint, bool current) noexcept TANDEM_RT {
    actuators_.set_coil(map_[joint], current);
  }
  /// Whether its brake presses on the rotor.
  [[nodiscard]] bool brake_closed(std::size_t joint) const noexcept {
    return actuators_.brake_closed(map_[joint]);
  }
  /// Lets go what holds joints at power-on, for good, and starts to let the base down. Further
  /// calls do nothing.
  void release() noexcept TANDEM_RT;
  [[nodiscard]] bool released() const noexcept { return released_ != 0 && !hoist_.holding(); }

  /// Damage: see Actuators. They last until a snapshot from before is restored.
  void break_spring(std::size_t joint) noexcept TANDEM_RT {
    actuators_.break_spring(map_[joint]);
    vdot_fresh_ = 0;
  }
  void heat_winding(std::size_t joint, double at_least_C) noexcept TANDEM_RT {
    actuators_.heat(map_[joint], at_least_C);
  }

  /// Who pushes the robot from outside; empty without the description.
  [[nodiscard]] Pushes& pushes() noexcept { return pushes_; }

  /// What the robot carries from now on, whatever it was before. Needs the description.
  void carry(std::span<const Load> loads) noexcept TANDEM_RT;
  [[nodiscard]] const AddedInertia& added() const noexcept { return added_; }
  /// Another engine moves the bodies, which keep their masses.
  [[nodiscard]] bool has_engine() const noexcept { return engine_ != nullptr; }

  /// 1: the hoist holds the base, 0: it is free.
  [[nodiscard]] double hoist_share() const noexcept { return hoist_.share(); }

  /// Advances by `duration_ns`, in sub-steps of the configured length (the last may be shorter).
  /// @return kOk; kDiverged when a rate is not finite or beyond the limit; then the plant stands
  ///         still and diverged_text() says which joint and when.
  [[nodiscard]] Code advance(std::int64_t duration_ns) noexcept TANDEM_RT;

  /// Evaluates forces and accelerations at the present state, for sensors. Cheap when nothing
  /// changed since; the next sub-step reuses it. Pushes are those of the last sub-step.
  void evaluate() noexcept TANDEM_RT;

  /// @pre evaluate() since the last advance(), for torque_Nm.
  [[nodiscard]] JointReading joint(std::size_t joint) const noexcept TANDEM_RT;
  [[nodiscard]] std::size_t joints() const noexcept { return map_.size(); }
  [[nodiscard]] std::int64_t time_ns() const noexcept { return time_ns_; }

  // Views for sensors, truth and tests. Those that are forces need evaluate().
  [[nodiscard]] const tandem_kernels& kernels() const noexcept { return *kernels_; }
  [[nodiscard]] const double* q() const noexcept { return x_.q(); }
  [[nodiscard]] const double* v() const noexcept { return x_.v(); }
  /// For the kernels' _at forms at q(). @pre evaluate() since the last advance()
  [[nodiscard]] const double* sines() const noexcept { return sines_.data(); }
  [[nodiscard]] const double* vdot() const noexcept { return vdot_.data(); }
  [[nodiscard]] const double* tau() const noexcept { return tau_.data(); }
  [[nodiscard]] const double* wrench() const noexcept { return wrench_.data(); }
  /// What force/torque sensor `sensor` (of robot.toml) feels of what the kernels do not know.
  void add_beyond(std::size_t sensor, double* channels) noexcept TANDEM_RT;
  /// The whole robot's, in W; as the kernels' of this name.
  void center_of_mass(double* c, double* cdot, double* J) noexcept TANDEM_RT;
  [[nodiscard]] const double* pose() const noexcept { return pose_.data(); }
  [[nodiscard]] const ClosureForces& loops() const noexcept { return loops_; }
  [[nodiscard]] const Contact& contact() const noexcept { return contact_; }
  [[nodiscard]] const BodyContact& bodies() const noexcept { return bodies_; }
  [[nodiscard]] const EndStops& end_stops() const noexcept { return stops_; }
  [[nodiscard]] const Actuators& actuators() const noexcept { return actuators_; }
  /// Whether the dampers of the kernels' joint `joint` go by a velocity that is predicted.
  [[nodiscard]] bool predicts(std::size_t joint) const noexcept {
    return leaps_ && predicted_[joint] != 0.0;
  }
  /// Index of joint `joint` among the kernels' joints.
  [[nodiscard]] std::size_t model_index(std::size_t joint) const noexcept { return map_[joint]; }
  /// The same of the passive joints, in PlantConfig's order.
  [[nodiscard]] const std::vector<std::size_t>& passive() const noexcept { return passive_; }

  /// Puts the plant into a state of choice (tests, start of a run): joints in the kernels' order,
  /// motors at rest with their springs relaxed. @pre the loops are closed
  void set_state(std::span<const double> q, std::span<const double> v) noexcept;

  [[nodiscard]] bool diverged() const noexcept { return diverged_ >= 0; }
  /// "joint LKneeSag at 1.2345 s: …"; empty while all is well.
  [[nodiscard]] std::string diverged_text() const;

  void archive(Archive& ar);

 private:
  explicit Plant(const PlantConfig& config);
  Status map_joints(const PlantConfig& config);
  Status place_contact(const PlantConfig& config);
  Status make_loops(const PlantConfig& config);
  void add_inertia(const PlantConfig& config);
  Status open_engine(const PlantConfig& config);
  Status start(const PlantConfig& config);
  void fit_passive_friction(const PlantConfig& config, std::span<const double> q);
  void place_surroundings(const PlantConfig& config);
  void predict_dampers(std::span<const JointInertia> inertias);
  Status close_loops(double* q);
  void hold(const double* q, std::span<const double> load);

  void evaluate(std::int64_t step_ns) noexcept;
  void touch_ground(const PlantState& x, const double* v, bool move_anchors,
                    double ahead_s = 0.0) noexcept;
  [[nodiscard]] double rise_m(PlantState& at) noexcept;
  /// At a state: by which velocity what goes.
  struct Velocities {
    const double *dynamics, *forces;              ///< (nv)
    const double *joint_dampers, *motor_dampers;  ///< (n)
  };
  [[nodiscard]] static Velocities velocities_of(const PlantState& x) noexcept;
  [[nodiscard]] Velocities leap_velocities() const noexcept;
  void begin_leaps() noexcept;
  void rates(const PlantState& x, const Velocities& v) noexcept;
  [[nodiscard]] const std::vector<double>& with_ends_and_ground(const PlantState& x,
                                                                const double* v) noexcept;
  void accelerate(const double* q, const double* v, const double* forces) noexcept;
  void step_runge_kutta(double h_s) noexcept;
  void leap(double h_s) noexcept;
  void land(double h_s) noexcept;
  [[nodiscard]] bool flies() const noexcept;
  void settle(double h_s) noexcept;
  void step_engine(double h_s) noexcept;
  [[nodiscard]] bool plausible() noexcept;

  const tandem_kernels* kernels_;
  AddedInertia added_;
  model::Sines sines_;  // of the last touch_ground()'s posture
  Integrator integrator_;
  bool leaps_;  // our own bodies, by the leapfrog
  std::int64_t substep_ns_, release_ns_;
  bool lifted_;  // the hoist holds the base to the end
  double rate_limit_;
  std::size_t base_v_;                // 6, or 0
  std::vector<std::size_t> map_;      // joint -> model joint
  std::vector<std::size_t> passive_;  // passive joint -> model joint
  std::vector<double> damping_;       // model order
  Actuators actuators_;
  Contact contact_;
  BodyContact bodies_;
  Pushes pushes_;
  EndStops stops_;
  LightJoints light_;
  Hoist hoist_;
  ClosureForces loops_;
  FlightMomentum flight_;
  std::unique_ptr<Engine> engine_;  // null: our own

  PlantState x_;
  // By which velocities leap() evaluates: predicted (nv), half a step behind (nv), and of joints
  // and motors (2n) the one or the other, as `predicted_` (n) is 1 or 0.
  std::vector<double> ahead_v_, midway_v_, damper_v_, predicted_;
  PlantState rate_, stage_, sum_;  // scratch: of the last rates(); of Runge-Kutta
  std::vector<double> tau_;        // of actuators, joint friction and hoist
  std::vector<double> forces_;     // with what else acts, where anything does
  std::vector<double> applied_tau_, vdot_, wrench_;
  std::vector<double> pose_, twist_;    // of the sites
  std::vector<double> point_forces_W_;  // of another engine's last step
  std::int64_t time_ns_ = 0;
  std::uint8_t released_ = 0;
  std::uint8_t contact_fresh_ = 0, vdot_fresh_ = 0;  // evaluated at the present state
  std::int32_t diverged_ = -1;                       // index in v
  double diverged_rate_ = 0.0;
};

}  // namespace tandem::sim
