// The numbers behind the figures: slopes, inverse dynamics of a logged motion, postures.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "model/urdf.hpp"
#include "report/inverse_dynamics.hpp"
#include "report/layout.hpp"
#include "report/posture.hpp"

namespace tandem::report {
namespace {

TEST(Derivative, OfAStraightLineIsItsSlopeUpToTheEnds) {
  std::vector<double> line;
  for (int i = 0; i < 50; ++i) line.push_back(3.0 - 0.2 * i);
  for (const double slope : derivative(line, 0.1, 7)) EXPECT_NEAR(slope, -2.0, 1e-12);
}

TEST(Derivative, OfASineIsItsCosineToSecondOrderInTheWindow) {
  constexpr double kStep = 0.001;
  std::vector<double> sine;
  for (int i = 0; i < 2000; ++i) sine.push_back(std::sin(i * kStep));
  const std::vector<double> slope = derivative(sine, kStep, 10);
  for (std::size_t i = 20; i < 1980; ++i) {
    EXPECT_NEAR(slope[i], std::cos(static_cast<double>(i) * kStep), 2e-5);
  }
}

// A cart of 2 kg on a foot: v' = (tau + fz) / 2. The sensor above the foot (1 kg, 10 N) feels
// the ground less the foot's weight.
void cart_inverse_dynamics(const double*, const double*, const double* vdot, const double* wrench,
                           double* tau) {
  tau[0] = 2.0 * vdot[0] - wrench[2];
}
void cart_sensor(const double*, const double*, const double*, const double* wrench, double* out) {
  for (int i = 0; i < 6; ++i) out[i] = wrench[i];
  out[2] -= 10.0;
}

TEST(InverseDynamics, ExplainsTheSensorsByWrenchesAtTheSites) {
  tandem_kernels cart{};
  cart.nq = cart.nv = cart.joints = cart.wrenches = cart.sensors = 1;
  cart.inverse_dynamics = cart_inverse_dynamics;
  cart.sensor_wrenches = cart_sensor;
  SampledMotion motion;
  motion.step_s = 0.01;
  for (int i = 0; i < 100; ++i) {
    motion.q.push_back({0.0});
    motion.v.push_back({0.5 * i * motion.step_s});    // v' = 0.5
    motion.sensors.push_back({0, 0, 25.0, 0, 0, 0});  // ground: 35 N
  }
  for (const std::vector<double>& tau : inverse_dynamics(cart, motion)) {
    EXPECT_NEAR(tau[0], 2.0 * 0.5 - 35.0, 1e-9);
  }
}

/// The cart's foot is turned upside down: its z is W's -z.
void upside_down(const double*, const double*, const double*, double* pose, double*, double*) {
  const double turned[12] = {1, 0, 0, 0, -1, 0, 0, 0, -1, 0, 0, 0};
  std::copy_n(turned, 12, pose);
}

TEST(InverseDynamics, TakesTheMotionsWrenchesWhereNoSensorMeasures) {
  static const char* const foot[] = {"foot"};
  tandem_kernels cart{};
  cart.nq = cart.nv = cart.joints = cart.sites = cart.wrenches = 1;
  cart.site_names = cart.wrench_names = foot;
  cart.inverse_dynamics = cart_inverse_dynamics;
  cart.site_motion = upside_down;
  cart.sensor_wrenches = [](const double*, const double*, const double*, const double*, double*) {};
  SampledMotion motion{0.01, {{0.0}, {0.0}, {0.0}}, {{0.0}, {0.0}, {0.0}}, {{}, {}, {}}, {}};
  EXPECT_FALSE(wrenches_known(cart, motion));
  motion.wrenches.assign(3, {0, 0, 20.0, 0, 0, 0});
  EXPECT_TRUE(wrenches_known(cart, motion));
  EXPECT_NEAR(inverse_dynamics(cart, motion)[1][0], 20.0, 1e-9);
}

TEST(InverseDynamics, WithoutSensorsTakesNoWrench) {
  tandem_kernels cart{};
  cart.nq = cart.nv = cart.joints = cart.wrenches = 1;
  cart.inverse_dynamics = cart_inverse_dynamics;
  cart.sensor_wrenches = [](const double*, const double*, const double*, const double*, double*) {};
  SampledMotion motion{0.01, {{0.0}, {0.0}, {0.0}}, {{0.0}, {0.03}, {0.06}}, {{}, {}, {}}, {}};
  EXPECT_NEAR(inverse_dynamics(cart, motion)[1][0], 2.0 * 3.0, 1e-9);
}

/// iCub's URDF has x backwards: what its feet say counts.
TEST(Posture, LooksToTheRightWhereverTheDescriptionsXPoints) {
  for (const std::string name : {"icub", "coman"}) {
    const std::string folder = TANDEM_SOURCE_DIR "/config/" + name + "/";
    const auto robot = hal::read_robot_config(folder + "robot.toml");
    ASSERT_TRUE(robot.has_value());
    const auto description = model::read_urdf(robot->model.urdf, {.floating_base = true});
    ASSERT_TRUE(description.has_value());
    const PostureSample zero{"", 0.0, {}, std::vector<double>(robot->joints.size(), 0.0)};
    const Figure figure = posture_figure(description->tree, *robot, {&zero, 1});
    const Curve& legs = *std::ranges::find(figure.curves, "legs", &Curve::label);
    ASSERT_GE(legs.x.size(), 4U);
    const std::size_t ankle = legs.x.size() - 4;  // then heel, toe, gap
    EXPECT_GT(legs.x[ankle + 2] - legs.x[ankle], legs.x[ankle] - legs.x[ankle + 1]) << name;
  }
}

/// Without a truth the base stood at 0, the feet half a metre below, and "ground" between.
TEST(Posture, OfABaseThatNobodyKnowsStandsOnItsFeetAndSaysSo) {
  const std::string folder = TANDEM_SOURCE_DIR "/config/coman/";
  const auto robot = hal::read_robot_config(folder + "robot.toml");
  ASSERT_TRUE(robot.has_value());
  const auto description = model::read_urdf(robot->model.urdf, {.floating_base = true});
  ASSERT_TRUE(description.has_value());
  PostureSample zero{"", 0.0, {}, std::vector<double>(robot->joints.size(), 0.0), false};
  const auto lowest = [&](const Figure& figure) {
    double low = 1e300;
    for (const Curve& curve : figure.curves)
      for (const double z : curve.y) low = std::isfinite(z) ? std::min(low, z) : low;
    return low;
  };
  const Figure unknown = posture_figure(description->tree, *robot, {&zero, 1});
  EXPECT_NEAR(lowest(unknown), robot->contact.height_m, 1e-9);
  EXPECT_TRUE(unknown.title.ends_with("; base unknown: upright on its feet")) << unknown.title;
  zero.placed = true;
  const Figure known = posture_figure(description->tree, *robot, {&zero, 1});
  EXPECT_LT(lowest(known), -0.3);
  EXPECT_EQ(known.title, "Posture, seen from the robot's right");
}

/// On a slope and steps the robot hung in the air: the ground is below it, where it stands in W.
TEST(Posture, HasTheGroundBelowEachMomentWhereItIsNotLevel) {
  const std::string folder = TANDEM_SOURCE_DIR "/config/icub/";  // whose x points backwards
  auto robot = hal::read_robot_config(folder + "robot.toml");
  ASSERT_TRUE(robot.has_value());
  const auto description = model::read_urdf(robot->model.urdf, {.floating_base = true});
  ASSERT_TRUE(description.has_value());
  hal::ContactConfig ground = robot->contact;
  hal::GroundShape slope;
  slope.slope_rad = 0.1;
  ground.terrain.add(slope);
  std::vector<PostureSample> samples;
  for (const double x_m : {0.0, 2.0}) {
    PostureSample sample{"", 0.0, {}, std::vector<double>(robot->joints.size(), 0.0)};
    sample.base.p = {x_m, 0.3, 0.6};
    sample.ground = &ground;
    sample.ground_m = {0.0, 0.0, 0.05};
    samples.push_back(sample);
  }
  const Figure figure = posture_figure(description->tree, *robot, samples);
  const auto found = std::ranges::find(figure.curves, "ground", &Curve::label);
  ASSERT_NE(found, figure.curves.end());
  ASSERT_EQ(found->x.size() % 2, 0U);
  const std::size_t each = found->x.size() / 2;
  const auto middle = [&](std::size_t s) {  // of the line below one figure
    const auto first = found->y.begin() + static_cast<std::ptrdiff_t>(s * each);
    const auto [low, high] = std::minmax_element(first, first + std::ptrdiff_t(each) - 1);
    return 0.5 * (*low + *high);
  };
  EXPECT_NEAR(middle(1) - middle(0), 2.0 * std::tan(0.1), 1e-9);
  EXPECT_NEAR(middle(0), ground.height_m + 0.05, 0.05) << "the base is about over its feet";
  // Ahead is to the right, and against W's x: there the slope falls.
  EXPECT_NEAR((found->y[10] - found->y[0]) / (found->x[10] - found->x[0]), -std::tan(0.1), 1e-9);
  EXPECT_TRUE(std::isnan(found->y[each - 1])) << "a line for each moment";
  // On level ground it is one level, as before; of a base that nobody knows there is none.
  samples[0].placed = samples[1].placed = false;
  const Figure unknown = posture_figure(description->tree, *robot, samples);
  EXPECT_EQ(std::ranges::find(unknown.curves, "ground", &Curve::label), unknown.curves.end());
}

/// An arm that reaches ahead and turns a little was a line, seen from the front.
TEST(Posture, OfAnArmIsSeenFromWhereItShowsMost) {
  const std::string folder = TANDEM_SOURCE_DIR "/config/panda/";
  const auto robot = hal::read_robot_config(folder + "robot.toml");
  ASSERT_TRUE(robot.has_value());
  const auto description = model::read_urdf(robot->model.urdf, {.lock = robot->model.lock});
  ASSERT_TRUE(description.has_value());
  std::vector<double> q = robot->posture("ready")->position_rad;
  std::vector<PostureSample> samples{{"start", 0.0, {}, q}};
  q[0] += 0.4;
  samples.push_back({"farthest", 1.0, {}, q});
  EXPECT_EQ(posture_figure(description->tree, *robot, samples).title,
            "Posture, seen from the robot's right");
  for (PostureSample& sample : samples) sample.position_rad[0] += 1.5;
  EXPECT_EQ(posture_figure(description->tree, *robot, samples).title,
            "Posture, seen from the front");
}

TEST(Posture, PlacesEveryBodyOfThePendulum) {
  const std::string folder = TANDEM_SOURCE_DIR "/config/double_pendulum/";
  const auto robot = hal::read_robot_config(folder + "robot.toml");
  ASSERT_TRUE(robot.has_value());
  const auto description = model::read_urdf(robot->model.urdf, {});
  ASSERT_TRUE(description.has_value());
  const model::Tree& tree = description->tree;
  const PostureSample straight{"", 0.0, {}, {0.0, 0.0}};
  const PostureSample bent{"", 0.0, {}, {0.7, 0.0}};
  const auto a = body_placements(tree, *robot, straight);
  const auto b = body_placements(tree, *robot, bent);
  ASSERT_EQ(a.size(), 3U);
  const double length = (a[2].p - a[1].p).norm();
  EXPECT_GT(length, 0.0);
  EXPECT_NEAR((b[2].p - b[1].p).norm(), length, 1e-12) << "a link does not stretch";
  const Eigen::Vector3d axis = a[1].R * tree.joints[0].axis;
  const auto across = [&axis](const Eigen::Vector3d& d) { return (d - d.dot(axis) * axis).eval(); };
  const Eigen::Vector3d from = across(a[2].p - a[1].p);
  const Eigen::Vector3d to = across(b[2].p - b[1].p);
  EXPECT_NEAR(std::atan2(from.cross(to).dot(axis), from.dot(to)), 0.7, 1e-9);

  const std::vector<PostureSample> samples{straight, bent};
  const Figure figure = posture_figure(tree, *robot, samples);
  ASSERT_EQ(figure.curves.size(), 1U);
  EXPECT_TRUE(figure.equal_axes);
  EXPECT_EQ(figure.notes.size(), 4U);
}

// One reaches to the right and the next to the left: they had crossed. What hung below the last
// joint crossed the texts.
TEST(Posture, OfFiguresThatReachFarBothWaysNoneTouchesAnotherOrTheTexts) {
  const std::string folder = TANDEM_SOURCE_DIR "/config/double_pendulum/";
  const auto robot = hal::read_robot_config(folder + "robot.toml");
  ASSERT_TRUE(robot.has_value());
  const auto description = model::read_urdf(robot->model.urdf, {});
  ASSERT_TRUE(description.has_value());
  std::vector<PostureSample> samples;
  for (const double turn : {1.5, -1.5, 1.5, 3.1, 0.0, -1.5})
    samples.push_back({"farthest A", 0.0, {}, {turn, 0.0}});
  const Figure figure = posture_figure(description->tree, *robot, samples);
  const Curve& curve = figure.curves.front();
  std::vector<Extent> figures(1);  // a NaN ends each line; the outer edges come first
  double lowest = 1e300;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    if (std::isfinite(curve.y[i])) {
      figures.back().include(curve.x[i]);
      lowest = std::min(lowest, curve.y[i]);
    } else if (figures.back().low <= figures.back().high) {
      figures.emplace_back();
    }
  }
  figures.pop_back();
  ASSERT_EQ(figures.size(), samples.size());
  const double across = curve.x[1] - curve.x[0];
  for (std::size_t i = 0; i < figures.size(); ++i) {
    EXPECT_NEAR(figure.notes[2 * i].x, 0.5 * (figures[i].low + figures[i].high), 1e-9);
    EXPECT_LT(figure.notes[2 * i].y, lowest);
    if (i == 0) continue;
    EXPECT_GT(figures[i].low, figures[i - 1].high) << i;
    EXPECT_GT(figure.notes[2 * i].x - figure.notes[2 * i - 2].x, 0.13 * across) << "texts of " << i;
  }
}

}  // namespace
}  // namespace tandem::report
