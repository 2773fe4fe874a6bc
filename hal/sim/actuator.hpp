// Motors, gears and series springs of every joint: torque on the link, and the motor's own state.
// Layer: hal/sim.  Thread: create non-RT; evaluate and step RT.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/config/robot_config.hpp"

namespace tandem::sim {

/// One actuator's constants, derived from its configuration. Everything is on the link side.
///
///   order 0  rigid:      i = (V - ke q') / R                 tau = kt i - b q'
///   order 1  electrical: L i' = V - R i - ke q'              tau = kt i - b q'
///   order 2  mechanical: i = (V - ke th') / R                tau = Ks (th - q) + Ds (th' - q')
///                        J th'' = kt i - b th' - tau
///   order 3  both:       L i' = V - R i - ke th', the rest as order 2
///
/// With kt = N K. The configured D is friction and back-EMF together, D = b + kt ke / R, so
/// b = D - N^2 K^2 / R; order 2 is then J th'' = (N K / R) V - D th' - tau. Where a data sheet's
/// D is below N^2 K^2 / R, ke is lowered to D R / (N K) and b is 0: D is what the sheet says and
/// no joint pushes itself. Orders 0 and 1 leave J to the model, as armature of the joint.
struct ActuatorModel {
  int order = 2;
  double torque_per_A = 0.0;      ///< kt = N K [Nm/A]
  double back_emf_Vs_rad = 0.0;   ///< ke
  double friction_Nms_rad = 0.0;  ///< b, what is left with the bridge off (open circuit)
  double resistance_ohm = 0.0;
  double inductance_H = 0.0;
  double inertia_kg_m2 = 0.0;
  double spring_Nm_rad = 0.0;
  double spring_damping_Nms_rad = 0.0;
  double current_limit_A = 0.0;  ///< 0: none
  double voltage_limit_V = 0.0;  ///< 0: none
  double thermal_resistance_K_W = 0.0;
  double thermal_time_constant_s = 0.0;

  [[nodiscard]] bool elastic() const noexcept { return order >= 2; }
  [[nodiscard]] bool current_is_state() const noexcept { return (order & 1) != 0; }
};

/// Errors: an order other than 0 to 3, a constant its order needs that is not positive.
[[nodiscard]] Result<ActuatorModel> make_actuator(const hal::ActuatorConfig& config);

/// The armature a joint with this actuator has in the multibody model [kg m2]: J when the gear
/// is rigid, 0 when a spring separates motor and link.
[[nodiscard]] double armature(const hal::ActuatorConfig& config);

/// The motors' part of the plant's state and its derivative, one block of three arrays each.
struct MotorStateView {
  const double* position_rad;    ///< (n) th; of a rigid joint a copy of q
  const double* velocity_rad_s;  ///< (n) th'
  const double* current_A;       ///< (n) i
};
struct MotorState {
  double* position_rad;
  double* velocity_rad_s;
  double* current_A;

  operator MotorStateView() const noexcept { return {position_rad, velocity_rad_s, current_A}; }
};

/// All joints' actuators. Arrays are in the model's joint order. What the drives apply (voltage,
/// bridge, brake) is held between calls; motor position, velocity and current live in the plant.
class Actuators {
 public:
  explicit Actuators(std::vector<ActuatorModel> models, double ambient_C = 25.0);

  [[nodiscard]] std::size_t size() const noexcept { return models_.size(); }
  [[nodiscard]] const ActuatorModel& model(std::size_t joint) const noexcept {
    return models_[joint];
  }

  /// What the power stage does from now on. `voltage_V` is saturated. With the bridge off the
  /// winding is open: no current, no back-EMF damping.
  void set_drive(std::size_t joint, double voltage_V, bool bridge_on) noexcept TANDEM_RT;

  /// Holds the rotor where it is (rigid joints: by a stiff spring about `position_rad` with
  /// `load_Nm` compensated), or lets it go.
  void set_brake(std::size_t joint, bool engaged, double position_rad,
                 double load_Nm) noexcept TANDEM_RT;
  [[nodiscard]] bool braked(std::size_t joint) const noexcept { return free_[joint] == 0.0; }

  /// Fits a motor brake: dry friction on the rotor that holds up to torque_Nm and slips above.
  ///
  ///   spring = cut(-k (th - a))        a: where the rotor stuck, dragged to fit the cut
  ///   torque = cut(spring - d th')     cut: to +-torque_Nm
  ///
  /// with k = J (0.4 / h)^2 and d = 0.3 J / h for the sub-step `substep_s`, so that any joint stays
  /// well inside what that can integrate. Inside the cut the anchor rests: it does not creep. Both
  /// cuts are projections, so it only ever takes energy. Closed at first.
  void fit_brake(std::size_t joint, const hal::BrakeConfig& brake, double substep_s);
  /// Gives the joint dry friction by the same law, with `inertia_kg_m2` for J: on the rotor, or on
  /// the link of a rigid or a passive joint. It holds where the anchor is and moves by at most
  /// friction_Nm / k, for good; while it slides it is friction_Nm, to the bit.
  /// @param inertia_kg_m2  at most what the joint shows
  void fit_friction(std::size_t joint, double friction_Nm, double inertia_kg_m2, double substep_s);
  /// Sets every anchor of brakes and friction to where its motor is. `position_rad` (n)
  void seat_brakes(const double* position_rad) noexcept;
  /// Current in the coil of the joint's brake, or none. It obeys after its time.
  void set_coil(std::size_t joint, bool current) noexcept TANDEM_RT;
  /// Whether the joint has a brake that presses on its rotor now.
  [[nodiscard]] bool brake_closed(std::size_t joint) const noexcept {
    return brake_states_[joint].closed != 0;
  }
  /// After a sub-step to motor positions `position_rad` (n): coils' times and anchors.
  void advance_brakes(std::int64_t step_ns, const double* position_rad) noexcept TANDEM_RT;

  /// The series spring of `joint` parts, for good: nothing passes between motor and link any more.
  /// What the spring had stored is lost; energy does not appear. @pre the actuator is elastic
  void break_spring(std::size_t joint) noexcept TANDEM_RT { whole_[joint] = 0.0; }
  /// The winding is at least so hot now, from outside; it cools by itself.
  void heat(std::size_t joint, double at_least_C) noexcept TANDEM_RT {
    temperature_[joint] = std::max(temperature_[joint], at_least_C);
  }

  /// Torque on the links `torque_Nm` (n) and the motor state's rate of change.
  /// @param spring_rad_s  (n) motor velocities that the springs' damping goes by
  void evaluate(const double* q, const double* qd, MotorStateView motor, const double* spring_rad_s,
                double* torque_Nm, MotorState rate) const noexcept TANDEM_RT;

  /// Motor velocities `h_s` after they had `rate`: exactly, where only they themselves change it.
  void kick(double h_s, MotorStateView rate, MotorState motor) noexcept TANDEM_RT;
  /// Motor positions after `h_s` of their velocities, and currents that are states.
  void drift(double h_s, const double* q, MotorState motor) const noexcept TANDEM_RT;

  /// After a step to link state q, qd: clamps currents, copies rigid links to their motors,
  /// computes algebraic currents, and warms the windings for `h_s`.
  void finish_step(double h_s, const double* q, const double* qd,
                   MotorState motor) noexcept TANDEM_RT;

  [[nodiscard]] std::span<const double> voltage_V() const noexcept { return voltage_; }
  [[nodiscard]] std::span<const double> temperature_C() const noexcept { return temperature_; }

  void archive(Archive& ar) {
    ar(voltage_, bridge_, free_, whole_, brake_rad_, brake_Nm_, temperature_, brake_states_,
       friction_anchors_rad_);
  }

 private:
  /// The law at fit_brake(); torque_Nm is 0 where there is none.
  struct DryFriction {
    double torque_Nm = 0.0, stiffness_Nm_rad = 0.0, damping_Nms_rad = 0.0;

    static DryFriction fit(double torque_Nm, double inertia_kg_m2, double substep_s);
    [[nodiscard]] double torque(double anchor_rad, double position_rad,
                                double velocity_rad_s) const noexcept;
    void drag(double& anchor_rad, double position_rad) const noexcept;
  };
  struct Brake {
    DryFriction law;
    std::int64_t release_ns = 0, engage_ns = 0;
  };
  struct BrakeState {  // wide flags: no padding in a snapshot
    double anchor_rad = 0.0;
    std::int64_t since_ns = 0;  ///< the coil's last change
    std::int64_t coil = 0, closed = 0;
  };
  void obey_coil(std::size_t joint, double position_rad) noexcept;
  [[nodiscard]] double dry_torque(std::size_t joint, double position_rad,
                                  double velocity_rad_s) const noexcept;
  [[nodiscard]] double current(std::size_t joint, double velocity_rad_s) const noexcept;
  [[nodiscard]] double rigid_brake(std::size_t joint, double q, double qd) const noexcept;

  /// A robot's actuators are all of order 2 and without brakes and dry friction as a rule: then all
  /// joints at once, with the bits of the loops over joints. One array for each constant of
  /// ActuatorModel.
  template <class Array>
  struct Elastic {
    Array torque_per_A, back_emf, friction, resistance, inertia, spring, spring_damping;
    Array current_limit;  ///< infinite where there is none
    Array heating;        ///< thermal_resistance_K_W * resistance_ohm
  };
  [[nodiscard]] static Elastic<const double*> pointers(const Elastic<std::vector<double>>& m);
  [[nodiscard]] bool all_elastic() const noexcept {
    return all_elastic_ && !any_brake_ && frictions_.empty();
  }
  void evaluate_elastic(const double* q, const double* qd, MotorStateView motor,
                        const double* spring_rad_s, double* torque_Nm,
                        MotorState rate) const noexcept;
  void kick_elastic(MotorStateView rate, MotorState motor) const noexcept;
  void fit_kick(double h_s) noexcept;
  void finish_elastic(MotorState motor) noexcept;
  void cool(double h_s) noexcept;

  std::vector<ActuatorModel> models_;
  Elastic<std::vector<double>> elastic_;
  bool all_elastic_ = true;
  std::vector<double> voltage_, brake_rad_, brake_Nm_, temperature_;
  // 1 or 0, as factors: the bridge is on; the rotor is not held; the spring is whole.
  std::vector<double> bridge_, free_, whole_;
  std::vector<Brake> brakes_;
  std::vector<BrakeState> brake_states_;
  bool any_brake_ = false;
  std::vector<DryFriction> frictions_;        // (n), empty where no joint has any
  std::vector<double> friction_anchors_rad_;  // alike
  std::vector<double> cooling_;               // exp(-h / time constant) of the last step length
  double cooling_h_s_ = 0.0;
  std::vector<double> kick_s_,
      limited_kick_s_;           // the velocity's change over its rate, in kick_h_s_
  std::vector<double> limit_V_;  // at which the current is limited, at rest
  double kick_h_s_ = 0.0;
  double ambient_C_;
};

}  // namespace tandem::sim
