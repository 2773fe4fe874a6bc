// joint_trajectory: leads joints through way-points at given times, or along Fourier series.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <tuple>

#include "base/counted.hpp"
#include "controllers/controller.hpp"
#include "controllers/fourier_series.hpp"
#include "controllers/parameters.hpp"
#include "controllers/segment.hpp"

namespace tandem {
namespace {

constexpr int kSamples = 50;  // of a segment, when its limits are checked

/// Parameters: joints (all), interpolation ("min_jerk": rests at every way-point, "quintic": runs
/// through them), stop_at_end (false), link_damping_Nms_rad (0), [[waypoint]] time_s, position_rad
/// (one per joint). With interpolation "fourier" instead of way-points: period_s, periods (1),
/// [[harmonic]] cos_rad, sin_rad (one per joint): x = start + sum_k cos_k (cos k w t - 1) + sin_k
/// sin k w t.
class JointTrajectory : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    TomlTable& parameters = setup.parameters;
    const std::string interpolation =
        parameters.choice_or("interpolation", "min_jerk", {"min_jerk", "quintic", "fourier"});
    through_ = interpolation == "quintic";
    stop_at_end_ = parameters.boolean_or("stop_at_end", false);
    link_damping_Nms_rad_ = parameters.number_or("link_damping_Nms_rad", 0.0, kNotNegative);
    joints_ = joints_parameter(setup);
    joints_known_ = !setup.parameters.has_errors();
    for (const std::size_t joint : joints_) setup.claim(joint, hal::ControlMode::kPosition);
    if (interpolation == "fourier") {
      series_.configure(setup, joints_, joints_known_);
      setup.plan(parameters, "periods", series_.end_s());
      return {};
    }
    std::vector<TomlTable> tables = parameters.tables("waypoint");
    if (tables.empty()) {
      parameters.error("", "there is no way-point",
                       "add [[controller.parameters.waypoint]] with time_s and position_rad");
    }
    times_s_.assign(1, 0.0);
    points_.assign(joints_.size(), Motion{});  // the measured positions, at the start
    for (TomlTable& table : tables) read_waypoint(setup, table);
    wrong_number_.tell();
    beyond_.tell();
    set_velocities();
    const bool known = !setup.start_position_rad.empty();  // else it is left to the limits
    for (std::size_t k = 0; known && k < joints_.size(); ++k) {
      points_[k].position = setup.start_position_rad[joints_[k]];
    }
    for (std::size_t i = known ? 0 : 1; i + 1 < times_s_.size(); ++i)
      check_segment(setup, tables[i], i);
    return {};
  }

  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    start_ns_ = time.time_ns;
    segment_ = 0;
    if (series_.used()) return series_.start(joints_, state);
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      points_[k].position = state.position_rad()[joints_[k]];
    }
  }

  Code update(const hal::CycleTime& time, const hal::StateImage& state,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    const double t_s = static_cast<double>(time.time_ns - start_ns_) * 1e-9;
    if (series_.used()) {
      series_.play(t_s, joints_, command);
      damp_links(state, command);
      return stop_at_end_ && t_s >= series_.end_s() ? Code::kStopped : Code::kOk;
    }
    const std::size_t last = times_s_.size() - 1;
    while (segment_ < last && t_s >= times_s_[segment_ + 1]) ++segment_;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const Motion now = segment_ == last ? Motion{point(last, k).position, 0.0, 0.0}
                                          : at(segment_, k, t_s - times_s_[segment_]);
      command.position_rad()[joints_[k]] = now.position;
      command.velocity_rad_s()[joints_[k]] = now.velocity;
    }
    damp_links(state, command);
    return segment_ == last && stop_at_end_ ? Code::kStopped : Code::kOk;
  }

  void archive(Archive& ar) override { ar(start_ns_, segment_, points_, series_.start_rad()); }

 private:
  /// On a spring the link may swing, which the motor's own loop hardly damps.
  void damp_links(const hal::StateImage& state,
                  hal::CommandImage& command) const noexcept TANDEM_RT {
    if (link_damping_Nms_rad_ == 0.0) return;
    for (const std::size_t joint : joints_) {
      const double swing = state.velocity_rad_s()[joint] - command.velocity_rad_s()[joint];
      command.torque_Nm()[joint] = -link_damping_Nms_rad_ * swing;
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

  void read_waypoint(ControllerSetup& setup, TomlTable& table) {
    const double time_s = table.number("time_s", kPositive);
    std::vector<double> positions = read_positions(setup, table);
    const bool each_has_one = joints_known_ && positions.size() == joints_.size();
    incomplete_ = incomplete_ || !each_has_one;
    positions.resize(joints_.size(), 0.0);
    table.finish();
    if (time_s > 0.0 && time_s <= times_s_.back()) {
      table.error("time_s", "is not later than the way-point before", "sort them by time");
    }
    std::vector<const hal::Joint*> beyond;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const hal::Joint& joint = setup.robot.joints[joints_[k]];
      if (each_has_one &&
          (positions[k] < joint.min_position_rad || positions[k] > joint.max_position_rad)) {
        beyond.push_back(&joint);
      }
      points_.push_back({positions[k], 0.0, 0.0});
    }
    if (!beyond.empty()) {
      const hal::Joint& first = *beyond.front();
      const std::string others = beyond.size() == 1 ? " leaves its limits"
                                                    : " and " + std::to_string(beyond.size() - 1) +
                                                          " more leave their limits";
      beyond_.add(table, "joint '" + first.name + "'" + others,
                  "stay within " + std::to_string(first.min_position_rad) + " and " +
                      std::to_string(first.max_position_rad) +
                      "; in radians, or metres of a slide");
    }
    times_s_.push_back(time_s);
    setup.plan(table, "time_s", time_s);
  }

  /// Through a way-point a joint runs as fast as between its neighbours, or rests where it turns.
  void set_velocities() {
    for (std::size_t i = 1; through_ && i + 1 < times_s_.size(); ++i) {
      for (std::size_t k = 0; k < joints_.size(); ++k) {
        const double before = point(i, k).position - point(i - 1, k).position;
        const double after = point(i + 1, k).position - point(i, k).position;
        // The start is not known yet: the first way-point is where the joints rest.
        const bool turns = i == 1 || before * after <= 0.0;
        point(i, k).velocity = turns ? 0.0 : (before + after) / (times_s_[i + 1] - times_s_[i - 1]);
      }
    }
  }

  /// The fastest that a joint is within a segment [rad/s or m/s], and whether it stays inside.
  struct Way {
    double fastest = 0.0;
    bool inside = true;
  };
  Way way_of(const hal::Joint& joint, std::size_t segment, std::size_t k) {
    const double duration = times_s_[segment + 1] - times_s_[segment];
    Way way;
    for (int i = 0; i <= kSamples; ++i) {
      const Motion now = at(segment, k, duration * i / kSamples);
      way.fastest = std::max(way.fastest, std::abs(now.velocity));
      way.inside = way.inside && now.position >= joint.min_position_rad &&
                   now.position <= joint.max_position_rad;
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
      const hal::Joint& joint = setup.robot.joints[joints_[k]];
      const Way way = way_of(joint, segment, k);
      const double share = way.fastest / joint.max_velocity_rad_s;
      if (share > 1.0) ++too_fast;
      if (share > worst) {
        worst = share;
        char needs[96];
        std::snprintf(needs, sizeof needs, "would need %.3g rad/s on the way%s, its limit is %.3g",
                      way.fastest, segment == 0 ? " from the start" : "", joint.max_velocity_rad_s);
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
    if (through_ && segment > 0) return "give it more time";
    char text[96];
    const double up_s = std::ceil(1e3 * least_s) * 1e-3;
    if (segment == 0) {
      std::snprintf(text, sizeof text, "time_s = %g or more; and move the later ones", up_s);
    } else {
      std::snprintf(text, sizeof text, "give it %g s or more after the way-point before", up_s);
    }
    return text;
  }

  [[nodiscard]] Motion& point(std::size_t i, std::size_t k) noexcept {
    return points_[i * joints_.size() + k];
  }
  [[nodiscard]] Motion at(std::size_t segment, std::size_t k, double t_s) noexcept TANDEM_RT {
    const double duration = times_s_[segment + 1] - times_s_[segment];
    return quintic(point(segment, k), point(segment + 1, k), duration, t_s);
  }

  FourierSeries series_;
  bool through_ = false;
  bool stop_at_end_ = false;
  double link_damping_Nms_rad_ = 0.0;
  bool joints_known_ = false;  // else their number says nothing of the way-points
  bool incomplete_ = false;    // some way-point is
  // Of all way-points; what is between them follows from these.
  Mistake wrong_number_, beyond_;
  std::vector<std::size_t> joints_;
  std::vector<double> times_s_;  // of every point, the start at 0 first
  std::vector<Motion> points_;   // per time, per joint
  std::int64_t start_ns_ = 0;
  std::size_t segment_ = 0;
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::JointTrajectory, "joint_trajectory",
                  "Leads joints through way-points at given times, or along Fourier series.")
