// An operator's loop, a link and a robot, as `tandem run` puts them together: what the operator
// sees, what the robot does, and what happens when the link is gone.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "controllers/model_map.hpp"
#include "hal/config/capabilities.hpp"
#include "hal/remote/tele_backend.hpp"
#include "runtime/run/operator_link.hpp"
#include "tests/runtime/bundled_run.hpp"
#include "tests/support/payload_kernels.hpp"

namespace tandem::remote {
namespace {

/// One cycle in which controllers ran.
struct Row {
  std::vector<double> hand, seen, robot, robot_velocity, reference;
  double tilt = 0.0, height_m = 0.0;
};

/// How the robot differs from its twin.
struct Real {
  double gain = 1.0;     ///< on its position loops
  bool payload = false;  ///< a ball of 1 kg in its hand
};

/// The hand that is led, by robot.
struct Led {
  const char* site;
  const char* link;              ///< the site's
  Eigen::Vector3d ball_in_link;  ///< centre of the payload [m]
};
const Led& led(const std::string& robot) {
  static const Led panda{"hand", "panda_hand", {0.0, 0.0, 0.1}};
  static const Led coman{"l_hand", "LSoftHand", {0.0, 0.0, -0.05}};
  return robot == "panda" ? panda : coman;
}

/// The robot at the far end, which its twin need not be like.
struct RealRobot {
  Diagnostics connect(runtime::Composition& c, const std::string& robot, const Real& of) {
    const runtime::Experiment& e = c.experiment;
    hal::RobotConfig real = e.robot;
    for (hal::GainsConfig& gains : real.gains) gains.position.gains.kp *= of.gain;
    if (of.payload)
      loaded =
          std::make_unique<test::PayloadKernels>(real, led(robot).link, led(robot).ball_in_link);
    auto far = sim::SimRobot::create(real, of.payload ? loaded->get() : c.kernels.get(),
                                     e.sim_robot_config());
    if (!far) return {far.error()};
    c.sim = far->get();
    auto made = runtime::link_to(c, std::move(*far));
    if (!made) return made.error();
    c.tele = made->get();
    c.backend = std::move(*made);
    link = static_cast<TeleBackend*>(c.tele);
    return {};
  }

  std::unique_ptr<test::PayloadKernels> loaded;
  TeleBackend* link = nullptr;
};

/// A bundled robot's teleoperation.toml with a link of one's own.
class Operated : public RealRobot, public runtime::BundledRun {
 public:
  Operated(const std::string& robot, double one_way_s, double loss, bool predict,
           double seconds = 8.0, std::vector<Outage> outages = {}, const Real& of = {})
      : BundledRun(robot, "teleoperation",
                   {.duration_s = seconds,
                    .change =
                        [&](runtime::Experiment& e) {
                          TeleConfig& config = e.teleoperation->link;
                          config.up = config.down =
                              NetworkConfig{.delay_s = one_way_s, .loss = loss, .limit = 10'000};
                          config.playout_ns = std::llround(1e9 * (one_way_s + 0.02));
                          config.predict = predict;
                          config.outages = std::move(outages);
                        }},
                   {}, [&](runtime::Composition& c) { return connect(c, robot, of); }),
        map_(*ModelMap::make(hal::robot_of(experiment->robot), &run->kernels())),
        site_(*site_index(run->kernels(), led(robot).site)) {}
  void operate() {
    while (cycle->step()) {
      if (cycle->phase() != runtime::RunPhase::kRunning) continue;
      Row row;
      const auto copy = [](std::span<const double> values) {
        return std::vector<double>(values.begin(), values.end());
      };
      row.hand = copy(cycle->command().position_rad());
      row.seen = copy(cycle->state().position_rad());
      row.robot = copy(run->truth().position_rad());
      row.robot_velocity = copy(run->truth().velocity_rad_s());
      row.reference = copy(link->robot_command().position_rad());
      const auto q = run->truth().base_quaternion();
      row.tilt = 2.0 * std::asin(std::min(1.0, std::hypot(q[0], q[1])));
      row.height_m = run->truth().base_position_m()[2];
      rows.push_back(std::move(row));
    }
    for (const runtime::FaultReport& fault : cycle->faults())
      EXPECT_FALSE(fault.latched) << fault.text;
  }

  /// RMS distance of the hand, in the base's frame, from where it was led [m].
  double error(std::vector<double> Row::*what, std::size_t later = 0) const {
    return distance(what, later, &Row::hand);
  }
  /// RMS distance of the hand that the operator saw from where the robot's was a moment later [m].
  double prediction_error(std::size_t later) const {
    return distance(&Row::robot, later, &Row::seen);
  }
  std::vector<std::size_t> moved() const {
    std::vector<std::size_t> joints;
    for (std::size_t j = 0; j < rows.front().hand.size(); ++j) {
      double most = 0.0;
      for (const Row& row : rows) most = std::max(most, std::abs(row.hand[j] - rows[0].hand[j]));
      if (most > 0.01) joints.push_back(j);
    }
    return joints;
  }

  /// How far a reference that returns to its commands may go in a cycle on top of them [rad].
  double return_step_rad() const {
    double fastest_rad_s = 0.0;
    for (const std::size_t joint : moved())
      fastest_rad_s = std::max(fastest_rad_s, experiment->robot.joints[joint].max_velocity_rad_s);
    return 0.25 * fastest_rad_s * 1e-9 * static_cast<double>(experiment->loop.period_ns);
  }

  std::vector<Row> rows;

 private:
  /// From the link's first round trip on.
  double distance(std::vector<double> Row::*a, std::size_t later,
                  std::vector<double> Row::*b) const {
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t i = 1200; i + later < rows.size(); i += 10, ++count)
      sum += (hand_m(rows[i + later].*a) - hand_m(rows[i].*b)).squaredNorm();
    return std::sqrt(sum / static_cast<double>(count));
  }
  /// In the base's frame, of joints in the image's order.
  Eigen::Vector3d hand_m(const std::vector<double>& image) const {
    const tandem_kernels& k = run->kernels();
    std::vector<double> q(k.nq), zero(k.nv);
    std::vector<double> pose(12 * k.sites), motion(6 * k.sites);
    if (k.floating_base != 0) q[6] = 1.0;
    map_.positions_to_q(image, q);
    k.site_motion(q.data(), zero.data(), zero.data(), pose.data(), motion.data(), motion.data());
    return Eigen::Map<const Eigen::Vector3d>(&pose[12 * site_ + 9]);
  }

  ModelMap map_;
  std::size_t site_;
};

std::size_t cycles_of(double seconds) {
  return static_cast<std::size_t>(std::llround(seconds * 1e3));
}

class Teleoperation : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Robots, Teleoperation, testing::Values("panda", "coman"),
                         [](const auto& one) { return std::string(one.param); });

TEST_P(Teleoperation, PredictionShowsTheHandAtAQuarterOfASecond) {
  Operated predicted(GetParam(), 0.25, 0.1, true), plain(GetParam(), 0.25, 0.1, false);
  predicted.operate();
  plain.operate();
  const double with = predicted.error(&Row::seen), without = plain.error(&Row::seen);
  // The robot does what the hand did, later by the time of play-out, whatever is lost.
  const std::size_t later = cycles_of(0.27);
  fmt::print(
      "{}: the operator sees {:.2f} mm of error with prediction, {:.1f} without: {:.1f} x; what is "
      "seen differs from what the robot does by {:.2f} mm\n",
      GetParam(), 1e3 * with, 1e3 * without, without / with,
      1e3 * predicted.prediction_error(later));
  EXPECT_GT(without, 5.0 * with);
  EXPECT_GT(without, 0.01) << "the hand moves";
  EXPECT_LT(predicted.error(&Row::robot, later), 1.5 * with + 1e-3);
  EXPECT_EQ(predicted.link->figures().starved_cycles, plain.link->figures().starved_cycles);
  EXPECT_GT(predicted.link->figures().up.lost, 700U);
}

/// A robot that differs from its model: what the operator sees is what it does a moment later.
void expect_corrected(const std::string& robot, const Real& real, double seconds,
                      const char* what) {
  Operated plain(robot, 0.25, 0.1, false, seconds);
  Operated operated(robot, 0.25, 0.1, true, seconds, {}, real);  // last: kernels of one payload
  operated.operate();
  plain.operate();
  const double with = operated.error(&Row::seen), without = plain.error(&Row::seen);
  const double differs = operated.prediction_error(cycles_of(0.27));
  fmt::print(
      "{}, {}: {:.2f} mm of error with prediction, {:.1f} without: {:.1f} x; what is seen differs "
      "from what the robot does by {:.2f} mm, a state from its prediction by {:.1f} mrad at most\n",
      robot, what, 1e3 * with, 1e3 * without, without / with, 1e3 * differs,
      1e3 * operated.link->figures().worst_prediction_rad);
  EXPECT_GT(without, 5.0 * with);
  EXPECT_GT(without, 5.0 * differs);
}

TEST_P(Teleoperation, PredictionIsCorrectedWhereTheRobotIsSofterThanItsModel) {
  expect_corrected(GetParam(), {.gain = 0.66}, 8.0, "two thirds of the stiffness");
}

TEST_P(Teleoperation, PredictionIsCorrectedWhereTheRobotHoldsWhatItsModelLacks) {
  expect_corrected(GetParam(), {.payload = true}, 4.0, "1 kg in its hand");
}

/// The worst of a run.
struct Worst {
  double speed = 0.0, step = 0.0, tilt = 0.0, sink = 0.0;
  std::size_t held = 0;  ///< cycles in which no reference moved and no joint was faster than 0.15
                         ///< rad/s: springs ring
};

Worst worst_of(const Operated& operated) {
  Worst worst;
  const auto joints = operated.moved();
  const auto& rows = operated.rows;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    double speed = 0.0, step = 0.0;
    for (const std::size_t j : joints) {
      speed = std::max(speed, std::abs(rows[i].robot_velocity[j]));
      step = std::max(step, std::abs(rows[i].reference[j] - rows[i - 1].reference[j]));
    }
    worst.speed = std::max(worst.speed, speed);
    worst.step = std::max(worst.step, step);
    worst.tilt = std::max(worst.tilt, rows[i].tilt);
    worst.sink = std::max(worst.sink, std::abs(rows[i].height_m - rows[0].height_m));
    worst.held += step == 0.0 && speed < 0.15 ? 1 : 0;
  }
  return worst;
}

TEST_P(Teleoperation, HoldsWhenTheLinkIsGoneAndReturnsWithoutAStep) {
  Operated operated(GetParam(), 0.1, 0.1, true, 8.0, {{4'500'000'000, 6'500'000'000}});
  Operated whole(GetParam(), 0.1, 0.1, true, 8.0);
  operated.operate();
  whole.operate();
  const TeleFigures figures = operated.link->figures();
  EXPECT_EQ(figures.holds, 1U);
  EXPECT_NEAR(static_cast<double>(figures.starved_cycles), 2000.0, 60.0);
  const Worst cut = worst_of(operated), uncut = worst_of(whole);
  for (const auto& [name, one] : {std::pair{"cut", cut}, std::pair{"whole", uncut}}) {
    fmt::print(
        "{}, {}: holds {} ms; at most {:.2f} rad/s, {:.2f} mrad a cycle, {:.4f} rad tilted\n",
        GetParam(), name, one.held, one.speed, 1e3 * one.step, one.tilt);
  }
  EXPECT_GT(cut.held, uncut.held + 1300U) << "2 s less braking and ringing";
  EXPECT_LT(cut.step, uncut.step + operated.return_step_rad()) << "no step of its references";
  EXPECT_LT(cut.speed, 1.2 * uncut.speed);
  EXPECT_LT(cut.tilt, 1.2 * uncut.tilt + 1e-3);
  EXPECT_LT(cut.sink, uncut.sink + 0.005);
  const std::size_t first = operated.moved().front();
  EXPECT_LT(std::abs(operated.rows.back().robot[first] -
                     operated.rows[operated.rows.size() - 121].hand[first]),
            0.02)
      << "it follows again";
}

TEST(TeleoperationLink, IsAFunctionOfItsSeed) {
  Operated a("panda", 0.05, 0.2, true, 2.0), b("panda", 0.05, 0.2, true, 2.0);
  a.operate();
  b.operate();
  ASSERT_EQ(a.rows.size(), b.rows.size());
  for (std::size_t i = 0; i < a.rows.size(); ++i) {
    ASSERT_EQ(a.rows[i].seen, b.rows[i].seen) << i;
    ASSERT_EQ(a.rows[i].robot, b.rows[i].robot) << i;
  }
}

/// The table of docs/teleoperation.md. TANDEM_TELEOPERATION: a file for it.
TEST(TeleoperationTable, OfDelaysAndLosses) {
  const char* file = std::getenv("TANDEM_TELEOPERATION");
  if (file == nullptr)
    GTEST_SKIP() << "in make test-all: TANDEM_TELEOPERATION names no file for the table";
  std::ofstream out(file);
  out << "robot delay_ms loss predicted_mm plain_mm robot_mm prediction_mm loadedprediction_mm "
         "starved_ms\n";
  for (const char* robot : {"panda", "coman"}) {
    for (const double delay_s : {0.0, 0.1, 0.25, 0.5}) {
      for (const double loss : {0.0, 0.05, 0.2}) {
        Operated predicted(robot, delay_s, loss, true, 12.0);
        Operated plain(robot, delay_s, loss, false, 12.0);
        Operated carries(robot, delay_s, loss, true, 12.0, {}, {.payload = true});
        for (Operated* one : {&predicted, &plain, &carries}) one->operate();
        EXPECT_EQ(predicted.link->figures().starved_cycles, 0U) << robot << " " << delay_s;
        const double with = predicted.error(&Row::seen);
        const double without = plain.error(&Row::seen);
        if (delay_s >= 0.25) {
          EXPECT_GT(without, 5.0 * with) << robot << " " << delay_s;
        }
        const std::size_t later = cycles_of(delay_s + 0.02);
        out << fmt::format(
            "{} {:.0f} {:.2f} {:.3f} {:.3f} {:.3f} {:.3f} {:.3f} {}\n", robot, 1e3 * delay_s, loss,
            1e3 * with, 1e3 * without, 1e3 * predicted.error(&Row::robot, later),
            1e3 * predicted.prediction_error(later), 1e3 * carries.prediction_error(later),
            predicted.link->figures().starved_cycles);
        out.flush();
      }
    }
  }
}

}  // namespace
}  // namespace tandem::remote
