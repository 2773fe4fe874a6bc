// 03: a whole controller. It moves one joint to and fro about where it stands.
//   cmake --build build/release --target tandem controller_sway    (`make demo` has done so)
//   export TANDEM_CONTROLLERS=build/release/lib/examples
//   build/release/bin/tandem run examples/03_controller/sway.toml
// Its CMakeLists.txt says how it is built by itself, against an installed Tandem.
#include <cmath>

#include "controllers/controller.hpp"

class Sway : public tandem::Controller {
 public:
  tandem::Status configure(tandem::ControllerSetup& setup) override {
    const std::string name = setup.parameters.text("joint");
    const int joint = setup.robot.joint_index(name);
    if (joint < 0)
      return tandem::fail("there is no joint '" + name + "'", "see " + setup.robot.file);
    joint_ = static_cast<std::size_t>(joint);
    amplitude_rad_ = setup.parameters.number("amplitude_rad", tandem::kPositive);
    frequency_rad_s_ = 2.0 * M_PI / setup.parameters.number_or("period_s", 2.0, tandem::kPositive);
    setup.claim(joint_, tandem::hal::ControlMode::kPosition);
    return {};
  }
  void start(const tandem::hal::CycleTime& time, const tandem::hal::StateImage& state,
             tandem::hal::CommandImage&) noexcept TANDEM_RT override {
    start_ns_ = time.time_ns;
    middle_rad_ = state.position_rad()[joint_];
  }
  tandem::Code update(const tandem::hal::CycleTime& time, const tandem::hal::StateImage&,
                      tandem::hal::CommandImage& command) noexcept TANDEM_RT override {
    const double phase = frequency_rad_s_ * static_cast<double>(time.time_ns - start_ns_) * 1e-9;
    command.position_rad()[joint_] = middle_rad_ + amplitude_rad_ * std::sin(phase);
    return tandem::Code::kOk;
  }
  void archive(tandem::Archive& ar) override { ar(start_ns_, middle_rad_); }

 private:
  std::size_t joint_ = 0;
  double amplitude_rad_ = 0.0, frequency_rad_s_ = 0.0, middle_rad_ = 0.0;
  std::int64_t start_ns_ = 0;
};

TANDEM_CONTROLLER(Sway, "sway", "Moves one joint to and fro about where it stands.")
