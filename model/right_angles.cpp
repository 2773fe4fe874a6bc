// Counts nearly right angles in rpy and axis attributes, writes them exactly into the XML when
// asked to, and bounds how far any link moves by that.
#include "model/right_angles.hpp"

#include <tinyxml2.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <string_view>

namespace tandem::model {
namespace {

using Eigen::Vector3d;

std::optional<Vector3d> three_numbers(const tinyxml2::XMLElement* e, const char* name) {
  const char* text = e == nullptr ? nullptr : e->Attribute(name);
  if (text == nullptr) return {};
  std::string_view rest = text;
  Vector3d numbers;
  for (double& number : numbers) {
    rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r\n+"), rest.size()));
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    if (error != std::errc{} || !std::isfinite(number)) return {};
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  }
  return numbers;
}

void write(tinyxml2::XMLElement* e, const char* name, const Vector3d& numbers) {
  std::string text;
  for (const double number : numbers) {
    std::array<char, 32> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
    text += (text.empty() ? "" : " ") + std::string(digits.data(), end);
  }
  e->SetAttribute(name, text.c_str());
}

// Counts what is so far off; false when it is exact, or no right angle at all.
bool near(double off, RightAngles& found) {
  if (off <= kExactRightAngle || off > kNearRightAngle_rad) return false;
  ++found.count;
  found.worst_rad = std::max(found.worst_rad, off);
  return true;
}

void note_perhaps(const tinyxml2::XMLElement& origin, double off, RightAngles& found) {
  if (off <= kNearRightAngle_rad || off > kPerhapsRightAngle_rad) return;
  for (const tinyxml2::XMLNode* of = origin.Parent(); found.perhaps == 0 && of != nullptr;
       of = of->Parent()) {
    const char* name = of->ToElement() == nullptr ? nullptr : of->ToElement()->Attribute("name");
    if (name == nullptr) continue;
    found.perhaps_first = name;
    break;
  }
  ++found.perhaps;
  found.perhaps_worst_rad = std::max(found.perhaps_worst_rad, off);
}

double angle_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return (a - b).norm() / std::numbers::sqrt2;  // of small ones
}

}  // namespace

void look_at_rpy(tinyxml2::XMLElement* origin, bool make_exact, RightAngles& found) {
  std::optional<Vector3d> rpy = three_numbers(origin, "rpy");
  if (!rpy) return;
  bool any = false;
  for (double& angle : *rpy) {
    const double right = 0.5 * std::numbers::pi * std::round(angle / (0.5 * std::numbers::pi));
    const double off = std::abs(angle - right);
    if (right != 0.0) note_perhaps(*origin, off, found);
    if (!near(off, found)) continue;
    angle = right;
    any = true;
  }
  if (any && make_exact) write(origin, "rpy", *rpy);
}

void look_at_axis(tinyxml2::XMLElement* axis, bool make_exact, RightAngles& found) {
  const std::optional<Vector3d> xyz = three_numbers(axis, "xyz");
  if (!xyz || !(xyz->norm() > 0.0)) return;
  const Vector3d direction = xyz->stableNormalized();
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  const Vector3d right = std::copysign(1.0, direction[largest]) * Vector3d::Unit(largest);
  if (near(direction.cross(right).norm(), found) && make_exact) write(axis, "xyz", right);
}

Displacement largest_displacement(const Tree& written, const Tree& exact) {
  // Per body: by how much its frame may be turned, and its origin moved.
  std::vector<double> turned(written.bodies.size(), 0.0);
  std::vector<double> moved(written.bodies.size(), 0.0);
  for (std::size_t j = 0; j < written.joints.size(); ++j) {
    const Joint& a = written.joints[j];
    const Joint& b = exact.joints[j];
    const auto parent = static_cast<std::size_t>(a.parent);
    moved[j + 1] = moved[parent] + turned[parent] * a.in_parent.p.norm() +
                   (a.in_parent.p - b.in_parent.p).norm();
    turned[j + 1] = turned[parent] + angle_between(a.in_parent.R, b.in_parent.R) +
                    2.0 * (a.axis - b.axis).norm();  // an axis turns what it carries, and back
  }
  Displacement largest;
  for (std::size_t i = 0; i < written.links.size(); ++i) {
    const Link& a = written.links[i];
    const auto body = static_cast<std::size_t>(a.body);
    const double distance = moved[body] + turned[body] * a.in_body.p.norm() +
                            (a.in_body.p - exact.links[i].in_body.p).norm();
    if (distance > largest.distance_m) largest = {a.name, distance};
  }
  return largest;
}

}  // namespace tandem::model
