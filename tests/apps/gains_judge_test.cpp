// Gains against the model: the board's own code in a simulation of its own, a frequency response
// that was written by hand, the bundled robots, and the two cases that once ran without a fault.
#include "robot/gains_judge.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "apps/robot/gains_opinion.hpp"
#include "firmware_emu/estimator.hpp"
#include "firmware_emu/joint_controller.hpp"
#include "hal/config/capabilities.hpp"
#include "model/interpreted_kernels.hpp"
#include "robot/loop_margin.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {
namespace {

using hal::PidLoop;

// --- The board's own code -------------------------------------------------------------------

hal::ActuatorConfig motor(int order) {
  return {.name = {},
          .order = order,
          .resistance_ohm = 0.8,
          .inductance_H = 5e-4,
          .torque_constant_Nm_A = 0.05,
          .gear_ratio = 100.0,
          .inertia_kg_m2 = 0.4,
          .damping_Nms_rad = 40.0,  // N^2 K^2 / R = 31.25
          .spring_Nm_rad = 900.0,
          .spring_damping_Nms_rad = 2.0};
}

/// A joint whose board is firmware::JointController, whose physics are integrated by Runge-Kutta.
class SimulatedLoop {
 public:
  SimulatedLoop(const robot::LoopPlant& plant, double inertia_kg_m2)
      : plant_(plant), inertia_(inertia_kg_m2) {
    const hal::ActuatorConfig& a = plant.actuator;
    const auto pid = [](const hal::PidConfig& of) {
      return firmware::Pid::Config{of.gains.kp, of.gains.ki, of.gains.kd, 0.0};
    };
    canopen::DriveParameters c;
    c.position = pid(plant.gains.position);
    c.velocity = pid(plant.gains.velocity);
    c.torque = pid(plant.gains.torque);
    c.torque_to_voltage_V_Nm = plant.gains.torque_feedforward * a.resistance_ohm / kt();
    c.emf_compensation_Vs_rad = plant.gains.emf_compensation * kt();
    c.motor_constant_Nm_A = kt();
    c.spring_Nm_rad = a.order >= 2 ? a.spring_Nm_rad : 0.0;
    c.voltage_limit_V = c.torque_limit_Nm = 1e300;
    c.motor_feedback = static_cast<double>(plant.gains.position_feedback);
    board_.configure(c, plant.period_s);
    for (auto* filter : {&link_rate_, &motor_rate_, &torque_rate_}) {
      filter->configure(150.0, plant.period_s);
    }
    x_ = {1e-3, 0.01, 1e-3, 0.02, 0.0};
  }

  /// By which factor rates and twist grow in a period, over the second half of `periods`.
  [[nodiscard]] double growth(int periods) {
    std::vector<double> largest;  // of fifty periods each
    for (int k = 0; k < periods && size() < 1e200; ++k) {
      if (k % 50 == 0) largest.push_back(0.0);
      step();
      largest.back() = std::max(largest.back(), size());
      if (size() > 1e50 && first_ == 0) first_ = k + 1, at_first_ = size();
      last_ = k + 1;
    }
    if (size() >= 1e200) return std::pow(size() / at_first_, 1.0 / (last_ - first_));
    const std::size_t half = largest.size() / 2, end = largest.size() - 1;
    if (!(largest[half] > 0.0)) return 0.0;
    return std::pow(largest[end] / largest[half], 1.0 / (50.0 * static_cast<double>(end - half)));
  }

 private:
  using State = std::array<double, 5>;  // motor, its rate, link, its rate, current

  [[nodiscard]] double kt() const {
    return plant_.actuator.gear_ratio * plant_.actuator.torque_constant_Nm_A;
  }
  [[nodiscard]] double size() const {
    return std::hypot(x_[0] - x_[2], x_[1] * plant_.period_s, x_[3] * plant_.period_s);
  }
  [[nodiscard]] double current(const State& x) const {
    const hal::ActuatorConfig& a = plant_.actuator;
    return (a.order & 1) != 0 ? x[4] : (voltage_ - kt() * x[1]) / a.resistance_ohm;
  }
  [[nodiscard]] double friction() const {
    return plant_.actuator.damping_Nms_rad - kt() * kt() / plant_.actuator.resistance_ohm;
  }
  [[nodiscard]] double torque(const State& x) const {
    const hal::ActuatorConfig& a = plant_.actuator;
    if (a.order < 2) return kt() * current(x) - friction() * x[1];
    return a.spring_Nm_rad * (x[0] - x[2]) + a.spring_damping_Nms_rad * (x[1] - x[3]);
  }
  [[nodiscard]] State rate(const State& x) const {
    const hal::ActuatorConfig& a = plant_.actuator;
    const double tau = torque(x), drive = kt() * current(x) - friction() * x[1];
    const double link = tau / inertia_;
    const double rotor = a.order < 2 ? link : (drive - tau) / a.inertia_kg_m2;
    const double winding = (a.order & 1) != 0
                               ? (voltage_ - a.resistance_ohm * x[4] - kt() * x[1]) / a.inductance_H
                               : 0.0;
    return {x[1], rotor, x[3], link, winding};
  }
  void integrate(double h) {
    const auto along = [](const State& x, const State& d, double by) {
      State out = x;
      for (std::size_t i = 0; i < out.size(); ++i) out[i] += by * d[i];
      return out;
    };
    const State a = rate(x_), b = rate(along(x_, a, h / 2)), c = rate(along(x_, b, h / 2)),
                d = rate(along(x_, c, h));
    for (std::size_t i = 0; i < x_.size(); ++i)
      x_[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
  }
  void step() {
    firmware::Measurement m{.link_position_rad = x_[2],
                            .motor_position_rad = x_[0],
                            .torque_Nm = torque(x_),
                            .current_A = current(x_),
                            .bus_voltage_V = 1e300};
    const double before = link_rate_.rate();
    m.link_velocity_rad_s = link_rate_.update(x_[2]);
    m.motor_velocity_rad_s = motor_rate_.update(x_[0]);
    m.link_acceleration_rad_s2 = (m.link_velocity_rad_s - before) / plant_.period_s;
    m.torque_rate_Nm_s = torque_rate_.update(m.torque_Nm);
    const std::array modes{canopen::Mode::kCsp, canopen::Mode::kCsv, canopen::Mode::kCst};
    voltage_ = board_.update(firmware::BridgeAction::kFollow,
                             modes[static_cast<std::size_t>(plant_.loop)], {}, m);
    constexpr int kSteps = 10;
    for (int i = 0; i < kSteps; ++i) integrate(plant_.period_s / kSteps);
  }

  const robot::LoopPlant& plant_;
  double inertia_;
  firmware::JointController board_;
  firmware::FilteredDifference link_rate_, motor_rate_, torque_rate_;
  State x_{};
  double voltage_ = 0.0;
  int first_ = 0, last_ = 0;  // period in which it was beyond 1e50, and the last one
  double at_first_ = 0.0;
};

/// 160 loops of random gains, of each order, mode and feedback: what is judged unstable grows by as
/// much, what is judged stable does not.
TEST(LoopMargin, IsWhatTheBoardsOwnCodeDoes) {
  std::mt19937_64 random(7);
  const auto between = [&](double low, double high) {
    const double share = static_cast<double>(random() >> 11) * 0x1p-53;
    return low * std::pow(high / low, share);
  };
  const auto maybe = [&](double value) { return random() % 3 == 0 ? 0.0 : value; };
  int unstable = 0;
  for (int i = 0; i < 160; ++i) {
    const hal::ActuatorConfig actuator = motor(i % 4);
    hal::GainsConfig gains;
    gains.torque_feedforward = 1.0;
    gains.emf_compensation = i % 8 < 4 ? 1.0 : 0.0;
    gains.position_feedback =
        i % 16 < 8 ? hal::PositionFeedback::kLink : hal::PositionFeedback::kMotor;
    gains.position.gains = {between(100, 2e4), maybe(between(100, 1e5)), maybe(between(1, 500))};
    gains.velocity.gains = {between(1, 1e3), maybe(between(1, 1e4)), maybe(between(0.01, 1))};
    gains.torque.gains = {maybe(between(1e-3, 1)), maybe(between(1e-2, 10)),
                          maybe(between(1e-4, 1e-2))};
    const robot::LoopPlant plant{static_cast<PidLoop>(random() % 3), actuator, gains,
                                 i % 5 == 0 ? 4e-3 : 1e-3};
    const double inertia = between(0.05, 20.0);
    const std::array inertias{inertia};
    const robot::LoopVerdict verdict = robot::judge_loop(plant, inertias, false);
    const double simulated = SimulatedLoop(plant, inertia).growth(8000);
    const std::string what = fmt::format(
        "{}: order {} {} loop, kp {:g} {:g} {:g}, {:g} {:g} {:g}; torque {:g} {:g} {:g}, J {:g}", i,
        actuator.order, hal::to_string(plant.loop), gains.position.gains.kp,
        gains.position.gains.ki, gains.position.gains.kd, gains.velocity.gains.kp,
        gains.velocity.gains.ki, gains.velocity.gains.kd, gains.torque.gains.kp,
        gains.torque.gains.ki, gains.torque.gains.kd, inertia);
    if (verdict.growth > 1.002) {
      ++unstable;
      EXPECT_NEAR(std::log(simulated), std::log(verdict.growth),
                  0.03 * std::log(verdict.growth) + 5e-4)
          << what;
    } else if (verdict.growth > 1.0005) {
      EXPECT_GT(simulated, 1.0) << what;
    } else {
      EXPECT_LT(simulated, 1.0005) << what << ", judged " << verdict.growth;
    }
  }
  EXPECT_GT(unstable, 40);
  EXPECT_LT(unstable, 120);
}

// --- A frequency response by hand -----------------------------------------------------------

/// The textbook's loop of a rigid joint: PID with a filtered derivative, half a period of delay for
/// the hold, 1 / (J s^2 + D s). The board's loop is the same far below its sampling.
TEST(LoopMargin, IsTheTextbooksOfARigidJoint) {
  const double J = 1.2, T = 1e-3;
  const hal::ActuatorConfig actuator = motor(0);
  hal::GainsConfig gains;
  gains.torque_feedforward = 1.0;
  for (const auto& [kp, ki, kd] : {std::array{4000.0, 8000.0, 140.0},
                                   {1000.0, 0.0, 20.0},
                                   {8000.0, 16000.0, 280.0},
                                   {300.0, 100.0, 0.0}}) {
    gains.position.gains = {kp, ki, kd};
    const auto gain = [&, kp = kp, ki = ki, kd = kd](double w) {
      const std::complex<double> s(0.0, w);
      const std::complex<double> rate = s / (1.0 + s / (2.0 * std::numbers::pi * 150.0));
      return (kp + ki / s + kd * rate) * std::exp(-s * 0.5 * T) /
             (J * s * s + actuator.damping_Nms_rad * s);
    };
    double low = 1.0, high = 1000.0;  // the gain falls all the way
    while (high / low > 1.0 + 1e-9) {
      (std::abs(gain(std::sqrt(low * high))) > 1.0 ? low : high) = std::sqrt(low * high);
    }
    const double margin_deg = 180.0 + std::arg(gain(low)) * 180.0 / std::numbers::pi;
    const std::array inertias{J};
    const robot::LoopVerdict verdict =
        robot::judge_loop({PidLoop::kPosition, actuator, gains, T}, inertias);
    EXPECT_TRUE(verdict.stable());
    EXPECT_NEAR(verdict.crossover_rad_s, low, 0.01 * low);
    EXPECT_NEAR(verdict.phase_margin_deg, margin_deg, 1.5);
  }
}

// --- Robots ---------------------------------------------------------------------------------

struct Judged {
  explicit Judged(const std::string& name)
      : files(*robot::read_robot(TANDEM_SOURCE_DIR "/config/" + name + "/robot.toml")),
        kernels(*model::make_mechanism(files.tree, files.spec, model::Frames::kAsDescribed), name),
        judge(files.config, kernels.get()),
        image(hal::initial_parameters(files.config)),
        at(files.config.joints.size(), 0.0) {}

  [[nodiscard]] robot::GainsJudge::Gains gains(std::size_t joint) const {
    robot::GainsJudge::Gains out;
    for (std::size_t l = 0; l < out.size(); ++l) {
      out[l] = image.gains(joint, static_cast<PidLoop>(l));
    }
    return out;
  }
  [[nodiscard]] Json opinion(const std::string& joint, const hal::PidGains& position) const {
    const auto j = static_cast<std::size_t>(files.config.joint_index(joint));
    robot::GainsJudge::Gains all = gains(j);
    all[0] = position;
    return apps::opinion(judge, j, PidLoop::kPosition, all, at);
  }

  robot::RobotFiles files;
  model::InterpretedKernels kernels;
  robot::GainsJudge judge;
  hal::ParameterImage image;
  std::vector<double> at;
};

TEST(GainsJudge, FindsTheBundledRobotsStable) {
  for (const char* name :
       {"anymal_c", "coman", "double_pendulum", "icub", "panda", "ur5e", "walkman"}) {
    const Judged robot(name);
    for (std::size_t j = 0; j < robot.at.size(); ++j) {
      ASSERT_EQ(robot.judge.unknown(j), "");
      for (const PidLoop loop : {PidLoop::kPosition, PidLoop::kVelocity, PidLoop::kTorque}) {
        const auto verdict = robot.judge.judge(j, loop, robot.gains(j), robot.at, false);
        if (!verdict) continue;
        EXPECT_TRUE(verdict->stable())
            << name << " " << robot.files.config.joints[j].name << " " << hal::to_string(loop);
      }
    }
  }
}

/// Both once ran at twice the joint's velocity limit without a fault: they swing at a few hertz.
TEST(GainsJudge, FindsAnIntegralThatIsTooMuch) {
  for (const auto& [name, joint, kp] :
       {std::tuple{"panda", "panda_joint3", 400.0}, {"ur5e", "shoulder_lift_joint", 1000.0}}) {
    const Judged robot(name);
    const Json bad = robot.opinion(joint, {kp, 8000.0, 0.0});
    EXPECT_EQ(bad["judged"], true);
    EXPECT_EQ(bad["stable"], false) << bad;
    EXPECT_TRUE(bad["phase_margin_deg"].is_null());
    EXPECT_LT(bad["doubles_in_s"].get<double>(), 2.0);
    const std::string remedy = bad["remedy"];
    const std::size_t kd = remedy.find("kd = ");
    ASSERT_NE(kd, std::string::npos) << remedy;
    const Json good = robot.opinion(joint, {kp, 8000.0, std::stod(remedy.substr(kd + 5))});
    EXPECT_EQ(good["stable"], true) << remedy;
    EXPECT_GT(good["phase_margin_deg"].get<double>(), 29.0) << remedy;  // kd has two digits
  }
}

TEST(GainsJudge, SaysWhyItDoesNotJudge) {
  const auto loops = robot::read_robot(TANDEM_SOURCE_DIR "/config/four_bar/robot.toml");
  const robot::GainsJudge closed(loops->config, nullptr);
  EXPECT_NE(closed.unknown(0).find("no model"), std::string::npos);
  for (const auto& [name, why] :
       {std::pair{"four_bar", "closed loops"}, {"panda_classic", "not ours"}}) {
    const Judged robot(name);
    const Json said = apps::opinion(robot.judge, 0, PidLoop::kPosition, robot.gains(0), robot.at);
    EXPECT_EQ(said["judged"], false) << name;
    EXPECT_NE(said["why"].get<std::string>().find(why), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace tandem::apps
