#include "model/mechanism.hpp"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/nearest.hpp"

namespace tandem::model {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kExact = 1e-14;  // relative: below this a constant is rounding noise

Placement inverse(const Placement& a) { return {a.R.transpose(), -(a.R.transpose() * a.p)}; }

FixedPlacement fixed_placement(const Placement& a) {
  FixedPlacement result;
  result.R = factor_rotation(a.R);
  for (int k = 0; k < 3; ++k) result.p[k] = std::abs(a.p[k]) < kExact ? 0.0 : a.p[k];
  return result;
}

Moments<double> moments_of(const Inertia& inertia) {
  const Vector3d& c = inertia.com_m;
  const Matrix3d J = 0.5 * inertia.about_com_kg_m2.trace() * Matrix3d::Identity() -
                     inertia.about_com_kg_m2 + inertia.mass_kg * c * c.transpose();
  Moments<double> result;
  result.m = inertia.mass_kg;
  for (int i = 0; i < 3; ++i) {
    result.h[i] = inertia.mass_kg * c[i];
    for (int j = 0; j <= i; ++j) result.J(i, j) = 0.5 * (J(i, j) + J(j, i));
  }
  return result;
}

void drop_noise(Moments<double>& x, double total_mass) {
  double h = 0.0;
  double J = 0.0;
  for (const double v : x.h) h = std::max(h, std::abs(v));
  for (const double v : x.J.entry) J = std::max(J, std::abs(v));
  if (std::abs(x.m) < kExact * total_mass) x.m = 0.0;
  for (double& v : x.h) v = std::abs(v) < kExact * h ? 0.0 : v;
  for (double& v : x.J.entry) v = std::abs(v) < kExact * J ? 0.0 : v;
}

// Gives to the parent what a joint's motion leaves as it is: masses on a revolute joint's axis
// (m, h_z, J_zz), and for a prismatic joint the second moments about its origin.
void regroup(Mechanism& mechanism) {
  for (int j = mechanism.joint_count() - 1; j >= 0; --j) {
    const MechanismJoint& joint = mechanism.joints[j];
    Moments<double>& own = mechanism.moments[j + 1];
    Moments<double> moved;
    if (joint.prismatic) {
      std::swap(moved.J, own.J);
    } else {
      std::swap(moved.m, own.m);
      std::swap(moved.h[2], own.h[2]);
      std::swap(moved.J(2, 2), own.J(2, 2));
    }
    moved = turned(joint.in_parent.R, moved);
    for (int axis = 0; axis < 3; ++axis) shift(moved, axis, joint.in_parent.p[axis]);
    add_to(mechanism.moments[joint.parent], moved);
  }
  for (Moments<double>& x : mechanism.moments) drop_noise(x, mechanism.mass_kg);
}

std::vector<std::string> link_names(const Tree& tree) {
  std::vector<std::string> names;
  for (const Link& link : tree.links) names.push_back(link.name);
  return names;
}

std::unexpected<Error> unknown(const Tree& tree, const std::string& what, const std::string& user,
                               const std::string& name, const std::vector<std::string>& known) {
  Error error;
  error.message = user + " names the " + what + " '" + name + "', which the description lacks";
  error.hint = suggest(name, known);
  error.file = tree.file;
  error.key = name;
  return std::unexpected(std::move(error));
}

Matrix3d from_rpy(const std::array<double, 3>& rpy) {
  return (Eigen::AngleAxisd(rpy[2], Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy[1], Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy[0], Vector3d::UnitX()))
      .toRotationMatrix();
}

// What make_mechanism works on.
struct Maker {
  const Tree& tree;
  const ModelSpec& spec;
  std::vector<Placement> frames;  // chosen frame of each body, in the description's
  std::vector<int> site_link;     // per site
  Mechanism result;

  Placement in_frame(int body, const Placement& in_described) const {
    return inverse(frames[body]) * in_described;
  }
  void bodies();
  Status armature();
  Status sites();
  void gather_beyond(int first, MechanismSensor& sensor) const;
  Status sensor(const SensorSpec& sensor);
  Status sensors();
};

void Maker::bodies() {
  result.floating_base = tree.floating_base;
  for (int k = 0; k < 3; ++k) result.gravity[k] = spec.gravity_m_s2[k];
  result.children.resize(tree.bodies.size());
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    const Joint& joint = tree.joints[j];
    result.joints.push_back(make_joint(joint, frames[joint.parent], frames[j + 1]));
    result.joints.back().parent = joint.parent;
    result.children[joint.parent].push_back(static_cast<int>(j));
    result.joint_names.push_back(joint.name);
  }
  for (std::size_t b = 0; b < tree.bodies.size(); ++b) {
    const bool moves = b > 0 || tree.floating_base;
    const Inertia inertia = moves ? tree.bodies[b].inertia : Inertia{};
    result.true_moments.push_back(moments_of(inverse(frames[b]) * inertia));
    result.mass_kg += inertia.mass_kg;
  }
  for (Moments<double>& x : result.true_moments) drop_noise(x, result.mass_kg);
  result.moments = result.true_moments;
}

Status Maker::armature() {
  for (const auto& [name, value] : spec.armature) {
    const int joint = tree.joint_index(name);
    if (joint < 0) return unknown(tree, "moving joint", "an armature", name, result.joint_names);
    if (!(value >= 0.0 && std::isfinite(value)))
      return fail("armature of joint '" + name + "' is negative or not finite",
                  "give the rotor's inertia on the link side, 0 or more");
    result.joints[joint].armature = value;
  }
  return {};
}

Status Maker::sites() {
  for (const SiteSpec& site : spec.sites) {
    const int link = tree.link_index(site.link);
    const std::string user = "site '" + site.name + "'";
    if (link < 0) return unknown(tree, "link", user, site.link, link_names(tree));
    if (std::ranges::count(result.site_names, site.name) != 0)
      return fail(user + " is defined twice", "give each site a name of its own");
    const Placement in_link{from_rpy(site.rpy_rad), Vector3d(site.xyz_m.data())};
    const int body = tree.links[link].body;
    result.sites.push_back(
        {body, fixed_placement(in_frame(body, tree.links[link].in_body * in_link)), -1});
    result.site_names.push_back(site.name);
    site_link.push_back(link);
    if (!site.wrench) continue;
    result.sites.back().wrench = result.wrenches++;
    result.wrench_names.push_back(site.name);
  }
  return {};
}

// What hangs on the link `first`: on its own body masses and sites, and the joints that leave it.
void Maker::gather_beyond(int first, MechanismSensor& sensor) const {
  std::vector<bool> beyond(tree.links.size(), false);
  for (std::size_t i = static_cast<std::size_t>(first); i < tree.links.size(); ++i) {
    const Link& link = tree.links[i];
    beyond[i] = static_cast<int>(i) == first || (link.parent >= 0 && beyond[link.parent]);
    if (!beyond[i]) continue;
    if (link.body == sensor.body)
      add_to(sensor.beyond, moments_of(in_frame(sensor.body, link.in_body) * link.inertia));
    const bool starts_here = link.moving >= 0 && static_cast<int>(i) != first;
    if (starts_here && tree.joints[link.moving].parent == sensor.body)
      sensor.joints.push_back(link.moving);
  }
  drop_noise(sensor.beyond, result.mass_kg);
  for (std::size_t s = 0; s < result.sites.size(); ++s) {
    const MechanismSite& site = result.sites[s];
    if (site.wrench >= 0 && site.body == sensor.body && beyond[site_link[s]])
      sensor.sites.push_back(static_cast<int>(s));
  }
}

Status Maker::sensor(const SensorSpec& spec_of) {
  const std::string user = "sensor '" + spec_of.name + "'";
  const int first = tree.child_link_index(spec_of.joint);
  std::vector<std::string> joints;
  for (const Link& link : tree.links) joints.push_back(link.joint);
  if (first < 0) return unknown(tree, "joint", user, spec_of.joint, joints);
  const int frame = tree.link_index(spec_of.frame_link);
  if (frame < 0) return unknown(tree, "link", user, spec_of.frame_link, link_names(tree));
  if (std::ranges::count(result.sensor_names, spec_of.name) != 0)
    return fail(user + " is defined twice", "give each sensor a name of its own");

  MechanismSensor sensor;
  sensor.body = tree.links[first].body;
  const int moving = tree.links[first].moving;
  if (moving >= 0 && tree.links[frame].body == tree.joints[moving].parent) {
    sensor.through = moving;
  } else if (tree.links[frame].body != sensor.body) {
    return fail(user + ": link '" + spec_of.frame_link + "' is on neither side of joint '" +
                    spec_of.joint + "'",
                "name a link that the joint carries, or one that carries the joint");
  }
  gather_beyond(first, sensor);
  sensor.in_body = fixed_placement(in_frame(tree.links[frame].body, tree.links[frame].in_body));
  result.sensors.push_back(std::move(sensor));
  result.sensor_names.push_back(spec_of.name);
  return {};
}

Status Maker::sensors() {
  for (const SensorSpec& one : spec.sensors)
    if (Status status = sensor(one); !status) return status;
  return {};
}

}  // namespace

Result<Mechanism> make_mechanism(const Tree& tree, const ModelSpec& spec) {
  Maker maker{tree, spec, align_frames(tree), {}, {}};
  maker.bodies();
  if (Status status = maker.armature(); !status) return std::unexpected(status.error());
  if (Status status = maker.sites(); !status) return std::unexpected(status.error());
  if (Status status = maker.sensors(); !status) return std::unexpected(status.error());
  regroup(maker.result);
  return std::move(maker.result);
}

}  // namespace tandem::model
