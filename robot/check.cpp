#include "robot/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "hal/ethercat-can/bus_load.hpp"
#include "hal/ethercat-can/drive_use.hpp"
#include "hal/ethercat-can/interpolation_period.hpp"
#include "hal/sim/setup.hpp"
#include "model/interpreted_kernels.hpp"
#include "robot/check_rows.hpp"

namespace tandem::robot {
namespace {

void add(const Diagnostics& from, Diagnostics& to) {
  to.insert(to.end(), from.begin(), from.end());
}

void loops(const CheckedRobot& s, Findings& findings) {
  findings.loops = study_loops(s.robot.config, s.kernels, s.use.postures);
  add(findings.loops.errors, findings.errors);
}

/// A floating base that nothing carries.
void falls_for_ever(const CheckedRobot& s, Findings& findings) {
  const hal::RobotConfig& robot = s.robot.config;
  const bool pulled =
      std::ranges::any_of(robot.model.gravity_m_s2, [](double g) { return g != 0.0; });
  if (!robot.model.floating_base || !robot.contact.feet.empty() || !pulled) return;
  findings.warn(
      {.message = "the base floats and there is no [contact]: the simulated robot falls for ever",
       .hint = "add [contact] with the robot's feet, or base = \"fixed\"",
       .file = robot.file,
       .key = "model.base"});
}

/// Whether its boards can be emulated.
void firmware(const CheckedRobot& s, Findings& findings) {
  const Status boards = sim::check_firmware(s.robot.config);
  if (boards) return;
  if (!s.use.alone) return findings.add_error(boards.error());
  Error warning = boards.error();
  warning.message = "cannot be simulated: " + warning.message;
  findings.warn(std::move(warning));
}

/// Whether the engine takes the robot. Other engines have one coefficient for soles that stick and
/// that slide.
void engine(const CheckedRobot& s, Findings& findings) {
  sim::SimRobotConfig simulation = s.use.simulation;
  if (simulation.engine == sim::kOwnEngine) return;
  if (simulation.tree == nullptr) {
    simulation.tree = std::make_shared<const model::Tree>(s.robot.tree);
  }
  if (const Status taken = sim::check_engine(s.robot.config, simulation); !taken) {
    findings.add_error(taken.error());
  }
  const hal::ContactConfig& contact = s.robot.config.contact;
  if (contact.feet.empty() || contact.static_friction == contact.sliding_friction) return;
  findings.warn(
      {.message = fmt::format("the engine '{}' has one coefficient of friction, static_friction = "
                              "{:g}: sliding_friction = {:g} is not used",
                              simulation.engine, contact.static_friction, contact.sliding_friction),
       .hint = "to compare slides with Tandem's own, make both alike in [contact]",
       .file = {},
       .key = "sim.engine"});
}

/// Warns of a drive that is given its bearings' friction alone, a common slip: its motor turned
/// many times as fast as its voltage allows.
void back_emf(const CheckedRobot& s, Findings& findings) {
  for (const hal::ActuatorConfig& actuator : s.robot.config.actuators) {
    const double per_A = actuator.torque_per_A();
    const double whole = per_A * per_A / actuator.resistance_ohm;
    if (!(actuator.damping_Nms_rad < 0.5 * whole)) continue;
    findings.warn(
        {.message = fmt::format("is {:.3g}, and the back-EMF alone is N^2 K^2 / R = {:.3g}: the "
                                "simulated motor has {:.2g} of its back-EMF, and no friction",
                                actuator.damping_Nms_rad, whole, actuator.damping_Nms_rad / whole),
         .hint = "it is friction and back-EMF together",
         .file = s.robot.config.file,
         .line = actuator.damping_line,
         .key = "actuator." + actuator.name + ".damping_Nms_rad"});
  }
}

/// Gravity with z > 0: legal, and nearly always a slip of sign.
void upward_gravity(const CheckedRobot& s, Findings& findings) {
  const hal::RobotConfig& robot = s.robot.config;
  if (!(robot.model.gravity_m_s2[2] > 0.0)) return;
  findings.warn(
      {.message = "gravity points up: z > 0 pulls the robot towards +z, away from the ground",
       .hint = "[0, 0, -9.81] points down; keep it only if the robot hangs from a ceiling",
       .file = robot.file,
       .line = robot.model.gravity_line,
       .key = "model.gravity_m_s2"});
}

/// What drives of other makes miss. A layout that cannot be made is an error of the bus' load, too.
void drives(const CheckedRobot& s, Findings& findings) {
  add(hal::can::sheet_warnings(s.robot.config), findings.warnings);
  const auto found = hal::can::drive_warnings(s.robot.config);
  if (found) return add(*found, findings.warnings);
  if (s.use.period_ns == 0) findings.add_error(found.error());
}

void interpolation(const CheckedRobot& s, Findings& findings) {
  if (s.use.period_ns == 0) return;
  add(hal::can::check_interpolation(s.robot.config, s.use.period_ns), findings.errors);
}

void bus_load(const CheckedRobot& s, Findings& findings) {
  if (s.use.period_ns == 0) return;
  add(hal::can::check_bus_load(s.robot.config, s.use.period_ns), findings.errors);
}

/// Whom a check is for; the table's columns.
enum Who : unsigned { kAlone = 1, kPlant = 2, kDrives = 4, kAll = 8 };

struct Row {
  unsigned who;
  void (*look)(const CheckedRobot& subject, Findings& findings);
};

constexpr Row kRows[] = {
    {kAlone | kPlant, loops},
    {kAlone | kPlant, check_start_heights},
    {kAlone | kPlant, check_buried_links},
    {kAlone | kPlant, falls_for_ever},
    {kAlone | kPlant, firmware},
    {kPlant, engine},
    {kAlone | kPlant | kDrives, check_unused_limits},
    {kAlone | kPlant | kDrives, back_emf},
    {kAlone | kPlant | kDrives, upward_gravity},
    {kAlone | kPlant | kDrives, check_torques},
    {kAlone | kPlant | kDrives, check_gains},
    {kAlone | kDrives, drives},
    {kDrives, interpolation},
    {kAll, bus_load},
};

unsigned who(const RobotUse& use) {
  return kAll | (use.alone ? kAlone : 0U) | (use.plant ? kPlant : 0U) | (use.drives ? kDrives : 0U);
}

}  // namespace

Findings check(const RobotFiles& robot, const RobotUse& use) {
  Findings findings;
  auto mechanism = model::make_mechanism(robot.tree, robot.spec, model::Frames::kAsDescribed);
  if (!mechanism) {
    findings.add_error(mechanism.error());  // no kernels can be made of it, and little be checked
    if (findings.errors.back().file.empty()) findings.errors.back().file = robot.config.file;
    return findings;
  }
  const model::InterpretedKernels kernels(std::move(*mechanism), robot.config.name);
  const CheckedRobot subject{robot, use, *kernels.get()};
  for (const Row& row : kRows) {
    if ((row.who & who(use)) != 0) row.look(subject, findings);
  }
  return findings;
}

RobotUse use_alone(const hal::RobotConfig& robot, std::int64_t period_ns) {
  RobotUse use{.alone = true, .postures = {}, .period_ns = period_ns};
  for (const hal::PostureConfig& one : robot.postures) use.postures.push_back(one.name);
  if (use.postures.empty()) use.postures.emplace_back();
  return use;
}

}  // namespace tandem::robot
