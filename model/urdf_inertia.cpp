// Positive definiteness and triangle inequality of principal moments, link by link and body by
// body.
#include "model/urdf_inertia.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "model/urdf_override.hpp"
#include "model/urdf_repair.hpp"

namespace tandem::model {
namespace {

constexpr double kDefiniteTolerance = 1e-12;  // of the largest principal moment
constexpr double kMostGyration_m = 10.0;      // radius of gyration: likewise
constexpr double kFarthestMass_m = 20.0;      // from the link's frame: likewise
constexpr double kMostMass_kg = 1e6;          // a slip of units or digits
constexpr double kTriangleTolerance = 1e-6;   // rounding of the description's own digits

std::string mass_text(const Inertia& inertia) {
  char text[32];
  std::snprintf(text, sizeof text, "%g kg", inertia.mass_kg);
  return text;
}

Eigen::Vector3d principal_moments(const Eigen::Matrix3d& I) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(I, Eigen::EigenvaluesOnly);
  return solver.eigenvalues();  // ascending
}

class Checker {
 public:
  Checker(const Tree& tree, const Outline& outline, const UrdfOptions& options, Diagnostics& errors,
          Diagnostics& warnings)
      : tree_(tree), outline_(outline), options_(options), errors_(errors), warnings_(warnings) {}

  void run() {
    const std::size_t before = errors_.size();
    for (const Link& link : tree_.links) {
      check_place(link);
      check_link(link);
    }
    const bool possible = errors_.size() == before;
    for (std::size_t i = 0; possible && i < tree_.bodies.size(); ++i) check_body(i);
    check_carried_mass();
  }

 private:
  [[nodiscard]] bool fixed_to_world(int body) const { return body == 0 && !tree_.floating_base; }

  void check_place(const Link& link) {
    const double away_m = link.inertia.com_m.norm();
    if (fixed_to_world(link.body) || !(away_m > kFarthestMass_m)) return;
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", away_m);
    errors_.push_back({std::string("the centre of mass is ") + text + " m from the link's frame",
                       "lengths are in metres", tree_.file, line_of(link.name),
                       "link " + link.name});
  }

  void check_link(const Link& link) {
    const std::string found = inertia_problem(link.inertia);
    if (found.empty()) return;
    if (fixed_to_world(link.body) && link.inertia.mass_kg >= 0.0) return;  // it never counts
    const double whole = tree_.bodies[static_cast<std::size_t>(link.body)].inertia.mass_kg;
    Error report{found, {}, tree_.file, line_of(link.name), "link " + link.name};
    if (const LinkOverride* given = find_override(options_, link.name)) {
      report.file = file_of(options_, *given);
      report.line = given->line;
      report.key = key_of(*given);
    }
    if (link.inertia.mass_kg < 0.0) {
      report.hint = "masses are zero or positive";
      errors_.push_back(report);
    } else if (link.inertia.mass_kg > kMostMass_kg) {
      report.hint = "masses are in kilograms";
      errors_.push_back(report);
    } else if (std::isfinite(whole) && link.inertia.mass_kg < kNegligibleMassShare * whole) {
      report.hint =
          "used as it is, for it has less than 1 % of its body's mass; `tandem check --repair` "
          "shows the nearest possible one";
      warnings_.push_back(report);
    } else {
      report.hint = "check the six moments, their signs and their reference point";
      if (repaired(link.inertia)) {
        report.hint +=
            "; inertia = \"repair\" in [model] takes the nearest possible one, and `tandem check "
            "--repair` shows it";
      }
      errors_.push_back(report);
    }
  }

  /// A body's links one by one are possible or negligible; their sum must be possible too.
  void check_body(std::size_t index) {
    const Body& body = tree_.bodies[index];
    const std::string found = inertia_problem(body.inertia);
    if (fixed_to_world(static_cast<int>(index)) || found.empty()) return;
    errors_.push_back({"with all that is fixed to it, " + found,
                       "correct the inertias of its links", tree_.file, line_of(body.name),
                       "link " + body.name});
  }

  void check_carried_mass() {
    // Masses that are negative are reported themselves; here they are masses.
    std::vector<double> carried(tree_.bodies.size(), 0.0);
    for (const Link& link : tree_.links)
      carried[static_cast<std::size_t>(link.body)] += std::abs(link.inertia.mass_kg);
    const double base_kg = carried[0];
    for (std::size_t i = tree_.joints.size(); i > 0; --i) {
      carried[static_cast<std::size_t>(tree_.joints[i - 1].parent)] += carried[i];
    }
    for (std::size_t i = 0; i < tree_.joints.size(); ++i) {  // a leader moves its followers' too
      if (const int leader = tree_.joints[i].leader; leader >= 0) {
        carried[static_cast<std::size_t>(leader) + 1] += carried[i + 1];
      }
    }
    for (std::size_t i = 0; i < tree_.joints.size(); ++i) {
      if (carried[i + 1] > 0.0 || tree_.joints[i].follows()) continue;
      const Joint& joint = tree_.joints[i];
      errors_.push_back({"the joint moves nothing that has mass",
                         "give link '" + tree_.bodies[i + 1].name +
                             "' mass and inertia, lock the "
                             "joint or make it fixed; `tandem new` has --density, --lock and "
                             "--drop for that",
                         tree_.file, joint.line, "joint " + joint.name});
    }
    const Body& base = tree_.bodies[0];
    if (!tree_.floating_base || base_kg > 0.0) return;
    errors_.push_back({"the floating base has no mass",
                       "give it mass and inertia, or set base = \"fixed\" in robot.toml",
                       tree_.file, line_of(base.name), "link " + base.name});
  }

  int line_of(const std::string& link) const {
    const auto found = outline_.link_lines.find(link);
    return found == outline_.link_lines.end() ? 0 : found->second;
  }

  const Tree& tree_;
  const Outline& outline_;
  const UrdfOptions& options_;
  Diagnostics& errors_;
  Diagnostics& warnings_;
};

}  // namespace

bool is_beyond_size(double mass_kg, const Eigen::Matrix3d& about_com_kg_m2) {
  const double most = 2.0 * kMostGyration_m * kMostGyration_m * mass_kg;
  return mass_kg > 0.0 && about_com_kg_m2.trace() > most;
}

std::string inertia_problem(const Inertia& inertia) {
  const Eigen::Matrix3d& I = inertia.about_com_kg_m2;
  if (!I.allFinite() || !inertia.com_m.allFinite() || !std::isfinite(inertia.mass_kg)) {
    return "the mass or inertia is too large to be computed with";
  }
  if (inertia.mass_kg < 0.0) return "the mass is negative, " + mass_text(inertia);
  if (inertia.mass_kg > kMostMass_kg) {
    return "the mass is " + mass_text(inertia) + ", more than any robot has";
  }
  if (is_beyond_size(inertia.mass_kg, I)) {
    return "the inertia, of principal moments " + moments_text(inertia) +
           ", is that of a body of " + "more than " +
           std::to_string(static_cast<int>(kMostGyration_m)) + " m";
  }
  if (inertia.mass_kg == 0.0) return I.isZero(0.0) ? "" : "there is an inertia without mass";
  const Eigen::Vector3d moments = principal_moments(I);
  if (!(moments[0] > kDefiniteTolerance * std::abs(moments[2]))) {
    return "the inertia is not positive definite: principal moments " + moments_text(inertia);
  }
  if (moments[0] + moments[1] < moments[2] * (1.0 - kTriangleTolerance)) {
    return "the inertia breaks the triangle inequality: principal moments " + moments_text(inertia);
  }
  return {};
}

std::string moments_text(const Inertia& inertia) {
  const Eigen::Vector3d moments = principal_moments(inertia.about_com_kg_m2);
  char text[96];
  std::snprintf(text, sizeof text, "%.4g, %.4g, %.4g kg m^2", moments[0], moments[1], moments[2]);
  return text;
}

void check_inertias(const Tree& tree, const Outline& outline, const UrdfOptions& options,
                    Diagnostics& errors, Diagnostics& warnings) {
  Checker(tree, outline, options, errors, warnings).run();
}

Diagnostics impossible_links(const Outline& outline, const std::string& file) {
  double whole_kg = 0.0;
  for (const OutlineLink& link : outline.links) whole_kg += std::abs(link.mass_kg);
  Diagnostics errors;
  for (const OutlineLink& link : outline.links) {
    const auto& [xx, xy, xz, yy, yz, zz] = link.moments_kg_m2;
    Inertia inertia{link.mass_kg, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()};
    inertia.about_com_kg_m2 << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    const std::string found = inertia_problem(inertia);
    if (found.empty() || std::abs(link.mass_kg) < kNegligibleMassShare * whole_kg) continue;
    errors.push_back({found, "check the mass, the six moments and their signs", file, link.line,
                      "link " + link.name});
  }
  return errors;
}

}  // namespace tandem::model
