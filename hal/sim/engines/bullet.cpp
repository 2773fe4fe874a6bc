// Bullet: the robot as a btMultiBody (Featherstone's algorithm), its soles' points as balls on a
// static plane, in a btMultiBodyDynamicsWorld. Layer: hal/sim/engines.  Thread: one.
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <btBulletCollisionCommon.h>
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>

#include "hal/sim/engine.hpp"

namespace tandem::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

btVector3 bullet(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
btQuaternion bullet(const Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }
Vector3d eigen(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
Quaterniond eigen(const btQuaternion& q) { return {q.w(), q.x(), q.y(), q.z()}; }

/// Bullet's frame of a body in ours: its centre of mass and its principal axes.
struct Principal {
  explicit Principal(const model::Inertia& inertia) {
    if (!(inertia.mass_kg > 0.0)) return;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solved(inertia.about_com_kg_m2);
    frame = {solved.eigenvectors(), inertia.com_m};
    if (frame.R.determinant() < 0.0) frame.R.col(0) *= -1.0;
    moments_kg_m2 = bullet(solved.eigenvalues());
    mass_kg = inertia.mass_kg;
  }
  [[nodiscard]] btVector3 seen(const Vector3d& in_body) const {
    return bullet(frame.R.transpose() * (in_body - frame.p));
  }
  [[nodiscard]] btVector3 turned(const Vector3d& in_body) const {
    return bullet(frame.R.transpose() * in_body);
  }
  model::Placement frame;
  btVector3 moments_kg_m2{0.0, 0.0, 0.0};
  double mass_kg = 0.0;
};

/// Bullet's solver, which also adds up what it gave to every point. Bullet's own copy of the
/// impulses, in its contact points, is for warm starting.
class ContactSolver final : public btMultiBodyConstraintSolver {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();
  /// The number of every link's (the base first) balls, in the order of its compound shape.
  std::vector<std::vector<std::size_t>> balls;
  std::vector<double> impulses_W_Ns;  ///< 3 per point, on the robot

  btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                         const btContactSolverInfo& info) override {
    for (const auto* rows :
         {&m_multiBodyNormalContactConstraints, &m_multiBodyFrictionContactConstraints})
      for (int i = 0; i < rows->size(); ++i) add((*rows)[i]);
    return btMultiBodyConstraintSolver::solveGroupCacheFriendlyFinish(bodies, count, info);
  }

 private:
  void add(const btMultiBodySolverConstraint& row) {
    const auto& contact = *static_cast<const btManifoldPoint*>(row.m_originalContactPoint);
    const bool first = row.m_multiBodyA != nullptr;
    const auto link = static_cast<std::size_t>((first ? row.m_linkA : row.m_linkB) + 1);
    const int ball = first ? contact.m_index0 : contact.m_index1;
    const btVector3& direction = first ? row.m_contactNormal1 : row.m_contactNormal2;
    double* impulse = &impulses_W_Ns[3 * balls[link][static_cast<std::size_t>(ball)]];
    for (int axis = 0; axis < 3; ++axis)
      impulse[axis] += direction[axis] * static_cast<btScalar>(row.m_appliedImpulse);
  }
};

/// Bullet gives a joint that moves no inertia the acceleration zero, and says nothing.
Status check_masses(const model::Tree& tree) {
  std::vector<double> behind(tree.bodies.size());
  for (std::size_t b = tree.bodies.size(); b-- > 0;) {
    behind[b] += tree.bodies[b].inertia.mass_kg;
    const bool fixed = b == 0 && !tree.floating_base;
    if (!fixed && !(behind[b] > 0.0))
      return fail("no mass moves with '" + tree.bodies[b].name + "'", "give it one");
    if (b > 0) behind[static_cast<std::size_t>(tree.joints[b - 1].parent)] += behind[b];
  }
  if (tree.floating_base && !(tree.bodies[0].inertia.mass_kg > 0.0))
    return fail("Bullet wants a mass in a base that moves",
                "give '" + tree.bodies[0].name + "' one");
  return {};
}

class Bullet final : public Engine {
 public:
  static Result<std::unique_ptr<Engine>> create(const EngineModel& model) {
    if (Status massive = check_masses(model.tree); !massive) {
      return std::unexpected(massive.error());
    }
    return std::make_unique<Bullet>(model);
  }

  explicit Bullet(const EngineModel& model)
      : floating_(model.tree.floating_base),
        base_(model.tree.bodies[0].inertia),
        joints_(static_cast<int>(model.tree.joints.size())) {
    make_body(model);
    world_.setGravity(bullet(Vector3d(model.gravity_m_s2.data())));
    // PyBullet's. In a squat of COMAN at 250 us, Bullet's own 10 and 0.2 let the feet slip 14 mm;
    // 50 and 0.2, 1 mm, and its ankles stray by 2.1 degrees after the release.
    world_.getSolverInfo().m_numIterations = 50;
    world_.getSolverInfo().m_erp2 = 0.08;
    world_.addMultiBody(body_.get());
    make_contacts(model);
  }

  ~Bullet() override {
    world_.removeMultiBody(body_.get());
    for (const auto& collider : colliders_) world_.removeCollisionObject(collider.get());
    world_.removeCollisionObject(&ground_);
  }

  void set_state(const double* q, const double* v) override {
    const Matrix3d R =
        floating_ ? Quaterniond(q[6], q[3], q[4], q[5]).toRotationMatrix() : Matrix3d::Identity();
    const Vector3d com_W = R * base_.frame.p;
    body_->setBasePos(bullet(com_W));
    body_->setWorldToBaseRot(bullet(Quaterniond(R * base_.frame.R)).inverse());
    body_->clearVelocities();
    if (floating_) {
      const Vector3d omega_W = R * Eigen::Map<const Vector3d>(v + 3);
      body_->setBasePos(bullet(Eigen::Map<const Vector3d>(q) + com_W));
      body_->setBaseOmega(bullet(omega_W));
      body_->setBaseVel(bullet(R * Eigen::Map<const Vector3d>(v) + omega_W.cross(com_W)));
    }
    for (int i = 0; i < joints_; ++i) {
      body_->setJointPos(i, q[(floating_ ? 7 : 0) + i]);
      body_->setJointVel(i, v[(floating_ ? 6 : 0) + i]);
    }
    place_balls();
  }

  void step(double step_s, const double* tau, double* q, double* v, double* forces_W) override {
    // New contacts in every step: the next one is a function of the archived state alone.
    pairs_.getOverlappingPairCache()->cleanProxyFromPairs(ground_.getBroadphaseHandle(),
                                                          &dispatcher_);
    std::ranges::fill(solver_.impulses_W_Ns, 0.0);
    load(tau);
    world_.stepSimulation(step_s, 0);
    read_state(q, v);
    for (const double impulse : solver_.impulses_W_Ns) *forces_W++ = impulse / step_s;
  }

  void accelerations(const double* q, const double* v, const double* tau, double* vdot) override {
    set_state(q, v);
    load(tau);
    world_.applyGravity();
    const int rates = 6 + joints_;
    const std::vector<double> before(body_->getVelocityVector(),
                                     body_->getVelocityVector() + rates);
    btAlignedObjectArray<btScalar> r;
    btAlignedObjectArray<btVector3> vectors;
    btAlignedObjectArray<btMatrix3x3> matrices;
    constexpr double kStep_s = 1.0;  // the velocities' change is the acceleration
    body_->computeAccelerationsArticulatedBodyAlgorithmMultiDof(kStep_s, r, vectors, matrices,
                                                                false, false, false);
    body_->clearForcesAndTorques();
    std::vector<double> change(body_->getVelocityVector(), body_->getVelocityVector() + rates);
    for (std::size_t i = 0; i < change.size(); ++i) change[i] -= before[i];
    set_state(q, v);
    std::copy(change.begin() + 6, change.end(), vdot + (floating_ ? 6 : 0));
    if (!floating_) return;
    // From the centre of mass in W to the base's origin in its own axes, which turn.
    const Matrix3d to_base = base_turn().transpose();
    const Vector3d angular = Eigen::Map<const Vector3d>(v + 3);
    const Vector3d turning = to_base * Vector3d(change.data());
    Eigen::Map<Vector3d>{vdot} =
        to_base * Vector3d(change.data() + 3) - turning.cross(base_.frame.p) -
        angular.cross(angular.cross(base_.frame.p)) - angular.cross(Eigen::Map<const Vector3d>(v));
    Eigen::Map<Vector3d>{vdot + 3} = turning;
  }

  void archive(Archive& ar) override {
    btVector3 position = body_->getBasePos();
    btQuaternion turn = body_->getWorldToBaseRot();
    btVector3 linear = body_->getBaseVel(), angular = body_->getBaseOmega();
    for (btScalar* values : {&position[0], &linear[0], &angular[0]})
      ar.raw(values, 3 * sizeof(btScalar));
    ar.raw(&turn[0], 4 * sizeof(btScalar));
    body_->setBasePos(position);
    body_->setWorldToBaseRot(turn);
    body_->setBaseVel(linear);
    body_->setBaseOmega(angular);
    for (int i = 0; i < joints_; ++i) {
      btScalar at = body_->getJointPos(i), rate = body_->getJointVel(i);
      ar(at, rate);
      body_->setJointPos(i, at);
      body_->setJointVel(i, rate);
    }
    if (ar.reading()) place_balls();
  }

 private:
  void make_body(const EngineModel& model) {
    const model::Tree& tree = model.tree;
    body_ = std::make_unique<btMultiBody>(joints_, base_.mass_kg, base_.moments_kg_m2, !floating_,
                                          false);
    std::vector<Principal> bodies;
    for (const model::Body& body : tree.bodies) bodies.emplace_back(body.inertia);
    for (int i = 0; i < joints_; ++i) {
      const model::Joint& joint = tree.joints[i];
      const Principal &own = bodies[i + 1], &parent = bodies[joint.parent];
      const btQuaternion turn = bullet(
          Quaterniond(own.frame.R.transpose() * joint.in_parent.R.transpose() * parent.frame.R));
      const auto setup = joint.type == model::JointType::kPrismatic ? &btMultiBody::setupPrismatic
                                                                    : &btMultiBody::setupRevolute;
      (*body_.*setup)(i, own.mass_kg, own.moments_kg_m2, joint.parent - 1, turn,
                      own.turned(joint.axis), parent.seen(joint.in_parent.p),
                      -own.seen(Vector3d::Zero()), true);
    }
    body_->finalizeMultiDof();
    body_->setLinearDamping(0.0);
    body_->setAngularDamping(0.0);
    body_->setHasSelfCollision(false);
    body_->setMaxCoordinateVelocity(1e18);
    body_->clearVelocities();
  }

  void make_contacts(const EngineModel& model) {
    ground_.setCollisionShape(&plane_);
    btTransform below;
    below.setIdentity();
    below.setOrigin(btVector3(0.0, 0.0, model.ground_m - EngineModel::kRadius_m));
    ground_.setWorldTransform(below);
    ground_.setFriction(1.0);  // the coefficients of two bodies are multiplied
    world_.addCollisionObject(&ground_, btBroadphaseProxy::StaticFilter,
                              btBroadphaseProxy::DefaultFilter);
    solver_.impulses_W_Ns.assign(3 * model.points.size(), 0.0);
    solver_.balls.resize(model.tree.bodies.size());
    for (std::size_t b = 0; b < model.tree.bodies.size(); ++b) {
      const Principal principal(model.tree.bodies[b].inertia);
      auto shape = std::make_unique<btCompoundShape>(false);
      for (std::size_t i = 0; i < model.points.size(); ++i) {
        if (model.points[i].body != static_cast<int>(b)) continue;
        btTransform at;
        at.setIdentity();
        at.setOrigin(principal.seen(model.points[i].in_body_m));
        shape->addChildShape(at, &ball_);
        solver_.balls[b].push_back(i);
      }
      if (!solver_.balls[b].empty()) add_collider(static_cast<int>(b) - 1, std::move(shape), model);
    }
  }

  void add_collider(int link, std::unique_ptr<btCompoundShape> shape, const EngineModel& model) {
    auto collider = std::make_unique<btMultiBodyLinkCollider>(body_.get(), link);
    collider->setCollisionShape(shape.get());
    collider->setFriction(model.friction);
    collider->setActivationState(DISABLE_DEACTIVATION);
    world_.addCollisionObject(collider.get(), btBroadphaseProxy::DefaultFilter,
                              btBroadphaseProxy::StaticFilter);
    if (link < 0) {
      body_->setBaseCollider(collider.get());
    } else {
      body_->getLink(link).m_collider = collider.get();
    }
    colliders_.push_back(std::move(collider));
    shapes_.push_back(std::move(shape));
  }

  // A step begins with the balls where the one before left them.
  void place_balls() {
    btAlignedObjectArray<btQuaternion> turns;
    btAlignedObjectArray<btVector3> origins;
    body_->forwardKinematics(turns, origins);
    body_->updateCollisionObjectWorldTransforms(turns, origins);
  }

  /// From the base's frame to W.
  [[nodiscard]] Matrix3d base_turn() const {
    return eigen(body_->getWorldToBaseRot()).conjugate().normalized().toRotationMatrix() *
           base_.frame.R.transpose();
  }

  void load(const double* tau) {
    if (floating_) {
      const Matrix3d R = base_turn();
      const Vector3d force_W = R * Eigen::Map<const Vector3d>(tau);
      body_->addBaseForce(bullet(force_W));
      body_->addBaseTorque(
          bullet(R * Eigen::Map<const Vector3d>(tau + 3) - (R * base_.frame.p).cross(force_W)));
    }
    for (int i = 0; i < joints_; ++i) body_->addJointTorque(i, tau[(floating_ ? 6 : 0) + i]);
  }

  void read_state(double* q, double* v) const {
    if (floating_) {
      const Matrix3d R = base_turn();
      const Vector3d com_W = R * base_.frame.p;
      const Vector3d omega_W = eigen(body_->getBaseOmega());
      const Quaterniond turn(R);
      Eigen::Map<Vector3d>{q} = eigen(body_->getBasePos()) - com_W;
      std::copy_n(turn.coeffs().data(), 4, q + 3);  // x y z w
      Eigen::Map<Vector3d>{v} = R.transpose() * (eigen(body_->getBaseVel()) - omega_W.cross(com_W));
      Eigen::Map<Vector3d>{v + 3} = R.transpose() * omega_W;
    }
    for (int i = 0; i < joints_; ++i) {
      q[(floating_ ? 7 : 0) + i] = body_->getJointPos(i);
      v[(floating_ ? 6 : 0) + i] = body_->getJointVel(i);
    }
  }

  const bool floating_;
  const Principal base_;
  const int joints_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase pairs_;
  ContactSolver solver_;
  btSphereShape ball_{EngineModel::kRadius_m};
  btStaticPlaneShape plane_{btVector3(0.0, 0.0, 1.0), 0.0};
  btCollisionObject ground_;
  std::unique_ptr<btMultiBody> body_;
  std::vector<std::unique_ptr<btCompoundShape>> shapes_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders_;
  btMultiBodyDynamicsWorld world_{&dispatcher_, &pairs_, &solver_, &configuration_};
};

const char* version() {
  static const std::string text =
      fmt::format("{}.{:02}", btGetVersion() / 100, btGetVersion() % 100);
  return text.c_str();
}

}  // namespace
}  // namespace tandem::sim

TANDEM_ENGINE({.interface = tandem::sim::kEngineInterface,
               .compiler = __VERSION__,
               .name = "bullet",
               .version = tandem::sim::version(),
               .integrator = "semi-implicit Euler, order 1",
               .settings = "numIterations = 50 (default: 10) and erp2 = 0.08 (default: 0.2) as in "
                           "PyBullet, linear and angular damping = 0 (default: 0.04), no sleeping, "
                           "velocities not clamped (default: 100), no self collision, contacts "
                           "found anew in every step",
               .armature = false,
               .rk4 = false,
               .create = tandem::sim::Bullet::create})
