// ODE: every body moves by itself, joints and contacts hold them together; stepped by dWorldStep(),
// which solves them exactly (the "big matrix" method). Layer: hal/sim/engines.  Thread: one.
#include <ode/ode.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <numbers>
#include <stdexcept>

#include "hal/sim/engine.hpp"
#include "hal/sim/engines/masses.hpp"

namespace tandem::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

static_assert(sizeof(dReal) == sizeof(double));

Quaterniond turn_by(const Vector3d& angle) {
  const double size = angle.norm();
  return size > 0.0 ? Quaterniond(Eigen::AngleAxisd(size, angle / size)) : Quaterniond::Identity();
}

// Contacts whose rows depend on one another (four points of a sole) need a little give; joints of a
// tree need none.
constexpr double kContactCfm = 1e-10;
// What sank in is pushed out slowly, as in the demonstrations of ODE: soles start in the ground.
constexpr double kMostCorrecting_m_s = 0.1;
// How deep a point may rest. Without it contacts are made and broken in turn.
constexpr double kSurfaceLayer_m = 1e-4;

class Ode final : public Engine {
 public:
  static Result<std::unique_ptr<Engine>> create(const EngineModel& model) {
    if (const Status masses = check_masses(model.tree, "ODE", true); !masses)
      return std::unexpected(masses.error());
    return std::make_unique<Ode>(model);
  }

  explicit Ode(const EngineModel& model) : model_(model), base_(model.tree.floating_base ? 1 : 0) {
    dInitODE2(0);
    // ODE prints what its solver cannot do, and ends the program when an assertion fails.
    dSetMessageHandler([](int, const char*, va_list) {});
    dSetDebugHandler([](int, const char*, va_list) { throw std::runtime_error("ODE"); });
    dSetErrorHandler([](int, const char*, va_list) { throw std::runtime_error("ODE"); });
    world_ = dWorldCreate();
    group_ = dJointGroupCreate(0);
    const auto& [x, y, z] = model.gravity_m_s2;
    dWorldSetGravity(world_, x, y, z);
    dWorldSetCFM(world_, 0.0);
    dWorldSetContactMaxCorrectingVel(world_, kMostCorrecting_m_s);
    dWorldSetContactSurfaceLayer(world_, kSurfaceLayer_m);
    bodies_.resize(model.tree.bodies.size());
    angle_.resize(model.tree.joints.size());
    rate_.resize(angle_.size());
    axis_.resize(angle_.size());
    add_bodies();
    add_joints();
    ground_ = dCreatePlane(nullptr, 0.0, 0.0, 1.0, model.ground_m - EngineModel::kRadius_m);
    add_points();
  }

  ~Ode() override {
    for (dGeomID point : points_) dGeomDestroy(point);
    dGeomDestroy(ground_);
    dJointGroupDestroy(group_);
    dWorldDestroy(world_);
    dCloseODE();
  }

  void set_state(const double* q, const double* v) override {
    std::copy_n(q + 7 * base_, angle_.size(), angle_.begin());
    std::copy_n(v + 6 * base_, rate_.size(), rate_.begin());
    place(q);
    spread(v, 0.0);
    fresh_ = 1;
  }

  void step(double step_s, const double* tau, double* q, double* v, double* forces_W) override {
    const auto nv = static_cast<Eigen::Index>(6 * base_ + angle_.size());
    try {
      if (!Eigen::Map<const Eigen::VectorXd>(tau, nv).allFinite()) throw std::range_error("torque");
      advance(step_s, tau, forces_W);
      read_state(q, v);
    } catch (const std::exception&) {  // it lost its way: the plant ends the run
      give_up();
      std::fill_n(v, nv, std::numeric_limits<double>::quiet_NaN());
      std::fill_n(forces_W, 3 * points_.size(), 0.0);
    }
  }

  // ODE has none of its own: the limit of its own steps, which get shorter, from the same state.
  void accelerations(const double* q, const double* v, const double* tau, double* vdot) override {
    constexpr double kShortest_s = 2e-6;
    const auto nv = static_cast<Eigen::Index>(6 * base_ + angle_.size());
    const Eigen::Map<const Eigen::VectorXd> before(v, nv);
    std::vector<double> moved(7 * base_ + angle_.size());
    Eigen::VectorXd after(nv), rate[3];
    dWorldSetERP(world_, 0.0);
    for (int i = 0; i < 3; ++i) {
      const double step_s = kShortest_s * (1 << i);
      set_state(q, v);
      advance(step_s, tau, nullptr);
      read_state(moved.data(), after.data());
      rate[i] = (after - before) / step_s;
    }
    dWorldSetERP(world_, erp_);
    set_state(q, v);
    // Errors of first and second order in the step go (Richardson).
    Eigen::Map<Eigen::VectorXd>(vdot, nv) = (8.0 * rate[0] - 6.0 * rate[1] + rate[2]) / 3.0;
  }

  void archive(Archive& ar) override { ar(state_, angle_, rate_, fresh_); }

 private:
  // ODE's own state of a body: centre of mass, w x y z, velocities in W.
  struct Moving {
    std::array<double, 3> p;
    std::array<double, 4> turn;
    std::array<double, 3> velocity, rate;
  };
  // A body's frame and velocities in W.
  struct Pose {
    Quaterniond R = Quaterniond::Identity();
    Vector3d p = Vector3d::Zero();                                  // its origin
    Vector3d velocity = Vector3d::Zero(), rate = Vector3d::Zero();  // of the centre of mass
  };

  [[nodiscard]] const Vector3d& com(std::size_t body) const {
    return model_.tree.bodies[body].inertia.com_m;
  }
  [[nodiscard]] bool slides(std::size_t joint) const {
    return model_.tree.joints[joint].type == model::JointType::kPrismatic;
  }

  void add_bodies() {
    state_.resize(bodies_.size());
    for (std::size_t b = 1 - base_; b < bodies_.size(); ++b) {
      const model::Inertia& inertia = model_.tree.bodies[b].inertia;
      const Matrix3d& I = inertia.about_com_kg_m2;
      dMass mass;
      dMassSetParameters(&mass, inertia.mass_kg, 0.0, 0.0, 0.0, I(0, 0), I(1, 1), I(2, 2), I(0, 1),
                         I(0, 2), I(1, 2));
      bodies_[b] = dBodyCreate(world_);
      dBodySetMass(bodies_[b], &mass);
    }
    erp_ = dWorldGetERP(world_);
  }

  // ODE counts positions from where the bodies stand when a joint is made.
  void add_joints() {
    std::vector<double> zero(7 * base_ + angle_.size(), 0.0);
    if (base_ != 0) zero[6] = 1.0;
    place(zero.data());
    load_state();
    for (std::size_t j = 0; j < angle_.size(); ++j) {
      const dBodyID parent = bodies_[model_.tree.joints[j].parent];
      const Pose& pose = poses_[j + 1];
      const Vector3d axis = pose.R * model_.tree.joints[j].axis;
      dJointID joint;
      if (slides(j)) {
        joint = dJointCreateSlider(world_, nullptr);
        dJointAttach(joint, bodies_[j + 1], parent);
        dJointSetSliderAxis(joint, axis.x(), axis.y(), axis.z());
        if (model_.armature_kg_m2[j] > 0.0) dJointSetSliderParam(joint, dParamFMax, dInfinity);
      } else {
        joint = dJointCreateHinge(world_, nullptr);
        dJointAttach(joint, bodies_[j + 1], parent);
        dJointSetHingeAnchor(joint, pose.p.x(), pose.p.y(), pose.p.z());
        dJointSetHingeAxis(joint, axis.x(), axis.y(), axis.z());
        if (model_.armature_kg_m2[j] > 0.0) dJointSetHingeParam(joint, dParamFMax, dInfinity);
      }
      joints_.push_back(joint);
    }
  }

  void add_points() {
    for (const EngineModel::Point& point : model_.points) {
      const Vector3d at = point.in_body_m - com(point.body);
      points_.push_back(dCreateSphere(nullptr, EngineModel::kRadius_m));
      if (bodies_[point.body] == nullptr) continue;  // of a base that is fixed
      dGeomSetBody(points_.back(), bodies_[point.body]);
      dGeomSetOffsetPosition(points_.back(), at.x(), at.y(), at.z());
    }
  }

  // Poses of all bodies from those of the base and the joints' positions.
  void chain(const std::vector<double>& angle) {
    for (std::size_t j = 0; j < angle.size(); ++j) {
      const model::Joint& joint = model_.tree.joints[j];
      const Pose& parent = poses_[joint.parent];
      Pose& pose = poses_[j + 1];
      pose.p = parent.p + parent.R * joint.in_parent.p;
      pose.R = parent.R * Quaterniond(joint.in_parent.R);
      if (slides(j)) {
        pose.p += pose.R * joint.axis * angle[j];
      } else {
        pose.R = pose.R * turn_by(joint.axis * angle[j]);
      }
    }
  }

  void place(const double* q) {
    poses_.assign(bodies_.size(), Pose{});
    if (base_ != 0) {
      poses_[0].p = Eigen::Map<const Vector3d>(q);
      poses_[0].R = Quaterniond(q[6], q[3], q[4], q[5]).normalized();
    }
    chain({q + 7 * base_, q + 7 * base_ + angle_.size()});
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const Pose& pose = poses_[b];
      const Vector3d p = pose.p + pose.R * com(b);
      state_[b] = {.p = {p.x(), p.y(), p.z()},
                   .turn = {pose.R.w(), pose.R.x(), pose.R.y(), pose.R.z()},
                   .velocity = {},
                   .rate = {}};
    }
  }

  // Gives every body the velocity that `v` means; state_ is placed and angle_ read. ODE's steps end
  // with velocities that fit where the joints stood `ago_s` before, at the start of the step.
  void spread(const double* v, double ago_s) {
    poses_.assign(bodies_.size(), Pose{});
    const double* rates = v + 6 * base_;
    if (base_ != 0) {
      const auto& [w, x, y, z] = state_[0].turn;
      const Quaterniond now(w, x, y, z);
      const Eigen::Map<const Vector3d> linear(v), angular(v + 3);
      poses_[0].R = now * turn_by(-ago_s * angular);
      poses_[0].rate = now * angular;
      poses_[0].velocity = now * (linear + angular.cross(com(0)));
    }
    std::vector<double> angle = angle_;
    for (std::size_t j = 0; j < angle.size(); ++j) angle[j] -= ago_s * rates[j];
    chain(angle);
    for (std::size_t j = 0; j < angle.size(); ++j) {
      const std::size_t from = model_.tree.joints[j].parent;
      const Pose& parent = poses_[from];
      Pose& pose = poses_[j + 1];
      const Vector3d along = pose.R * model_.tree.joints[j].axis * rates[j];
      const Vector3d arm = pose.R * com(j + 1);
      pose.rate = parent.rate;
      if (!slides(j)) pose.rate += along;
      const Vector3d origin = pose.p - parent.p - parent.R * com(from);
      pose.velocity = parent.velocity + parent.rate.cross(origin) + pose.rate.cross(arm);
      if (slides(j)) pose.velocity += along;
    }
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      Eigen::Map<Vector3d>(state_[b].velocity.data()) = poses_[b].velocity;
      Eigen::Map<Vector3d>(state_[b].rate.data()) = poses_[b].rate;
    }
  }

  // What ODE keeps of a quaternion is not bit by bit what it was given, so every step starts here.
  void load_state() const {
    for (std::size_t b = 1 - base_; b < bodies_.size(); ++b) {
      const auto& [p, turn, velocity, rate] = state_[b];
      dBodySetPosition(bodies_[b], p[0], p[1], p[2]);
      dBodySetQuaternion(bodies_[b], turn.data());
      dBodySetLinearVel(bodies_[b], velocity[0], velocity[1], velocity[2]);
      dBodySetAngularVel(bodies_[b], rate[0], rate[1], rate[2]);
    }
  }

  void save_state() {
    for (std::size_t b = 1 - base_; b < bodies_.size(); ++b) {
      std::copy_n(dBodyGetPosition(bodies_[b]), 3, state_[b].p.begin());
      std::copy_n(dBodyGetQuaternion(bodies_[b]), 4, state_[b].turn.begin());
      std::copy_n(dBodyGetLinearVel(bodies_[b]), 3, state_[b].velocity.begin());
      std::copy_n(dBodyGetAngularVel(bodies_[b]), 3, state_[b].rate.begin());
    }
  }

  // Without `forces_W` there is no ground.
  void advance(double step_s, const double* tau, double* forces_W) {
    if (fresh_ != 0) {
      std::vector<double> v(6 * base_ + rate_.size());
      read_base(nullptr, v.data());
      std::ranges::copy(rate_, v.begin() + static_cast<std::ptrdiff_t>(6 * base_));
      spread(v.data(), step_s);
      fresh_ = 0;
    }
    load_state();
    load(step_s, tau);
    if (forces_W != nullptr) touch_ground();
    if (dWorldStep(world_, step_s) == 0) throw std::bad_alloc();
    if (forces_W != nullptr) read_forces(forces_W);
    dJointGroupEmpty(group_);
    const std::vector<Moving> before = state_;
    save_state();
    read_rates(before);
  }

  void give_up() {
    dJointGroupEmpty(group_);
    for (std::size_t b = 1 - base_; b < bodies_.size(); ++b) {
      dBodySetForce(bodies_[b], 0.0, 0.0, 0.0);
      dBodySetTorque(bodies_[b], 0.0, 0.0, 0.0);
    }
  }

  void load(double step_s, const double* tau) {
    if (base_ != 0) {
      const Vector3d at = -com(0);
      dBodyAddRelForceAtRelPos(bodies_[0], tau[0], tau[1], tau[2], at.x(), at.y(), at.z());
      dBodyAddRelTorque(bodies_[0], tau[3], tau[4], tau[5]);
    }
    // A rotor pulls by armature x (rate before - rate after) / step: a motor that holds the rate
    // it has, as yielding as that.
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      const double armature = model_.armature_kg_m2[j], force = tau[6 * base_ + j];
      dVector3 axis;
      if (slides(j)) {
        dJointGetSliderAxis(joints_[j], axis);
        dJointAddSliderForce(joints_[j], force);
        dJointSetSliderParam(joints_[j], dParamVel, rate_[j]);
        if (armature > 0.0) dJointSetSliderParam(joints_[j], dParamCFM, step_s / armature);
      } else {
        dJointGetHingeAxis(joints_[j], axis);
        dJointAddHingeTorque(joints_[j], force);
        dJointSetHingeParam(joints_[j], dParamVel, rate_[j]);
        if (armature > 0.0) dJointSetHingeParam(joints_[j], dParamCFM, step_s / armature);
      }
      axis_[j] = Eigen::Map<const Vector3d>(axis);
    }
  }

  void touch_ground() {
    feedback_.assign(points_.size(), {});
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const dBodyID body = bodies_[model_.points[i].body];
      dContact contact{};
      if (body == nullptr ||
          dCollide(points_[i], ground_, 1, &contact.geom, sizeof contact.geom) == 0) {
        continue;
      }
      contact.surface.mode = dContactApprox1 | dContactSoftCFM | dContactSlip1 | dContactSlip2;
      contact.surface.mu = model_.friction;
      contact.surface.soft_cfm = contact.surface.slip1 = contact.surface.slip2 = kContactCfm;
      const dJointID joint = dJointCreateContact(world_, group_, &contact);
      dJointAttach(joint, body, nullptr);
      dJointSetFeedback(joint, &feedback_[i]);
    }
  }

  void read_forces(double* forces_W) const {
    for (std::size_t i = 0; i < points_.size(); ++i)
      std::copy_n(feedback_[i].f1, 3, forces_W + 3 * i);
  }

  // A joint's rate is its child's against its parent's, where they stood when the step began: that
  // is where ODE made the velocities fit the joints.
  void read_rates(const std::vector<Moving>& before) {
    const auto vector = [](const auto& of) { return Eigen::Map<const Vector3d>(of.data()); };
    for (std::size_t j = 0; j < rate_.size(); ++j) {
      const std::size_t parent = model_.tree.joints[j].parent;
      const Moving &a = state_[parent], &b = state_[j + 1];
      if (slides(j)) {
        const Vector3d apart = vector(before[j + 1].p) - vector(before[parent].p);
        rate_[j] =
            axis_[j].dot(vector(b.velocity) - vector(a.velocity) - vector(a.rate).cross(apart));
      } else {
        rate_[j] = axis_[j].dot(vector(b.rate) - vector(a.rate));
      }
    }
  }

  // `q` may be null.
  void read_base(double* q, double* v) const {
    if (base_ == 0) return;
    const auto& [p, turn, velocity, rate] = state_[0];
    const Quaterniond R(turn[0], turn[1], turn[2], turn[3]);
    if (q != nullptr) {
      Eigen::Map<Vector3d>{q} = Eigen::Map<const Vector3d>(p.data()) - R * com(0);
      Eigen::Map<Eigen::Vector4d>{q + 3} = R.coeffs();  // x y z w
    }
    const Vector3d angular = R.conjugate() * Eigen::Map<const Vector3d>(rate.data());
    const Vector3d centre = R.conjugate() * Eigen::Map<const Vector3d>(velocity.data());
    Eigen::Map<Vector3d>{v} = centre - angular.cross(com(0));
    Eigen::Map<Vector3d>{v + 3} = angular;
  }

  void read_state(double* q, double* v) {
    read_base(q, v);
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      if (slides(j)) {
        angle_[j] = dJointGetSliderPosition(joints_[j]);
      } else {  // within half a turn
        const double moved = dJointGetHingeAngle(joints_[j]) - angle_[j];
        angle_[j] += std::remainder(moved, 2.0 * std::numbers::pi);
      }
      q[7 * base_ + j] = angle_[j];
      v[6 * base_ + j] = rate_[j];
    }
  }

  const EngineModel model_;
  const std::size_t base_;  // 1 when it floats
  dWorldID world_ = nullptr;
  dJointGroupID group_ = nullptr;  // the contacts of a step
  dGeomID ground_ = nullptr;
  double erp_ = 0.0;
  std::vector<dBodyID> bodies_;  // null: a base that is fixed
  std::vector<dJointID> joints_;
  std::vector<dGeomID> points_;
  std::vector<dJointFeedback> feedback_;
  std::vector<Pose> poses_;           // scratch
  std::vector<Moving> state_;         // what the bodies are given before a step
  std::vector<double> angle_, rate_;  // of the joints, as last read
  std::vector<Vector3d> axis_;        // in W, when the step began
  std::uint8_t fresh_ = 0;            // velocities do not know their step yet
};

}  // namespace
}  // namespace tandem::sim

TANDEM_ENGINE({.interface = tandem::sim::kEngineInterface,
               .compiler = __VERSION__,
               .name = "ode",
               .version = dODE_VERSION,
               .integrator = "semi-implicit Euler in maximal coordinates (dWorldStep), order 1",
               .settings = "CFM = 0 in joints (default: 1e-10), contacts: Approx1 friction pyramid "
                           "of coefficient mu (default: a force mu), contacts push out at 0.1 m/s "
                           "at most (default: unbounded) and rest 0.1 mm deep (default: 0)",
               .armature = true,
               .rk4 = false,
               .create = tandem::sim::Ode::create})
