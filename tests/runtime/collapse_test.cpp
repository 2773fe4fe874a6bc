// After an emergency stop in motion: the robot falls, lies still within its end stops, and can be
// reset as docs/safety.md says.
#include <algorithm>
#include <cmath>

#include "hal/sim/rotation.hpp"
#include "hal/sim/setup.hpp"
#include "tests/runtime/bundled_run.hpp"

namespace tandem::runtime {
namespace {

constexpr double kPastTheEnd_rad = 0.05;  // that docs/simulation.md allows

/// An experiment whose faults wait for a reset, and what is watched of it every cycle.
struct Collapse : BundledRun {
  explicit Collapse(const std::string& robot, const std::string& name)
      : BundledRun(robot, name, {.duration_s = 1000.0, .on_fault = "wait"}) {
    ranges = sim::mechanical_ranges(experiment->robot, *experiment->tree());
  }
  [[nodiscard]] const sim::Plant& plant() const { return backend->plant(); }

  void steps(int count) {
    for (int i = 0; i < count; ++i) {
      ASSERT_TRUE(cycle->step());
      watch();
    }
  }
  void watch() {
    const tandem_kernels& k = plant().kernels();
    const double* q = plant().q() + (k.nq - k.joints);
    for (const sim::JointRange& range : ranges) {
      const std::size_t joint = sim::joint_of(k, range.joint);
      const double past = std::max(q[joint] - range.upper_rad, range.lower_rad - q[joint]);
      if (past <= worst_rad) continue;
      worst_rad = past;
      worst = range.joint;
    }
    for (std::size_t i = 0; i < k.nq; ++i) finite = finite && std::isfinite(plant().q()[i]);
  }
  [[nodiscard]] double kinetic_J() const {
    double energy[2];
    plant().kernels().energy(plant().q(), plant().v(), energy);
    return energy[0];
  }
  /// Energy of everything that moves or is stretched, but for the motors' own.
  [[nodiscard]] double energy_J() const {
    double energy[2];
    plant().kernels().energy(plant().q(), plant().v(), energy);
    const tandem_kernels& k = plant().kernels();
    return energy[0] + energy[1] + plant().contact().elastic_energy_J() +
           plant().bodies().elastic_energy_J() +
           plant().end_stops().elastic_energy_J(plant().q() + (k.nq - k.joints));
  }
  void expect_no_fault_but_the_stop() {
    for (const FaultReport& fault : cycle->faults()) {
      EXPECT_EQ(fault.text, "emergency stop on request") << fault.joint << " at " << fault.time_s;
    }
  }
  /// Reset, held, and what was active started again.
  void recover() {
    cycle->inbox().reset_faults();
    for (int i = 0; i < 3000 && cycle->phase() != RunPhase::kHeld; ++i) steps(1);
    ASSERT_EQ(cycle->phase(), RunPhase::kHeld) << backend->status_text();
    EXPECT_EQ(cycle->fault_log().latched(), 0U);
    steps(3000);
    EXPECT_EQ(cycle->phase(), RunPhase::kHeld);
    EXPECT_EQ(cycle->fault_log().latched(), 0U);
    expect_no_fault_but_the_stop();
  }

  std::vector<sim::JointRange> ranges;
  double worst_rad = 0.0;
  std::string worst;
  bool finite = true;
};

void collapse(const std::string& robot, hal::StopCategory category) {
  Collapse run(robot, "squat");
  run.run_to(RunPhase::kRunning);
  run.steps(4000);  // half way down the first squat
  const double standing_m = run.plant().q()[2], before_J = run.energy_J();
  run.cycle->inbox().emergency_stop(category);
  run.steps(6000);
  EXPECT_EQ(run.cycle->phase(), RunPhase::kFaulted);
  EXPECT_TRUE(run.finite);
  EXPECT_LT(run.worst_rad, kPastTheEnd_rad) << run.worst;
  EXPECT_LT(run.energy_J(), before_J - 0.3 * run.plant().kernels().mass_kg * 9.81 * standing_m);
  EXPECT_LT(run.kinetic_J(), 0.05) << "it lies still";
  EXPECT_GT(run.plant().q()[2], 0.02) << "on the ground, not in it";
  EXPECT_LT(run.plant().q()[2], 0.7 * standing_m);
  EXPECT_GT(run.plant().bodies().vertical_force_N(), 0.1 * run.plant().kernels().mass_kg * 9.81);
  run.expect_no_fault_but_the_stop();
  run.recover();
  EXPECT_LT(run.worst_rad, kPastTheEnd_rad) << run.worst;
  EXPECT_TRUE(run.finite);
  EXPECT_LT(run.kinetic_J(), 0.05);
}

/// COMAN is stopped in its squat, by `category`, and falls.
struct Fall {
  Fall(hal::StopCategory category, int after) {
    run.run_to(RunPhase::kRunning);
    run.steps(after);
    (void)run.cycle->inbox().emergency_stop(category);
    for (int i = 0; i < 9000; ++i) {
      EXPECT_TRUE(run.cycle->step());
      if (run.cycle->phase() != RunPhase::kFaulted) continue;
      if (begin_J == 0.0) {
        begin_J = run.energy_J();
        from_m = run.plant().q()[2];
      }
      most_J = std::max(most_J, run.energy_J());
    }
    EXPECT_FALSE(run.plant().diverged()) << run.plant().diverged_text();
  }
  Collapse run{"coman", "squat"};
  double begin_J = 0.0, most_J = 0.0, from_m = 0.0;
};

// Also with straight arms on the ground, whose shoulder yaw the sub-step does not integrate.
TEST(Collapse, OfComanGainsNoEnergyAndIsFromItsLowestPointAfterARetreat) {
  for (const int after : {500, 2000}) {  // standing, going down
    SCOPED_TRACE(after);
    const Fall hard(hal::StopCategory::kCategory1, after);
    const Fall soft(hal::StopCategory::kCategory2, after);
    for (const Fall* fall : {&hard, &soft}) {
      EXPECT_GT(fall->begin_J, 10.0);
      EXPECT_LT(fall->most_J, fall->begin_J + 1.0) << "the motors brake, and springs give little";
    }
    EXPECT_LT(soft.from_m, hard.from_m);
  }
}

// Without dampers and friction the ground's forces are the slope of its springs' energy: an
// independent way to every entry of J^T f.
TEST(Collapse, LiesOnForcesThatAreTheSlopeOfTheGroundsEnergy) {
  BundledRun squat("coman", "squat");
  hal::RobotConfig robot = squat.experiment->robot;
  robot.contact.damping_s_m = robot.contact.tangential_damping_Ns_m = 0.0;
  robot.contact.static_friction = robot.contact.sliding_friction = 0.0;
  const tandem_kernels& k = squat.run->kernels();
  const double* start = squat.backend->plant().q();
  const auto postures = sim::postures_within(
      k, {start, k.nq}, sim::mechanical_ranges(robot, *squat.experiment->tree()));
  sim::BodyContact bodies(robot, *squat.experiment->tree(), k, start, postures, 250'000);
  const std::vector<double> rest(k.nv, 0.0);
  const auto energy_at = [&](const std::vector<double>& q) {
    bodies.lost();
    bodies.evaluate(q.data(), rest.data(), true);
    return bodies.elastic_energy_J();
  };
  std::vector<double> q = postures[5].q;
  q[2] = 0.05;  // deep, and turned
  const double turn[4] = {0.3, -0.4, 0.2, std::sqrt(1.0 - 0.29)};
  std::copy_n(turn, 4, q.begin() + 3);
  ASSERT_GT(energy_at(q), 1.0);
  std::vector<double> forces(k.nv, 0.0);
  bodies.add_forces(forces.data());
  constexpr double kStep = 1e-7;
  for (std::size_t i = 0; i < k.nv; ++i) {
    const auto moved = [&](double way) {
      std::vector<double> to = q;
      double v[6] = {};
      if (i < 6) v[i] = way;
      const sim::Vec3 shift = sim::rotate(sim::rotation_of(q.data() + 3).data(), v);
      for (std::size_t axis = 0; axis < 3; ++axis) to[axis] += shift[axis];
      sim::turn_quaternion(to.data() + 3, v + 3, 1.0);
      if (i >= 6) to[i + 1] += way;
      return energy_at(to);
    };
    const double slope = (moved(kStep) - moved(-kStep)) / (2.0 * kStep);
    EXPECT_NEAR(forces[i], -slope, 1e-5 * (10.0 + std::abs(slope))) << i;
  }
}

/// Ground that its file does not know of: the robot sank to -6.4 m, with status 0.
Diagnostics on_soft_ground(Composition& c) {
  hal::RobotConfig robot = c.experiment.robot;
  robot.contact.stiffness_N_m *= 1e-4;
  auto made = sim::SimRobot::create(robot, c.kernels.get(), c.experiment.sim_robot_config());
  if (!made) return {made.error()};
  c.sim = made->get();
  c.backend = std::move(*made);
  return {};
}

TEST(Collapse, OfARunningRobotIsAFaultWithItsTime) {
  for (const bool allowed : {false, true}) {
    BundledRun squat(
        "coman", "squat",
        {.duration_s = 4.0, .change = [=](Experiment& e) { e.falls_are_faults = !allowed; }}, {},
        on_soft_ground);
    squat.cycle->run();
    const auto faults = squat.cycle->faults();
    if (allowed) {
      for (const FaultReport& fault : faults)
        EXPECT_FALSE(fault.text.starts_with("the robot")) << fault.text;
      continue;
    }
    ASSERT_EQ(faults.size(), 1U);
    EXPECT_TRUE(faults[0].text.starts_with("the robot sank: a foot is 0.")) << faults[0].text;
    EXPECT_GT(faults[0].time_s, 1.0) << "after the hoist has let it down";
    EXPECT_LT(faults[0].time_s, 2.5);
    EXPECT_EQ(faults[0].category, hal::StopCategory::kCategory1);
  }
}

TEST(Collapse, OfComanAfterAnEmergencyStopOfCategory0) {
  collapse("coman", hal::StopCategory::kCategory0);
}
TEST(Collapse, OfComanAfterAnEmergencyStopOfCategory1) {
  collapse("coman", hal::StopCategory::kCategory1);
}
TEST(Collapse, OfWalkmanAfterAnEmergencyStopOfCategory1) {
  collapse("walkman", hal::StopCategory::kCategory1);
}

TEST(Collapse, OfPandaEndsAtItsEndStops) {
  Collapse run("panda", "trajectory");
  run.run_to(RunPhase::kRunning);
  run.steps(2500);
  const double before_J = run.energy_J();
  run.cycle->inbox().emergency_stop(hal::StopCategory::kCategory0);
  run.steps(15000);
  EXPECT_TRUE(run.finite);
  EXPECT_LT(run.worst_rad, kPastTheEnd_rad) << run.worst;
  EXPECT_LT(run.energy_J(), before_J);
  run.expect_no_fault_but_the_stop();
  run.recover();
  EXPECT_LT(run.worst_rad, kPastTheEnd_rad) << run.worst;
}

}  // namespace
}  // namespace tandem::runtime
