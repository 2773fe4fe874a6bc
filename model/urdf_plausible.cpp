// Masses and inertias that a body can have, but that this robot's links hardly do.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/counted.hpp"
#include "model/density.hpp"
#include "model/urdf_outline.hpp"

namespace tandem::model {
namespace {

using Eigen::Vector3d;

constexpr double kDensest_kg_m3 = 1e5;  // nine times lead
constexpr double kSlack = 2.0;          // shapes may be smaller than the link: the Panda has 1.8
constexpr double kLeast_m = 0.5;        // of a link whose size nothing says

double half_size_m(const Shape& shape) {
  switch (shape.kind) {
    case Shape::Kind::kBox: return 0.5 * shape.size_m.norm();
    case Shape::Kind::kSphere: return shape.size_m.x();
    case Shape::Kind::kCylinder: return std::hypot(shape.size_m.x(), 0.5 * shape.size_m.z());
    case Shape::Kind::kCapsule: return shape.size_m.x() + 0.5 * shape.size_m.z();
    case Shape::Kind::kMesh: break;
  }
  return 0.0;
}

class Plausibility {
 public:
  Plausibility(const Tree& tree, const Outline& outline, Diagnostics& warnings)
      : tree_(tree), outline_(outline), warnings_(warnings) {}

  void run() {
    find_reach();
    Found bare, wide, dense;
    look_at_bodies(bare);
    for (std::size_t i = 0; i < tree_.links.size(); ++i) look_at(i, wide, dense);
    const std::string other = "give them an <inertial>, or make one of the joints fixed";
    report(bare, "no mass, though between two joints that move", other);
    report(wide, "an inertia that is too large for the link",
           "inertias are in kg m^2, about the centre of mass, lengths in metres");
    report(dense, "a density far above lead's",
           "masses are in kilograms, lengths in metres, inertias in kg m^2");
  }

 private:
  struct Found {
    std::vector<std::string> links;
    std::string example;
  };

  void report(const Found& found, const std::string& what, const std::string& hint) {
    if (found.links.empty()) return;
    const bool one = found.links.size() == 1;
    std::string text = counted(found.links.size(), "link") + (one ? " has " : " have ") + what;
    text += ": " + found.links[0] + (found.example.empty() ? "" : " (" + found.example + ")");
    if (!one) text += ", and " + counted(found.links.size() - 1, "more", "more");
    const auto line = outline_.link_lines.find(found.links[0]);
    // Without a key: that of a link means an impossible inertia.
    warnings_.push_back(
        {text, hint, tree_.file, line == outline_.link_lines.end() ? 0 : line->second, {}});
  }

  void look_at_bodies(Found& bare) const {
    for (std::size_t b = 1; b < tree_.bodies.size(); ++b) {
      const auto hangs = [b](const Joint& joint) { return joint.parent == static_cast<int>(b); };
      if (tree_.bodies[b].inertia.mass_kg == 0.0 && std::ranges::any_of(tree_.joints, hangs))
        bare.links.push_back(tree_.bodies[b].name);
    }
  }

  /// The farthest frame or centre of mass, all joints at 0.
  void find_reach() {
    std::vector<Placement> bodies{{}};
    for (const Joint& joint : tree_.joints)
      bodies.push_back(bodies[static_cast<std::size_t>(joint.parent)] * joint.in_parent);
    for (const Link& link : tree_.links) {
      const Placement at = bodies[static_cast<std::size_t>(link.body)] * link.in_body;
      reach_m_ = std::max({reach_m_, at.p.norm(), (at.R * link.inertia.com_m + at.p).norm()});
    }
  }

  void look_at(std::size_t index, Found& wide, Found& dense) const {
    const Link& link = tree_.links[index];
    const double whole_kg = tree_.bodies[static_cast<std::size_t>(link.body)].inertia.mass_kg;
    const double mass_kg = link.inertia.mass_kg;
    const bool counts = link.body != 0 || tree_.floating_base;
    if (!counts || !(mass_kg > kNegligibleMassShare * whole_kg)) return;
    const double gyration_m = largest_gyration_m(link.inertia);
    const double size_m = size_of(index);
    char text[96];
    if (gyration_m > size_m) {
      std::snprintf(text, sizeof text, "radius of gyration %.3g m, of a size of %.3g m", gyration_m,
                    size_m);
      note(wide, link.name, text);
    } else if (density_of_ball(link.inertia) > kDensest_kg_m3) {
      std::snprintf(text, sizeof text, "%.5g kg, radius of gyration %.3g m", mass_kg, gyration_m);
      note(dense, link.name, text);
    }
  }

  static void note(Found& found, const std::string& link, const char* text) {
    if (found.links.empty()) found.example = text;
    found.links.push_back(link);
  }

  /// Nothing of the link is farther from its centre of mass. Where no shape says how large it is:
  /// nor from a robot's.
  [[nodiscard]] double size_of(std::size_t index) const {
    const Link& link = tree_.links[index];
    const Vector3d& com = link.inertia.com_m;
    double size_m = com.norm();
    bool known = !link.shapes.empty();
    for (const Shape& shape : link.shapes) {
      known = known && shape.kind != Shape::Kind::kMesh;
      size_m = std::max(size_m, (shape.in_link.p - com).norm() + half_size_m(shape));
    }
    for (const Link& child : tree_.links) {
      if (child.parent != static_cast<int>(index)) continue;
      const Placement in_body =
          child.moving < 0 ? child.in_body
                           : tree_.joints[static_cast<std::size_t>(child.moving)].in_parent;
      const Vector3d in_link = link.in_body.R.transpose() * (in_body.p - link.in_body.p);
      size_m = std::max(size_m, (in_link - com).norm());
    }
    return known ? kSlack * size_m : std::max({size_m, reach_m_, kLeast_m});
  }

  const Tree& tree_;
  const Outline& outline_;
  Diagnostics& warnings_;
  double reach_m_ = 0.0;
};

}  // namespace

void warn_of_odd_masses(const Tree& tree, const Outline& outline, Diagnostics& warnings) {
  Plausibility(tree, outline, warnings).run();
}

}  // namespace tandem::model
