// trajectory_follower: joints along way-points that its input says, a new one from where they are.
#include <algorithm>

#include "controllers/controller.hpp"
#include "controllers/parameters.hpp"

namespace tandem {
namespace {

/// Parameters: joints (all), most_points (16). Input: `trajectory`.
class TrajectoryFollower : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    const double most_points = setup.parameter("most_points", {.min = 1,
                                                               .max = InputBlock::kMostValues,
                                                               .whole = true,
                                                               .otherwise = 16,
                                                               .doc = "way-points at a time"});
    InputOptions options{.doc = "way-points of the joints",
                         .timeout_s = 0.0,
                         .most_points = static_cast<std::size_t>(most_points)};
    for (const std::size_t joint : joints_parameter(setup)) {
      setup.claim(joint, hal::ControlMode::kPosition);
      options.names.push_back(setup.robot.joints[joint].name);
      joints_.push_back({joint, {}, {}});
    }
    input_ = setup.input("trajectory", InputKind::kTrajectory, std::move(options));
    return {};
  }

  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    for (Led& one : joints_) one.at = {state.position_rad()[one.joint], 0.0};
    next_ = 0;
  }

  Code update(const hal::CycleTime& time, const hal::StateImage&,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    if (input_.arrived()) {  // from the reference, whatever was under way
      for (Led& one : joints_) one.from = one.at;
      start_ns_ = time.time_ns;
      next_ = 0;
    }
    const double now_s = static_cast<double>(time.time_ns - start_ns_) * 1e-9;
    while (next_ < input_.points() && now_s >= input_.time_s(next_)) ++next_;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      Led& one = joints_[i];
      if (next_ < input_.points()) {
        one.at = on_the_way(i, now_s);
      } else if (input_.points() > 0) {
        one.at = {input_.position_rad(next_ - 1)[i], 0.0};
      } else {
        one.at.velocity_rad_s = 0.0;
      }
      command.position_rad()[one.joint] = one.at.position_rad;
      command.velocity_rad_s()[one.joint] = one.at.velocity_rad_s;
    }
    return Code::kOk;
  }

  void archive(Archive& ar) override { ar(joints_, start_ns_, next_); }

 private:
  struct Place {
    double position_rad = 0.0, velocity_rad_s = 0.0;
  };
  struct Led {
    std::size_t joint;
    Place from, at;  // where the trajectory found it, and the reference
  };

  [[nodiscard]] double position(std::size_t i, std::size_t point) const noexcept TANDEM_RT {
    return point == 0 ? joints_[i].from.position_rad : input_.position_rad(point - 1)[i];
  }
  [[nodiscard]] double time_s(std::size_t point) const noexcept TANDEM_RT {
    return point == 0 ? 0.0 : input_.time_s(point - 1);
  }
  /// As it is given; else the mean speed about the way-point, 0 at the end and where it reverses.
  /// @param point  0: where the trajectory found the joint
  [[nodiscard]] double velocity(std::size_t i, std::size_t point) const noexcept TANDEM_RT {
    if (point == 0) return joints_[i].from.velocity_rad_s;
    if (input_.has_velocities()) return input_.velocity_rad_s(point - 1)[i];
    if (point == input_.points()) return 0.0;
    const double before = position(i, point) - position(i, point - 1);
    const double after = position(i, point + 1) - position(i, point);
    if (before * after <= 0.0) return 0.0;
    return (before + after) / (time_s(point + 1) - time_s(point - 1));
  }
  /// A cubic from the way-point before to the next one.
  [[nodiscard]] Place on_the_way(std::size_t i, double now_s) const noexcept TANDEM_RT {
    const double begin_s = time_s(next_), whole_s = time_s(next_ + 1) - begin_s;
    const double x = (now_s - begin_s) / whole_s;
    const double p0 = position(i, next_), way = position(i, next_ + 1) - p0;
    const double m0 = velocity(i, next_) * whole_s, m1 = velocity(i, next_ + 1) * whole_s;
    const double c2 = 3.0 * way - 2.0 * m0 - m1, c3 = m0 + m1 - 2.0 * way;
    return {p0 + x * (m0 + x * (c2 + x * c3)), (m0 + x * (2.0 * c2 + x * 3.0 * c3)) / whole_s};
  }

  Input input_;
  std::vector<Led> joints_;
  std::int64_t start_ns_ = 0;
  std::size_t next_ = 0;  // way-point
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::TrajectoryFollower, "trajectory_follower",
                  "Leads joints along way-points that its input says.")
