// Applies the frames that align.cpp chose, drops constants below their own rounding error, and
// regroups inertias from the tips to the base.
#include "model/mechanism.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/nearest.hpp"
#include "model/placements.hpp"
#include "model/rounded.hpp"

namespace tandem::model {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// What a length that is the difference of longer ones, or a sum over links, may be off by.
constexpr double kRounding = 4.0 * std::numeric_limits<double>::epsilon();

// Lengths [m] and angles [rad] that are rounding of a description's numbers, and one of which no
// result changes.
constexpr double kRounded = 1e-7;
constexpr double kNothing = 1e-30;

Placement inverse(const Placement& a) { return {a.R.transpose(), -(a.R.transpose() * a.p)}; }

// The components of a shift; `size` is that of the lengths that it is the difference of.
FixedPlacement fixed_placement(const Placement& a, double size) {
  FixedPlacement result;
  result.R = factor_rotation(a.R);
  for (int k = 0; k < 3; ++k) result.p[k] = Rounded(a.p[k], kRounding * size).without_noise();
  return result;
}

using RoundedMoments = Moments<Rounded>;

// The moments of `inertia`, seen from where `frame` says that its own frame stands. `size`: of the
// lengths that its centre of mass was summed of.
RoundedMoments moments_of(const Inertia& inertia, const Placement& frame, double size) {
  const double about_com = inertia.about_com_kg_m2.lpNorm<Eigen::Infinity>();
  const double noise_h = kRounding * inertia.mass_kg * size;
  const double noise_J = kRounding * (about_com + inertia.mass_kg * size * size);
  Vec3<Rounded> c;  // of the mass, in the new frame
  Mat3<Rounded> R;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) R[i][j] = Rounded(frame.R(i, j));
  for (int i = 0; i < 3; ++i) c[i] = Rounded(inertia.com_m[i], kRounding * size);
  c = multiply(R, c) + Vec3<Rounded>{frame.p[0], frame.p[1], frame.p[2]};
  const Matrix3d J = 0.5 * inertia.about_com_kg_m2.trace() * Matrix3d::Identity() -
                     0.5 * (inertia.about_com_kg_m2 + inertia.about_com_kg_m2.transpose());
  RoundedMoments result;
  result.m = Rounded(inertia.mass_kg, 0.0);
  for (int i = 0; i < 3; ++i) {
    result.h[i] = result.m * c[i];
    result.h[i].noise += noise_h;
    for (int j = 0; j <= i; ++j) {
      Rounded sum = result.h[i] * c[j];
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) sum += R[i][k] * R[j][l] * Rounded(J(k, l), 0.0);
      result.J(i, j) = {sum.value, sum.noise + noise_J};
    }
  }
  return result;
}

Moments<double> without_noise(const RoundedMoments& x) {
  Moments<double> result;
  result.m = x.m.value;  // masses are only ever added
  for (int i = 0; i < 3; ++i) result.h[i] = x.h[i].without_noise();
  for (std::size_t i = 0; i < 6; ++i) result.J.entry[i] = x.J.entry[i].without_noise();
  return result;
}

// Gives to the parent what a joint's motion leaves as it is: masses on a revolute joint's axis
// (m, h_z, J_zz), and for a prismatic joint the second moments about its origin.
void regroup(Mechanism& mechanism, std::vector<RoundedMoments> moments) {
  for (int j = mechanism.joint_count() - 1; j >= 0; --j) {
    const MechanismJoint& joint = mechanism.joints[j];
    RoundedMoments& own = moments[j + 1];
    RoundedMoments moved;
    if (joint.prismatic) {
      std::swap(moved.J, own.J);
    } else {
      std::swap(moved.m, own.m);
      std::swap(moved.h[2], own.h[2]);
      std::swap(moved.J(2, 2), own.J(2, 2));
    }
    moved = turned(joint.in_parent.R, moved);
    for (int axis = 0; axis < 3; ++axis) shift(moved, axis, Rounded(joint.in_parent.p[axis]));
    add_to(moments[joint.parent], moved);
  }
  for (const RoundedMoments& x : moments) mechanism.moments.push_back(without_noise(x));
}

// Gives `x` the turns that `like` has more of, as turns by kNothing, where their cosines are 1.
void turn_alike(FixedRotation& x, const FixedRotation& like) {
  std::vector<AxisRotation<double>> turns;
  std::size_t own = 0;
  for (const AxisRotation<double>& turn : like.turns) {
    if (own < x.turns.size() && x.turns[own].axis == turn.axis) {
      turns.push_back(x.turns[own++]);
    } else if (turn.c == 1.0) {
      turns.push_back({turn.axis, 1.0, kNothing, 2.0});
    } else {
      return;
    }
  }
  if (own == x.turns.size()) x.turns = std::move(turns);
}

// What descriptions round differs between limbs that are alike: an axis that is off by 1e-9 takes a
// turn that the other limb does not need. There it becomes one that changes no digit, so that the
// same operations serve both.
void match_rounding(Mechanism& mechanism) {
  for (const LimbPair& limbs : mechanism.limbs) {
    for (std::size_t k = 0; k < limbs.first.size(); ++k) {
      FixedPlacement& a = mechanism.joints[static_cast<std::size_t>(limbs.first[k])].in_parent;
      FixedPlacement& b = mechanism.joints[static_cast<std::size_t>(limbs.second[k])].in_parent;
      if (a.R.from == b.R.from) {
        turn_alike(a.R, b.R);
        turn_alike(b.R, a.R);
      }
      for (std::size_t i = 0; i < 3; ++i) {
        if (a.p[i] == 0.0 && std::abs(b.p[i]) < kRounded) a.p[i] = b.p[i] == 0.0 ? 0.0 : kNothing;
        if (b.p[i] == 0.0 && std::abs(a.p[i]) < kRounded) b.p[i] = a.p[i] == 0.0 ? 0.0 : kNothing;
      }
    }
  }
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

// What make_mechanism works on.
struct Maker {
  const Tree& tree;
  const ModelSpec& spec;
  std::vector<Placement> frames;        // chosen frame of each body, in the description's
  std::vector<int> site_link;           // per site
  std::vector<RoundedMoments> moments;  // per body, as described
  Mechanism result;

  // A placement that is given in a body's described frame, in its chosen one.
  FixedPlacement in_frame(int body, const Placement& in_described) const {
    return fixed_placement(inverse(frames[body]) * in_described,
                           in_described.p.norm() + frames[body].p.norm());
  }
  // The moments of a link or body, in a body's chosen frame.
  RoundedMoments moments_in(int body, const Inertia& in_described, double size) const {
    return moments_of(in_described, inverse(frames[body]), size + frames[body].p.norm());
  }
  double size_of(int body) const;
  void bodies();
  void coordinates();
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
  }
  coordinates();
  for (std::size_t b = 0; b < tree.bodies.size(); ++b) {
    const bool moves = b > 0 || tree.floating_base;
    const Inertia inertia = moves ? tree.bodies[b].inertia : Inertia{};
    moments.push_back(moments_in(static_cast<int>(b), inertia, size_of(static_cast<int>(b))));
    result.true_moments.push_back(without_noise(moments.back()));
    result.mass_kg += inertia.mass_kg;
  }
}

// How far a body's links reach from its described frame.
double Maker::size_of(int body) const {
  double size = 0.0;
  for (const Link& link : tree.links)
    if (link.body == body && link.inertia.mass_kg > 0.0)
      size = std::max(size, link.in_body.p.norm() + link.inertia.com_m.norm());
  return size;
}

// Leaders are numbered in the tree's order; a follower may stand before its leader.
void Maker::coordinates() {
  result.coordinate_of.resize(tree.joints.size());
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    if (tree.joints[j].follows()) continue;
    result.coordinate_of[j].index = result.coordinates++;
    result.joint_names.push_back(tree.joints[j].name);
  }
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    const Joint& joint = tree.joints[j];
    if (!joint.follows()) continue;
    const int index = result.coordinate_of[static_cast<std::size_t>(joint.leader)].index;
    result.coordinate_of[j] = {index, joint.multiplier, joint.offset};
  }
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
    const Placement in_link = placement_of(site.xyz_m, site.rpy_rad);
    const int body = tree.links[link].body;
    result.sites.push_back({body, in_frame(body, tree.links[link].in_body * in_link), -1});
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
  RoundedMoments masses;
  for (std::size_t i = static_cast<std::size_t>(first); i < tree.links.size(); ++i) {
    const Link& link = tree.links[i];
    beyond[i] = static_cast<int>(i) == first || (link.parent >= 0 && beyond[link.parent]);
    if (!beyond[i]) continue;
    if (link.body == sensor.body)
      add_to(masses, moments_in(sensor.body, link.in_body * link.inertia, size_of(link.body)));
    const bool starts_here = link.moving >= 0 && static_cast<int>(i) != first;
    if (starts_here && tree.joints[link.moving].parent == sensor.body)
      sensor.joints.push_back(link.moving);
  }
  sensor.beyond = without_noise(masses);
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
    return fail(user + ": link '" + spec_of.frame_link + "' turns against both sides of joint '" +
                    spec_of.joint + "'",
                "name a link that is fixed to what the joint carries, or to what carries it");
  }
  gather_beyond(first, sensor);
  sensor.in_body = in_frame(tree.links[frame].body, tree.links[frame].in_body);
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

Result<Mechanism> make_mechanism(const Tree& tree, const ModelSpec& spec, Frames frames) {
  const bool chosen = frames == Frames::kFewestOperations;
  Maker maker{tree, spec, chosen ? align_frames(tree) : described_frames(tree), {}, {}, {}};
  maker.bodies();
  maker.result.limbs = find_limb_pairs(tree);
  if (Status status = maker.armature(); !status) return std::unexpected(status.error());
  if (Status status = maker.sites(); !status) return std::unexpected(status.error());
  if (Status status = maker.sensors(); !status) return std::unexpected(status.error());
  if (chosen) {
    regroup(maker.result, std::move(maker.moments));
    match_rounding(maker.result);
  } else {
    maker.result.moments = maker.result.true_moments;
  }
  return std::move(maker.result);
}

}  // namespace tandem::model
