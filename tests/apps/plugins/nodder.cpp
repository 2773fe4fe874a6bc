// A controller whose builds differ, as its author changes it while a run goes on: ABOVE_RAD is a
// constant; MORE more state; ALL claims every joint; ASKS wants a parameter; FAILS has a mistake;
// STUCK never returns from its static initialisers, CLINGS from its clean-up.
#include <unistd.h>

#include <algorithm>

#include "controllers/controller.hpp"

namespace {

using namespace tandem;

[[maybe_unused]] int wait_for_ever() {
  for (;;) ::pause();
}
#ifdef STUCK
[[maybe_unused]] const int stuck = wait_for_ever();
#endif
#ifdef CLINGS
struct Clings {
  ~Clings() { wait_for_ever(); }
} clings;
#endif

class Nodder final : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
#ifdef FAILS
    return fail("this build has a mistake", "mend it");
#endif
#ifdef ASKS
    if (setup.parameters.number("gain") == 0.0) return fail("a gain of 0 does nothing", "raise it");
#endif
#ifdef ALL
    setup.claim(0, hal::ControlMode::kPosition);
#endif
    joint_ = setup.robot.joints.size() - 1;
    setup.claim(joint_, hal::ControlMode::kPosition);
    speed_rad_s_ = setup.parameters.number("speed_rad_s", kPositive);
    period_s_ = static_cast<double>(setup.period_ns) * 1e-9;
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    begin_rad_ = state.position_rad()[joint_];
    cycles_ = 0;
  }
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    const double way_rad = speed_rad_s_ * period_s_ * static_cast<double>(++cycles_);
    command.position_rad()[joint_] = begin_rad_ + std::min(way_rad, ABOVE_RAD);
    return Code::kOk;
  }
  void archive(Archive& ar) override {
    ar(begin_rad_, cycles_);
#ifdef MORE
    ar(more_);
#endif
  }

 private:
  std::size_t joint_ = 0;
  double speed_rad_s_ = 0.0, period_s_ = 0.0, begin_rad_ = 0.0;
  [[maybe_unused]] double more_ = 0.0;
  std::int64_t cycles_ = 0;
};

}  // namespace

TANDEM_CONTROLLER(Nodder, "nodder", "Moves the last joint a little, and stays.")
