// Creates the plant: joints mapped by name, loops closed, springs and hoist loaded so that it
// starts at rest. How it advances is in plant_step.cpp.
#include "hal/sim/plant.hpp"

#include <algorithm>
#include <cstdio>
#include <string_view>

#include "base/nearest.hpp"

namespace tandem::sim {
namespace {

std::vector<std::string> names(const char* const* first, std::uint32_t count) {
  return {first, first + count};
}

int find(const std::vector<std::string>& all, std::string_view name) {
  const auto found = std::find(all.begin(), all.end(), name);
  return found == all.end() ? -1 : static_cast<int>(found - all.begin());
}

std::vector<ActuatorModel> in_model_order(const PlantConfig& config) {
  // A passive joint is one whose bridge is never on, without inertia or friction of a motor.
  const ActuatorModel none{.order = 0, .resistance_ohm = 1.0, .thermal_time_constant_s = 1.0};
  std::vector<ActuatorModel> models(config.kernels->joints, none);
  const std::vector<std::string> all = names(config.kernels->joint_names, config.kernels->joints);
  for (const PlantJoint& joint : config.joints) {
    models[static_cast<std::size_t>(find(all, joint.name))] = *make_actuator(joint.actuator);
  }
  return models;
}

Status check(const PlantConfig& config) {
  if (config.kernels == nullptr || config.kernels->abi != TANDEM_KERNELS_ABI) {
    return fail("the robot's kernels were built for another version", "build them again");
  }
  if (config.substep_ns <= 0) {
    return fail("the plant's sub-step has to be above 0 ns", "250000 is usual");
  }
  if (!(config.rate_limit > 0.0)) {
    return fail("the plausible rate has to be above 0", "1000 is usual");
  }
  for (const PlantJoint& joint : config.joints) {
    if (Result<ActuatorModel> model = make_actuator(joint.actuator); !model) {
      return std::unexpected(model.error());
    }
  }
  return {};
}

}  // namespace

Result<Plant> Plant::create(const PlantConfig& config) {
  if (Status status = check(config); !status) return std::unexpected(status.error());
  Plant plant(config);
  if (Status status = plant.map_joints(config); !status) return std::unexpected(status.error());
  plant.actuators_ = Actuators(in_model_order(config));
  for (std::size_t j = 0; j < config.joints.size(); ++j) {
    const PlantJoint& joint = config.joints[j];
    const double substep_s = static_cast<double>(config.substep_ns) * 1e-9;
    if (joint.brake) plant.actuators_.fit_brake(plant.map_[j], *joint.brake, substep_s);
    if (!(joint.actuator.friction_Nm > 0.0)) continue;
    plant.actuators_.fit_friction(plant.map_[j], joint.actuator.friction_Nm,
                                  joint.actuator.inertia_kg_m2, substep_s);
  }
  if (Status status = plant.place_contact(config); !status) return std::unexpected(status.error());
  if (Status status = plant.make_loops(config); !status) return std::unexpected(status.error());
  if (Status status = plant.open_engine(config); !status) return std::unexpected(status.error());
  plant.add_inertia(config);
  if (Status status = plant.start(config); !status) return std::unexpected(status.error());
  return plant;
}

Plant::Plant(const PlantConfig& config)
    : kernels_(config.kernels),
      added_(*config.kernels),
      sines_(*config.kernels),
      integrator_(config.integrator),
      leaps_(config.integrator == Integrator::kLeapfrog && config.engine == kOwnEngine),
      substep_ns_(config.substep_ns),
      release_ns_(config.release_ns),
      lifted_(config.lift_m != 0.0),
      rate_limit_(config.rate_limit),
      base_v_(config.kernels->floating_base != 0 ? 6 : 0),
      actuators_({}),
      flight_(*config.kernels),
      x_(*config.kernels),
      ahead_v_(kernels_->nv),
      midway_v_(kernels_->nv),
      damper_v_(2 * kernels_->joints),
      predicted_(kernels_->joints, 1.0),
      rate_(x_),
      stage_(x_),
      sum_(x_) {
  for (auto* block : {&tau_, &forces_, &applied_tau_, &vdot_}) block->assign(kernels_->nv, 0.0);
  wrench_.assign(6 * kernels_->wrenches, 0.0);
  pose_.assign(12 * kernels_->sites, 0.0);
  twist_.assign(6 * kernels_->sites, 0.0);
  damping_.assign(kernels_->joints, 0.0);
}

Status Plant::map_joints(const PlantConfig& config) {
  const std::vector<std::string> all = names(kernels_->joint_names, kernels_->joints);
  std::vector<std::uint8_t> used(all.size(), 0);
  const auto take = [&](const std::string& name, double damping) -> Result<std::size_t> {
    const int found = find(all, name);
    const auto index = static_cast<std::size_t>(found);
    if (found < 0 || used[index] != 0) {
      return std::unexpected(
          Error{.message = found < 0 ? "the model has no such joint" : "the joint is listed twice",
                .hint = suggest(name, all),
                .file = {},
                .key = name});
    }
    used[index] = 1;
    damping_[index] = damping;
    return index;
  };
  for (const PlantJoint& joint : config.joints) {
    const Result<std::size_t> index = take(joint.name, joint.damping_Nms_rad);
    if (!index) return std::unexpected(index.error());
    map_.push_back(*index);
  }
  for (const hal::PassiveConfig& joint : config.passive) {
    const Result<std::size_t> index = take(joint.name, joint.damping_Nms_rad);
    if (!index) return std::unexpected(index.error());
    passive_.push_back(*index);
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (used[i] == 0) {
      return std::unexpected(
          Error{.message = "the model's joint has no actuator",
                .hint = "add a [[joint]] or a [[passive]], or lock it under [model.lock]",
                .file = {},
                .key = all[i]});
    }
  }
  return {};
}

Status Plant::make_loops(const PlantConfig& config) {
  if (config.loops.empty()) return {};
  std::vector<std::string> passive;
  for (const hal::PassiveConfig& joint : config.passive) passive.push_back(joint.name);
  auto loops = model::ClosedLoops::create(config.loops, passive, *kernels_);
  if (!loops) return std::unexpected(loops.error());
  loops_ = ClosureForces(std::move(*loops), *kernels_);
  return {};
}

Status Plant::open_engine(const PlantConfig& config) {
  if (config.engine == kOwnEngine) return {};
  if (config.robot == nullptr || config.tree == nullptr) {
    return fail("the engine '" + config.engine + "' needs the robot's description",
                "give PlantConfig its robot and tree");
  }
  const model::Tree& tree = config.actual != nullptr ? *config.actual : *config.tree;
  auto engine =
      make_engine(config.engine, *config.robot, tree, static_cast<double>(config.substep_ns) * 1e-9,
                  config.integrator == Integrator::kRungeKutta4);
  if (!engine) return std::unexpected(engine.error());
  engine_ = std::move(*engine);
  point_forces_W_.assign(3 * contact_.points(), 0.0);
  return {};
}

void Plant::add_inertia(const PlantConfig& config) {
  if (config.tree != nullptr && config.robot != nullptr) {
    const model::Tree& actual = config.actual != nullptr ? *config.actual : *config.tree;
    added_ = AddedInertia(*kernels_, *config.robot, *config.tree, actual);
  }
  for (std::size_t j = 0; j < config.joints.size(); ++j)
    added_.add_armature(map_[j], config.joints[j].added_armature_kg_m2);
}

Status Plant::place_contact(const PlantConfig& config) {
  const std::vector<std::string> sites = names(kernels_->site_names, kernels_->sites);
  const std::vector<std::string> wrenches = names(kernels_->wrench_names, kernels_->wrenches);
  std::vector<Contact::Sole> feet;
  for (const hal::Foot& foot : config.contact.feet) {
    const int site = find(sites, foot.site);
    const int wrench = find(wrenches, foot.site);
    if (site < 0 || wrench < 0) {
      return std::unexpected(
          Error{.message = "the foot's site cannot take a wrench in the model",
                .hint = site < 0 ? suggest(foot.site, sites) : "set wrench = true in its [[site]]",
                .file = {},
                .key = "contact.foot." + foot.site});
    }
    feet.push_back(
        {static_cast<std::size_t>(site), static_cast<std::size_t>(wrench), foot.points_m});
  }
  Result<Contact> contact = Contact::create(config.contact, feet);
  if (!contact) return std::unexpected(contact.error());
  contact_ = std::move(*contact);
  return {};
}

Status Plant::close_loops(double* q) {
  constexpr int kStepsFromAnywhere = 200;
  model::ClosedLoops& loops = loops_.equations();
  if (loops_.none() || loops.close(q, kStepsFromAnywhere)) return {};
  std::size_t worst = 0;
  for (std::size_t l = 1; l < loops.loops(); ++l)
    if (loops.position_error_m(l) > loops.position_error_m(worst)) worst = l;
  return std::unexpected(Error{
      .message = "cannot be closed from the start's posture: " + loops.gap(worst).to_string(),
      .hint = "change the posture of the driven joints, the position_rad of a [[passive]], or "
              "the loop's sites",
      .file = {},
      .key = "loop." + loops.name(worst)});
}

Status Plant::start(const PlantConfig& config) {
  PlantState at(*kernels_);
  if (base_v_ != 0) {
    at.q()[2] = config.base_height_m + config.lift_m;
    at.q()[6] = 1.0;
  }
  for (std::size_t j = 0; j < map_.size(); ++j)
    at.joint_q()[map_[j]] = config.joints[j].position_rad;
  for (std::size_t j = 0; j < passive_.size(); ++j)
    at.joint_q()[passive_[j]] = config.passive[j].position_rad;
  if (Status status = close_loops(at.q()); !status) return status;
  if (base_v_ != 0 && !contact_.terrain().level()) at.q()[2] += rise_m(at);
  const std::span<const double> q(at.q(), kernels_->nq), v(at.v(), kernels_->nv);
  fit_passive_friction(config, q);
  set_state(q, v);
  place_surroundings(config);  // for the lightest that the robot is
  for (const Load& load : config.carried) added_.carry(load);

  // Springs and hoist start with the load that keeps everything at rest.
  touch_ground(x_, x_.v(), true);
  std::vector<double> load(kernels_->nv, 0.0);
  added_.inverse_dynamics(sines(), q.data(), v.data(), v.data(), wrench_.data(), load.data());
  loops_.equations().carry_passive(load.data());
  for (const std::size_t i : map_) {
    const double joint_load = load[base_v_ + i];
    const ActuatorModel& model = actuators_.model(i);
    if (config.held && model.elastic()) {
      x_.motor().position_rad[i] += joint_load / model.spring_Nm_rad;
    }
    actuators_.set_brake(i, config.held, at.joint_q()[i], joint_load);
  }
  actuators_.seat_brakes(x_.motor().position_rad);
  released_ = config.held ? 0 : 1;
  if (config.held && base_v_ != 0) hold(q.data(), load);
  return {};
}

/// So much higher no sole is inside the terrain.
double Plant::rise_m(PlantState& at) noexcept {
  sines_.take(at.q());
  kernels_->site_twists_at(sines(), at.q(), at.v(), pose_.data(), twist_.data());
  return contact_.rise_m(pose_.data());
}

/// A joint without a rotor has a share of the least inertia that it shows: together they are never
/// stiffer than the links allow.
void Plant::fit_passive_friction(const PlantConfig& config, std::span<const double> q) {
  const auto has = [](const hal::PassiveConfig& joint) { return joint.friction_Nm > 0.0; };
  const std::ptrdiff_t count = std::ranges::count_if(config.passive, has);
  if (count == 0) return;
  const auto inertias = joint_inertias(*kernels_, postures_within(added_, q, config.ranges, 128));
  for (std::size_t j = 0; j < passive_.size(); ++j) {
    if (!has(config.passive[j])) continue;
    actuators_.fit_friction(passive_[j], config.passive[j].friction_Nm,
                            inertias[passive_[j]].least / static_cast<double>(count),
                            static_cast<double>(config.substep_ns) * 1e-9);
  }
}

void Plant::place_surroundings(const PlantConfig& config) {
  std::vector<JointRange> ranges = config.ranges;
  for (JointRange& range : ranges) {
    const std::size_t joint = joint_of(*kernels_, range.joint);
    if (joint == kernels_->joints) continue;
    range.lower_rad = std::min(range.lower_rad, x_.joint_q()[joint]);
    range.upper_rad = std::max(range.upper_rad, x_.joint_q()[joint]);
  }
  const auto many = postures_within(added_, {q(), kernels_->nq}, ranges, 128);
  const std::vector<JointInertia> inertias = joint_inertias(*kernels_, many);
  predict_dampers(inertias);
  const bool described = config.tree != nullptr && config.robot != nullptr;
  if (config.ranges.empty() && !described) return;
  const auto postures = postures_within(added_, {q(), kernels_->nq}, ranges);
  stops_ = EndStops(*kernels_, ranges, joint_inertias(*kernels_, postures), substep_ns_);
  light_ = LightJoints(*kernels_, actuators_, damping_, inertias, step_stretch(integrator_),
                       substep_ns_);
  if (!described) return;
  bodies_ = BodyContact(*config.robot, *config.tree, *kernels_, q(), postures, substep_ns_);
  std::vector<std::string> joints;
  for (const PlantJoint& joint : config.joints) joints.push_back(joint.name);
  pushes_ = Pushes(*config.tree, *kernels_, joints);
}

/// Which dampers may go by a predicted velocity: those of joints whose links are heavy enough.
void Plant::predict_dampers(std::span<const JointInertia> inertias) {
  const double u_s = static_cast<double>(substep_ns_) * 1e-9 / step_stretch(integrator_);
  for (std::size_t j = 0; j < inertias.size(); ++j) {
    const double need_kg_m2 =
        LightJoints::need_kg_m2(actuators_.model(j), damping_[j], u_s, kPredictedDamper);
    predicted_[j] = need_kg_m2 <= LightJoints::kTaken * inertias[j].least ? 1.0 : 0.0;
  }
}

void Plant::hold(const double* q, std::span<const double> load) {
  // Apparent inertia along each base axis: the acceleration that a unit force adds.
  const std::vector<double> v(kernels_->nv, 0.0);
  std::vector<double> rest(kernels_->nv), moved(kernels_->nv);
  added_.forward_dynamics(sines(), q, v.data(), load.data(), wrench_.data(), rest.data());
  double most[2] = {0.0, 0.0};
  for (std::size_t axis = 0; axis < 6; ++axis) {
    std::vector<double> pushed(load.begin(), load.end());
    pushed[axis] += 1.0;
    added_.forward_dynamics(sines(), q, v.data(), pushed.data(), wrench_.data(), moved.data());
    most[axis / 3] = std::max(most[axis / 3], moved[axis] - rest[axis]);
  }
  hoist_.hold(1.0 / most[0], 1.0 / most[1], q, load.data());
}

void Plant::set_state(std::span<const double> q, std::span<const double> v) noexcept {
  x_.place(q, v);
  actuators_.seat_brakes(x_.motor().position_rad);
  loops_.changed();
  flight_.end();
  bodies_.lost();
  light_.lost();
  if (engine_) engine_->set_state(q.data(), v.data());
  std::fill(point_forces_W_.begin(), point_forces_W_.end(), 0.0);
  contact_fresh_ = vdot_fresh_ = 0;
  begin_leaps();
}

void Plant::set_drive(std::size_t joint, double voltage_V, bool bridge_on) noexcept TANDEM_RT {
  const std::size_t i = map_[joint];
  actuators_.set_drive(i, voltage_V, bridge_on);
  const bool brake = !bridge_on;  // between power-on and release
  if (released_ != 0 || actuators_.braked(i) == brake) return;
  actuators_.set_brake(i, brake, x_.joint_q()[i], tau_[base_v_ + i]);
}

void Plant::release() noexcept TANDEM_RT {
  if (released_ != 0) return;
  released_ = 1;
  if (!lifted_) hoist_.release(release_ns_);
  for (const std::size_t i : map_) actuators_.set_brake(i, false, 0.0, 0.0);
}

void Plant::carry(std::span<const Load> loads) noexcept TANDEM_RT {
  added_.let_go();
  for (const Load& load : loads) added_.carry(load);
  loops_.changed();
  flight_.end();
  vdot_fresh_ = 0;
}

void Plant::add_beyond(std::size_t sensor, double* channels) noexcept TANDEM_RT {
  bodies_.add_beyond(sensor, channels);
  added_.add_beyond(sensor, q(), v(), vdot(), channels);
}

void Plant::center_of_mass(double* c, double* cdot, double* J) noexcept TANDEM_RT {
  kernels_->center_of_mass_at(sines(), q(), v(), c, cdot, J);
  added_.add_to_center_of_mass(q(), c);
}

JointReading Plant::joint(std::size_t joint) const noexcept TANDEM_RT {
  const std::size_t i = map_[joint];
  const MotorStateView motors = x_.motor();
  return {x_.joint_q()[i],
          x_.joint_v()[i],
          motors.position_rad[i],
          motors.velocity_rad_s[i],
          tau_[base_v_ + i] + damping_[i] * (leaps_ ? damper_v_.data() : x_.joint_v())[i],
          motors.current_A[i],
          actuators_.voltage_V()[i],
          actuators_.temperature_C()[i]};
}

std::string Plant::diverged_text() const {
  if (diverged_ < 0) return {};
  const auto index = static_cast<std::size_t>(diverged_);
  const std::string who = index < base_v_
                              ? "the floating base"
                              : "joint " + std::string(kernels_->joint_names[index - base_v_]);
  char text[160];
  std::snprintf(text, sizeof text, "%s at %.6f s: rate %g is beyond the plausible %g rad/s or m/s",
                who.c_str(), static_cast<double>(time_ns_) * 1e-9, diverged_rate_, rate_limit_);
  return text;
}

void Plant::archive(Archive& ar) {
  ar(actuators_, added_, contact_, bodies_, hoist_, loops_, flight_, light_, x_, ahead_v_,
     midway_v_, damper_v_, tau_, applied_tau_, vdot_, wrench_, pose_, twist_, time_ns_, released_,
     contact_fresh_, vdot_fresh_, diverged_, diverged_rate_, point_forces_W_, pushes_);
  if (ar.reading()) sines_.take(q());
  if (ar.reading() && leaps_ && !loops_.none()) loops_.prepare(added_, q(), v());
  if (engine_) engine_->archive(ar);
}

}  // namespace tandem::sim
