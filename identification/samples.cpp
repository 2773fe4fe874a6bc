// Filters and differences every signal at one instant after the other, and writes the equations.
#include "identification/samples.hpp"

#include <fmt/core.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "identification/low_pass.hpp"
#include "identification/repeats.hpp"
#include "identification/voltage_hold.hpp"

namespace tandem::identification {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

std::unexpected<Error> cannot(const hal::RobotConfig& robot, std::string message,
                              std::string hint) {
  return std::unexpected(Error{std::move(message), std::move(hint), robot.file, 0, {}});
}

/// Channels of an IMU: quaternion, angular velocity, specific force.
constexpr std::size_t kGyro = 4, kAccelerometer = 7;
/// Share of the robot's weight: a larger force on the base has another cause than a wrong mass.
constexpr double kUnexplained = 0.3;
/// Every so many instants it is computed what the IMU's noise does to the equations, six ways.
constexpr std::size_t kNoiseEvery = 6;
/// Share of unknown_hold_s: half of it a voltage may have been held, and when in it the torque was
/// sampled is not known better than to another quarter.
constexpr double kUnknownHold = 0.75;
/// Standard deviations in half of a 95 % interval.
constexpr double kSpreads = 1.96;

Vector3d filtered(const LowPass& filter, const Recording& r, std::size_t channel, std::size_t at,
                  bool rate = false) {
  Vector3d out;
  for (std::size_t i = 0; i < 3; ++i) {
    const Signal& signal = r.sensor[channel + i];
    out[static_cast<Index>(i)] = rate ? filter.rate(signal, at) : filter.value(signal, at);
  }
  return out;
}

/// sign(v) of a joint at every sample, smooth about 0; from differences over a few samples, for an
/// encoder's steps must not look like motion.
Signal directions(const Signal& position, double period_s) {
  const auto span = static_cast<std::size_t>(std::max(1.0, std::round(0.01 / period_s)));
  Signal out(position.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = span; i + span < position.size(); ++i) {
    const double v =
        (position[i + span] - position[i - span]) / (2.0 * static_cast<double>(span) * period_s);
    out[i] = std::tanh(v / kStick_rad_s);
  }
  return out;
}

/// Variance of a signal's white noise: by what a sample is off the line through its neighbours. A
/// motion is smooth over three samples, noise is not.
double noise_of(const Signal& signal) {
  double sum = 0.0;
  std::size_t n = 0;
  for (std::size_t i = 1; i + 1 < signal.size(); ++i) {
    const double off = signal[i + 1] - 2.0 * signal[i] + signal[i - 1];
    if (!std::isfinite(off)) continue;
    sum += off * off / 6.0;
    ++n;
  }
  return n > 0 ? sum / static_cast<double>(n) : 0.0;
}

}  // namespace

Result<IdentifiedRobot> make_identified_robot(const model::Tree& tree,
                                              const hal::RobotConfig& robot) {
  if (!robot.loops.empty() || !robot.passive.empty()) {
    return cannot(robot,
                  "closed loops and passive joints cannot be identified: the forces in a loop are "
                  "not measured",
                  "identify the robot with its loops opened, if it can run so");
  }
  RegressorSpec spec;
  RobotFacts facts;
  std::size_t channel = 0;
  for (const hal::SensorConfig& sensor : robot.sensors) {
    if (sensor.type == hal::SensorType::kForceTorque) {
      spec.sensors.push_back({sensor.name, sensor.joint, sensor.link});
      facts.wrench_channel.push_back(channel);
    } else if (facts.imu_link < 0) {
      facts.imu_link = tree.link_index(sensor.link);
      facts.imu_channel = channel;
    }
    channel += sensor.channels();
  }
  for (const hal::Foot& foot : robot.contact.feet) {
    const auto site = std::ranges::find(robot.model.sites, foot.site, &hal::SiteConfig::name);
    if (site != robot.model.sites.end()) spec.ground_links.push_back(site->link);
  }
  auto regressor = Regressor::create(tree, spec);
  if (!regressor) {
    Error error = regressor.error();
    error.file = robot.file;
    return std::unexpected(std::move(error));
  }
  if (tree.floating_base && facts.imu_link < 0) {
    return cannot(robot, "the base floats, and no IMU says how it moves",
                  "add a [[sensor]] of type \"imu\", or hold the base (base = \"fixed\")");
  }
  for (const std::string& name : regressor->coordinates()) {
    const int joint = robot.joint_index(name);
    facts.joint.push_back(joint);
    const hal::JointConfig& config = robot.joints[static_cast<std::size_t>(joint)];
    const hal::ActuatorConfig& actuator = robot.actuator_of(config);
    facts.rigid.push_back(actuator.order < 2);
    facts.rotor_kg_m2.push_back(actuator.inertia_kg_m2);
    facts.torque_per_A.push_back(actuator.torque_per_A());
    facts.damping_Nms_rad.push_back(actuator.damping_Nms_rad);
    facts.max_torque_Nm.push_back(config.max_torque_Nm);
    facts.max_velocity_rad_s.push_back(config.max_velocity_rad_s);
  }
  facts.gravity_m_s2 = Vector3d(robot.model.gravity_m_s2.data());
  return IdentifiedRobot{std::move(*regressor), std::move(facts), tree.floating_base};
}

namespace {

/// What add_equations() does at one instant after the other.
class Writer {
 public:
  Writer(const Recording& recording, const LowPass& filter, IdentifiedRobot& robot, Equations& all,
         const Eigen::VectorXd& assumed)
      : r_(recording), filter_(filter), robot_(robot), all_(all) {
    const auto joints = static_cast<Index>(robot.facts.joint.size());
    assumed_ = assumed.size() > 0 ? assumed.head(described_.size()).eval() : described_;
    rotors_ = Eigen::Map<const Eigen::VectorXd>(robot.facts.rotor_kg_m2.data(), joints);
    for (Index c = 0; assumed.size() > 0 && c < joints; ++c)
      if (robot.facts.rigid[static_cast<std::size_t>(c)])
        rotors_[c] = assumed[described_.size() + kJointColumns * c +
                             static_cast<Index>(JointColumn::kRotor)];
    for (Index i = 0; i < described_.size(); i += 10) mass_kg_ += described_[i];
    for (std::size_t c = 0; c < robot.facts.joint.size(); ++c) {
      const auto j = static_cast<std::size_t>(robot.facts.joint[c]);
      direction_.push_back(directions(r_.position_rad[j], r_.period_s));
      motor_direction_.push_back(robot.facts.rigid[c]
                                     ? direction_.back()
                                     : directions(r_.motor_position_rad[j], r_.period_s));
    }
    for (std::size_t i = 0; robot.floating && i < 3; ++i) {
      const std::size_t imu = robot.facts.imu_channel + i;
      imu_noise_[i] = noise_of(r_.sensor[imu + kGyro]) * filter.noise(1);
      imu_noise_[i + 3] = noise_of(r_.sensor[imu + kAccelerometer]) * filter.noise(0);
    }
    const auto& rigid = robot.facts.rigid;
    const bool any = std::ranges::find(rigid, true) != rigid.end();
    holds_ = hold_.seconds > 0.0 && any;
    doubts_ = r_.unknown_hold_s > 0.0 && any;
  }

  void add(std::size_t at) {
    Instant now;
    read(at, now);
    hold(at, now);
    robot_.regressor.evaluate(now, Y_, known_);
    if (holds_) sense(at, now);
    const bool free = base_is_free();
    bool any = false;
    for (std::size_t c = 0; c < robot_.regressor.channels().size(); ++c) {
      const Channel& channel = robot_.regressor.channels()[c];
      const auto row = static_cast<Index>(c);
      double measured = 0.0;
      if (holds_ && !sampled_known_ && channel.kind != Channel::Kind::kJoint) continue;
      Eigen::VectorXd x = Eigen::VectorXd::Zero(all_.columns);
      x.head(Y_.cols()) = Y_.row(row);
      if (channel.kind == Channel::Kind::kBase) {
        if (!free) continue;
      } else if (channel.kind == Channel::Kind::kJoint) {
        measured = filter_.value(r_.torque_Nm[joint(channel.index)], at);
        measured += held_Nm_[channel.index];
        joint_columns(channel.index, at, now, x);
      } else if (channel.kind == Channel::Kind::kSensor) {
        measured = now.wrenches[static_cast<std::size_t>(channel.index)][channel.component];
      }
      const double y = measured - known_[row];
      if (!std::isfinite(y) || !x.allFinite()) continue;
      all_.channels[c].append(x, y, measured, all_.time_s.size());
      if (doubts_) all_.channels[c].doubt_last(doubt_[row]);
      any = true;
    }
    if (!any) return;
    if (robot_.floating && all_.time_s.size() % kNoiseEvery == 0) add_noise(at, now);
    for (Index c = 0; c < now.q.size(); ++c) add_motor(c, at, now);
    all_.time_s.push_back(r_.time_s[at]);
  }

  /// Instants at which something else than the measured feet holds the base, though no experiment
  /// says that it hangs.
  [[nodiscard]] std::size_t held() const { return held_; }

 private:
  /// Whether the equations of a floating base hold: nothing acts on it but what is measured. The
  /// description's masses are near enough to see a hoist, or somebody's hand.
  bool base_is_free() {
    if (!robot_.floating || r_.hangs) return false;
    const Vector3d needed = Y_.topRows<3>() * described_;
    const double weight_N = mass_kg_ * robot_.facts.gravity_m_s2.norm();
    const bool free = (needed + known_.head<3>()).norm() < kUnexplained * weight_N;
    held_ += free ? 0 : 1;
    return free;
  }
  /// The equations are linear in the base's accelerations, so a unit of each shows what its noise
  /// does. In the angular velocity noise is small: nothing is differentiated.
  void add_noise(std::size_t at, const Instant& now) {
    const ImuMotion imu = imu_at(at);
    Eigen::MatrixXd moved, still;
    Eigen::VectorXd known, known_still;
    robot_.regressor.evaluate(now, still, known_still);
    for (std::size_t i = 0; i < imu_noise_.size(); ++i) {
      ImuMotion one = imu;
      (i < 3 ? one.al : one.a)[static_cast<Index>(i % 3)] += 1.0;
      Instant then = now;
      robot_.regressor.base_from_link(robot_.facts.imu_link, one.w, one.al, one.a, then);
      robot_.regressor.evaluate(then, moved, known);
      const double share = std::sqrt(imu_noise_[i] * static_cast<double>(kNoiseEvery));
      for (std::size_t c = 0; c < all_.channels.size(); ++c) {
        const auto& used = all_.channels[c].instant;
        if (used.empty() || used.back() != all_.time_s.size()) continue;
        const auto row = static_cast<Index>(c);
        Eigen::VectorXd x = Eigen::VectorXd::Zero(all_.columns);
        x.head(Y_.cols()) = share * (moved.row(row) - still.row(row));
        all_.sensor_noise[c].append(x, share * (known_still[row] - known[row]), 0.0,
                                    all_.time_s.size());
      }
    }
  }
  /// held_Nm_: what a rigid drive's torque has lost at its sample to the back-EMF, by the assumed
  /// inertia about the joints. sampled_: the accelerations there. Torques and their mean
  /// accelerations belong to the middle of the hold, and are that much late.
  void hold(std::size_t at, const Instant& now) {
    const auto n = static_cast<Index>(robot_.facts.joint.size());
    held_Nm_.setZero(n);
    sampled_ = now.vdot;
    if (!holds_ && !doubts_) return;
    Eigen::VectorXd damping = Eigen::VectorXd::Zero(n), rate = damping;
    for (Index c = 0; c < n; ++c) {
      const auto k = static_cast<std::size_t>(c);
      if (!robot_.facts.rigid[k]) continue;
      damping[c] = robot_.facts.damping_Nms_rad[k];
      rate[c] = filter_.rate(r_.torque_Nm[joint(static_cast<int>(c))], at);
    }
    sampled_known_ = rate.allFinite();
    if (!sampled_known_) rate.setZero();
    respond(now);
    const auto M = inertia_.partialPivLu();
    if (holds_) {
      const Eigen::VectorXd last = hold_.sampled(inertia_, damping, now.vdot);
      sampled_ = last - hold_.lag_s() * M.solve(rate);
      held_Nm_ = inertia_ * (now.vdot - last);
    }
    if (!doubts_) return;
    const double unknown_s = kUnknownHold * r_.unknown_hold_s / kSpreads;
    const Eigen::VectorXd braked = damping.cwiseProduct(now.vdot);
    doubt_ = -unknown_s * response_ * M.solve(braked + rate);
    for (std::size_t c = 0; c < robot_.regressor.channels().size(); ++c) {
      const Channel& channel = robot_.regressor.channels()[c];
      if (channel.kind == Channel::Kind::kJoint)
        doubt_[static_cast<Index>(c)] = -unknown_s * braked[channel.index];
    }
  }
  /// response_: what a unit of every joint's acceleration needs in each channel, a floating base
  /// held; inertia_: of it the joints' rows, with their rotors. By the assumed parameters.
  void respond(const Instant& now) {
    const auto n = static_cast<Index>(robot_.facts.joint.size());
    Instant still = now;
    still.v.setZero();
    still.w.setZero();
    still.al.setZero();
    still.a.setZero();
    for (auto& wrench : still.wrenches) wrench.setZero();
    response_.resize(static_cast<Index>(robot_.regressor.channels().size()), n);
    inertia_ = rotors_.asDiagonal();
    for (Index c = 0; c < n; ++c) {
      still.vdot = Eigen::VectorXd::Unit(n, c);
      robot_.regressor.evaluate(still, Y_, known_);
      response_.col(c) = Y_ * assumed_ + known_;
    }
    for (std::size_t row = 0; row < robot_.regressor.channels().size(); ++row) {
      const Channel& channel = robot_.regressor.channels()[row];
      if (channel.kind == Channel::Kind::kJoint)
        inertia_.row(channel.index) += response_.row(static_cast<Index>(row));
    }
  }
  [[nodiscard]] std::size_t joint(int coordinate) const {
    return static_cast<std::size_t>(robot_.facts.joint[static_cast<std::size_t>(coordinate)]);
  }

  void read(std::size_t at, Instant& now) const {
    const RobotFacts& facts = robot_.facts;
    const auto n = static_cast<Index>(facts.joint.size());
    now.q.resize(n);
    now.v.resize(n);
    now.vdot.resize(n);
    for (Index c = 0; c < n; ++c) {
      const Signal& position = r_.position_rad[joint(static_cast<int>(c))];
      now.q[c] = filter_.value(position, at);
      now.vdot[c] = filter_.second_rate(position, at);
      now.v[c] = filter_.rate(position, at);
    }
    for (const std::size_t channel : facts.wrench_channel) {
      Eigen::Matrix<double, 6, 1> wrench;
      wrench << filtered(filter_, r_, channel, at), filtered(filter_, r_, channel + 3, at);
      now.wrenches.push_back(wrench);
    }
    now.w.setZero();
    now.al.setZero();
    now.a = -facts.gravity_m_s2;
    if (robot_.floating) place_base(at, now);
  }
  /// The rows of sensors and base once more, at the sample's own accelerations.
  void sense(std::size_t at, const Instant& now) {
    Instant then = now;
    then.vdot = sampled_;
    if (robot_.floating) place_base(at, then);
    Eigen::MatrixXd Y;
    Eigen::VectorXd known;
    robot_.regressor.evaluate(then, Y, known);
    for (std::size_t c = 0; c < robot_.regressor.channels().size(); ++c) {
      if (robot_.regressor.channels()[c].kind == Channel::Kind::kJoint) continue;
      Y_.row(static_cast<Index>(c)) = Y.row(static_cast<Index>(c));
      known_[static_cast<Index>(c)] = known[static_cast<Index>(c)];
    }
  }
  void place_base(std::size_t at, Instant& now) const {
    const ImuMotion imu = imu_at(at);
    robot_.regressor.base_from_link(robot_.facts.imu_link, imu.w, imu.al, imu.a, now);
  }
  struct ImuMotion {
    Vector3d w, al, a;
  };
  [[nodiscard]] ImuMotion imu_at(std::size_t at) const {
    const std::size_t imu = robot_.facts.imu_channel;
    return {filtered(filter_, r_, imu + kGyro, at), filtered(filter_, r_, imu + kGyro, at, true),
            filtered(filter_, r_, imu + kAccelerometer, at)};
  }

  void joint_columns(int coordinate, std::size_t at, const Instant& now, Eigen::VectorXd& x) const {
    const auto c = static_cast<std::size_t>(coordinate);
    const Index first = Y_.cols() + kJointColumns * coordinate;
    x[first] = now.v[coordinate];
    x[first + 1] = filter_.value(direction_[c], at);
    x[first + 2] = 1.0;
    x[first + 3] = robot_.facts.rigid[c] ? now.vdot[coordinate] : 0.0;
    x[first + 4] = -filter_.rate(r_.torque_Nm[joint(coordinate)], at);
  }

  void add_motor(Index coordinate, std::size_t at, const Instant& now) {
    const auto c = static_cast<std::size_t>(coordinate);
    const std::size_t j = joint(static_cast<int>(coordinate));
    const double per_A = robot_.facts.torque_per_A[c];
    const bool rigid = robot_.facts.rigid[c];
    const Signal& motor = r_.motor_position_rad[j];
    MotorInstant one;
    one.drive = per_A * filter_.value(r_.current_A[j], at);
    one.drive_rate = per_A * filter_.rate(r_.current_A[j], at);
    one.torque = filter_.value(r_.torque_Nm[j], at);
    one.velocity = rigid ? now.v[coordinate] : filter_.rate(motor, at);
    one.acceleration = rigid ? 0.0 : filter_.second_rate(motor, at);
    // The held voltage makes less current at the period's end than on its mean: back-EMF.
    const double damping = robot_.facts.damping_Nms_rad[c];
    const double rotor = robot_.facts.rotor_kg_m2[c];
    if (!rigid && hold_.seconds > 0.0 && rotor > 0.0)
      one.drive += rotor * (one.acceleration - last_of_hold(rotor, damping, one.acceleration));
    one.direction = filter_.value(motor_direction_[c], at);
    const double sum =
        one.drive + one.drive_rate + one.torque + one.velocity + one.acceleration + one.direction;
    if (std::isfinite(sum) && per_A > 0.0) all_.motors[c].push_back(one);
  }

  [[nodiscard]] double last_of_hold(double inertia, double damping, double mean) const {
    const auto one = [](double value) { return Eigen::VectorXd::Constant(1, value); };
    return hold_.sampled(one(inertia), one(damping), one(mean))[0];
  }

  const Recording& r_;
  const LowPass& filter_;
  IdentifiedRobot& robot_;
  Equations& all_;
  std::vector<Signal> direction_, motor_direction_;
  Eigen::MatrixXd Y_;
  Eigen::VectorXd known_;
  Eigen::VectorXd described_ = robot_.regressor.described();
  VoltageHold hold_{r_.voltage_hold_s, r_.hold_steps};
  bool holds_ = false, doubts_ = false;
  bool sampled_known_ = true;         // sampled_: all torques it follows from were measured
  Eigen::VectorXd assumed_, rotors_;  // by which a hold is corrected
  Eigen::VectorXd held_Nm_, sampled_;
  Eigen::MatrixXd response_, inertia_;
  Eigen::VectorXd doubt_;              // per channel: see ChannelRows
  std::array<double, 6> imu_noise_{};  // variances after the filter: angular, linear acceleration
  double mass_kg_ = 0.0;
  std::size_t held_ = 0;
};

}  // namespace

void ChannelRows::append(const Eigen::VectorXd& x, double value, double whole, std::size_t at) {
  const Index row = rows();
  if (row == X.rows()) {
    const Index more = std::max<Index>(64, 2 * row);
    X.conservativeResize(more, x.size());
    y.conservativeResize(more);
    measured.conservativeResize(more);
  }
  X.row(row) = x.transpose();
  y[row] = value;
  measured[row] = whole;
  instant.push_back(at);
}

void ChannelRows::doubt_last(double one_deviation) {
  doubt.resize(instant.size(), 0.0);
  doubt.back() = one_deviation;
}

Status add_equations(const Recording& recording, double cutoff_Hz, IdentifiedRobot& robot,
                     Equations& equations, const Eigen::VectorXd& assumed) {
  if (cutoff_Hz * recording.period_s > 0.2) {
    return std::unexpected(
        Error{fmt::format("a cut-off of {} Hz is too high for samples every {:.3g} ms", cutoff_Hz,
                          1e3 * recording.period_s),
              fmt::format("give --cutoff {:.3g} or less", 0.2 / recording.period_s),
              recording.path,
              0,
              {}});
  }
  const LowPass filter(recording.period_s, cutoff_Hz);
  const std::size_t coordinates = robot.facts.joint.size();
  equations.columns = robot.regressor.columns() + kJointColumns * static_cast<Index>(coordinates);
  equations.channels.resize(robot.regressor.channels().size());
  equations.sensor_noise.resize(equations.channels.size());
  equations.motors.resize(coordinates);
  equations.travel_rad.resize(coordinates, 0.0);
  equations.first_of_log.push_back(equations.time_s.size());
  equations.stride_s = static_cast<double>(filter.stride()) * recording.period_s;
  equations.repeats_s.push_back(
      motion_period_s(recording.position_rad, recording.period_s, filter.stride()));
  Writer writer(recording, filter, robot, equations, assumed);
  for (std::size_t at = filter.reach(); at + filter.reach() < recording.rows();
       at += filter.stride())
    writer.add(at);
  equations.held_s += static_cast<double>(writer.held() * filter.stride()) * recording.period_s;
  const std::size_t added = equations.time_s.size() - equations.first_of_log.back();
  equations.usable_s += static_cast<double>(added * filter.stride()) * recording.period_s;
  for (std::size_t c = 0; c < coordinates; ++c) {
    const Signal& position = recording.position_rad[static_cast<std::size_t>(robot.facts.joint[c])];
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double q : position) {
      if (std::isnan(q)) continue;
      low = std::min(low, q);
      high = std::max(high, q);
    }
    equations.travel_rad[c] = std::max(equations.travel_rad[c], high - low);
  }
  return {};
}

}  // namespace tandem::identification
