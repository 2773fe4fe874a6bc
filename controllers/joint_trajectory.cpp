// joint_trajectory: leads joints through way-points at given times, or along Fourier series.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <span>
#include <tuple>

#include "base/counted.hpp"
#include "controllers/controller.hpp"
#include "controllers/fourier_series.hpp"
#include "controllers/min_jerk.hpp"
#include "controllers/motion_plan.hpp"
#include "controllers/parameters.hpp"
#include "controllers/segment.hpp"

namespace tandem {
namespace {

constexpr double kTurn_rad = 2.0 * std::numbers::pi;
constexpr int kSamples = 50;  // of a segment, when its limits are checked

/// Parameters: joints (all), interpolation ("min_jerk": rests at every way-point, "quintic": runs
/// through them), stop_at_end (false), link_damping_Nms_rad (0), angle_wraparound (false: angles as
/// they are; true: each by whole turns nearest to the one before), [[waypoint]] time_s,
/// position_rad (one per joint), and of "quintic" velocity_rad_s, acceleration_rad_s2. A first
/// way-point at 0 s is where the plan starts: joints that stand elsewhere are led there first. With
/// interpolation "fourier" instead of way-points: period_s, periods (1),
/// [[harmonic]] cos_rad, sin_rad (one per joint): x = start + sum_k cos_k (cos k w t - 1) + sin_k
/// sin k w t.
class JointTrajectory : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    TomlTable& parameters = setup.parameters;
    const Parameter interpolation = setup.parameter(
        "interpolation", {.choices = {"min_jerk", "quintic", "fourier"},
                          .otherwise = "min_jerk",
                          .doc = "rests at way-points, runs through them, or series"});
    through_ = interpolation.is("quintic");
    stop_at_end_ = stop_at_end_parameter(setup);
    wraps_ = setup
                 .parameter("angle_wraparound",
                            {.otherwise = false, .doc = "angles by whole turns, the nearest"})
                 .on();
    link_damping_Nms_rad_ = link_damping_parameter(setup);
    joints_ = joints_parameter(setup);
    joints_known_ = !setup.parameters.has_errors();
    for (const std::size_t joint : joints_) {
      setup.claim(joint, hal::ControlMode::kPosition);
      limits_.push_back(setup.robot.joints[joint]);
    }
    if (interpolation.is("fourier")) {
      series_.configure(setup, joints_, joints_known_);
      setup.plan(parameters, "periods", series_.end_s());
      return {};
    }
    std::vector<TomlTable> tables = parameters.tables("waypoint");
    if (tables.empty()) {
      parameters.error("", "there is no way-point",
                       "add [[controller.parameters.waypoint]] with time_s and position_rad");
    }
    here_rad_.assign(joints_.size(), 0.0);
    turned_rad_.assign(joints_.size(), 0.0);
    for (TomlTable& table : tables) read_waypoint(setup, table);
    wrong_number_.tell();
    beyond_.tell();
    check_ends(tables);
    if (!planned_start_) {  // the measured positions, at the start
      times_s_.insert(times_s_.begin(), 0.0);
      points_.insert(points_.begin(), joints_.size(), TrajectoryPoint{});
    }
    const bool known = !setup.start_position_rad.empty();  // else it is left to the limits
    if (known && !tables.empty() && !incomplete_) begin_at(setup.start_position_rad);
    set_velocities();
    const std::size_t first = known || planned_start_ ? 0 : 1;
    for (std::size_t i = first; i + 1 < times_s_.size(); ++i)
      check_segment(setup, tables[planned_start_ ? i + 1 : i], i);
    for (std::size_t i = 0; i < tables.size(); ++i) {
      setup.plan(tables[i], "time_s", approach_s_ + times_s_[planned_start_ ? i : i + 1]);
    }
    return {};
  }

  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    start_ns_ = time.time_ns;
    segment_ = 0;
    if (series_.used()) return series_.start(joints_, state);
    begin_at(state.position_rad());
  }

  Code update(const hal::CycleTime& time, const hal::StateImage& state,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    const double t_s = static_cast<double>(time.time_ns - start_ns_) * 1e-9;
    if (series_.used()) {
      series_.play(t_s, joints_, command);
      damp_links(state, command);
      return stop_at_end_.on() && t_s >= series_.end_s() ? Code::kStopped : Code::kOk;
    }
    if (t_s < approach_s_) {
      approach(t_s, command);
      damp_links(state, command);
      return Code::kOk;
    }
    const double plan_s = t_s - approach_s_;
    const std::size_t last = times_s_.size() - 1;
    while (segment_ < last && plan_s >= times_s_[segment_ + 1]) ++segment_;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const TrajectoryPoint now = segment_ == last
                                      ? TrajectoryPoint{point(last, k).position, 0.0, 0.0}
                                      : at(segment_, k, plan_s - times_s_[segment_]);
      command.position_rad()[joints_[k]] = now.position + turned_rad_[k];
      command.velocity_rad_s()[joints_[k]] = now.velocity;
    }
    damp_links(state, command);
    return segment_ == last && stop_at_end_.on() ? Code::kStopped : Code::kOk;
  }

  void archive(Archive& ar) override {
    ar(start_ns_, segment_, points_, series_.start_rad(), here_rad_, turned_rad_, approach_s_);
  }

 private:
  /// Where the joints are: the first point of the path, unless that is planned; then the way to it,
  /// no faster than half of each joint's speed. Turned angles go as a whole to where the joint is.
  void begin_at(std::span<const double> position_rad) noexcept TANDEM_RT {
    approach_s_ = 0.0;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      here_rad_[k] = position_rad[joints_[k]];
      turned_rad_[k] = wraps_ ? turns_to(k, here_rad_[k]) : 0.0;
      if (!planned_start_) points_[k].position = here_rad_[k] - turned_rad_[k];
      const double way = points_[k].position + turned_rad_[k] - here_rad_[k];
      approach_s_ = std::max(approach_s_, approach_time_s(way, limits_[k]));
    }
  }
  void approach(double t_s, hal::CommandImage& command) const noexcept TANDEM_RT {
    const MinJerk share = min_jerk(t_s / approach_s_);
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const double way = points_[k].position + turned_rad_[k] - here_rad_[k];
      command.position_rad()[joints_[k]] = here_rad_[k] + share.s * way;
      command.velocity_rad_s()[joints_[k]] = share.ds / approach_s_ * way;
    }
  }
  /// Whole turns that bring the path's first way-point nearest to `rad`, and leave it in its
  /// limits.
  [[nodiscard]] double turns_to(std::size_t k, double rad) const noexcept TANDEM_RT {
    if (limits_[k].slides) return 0.0;
    const double first = points_[planned_start_ ? k : joints_.size() + k].position;
    const double fewest = std::ceil((limits_[k].min_position_rad - lowest_rad_[k]) / kTurn_rad);
    const double most = std::floor((limits_[k].max_position_rad - highest_rad_[k]) / kTurn_rad);
    const double turns = std::round((rad - first) / kTurn_rad);
    return fewest <= most ? kTurn_rad * std::clamp(turns, fewest, most) : 0.0;
  }

  /// On a spring the link may swing, which the motor's own loop hardly damps.
  void damp_links(const hal::StateImage& state,
                  hal::CommandImage& command) const noexcept TANDEM_RT {
    const double damping = link_damping_Nms_rad_;
    if (damping == 0.0 && !link_damping_Nms_rad_.changed()) return;
    for (const std::size_t joint : joints_) {
      const double swing = state.velocity_rad_s()[joint] - command.velocity_rad_s()[joint];
      command.torque_Nm()[joint] = -damping * swing;
    }
  }

  /// Mostly wrong with every way-point when it is with one, so only the first is reported.
  class Mistake {
   public:
    void add(const TomlTable& table, std::string message, std::string hint) {
      if (!first_) first_.emplace(table, std::move(message), std::move(hint));
      ++count_;
    }
    void tell() {
      if (!first_) return;
      auto& [table, message, hint] = *first_;
      if (count_ > 1) message += ", here and in " + counted(count_ - 1, "later way-point");
      table.error("position_rad", message, hint);
    }
    [[nodiscard]] explicit operator bool() const { return count_ > 0; }

   private:
    std::optional<std::tuple<TomlTable, std::string, std::string>> first_;
    std::size_t count_ = 0;
  };

  /// One number a joint; says which joints these are when there are more or fewer.
  std::vector<double> read_positions(const ControllerSetup& setup, TomlTable& table) {
    std::vector<double> positions = table.numbers("position_rad", 0);
    if (joints_known_ && table.has("position_rad") && !table.has_errors("position_rad") &&
        positions.size() != joints_.size()) {
      std::string order;
      for (const std::size_t joint : joints_) {
        order += (order.empty() ? "" : ", ") + setup.robot.joints[joint].name;
      }
      wrong_number_.add(
          table,
          "has " + counted(positions.size(), "number") + " for " + counted(joints_.size(), "joint"),
          "give one each for " + order + "; or name those that move in `joints`");
    }
    return positions;
  }

  /// Velocities or accelerations at a way-point: none, or one a joint, and then of every way-point.
  std::vector<double> read_rates(TomlTable& table, const char* key, std::optional<bool>& given) {
    const bool has = table.has(key);
    const bool first = !given.has_value();
    if (first) given = has;
    std::vector<double> rates = has ? table.numbers(key, 0) : std::vector<double>();
    const bool fits = rates.size() == joints_.size();
    if (has && !through_) {
      table.error(key, "min_jerk rests at every way-point", "set interpolation = \"quintic\"");
    } else if (has != *given) {
      table.error(has ? key : "time_s", std::string("some way-points have ") + key + ", some not",
                  "give it to all of them or to none");
    } else if (has && !fits && joints_known_ && !table.has_errors(key)) {
      table.error(
          key,
          "has " + counted(rates.size(), "number") + " for " + counted(joints_.size(), "joint"),
          "give one for each, as in position_rad");
    }
    rates.resize(joints_.size(), 0.0);
    return rates;
  }

  void read_waypoint(ControllerSetup& setup, TomlTable& table) {
    const bool first = times_s_.empty();
    const double time_s = table.number("time_s", first ? kNotNegative : kPositive);
    std::vector<double> positions = read_positions(setup, table);
    const std::vector<double> velocities = read_rates(table, "velocity_rad_s", with_velocity_);
    const std::vector<double> accelerations =
        read_rates(table, "acceleration_rad_s2", with_acceleration_);
    const bool each_has_one = joints_known_ && positions.size() == joints_.size();
    incomplete_ = incomplete_ || !each_has_one;
    positions.resize(joints_.size(), 0.0);
    table.finish();
    if (first) planned_start_ = time_s == 0.0 && !table.has_errors("time_s");
    if (table.has_errors("time_s")) {
      // said already
    } else if (!first && time_s == times_s_.back()) {
      table.error("time_s", "is the time of the way-point before",
                  "a joint cannot be at two places at once: remove one of the two, or move it");
    } else if (!first && time_s < times_s_.back()) {
      table.error("time_s", "is not later than the way-point before", "sort them by time");
    }
    std::vector<const hal::DrivenJoint*> beyond;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const hal::DrivenJoint& joint = limits_[k];
      if (wraps_ && each_has_one) positions[k] = turned(k, positions[k]);
      if (each_has_one &&
          (positions[k] < joint.min_position_rad || positions[k] > joint.max_position_rad)) {
        beyond.push_back(&joint);
      }
      points_.push_back({positions[k], velocities[k], accelerations[k]});
    }
    if (!beyond.empty()) {
      const hal::DrivenJoint& one = *beyond.front();
      const std::string others = beyond.size() == 1 ? " leaves its limits"
                                                    : " and " + std::to_string(beyond.size() - 1) +
                                                          " more leave their limits";
      beyond_.add(table, "joint '" + one.name + "'" + others,
                  "stay within " + std::to_string(one.min_position_rad) + " and " +
                      std::to_string(one.max_position_rad) + "; in radians, or metres of a slide");
    }
    times_s_.push_back(time_s);
  }

  /// The angle by whole turns that is nearest to the way-point before, and within the limits.
  double turned(std::size_t k, double rad) {
    const hal::DrivenJoint& limit = limits_[k];
    if (!limit.slides && !times_s_.empty()) {
      const double before = point(times_s_.size() - 1, k).position;
      const double nearest = rad + kTurn_rad * std::round((before - rad) / kTurn_rad);
      const bool fits = nearest >= limit.min_position_rad && nearest <= limit.max_position_rad;
      if (fits) rad = nearest;
    }
    if (times_s_.empty()) {
      lowest_rad_.push_back(rad);
      highest_rad_.push_back(rad);
    }
    lowest_rad_[k] = std::min(lowest_rad_[k], rad);
    highest_rad_[k] = std::max(highest_rad_[k], rad);
    return rad;
  }

  /// A plan begins and ends at rest.
  void check_ends(std::vector<TomlTable>& tables) {
    if (tables.empty() || incomplete_) return;
    if (!with_velocity_.value_or(false)) {
      if (with_acceleration_.value_or(false)) {
        tables.front().error("acceleration_rad_s2", "needs velocity_rad_s", "give both, or none");
      }
      return;
    }
    const auto moves = [&](std::size_t i) {
      const auto at = points_.begin() + static_cast<std::ptrdiff_t>(i * joints_.size());
      return std::any_of(at, at + static_cast<std::ptrdiff_t>(joints_.size()),
                         [](const TrajectoryPoint& one) { return one.velocity != 0.0; });
    };
    if (planned_start_ && moves(0)) {
      tables.front().error("velocity_rad_s", "the plan begins in motion, the joints at rest",
                           "give 0 at 0 s");
    }
    if (moves(tables.size() - 1)) {
      tables.back().error("velocity_rad_s", "the plan ends in motion, the joints stay there",
                          "give 0 at the last way-point");
    }
  }

  /// Through a way-point a joint runs as fast as between its neighbours, or rests where it turns.
  void set_velocities() {
    if (with_velocity_.value_or(false)) return;
    for (std::size_t i = 1; through_ && i + 1 < times_s_.size(); ++i) {
      for (std::size_t k = 0; k < joints_.size(); ++k) {
        const double before = point(i, k).position - point(i - 1, k).position;
        const double after = point(i + 1, k).position - point(i, k).position;
        // The start is not known yet: the first way-point is where the joints rest.
        const bool turns = (i == 1 && !planned_start_) || before * after <= 0.0;
        point(i, k).velocity = turns ? 0.0 : (before + after) / (times_s_[i + 1] - times_s_[i - 1]);
      }
    }
  }

  /// The fastest that a joint is within a segment [rad/s or m/s], and whether it stays inside.
  struct Way {
    double fastest = 0.0;
    bool inside = true;
  };
  Way way_of(const hal::DrivenJoint& joint, std::size_t segment, std::size_t k) {
    const double duration = times_s_[segment + 1] - times_s_[segment];
    Way way;
    for (int i = 0; i <= kSamples; ++i) {
      const TrajectoryPoint now = at(segment, k, duration * i / kSamples);
      way.fastest = std::max(way.fastest, std::abs(now.velocity));
      const double position = now.position + turned_rad_[k];
      way.inside =
          way.inside && position >= joint.min_position_rad && position <= joint.max_position_rad;
    }
    return way;
  }

  /// One message for all the joints that are too fast, with the time that the slowest needs.
  void check_segment(ControllerSetup& setup, TomlTable& end, std::size_t segment) {
    const double duration = times_s_[segment + 1] - times_s_[segment];
    if (!(duration > 0.0) || incomplete_ || beyond_) return;  // reported already
    std::size_t too_fast = 0;
    double worst = 1.0;  // of the limit
    std::string text;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const hal::DrivenJoint& joint = setup.robot.joints[joints_[k]];
      const Way way = way_of(joint, segment, k);
      const double share = way.fastest / joint.max_velocity_rad_s;
      if (share > 1.0) ++too_fast;
      if (share > worst) {
        worst = share;
        char needs[96];
        std::snprintf(needs, sizeof needs, "would need %.3g rad/s on the way%s, its limit is %.3g",
                      way.fastest, segment == 0 && !planned_start_ ? " from the start" : "",
                      joint.max_velocity_rad_s);
        text = "joint '" + joint.name + "' " + needs;
      }
      if (!way.inside) {
        end.error("position_rad", "joint '" + joint.name + "' leaves its limits on the way",
                  "use interpolation = \"min_jerk\", or another way-point");
      }
    }
    if (too_fast == 0) return;
    if (too_fast > 1) text += ", and " + std::to_string(too_fast - 1) + " more are too fast";
    end.error("time_s", text, more_time(segment, duration * worst));
  }

  /// From rest to rest the velocity goes with one over the time.
  [[nodiscard]] std::string more_time(std::size_t segment, double least_s) const {
    char text[96];
    if (through_ && (segment > 0 || planned_start_)) {
      // The neighbours' times are in the velocities at the way-points: all of them together.
      const double duration = times_s_[segment + 1] - times_s_[segment];
      std::snprintf(
          text, sizeof text, "give it more time: with all times %.3g times as long%s",
          std::ceil(1e2 * least_s / duration) * 1e-2,
          with_velocity_.value_or(false) ? ", and slower velocity_rad_s, it fits" : " it fits");
      return text;
    }
    const double up_s = std::ceil(1e3 * least_s) * 1e-3;
    if (segment == 0 && !planned_start_) {
      std::snprintf(text, sizeof text, "time_s = %g or more; and move the later ones", up_s);
    } else {
      std::snprintf(text, sizeof text, "give it %g s or more after the way-point before", up_s);
    }
    return text;
  }

  [[nodiscard]] TrajectoryPoint& point(std::size_t i, std::size_t k) noexcept {
    return points_[i * joints_.size() + k];
  }
  [[nodiscard]] TrajectoryPoint at(std::size_t segment, std::size_t k,
                                   double t_s) noexcept TANDEM_RT {
    const double duration = times_s_[segment + 1] - times_s_[segment];
    const TrajectoryPoint &from = point(segment, k), &to = point(segment + 1, k);
    if (with_acceleration_.value_or(false)) return quintic_through(from, to, duration, t_s);
    if (with_velocity_.value_or(false)) return cubic(from, to, duration, t_s);
    return quintic(from, to, duration, t_s);
  }

  FourierSeries series_;
  bool through_ = false;
  Parameter stop_at_end_;
  bool wraps_ = false;
  bool planned_start_ = false;                             // the first way-point is at 0
  std::optional<bool> with_velocity_, with_acceleration_;  // the way-points have them
  Parameter link_damping_Nms_rad_;
  bool joints_known_ = false;  // else their number says nothing of the way-points
  bool incomplete_ = false;    // some way-point is
  // Mistakes at way-points; those between them follow from these.
  Mistake wrong_number_, beyond_;
  std::vector<std::size_t> joints_;
  std::vector<hal::DrivenJoint> limits_;          // of these
  std::vector<double> lowest_rad_, highest_rad_;  // of the way-points, where angles wrap around
  std::vector<double> times_s_;                   // of every point, the start at 0 first
  std::vector<TrajectoryPoint> points_;           // per time, per joint
  std::vector<double> here_rad_;                  // where the joints were at the start
  std::vector<double> turned_rad_;                // by which the path is turned
  double approach_s_ = 0.0;                       // to a planned start
  std::int64_t start_ns_ = 0;
  std::size_t segment_ = 0;
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::JointTrajectory, "joint_trajectory",
                  "Leads joints through way-points at given times, or along Fourier series.")
