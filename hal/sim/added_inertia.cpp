// Newton and Euler with the added moments alone, all in W about its origin: nothing has to be
// shifted between bodies. Featherstone (2008), chapters 2, 5 and 6.
#include "hal/sim/added_inertia.hpp"

#include <algorithm>

#include "hal/sim/cholesky.hpp"

namespace tandem::sim {
namespace {

void add_scaled(Vec3& to, double factor, const Vec3& v) noexcept {
  for (std::size_t i = 0; i < 3; ++i) to[i] += factor * v[i];
}

}  // namespace

AddedInertia::AddedInertia(const tandem_kernels& kernels)
    : kernels_(&kernels), base_(kernels.floating_base != 0 ? 6 : 0) {
  armature_.assign(kernels.joints, 0.0);
  rest_.assign(kernels.nv, 0.0);
  bias_.assign(kernels.nv, 0.0);
  M_.assign(std::size_t{kernels.nv} * kernels.nv, 0.0);
}

AddedInertia::AddedInertia(const tandem_kernels& kernels, const hal::RobotConfig& robot,
                           const model::Tree& described, const model::Tree& actual)
    : AddedInertia(kernels) {
  motion_ = TreeMotion(described, kernels);
  const std::size_t bodies = motion_.bodies().size();
  for (const model::Link& link : described.links) {
    places_.push_back(
        {static_cast<std::size_t>(link.body), mat3(link.in_body.R), vec3(link.in_body.p)});
  }
  link_.resize(places_.size());
  body_.resize(bodies);
  composite_.resize(bodies);
  velocity_.resize(bodies);
  acceleration_.resize(bodies);
  base_axes_.resize(base_);
  body_force_.assign(6 * bodies, 0.0);
  for (std::size_t l = 0; l < actual.links.size(); ++l) {
    const model::Inertia& now = actual.links[l].inertia;
    const model::Inertia& before = described.links[l].inertia;
    if (now.mass_kg == before.mass_kg && now.com_m == before.com_m &&
        now.about_com_kg_m2 == before.about_com_kg_m2) {
      continue;
    }
    add({l, now}, 1.0);
    add({l, before}, -1.0);
  }
  own_ = link_;
  own_any_ = any_;
  add_sensors(robot, described);
}

void AddedInertia::add_sensors(const hal::RobotConfig& robot, const model::Tree& tree) {
  for (const hal::SensorConfig& sensor : robot.sensors) {
    sensors_.emplace_back();
    const int first = tree.child_link_index(sensor.joint), frame = tree.link_index(sensor.link);
    if (sensor.type != hal::SensorType::kForceTorque || first < 0 || frame < 0) continue;
    sensors_.back().frame = places_[static_cast<std::size_t>(frame)];
    for (std::size_t l = 0; l < tree.links.size(); ++l)
      sensors_.back().beyond.push_back(is_beyond(tree, static_cast<int>(l), first) ? 1 : 0);
  }
}

void AddedInertia::add_armature(std::size_t joint, double more_kg_m2) {
  if (more_kg_m2 == 0.0) return;
  armature_[joint] += more_kg_m2;
  any_ = own_any_ = 1;
}

void AddedInertia::let_go() noexcept TANDEM_RT {
  link_ = own_;  // of one size: nothing is allocated
  std::ranges::fill(body_, Moments{});
  added_kg_ = 0.0;
  for (std::size_t l = 0; l < link_.size(); ++l) {
    const std::size_t body = places_[l].body;
    model::add_to(body_[body], link_[l]);
    if (body > 0 || base_ != 0) added_kg_ += link_[l].m;
  }
  any_ = own_any_;
}

void AddedInertia::carry(const Load& load) noexcept TANDEM_RT {
  if (load.link < places_.size()) add(load, 1.0);
}

void AddedInertia::add(const Load& load, double sign) noexcept {
  const Place& at = places_[load.link];
  Moments more = placed(at.R, at.p, moments_of(load.in_link));
  more.m *= sign;
  for (double& h : more.h) h *= sign;
  for (double& J : more.J.entry) J *= sign;
  model::add_to(link_[load.link], more);
  model::add_to(body_[at.body], more);
  if (at.body > 0 || base_ != 0) added_kg_ += more.m;
  any_ = 1;
}

/// J = sum m r r^T about the frame's origin: half the trace less the inertia.
AddedInertia::Moments AddedInertia::moments_of(const model::Inertia& inertia) noexcept {
  const Eigen::Vector3d& c = inertia.com_m;
  const Eigen::Matrix3d& I = inertia.about_com_kg_m2;
  const Eigen::Matrix3d J =
      0.5 * I.trace() * Eigen::Matrix3d::Identity() - I + inertia.mass_kg * (c * c.transpose());
  Moments x;
  x.m = inertia.mass_kg;
  for (int i = 0; i < 3; ++i) {
    x.h[static_cast<std::size_t>(i)] = inertia.mass_kg * c(i);
    for (int k = 0; k <= i; ++k) x.J(i, k) = J(i, k);
  }
  return x;
}

/// From a frame to the one that it stands in: turned by R, its origin at p.
AddedInertia::Moments AddedInertia::placed(const Mat3& R, const Vec3& p,
                                           const Moments& x) noexcept {
  const Vec3 h = rotate(R.data(), x.h.data());
  Mat3 J{};  // R J
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      for (int n = 0; n < 3; ++n)
        J[static_cast<std::size_t>(3 * i + k)] +=
            R[static_cast<std::size_t>(3 * i + n)] * x.J(n, k);
  Moments moved;
  moved.m = x.m;
  for (std::size_t i = 0; i < 3; ++i) moved.h[i] = h[i] + x.m * p[i];
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k <= i; ++k) {
      const double turned =
          J[3 * i] * R[3 * k] + J[3 * i + 1] * R[3 * k + 1] + J[3 * i + 2] * R[3 * k + 2];
      moved.J(static_cast<int>(i), static_cast<int>(k)) =
          turned + p[i] * h[k] + h[i] * p[k] + x.m * p[i] * p[k];
    }
  }
  return moved;
}

AddedInertia::Spatial AddedInertia::force_of(const Moments& x, const Spatial& a) noexcept {
  const double trace = x.J(0, 0) + x.J(1, 1) + x.J(2, 2);
  const Vec3 turning = cross(a.angular, x.h), lever = cross(x.h, a.linear);
  Spatial force;
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    force.linear[at] = x.m * a.linear[at] + turning[at];
    force.angular[at] = lever[at] + trace * a.angular[at] - x.J(i, 0) * a.angular[0] -
                        x.J(i, 1) * a.angular[1] - x.J(i, 2) * a.angular[2];
  }
  return force;
}

/// D a + v x* D v
AddedInertia::Spatial AddedInertia::needed(const Moments& x, const Spatial& velocity,
                                           const Spatial& acceleration) noexcept {
  Spatial force = force_of(x, acceleration);
  const Spatial momentum = force_of(x, velocity);
  add_scaled(force.linear, 1.0, cross(velocity.angular, momentum.linear));
  add_scaled(force.angular, 1.0, cross(velocity.angular, momentum.angular));
  add_scaled(force.angular, 1.0, cross(velocity.linear, momentum.linear));
  return force;
}

double AddedInertia::power(const Spatial& a, const Spatial& b) noexcept {
  return dot(a.linear, b.linear.data()) + dot(a.angular, b.angular.data());
}

/// The twist of a unit rate of the joint.
AddedInertia::Spatial AddedInertia::along(std::size_t joint) const noexcept {
  const TreeMotion::BodyMotion& body = motion_.bodies()[joint + 1];
  if (motion_.joints()[joint].prismatic) return {body.axis, {}};
  return {cross(body.p, body.axis), body.axis};
}

void AddedInertia::place(const double* q, const double* v) noexcept {
  motion_.place(q, v);
  for (std::size_t b = 0; b < velocity_.size(); ++b) {
    const TreeMotion::BodyMotion& body = motion_.bodies()[b];
    velocity_[b] = {sum(body.v, cross(body.p, body.w)), body.w};
  }
  const TreeMotion::BodyMotion& base = motion_.bodies()[0];
  for (std::size_t i = 0; i < base_axes_.size(); ++i) {
    const Vec3 axis{base.R[i % 3], base.R[3 + i % 3], base.R[6 + i % 3]};
    base_axes_[i] = i < 3 ? Spatial{axis, {}} : Spatial{cross(base.p, axis), axis};
  }
}

/// Those of every body less gravity. Null: of the velocities alone.
void AddedInertia::accelerate(const double* vdot) noexcept {
  Spatial& base = acceleration_[0];
  base = {};
  add_scaled(base.linear, -1.0,
             {kernels_->gravity_m_s2[0], kernels_->gravity_m_s2[1], kernels_->gravity_m_s2[2]});
  for (std::size_t i = 0; vdot != nullptr && i < base_axes_.size(); ++i) {
    add_scaled(base.linear, vdot[i], base_axes_[i].linear);
    add_scaled(base.angular, vdot[i], base_axes_[i].angular);
  }
  for (std::size_t j = 0; j < motion_.joints().size(); ++j) {
    const TreeMotion::JointFrame& joint = motion_.joints()[j];
    const Spatial& carrier = velocity_[joint.parent];
    const Spatial axis = along(j);
    Spatial own = velocity_[j + 1];  // the joint's part
    add_scaled(own.linear, -1.0, carrier.linear);
    add_scaled(own.angular, -1.0, carrier.angular);
    Spatial& a = acceleration_[j + 1];
    a = acceleration_[joint.parent];
    add_scaled(a.linear, 1.0, cross(carrier.angular, own.linear));
    add_scaled(a.linear, 1.0, cross(carrier.linear, own.angular));
    add_scaled(a.angular, 1.0, cross(carrier.angular, own.angular));
    if (vdot == nullptr) continue;
    const double rate = joint.multiplier * vdot[base_ + joint.coordinate];
    add_scaled(a.linear, rate, axis.linear);
    add_scaled(a.angular, rate, axis.angular);
  }
}

/// Adds what the added moments need to `tau`. @pre accelerate()
void AddedInertia::add_forces(double* tau) noexcept {
  for (std::size_t b = 0; b < body_.size(); ++b) {
    const TreeMotion::BodyMotion& body = motion_.bodies()[b];
    const Spatial force = needed(placed(body.R, body.p, body_[b]), velocity_[b], acceleration_[b]);
    std::ranges::copy(force.linear, body_force_.begin() + static_cast<std::ptrdiff_t>(6 * b));
    std::ranges::copy(force.angular, body_force_.begin() + static_cast<std::ptrdiff_t>(6 * b + 3));
  }
  if (!body_.empty()) motion_.add_generalized(body_force_.data(), tau);
}

/// From the tips to the base: each joint's column is what all beyond it needs. @pre place()
void AddedInertia::add_composites(double* M) noexcept {
  const std::size_t nv = kernels_->nv;
  const auto both = [&](std::size_t i, std::size_t k, double value) {
    M[i * nv + k] += value;
    M[k * nv + i] += value;
  };
  for (std::size_t b = 0; b < body_.size(); ++b) {
    const TreeMotion::BodyMotion& body = motion_.bodies()[b];
    composite_[b] = placed(body.R, body.p, body_[b]);
  }
  for (std::size_t j = motion_.joints().size(); j-- > 0;) {
    const TreeMotion::JointFrame& joint = motion_.joints()[j];
    const std::size_t at = base_ + joint.coordinate;
    const Spatial axis = along(j);
    const Spatial force = force_of(composite_[j + 1], axis);
    M[at * nv + at] += joint.multiplier * joint.multiplier * power(axis, force);
    for (std::size_t b = joint.parent; b > 0; b = motion_.joints()[b - 1].parent) {
      const TreeMotion::JointFrame& other = motion_.joints()[b - 1];
      both(at, base_ + other.coordinate,
           joint.multiplier * other.multiplier * power(along(b - 1), force));
    }
    for (std::size_t i = 0; i < base_; ++i)
      both(at, i, joint.multiplier * power(base_axes_[i], force));
    model::add_to(composite_[joint.parent], composite_[j + 1]);
  }
  for (std::size_t i = 0; i < base_axes_.size(); ++i) {
    const Spatial force = force_of(composite_[0], base_axes_[i]);
    for (std::size_t k = 0; k < base_; ++k) M[i * nv + k] += power(base_axes_[k], force);
  }
}

void AddedInertia::add_to_mass_matrix(const double* q, double* M) noexcept TANDEM_RT {
  if (!any()) return;
  if (!body_.empty()) {
    place(q, rest_.data());
    add_composites(M);
  }
  const std::size_t nv = kernels_->nv;
  for (std::size_t j = 0; j < armature_.size(); ++j)
    M[(base_ + j) * nv + base_ + j] += armature_[j];
}

void AddedInertia::forward_dynamics(const double* sines, const double* q, const double* v,
                                    const double* tau, const double* wrench,
                                    double* vdot) noexcept TANDEM_RT {
  if (!any()) return kernels_->forward_dynamics_at(sines, q, v, tau, wrench, vdot);
  const std::size_t nv = kernels_->nv;
  kernels_->mass_matrix_at(sines, q, M_.data());
  add_to_mass_matrix(q, M_.data());
  inverse_dynamics(sines, q, v, rest_.data(), wrench, bias_.data());
  for (std::size_t i = 0; i < nv; ++i) vdot[i] = tau[i] - bias_[i];
  cholesky(M_, nv);
  solve_cholesky(M_, nv, vdot);
}

void AddedInertia::inverse_dynamics(const double* sines, const double* q, const double* v,
                                    const double* vdot, const double* wrench,
                                    double* tau) noexcept TANDEM_RT {
  kernels_->inverse_dynamics_at(sines, q, v, vdot, wrench, tau);
  if (!any()) return;
  for (std::size_t j = 0; j < armature_.size(); ++j)
    tau[base_ + j] += armature_[j] * vdot[base_ + j];
  if (body_.empty()) return;
  place(q, v);
  accelerate(vdot);
  add_forces(tau);
}

void AddedInertia::add_to_center_of_mass(const double* q, double* c) noexcept TANDEM_RT {
  if (!any() || body_.empty()) return;
  place(q, rest_.data());
  for (std::size_t i = 0; i < 3; ++i) c[i] *= kernels_->mass_kg;
  for (std::size_t b = base_ != 0 ? 0 : 1; b < body_.size(); ++b) {
    const TreeMotion::BodyMotion& body = motion_.bodies()[b];
    const Moments at = placed(body.R, body.p, body_[b]);
    for (std::size_t i = 0; i < 3; ++i) c[i] += at.h[i];
  }
  for (std::size_t i = 0; i < 3; ++i) c[i] /= mass_kg();
}

void AddedInertia::add_beyond(std::size_t sensor, const double* q, const double* v,
                              const double* vdot, double* channels) noexcept TANDEM_RT {
  if (!any() || sensor >= sensors_.size() || sensors_[sensor].beyond.empty()) return;
  const auto& [frame, beyond] = sensors_[sensor];
  place(q, v);
  accelerate(vdot);
  Spatial felt;
  for (std::size_t l = 0; l < link_.size(); ++l) {
    if (beyond[l] == 0) continue;
    const std::size_t b = places_[l].body;
    const TreeMotion::BodyMotion& body = motion_.bodies()[b];
    const Spatial force = needed(placed(body.R, body.p, link_[l]), velocity_[b], acceleration_[b]);
    add_scaled(felt.linear, -1.0, force.linear);  // it pushes back
    add_scaled(felt.angular, -1.0, force.angular);
  }
  const TreeMotion::BodyMotion& body = motion_.bodies()[frame.body];
  const Mat3 R = product(body.R, frame.R);
  const Vec3 p = sum(body.p, rotate(body.R.data(), frame.p.data()));
  add_scaled(felt.angular, -1.0, cross(p, felt.linear));
  const Vec3 f = rotate_back(R.data(), felt.linear.data());
  const Vec3 n = rotate_back(R.data(), felt.angular.data());
  for (std::size_t i = 0; i < 3; ++i) {
    channels[i] += f[i];
    channels[3 + i] += n[i];
  }
}

}  // namespace tandem::sim
