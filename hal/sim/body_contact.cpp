// Points are tested only when a bound on the distance travelled has used up the clearance. Their
// forces are summed from the tips to the base, without a Jacobian.
#include "hal/sim/body_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::sim {
namespace {

constexpr double kStiffShare = 0.4, kDampedShare = 0.3;  // of 1 / h and m / h
constexpr double kTogether = 4.0;                        // points on the ground at once
// What the bound on the way leaves out: projections onto closed loops, stages of Runge-Kutta.
constexpr double kMargin_m = 0.001;

/// Below the ground that stands where it starts, vertically.
double depth_m(const hal::ContactConfig& config, const Vec3& at) noexcept {
  const double level_m = config.height_m - at[2];
  return config.terrain.level() ? level_m : level_m + config.terrain.at(at[0], at[1]).height_m;
}

double length_1(const double* v) noexcept {
  return std::abs(v[0]) + std::abs(v[1]) + std::abs(v[2]);
}

}  // namespace

BodyContact::BodyContact(const hal::RobotConfig& robot, const model::Tree& tree,
                         const tandem_kernels& kernels, const double* q,
                         std::span<const PostureInertia> postures, std::int64_t substep_ns)
    : config_(robot.contact) {
  if (!(config_.stiffness_N_m > 0.0)) return;
  motion_ = TreeMotion(tree, kernels);
  body_force_.assign(6 * motion_.bodies().size(), 0.0);
  for (const model::Link& link : tree.links) names_.push_back(link.name);
  generalized_.assign(kernels.nv, 0.0);
  const std::vector<double> rest(kernels.nv, 0.0);
  motion_.place(q, rest.data());
  add_groups(tree, link_points(robot, tree));
  add_reach(tree);
  add_sensors(robot, tree);
  fit(kernels, postures, substep_ns);
  anchor_x_.assign(points_.size(), 0.0);
  anchor_y_.assign(points_.size(), 0.0);
  anchored_.assign(points_.size(), 0);
  groups_force_.assign(6 * groups_.size(), 0.0);
}

void BodyContact::add_groups(const model::Tree& tree, const std::vector<LinkPoints>& points) {
  for (const LinkPoints& one : points) {
    const model::Link& link = tree.links[one.link];
    const auto body = static_cast<std::size_t>(link.body);
    Group group{one.link, body, points_.size(), points_.size(), {}, 0.0};
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& point : one.in_body_m) {
      const Vec3 at = rotate(motion_.bodies()[body].R.data(), vec3(point).data());
      if (depth_m(config_, sum(motion_.bodies()[body].p, at)) > 0.0) continue;
      points_.push_back(vec3(point));
      center += point;
    }
    group.end = points_.size();
    if (group.end == group.begin) continue;
    center /= static_cast<double>(group.end - group.begin);
    group.center = vec3(center);
    for (std::size_t i = group.begin; i < group.end; ++i) {
      const Eigen::Vector3d point(points_[i].data());
      group.radius = std::max(group.radius, (point - center).norm());
    }
    groups_.push_back(group);
  }
}

/// How far any point of a body, or beyond it, is from the body's origin, in any posture.
void BodyContact::add_reach(const model::Tree& tree) {
  std::vector<double> reach(motion_.bodies().size(), 0.0);
  for (const Group& group : groups_) {
    const double at = Eigen::Vector3d(group.center.data()).norm() + group.radius;
    reach[group.body] = std::max(reach[group.body], at);
  }
  reach_m_.assign(generalized_.size() - (motion_.floating() ? 6 : 0), 0.0);
  for (std::size_t j = motion_.joints().size(); j-- > 0;) {
    const TreeMotion::JointFrame& joint = motion_.joints()[j];
    const double beyond = reach[j + 1];
    if (!(beyond > 0.0)) continue;
    const model::Joint& described = tree.joints[j];
    double to_parent = beyond + Eigen::Vector3d(joint.p.data()).norm();
    if (joint.prismatic) {
      to_parent += std::max(std::abs(described.lower), std::abs(described.upper));  // NaN, too
    }
    reach[joint.parent] = std::max(reach[joint.parent], to_parent);
    reach_m_[joint.coordinate] += std::abs(joint.multiplier) * (joint.prismatic ? 1.0 : beyond);
  }
  base_reach_m_ = reach[0];
}

void BodyContact::add_sensors(const hal::RobotConfig& robot, const model::Tree& tree) {
  sensors_.resize(robot.sensors.size());
  for (std::size_t s = 0; s < sensors_.size(); ++s) {
    const hal::SensorConfig& sensor = robot.sensors[s];
    const int first = tree.child_link_index(sensor.joint), frame = tree.link_index(sensor.link);
    if (sensor.type != hal::SensorType::kForceTorque || first < 0 || frame < 0) continue;
    const model::Link& link = tree.links[static_cast<std::size_t>(frame)];
    Beyond& beyond = sensors_[s];
    beyond = {static_cast<std::size_t>(link.body), mat3(link.in_body.R), vec3(link.in_body.p), {}};
    for (const Group& group : groups_) {
      beyond.group.push_back(is_beyond(tree, static_cast<int>(group.link), first) ? 1 : 0);
    }
  }
}

void BodyContact::fit(const tandem_kernels& kernels, std::span<const PostureInertia> postures,
                      std::int64_t substep_ns) {
  const double h_s = static_cast<double>(substep_ns) * 1e-9;
  const std::size_t base = motion_.floating() ? 6 : 0;
  const std::vector<double> rest(kernels.nv, 0.0);
  std::vector<double> mass(points_.size(), std::numeric_limits<double>::infinity());
  for (const PostureInertia& posture : postures) {
    motion_.place(posture.q.data(), rest.data());
    for (const Group& group : groups_) {
      for (std::size_t i = group.begin; i < group.end; ++i) {
        PointJacobian J = PointJacobian::Zero(kernels.nv, 3);
        const Vec3 lever = rotate(motion_.bodies()[group.body].R.data(), points_[i].data());
        const Vec3 at = sum(motion_.bodies()[group.body].p, lever);
        const auto to = [&at](const TreeMotion::BodyMotion& body) -> Vec3 {
          return {at[0] - body.p[0], at[1] - body.p[1], at[2] - body.p[2]};
        };
        for (std::size_t body = group.body; body > 0; body = motion_.joints()[body - 1].parent) {
          const TreeMotion::JointFrame& joint = motion_.joints()[body - 1];
          const Vec3& axis = motion_.bodies()[body].axis;
          const Vec3 way = joint.prismatic ? axis : cross(axis, to(motion_.bodies()[body]));
          J.row(static_cast<Eigen::Index>(base + joint.coordinate)) +=
              joint.multiplier * Eigen::RowVector3d(way.data());
        }
        for (std::size_t axis = 0; axis < base / 2; ++axis) {
          const Mat3& R = motion_.bodies()[0].R;
          const Vec3 along{R[axis], R[3 + axis], R[6 + axis]};
          J.row(static_cast<Eigen::Index>(axis)) = Eigen::RowVector3d(along.data());
          J.row(static_cast<Eigen::Index>(3 + axis)) =
              Eigen::RowVector3d(cross(along, to(motion_.bodies()[0])).data());
        }
        mass[i] = std::min(mass[i], point_mass(posture, J));
      }
    }
  }
  for (const double m : mass) {
    const double stiffest = m * (kStiffShare / h_s) * (kStiffShare / h_s) / kTogether;
    const double damped = kDampedShare * m / h_s / kTogether;
    ground_.push_back(
        {.stiffness_N_m = std::min(config_.stiffness_N_m, stiffest),
         .damping_s_m = config_.damping_s_m,
         .most_damping_Ns_m = damped,
         .tangential_stiffness_N_m = std::min(config_.tangential_stiffness_N_m, stiffest),
         .tangential_damping_Ns_m = std::min(config_.tangential_damping_Ns_m, damped)});
  }
}

void BodyContact::moved(const double* v, double h_s) noexcept TANDEM_RT {
  if (groups_.empty()) return;
  double speed = 0.0;
  if (motion_.floating()) {
    speed = length_1(v) + base_reach_m_ * length_1(v + 3);
    v += 6;
  }
  for (std::size_t i = 0; i < reach_m_.size(); ++i) speed += reach_m_[i] * std::abs(v[i]);
  step_m_ = h_s * (speed + config_.terrain.fastest_m_s());
  clearance_m_ -= step_m_;
}

void BodyContact::evaluate(const double* q, const double* v, bool move_anchors) noexcept TANDEM_RT {
  touching_ = 0;
  if (groups_.empty() || clearance_m_ > kMargin_m + 2.0 * step_m_) return;
  motion_.place(q, v);
  energy_J_ = 0.0;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const Group& group = groups_[g];
    const TreeMotion::BodyMotion& body = motion_.bodies()[group.body];
    const double clearance =
        config_.terrain.level()
            ? body.p[2] + dot({body.R[6], body.R[7], body.R[8]}, group.center.data()) -
                  group.radius - config_.height_m
            : clearance_m(sum(body.p, rotate(body.R.data(), group.center.data())), group.radius);
    nearest_m = std::min(nearest_m, clearance);
    double* force = groups_force_.data() + 6 * g;
    std::fill_n(force, 6, 0.0);
    if (clearance < 0.0) {
      touch(group, force, move_anchors);
    } else if (move_anchors) {
      std::fill(anchored_.begin() + static_cast<std::ptrdiff_t>(group.begin),
                anchored_.begin() + static_cast<std::ptrdiff_t>(group.end), std::uint8_t{0});
    }
  }
  if (move_anchors) clearance_m_ = nearest_m;
  if (touching_ != 0) generalize();
}

Vec3 BodyContact::on_ground(const Vec3& at) const noexcept {
  return {at[0] - moved_.position_m[0], at[1] - moved_.position_m[1], at[2] - moved_.position_m[2]};
}

/// At least so far a ball has to move before it touches terrain: no place is steeper than the
/// steepest.
double BodyContact::clearance_m(const Vec3& center, double radius) const noexcept {
  const double steepest = config_.terrain.steepest();
  return -depth_m(config_, on_ground(center)) / std::sqrt(1.0 + steepest * steepest) - radius;
}

void BodyContact::touch(const Group& group, double* force, bool move_anchors) noexcept {
  const TreeMotion::BodyMotion& body = motion_.bodies()[group.body];
  for (std::size_t i = group.begin; i < group.end; ++i) {
    const Vec3 lever = rotate(body.R.data(), points_[i].data());
    const Vec3 at = sum(body.p, lever);
    const Vec3 rate = sum(body.v, cross(body.w, lever));
    if (depth_m(config_, on_ground(at)) > 0.0) ++touching_;
    const std::array<double, 3> f =
        ground_force(config_, moved_, ground_[i], {at[0], at[1], at[2], rate[0], rate[1], rate[2]},
                     move_anchors, {&anchor_x_[i], &anchor_y_[i], &anchored_[i]}, energy_J_);
    const Vec3 moment = cross(at, f);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      force[axis] += f[axis];
      force[3 + axis] += moment[axis];
    }
  }
}

/// The groups' forces as generalized ones.
void BodyContact::generalize() noexcept {
  std::ranges::fill(generalized_, 0.0);
  std::ranges::fill(body_force_, 0.0);
  for (std::size_t g = 0; g < groups_.size(); ++g)
    for (std::size_t i = 0; i < 6; ++i)
      body_force_[6 * groups_[g].body + i] += groups_force_[6 * g + i];
  motion_.add_generalized(body_force_.data(), generalized_.data());
}

void BodyContact::add_forces(double* forces) const noexcept TANDEM_RT {
  for (std::size_t i = 0; i < generalized_.size(); ++i) forces[i] += generalized_[i];
}

void BodyContact::add_beyond(std::size_t sensor, double* channels) const noexcept TANDEM_RT {
  if (touching_ == 0 || sensors_[sensor].group.empty()) return;
  const Beyond& beyond = sensors_[sensor];
  Vec3 force{}, moment{};
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    if (beyond.group[g] == 0) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      force[i] += groups_force_[6 * g + i];
      moment[i] += groups_force_[6 * g + 3 + i];
    }
  }
  const TreeMotion::BodyMotion& body = motion_.bodies()[beyond.body];
  const Mat3 R = product(body.R, beyond.R);
  const Vec3 moved = cross(sum(body.p, rotate(body.R.data(), beyond.p.data())), force);
  for (std::size_t i = 0; i < 3; ++i) moment[i] -= moved[i];
  const Vec3 f = rotate_back(R.data(), force.data()), m = rotate_back(R.data(), moment.data());
  for (std::size_t i = 0; i < 3; ++i) {
    channels[i] += f[i];
    channels[3 + i] += m[i];
  }
}

double BodyContact::vertical_force_N() const noexcept {
  double force = 0.0;
  for (std::size_t g = 0; g < groups_.size(); ++g) force += groups_force_[6 * g + 2];
  return force;
}

bool BodyContact::touching(const std::string& link) const noexcept {
  for (std::size_t g = 0; g < groups_.size(); ++g)
    if (names_[groups_[g].link] == link && groups_force_[6 * g + 2] > 0.0) return true;
  return false;
}

}  // namespace tandem::sim
