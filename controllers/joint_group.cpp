// joint_group: joints at the positions that its input says, as fast as it is allowed to.
#include <algorithm>
#include <cmath>

#include "controllers/controller.hpp"
#include "controllers/parameters.hpp"

namespace tandem {
namespace {

constexpr double kUp_s = 0.25;  // to the largest velocity

/// Parameters: joints (all), share (0.25). Input: `position`, numbers by joint [rad, of a slide m].
class JointGroup : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    const double share = setup.parameter("share", {.min = 0,
                                                   .max = 1,
                                                   .above_min = true,
                                                   .otherwise = 0.25,
                                                   .doc = "of each joint's velocity limit"});
    InputOptions options{.doc = "positions of the joints",
                         .unit = "rad",
                         .timeout_s = 0.0,
                         .after = AfterTimeout::kLast};
    for (const std::size_t joint : joints_parameter(setup)) {
      const hal::DrivenJoint& limit = setup.robot.joints[joint];
      const double most = share * limit.max_velocity_rad_s;
      setup.claim(joint, hal::ControlMode::kPosition);
      joints_.push_back(
          {.joint = joint,
           .velocity_rad_s = most,
           .acceleration_rad_s2 = std::min(limit.max_acceleration_rad_s2, most / kUp_s)});
      options.names.push_back(limit.name);
      options.min.push_back(limit.min_position_rad);
      options.max.push_back(limit.max_position_rad);
    }
    input_ = setup.input("position", InputKind::kNumbers, std::move(options));
    return {};
  }

  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    for (Led& one : joints_) one.at = {state.position_rad()[one.joint], 0.0};
  }

  Code update(const hal::CycleTime& time, const hal::StateImage&,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    const double dt_s = static_cast<double>(time.period_ns) * 1e-9;
    const bool told = input_.sequence() > 0;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      Led& one = joints_[i];
      if (told) approach(one, input_[i], dt_s);
      command.position_rad()[one.joint] = one.at.position_rad;
      command.velocity_rad_s()[one.joint] = one.at.velocity_rad_s;
    }
    return Code::kOk;
  }

  void archive(Archive& ar) override { ar(joints_); }

 private:
  struct Place {
    double position_rad, velocity_rad_s;
  };
  struct Led {
    std::size_t joint;
    double velocity_rad_s, acceleration_rad_s2;  // at most
    Place at{};                                  // the reference
  };

  /// A step towards `to_rad`, from which it can still brake before it.
  static void approach(Led& one, double to_rad, double dt_s) noexcept TANDEM_RT {
    const double way_rad = to_rad - one.at.position_rad;
    const double step = one.acceleration_rad_s2 * dt_s;
    // So fast that after this cycle's way there is room to stop: v^2 / 2a + v dt / 2 <= way.
    const double half = 0.5 * step;
    const double stopping =
        std::sqrt(half * half + 2.0 * one.acceleration_rad_s2 * std::abs(way_rad)) - half;
    const double most = std::min(one.velocity_rad_s, stopping);
    const double wanted = std::copysign(most, way_rad);
    one.at.velocity_rad_s += std::clamp(wanted - one.at.velocity_rad_s, -step, step);
    if (std::abs(way_rad) <= std::abs(one.at.velocity_rad_s) * dt_s &&
        std::abs(one.at.velocity_rad_s) <= step) {
      one.at = {to_rad, 0.0};
      return;
    }
    one.at.position_rad += one.at.velocity_rad_s * dt_s;
  }

  Input input_;
  std::vector<Led> joints_;
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::JointGroup, "joint_group",
                  "Moves joints to the positions that its input says.")
