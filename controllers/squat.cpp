// squat: the feet stay, the centre of mass stays over them, the base goes down and up again.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "controllers/controller.hpp"
#include "controllers/feet.hpp"
#include "controllers/min_jerk.hpp"
#include "controllers/parameters.hpp"
#include "controllers/stance.hpp"

namespace tandem {
namespace {

constexpr int kWalkSteps = 200;  // of the way down, checked at configuration
constexpr int kFirstSolve = 50;  // Newton steps to the first configuration
constexpr int kCycleSolve = 4;   // and at most in a cycle; one is enough as a rule
constexpr double kMostSlip_m = 1e-3;

std::string metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f m", value);
  return text;
}

/// When and how far.
struct Plan {
  double depth_m = 0.0;
  double period_s = 0.0;
  double cycles = 0.0;
  double start_s = 0.0;
  double approach_s = 0.0;
  double settle_s = -1.0;  ///< negative: until the run ends

  /// How far down the base is [m], and how fast it goes down [m/s], `t_s` after the start.
  struct Way {
    double down_m = 0.0;
    double rate_m_s = 0.0;
  };
  [[nodiscard]] Way at(double t_s) const noexcept TANDEM_RT {
    const double since = t_s - start_s;
    if (since <= 0.0 || since >= cycles * period_s) return {};
    const double half = period_s / 2.0;
    const double phase = std::fmod(since, period_s);
    const bool down = phase < half;
    const MinJerk profile = min_jerk((down ? phase : period_s - phase) / half);
    return {depth_m * profile.s, (down ? depth_m : -depth_m) * profile.ds / half};
  }
  /// The rate's own rate [m/s^2], downward.
  [[nodiscard]] double acceleration_m_s2(double t_s) const noexcept TANDEM_RT {
    const double since = t_s - start_s;
    if (since <= 0.0 || since >= cycles * period_s) return 0.0;
    const double half = period_s / 2.0;
    const double phase = std::fmod(since, period_s);
    return depth_m * min_jerk((phase < half ? phase : period_s - phase) / half).dds / (half * half);
  }
  /// That a motion from `t_s` to the lowest point takes: what is left of the way down, or a way.
  [[nodiscard]] double to_the_bottom_s(double t_s) const noexcept TANDEM_RT {
    const double since = t_s - start_s;
    const double half = period_s / 2.0;
    const double phase =
        since > 0.0 && since < cycles * period_s ? std::fmod(since, period_s) : 0.0;
    return phase < half ? half - phase : half;
  }
  [[nodiscard]] double peak_rate_m_s() const { return kMinJerkPeak * depth_m / (period_s / 2.0); }
  [[nodiscard]] bool over(double t_s) const noexcept TANDEM_RT {
    return settle_s >= 0.0 && t_s >= start_s + cycles * period_s + settle_s;
  }
};

/// From a motion to rest at `end_m` in `time_s`: the polynomial of fifth order that continues
/// position, velocity and acceleration.
class Retreat {
 public:
  Retreat() = default;
  Retreat(const Plan::Way& from, double acceleration_m_s2, double end_m, double time_s) noexcept
      : time_s_(time_s), end_m_(end_m) {
    const double way = end_m - from.down_m, v = from.rate_m_s * time_s,
                 a = acceleration_m_s2 * time_s * time_s;
    c_ = {from.down_m,
          v,
          a / 2.0,
          10.0 * way - 6.0 * v - 1.5 * a,
          -15.0 * way + 8.0 * v + 1.5 * a,
          6.0 * way - 3.0 * v - 0.5 * a};
  }
  [[nodiscard]] Plan::Way at(double t_s) const noexcept TANDEM_RT {
    if (over(t_s)) return {end_m_, 0.0};
    const double x = t_s / time_s_;
    Plan::Way way;
    for (std::size_t i = c_.size(); i-- > 0;) {
      way.rate_m_s = way.rate_m_s * x + way.down_m;
      way.down_m = way.down_m * x + c_[i];
    }
    way.rate_m_s /= time_s_;
    return way;
  }
  [[nodiscard]] bool over(double t_s) const noexcept TANDEM_RT { return t_s >= time_s_; }

 private:
  double time_s_ = 0.0, end_m_ = 0.0;
  std::array<double, 6> c_{};
};

class Squat : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    read(setup);
    setup.plan(setup.parameters, "cycles", plan_.start_s + plan_.cycles * plan_.period_s);
    const hal::Posture* posture = posture_parameter(setup);
    const std::vector<std::string> feet =
        setup.parameters.texts_or("feet", foot_names(setup.robot));
    Result<Stance> stance = Stance::make(setup.robot, setup.kernels, feet);
    if (!stance) return std::unexpected(stance.error());
    for (std::size_t j = 0; j < setup.robot.joints.size(); ++j) {
      setup.claim(j, hal::ControlMode::kPosition);
    }
    period_s_ = static_cast<double>(setup.period_ns) * 1e-9;
    measured_.assign(setup.robot.joints.size(), 0.0);
    for (std::size_t j = 0; j < setup.robot.joints.size(); ++j) {
      in_leg_.push_back(stance->in_leg(j) ? 1.0 : 0.0);
    }
    last_v_.assign(setup.kernels->nv, 0.0);
    vdot_.assign(setup.kernels->nv, 0.0);
    stance_.emplace(std::move(*stance));
    if (posture == nullptr && !setup.robot.postures.empty()) posture = &setup.robot.postures[0];
    walk(setup, posture == nullptr ? measured_ : posture->position_rad);
    return {};
  }

  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    start_ns_ = time.time_ns;
    retreats_ = 0;
    std::ranges::copy(state.position_rad(), measured_.begin());
    height_m_ = stance_->place(state.position_rad());
    standing_ = stance_->solve(height_m_, kFirstSolve).converged;
    std::ranges::fill(last_v_, 0.0);
  }

  Code update(const hal::CycleTime& time, const hal::StateImage& state,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    if (standing_ == 0) return Code::kFault;
    const double t_s = static_cast<double>(time.time_ns - start_ns_) * 1e-9;
    const double back_s = static_cast<double>(time.time_ns - retreat_ns_) * 1e-9;
    const Plan::Way way = retreats_ != 0 ? retreat_.at(back_s) : plan_.at(t_s);
    stance_->predict(period_s_);
    if (!stance_->solve(height_m_ - way.down_m, kCycleSolve).converged) return Code::kFault;
    stance_->move(-way.rate_m_s);
    const std::span<const double> v = stance_->v();
    for (std::size_t i = 0; i < v.size(); ++i) {
      vdot_[i] = (v[i] - last_v_[i]) / period_s_;
      last_v_[i] = v[i];
    }
    stance_->carry(vdot_);
    write(min_jerk(t_s / plan_.approach_s), state, command);
    const bool over = retreats_ != 0 ? retreat_.over(back_s) : plan_.over(t_s);
    return over ? Code::kStopped : Code::kOk;
  }

  [[nodiscard]] bool can_retreat() const noexcept TANDEM_RT override { return true; }
  /// To the lowest point, wherever in its squat it is. From there it falls less far.
  bool retreat(const hal::CycleTime& time, const hal::StateImage&) noexcept TANDEM_RT override {
    if (standing_ == 0) return false;
    const double t_s = static_cast<double>(time.time_ns - start_ns_) * 1e-9;
    retreat_ = Retreat(plan_.at(t_s), plan_.acceleration_m_s2(t_s), plan_.depth_m,
                       plan_.to_the_bottom_s(t_s));
    retreat_ns_ = time.time_ns;
    retreats_ = 1;
    return true;
  }

  void archive(Archive& ar) override {
    ar(start_ns_, retreat_ns_, retreats_, retreat_, height_m_, standing_, measured_, last_v_);
    if (stance_) stance_->archive(ar);
  }

 private:
  void read(ControllerSetup& setup) {
    plan_.depth_m = setup.parameter(
        "depth_m", {.unit = "m", .min = 0, .above_min = true, .doc = "of the base, downward"});
    plan_.period_s = setup.parameter(
        "period_s", {.unit = "s", .min = 0, .above_min = true, .doc = "down and up once"});
    plan_.cycles = setup.parameter(
        "cycles", {.min = 1, .max = 1e6, .whole = true, .otherwise = 1, .doc = "how often"});
    plan_.approach_s = setup.parameter(
        "approach_s",
        {.unit = "s", .min = 0, .above_min = true, .otherwise = 1, .doc = "to the start posture"});
    plan_.start_s = setup.parameter("start_s", {.unit = "s",
                                                .min = 0,
                                                .above_min = true,
                                                .otherwise = plan_.approach_s,
                                                .doc = "when it first goes down"});
    const Parameter settle_s = setup.parameter(
        "settle_s",
        {.unit = "s", .min = 0, .otherwise = kNotGiven, .doc = "done so long after the last"});
    if (settle_s.given()) plan_.settle_s = settle_s;
    link_damping_Nms_rad_ = link_damping_parameter(setup);
    if (plan_.start_s < plan_.approach_s) {
      setup.parameters.error("start_s", "the squat would start before the start posture is reached",
                             "give approach_s or more");
    }
  }

  /// References between the measured and the start posture, then those of the squat.
  void write(const MinJerk& approach, const hal::StateImage& state,
             hal::CommandImage& command) const noexcept TANDEM_RT {
    const ModelMap& map = stance_->map();
    const double link_damping = link_damping_Nms_rad_;
    for (std::size_t j = 0; j < map.joints(); ++j) {
      const double way = stance_->q()[map.q_index(j)] - measured_[j];
      command.position_rad()[j] = measured_[j] + way * approach.s;
      command.velocity_rad_s()[j] =
          way * approach.ds / plan_.approach_s + stance_->v()[map.v_index(j)] * approach.s;
      // On a spring the link may swing, which the motor's own loop hardly damps.
      const double swing = state.velocity_rad_s()[j] - command.velocity_rad_s()[j];
      command.torque_Nm()[j] =
          stance_->tau()[map.v_index(j)] * approach.s - link_damping * in_leg_[j] * swing;
    }
  }

  /// Goes down the whole way before anything moves.
  void walk(ControllerSetup& setup, std::span<const double> posture) {
    if (!(plan_.depth_m > 0.0) || !(plan_.period_s > 0.0)) return;  // reported by read()
    const double top = stance_->place(posture);
    double reached = 0.0;
    for (int i = 0; i <= kWalkSteps; ++i) {
      const double down = plan_.depth_m * i / kWalkSteps;
      const Stance::Solution solution = stance_->solve(top - down, kFirstSolve);
      std::string problem = "the feet cannot stay where they are with the mass over them";
      if (solution.converged) problem = beyond_limits(setup.robot);
      if (problem.empty()) {
        reached = down;
        continue;
      }
      if (too_fast_ > 1.0) {
        char least[32];
        std::snprintf(least, sizeof least, "%.2g s", 1.05 * plan_.period_s * too_fast_);
        setup.parameters.error("period_s", problem + ", " + metres(down) + " down",
                               std::string("give at least ") + least +
                                   ", less depth_m, or a posture with more bent knees");
      } else if (i == 0) {
        setup.parameters.error("posture", "the robot cannot stand like this: " + problem,
                               "choose a posture with every foot on the ground and bent knees");
      } else {
        setup.parameters.error("depth_m",
                               "only " + metres(reached) + " can be reached; beyond, " + problem,
                               "give at most " + metres(std::floor(reached * 1e3) * 1e-3));
      }
      return;
    }
  }

  /// What the configuration at hand would break, moving at the squat's largest speed.
  [[nodiscard]] std::string beyond_limits(const hal::Robot& robot) {
    if (stance_->slip_m() > kMostSlip_m) {
      return "the legs have too few joints to keep every foot in its place";
    }
    stance_->move(-plan_.peak_rate_m_s());
    std::ranges::fill(vdot_, 0.0);
    stance_->carry(vdot_);
    const ModelMap& map = stance_->map();
    for (std::size_t j = 0; j < map.joints(); ++j) {
      const hal::DrivenJoint& joint = robot.joints[j];
      const double q = stance_->q()[map.q_index(j)];
      if (q < joint.min_position_rad || q > joint.max_position_rad) {
        return "joint '" + joint.name + "' leaves its limits";
      }
      too_fast_ = std::abs(stance_->v()[map.v_index(j)]) / joint.max_velocity_rad_s;
      if (too_fast_ > 1.0) {
        return "joint '" + joint.name + "' is too slow for this period";
      }
      if (std::abs(stance_->tau()[map.v_index(j)]) > joint.max_torque_Nm) {
        return "joint '" + joint.name + "' is too weak";
      }
    }
    return {};
  }

  Plan plan_;
  std::optional<Stance> stance_;
  double period_s_ = 0.0;
  std::int64_t start_ns_ = 0;
  std::int64_t retreat_ns_ = 0, retreats_ = 0;  // when it began; whether it has
  Retreat retreat_;
  double too_fast_ = 0.0;           // a joint's speed over its limit, of beyond_limits()
  double height_m_ = 0.0;           // of the base above the feet at the start
  std::int64_t standing_ = 0;       // whether the start posture was found
  Parameter link_damping_Nms_rad_;  // of the legs' joints
  std::vector<double> in_leg_;      // 1 or 0
  std::vector<double> measured_, last_v_, vdot_;
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::Squat, "squat", "Squats on its feet with the centre of mass over them.")
