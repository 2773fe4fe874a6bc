#include "tests/model/random_robot.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace tandem::model {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

std::string text(const Vector3d& v) {
  return fmt::format("{:.17g} {:.17g} {:.17g}", v[0], v[1], v[2]);
}

}  // namespace

RandomRobot::RandomRobot(std::uint64_t seed, const RandomRobotOptions& options)
    : generator_(seed * 0x9E3779B97F4A7C15u + 1), options_(options) {
  urdf_ = "<robot name=\"random\">\n";
  add_link("link0", false);
  int moving = 0;
  while (moving < options_.joints) {
    const int index = links_;
    const int above = chance(options_.branching) ? pick(links_) : links_ - 1;
    const double kind = uniform(0.0, 1.0);
    const char* type = kind < 0.5 ? "revolute" : kind < 0.7 ? "continuous" : "prismatic";
    if (kind > 0.88) type = "fixed";
    moving += kind > 0.88 ? 0 : 1;
    const bool last = moving == options_.joints;
    // What ends a limb has mass, so that no joint carries none: a massless one is always followed.
    const bool massless = !last && kind <= 0.88 && chance(0.08);
    add_joint(index, type, fmt::format("link{}", above), fmt::format("link{}", index));
    add_link(fmt::format("link{}", index), massless);
    if (!massless) continue;
    add_joint(links_, "fixed", fmt::format("link{}", index), fmt::format("link{}", links_));
    add_link(fmt::format("link{}", links_), false);
  }
  add_joint(links_, "fixed", fmt::format("link{}", links_ - 1), "tip");
  urdf_ += "<link name=\"tip\"/>\n</robot>\n";
}

double RandomRobot::uniform(double low, double high) {
  return low + (high - low) * static_cast<double>(generator_() >> 11) * 0x1p-53;
}

int RandomRobot::pick(int count) {
  return static_cast<int>(generator_() % static_cast<std::uint64_t>(count));
}

std::string RandomRobot::rounded(double value) {
  const int digits = options_.digits > 0 ? options_.digits : 4 + pick(14);
  return fmt::format("{:.{}g}", value, digits);
}

double RandomRobot::angle() {
  if (chance(0.4)) return 0.0;
  const double right = 0.5 * std::numbers::pi * (pick(5) - 2);
  if (chance(options_.right_angles)) return right;
  if (chance(0.3)) return right + std::pow(10.0, -uniform(4.0, 16.0));
  return uniform(-3.0, 3.0);
}

// Numbers are drawn in statements of their own: compilers evaluate arguments in different orders.
Eigen::Vector3d RandomRobot::direction() {
  const double z = uniform(0.1, 1.0);
  const double y = uniform(-1.0, 1.0);
  return {uniform(-1.0, 1.0), y, z};
}

std::string RandomRobot::origin() {
  const std::string yaw = rounded(angle());
  const std::string pitch = rounded(angle());
  const std::string roll = rounded(angle());
  return fmt::format("<origin xyz=\"{}\" rpy=\"{} {} {}\"/>", offset(), roll, pitch, yaw);
}

std::string RandomRobot::axis() {
  const double sign = chance(0.5) ? 1.0 : -1.0;
  Vector3d v = sign * Vector3d::Unit(pick(3));
  if (chance(options_.near_parallel)) {
    v = Vector3d::UnitZ();  // of the parent's, if that is the usual one and nothing turns between
    if (chance(0.7)) v[pick(2)] = std::pow(10.0, -uniform(4.0, 16.0));
  } else if (chance(0.3)) {
    v = direction();
  }
  return text(v);
}

std::string RandomRobot::offset() {
  Vector3d v = Vector3d::Zero();
  for (int k = 0; k < 3; ++k)
    if (chance(0.6)) v[k] = uniform(-0.5, 0.5);
  if (chance(0.1)) v[pick(3)] = std::pow(10.0, -uniform(3.0, 14.0));
  return fmt::format("{:.6g} {:.6g} {:.6g}", v[0], v[1], v[2]);
}

void RandomRobot::add_link(const std::string& name, bool massless) {
  ++links_;
  if (massless) {
    urdf_ += fmt::format("<link name=\"{}\"/>\n", name);
    return;
  }
  const double half = 0.5 * options_.mass_decades;
  const double mass = std::pow(10.0, uniform(-half, half));
  const double size = std::pow(10.0, uniform(-1.5, 0.0));
  Vector3d second;  // second moments of an ellipsoid with these half axes, over the mass
  for (double& s : second) s = 0.2 * size * size * std::pow(10.0, uniform(-2.0, 0.0));
  Matrix3d R = Matrix3d::Identity();
  if (chance(0.5)) {
    const Vector3d about = direction().normalized();
    R = Eigen::AngleAxisd(uniform(-3.0, 3.0), about).toRotationMatrix();
  }
  const Matrix3d J = mass * R * second.asDiagonal() * R.transpose();
  const Matrix3d I = J.trace() * Matrix3d::Identity() - J;
  urdf_ += fmt::format(
      "<link name=\"{}\"><inertial>{}<mass value=\"{:.9g}\"/>"
      "<inertia ixx=\"{:.15g}\" ixy=\"{:.15g}\" ixz=\"{:.15g}\" iyy=\"{:.15g}\" iyz=\"{:.15g}\" "
      "izz=\"{:.15g}\"/></inertial></link>\n",
      name, origin(), mass, I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2));
}

void RandomRobot::add_joint(int index, const std::string& type, const std::string& parent,
                            const std::string& child) {
  urdf_ +=
      fmt::format("<joint name=\"joint{}\" type=\"{}\"><parent link=\"{}\"/><child link=\"{}\"/>{}",
                  index, type, parent, child, origin());
  if (type != "fixed") urdf_ += "<axis xyz=\"" + axis() + "\"/>";
  if (type == "revolute" || type == "prismatic")
    urdf_ += "<limit lower=\"-3\" upper=\"3\" effort=\"100\" velocity=\"10\"/>";
  urdf_ += "</joint>\n";
}

RandomRobotOptions options_of(std::uint64_t seed, int most_joints) {
  std::mt19937_64 generator(seed ^ 0xD1B54A32D192ED03u);
  const auto uniform = [&] { return static_cast<double>(generator() >> 11) * 0x1p-53; };
  RandomRobotOptions options;
  // Small ones more often: they take less time and have the same odd places.
  options.joints = 1 + static_cast<int>(std::pow(uniform(), 2.5) * most_joints);
  options.floating_base = uniform() < 0.5;
  options.branching = uniform() < 0.5 ? 0.0 : uniform();
  options.near_parallel = uniform();
  options.right_angles = uniform();
  options.digits = uniform() < 0.7 ? 4 + static_cast<int>(uniform() * 14.0) : 0;
  options.mass_decades = uniform() < 0.5 ? 6.0 : 1.0;
  return options;
}

}  // namespace tandem::model
