// DART: the robot as a Skeleton, its soles' points as balls on a box, in a simulation::World.
// Layer: hal/sim/engines.  Thread: one.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <dart/collision/CollisionObject.hpp>
#include <dart/collision/dart/DARTCollisionDetector.hpp>
#include <dart/constraint/ConstraintSolver.hpp>
#include <dart/constraint/ContactConstraint.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/PrismaticJoint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/SphereShape.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/simulation/World.hpp>
#include <tuple>

#include "hal/sim/engine.hpp"
#include "hal/sim/engines/masses.hpp"

namespace tandem::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
namespace dd = dart::dynamics;

/// A joint of DART with a rotor: its inertia joins what the joint moves, wherever DART inverts
/// that, for forces and for impulses.
template <class Joint>
class WithRotor final : public Joint {
 public:
  using Properties = typename Joint::Properties;
  explicit WithRotor(const Properties& properties) : Joint(properties) {}
  double rotor_kg_m2 = 0.0;

 protected:
  void updateInvProjArtInertia(const Eigen::Matrix6d& moved) override {
    Joint::updateInvProjArtInertia(moved);
    add(this->mInvProjArtInertia);
  }
  void updateInvProjArtInertiaImplicit(const Eigen::Matrix6d& moved, double step_s) override {
    Joint::updateInvProjArtInertiaImplicit(moved, step_s);
    add(this->mInvProjArtInertiaImplicit);
  }

 private:
  template <class Inverse>
  void add(Inverse& inverse) const {
    inverse /= 1.0 + rotor_kg_m2 * inverse(0, 0);
  }
};

Isometry3d isometry(const model::Placement& at) {
  Isometry3d out = Isometry3d::Identity();
  out.linear() = at.R;
  out.translation() = at.p;
  return out;
}

class Dart final : public Engine {
 public:
  static Result<std::unique_ptr<Engine>> create(const EngineModel& model) {
    if (const Status masses = check_masses(model.tree, "DART", false); !masses)
      return std::unexpected(masses.error());
    return std::make_unique<Dart>(model);
  }

  explicit Dart(const EngineModel& model) {
    // With DART's own 0, in a squat of COMAN at 250 us, a third of the steps miss one or more of
    // the soles' eight points, and the force on the ground leaps. Points that may stay 0.1 mm deep
    // stay.
    dart::constraint::ContactConstraint::setErrorAllowance(1e-4);  // of the process
    world_->getConstraintSolver()->setCollisionDetector(
        dart::collision::DARTCollisionDetector::create());
    world_->setGravity(Vector3d(model.gravity_m_s2.data()));
    make_robot(model);
    make_points(model);
    make_ground(model);
  }

  void set_state(const double* q, const double* v) override {
    if (free_ != nullptr) {
      Isometry3d base(Quaterniond(q[6], q[3], q[4], q[5]));
      base.translation() = Eigen::Map<const Vector3d>(q);
      free_->setPositions(dd::FreeJoint::convertToPositions(base));
      free_->setVelocities(angular_first(v));
    }
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      joints_[i]->setPosition(0, q[base_q() + i]);
      joints_[i]->setVelocity(0, v[base_v() + i]);
    }
  }

  void step(double step_s, const double* tau, double* q, double* v, double* forces_W) override {
    if (step_s != world_->getTimeStep()) world_->setTimeStep(step_s);
    load(tau);
    world_->step();
    read_state(q, v);
    read_forces(forces_W);
  }

  void accelerations(const double* q, const double* v, const double* tau, double* vdot) override {
    set_state(q, v);
    load(tau);
    robot_->computeForwardDynamics();
    if (free_ != nullptr) angular_last(free_->getAccelerations(), vdot);
    for (std::size_t i = 0; i < joints_.size(); ++i)
      vdot[base_v() + i] = joints_[i]->getAcceleration(0);
  }

  void archive(Archive& ar) override {
    Eigen::VectorXd positions = robot_->getPositions(), velocities = robot_->getVelocities();
    for (Eigen::VectorXd* values : {&positions, &velocities})
      ar.raw(values->data(), static_cast<std::size_t>(values->size()) * sizeof(double));
    if (!ar.reading()) return;
    robot_->setPositions(positions);
    robot_->setVelocities(velocities);
  }

 private:
  // DART's twists and wrenches of a base are in its own axes too, with the angular part first.
  static Eigen::Vector6d angular_first(const double* linear_first) {
    Eigen::Vector6d out;
    out << Eigen::Map<const Vector3d>(linear_first + 3), Eigen::Map<const Vector3d>(linear_first);
    return out;
  }
  static void angular_last(const Eigen::Vector6d& twist, double* linear_first) {
    Eigen::Map<Vector3d>{linear_first} = twist.tail<3>();
    Eigen::Map<Vector3d>{linear_first + 3} = twist.head<3>();
  }
  [[nodiscard]] std::size_t base_q() const { return free_ != nullptr ? 7 : 0; }
  [[nodiscard]] std::size_t base_v() const { return free_ != nullptr ? 6 : 0; }

  // DART prints a line about every name that it has to change, and, when it is given the moments
  // as a matrix, about every one that it finds odd. A base that is fixed may have no mass at all.
  static dd::BodyNode::Properties body_properties(const model::Body& body, std::size_t index) {
    dd::BodyNode::Properties properties;
    properties.mName = fmt::format("b{}", index);
    const auto& [mass, com, I] = body.inertia;
    if (mass > 0.0) {
      properties.mInertia = dd::Inertia(mass, com.x(), com.y(), com.z(), I(0, 0), I(1, 1), I(2, 2),
                                        I(0, 1), I(0, 2), I(1, 2));
    }
    return properties;
  }

  void make_robot(const EngineModel& model) {
    const model::Tree& tree = model.tree;
    const auto base = body_properties(tree.bodies[0], 0);
    if (tree.floating_base) {
      std::tie(free_, root_) = robot_->createJointAndBodyNodePair<dd::FreeJoint>(nullptr, {}, base);
    } else {
      root_ = robot_->createJointAndBodyNodePair<dd::WeldJoint>(nullptr, {}, base).second;
    }
    for (std::size_t i = 0; i < tree.joints.size(); ++i) {
      const double rotor = model.armature_kg_m2[i];
      const auto body = body_properties(tree.bodies[i + 1], i + 1);
      if (tree.joints[i].type == model::JointType::kPrismatic) {
        add_joint<dd::PrismaticJoint>(tree.joints[i], rotor, body);
      } else {
        add_joint<dd::RevoluteJoint>(tree.joints[i], rotor, body);
      }
    }
    world_->addSkeleton(robot_);
  }

  template <class Joint>
  void add_joint(const model::Joint& joint, double rotor_kg_m2,
                 const dd::BodyNode::Properties& body) {
    typename Joint::Properties properties;
    properties.mName = "j" + body.mName;
    properties.mAxis = joint.axis;
    properties.mT_ParentBodyToJoint = isometry(joint.in_parent);
    auto* parent = robot_->getBodyNode(static_cast<std::size_t>(joint.parent));
    auto* made =
        robot_->createJointAndBodyNodePair<WithRotor<Joint>>(parent, properties, body).first;
    made->rotor_kg_m2 = rotor_kg_m2;
    joints_.push_back(made);
  }

  void make_points(const EngineModel& model) {
    const auto ball = std::make_shared<dd::SphereShape>(EngineModel::kRadius_m);
    for (const EngineModel::Point& point : model.points) {
      dd::ShapeNode* node = add_shape(robot_->getBodyNode(static_cast<std::size_t>(point.body)),
                                      ball, model.friction);
      node->setRelativeTranslation(point.in_body_m);
      points_.push_back(node);
    }
  }

  // DART's own detector knows no planes.
  void make_ground(const EngineModel& model) {
    constexpr double kWide_m = 1e3, kThick_m = 2.0;
    const auto body = dd::Skeleton::create("ground");
    dd::BodyNode* node = body->createJointAndBodyNodePair<dd::WeldJoint>().second;
    add_shape(node, std::make_shared<dd::BoxShape>(Vector3d(kWide_m, kWide_m, kThick_m)),
              model.friction)  // the smaller one of two counts
        ->setRelativeTranslation(
            Vector3d(0.0, 0.0, model.ground_m - EngineModel::kRadius_m - 0.5 * kThick_m));
    world_->addSkeleton(body);
  }

  static dd::ShapeNode* add_shape(dd::BodyNode* body, const dd::ShapePtr& shape, double friction) {
    auto* node = body->createShapeNodeWith<dd::CollisionAspect, dd::DynamicsAspect>(shape);
    node->getDynamicsAspect()->setFrictionCoeff(friction);
    return node;
  }

  void load(const double* tau) {
    if (free_ != nullptr) free_->setForces(angular_first(tau));
    for (std::size_t i = 0; i < joints_.size(); ++i) joints_[i]->setForce(0, tau[base_v() + i]);
  }

  void read_state(double* q, double* v) const {
    if (free_ != nullptr) {
      const Isometry3d& base = root_->getWorldTransform();
      const Quaterniond turn(base.linear());
      Eigen::Map<Vector3d>{q} = base.translation();
      std::copy_n(turn.coeffs().data(), 4, q + 3);  // x y z w
      angular_last(free_->getVelocities(), v);
    }
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      q[base_q() + i] = joints_[i]->getPosition(0);
      v[base_v() + i] = joints_[i]->getVelocity(0);
    }
  }

  void read_forces(double* forces_W) const {
    std::fill_n(forces_W, 3 * points_.size(), 0.0);
    for (const dart::collision::Contact& contact : world_->getLastCollisionResult().getContacts()) {
      double sign = 1.0;  // its force is the one on the first body
      for (const auto* object : {contact.collisionObject1, contact.collisionObject2}) {
        const auto at = std::ranges::find(points_, object->getShapeFrame());
        const auto point = static_cast<std::size_t>(at - points_.begin());
        if (at != points_.end()) Eigen::Map<Vector3d>{forces_W + 3 * point} += sign * contact.force;
        sign = -1.0;
      }
    }
  }

  dart::simulation::WorldPtr world_ = dart::simulation::World::create();
  dd::SkeletonPtr robot_ = dd::Skeleton::create("robot");
  dd::FreeJoint* free_ = nullptr;  // of a floating base
  dd::BodyNode* root_ = nullptr;
  std::vector<dd::Joint*> joints_;
  std::vector<const dd::ShapeFrame*> points_;
};

}  // namespace
}  // namespace tandem::sim

TANDEM_ENGINE(
    {.interface = tandem::sim::kEngineInterface,
     .compiler = __VERSION__,
     .name = "dart",
     .version = DART_VERSION,
     .integrator = "semi-implicit Euler, order 1",
     .settings = "error allowance of contacts = 0.1 mm (default: 0), collision detector = "
                 "dart (default: fcl, which makes meshes of balls), rotors added to its "
                 "joints, as it has no armature",
     .armature = true,
     .rk4 = false,
     .create = tandem::sim::Dart::create})
