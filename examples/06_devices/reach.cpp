// 06: a controller that uses the device interfaces (YARP's names: IPositionControl, IEncoders, …)
// instead of the command image. One joint goes to a place and back at a speed of its own; another
// is a spring that yields.
//   cmake --build build/release --target tandem controller_reach
//   export TANDEM_CONTROLLERS=build/release/lib/examples
//   build/release/bin/tandem run examples/06_devices/reach.toml
#include <optional>

#include "controllers/controller.hpp"
#include "hal/devices.hpp"

using tandem::hal::ControlMode;
using tandem::hal::InteractionMode;

class Reach : public tandem::Controller {
 public:
  tandem::Status configure(tandem::ControllerSetup& setup) override {
    devices_.emplace(setup.robot, setup.gains, setup.period_ns);
    for (const auto& [key, joint] : {std::pair{"moves", &moves_}, {"yields", &yields_}}) {
      const std::string name = setup.parameters.text(key);
      const int index = setup.robot.joint_index(name);
      if (index < 0)
        return tandem::fail("there is no joint '" + name + "'", "see " + setup.robot.file);
      *joint = static_cast<std::size_t>(index);
    }
    way_rad_ = setup.parameters.number("way_rad");
    const double speed_rad_s = setup.parameters.number("speed_rad_s", tandem::kPositive);
    if (devices_->position.set_ref_speed(moves_, speed_rad_s) != tandem::Code::kOk) {
      return tandem::fail("speed_rad_s is more than the joint's max_velocity_rad_s");
    }
    stiffness_Nm_rad_ = setup.parameters.number("stiffness_Nm_rad", tandem::kPositive);
    setup.claim(moves_, ControlMode::kPosition);
    setup.claim_with_modes(yields_, ControlMode::kPosition);
    return {};
  }
  void start(const tandem::hal::CycleTime&, const tandem::hal::StateImage& state,
             tandem::hal::CommandImage& command) noexcept TANDEM_RT override {
    devices_->begin(state, command);
    back_ = 0;
    start_rad_ = devices_->encoders.position_rad(moves_);
    (void)devices_->position.position_move(moves_, start_rad_ + way_rad_);
    (void)devices_->interaction.set_interaction_mode(yields_, InteractionMode::kCompliant);
    tandem::hal::Impedance impedance = devices_->impedance.impedance(yields_);
    impedance.stiffness_Nm_rad = stiffness_Nm_rad_;
    (void)devices_->impedance.set_impedance(yields_, impedance);
  }
  tandem::Code update(const tandem::hal::CycleTime&, const tandem::hal::StateImage& state,
                      tandem::hal::CommandImage& command) noexcept TANDEM_RT override {
    devices_->begin(state, command);
    if (devices_->position.check_motion_done(moves_)) {
      if (back_ != 0) return tandem::Code::kStopped;
      back_ = 1;
      (void)devices_->position.position_move(moves_, start_rad_);
    }
    devices_->advance();
    return tandem::Code::kOk;
  }
  void archive(tandem::Archive& ar) override { ar(*devices_, start_rad_, back_); }

 private:
  std::optional<tandem::hal::Devices> devices_;
  std::size_t moves_ = 0, yields_ = 0;
  double way_rad_ = 0.0, stiffness_Nm_rad_ = 0.0, start_rad_ = 0.0;
  std::uint8_t back_ = 0;
};

TANDEM_CONTROLLER(Reach, "reach", "Leads one joint there and back, while another yields.")
