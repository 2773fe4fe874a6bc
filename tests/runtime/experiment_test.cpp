#include "runtime/experiment.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "tests/support/scratch_folder.hpp"

namespace tandem::runtime {
namespace {

const char* const kExperiment = R"(robot = "robot.toml"
duration_s = 2.5
posture = "ready"
[[controller]]
plugin = "hold"
[controller.parameters]
stiffness = 3
)";

const char* const kRobot = R"(name = "arm"
[model]
urdf = "arm.urdf"
base = "fixed"
[actuator.motor]
resistance_ohm = 1.0
torque_constant_Nm_A = 0.02
gear_ratio = 20
inertia_kg_m2 = 0.002
damping_Nms_rad = 0.17
spring_Nm_rad = 100
current_limit_A = 10
voltage_limit_V = 24
[gains.motor]
position = {kp = 6}
[[bus]]
name = "arm"
[[board]]
name = "board"
bus = "arm"
node_id = 1
[[joint]]
name = "elbow"
board = "board"
actuator = "motor"
gains = "motor"
torque_noise_Nm = 0.1
encoder_counts_per_rev = 65536
motor_encoder_counts_per_rev = 65536
[[sensor]]
name = "wrist_ft"
type = "force_torque"
bus = "arm"
node_id = 2
joint = "wrist"
link = "hand"
noise = [1, 1, 1, 1, 1, 1]
[posture.ready]
elbow = 0.5
)";

const char* const kUrdf = R"(<robot name="arm"><link name="base"/><link name="upper"><inertial>
<mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="hand"/>
<joint name="elbow" type="revolute"><parent link="base"/><child link="upper"/>
<limit lower="-1" upper="2" velocity="3" effort="4"/></joint>
<joint name="wrist" type="fixed"><parent link="upper"/><child link="hand"/></joint></robot>
)";

hal::RobotConfig robot(const std::string& text = kRobot) {
  const auto read = hal::parse_robot_config(text, "arm/robot.toml");
  EXPECT_TRUE(read.has_value());
  return read.value_or(hal::RobotConfig{});
}

std::string errors_of(const std::string& text, const hal::RobotConfig& with = robot()) {
  const auto experiment = parse_experiment(text, "arm/x.toml", with);
  std::string all;
  if (experiment.has_value()) return all;
  for (const Error& error : experiment.error()) all += error.to_string() + "\n";
  return all;
}

/// `text` with `from` (which must occur once) replaced by `to`.
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  EXPECT_EQ(text.find(from, at + 1), std::string::npos) << from << " occurs twice";
  return text.replace(at, from.size(), to);
}

/// The experiment with `lines` before its first table.
std::string with(const std::string& lines) {
  return replaced(kExperiment, "[[controller]]", lines + "\n[[controller]]");
}

TEST(Experiment, IsReadWithItsDefaults) {
  const auto e = parse_experiment(kExperiment, "arm/x.toml", robot());
  ASSERT_TRUE(e.has_value()) << errors_of(kExperiment);
  EXPECT_EQ(e->robot_file, "arm/robot.toml");
  EXPECT_EQ(e->duration_s, 2.5);
  EXPECT_EQ(e->cycles(), 2500u);
  EXPECT_EQ(e->seed, 1u);
  EXPECT_EQ(e->posture, "ready");
  EXPECT_EQ(e->loop.period_ns, 1'000'000);
  EXPECT_EQ(e->loop.on_overrun, rt::OverrunPolicy::kSkip);
  EXPECT_EQ(e->thread.policy, rt::SchedulingPolicy::kOther);
  EXPECT_FALSE(e->thread.lock_memory);
  EXPECT_EQ(e->sim.integrator, sim::Integrator::kLeapfrog);
  EXPECT_TRUE(e->sim.hoist);
  EXPECT_FALSE(e->remote.command.has_value());
  EXPECT_EQ(e->remote.lease_timeout_s, 1.0);
  EXPECT_EQ(e->remote.lockstep_timeout_s, 60.0);
  EXPECT_EQ(e->remote.max_age_cycles, 100U);
  EXPECT_EQ(e->log.folder, "runs");
  ASSERT_EQ(e->controllers.size(), 1u);
  EXPECT_EQ(e->controllers[0].name, "hold");
  EXPECT_EQ(e->robot.joints[0].torque_noise_Nm, 0.1);
}

TEST(Experiment, ReadsEveryKey) {
  const auto e = parse_experiment(with(R"(seed = 7
period_ns = 2_000_000
kernel_variant = "baseline"
[hal]
backend = "can"
lockstep = true
answer_window = 0.7
settle_s = 0.003
[sim]
integrator = "rk4"
substep_ns = 250_000
bus_timing = true
bus_latency_ns = 20_000
order = 0
noise = false
ground_truth = false
hoist = {enabled = false, release_s = 0.5}
[overrun]
policy = "stop"
n = 2
m = 10
[realtime]
policy = "rr"
priority = 42
cpu = 1
lock_memory = false
[faults]
after_stop = "wait"
after_reset = "continue"
stray_writes = "hold"
watchdog_s = 0.25
[remote]
command = "local"
[log]
folder = "logs"
compression = "zstd"
truth_every = 10
estimate_every = 0
without = ["state.acceleration_rad_s2", "truth.foot_moment_nm"]
viewers = false
file_MB = 100
total_MB = 1000
keep_free_MB = 500
[report]
position_of = "elbow"
torque_of = "elbow"
foot = "wrist_ft")"),
                                  "arm/x.toml", robot());
  ASSERT_TRUE(e.has_value());
  EXPECT_EQ(e->seed, 7u);
  EXPECT_EQ(e->cycles(), 1250u);
  EXPECT_EQ(e->kernel_variant, "baseline");
  EXPECT_EQ(e->hal.backend, BackendKind::kWire);
  EXPECT_TRUE(e->hal.lockstep);
  EXPECT_EQ(e->hal.answer_window, 0.7);
  EXPECT_EQ(e->settle_cycles(), 2u);
  EXPECT_EQ(e->sim.integrator, sim::Integrator::kRungeKutta4);
  EXPECT_EQ(e->sim.substep_ns, 250'000);
  EXPECT_TRUE(e->sim_robot_config().bus_timing);
  EXPECT_EQ(e->sim_robot_config().bus_latency_ns, 20'000);
  EXPECT_EQ(e->sim_robot_config().answer_window_ns, 1'400'000);
  EXPECT_EQ(e->robot.actuators[0].order, 0);
  EXPECT_TRUE(e->robot.sensors[0].noise.empty());
  EXPECT_EQ(e->robot.joints[0].torque_noise_Nm, 0.0);
  EXPECT_FALSE(e->sim.ground_truth);
  EXPECT_FALSE(e->sim.hoist);
  const sim::SimRobotConfig robot_config = e->sim_robot_config();
  EXPECT_EQ(robot_config.period_ns, 2'000'000);
  EXPECT_EQ(robot_config.integrator, sim::Integrator::kRungeKutta4);
  EXPECT_EQ(robot_config.substep_ns, 250'000);
  EXPECT_EQ(robot_config.posture, "ready");
  EXPECT_FALSE(robot_config.hold);
  EXPECT_EQ(robot_config.release_ns, 500'000'000);
  EXPECT_EQ(robot_config.seed, 7u);
  EXPECT_FALSE(robot_config.truth);
  EXPECT_EQ(e->loop.on_overrun, rt::OverrunPolicy::kStop);
  EXPECT_EQ(e->loop.stop_late, 2);
  EXPECT_EQ(e->loop.stop_window, 10);
  EXPECT_EQ(e->thread.policy, rt::SchedulingPolicy::kRoundRobin);
  EXPECT_EQ(e->thread.priority, 42);
  EXPECT_EQ(e->thread.cpu, 1);
  EXPECT_FALSE(e->thread.lock_memory);
  EXPECT_EQ(e->after_stop, AfterStop::kWait);
  EXPECT_EQ(e->after_reset, AfterReset::kContinue);
  EXPECT_EQ(e->on_stray, hal::StopCategory::kHold);
  EXPECT_EQ(e->watchdog_s, 0.25);
  EXPECT_EQ(e->remote.command, RemoteAccess::kLocal);
  EXPECT_EQ(e->log.folder, "logs");
  EXPECT_EQ(e->log.compression, LogCompression::kZstd);
  EXPECT_EQ(e->log.state_every, 1u);
  EXPECT_EQ(e->log.truth_every, 10u);
  EXPECT_EQ(e->log.estimate_every, 0u);
  EXPECT_EQ(e->log.without.size(), 2u);
  EXPECT_FALSE(e->log.viewers);
  EXPECT_EQ(e->log.file_MB, 100.0);
  EXPECT_EQ(e->log.total_MB, 1000.0);
  EXPECT_EQ(e->log.keep_free_MB, 500.0);
  EXPECT_EQ(e->report.foot, "wrist_ft");
}

TEST(Experiment, LeavesParametersToTheirController) {
  auto e = parse_experiment(kExperiment, "arm/x.toml", robot());
  ASSERT_TRUE(e.has_value());
  TomlTable& parameters = e->controllers[0].parameters;
  EXPECT_EQ(parameters.number_or("stiffnes", 1.0), 1.0);
  parameters.finish();
  ASSERT_EQ(e->document.diagnostics().size(), 1u);
  EXPECT_EQ(e->document.diagnostics()[0].to_string(),
            "arm/x.toml:7: controller.hold.parameters.stiffness: unknown key "
            "(did you mean 'stiffnes'?)");
}

TEST(Experiment, RefusesAPeriodOfZero) {
  EXPECT_EQ(errors_of(with("period_ns = 0")),
            "arm/x.toml:4: period_ns: 0 is out of range (must be 10000 to 1000000000)\n");
}

TEST(Experiment, RefusesToLiftWhatNoHoistHolds) {
  EXPECT_NE(errors_of(with("[sim]\nhoist = {lift_m = 0.2}"))
                .find("sim.hoist.lift_m: a fixed base cannot be lifted"),
            std::string::npos);
  EXPECT_NE(errors_of(with("[sim]\nhoist = {enabled = false, lift_m = 0.2}"))
                .find("sim.hoist.lift_m: without a hoist nothing lifts the base"),
            std::string::npos);
}

TEST(Experiment, RefusesAPeriodThatDoesNotFitABoard) {
  EXPECT_EQ(errors_of(with("period_ns = 1_500_000")),
            "arm/x.toml:4: period_ns: 1500000 ns and the control period of board 'board', "
            "1000000 ns, do not divide each other (make one a multiple of the other)\n");
  hal::RobotConfig two = robot();
  two.boards.push_back(two.boards[0]);
  const auto both = parse_experiment(with("period_ns = 1_500_000"), "arm/x.toml", two);
  ASSERT_EQ(both.error().size(), 1U) << "one message for all boards";
  EXPECT_NE(both.error()[0].message.find("of board 'board' and of 1 more"), std::string::npos);
}

TEST(Experiment, RefusesAPeriodThatLeavesNoTimeForAHeartbeat) {
  EXPECT_TRUE(parse_experiment(with("period_ns = 100_000_000"), "arm/x.toml", robot()));
  EXPECT_EQ(errors_of(with("period_ns = 101_000_000")),
            "arm/x.toml:4: period_ns: 101000000 ns is more than two heartbeats of board 'board' "
            "(heartbeat_ms = 50): it would count the master as lost (set its heartbeat_ms to 51 or "
            "more in arm/robot.toml, or shorten the period)\n");
  hal::RobotConfig slow = robot();
  slow.boards[0].heartbeat_ms = 125;
  slow.sensors[0].heartbeat_ms = 125;
  EXPECT_EQ(errors_of(with("period_ns = 250_000_000"), slow), "");
}

TEST(Experiment, RefusesASubstepThatDoesNotDivide) {
  EXPECT_EQ(errors_of(with("[sim]\nsubstep_ns = 300_000")),
            "arm/x.toml:5: sim.substep_ns: 300000 ns does not divide the period of 1000000 ns "
            "(choose a divisor of period_ns)\n");
}

TEST(Experiment, SaysWhatToDoAboutAnIntegratorThatIsNone) {
  EXPECT_EQ(
      errors_of(with("[sim]\nintegrator = 'semi_implicit'")),
      "arm/x.toml:5: sim.integrator: 'semi_implicit' is not one of the choices (leave it out: "
      "the leapfrog has replaced it, in the same sub-steps)\n");
  EXPECT_EQ(errors_of(with("[sim]\nintegrator = ''")),
            "arm/x.toml:5: sim.integrator: must not be empty (known: leapfrog, rk4)\n");
  EXPECT_EQ(errors_of(with("[sim]\nintegrator = 'euler'")),
            "arm/x.toml:5: sim.integrator: 'euler' is not one of the choices (known: leapfrog, "
            "rk4)\n");
}

TEST(Experiment, RefusesALogThatCannotBeKept) {
  const auto log = [](const std::string& lines) { return errors_of(with("[log]\n" + lines)); };
  EXPECT_EQ(log("truth_every = -1"),
            "arm/x.toml:5: log.truth_every: -1 is out of range (must be 0 to 1000000)\n");
  EXPECT_EQ(log("without = ['state.torque']"),
            "arm/x.toml:5: log.without: the topic 'state' has no field 'torque' (did you mean "
            "'torque_nm'?)\n");
  EXPECT_EQ(log("without = ['stat.torque_nm']"),
            "arm/x.toml:5: log.without: 'stat.torque_nm' begins with no topic of images (did you "
            "mean 'state'?)\n");
  for (const std::string entry : {"", ".", "state", "state.", "truth.foot_force_n.x"}) {
    EXPECT_NE(log("without = ['" + entry + "']").find("arm/x.toml:5: log.without: "),
              std::string::npos)
        << entry;
  }
  EXPECT_EQ(log("without = ['command.cycle']"),
            "arm/x.toml:5: log.without: 'command.cycle' cannot be left out (it tells a message's "
            "cycle)\n");
  EXPECT_EQ(log("without = ['truth.foot_force_n', 'estimate.base_valid']"), "");
  EXPECT_EQ(
      log("file_MB = 1"),
      "arm/x.toml:5: log.file_MB: 1 is out of range (must be at least 4 and at most 1e+06)\n");
  EXPECT_EQ(log("total_MB = 100"),
            "arm/x.toml:5: log.total_MB: without file_MB there is one file, which cannot be "
            "shortened (set file_MB, at most half of it)\n");
  EXPECT_EQ(log("total_MB = 100\nfile_MB = 60"),
            "arm/x.toml:5: log.total_MB: is less than two files of file_MB (the file that is being "
            "written and one before it stay)\n");
  EXPECT_EQ(log("total_MB = 120\nfile_MB = 60\nkeep_free_MB = 1e4"), "");
  EXPECT_EQ(log("total_s = 600"),
            "arm/x.toml:5: log.total_s: without file_s or file_MB there is one file, which cannot "
            "be shortened (set file_s, at most half of it)\n");
  EXPECT_EQ(log("total_s = 600\nfile_s = 301"),
            "arm/x.toml:5: log.total_s: is less than two files of file_s (the file that is being "
            "written and one before it stay)\n");
  EXPECT_EQ(log("total_s = 60\nfile_s = 10"),
            "arm/x.toml:5: log.total_s: is less than keep_before_fault_s (when a fault comes, what "
            "was before it has to be there still)\n");
  EXPECT_EQ(log("budget = 'experiment'\nfile_s = 10"),
            "arm/x.toml:5: log.budget: without total_MB and total_s nothing is removed (set one of "
            "them, or leave budget out)\n");
  EXPECT_EQ(log("total_s = 60\nfile_MB = 10\nkeep_before_fault_s = 0\nbudget = 'experiment'\n"
                "keep_free_share = 0.1"),
            "");
  EXPECT_NE(log("keep_free_share = 1").find("arm/x.toml:5: log.keep_free_share: "),
            std::string::npos);
  EXPECT_NE(log("keep_free_MB = nan").find("arm/x.toml:5: log.keep_free_MB: "), std::string::npos);
}

TEST(Experiment, ReadsWhatItExpects) {
  const auto e = parse_experiment(with(R"x([[expect]]
always = "torque(elbow) < 4Nm"
from_s = 0.5
to_s = 2.0
after = "phase() == running"
[[expect]]
name = "settles"
settles = "position(elbow)"
above = "1rad"
below = "2rad"
in_s = 0.4
[[expect]]
stays_up = true)x"),
                                  "experiment.toml", robot());
  ASSERT_TRUE(e.has_value()) << e.error().front().to_string();
  ASSERT_EQ(e->expectations.size(), 3U);
  const ExpectationSpec& first = e->expectations[0];
  EXPECT_EQ(first.name, "torque(elbow) < 4Nm") << "it is called what it says";
  EXPECT_EQ(first.kind, ExpectationKind::kAlways);
  EXPECT_EQ(first.from_s, 0.5);
  EXPECT_EQ(first.to_s, 2.0);
  EXPECT_EQ(first.after, "phase() == running");
  const ExpectationSpec& second = e->expectations[1];
  EXPECT_EQ(second.kind, ExpectationKind::kSettles);
  EXPECT_EQ(second.text, "position(elbow)");
  EXPECT_EQ(second.above, "1rad");
  EXPECT_EQ(second.below, "2rad");
  EXPECT_EQ(second.in_s, 0.4);
  EXPECT_TRUE(e->expectations[2].stays_up);
  EXPECT_EQ(e->expectations[2].name, "stays up");
}

TEST(Experiment, RefusesExpectationsThatSayNothing) {
  struct Case {
    const char *lines, *says;
  };
  const Case cases[] = {
      {"", "expects nothing"},
      {"name = \"n\"", "give one of always, never"},
      {"always = \"a\"\nnever = \"b\"", "the row has always already"},
      {"always = \"a\"\nstays_up = true", "the row has always already"},
      {"alwais = \"a\"", "did you mean 'always'"},
      {"always = 3", "must be a text"},
      {"always = \"\"", "is empty"},
      {"stays_up = 1", "must be"},
      {"bounds = \"a\"", "has no bound"},
      {"rms = \"a\"\nbelow = 3", "must be a text"},
      {"always = \"a\"\nbelow = \"3m\"", "is of no use beside a condition"},
      {"always = \"a\"\nin_s = 1.0", "is of no use without `settles`"},
      {"settles = \"a\"\nbelow = \"1m\"", "does not say how long"},
      {"settles = \"a\"\nbelow = \"1m\"\nin_s = 3\nto_s = 2", "longer than the window"},
      {"always = \"a\"\nfrom_s = 2\nto_s = 1", "ends before it begins"},
      {"always = \"a\"\nfrom_s = -1", "from_s: -1 is out of range"},
      {"always = \"a\"\nfrom_s = \"1s\"", "must be a number"},
      {"always = \"a\"\n[[expect]]\nalways = \"a\"", "two expectations are called 'a'"},
  };
  for (const Case& one : cases) {
    const std::string said = errors_of(with(std::string("[[expect]]\n") + one.lines));
    EXPECT_NE(said.find(one.says), std::string::npos) << one.lines << "\n" << said;
  }
  EXPECT_NE(errors_of(with("[expect]\nalways = \"a\"")), "") << "a table is no list of rows";
}

TEST(Experiment, ReadsTheNetworkProxysKeys) {
  const auto e = parse_experiment(with("[hal]\nbackend = 'dds'\ndelay_cycles = 2\n"
                                       "[remote]\ncommand = 'local'\nlockstep = true\n"
                                       "lease_timeout_s = 0.5\nmax_age_cycles = 20\n"
                                       "lockstep_timeout_s = 3.0\non_lost = 'category1'"),
                                  "arm/x.toml", robot());
  ASSERT_TRUE(e) << e.error().front().to_string();
  EXPECT_EQ(e->hal.backend, BackendKind::kDds);
  EXPECT_EQ(e->hal.delay_cycles, 2U);
  EXPECT_EQ(e->remote.command, RemoteAccess::kLocal);
  EXPECT_TRUE(e->remote.lockstep);
  EXPECT_EQ(e->remote.lease_timeout_s, 0.5);
  EXPECT_EQ(e->remote.max_age_cycles, 20U);
  EXPECT_EQ(e->remote.lockstep_timeout_s, 3.0);
  EXPECT_EQ(e->remote.on_lost, hal::StopCategory::kCategory1);
}

TEST(Experiment, ReadsWhatIsEstimated) {
  const auto plain = parse_experiment(kExperiment, "arm/x.toml", robot());
  ASSERT_TRUE(plain.has_value());
  EXPECT_FALSE(plain->estimation.any()) << "nothing without the table";
  const auto e =
      parse_experiment(with("[estimation.base]\nimu = 'head'\nfoot_noise_m = 0.002\nrest_s = 0.5\n"
                            "[estimation.observer]\nbandwidth_Hz = 20\n[estimation.collision]\n"
                            "reaction = 'retract'\nthreshold_Nm = {elbow = 2.5}\n"),
                       "arm/x.toml", robot());
  ASSERT_TRUE(e.has_value()) << e.error().front().to_string();
  const estimation::EstimationConfig& all = e->estimation;
  EXPECT_EQ(all.base->imu, "head");
  EXPECT_EQ(all.base->foot_noise_m, 0.002);
  EXPECT_EQ(all.base->gyro_noise_rad_s, estimation::BaseConfig{}.gyro_noise_rad_s);
  EXPECT_EQ(all.observer->bandwidth_Hz, 20.0);
  EXPECT_EQ(all.collision->reaction, hal::StopCategory::kCategory2);
  ASSERT_EQ(all.collision->thresholds.size(), 1U);
  EXPECT_EQ(all.collision->thresholds[0].joint, "elbow");
  EXPECT_EQ(all.collision->thresholds[0].torque_Nm, 2.5);
}

TEST(Experiment, RefusesWhatCannotBeEstimated) {
  const auto has = [](const std::string& text, const char* part) {
    return errors_of(with(text)).find(part) != std::string::npos;
  };
  EXPECT_TRUE(has("[estimation.base]\nfoot_noise = 0.1", "foot_noise_m")) << "the nearest key";
  EXPECT_TRUE(has("[estimation.observer]\nbandwidth_Hz = 0", "bandwidth_Hz"));
  EXPECT_TRUE(has("[estimation.collision]\nreaction = 'stop'\nthreshold_Nm = {elbow = 1}", "hold"));
  EXPECT_TRUE(has("[estimation.collision]\nthreshold_Nm = {knee = 1}", "knee"));
  EXPECT_TRUE(has("[estimation.collision]\nthreshold_Nm = {elbw = 1}", "did you mean 'elbow'?"))
      << "the robot's joints are known, not those that the table has";
  EXPECT_TRUE(has("[estimation.collision]\nreaction = 'warn'", "threshold_Nm"));
  EXPECT_TRUE(has("[estimation.collision]\nthreshold_Nm = {base_force_x = 9}", "does not float"));
  EXPECT_TRUE(has("[estimation.collision]\nthreshold_Nm = {elbow = -1}", "elbow"));
  auto sited = robot();
  sited.model.sites.push_back({});
  sited.model.sites.back().name = "tip";
  const auto e =
      parse_experiment(with("[[estimation.wrench]]\nsite = 'tip'\n"), "arm/x.toml", sited);
  ASSERT_TRUE(e.has_value()) << e.error().front().to_string();
  EXPECT_EQ(e->estimation.wrench_sites(), std::vector<std::string>{"tip"});
  EXPECT_TRUE(has("[[estimation.wrench]]\nsite = 'tap'", "the robot has no site 'tap'"));
  EXPECT_TRUE(has("[[estimation.wrench]]\nlink = 'hand'", "site"));
}

TEST(Experiment, SuggestsTheNearestPosture) {
  EXPECT_EQ(errors_of(replaced(kExperiment, "ready", "reddy")),
            "arm/x.toml:3: posture: the robot has no posture 'reddy' (did you mean 'ready'?)\n");
}

TEST(Experiment, AsksForThePostureOfAFloatingRobot) {
  const hal::RobotConfig floating = robot(replaced(kRobot, "fixed", "floating"));
  EXPECT_NE(errors_of(replaced(kExperiment, "posture = \"ready\"", ""), floating)
                .find("needs a posture to start from"),
            std::string::npos);
}

TEST(Experiment, SuggestsTheNearestJointAndSensorOfTheReport) {
  EXPECT_EQ(
      errors_of(with("[report]\ntorque_of = 'ellbow'\nfoot = 'wristft'")),
      "arm/x.toml:5: report.torque_of: the robot has no joint 'ellbow' (did you mean 'elbow'?)\n"
      "arm/x.toml:6: report.foot: the robot has no sensor 'wristft' "
      "(did you mean 'wrist_ft'?)\n");
}

TEST(Experiment, RefusesAnOrderThatTheActuatorsLackDataFor) {
  EXPECT_EQ(errors_of(with("[sim]\norder = 3")),
            "arm/x.toml:5: sim.order: the actuator 'motor' cannot be of order 3: inductance_H must "
            "be positive (complete it in arm/robot.toml, or leave the order to it)\n");
}

TEST(Experiment, RefusesLocalCommandsOverANetwork) {
  const std::string dds = "[dds]\ninterfaces = ['lo', 'eth0']\n[remote]\ncommand = ";
  EXPECT_NE(errors_of(with(dds + "'local'"))
                .find("remote.command: \"local\", but [dds] reaches beyond this machine"),
            std::string::npos);
  for (const char* fine :
       {"'off'", "'network'\ntrust = 'domain'", "'network'\ntrust = 'admitted'"}) {
    EXPECT_EQ(errors_of(with(dds + fine)), "");
  }
  EXPECT_NE(errors_of(with(dds + "'network'")).find("nothing says whose commands these would be"),
            std::string::npos);
  EXPECT_EQ(errors_of(with("[dds]\n[remote]\ncommand = 'local'")), "");
  EXPECT_NE(errors_of(with("[remote]\ncommand = 'all'")).find("remote.command"), std::string::npos);
}

TEST(Experiment, MayBeEndless) {
  const std::string key = "duration_s = 2.5";
  const auto e =
      parse_experiment(replaced(kExperiment, key, "duration_s = 'endless'"), "x", robot());
  ASSERT_TRUE(e.has_value());
  EXPECT_TRUE(e->endless());
  EXPECT_EQ(e->cycles(), 0U) << "which is a run until it is stopped";
  EXPECT_EQ(
      errors_of(replaced(kExperiment, key, "duration_s = 'endles'")),
      "arm/x.toml:2: duration_s: 'endles' is neither a number of seconds nor \"endless\" (write "
      "duration_s = 10.0, or \"endless\" for a run until it is stopped)\n");
  for (const std::string value :
       {"''", "'5'", "-1", "0", "inf", "nan", "1e7", "true", "['endless']"}) {
    EXPECT_NE(errors_of(replaced(kExperiment, key, "duration_s = " + value))
                  .find("arm/x.toml:2: duration_s: "),
              std::string::npos)
        << value;
  }
}

TEST(Experiment, RefusesARunWithoutController) {
  EXPECT_NE(errors_of("robot = 'robot.toml'\nduration_s = 1\n").find("there is no controller"),
            std::string::npos);
}

TEST(Experiment, RefusesTwoControllersOfAName) {
  EXPECT_NE(errors_of(std::string(kExperiment) + "[[controller]]\nplugin = 'hold'\n")
                .find("two controllers are called 'hold'"),
            std::string::npos);
}

TEST(Experiment, RefusesAControllersNameThatIsNoTopics) {
  const auto said = [](const std::string& name) {
    return errors_of(std::string(kExperiment) + "[[controller]]\nplugin = 'hold'\nname = \"" +
                     name + "\"\n");
  };
  for (const char* name :
       {"a.b", "a/b", "a-b", "../x", "-x", "ä", "w 3", "2nd", "a,b", "a\\u001b[2J"})
    EXPECT_NE(said(name).find("the controller's name '"), std::string::npos) << name;
  EXPECT_NE(said("a.b").find("use letters, digits and _, no digit first: name = \"a_b\""),
            std::string::npos);
  EXPECT_EQ(said("a\\u001b[2J").find('\033'), std::string::npos) << "a terminal obeys it";
  EXPECT_EQ(said("a_b"), "");
}

TEST(Experiment, RefusesARobotWithoutJoints) {
  const hal::RobotConfig bare = robot("name = 'm'\n[model]\nurdf = 'm.urdf'\nbase = 'fixed'\n");
  EXPECT_NE(errors_of(kExperiment, bare).find("nothing to control"), std::string::npos);
}

TEST(Experiment, RefusesMoreLateCyclesThanTheWindowHas) {
  EXPECT_EQ(errors_of(with("[overrun]\nn = 9\nm = 5")),
            "arm/x.toml:5: overrun.n: is more than m "
            "(the policy stops after n late cycles of the last m)\n");
}

TEST(Experiment, SuggestsTheNearestKey) {
  EXPECT_EQ(errors_of(with("perod_ns = 1000000")),
            "arm/x.toml:4: perod_ns: unknown key (did you mean 'period_ns'?)\n");
}

class ExperimentFiles : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  const test::ScratchFolder folder_;
};

TEST_F(ExperimentFiles, FindTheRobotBesideThem) {
  write("robot.toml", kRobot);
  write("arm.urdf", kUrdf);
  const auto e = read_experiment(write("x.toml", kExperiment));
  ASSERT_TRUE(e.has_value()) << e.error()[0].to_string();
  EXPECT_EQ(e->robot.name, "arm");
  EXPECT_EQ(e->robot.joints[0].max_position_rad, 2.0) << "from the description";
}

TEST_F(ExperimentFiles, NameAMissingDescription) {
  write("robot.toml", kRobot);
  const auto e = read_experiment(write("x.toml", kExperiment));
  ASSERT_FALSE(e.has_value());
  EXPECT_EQ(e.error()[0].file, folder_ / "arm.urdf");
}

TEST_F(ExperimentFiles, SuggestTheDescriptionsJoint) {
  write("robot.toml", kRobot);
  write("arm.urdf", replaced(kUrdf, "\"elbow\"", "\"ellbow\""));
  const auto e = read_experiment(write("x.toml", kExperiment));
  ASSERT_FALSE(e.has_value());
  EXPECT_EQ(e.error()[0].to_string(), (folder_ / "robot.toml") +
                                          ":22: joint.elbow: the description has no joint "
                                          "'elbow' (did you mean 'ellbow'?)");
}

TEST_F(ExperimentFiles, ReportTheErrorsOfBothFiles) {
  write("arm.urdf", kUrdf);
  write("robot.toml", replaced(kRobot, "kp = 6", "kp = -6"));
  const auto e = read_experiment(write("x.toml", with("perod_ns = 1")));
  ASSERT_FALSE(e.has_value());
  ASSERT_EQ(e.error().size(), 2u);
  EXPECT_EQ(e.error()[0].key, "perod_ns");
  EXPECT_EQ(e.error()[1].key, "gains.motor.position.kp");
  EXPECT_EQ(e.error()[1].file, folder_ / "robot.toml");
}

TEST_F(ExperimentFiles, ReportARobotsErrorsAndThoseAgainstItsDescriptionTogether) {
  write("arm.urdf", kUrdf);
  const std::string wrong = replaced(kRobot, "name = \"elbow\"", "name = \"elbwo\"");
  const auto robot =
      robot::read_complete_robot(write("robot.toml", replaced(wrong, "kp = 6", "kp = -6")));
  ASSERT_FALSE(robot.has_value());
  std::string all;
  for (const Error& error : robot.error())
    all += std::to_string(error.line) + " " + error.key + "\n";
  EXPECT_EQ(all, "15 gains.motor.position.kp\n22 joint.elbwo\n");
  EXPECT_EQ(robot.error()[1].hint, "did you mean 'elbow'?");
}

TEST_F(ExperimentFiles, NameAMissingRobot) {
  const auto e = read_experiment(write("x.toml", kExperiment));
  ASSERT_FALSE(e.has_value());
  EXPECT_EQ(e.error()[0].file, folder_ / "robot.toml");
}

TEST_F(ExperimentFiles, NameThemselvesWhenMissing) {
  const auto e = read_experiment(folder_ / "no.toml");
  ASSERT_FALSE(e.has_value());
  EXPECT_EQ(e.error()[0].file, folder_ / "no.toml");
}

TEST_F(ExperimentFiles, TakeLimitsFromTheRobotWhereTheDescriptionHasNone) {
  write("arm.urdf",
        replaced(kUrdf, "<limit lower=\"-1\" upper=\"2\" velocity=\"3\" effort=\"4\"/>", ""));
  const auto none = robot::read_complete_robot(write("robot.toml", kRobot));
  ASSERT_FALSE(none.has_value());
  EXPECT_EQ(none.error()[0].to_string(),
            (folder_ / "robot.toml") +
                ":22: joint.elbow: neither this file nor the description gives a "
                "limit (the joint at " +
                (folder_ / "arm.urdf") +
                ":4 has no <limit>) (set min_position_rad, "
                "max_position_rad, max_velocity_rad_s and max_torque_Nm)");
  EXPECT_EQ(none.error().size(), 1u) << "one <limit> is missing";
  const auto given = robot::read_complete_robot(
      write("robot.toml", replaced(kRobot, "board = \"board\"",
                                   "board = \"board\"\nmin_position_rad = -2\n"
                                   "max_position_rad = 2\nmax_velocity_rad_s = 3\n"
                                   "max_torque_Nm = 4")));
  ASSERT_TRUE(given.has_value()) << given.error()[0].to_string();
  EXPECT_EQ(given->config.joints[0].min_position_rad, -2.0);
}

TEST_F(ExperimentFiles, ReportAWrongMassOfALinkWithoutWhatFollowsForItsInertia) {
  write("arm.urdf", kUrdf);
  const auto robot = robot::read_complete_robot(
      write("robot.toml", replaced(kRobot, "[actuator.motor]",
                                   "[model.link.upper]\nmass_kg = -2\n"
                                   "inertia_kg_m2 = [1, 0, 0, 1, 0, 1.5]\n[actuator.motor]")));
  ASSERT_FALSE(robot.has_value());
  ASSERT_EQ(robot.error().size(), 1u) << robot.error()[1].to_string();
  EXPECT_EQ(robot.error()[0].key, "model.link.upper.mass_kg");
}

TEST_F(ExperimentFiles, ReportControllersInATableOfAnotherNameOnce) {
  write("arm.urdf", kUrdf);
  write("robot.toml", kRobot);
  const auto e =
      read_experiment(write("x.toml", replaced(kExperiment, "[[controller]]", "[[controllers]]")));
  ASSERT_FALSE(e.has_value());
  ASSERT_EQ(e.error().size(), 1u) << e.error()[1].to_string();
  EXPECT_EQ(e.error()[0].hint, "did you mean 'controller'?");
}

TEST_F(ExperimentFiles, TakeMassAndInertiaFromTheRobot) {
  write("arm.urdf", replaced(kUrdf, "izz=\"1\"", "izz=\"9\""));
  EXPECT_FALSE(robot::read_complete_robot(write("robot.toml", kRobot)).has_value());
  const auto given = robot::read_complete_robot(
      write("robot.toml", replaced(kRobot, "[actuator.motor]",
                                   "[model.link.upper]\nmass_kg = 2\n"
                                   "inertia_kg_m2 = [1, 0, 0, 1, 0, 1.5]\n[actuator.motor]")));
  ASSERT_TRUE(given.has_value()) << given.error()[0].to_string();
  EXPECT_EQ(given->description.tree.bodies[1].inertia.mass_kg, 2.0);
  EXPECT_EQ(given->description.tree.bodies[1].inertia.about_com_kg_m2(2, 2), 1.5);
  const auto unknown = robot::read_complete_robot(write(
      "robot.toml",
      replaced(kRobot, "[actuator.motor]", "[model.link.uper]\nmass_kg = 2\n[actuator.motor]")));
  ASSERT_FALSE(unknown.has_value());
  EXPECT_EQ(unknown.error()[0].to_string(), (folder_ / "robot.toml") +
                                                ":5: model.link.uper: the description has no link "
                                                "'uper' (did you mean 'upper'?)");
}

TEST_F(ExperimentFiles, RepairInertiasWhenTheRobotSaysSo) {
  write("arm.urdf", replaced(kUrdf, "izz=\"1\"", "izz=\"9\""));
  const auto repaired = robot::read_complete_robot(
      write("robot.toml",
            replaced(kRobot, "base = \"fixed\"", "base = \"fixed\"\ninertia = \"repair\"")));
  ASSERT_TRUE(repaired.has_value()) << repaired.error()[0].to_string();
  EXPECT_EQ(std::ranges::count(repaired->description.warnings, "link upper", &Error::key), 1)
      << "and one that the link is smaller than its inertia";
}

}  // namespace
}  // namespace tandem::runtime
