// jog: joints at the velocities that its input says: an operator's, a topic's, a timeline's.
#include <algorithm>
#include <cmath>

#include "controllers/controller.hpp"
#include "controllers/parameters.hpp"

namespace tandem {
namespace {

constexpr double kUp_s = 0.25;  // to the largest velocity

/// Parameters: joints (all), share (0.25), timeout_s (0.5), twist (none).
/// Input: `rate`, numbers by joint [rad/s, of a slide m/s]; with `twist` instead `twist`.
class Jog : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    const double share = setup.parameter("share", {.min = 0,
                                                   .max = 1,
                                                   .above_min = true,
                                                   .otherwise = 0.25,
                                                   .doc = "of each joint's velocity limit"});
    const double timeout_s = setup.parameter(
        "timeout_s",
        {.unit = "s", .min = 0.01, .max = 60, .otherwise = 0.5, .doc = "that a sample counts"});
    InputOptions options{.doc = "velocities of the joints",
                         .unit = "rad/s",
                         .timeout_s = timeout_s,
                         .after = AfterTimeout::kZero};
    for (const std::size_t joint : joints_parameter(setup)) {
      const hal::DrivenJoint& limit = setup.robot.joints[joint];
      const double most = share * limit.max_velocity_rad_s;
      setup.claim(joint, hal::ControlMode::kPosition);
      joints_.push_back(
          {.joint = joint,
           .component = joints_.size(),
           .min_rad = limit.min_position_rad,
           .max_rad = limit.max_position_rad,
           .acceleration_rad_s2 = std::min(limit.max_acceleration_rad_s2, most / kUp_s)});
      options.names.push_back(limit.name);
      options.max.push_back(most);
    }
    if (!setup.parameters.has("twist")) {
      input_ = setup.input("rate", InputKind::kNumbers, std::move(options));
      return {};
    }
    return follow_twist(setup, std::move(options));
  }

  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    for (Led& one : joints_) {
      one.position_rad = state.position_rad()[one.joint];
      one.velocity_rad_s = 0.0;
    }
  }

  Code update(const hal::CycleTime& time, const hal::StateImage&,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    const double dt_s = static_cast<double>(time.period_ns) * 1e-9;
    for (Led& one : joints_) {
      const double step = one.acceleration_rad_s2 * dt_s;
      one.velocity_rad_s += std::clamp(input_[one.component] - one.velocity_rad_s, -step, step);
      // Towards a limit it is never faster than it can brake before it.
      const double way_rad = one.velocity_rad_s > 0.0 ? one.max_rad - one.position_rad
                                                      : one.position_rad - one.min_rad;
      const double most = std::sqrt(2.0 * one.acceleration_rad_s2 * std::max(0.0, way_rad));
      one.velocity_rad_s = std::clamp(one.velocity_rad_s, -most, most);
      one.position_rad += one.velocity_rad_s * dt_s;
      command.position_rad()[one.joint] = one.position_rad;
      command.velocity_rad_s()[one.joint] = one.velocity_rad_s;
    }
    return Code::kOk;
  }

  void archive(Archive& ar) override { ar(joints_); }

 private:
  struct Led {
    std::size_t joint, component;
    double min_rad, max_rad, acceleration_rad_s2;
    double position_rad = 0.0, velocity_rad_s = 0.0;
  };

  /// `twist = ["yaw", "pitch"]`: a component for each of the joints. What no joint follows is 0.
  Status follow_twist(ControllerSetup& setup, InputOptions options) {
    const std::vector<std::string> wanted = setup.parameters.texts_or("twist", {});
    if (wanted.size() != joints_.size()) {
      setup.parameters.error("twist", "has not a component for each joint",
                             "one of x, y, z, roll, pitch, yaw for each of `joints`");
      return {};
    }
    const std::string components(row_of(InputKind::kTwist).components);
    const InputBlock twist("twist", InputKind::kTwist, {});
    options.names.clear();
    options.unit.clear();
    std::vector<double> max(twist.components.size(), 0.0);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      const auto found = std::ranges::find(twist.components, wanted[i]);
      if (found == twist.components.end()) {
        setup.parameters.error("twist", "a twist has no '" + wanted[i] + "'",
                               "its components: " + components);
        return {};
      }
      joints_[i].component = static_cast<std::size_t>(found - twist.components.begin());
      max[joints_[i].component] = options.max[i];
    }
    options.max = std::move(max);
    input_ = setup.input("twist", InputKind::kTwist, std::move(options));
    return {};
  }

  Input input_;
  std::vector<Led> joints_;
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::Jog, "jog", "Moves joints at the velocities that its input says.")
