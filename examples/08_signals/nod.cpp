// 08: a controller that tells what it does: signals, words and a mark, beside its command.
//   cmake --build build/release --target tandem controller_nod    (`make demo` has done so)
//   export TANDEM_CONTROLLERS=build/release/lib/examples
//   build/release/bin/tandem run examples/08_signals/nod.toml --realtime
//   build/release/bin/tandem signal watch nod                     in another terminal
#include <cmath>

#include "controllers/controller.hpp"

class Nod : public tandem::Controller {
 public:
  tandem::Status configure(tandem::ControllerSetup& setup) override {
    setup.claim(0, tandem::hal::ControlMode::kPosition);
    phase_ = setup.signal("phase", "rad", "where in its nod it is");
    error_ = setup.joint_signals("error", "rad", "reference less position");
    log_ = setup.text_events();
    arrow_ = setup.mark("way", {.shape = tandem::hal::MarkShape::kArrow, .frame = "base_link"});
    return {};
  }
  void start(const tandem::hal::CycleTime& time, const tandem::hal::StateImage& state,
             tandem::hal::CommandImage&) noexcept TANDEM_RT override {
    start_ns_ = time.time_ns;
    middle_rad_ = state.position_rad()[0];
  }
  tandem::Code update(const tandem::hal::CycleTime& time, const tandem::hal::StateImage& state,
                      tandem::hal::CommandImage& command) noexcept TANDEM_RT override {
    const double phase = M_PI * static_cast<double>(time.time_ns - start_ns_) * 1e-9;
    const double nod = std::sin(phase);
    command.position_rad()[0] = middle_rad_ + 0.2 * nod;
    const std::int64_t nods = static_cast<std::int64_t>(phase / (2.0 * M_PI));
    if (nods > nods_) log_("nodded", nods, "times; the joint is at", state.position_rad()[0]);
    nods_ = nods;
    phase_ = std::fmod(phase, 2.0 * M_PI);
    error_.set(0, command.position_rad()[0] - state.position_rad()[0]);
    arrow_.set(0, {0.0, 0.0, 1.0});
    arrow_.set(1, {0.3 * nod, 0.0, 1.0});
    return tandem::Code::kOk;
  }
  void archive(tandem::Archive& ar) override { ar(start_ns_, middle_rad_, nods_); }

 private:
  tandem::Signal phase_, error_;
  tandem::TextEvents log_;
  tandem::Mark arrow_;
  double middle_rad_ = 0.0;
  std::int64_t start_ns_ = 0, nods_ = 0;
};

TANDEM_CONTROLLER(Nod, "nod", "Nods with the first joint, and tells of it.")
