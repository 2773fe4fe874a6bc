// Motions down the tree, then each piece's six by ten matrix up to the base.
#include "identification/regressor.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "base/nearest.hpp"

namespace tandem::identification {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d skew(const Vector3d& v) {
  Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// I v = K(v) (ixx ixy ixz iyy iyz izz)
Eigen::Matrix<double, 3, 6> inertia_times(const Vector3d& v) {
  Eigen::Matrix<double, 3, 6> K;
  K << v.x(), v.y(), v.z(), 0.0, 0.0, 0.0,  //
      0.0, v.x(), 0.0, v.y(), v.z(), 0.0,   //
      0.0, 0.0, v.x(), 0.0, v.y(), v.z();
  return K;
}

/// Force and moment about the frame's origin, by the ten parameters, in the frame's axes.
Eigen::Matrix<double, 6, 10> newton_euler(const Vector3d& w, const Vector3d& al,
                                          const Vector3d& a) {
  Eigen::Matrix<double, 6, 10> A = Eigen::Matrix<double, 6, 10>::Zero();
  A.block<3, 1>(0, 0) = a;
  A.block<3, 3>(0, 1) = skew(al) + skew(w) * skew(w);
  A.block<3, 3>(3, 1) = -skew(a);
  A.block<3, 6>(3, 4) = inertia_times(al) + skew(w) * inertia_times(w);
  return A;
}

/// Forces given in frame B at its origin, in the frame A that B stands in.
template <class Forces>
Forces carried(const Matrix3d& R, const Vector3d& p, const Forces& in) {
  Forces out;
  out.template topRows<3>() = R * in.template topRows<3>();
  out.template bottomRows<3>() =
      R * in.template bottomRows<3>() + skew(p) * out.template topRows<3>();
  return out;
}

const char* const kComponents[] = {"force x",  "force y",  "force z",
                                   "moment x", "moment y", "moment z"};

}  // namespace

bool Regressor::is_beyond(int link, const std::string& joint) const {
  for (int at = link; at >= 0; at = tree_->links[at].parent)
    if (tree_->links[at].joint == joint && !joint.empty()) return true;
  return false;
}

Result<Regressor> Regressor::create(const model::Tree& tree, const RegressorSpec& spec) {
  Regressor regressor(tree);
  regressor.coordinate_.assign(tree.joints.size(), -1);
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    if (tree.joints[j].follows()) continue;
    regressor.coordinate_[j] = static_cast<int>(regressor.coordinates_.size());
    regressor.coordinates_.push_back(tree.joints[j].name);
  }
  for (std::size_t j = 0; j < tree.joints.size(); ++j)
    if (tree.joints[j].follows())
      regressor.coordinate_[j] = regressor.coordinate_[tree.joints[j].leader];
  if (const Status s = regressor.take_sensors(spec); !s) return std::unexpected(s.error());
  regressor.make_pieces();
  regressor.make_channels(spec);
  regressor.bodies_.resize(tree.bodies.size());
  return regressor;
}

Status Regressor::take_sensors(const RegressorSpec& spec) {
  for (const model::SensorSpec& one : spec.sensors) {
    const int child = tree_->child_link_index(one.joint);
    const int link = tree_->link_index(one.frame_link);
    if (child < 0 || link < 0) {
      return fail("the sensor '" + one.name + "' measures the joint '" + one.joint + "' in '" +
                      one.frame_link + "', which the description lacks",
                  "correct `joint` and `link` of [[sensor]]");
    }
    Sensor sensor;
    sensor.top = tree_->links[child].body;
    sensor.moving = tree_->links[child].moving >= 0;
    sensor.body = tree_->links[link].body;
    sensor.frame = tree_->links[link].in_body;
    for (const std::string& ground : spec.ground_links)
      sensor.cuts = sensor.cuts || is_beyond(tree_->link_index(ground), one.joint);
    sensors_.push_back(sensor);
    sensor_names_.push_back(one.name);
    sensor_joints_.push_back(one.joint);
  }
  for (const std::string& ground : spec.ground_links) {
    const int link = tree_->link_index(ground);
    bool measured = !tree_->floating_base;
    for (std::size_t s = 0; s < sensors_.size(); ++s)
      measured = measured || is_beyond(link, sensor_joints_[s]);
    if (measured) continue;
    return fail("the ground acts on the link '" + ground + "', and no force/torque sensor says how",
                "identification of a floating base needs a six-axis sensor between every foot and "
                "the body; of a robot without them hold the base (base = \"fixed\")");
  }
  beyond_.resize(tree_->links.size());
  for (std::size_t l = 0; l < tree_->links.size(); ++l)
    for (std::size_t s = 0; s < sensors_.size(); ++s)
      if (is_beyond(static_cast<int>(l), sensor_joints_[s]))
        beyond_[l].push_back(static_cast<int>(s));
  return {};
}

void Regressor::make_pieces() {
  const auto& links = tree_->links;
  std::vector<bool> taken(links.size(), false);
  for (std::size_t first = 0; first < links.size(); ++first) {
    if (taken[first] || links[first].inertia.mass_kg <= 0.0) continue;
    const auto cut = [&](int s) { return sensors_[s].cuts; };
    std::vector<std::size_t> group;
    for (std::size_t l = first; l < links.size(); ++l) {
      if (links[l].body != links[first].body || beyond_[l] != beyond_[first]) continue;
      taken[l] = true;
      if (links[l].inertia.mass_kg > 0.0) group.push_back(l);
    }
    const std::size_t main = *std::ranges::max_element(
        group, {}, [&](std::size_t l) { return links[l].inertia.mass_kg; });
    const bool rests = !tree_->floating_base && links[main].body == 0 && beyond_[first].empty();
    if (std::ranges::any_of(beyond_[first], cut) || rests) {
      for (const std::size_t l : group) unseen_.push_back(static_cast<int>(l));
      continue;
    }
    Piece piece{links[main].body, static_cast<int>(main), links[main].in_body,
                LinkParameters::Zero(), beyond_[first]};
    const model::Placement& in_body = piece.in_body;
    const model::Placement back{in_body.R.transpose(), -(in_body.R.transpose() * in_body.p)};
    for (const std::size_t l : group)
      if (l != main) piece.rest += parameters_of(back * links[l].in_body * links[l].inertia);
    pieces_.push_back(std::move(piece));
  }
}

void Regressor::make_channels(const RegressorSpec& spec) {
  using Kind = Channel::Kind;
  if (tree_->floating_base) {
    for (int i = 0; i < 6; ++i)
      channels_.push_back({Kind::kBase, 0, i, std::string("base ") + kComponents[i]});
  }
  joint_row_.assign(coordinates_.size(), -1);
  for (std::size_t c = 0; c < coordinates_.size(); ++c) {
    const int joint = tree_->joint_index(coordinates_[c]);
    const int link = tree_->child_link_index(coordinates_[c]);
    bool seen =
        std::ranges::find(spec.without_torque, coordinates_[c]) == spec.without_torque.end();
    for (std::size_t s = 0; s < sensors_.size() && link >= 0; ++s) {
      const bool itself = sensor_joints_[s] == tree_->joints[joint].name;
      seen = seen && !(sensors_[s].cuts && !itself && is_beyond(link, sensor_joints_[s]));
    }
    if (!seen) continue;
    joint_row_[c] = static_cast<int>(channels_.size());
    channels_.push_back({Kind::kJoint, static_cast<int>(c), 0, "joint " + coordinates_[c]});
  }
  for (std::size_t s = 0; s < sensors_.size(); ++s) {
    if (sensors_[s].cuts) continue;
    sensors_[s].row = static_cast<int>(channels_.size());
    for (int i = 0; i < 6; ++i)
      channels_.push_back({Kind::kSensor, static_cast<int>(s), i,
                           "sensor " + sensor_names_[s] + " " + kComponents[i]});
  }
}

Eigen::VectorXd Regressor::described() const {
  Eigen::VectorXd p(columns());
  for (std::size_t i = 0; i < pieces_.size(); ++i)
    p.segment<10>(10 * static_cast<Eigen::Index>(i)) =
        parameters_of(tree_->links[pieces_[i].link].inertia);
  return p;
}

void Regressor::place(const Instant& at) {
  for (std::size_t j = 0; j < tree_->joints.size(); ++j) {
    const model::Joint& joint = tree_->joints[j];
    const double q = joint.multiplier * at.q[coordinate_[j]] + joint.offset;
    Moving& body = bodies_[j + 1];
    body.R = joint.in_parent.R;
    body.p = joint.in_parent.p;
    if (joint.type == model::JointType::kPrismatic) {
      body.p += joint.in_parent.R * joint.axis * q;
    } else {
      body.R = body.R * Eigen::AngleAxisd(q, joint.axis).toRotationMatrix();
    }
  }
}

void Regressor::move(const Instant& at) {
  bodies_[0].w = at.w;
  bodies_[0].al = at.al;
  bodies_[0].a = at.a;
  for (std::size_t j = 0; j < tree_->joints.size(); ++j) {
    const model::Joint& joint = tree_->joints[j];
    const Moving& parent = bodies_[static_cast<std::size_t>(joint.parent)];
    Moving& body = bodies_[j + 1];
    const Vector3d v = joint.multiplier * at.v[coordinate_[j]] * joint.axis;
    const Vector3d vdot = joint.multiplier * at.vdot[coordinate_[j]] * joint.axis;
    const auto back = body.R.transpose();
    body.w = back * parent.w;
    body.al = back * parent.al;
    body.a = back * (parent.a + parent.al.cross(body.p) + parent.w.cross(parent.w.cross(body.p)));
    if (joint.type == model::JointType::kPrismatic) {
      body.a += 2.0 * body.w.cross(v) + vdot;
    } else {
      body.al += body.w.cross(v) + vdot;
      body.w += v;
    }
  }
}

Regressor::Wrenches Regressor::needed(const Piece& piece) const {
  const Moving& body = bodies_[static_cast<std::size_t>(piece.body)];
  const auto& [R, p] = piece.in_body;
  const auto back = R.transpose();
  const Vector3d a = back * (body.a + body.al.cross(p) + body.w.cross(body.w.cross(p)));
  Wrenches forces;
  forces.leftCols<10>() = newton_euler(back * body.w, back * body.al, a);
  forces.col(10) = forces.leftCols<10>() * piece.rest;
  return carried(R, p, forces);
}

void Regressor::climb(int body, Wrenches forces, const Piece* piece, Eigen::Index column,
                      Eigen::MatrixXd& Y, Eigen::VectorXd& known) const {
  const auto add = [&](int row, double factor, const Eigen::Matrix<double, 1, 11>& values) {
    if (piece != nullptr) Y.block<1, 10>(row, column) += factor * values.leftCols<10>();
    known[row] += factor * values[10];
  };
  for (int b = body;; b = tree_->joints[static_cast<std::size_t>(b - 1)].parent) {
    for (std::size_t s = 0; piece != nullptr && s < piece->beyond.size(); ++s) {
      const Sensor& sensor = sensors_[static_cast<std::size_t>(piece->beyond[s])];
      if (sensor.body != b || sensor.row < 0) continue;
      const Matrix3d back = sensor.frame.R.transpose();
      const Wrenches seen = carried(back, -(back * sensor.frame.p), forces);
      for (int i = 0; i < 6; ++i) add(sensor.row + i, -1.0, seen.row(i));
    }
    if (b == 0) break;
    const auto j = static_cast<std::size_t>(b - 1);
    const model::Joint& joint = tree_->joints[j];
    const int first = joint.type == model::JointType::kPrismatic ? 0 : 3;
    const int row = joint_row_[static_cast<std::size_t>(coordinate_[j])];
    if (row >= 0) add(row, joint.multiplier, joint.axis.transpose() * forces.middleRows<3>(first));
    forces = carried(bodies_[static_cast<std::size_t>(b)].R, bodies_[static_cast<std::size_t>(b)].p,
                     forces);
  }
  for (int i = 0; tree_->floating_base && i < 6; ++i) add(i, 1.0, forces.row(i));
}

void Regressor::evaluate(const Instant& at, Eigen::MatrixXd& Y, Eigen::VectorXd& known) {
  place(at);
  move(at);
  Y.setZero(static_cast<Eigen::Index>(channels_.size()), columns());
  known.setZero(static_cast<Eigen::Index>(channels_.size()));
  for (std::size_t i = 0; i < pieces_.size(); ++i)
    climb(pieces_[i].body, needed(pieces_[i]), &pieces_[i], 10 * static_cast<Eigen::Index>(i), Y,
          known);
  for (std::size_t s = 0; s < sensors_.size(); ++s) {
    const Sensor& sensor = sensors_[s];
    if (!sensor.cuts) continue;
    Wrenches forces = Wrenches::Zero();
    forces.col(10) = -at.wrenches[s];
    forces = carried(sensor.frame.R, sensor.frame.p, forces);
    if (sensor.moving && sensor.body != sensor.top) {  // measured on the near side of its joint
      const Moving& far = bodies_[static_cast<std::size_t>(sensor.top)];
      const Matrix3d back = far.R.transpose();
      forces = carried(back, -(back * far.p), forces);
    }
    climb(sensor.moving ? sensor.top : sensor.body, forces, nullptr, 0, Y, known);
  }
}

void Regressor::base_from_link(int link, const Vector3d& w, const Vector3d& al, const Vector3d& a,
                               Instant& at) {
  place(at);
  const model::Link& on = tree_->links[static_cast<std::size_t>(link)];
  const auto& [R, p] = on.in_body;
  at.w = R * w;
  at.al = R * al;
  at.a = R * a - at.al.cross(p) - at.w.cross(at.w.cross(p));
  for (int b = on.body; b > 0;) {
    const auto j = static_cast<std::size_t>(b - 1);
    const model::Joint& joint = tree_->joints[j];
    const Moving& body = bodies_[static_cast<std::size_t>(b)];
    const Vector3d v = joint.multiplier * at.v[coordinate_[j]] * joint.axis;
    const Vector3d vdot = joint.multiplier * at.vdot[coordinate_[j]] * joint.axis;
    if (joint.type == model::JointType::kPrismatic) {
      at.a -= 2.0 * at.w.cross(v) + vdot;
    } else {
      at.w -= v;
      at.al -= at.w.cross(v) + vdot;
    }
    at.w = body.R * at.w;
    at.al = body.R * at.al;
    at.a = body.R * at.a - at.al.cross(body.p) - at.w.cross(at.w.cross(body.p));
    b = joint.parent;
  }
}

}  // namespace tandem::identification
