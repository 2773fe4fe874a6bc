// Reads behind its own memory. Built with the address sanitizer, for a program without.
#include <memory>

#include "controllers/controller.hpp"

class Overflows : public tandem::Controller {
 public:
  tandem::Status configure(tandem::ControllerSetup& setup) override {
    setup.claim(0, tandem::hal::ControlMode::kPosition);
    table_.reset(new double[setup.robot.joints.size()]{});
    return {};
  }
  void start(const tandem::hal::CycleTime&, const tandem::hal::StateImage&,
             tandem::hal::CommandImage&) noexcept TANDEM_RT override {}
  tandem::Code update(const tandem::hal::CycleTime&, const tandem::hal::StateImage& state,
                      tandem::hal::CommandImage& command) noexcept TANDEM_RT override {
    command.position_rad()[0] = 1e-9 * table_[state.position_rad().size()];
    return tandem::Code::kOk;
  }
  void archive(tandem::Archive&) override {}

 private:
  std::unique_ptr<double[]> table_;
};

TANDEM_CONTROLLER(Overflows, "overflows", "Reads behind its own memory.")
