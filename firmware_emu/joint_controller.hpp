// The joint controller of a drive: one cascade from any mode's reference to the motor voltage.
// Layer: firmware_emu.  Thread: RT only.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"
#include "canopen/drive_parameters.hpp"
#include "canopen/objects.hpp"
#include "firmware_emu/pid.hpp"

namespace tandem::firmware {

/// What a mode is to follow. A field that the mode does not use is ignored; torque_Nm is the
/// feed-forward of every mode but CST, where it is the reference.
struct Reference {
  double position_rad = 0.0;
  double velocity_rad_s = 0.0;  ///< reference or feed-forward
  double torque_Nm = 0.0;
  double voltage_V = 0.0;
  double current_A = 0.0;
  double stiffness_Nm_rad = 0.0;
  double damping_Nms_rad = 0.0;
};

/// What the board's sensors and estimators say.
struct Measurement {
  double link_position_rad = 0.0;
  double link_velocity_rad_s = 0.0;
  double link_acceleration_rad_s2 = 0.0;
  double motor_position_rad = 0.0;
  double motor_velocity_rad_s = 0.0;
  double torque_Nm = 0.0;  ///< of the spring, positive when it drives the link to +
  double torque_rate_Nm_s = 0.0;
  double current_A = 0.0;
  double bus_voltage_V = 0.0;
};

/// What the bridge is to do.
enum class BridgeAction : std::uint8_t {
  kOff,     ///< bridge open
  kFollow,  ///< the mode's reference
  kHold,    ///< the position where this action began, by the position loop
  kRamp,    ///< from the velocity where this action began to rest, by the position loop
  kBrake,   ///< winding shorted through the bridge (0 V): needs neither sensor nor gain
};

/// The cascade, equation by equation in docs/firmware.md.
class JointController {
 public:
  /// Terms of the last update(), for telemetry.
  struct Terms {
    double torque_reference_Nm = 0.0;     ///< of the cascade; 0: it does not run
    double voltage_V = 0.0;               ///< after every limit
    double transfer_V = 0.0;              ///< what is left of a mode change's step
    double position_error_rad = 0.0;      ///< of the limited reference, on the link
    double held_position_rad = 0.0;       ///< kHold's, and the integrated one of kRamp and -4
    double ramp_velocity_rad_s = 0.0;     ///< kRamp's
    double last_position_rad = 0.0;       ///< reference of position control; first: measured
    double drive_current_A = 0.0;         ///< that the voltage drives, the winding's lag left out
    double deviation_rad_s = 0.0;         ///< velocity less the reference's; see follows_motion()
    std::int32_t voltage_saturation = 0;  ///< Saturation, by the voltage or current limit
    std::int32_t torque_saturation = 0;   ///< Saturation, by the torque's limit or slope
    std::int64_t reference_limited = 0;   ///< 1: position or velocity reference was cut
  };

  /// Takes new settings; the integrals stay, and the voltage goes over to them as in a change
  /// of mode. @pre every number finite, but the positions.
  void configure(const canopen::DriveParameters& config, double period_s) noexcept TANDEM_RT;

  /// One control period. A change of `action` or `mode` is made without a step of the voltage:
  /// integrals are seeded, what is left decays over the transfer time.
  /// @return motor voltage [V]; 0 when kOff.
  double update(BridgeAction action, canopen::Mode mode, const Reference& reference,
                const Measurement& measured) noexcept TANDEM_RT;

  [[nodiscard]] const Terms& terms() const noexcept { return terms_; }
  /// Whether the last update() led the joint to a position or velocity.
  [[nodiscard]] bool follows_motion() const noexcept {
    return cascaded() && (action_ != BridgeAction::kFollow || mode_ != canopen::Mode::kCst);
  }
  [[nodiscard]] const Pid& position_loop() const noexcept { return position_; }
  [[nodiscard]] const Pid& velocity_loop() const noexcept { return velocity_; }
  [[nodiscard]] const Pid& torque_loop() const noexcept { return torque_; }
  [[nodiscard]] const Pid& electrical_loop() const noexcept { return current_; }
  /// True when the last update() had to cut anything.
  [[nodiscard]] bool limited() const noexcept {
    return terms_.voltage_saturation != 0 || terms_.torque_saturation != 0 ||
           terms_.reference_limited != 0;
  }
  [[nodiscard]] const canopen::DriveParameters& config() const noexcept { return config_; }

  /// All but the configuration, which the board makes again from its object dictionary.
  template <class Archive>
  void archive(Archive& ar) {
    ar(position_.state, velocity_.state, torque_.state, current_.state);
    ar(terms_, action_, mode_, retuned_);
  }

 private:
  struct Outer {
    double torque_Nm = 0.0;  ///< before the torque limit
    double integrand = 0.0;  ///< what the loop's integral, or -4's position, integrates
    double feedforward_Nm = 0.0;
    Pid* loop = nullptr;  ///< whose integral it is; none in CST and impedance
    const Pid::Config* config = nullptr;
  };
  /// One update on its way through the cascade.
  struct Step {
    double voltage_V = 0.0;
    double torque_error_Nm = 0.0;
    double current_error_A = 0.0;
    Outer outer;
  };

  [[nodiscard]] bool cascaded() const noexcept;
  void begin(BridgeAction action, canopen::Mode mode, const Measurement& measured) noexcept;
  [[nodiscard]] Outer outer_loop(const Reference& reference, const Measurement& measured) noexcept;
  [[nodiscard]] Outer position_outer(double position_rad, double velocity_rad_s, double torque_Nm,
                                     const Measurement& measured) noexcept;
  [[nodiscard]] Outer velocity_outer(const Reference& reference,
                                     const Measurement& measured) noexcept;
  [[nodiscard]] double impedance_torque(double position_rad, double velocity_rad_s,
                                        const Reference& reference,
                                        const Measurement& measured) noexcept;
  void advance_ramp() noexcept;
  [[nodiscard]] double limited_position(double position_rad) noexcept;
  [[nodiscard]] double limited_velocity(double velocity_rad_s, double position_rad) noexcept;
  void cascade(const Reference& reference, const Measurement& measured, bool change,
               Step& step) noexcept;
  void current_loop(double current_A, const Measurement& measured, Step& step) noexcept;
  [[nodiscard]] Saturation limit_torque(double& torque_Nm, double last_Nm) const noexcept;
  [[nodiscard]] double current_of(double voltage_V, const Measurement& measured) const noexcept;
  [[nodiscard]] Saturation limit_voltage(double& voltage_V,
                                         const Measurement& measured) const noexcept;
  /// The most current in direction `way` (1 or -1): see kTaperFrom.
  [[nodiscard]] double most_current_A(double way, const Measurement& measured) const noexcept;
  void integrate(const Step& step, Saturation voltage_cut) noexcept;

  canopen::DriveParameters config_;
  double period_s_ = 1.0e-3;
  double transfer_decay_ = 0.0;
  Pid position_;
  Pid velocity_;
  Pid torque_;
  Pid current_;
  Terms terms_;
  BridgeAction action_ = BridgeAction::kOff;
  canopen::Mode mode_ = canopen::Mode::kNone;
  bool retuned_ = false;
};

}  // namespace tandem::firmware
