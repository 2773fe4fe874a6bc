#include "tests/support/sums_over_links.hpp"

#include <tuple>

namespace tandem::model {
namespace {

template <class M>
std::vector<double> flat_rows(const M& m) {
  std::vector<double> result;
  for (int i = 0; i < m.rows(); ++i)
    for (int j = 0; j < m.cols(); ++j) result.push_back(static_cast<double>(m(i, j)));
  return result;
}

template <class V>
void append(std::vector<double>& list, const V& v) {
  for (int i = 0; i < v.size(); ++i) list.push_back(static_cast<double>(v[i]));
}

Eigen::Matrix<Real, 3, 3> rotation(const Eigen::Matrix<Real, 3, 1>& axis, Real angle) {
  return Eigen::AngleAxis<Real>(angle, axis).toRotationMatrix();
}

RealVector real(std::span<const double> x) {
  RealVector result(static_cast<int>(x.size()));
  for (std::size_t i = 0; i < x.size(); ++i) result[static_cast<int>(i)] = x[i];
  return result;
}

}  // namespace

SumsOverLinks::SumsOverLinks(const Tree& tree, const ModelSpec& spec, std::span<const double> q,
                             std::span<const double> v)
    : tree_(tree), spec_(spec), v_(real(v)) {
  for (int k = 0; k < 3; ++k) gravity_[k] = spec.gravity_m_s2[static_cast<std::size_t>(k)];
  armature_ = RealVector::Zero(tree.nv());
  const int base = tree.floating_base ? 6 : 0;
  for (const auto& [name, value] : spec.armature) armature_[base + tree.joint_index(name)] = value;
  place_bodies(q);
  move_bodies();
  for (std::size_t i = 0; i < tree.links.size(); ++i) {
    const Link& link = tree.links[i];
    if (link.inertia.mass_kg == 0.0 || (link.body == 0 && !tree.floating_base)) continue;
    const Frame at = on_link(static_cast<int>(i), nullptr);
    const Vector3 com = at.p + at.R * link.inertia.com_m.cast<Real>();
    masses_.push_back({link.inertia.mass_kg, com,
                       at.R * link.inertia.about_com_kg_m2.cast<Real>() * at.R.transpose(),
                       link.body, static_cast<int>(i), jacobian(link.body, com),
                       jacobian_rate_times_v(link.body, com)});
    total_ += link.inertia.mass_kg;
  }
}

void SumsOverLinks::place_bodies(std::span<const double> q) {
  bodies_.assign(tree_.bodies.size(), {});
  std::size_t first = 0;
  if (tree_.floating_base) {
    first = 7;
    for (int i = 0; i < 3; ++i) bodies_[0].p[i] = q[static_cast<std::size_t>(i)];
    bodies_[0].R = Eigen::Quaternion<Real>(q[6], q[3], q[4], q[5]).toRotationMatrix();
    for (int k = 0; k < 6; ++k)
      columns_.push_back({0, k < 3, bodies_[0].R.col(k % 3), bodies_[0].p});
  }
  for (std::size_t j = 0; j < tree_.joints.size(); ++j) {
    const Joint& joint = tree_.joints[j];
    const Frame& parent = bodies_[static_cast<std::size_t>(joint.parent)];
    Frame& body = bodies_[j + 1];
    body.body = static_cast<int>(j) + 1;
    body.R = parent.R * joint.in_parent.R.cast<Real>();
    body.p = parent.p + parent.R * joint.in_parent.p.cast<Real>();
    const Vector3 axis = joint.axis.cast<Real>().normalized();
    const bool slides = joint.type == JointType::kPrismatic;
    columns_.push_back({body.body, slides, body.R * axis, body.p});
    if (slides) body.p += body.R * axis * Real(q[first + j]);
    if (!slides) body.R = body.R * rotation(axis, q[first + j]);
  }
}

bool SumsOverLinks::moves(int body, const Column& column) const {
  while (body > column.body) body = tree_.joints[static_cast<std::size_t>(body) - 1].parent;
  return body == column.body;
}

// The time derivatives of axes and points: each is fixed to the body that carries its joint.
void SumsOverLinks::move_bodies() {
  angular_.assign(bodies_.size(), Vector3::Zero());
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    for (std::size_t k = 0; k < columns_.size(); ++k)
      if (!columns_[k].slides && moves(static_cast<int>(b), columns_[k]))
        angular_[b] += columns_[k].axis * v_[static_cast<int>(k)];
  for (Column& column : columns_) {
    const auto body = static_cast<std::size_t>(column.body);
    const int carrier = body == 0 ? 0 : tree_.joints[body - 1].parent;
    column.axis_rate = angular_[static_cast<std::size_t>(carrier)].cross(column.axis);
    column.point_rate = velocity_of(carrier, column.point);
  }
}

SumsOverLinks::Frame SumsOverLinks::on_link(int index, const SiteSpec* site) const {
  const Link& link = tree_.links[static_cast<std::size_t>(index)];
  const Frame& body = bodies_[static_cast<std::size_t>(link.body)];
  Frame frame{body.R * link.in_body.R.cast<Real>(), body.p + body.R * link.in_body.p.cast<Real>(),
              link.body};
  if (site == nullptr) return frame;
  const Vector3 xyz(site->xyz_m[0], site->xyz_m[1], site->xyz_m[2]);
  frame.p += frame.R * xyz;
  frame.R = frame.R * rotation(Vector3::UnitZ(), site->rpy_rad[2]) *
            rotation(Vector3::UnitY(), site->rpy_rad[1]) *
            rotation(Vector3::UnitX(), site->rpy_rad[0]);
  return frame;
}

SumsOverLinks::Vector3 SumsOverLinks::velocity_of(int body, const Vector3& point) const {
  Vector3 sum = Vector3::Zero();
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    const Column& c = columns_[k];
    if (!moves(body, c)) continue;
    sum += (c.slides ? c.axis : Vector3(c.axis.cross(point - c.point))) * v_[static_cast<int>(k)];
  }
  return sum;
}

SumsOverLinks::Jacobian SumsOverLinks::jacobian(int body, const Vector3& point) const {
  Jacobian J = Jacobian::Zero(6, tree_.nv());
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    const Column& c = columns_[k];
    if (!moves(body, c)) continue;
    const int column = static_cast<int>(k);
    J.col(column).head<3>() = c.slides ? c.axis : Vector3(c.axis.cross(point - c.point));
    if (!c.slides) J.col(column).tail<3>() = c.axis;
  }
  return J;
}

Eigen::Matrix<Real, 6, 1> SumsOverLinks::jacobian_rate_times_v(int body,
                                                               const Vector3& point) const {
  const Vector3 point_rate = velocity_of(body, point);
  Eigen::Matrix<Real, 6, 1> sum = Eigen::Matrix<Real, 6, 1>::Zero();
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    const Column& c = columns_[k];
    if (!moves(body, c)) continue;
    const Real rate = v_[static_cast<int>(k)];
    if (c.slides) {
      sum.head<3>() += c.axis_rate * rate;
    } else {
      sum.head<3>() +=
          (c.axis_rate.cross(point - c.point) + c.axis.cross(point_rate - c.point_rate)) * rate;
      sum.tail<3>() += c.axis_rate * rate;
    }
  }
  return sum;
}

RealMatrix SumsOverLinks::mass_matrix() const {
  RealMatrix M = RealMatrix::Zero(tree_.nv(), tree_.nv());
  for (const Mass& mass : masses_) {
    std::vector<int> moving;  // columns that move this link
    for (int k = 0; k < mass.J.cols(); ++k)
      if (!mass.J.col(k).isZero(0)) moving.push_back(k);
    for (const int i : moving) {
      const Vector3 force = mass.kg * mass.J.col(i).head<3>();
      const Vector3 moment = mass.inertia * mass.J.col(i).tail<3>();
      for (const int j : moving)
        M(i, j) += force.dot(mass.J.col(j).head<3>()) + moment.dot(mass.J.col(j).tail<3>());
    }
  }
  M.diagonal() += armature_;
  return M;
}

RealVector SumsOverLinks::bias() const {
  RealVector h = RealVector::Zero(tree_.nv());
  for (const Mass& mass : masses_) {
    const auto& [J, rate] = std::tie(mass.J, mass.Jdot_v);
    const Vector3& w = angular_[static_cast<std::size_t>(mass.body)];
    const Vector3 force = mass.kg * (rate.head<3>() - gravity_);
    const Vector3 moment = mass.inertia * rate.tail<3>() + w.cross(mass.inertia * w);
    h += J.topRows<3>().transpose() * force + J.bottomRows<3>().transpose() * moment;
  }
  return h;
}

RealVector SumsOverLinks::external(std::span<const double> wrench) const {
  RealVector sum = RealVector::Zero(tree_.nv());
  std::size_t next = 0;
  for (const SiteSpec& site : spec_.sites) {
    if (!site.wrench) continue;
    const Frame at = on_link(tree_.link_index(site.link), &site);
    const RealVector f = real(wrench.subspan(next, 6));
    next += 6;
    const Jacobian J = jacobian(at.body, at.p);
    sum += J.topRows<3>().transpose() * (at.R * f.head<3>()) +
           J.bottomRows<3>().transpose() * (at.R * f.tail<3>());
  }
  return sum;
}

// M v, and with Mdot v = sum Jdot^T (m c', I w) + sum J^T d/dt (m c', I w at v = const) what is
// left of it less the bias: the time derivatives of the bodies' momenta cancel.
std::vector<std::vector<double>> SumsOverLinks::generalised_momentum(
    std::span<const double> wrench) const {
  RealVector b = external(wrench);
  for (const Mass& mass : masses_) {
    const Vector3 velocity = velocity_of(mass.body, mass.com);
    const Vector3 linear = mass.kg * velocity;
    const Vector3 angular = mass.inertia * angular_[static_cast<std::size_t>(mass.body)];
    b += mass.J.topRows<3>().transpose() * (mass.kg * gravity_);
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      const Column& c = columns_[k];
      if (!moves(mass.body, c)) continue;
      Real& entry = b[static_cast<int>(k)];
      if (c.slides) {
        entry += c.axis_rate.dot(linear);
      } else {
        entry += (c.axis_rate.cross(mass.com - c.point) + c.axis.cross(velocity - c.point_rate))
                     .dot(linear) +
                 c.axis_rate.dot(angular);
      }
    }
  }
  return {flat_rows(mass_matrix() * v_), flat_rows(b)};
}

RealVector SumsOverLinks::inverse_dynamics(std::span<const double> vdot,
                                           std::span<const double> wrench) const {
  return mass_matrix() * real(vdot) + bias() - external(wrench);
}

RealVector SumsOverLinks::forward_dynamics(std::span<const double> tau,
                                           std::span<const double> wrench) const {
  const RealMatrix M = mass_matrix();
  const RealVector rest = real(tau) + external(wrench) - bias();
  // Scaled to a unit diagonal: masses over six decades are no matter of condition.
  const RealVector scale = M.diagonal().cwiseSqrt().cwiseInverse();
  const RealMatrix scaled = scale.asDiagonal() * M * scale.asDiagonal();
  return scale.cwiseProduct(scaled.ldlt().solve(scale.cwiseProduct(rest)));
}

std::vector<std::vector<double>> SumsOverLinks::center_of_mass() const {
  Vector3 com = Vector3::Zero();
  RealMatrix J = RealMatrix::Zero(3, tree_.nv());
  for (const Mass& mass : masses_) {
    com += mass.kg / total_ * mass.com;
    J += mass.kg / total_ * mass.J.topRows<3>();
  }
  return {flat_rows(com), flat_rows(J * v_), flat_rows(J)};
}

std::vector<double> SumsOverLinks::momentum() const {
  Vector3 com = Vector3::Zero();
  for (const Mass& mass : masses_) com += mass.kg / total_ * mass.com;
  Vector3 linear = Vector3::Zero();
  Vector3 angular = Vector3::Zero();
  for (const Mass& mass : masses_) {
    const Vector3 p = mass.kg * velocity_of(mass.body, mass.com);
    linear += p;
    angular +=
        (mass.com - com).cross(p) + mass.inertia * angular_[static_cast<std::size_t>(mass.body)];
  }
  std::vector<double> result;
  append(result, linear);
  append(result, angular);
  return result;
}

std::vector<double> SumsOverLinks::energy() const {
  Real kinetic = Real(0.5) * v_.dot(armature_.cwiseProduct(v_));
  Real potential = 0;
  for (const Mass& mass : masses_) {
    const Vector3& w = angular_[static_cast<std::size_t>(mass.body)];
    kinetic += Real(0.5) *
               (mass.kg * velocity_of(mass.body, mass.com).squaredNorm() + w.dot(mass.inertia * w));
    potential -= mass.kg * gravity_.dot(mass.com);
  }
  return {static_cast<double>(kinetic), static_cast<double>(potential)};
}

std::vector<std::vector<double>> SumsOverLinks::site_motion(std::span<const double> vdot) const {
  std::vector<std::vector<double>> result(3);
  for (const SiteSpec& site : spec_.sites) {
    const Frame at = on_link(tree_.link_index(site.link), &site);
    const Jacobian J = jacobian(at.body, at.p);
    const std::vector<double> R = flat_rows(at.R);
    result[0].insert(result[0].end(), R.begin(), R.end());
    append(result[0], at.p);
    append(result[1], J * v_);
    append(result[2], J * real(vdot) + jacobian_rate_times_v(at.body, at.p));
  }
  return result;
}

std::vector<double> SumsOverLinks::site_jacobians() const {
  std::vector<double> result;
  for (const SiteSpec& site : spec_.sites) {
    const Frame at = on_link(tree_.link_index(site.link), &site);
    const std::vector<double> J = flat_rows(jacobian(at.body, at.p));
    result.insert(result.end(), J.begin(), J.end());
  }
  return result;
}

std::vector<double> SumsOverLinks::sensors(std::span<const double> vdot,
                                           std::span<const double> wrench) const {
  std::vector<double> result;
  for (const SensorSpec& sensor : spec_.sensors) {
    const int first = tree_.child_link_index(sensor.joint);
    const Frame at = on_link(tree_.link_index(sensor.frame_link), nullptr);
    const auto beyond = [&](int link) {
      while (link > first) link = tree_.links[static_cast<std::size_t>(link)].parent;
      return link == first;
    };
    Vector3 force = Vector3::Zero();  // on the parent's side, about the sensor's origin
    Vector3 moment = Vector3::Zero();
    for (const Mass& mass : masses_) {
      if (!beyond(mass.link)) continue;
      const Vector3& w = angular_[static_cast<std::size_t>(mass.body)];
      const Eigen::Matrix<Real, 6, 1> a = mass.J * real(vdot) + mass.Jdot_v;
      const Vector3 f = mass.kg * (a.head<3>() - gravity_);
      force -= f;
      moment -= (mass.com - at.p).cross(f) + mass.inertia * a.tail<3>() + w.cross(mass.inertia * w);
    }
    std::size_t next = 0;
    for (const SiteSpec& site : spec_.sites) {
      if (!site.wrench) continue;
      const RealVector external = real(wrench.subspan(next, 6));
      next += 6;
      const int link = tree_.link_index(site.link);
      if (!beyond(link)) continue;
      const Frame where = on_link(link, &site);
      const Vector3 f = where.R * external.head<3>();
      force += f;
      moment += where.R * external.tail<3>() + (where.p - at.p).cross(f);
    }
    append(result, at.R.transpose() * force);
    append(result, at.R.transpose() * moment);
  }
  return result;
}

std::vector<std::vector<double>> SumsOverLinks::outputs(
    Kernel kernel, const std::vector<std::vector<double>>& in) const {
  switch (kernel) {
    case Kernel::kForwardDynamics: return {flat_rows(forward_dynamics(in[2], in[3]))};
    case Kernel::kInverseDynamics: return {flat_rows(inverse_dynamics(in[2], in[3]))};
    case Kernel::kMassMatrix: return {flat_rows(mass_matrix())};
    case Kernel::kBias: return {flat_rows(bias())};
    case Kernel::kCenterOfMass: return center_of_mass();
    case Kernel::kCentroidalMomentum: return {momentum()};
    case Kernel::kEnergy: return {energy()};
    case Kernel::kSiteMotion: return site_motion(in[2]);
    case Kernel::kSiteTwists: {
      auto motion = site_motion(std::vector<double>(in[1].size()));
      motion.pop_back();
      return motion;
    }
    case Kernel::kSiteJacobians: return {site_jacobians()};
    case Kernel::kSensorWrenches: return {sensors(in[2], in[3])};
    case Kernel::kGeneralisedMomentum: return generalised_momentum(in[2]);
    case Kernel::kInverseDynamicsDerivatives:
    case Kernel::kForwardDynamicsDerivatives: break;  // tests take differences
  }
  return {};
}

}  // namespace tandem::model
