// 08: a controller with all that one can declare beside its command: signals, a parameter that may
// be set while it runs, an input, a mark and words.
//   cmake --build build/release --target tandem controller_nod
//   export TANDEM_CONTROLLERS=build/release/lib/examples
//   build/release/bin/tandem run examples/08_declarations/nod.toml --realtime --duration endless
// and in another terminal, while it nods:
//   build/release/bin/tandem signal watch nod --every 0.5
//   build/release/bin/tandem controller set nod rate_hz=1
//   build/release/bin/tandem input list                          nod.toml says who feeds it
#include <cmath>

#include "controllers/controller.hpp"

using namespace tandem;

class Nod : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    setup.claim(0, hal::ControlMode::kPosition);
    phase_ = setup.signal("phase", "rad", "where in its nod it is");
    error_ = setup.joint_signals("error", "rad", "reference less position");
    rate_hz_ = setup.parameter(
        "rate_hz",
        {.unit = "Hz", .min = 0, .max = 2, .otherwise = 0.5, .live = true, .doc = "nods a second"});
    wanted_ = setup.input("depth", InputKind::kNumbers,
                          {.doc = "of a nod",
                           .names = {"depth"},
                           .unit = "rad",
                           .min = {0.0},
                           .max = {0.4},
                           .timeout_s = 0.0,
                           .otherwise = {0.2}});
    arrow_ = setup.mark("way", {.shape = hal::MarkShape::kArrow, .frame = "base_link"});
    log_ = setup.text_events();
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    middle_rad_ = state.position_rad()[0];
    at_rad_ = now_hz_ = near_rad_ = depth_rad_ = 0.0;
  }
  Code update(const hal::CycleTime& time, const hal::StateImage& state,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    const double step_s = 1e-9 * static_cast<double>(time.period_ns);
    if (wanted_.arrived()) log_("is to nod by", wanted_[0], "rad");
    // What is set or told may jump; the reference and its velocity do not.
    const auto approach = [&](double& value, double to) { value += (to - value) * step_s / 0.3; };
    approach(now_hz_, rate_hz_);
    approach(near_rad_, wanted_[0]);
    approach(depth_rad_, near_rad_);
    at_rad_ = std::fmod(at_rad_ + 2.0 * M_PI * now_hz_ * step_s, 2.0 * M_PI);
    const double nod = std::sin(at_rad_);
    command.position_rad()[0] = middle_rad_ + depth_rad_ * nod;

    phase_ = at_rad_;
    error_.set(0, command.position_rad()[0] - state.position_rad()[0]);
    arrow_.set(0, {0.0, 0.0, 1.0});
    arrow_.set(1, {depth_rad_ * nod, 0.0, 1.0});
    return Code::kOk;
  }
  void archive(Archive& ar) override { ar(middle_rad_, at_rad_, now_hz_, near_rad_, depth_rad_); }

 private:
  Signal phase_, error_;
  Parameter rate_hz_;
  Input wanted_;
  Mark arrow_;
  TextEvents log_;
  double middle_rad_ = 0.0, at_rad_ = 0.0, now_hz_ = 0.0, near_rad_ = 0.0, depth_rad_ = 0.0;
};

TANDEM_CONTROLLER(Nod, "nod", "Nods with the first joint, as deep as it is told.")
