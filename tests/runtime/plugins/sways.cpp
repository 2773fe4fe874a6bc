// A controller whose builds differ from a cycle on: SWAYS_FROM is its number since the start,
// SWAYS_MORE the share that the sway is larger by; SWAYS_BY_CHANCE adds what no log has.
#include <cmath>
#include <random>

#include "controllers/controller.hpp"

namespace {

using namespace tandem;

class Sways final : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    size_rad_ = setup.parameter("size_rad", {.min = 0, .max = 0.5, .otherwise = 0.1, .live = true});
    joint_ = setup.parameters.integer_or("joint", 0, 0, 1) == 0 ? 0 : 1;
    add_ = setup.input("add", InputKind::kNumbers,
                       {.names = {"rad"}, .max = {0.2}, .timeout_s = 0.05});
    phase_ = setup.signal("phase", "rad", "of the sway");
    setup.claim(joint_, hal::ControlMode::kPosition);
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    from_rad_ = state.position_rad()[joint_];
    cycles_ = 0;
  }
  Code update(const hal::CycleTime&, const hal::StateImage& state,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    const double phase = 0.002 * static_cast<double>(cycles_);
    phase_ = phase;
    double size = size_rad_ * (cycles_ >= SWAYS_FROM ? 1.0 + SWAYS_MORE : 1.0);
#ifdef SWAYS_BY_CHANCE
    size *= 1.0 + 1e-9 * std::uniform_real_distribution<double>(1.0, 2.0)(chance_);
#endif
    command.position_rad()[joint_] =
        from_rad_ + size * std::sin(phase) + add_[0] + 1e-3 * state.velocity_rad_s()[joint_];
    ++cycles_;
    return Code::kOk;
  }
  void archive(Archive& ar) override { ar(from_rad_, cycles_); }

 private:
  Parameter size_rad_;
  Input add_;
  Signal phase_;
  std::size_t joint_ = 0;
  double from_rad_ = 0.0;
  std::uint64_t cycles_ = 0;
#ifdef SWAYS_BY_CHANCE
  std::minstd_rand chance_{std::random_device{}()};
#endif
};

}  // namespace

TANDEM_CONTROLLER(Sways, "sways", "Sways a joint about where it was.")
