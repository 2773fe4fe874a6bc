// trajectory_follower: joints along way-points that its input says, a new one from where they are.
#include <algorithm>
#include <cmath>

#include "controllers/controller.hpp"
#include "controllers/parameters.hpp"
#include "controllers/trajectory_outcome.hpp"

namespace tandem {
namespace {

/// Parameters: joints (all), most_points (16), path_tolerance_rad, goal_tolerance_rad (none),
/// stopped_velocity_rad_s (0.01), goal_time_s (0). Input: `trajectory`. Its signals:
/// trajectory_outcome.hpp.
class TrajectoryFollower : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    const double most_points = setup.parameter("most_points", {.min = 1,
                                                               .max = InputBlock::kMostValues,
                                                               .whole = true,
                                                               .otherwise = 16,
                                                               .doc = "way-points at a time"});
    goal_time_s_ = setup.parameter("goal_time_s",
                                   {.unit = "s",
                                    .min = 0,
                                    .max = 3600,
                                    .otherwise = 0,
                                    .live = true,
                                    .doc = "for the goal's tolerances after the end; 0: for ever"});
    stopped_rad_s_ = setup.parameter("stopped_velocity_rad_s",
                                     {.unit = "rad/s",
                                      .min = 0,
                                      .max = 100,
                                      .otherwise = 0.01,
                                      .live = true,
                                      .doc = "velocity with which a goal is reached; 0: any"});
    InputOptions options{.doc = "way-points of the joints",
                         .timeout_s = 0.0,
                         .most_points = static_cast<std::size_t>(most_points),
                         .terms = true};
    const std::vector<std::size_t> joints = joints_parameter(setup);
    for (const std::size_t joint : joints) {
      const hal::DrivenJoint& limit = setup.robot.joints[joint];
      setup.claim(joint, hal::ControlMode::kPosition);
      options.names.push_back(limit.name);
      joints_.push_back({joint, {}, {}});
      limits_.push_back({limit.name, limit.min_position_rad, limit.max_position_rad,
                         limit.max_acceleration_rad_s2});
    }
    path_rad_ = tolerances(setup, "path_tolerance_rad", joints, "from the reference on the way");
    goal_rad_ = tolerances(setup, "goal_tolerance_rad", joints, "from the goal at the end");
    input_ = setup.input("trajectory", InputKind::kTrajectory, std::move(options));
    declare_signals(setup);
    return {};
  }

  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    for (Led& one : joints_) one.at = {state.position_rad()[one.joint], 0.0};
    way_ = {};
  }

  Code update(const hal::CycleTime& time, const hal::StateImage& state,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    if (input_.arrived()) begin(time);
    const double now_s = static_cast<double>(time.time_ns - way_.start_ns) * 1e-9;
    while (way_.leads && way_.next < input_.points() && now_s >= input_.time_s(way_.next)) {
      ++way_.next;
    }
    if (way_.outcome == TrajectoryOutcome::kUnderWay) judge(state, now_s);
    const double dt_s = static_cast<double>(time.period_ns) * 1e-9;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      Led& one = joints_[i];
      if (!way_.leads || input_.terms(i).stays != 0.0) {
        brake(one.at, limits_[i], dt_s);
      } else if (way_.next < input_.points()) {
        one.at = on_the_way(i, now_s);
      } else {
        one.at = {goal(i), 0.0};
      }
      command.position_rad()[one.joint] = one.at.position_rad;
      command.velocity_rad_s()[one.joint] = one.at.velocity_rad_s;
    }
    show();
    return Code::kOk;
  }

  void archive(Archive& ar) override { ar(joints_, way_); }

 private:
  struct Place {
    double position_rad = 0.0, velocity_rad_s = 0.0;
  };
  struct Led {
    std::size_t joint;
    Place from, at;  // where the trajectory found it, and the reference
  };
  struct Limits {
    std::string name;
    double min_rad, max_rad, brake_rad_s2;
  };
  /// The trajectory, and how it stands.
  struct Way {
    std::int64_t start_ns = 0;  // time of the run at which its own is 0
    double from_s = 0.0;        // its own time in the cycle before it arrived
    std::uint64_t first = 0;    // way-point that it began with: those before were past
    std::uint64_t next = 0;     // way-point
    std::uint64_t leads = 0;    // 0: the references come to rest, or do
    double cycle = -1.0;        // in which it arrived
    double joint = 0.0, error = 0.0, tolerance = 0.0, of_velocity = 0.0, time_s = 0.0;
    TrajectoryOutcome outcome = TrajectoryOutcome::kHolds;
  };

  static std::vector<Parameter> tolerances(ControllerSetup& setup, const char* name,
                                           const std::vector<std::size_t>& joints,
                                           const char* doc) {
    return setup.joint_parameters(
        name, joints,
        {{.unit = "rad", .min = 0, .max = 1e3, .otherwise = 0, .live = true, .doc = doc}});
  }

  void declare_signals(ControllerSetup& setup) {
    using Name = TrajectorySignals;
    cycle_ = setup.signal(Name::kCycle, "", "in which the trajectory arrived");
    outcome_ = setup.signal(Name::kOutcome, "",
                            "0 under way, 1 reached, 2 holds, 3 off the path, 4 off the goal");
    joint_ = setup.signal(Name::kJoint, "", "that is off, among the controller's");
    error_ = setup.signal(Name::kError, "", "of it, measured less reference [rad, rad/s]");
    tolerance_ = setup.signal(Name::kTolerance, "", "that this is beyond [rad, rad/s]");
    of_velocity_ = setup.signal(Name::kOfVelocity, "", "1: they are velocities");
    time_ = setup.signal(Name::kTime, "s", "of the outcome, after the trajectory's beginning");
    text_ = setup.text_events();
  }

  /// From the references, whatever was under way. Of way-points whose time is past the last counts.
  void begin(const hal::CycleTime& time) noexcept TANDEM_RT {
    for (Led& one : joints_) one.from = one.at;
    way_ = {};
    way_.cycle = static_cast<double>(input_.cycle());
    way_.outcome = TrajectoryOutcome::kUnderWay;
    way_.leads = input_.points() > 0 ? 1 : 0;
    const double now_s = -input_.terms().start_s;
    way_.start_ns = time.time_ns - static_cast<std::int64_t>(std::llround(now_s * 1e9));
    // The reference was there a cycle ago, and does not stand still until the next.
    way_.from_s = now_s - static_cast<double>(time.period_ns) * 1e-9;
    while (way_.next + 1 < input_.points() && input_.time_s(way_.next) <= now_s) ++way_.next;
    way_.first = way_.next;
  }

  /// Whether the trajectory ends, and how. The path is judged by the references of the cycle
  /// before, which the joints have had.
  void judge(const hal::StateImage& state, double now_s) noexcept TANDEM_RT {
    if (way_.leads == 0) {
      const auto rests = [](const Led& one) { return one.at.velocity_rad_s == 0.0; };
      if (std::ranges::all_of(joints_, rests)) end(TrajectoryOutcome::kHolds, now_s);
      return;
    }
    const bool ended = way_.next == input_.points();
    bool reached = ended;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const JointTerms terms = input_.terms(i);
      const bool goes = ended && terms.stays == 0.0;
      const Place wanted = goes ? Place{goal(i), 0.0} : joints_[i].at;
      const double off_rad = state.position_rad()[joints_[i].joint] - wanted.position_rad;
      const double off_rad_s = state.velocity_rad_s()[joints_[i].joint] - wanted.velocity_rad_s;
      const bool near = ended
                            ? keeps(i, off_rad, chosen(terms.goal_rad, goal_rad_[i]), 0.0) &&
                                  keeps(i, off_rad_s, chosen(terms.goal_rad_s, stopped_rad_s_), 1.0)
                            : keeps(i, off_rad, chosen(terms.path_rad, path_rad_[i]), 0.0) &&
                                  keeps(i, off_rad_s, chosen(terms.path_rad_s, 0.0), 1.0);
      if (near) continue;
      if (!ended) return leave(TrajectoryOutcome::kOffPath, now_s);
      reached = false;
      const double time_s = chosen(input_.terms().goal_time_s, goal_time_s_);
      if (time_s > 0.0 && now_s - input_.time_s(way_.next - 1) > time_s) {
        return leave(TrajectoryOutcome::kOffGoal, now_s);
      }
    }
    if (reached) end(TrajectoryOutcome::kReached, now_s);
  }

  /// A tolerance: of the trajectory, else the controller's; 0: there is none.
  static double chosen(double given, double otherwise) noexcept TANDEM_RT {
    return given > 0.0 ? given : given < 0.0 ? 0.0 : otherwise;
  }

  /// Whether a joint keeps a tolerance; what it does not is noted. What is not finite keeps none.
  bool keeps(std::size_t i, double error, double tolerance, double of_velocity) noexcept TANDEM_RT {
    if (tolerance <= 0.0 || std::abs(error) <= tolerance) return true;
    way_.joint = static_cast<double>(i);
    way_.error = error;
    way_.tolerance = tolerance;
    way_.of_velocity = of_velocity;
    return false;
  }

  void end(TrajectoryOutcome outcome, double now_s) noexcept TANDEM_RT {
    way_.outcome = outcome;
    way_.time_s = now_s;
  }
  /// The joints come to rest where they are.
  void leave(TrajectoryOutcome outcome, double now_s) noexcept TANDEM_RT {
    end(outcome, now_s);
    way_.leads = 0;
    text_.warn(limits_[static_cast<std::size_t>(way_.joint)].name,
               outcome == TrajectoryOutcome::kOffPath ? "left the path by" : "is off the goal by",
               way_.error, way_.of_velocity != 0.0 ? "rad/s, tolerance" : "rad, tolerance",
               way_.tolerance, "after", now_s, "s: the trajectory ends");
  }

  void show() noexcept TANDEM_RT {
    cycle_ = way_.cycle;
    outcome_ = static_cast<double>(way_.outcome);
    joint_ = way_.joint;
    error_ = way_.error;
    tolerance_ = way_.tolerance;
    of_velocity_ = way_.of_velocity;
    time_ = way_.time_s;
  }

  /// Within the limits of position and deceleration.
  static void brake(Place& at, const Limits& limits, double dt_s) noexcept TANDEM_RT {
    const double before = at.velocity_rad_s, step = limits.brake_rad_s2 * dt_s;
    at.velocity_rad_s -= std::clamp(before, -step, step);
    const double to = at.position_rad + 0.5 * (before + at.velocity_rad_s) * dt_s;
    const double low = std::min(limits.min_rad, at.position_rad);
    const double high = std::max(limits.max_rad, at.position_rad);
    if (to < low || to > high) at.velocity_rad_s = 0.0;
    at.position_rad = std::clamp(to, low, high);
  }

  [[nodiscard]] double goal(std::size_t i) const noexcept TANDEM_RT {
    return input_.position_rad(input_.points() - 1)[i];
  }
  [[nodiscard]] double position(std::size_t i, std::size_t point) const noexcept TANDEM_RT {
    return point == way_.first ? joints_[i].from.position_rad : input_.position_rad(point - 1)[i];
  }
  [[nodiscard]] double time_s(std::size_t point) const noexcept TANDEM_RT {
    return point == way_.first ? way_.from_s : input_.time_s(point - 1);
  }
  /// As it is given; else the mean speed about the way-point, 0 at the end and where it reverses.
  /// @param point  the first: where the trajectory found the joint
  [[nodiscard]] double velocity(std::size_t i, std::size_t point) const noexcept TANDEM_RT {
    if (point == way_.first) return joints_[i].from.velocity_rad_s;
    if (input_.has_velocities()) return input_.velocity_rad_s(point - 1)[i];
    if (point == input_.points()) return 0.0;
    const double before = position(i, point) - position(i, point - 1);
    const double after = position(i, point + 1) - position(i, point);
    if (before * after <= 0.0) return 0.0;
    return (before + after) / (time_s(point + 1) - time_s(point - 1));
  }
  /// A cubic from the way-point before to the next one.
  [[nodiscard]] Place on_the_way(std::size_t i, double now_s) const noexcept TANDEM_RT {
    const std::size_t next = way_.next;
    const double begin_s = time_s(next), whole_s = time_s(next + 1) - begin_s;
    const double x = (now_s - begin_s) / whole_s;
    const double p0 = position(i, next), way = position(i, next + 1) - p0;
    const double m0 = velocity(i, next) * whole_s, m1 = velocity(i, next + 1) * whole_s;
    const double c2 = 3.0 * way - 2.0 * m0 - m1, c3 = m0 + m1 - 2.0 * way;
    return {p0 + x * (m0 + x * (c2 + x * c3)), (m0 + x * (2.0 * c2 + x * 3.0 * c3)) / whole_s};
  }

  Input input_;
  Parameter goal_time_s_, stopped_rad_s_;
  std::vector<Parameter> path_rad_, goal_rad_;  // by joint
  std::vector<Limits> limits_;
  std::vector<Led> joints_;
  Way way_;
  Signal cycle_, outcome_, joint_, error_, tolerance_, of_velocity_, time_;
  TextEvents text_;
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::TrajectoryFollower, "trajectory_follower",
                  "Leads joints along way-points that its input says.")
