// Simbody: mobilized bodies, a Hunt-Crossley contact of every ball with the ground, and an
// integrator that takes as many steps within one of ours as its error asks for: of Simbody's the
// one that needs the fewest evaluations here, where friction is stiff. Layer: hal/sim/engines.
// Thread: one.
namespace SimTK {
// Simbody's headers are C++11: since C++20 `a == b` of its index types means two things. This is a
// third that fits better than both; it has to stand before the headers.
template <class Index>
requires requires(const Index& index) { index.isValidExtended(); }
bool operator==(const Index& a, const Index& b) {
  return static_cast<int>(a) == static_cast<int>(b);
}
}  // namespace SimTK

#include <Simbody.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/sim/engine.hpp"
#include "hal/sim/engines/masses.hpp"

namespace tandem::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// The ball's material: its modulus and the ground's, and how much an impact loses.
constexpr double kModulus_Pa = 1e9;
constexpr double kDissipation_s_m = 10.0;

constexpr const char* kWanted = "Simbody wants a mass in every body that moves";

SimTK::Vec3 vec3(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

SimTK::Rotation rotation(const Matrix3d& R) {
  const Quaterniond q(R);
  return SimTK::Rotation(SimTK::Quaternion(q.w(), q.x(), q.y(), q.z()));
}

SimTK::Body::Rigid rigid(const model::Inertia& inertia) {
  const Matrix3d& I = inertia.about_com_kg_m2;
  const SimTK::Inertia central(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
  const SimTK::Vec3 com = vec3(inertia.com_m);
  return SimTK::Body::Rigid(SimTK::MassProperties(
      inertia.mass_kg, com, central.shiftFromMassCenter(com, inertia.mass_kg)));
}

// Exerts nothing: its auxiliary states are the integrals of the ground's forces on the points.
class Impulses final : public SimTK::Force::Custom::Implementation {
 public:
  Impulses(const SimTK::GeneralForceSubsystem& forces,
           const SimTK::GeneralContactSubsystem& contacts)
      : forces_(forces), contacts_(contacts) {}

  void add(const SimTK::HuntCrossleyForce& force, SimTK::MobilizedBodyIndex body) {
    of_.push_back(force);
    body_.push_back(body);
  }

  void realizeTopology(SimTK::State& state) const override {
    const int size = 3 * static_cast<int>(of_.size());
    if (size > 0) forces_.allocateZ(state, SimTK::Vector(size, 0.0));
  }

  void realizeAcceleration(const SimTK::State& state) const override {
    for (std::size_t i = 0; i < of_.size(); ++i) {
      SimTK::Vec3 force(0.0);
      if (!of_[i].isDisabled(state) &&
          !contacts_.getContacts(state, SimTK::ContactSetIndex(static_cast<int>(i))).empty()) {
        of_[i].calcForceContribution(state, on_bodies_, on_particles_, on_mobilities_);
        force = on_bodies_[body_[i]][1];
      }
      for (int axis = 0; axis < 3; ++axis)
        forces_.updZDot(state)[3 * static_cast<int>(i) + axis] = force[axis];
    }
  }

  void calcForce(const SimTK::State&, SimTK::Vector_<SimTK::SpatialVec>&,
                 SimTK::Vector_<SimTK::Vec3>&, SimTK::Vector&) const override {}
  SimTK::Real calcPotentialEnergy(const SimTK::State&) const override { return 0.0; }

 private:
  const SimTK::GeneralForceSubsystem& forces_;
  const SimTK::GeneralContactSubsystem& contacts_;
  std::vector<SimTK::HuntCrossleyForce> of_;  // of every point, whose contact set has its number
  std::vector<SimTK::MobilizedBodyIndex> body_;
  mutable SimTK::Vector_<SimTK::SpatialVec> on_bodies_;  // scratch
  mutable SimTK::Vector_<SimTK::Vec3> on_particles_;
  mutable SimTK::Vector on_mobilities_;
};

class Simbody final : public Engine {
 public:
  static Result<std::unique_ptr<Engine>> create(const EngineModel& model) {
    // Without a mass it answers with accelerations that are wrong.
    if (const Status masses = check_masses(model.tree, "Simbody", false); !masses)
      return std::unexpected(masses.error());
    try {
      auto engine = std::make_unique<Simbody>(model);
      engine->system_.realize(engine->air_, SimTK::Stage::Acceleration);
      const SimTK::Vector& rates = engine->matter_.getUDot(engine->air_);
      for (int i = 0; i < rates.size(); ++i)
        if (!std::isfinite(rates[i])) return fail("a joint has nothing to move", kWanted);
      return engine;
    } catch (const std::exception& error) {
      return fail(error.what(), kWanted);
    }
  }

  explicit Simbody(const EngineModel& model)
      : matter_(system_),
        forces_(system_),
        contacts_(system_),
        discrete_(forces_, matter_),
        floating_(model.tree.floating_base),
        next_s_(model.step_s) {
    const auto& [x, y, z] = model.gravity_m_s2;
    SimTK::Force::UniformGravity(forces_, matter_, SimTK::Vec3(x, y, z));
    forces_.setNumberOfThreads(1);
    add_bodies(model);
    add_rotors(model);
    add_ground(model);
    state_ = system_.realizeTopology();
    system_.realizeModel(state_);
    air_ = state_;
    for (const SimTK::HuntCrossleyForce& force : grounds_) force.disable(air_);
    integrator_.setAllowInterpolation(false);
  }

  void set_state(const double* q, const double* v) override {
    place(q, v, state_);
    next_s_ = std::numeric_limits<double>::infinity();
  }

  void step(double step_s, const double* tau, double* q, double* v, double* forces_W) override {
    try {
      advance(step_s, tau);
    } catch (const std::exception&) {  // it lost its way: the plant ends the run
      matter_.updU(state_) = SimTK::NaN;
    }
    read_state(q, v);
    const SimTK::Vector& impulses = forces_.getZ(state_);
    for (int i = 0; i < impulses.size(); ++i) forces_W[i] = impulses[i] / step_s;
  }

  void accelerations(const double* q, const double* v, const double* tau, double* vdot) override {
    set_state(q, v);
    place(q, v, air_);
    load(tau, air_);
    system_.realize(air_, SimTK::Stage::Acceleration);
    const SimTK::Vector& rates = matter_.getUDot(air_);
    for (std::size_t j = 0; j < joints_.size(); ++j)
      vdot[base_v() + j] = rates[joints_[j].getFirstUIndex(air_)];
    if (!floating_) return;
    // The base's velocity turns with it: d(R^T v_W)/dt = R^T a_W - w x v.
    const Quaterniond back = base_turn(air_).conjugate();
    const Eigen::Map<const Vector3d> linear(v), angular(v + 3);
    Eigen::Map<Vector3d>{vdot} =
        back * Vector3d(rates[3], rates[4], rates[5]) - angular.cross(linear);
    Eigen::Map<Vector3d>{vdot + 3} = back * Vector3d(rates[0], rates[1], rates[2]);
  }

  void archive(Archive& ar) override {
    for (SimTK::Vector* values : {&matter_.updQ(state_), &matter_.updU(state_)})
      for (int i = 0; i < values->size(); ++i) ar((*values)[i]);
    ar(next_s_);
  }

 private:
  [[nodiscard]] std::size_t base_q() const { return floating_ ? 7 : 0; }
  [[nodiscard]] std::size_t base_v() const { return floating_ ? 6 : 0; }

  void add_bodies(const EngineModel& model) {
    const model::Tree& tree = model.tree;
    SimTK::MobilizedBody& ground = matter_.updGround();
    bodies_.push_back(ground);
    if (floating_) bodies_[0] = SimTK::MobilizedBody::Free(ground, rigid(tree.bodies[0].inertia));
    for (std::size_t j = 0; j < tree.joints.size(); ++j) {
      const model::Joint& joint = tree.joints[j];
      const bool slides = joint.type == model::JointType::kPrismatic;
      // Simbody slides along x and turns about z of a frame of the joint's own.
      const Quaterniond axis =
          Quaterniond::FromTwoVectors(slides ? Vector3d::UnitX() : Vector3d::UnitZ(), joint.axis);
      const SimTK::Rotation in_body = rotation(axis.toRotationMatrix());
      const SimTK::Transform in_parent(rotation(joint.in_parent.R * axis.toRotationMatrix()),
                                       vec3(joint.in_parent.p));
      const SimTK::Body::Rigid body = rigid(tree.bodies[j + 1].inertia);
      SimTK::MobilizedBody& parent = bodies_[joint.parent];
      if (slides) {
        joints_.push_back(SimTK::MobilizedBody::Slider(parent, in_parent, body, in_body));
      } else {
        joints_.push_back(SimTK::MobilizedBody::Pin(parent, in_parent, body, in_body));
      }
      bodies_.push_back(joints_.back());
    }
  }

  // A rotor turns on the ground, as fast as its joint.
  void add_rotors(const EngineModel& model) {
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      const double armature = model.armature_kg_m2[j];
      if (!(armature > 0.0)) continue;
      const SimTK::Body::Rigid rotor(
          SimTK::MassProperties(1.0, SimTK::Vec3(0.0), SimTK::Inertia(armature)));
      SimTK::MobilizedBody::Pin pin(matter_.updGround(), rotor);
      rotors_.push_back({static_cast<int>(j), pin});
      SimTK::Vector same(3, 0.0);
      same[0] = 1.0;
      same[1] = -1.0;
      const std::vector<SimTK::MobilizedBodyIndex> bodies{joints_[j].getMobilizedBodyIndex(),
                                                          pin.getMobilizedBodyIndex()};
      const std::vector<SimTK::MobilizerUIndex> speeds(2, SimTK::MobilizerUIndex(0));
      SimTK::Constraint::SpeedCoupler(matter_, new SimTK::Function::Linear(same), bodies, speeds);
    }
  }

  void add_ground(const EngineModel& model) {
    auto* impulses = new Impulses(forces_, contacts_);  // the system's own
    const SimTK::Transform down(SimTK::Rotation(0.5 * SimTK::Pi, SimTK::YAxis),
                                SimTK::Vec3(0.0, 0.0, model.ground_m - EngineModel::kRadius_m));
    for (const EngineModel::Point& point : model.points) {
      const SimTK::ContactSetIndex set = contacts_.createContactSet();
      SimTK::MobilizedBody& body = bodies_[point.body];
      contacts_.addBody(set, body, SimTK::ContactGeometry::Sphere(EngineModel::kRadius_m),
                        SimTK::Transform(vec3(point.in_body_m)));
      contacts_.addBody(set, matter_.updGround(), SimTK::ContactGeometry::HalfSpace(), down);
      SimTK::HuntCrossleyForce force(forces_, contacts_, set);
      for (const int side : {0, 1})
        force.setBodyParameters(SimTK::ContactSurfaceIndex(side), kModulus_Pa, kDissipation_s_m,
                                model.friction, model.friction, 0.0);
      grounds_.push_back(force);
      impulses->add(force, body.getMobilizedBodyIndex());
    }
    SimTK::Force::Custom(forces_, impulses);
  }

  void place(const double* q, const double* v, SimTK::State& state) const {
    SimTK::Vector &to_q = matter_.updQ(state), &to_u = matter_.updU(state);
    if (floating_) {  // w x y z, position; angular and linear velocity in W
      const Quaterniond R = Quaterniond(q[6], q[3], q[4], q[5]).normalized();
      const Vector3d linear = R * Eigen::Map<const Vector3d>(v);
      const Vector3d angular = R * Eigen::Map<const Vector3d>(v + 3);
      to_q[0] = R.w();
      for (int axis = 0; axis < 3; ++axis) {
        to_q[1 + axis] = R.vec()[axis];
        to_q[4 + axis] = q[axis];
        to_u[axis] = angular[axis];
        to_u[3 + axis] = linear[axis];
      }
    }
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      to_q[joints_[j].getFirstQIndex(state)] = q[base_q() + j];
      to_u[joints_[j].getFirstUIndex(state)] = v[base_v() + j];
    }
    for (const auto& [joint, rotor] : rotors_) {
      to_q[rotor.getFirstQIndex(state)] = 0.0;
      to_u[rotor.getFirstUIndex(state)] = v[base_v() + joint];
    }
  }

  [[nodiscard]] Quaterniond base_turn(const SimTK::State& state) const {
    const SimTK::Vector& q = matter_.getQ(state);
    return Quaterniond(q[0], q[1], q[2], q[3]);
  }

  void read_state(double* q, double* v) const {
    const SimTK::Vector &from_q = matter_.getQ(state_), &from_u = matter_.getU(state_);
    if (floating_) {
      const Quaterniond R = base_turn(state_);
      Eigen::Map<Vector3d>{q} = Vector3d(from_q[4], from_q[5], from_q[6]);
      Eigen::Map<Eigen::Vector4d>{q + 3} = R.coeffs();  // x y z w
      Eigen::Map<Vector3d>{v} = R.conjugate() * Vector3d(from_u[3], from_u[4], from_u[5]);
      Eigen::Map<Vector3d>{v + 3} = R.conjugate() * Vector3d(from_u[0], from_u[1], from_u[2]);
    }
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      q[base_q() + j] = from_q[joints_[j].getFirstQIndex(state_)];
      v[base_v() + j] = from_u[joints_[j].getFirstUIndex(state_)];
    }
  }

  void load(const double* tau, SimTK::State& state) const {
    for (std::size_t j = 0; j < joints_.size(); ++j)
      discrete_.setOneMobilityForce(state, joints_[j], SimTK::MobilizerUIndex(0),
                                    tau[base_v() + j]);
    if (!floating_) return;
    const Quaterniond R = base_turn(state);
    const Vector3d force = R * Eigen::Map<const Vector3d>(tau);
    const Vector3d torque = R * Eigen::Map<const Vector3d>(tau + 3);
    discrete_.setOneBodyForce(state, bodies_[0], SimTK::SpatialVec(vec3(torque), vec3(force)));
  }

  // The torques jump between steps, so the integrator starts anew; the state, and the length of
  // step that it would try, are all that it keeps.
  void advance(double step_s, const double* tau) {
    state_.setTime(0.0);
    forces_.updZ(state_) = 0.0;
    load(tau, state_);
    integrator_.setInitialStepSize(std::min(next_s_, step_s));
    integrator_.initialize(state_);
    while (integrator_.getTime() < step_s) integrator_.stepTo(step_s);
    const SimTK::State& after = integrator_.getAdvancedState();
    matter_.updQ(state_) = matter_.getQ(after);
    matter_.updU(state_) = matter_.getU(after);
    forces_.updZ(state_) = forces_.getZ(after);
    next_s_ = integrator_.getPredictedNextStepSize();
  }

  SimTK::MultibodySystem system_;
  SimTK::SimbodyMatterSubsystem matter_;
  SimTK::GeneralForceSubsystem forces_;
  SimTK::GeneralContactSubsystem contacts_;
  SimTK::Force::DiscreteForces discrete_;
  SimTK::SemiExplicitEuler2Integrator integrator_{system_};
  std::vector<SimTK::MobilizedBody> bodies_;  // 0: the ground when the base is fixed
  std::vector<SimTK::MobilizedBody> joints_;  // a joint is its child's
  struct Rotor {
    int joint;
    SimTK::MobilizedBody body;
  };
  std::vector<Rotor> rotors_;
  std::vector<SimTK::HuntCrossleyForce> grounds_;  // of every point
  SimTK::State state_, air_;                       // without ground: to ask accelerations
  const bool floating_;
  double next_s_;
};

}  // namespace
}  // namespace tandem::sim

TANDEM_ENGINE({.interface = tandem::sim::kEngineInterface,
               .compiler = __VERSION__,
               .name = "simbody",
               .version = "3.7",
               .integrator = "SemiExplicitEuler2 with error control (accuracy 1e-3), order 2",
               .settings = "contact without defaults: Hunt-Crossley of modulus 1e9 Pa and "
                           "dissipation 10 s/m",
               .armature = true,
               .rk4 = false,
               .create = tandem::sim::Simbody::create})
