// An experiment as its TOML describes it: which robot, for how long, with which controllers.
// Plain data. docs/configuration.md documents each key.
// Layer: runtime.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <expected>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "base/toml_reader.hpp"
#include "dds/config.hpp"
#include "estimation/config.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/sim_robot.hpp"
#include "model/urdf.hpp"
#include "robot/complete_robot.hpp"
#include "rt/cyclic_loop.hpp"
#include "rt/thread_setup.hpp"
#include "runtime/after_stop.hpp"
#include "runtime/condition/expectation_spec.hpp"
#include "runtime/controller_spec.hpp"
#include "runtime/event_spec.hpp"
#include "runtime/fall_watch.hpp"
#include "runtime/teleoperation.hpp"

namespace tandem::runtime {

/// [hal] backend
enum class BackendKind : std::uint8_t {
  kSim,
  kWire,  ///< the robot's buses, CAN and EtherCAT
  kDds,
};

/// [hal]: what stands for the robot, and how the loop and it go together.
struct HalOptions {
  BackendKind backend = BackendKind::kSim;
  std::string wire = {};           ///< kWire: "can" or "ethercat", as it was asked for
  bool lockstep = false;           ///< "can": wait for an emulated robot's answers, at any speed
  double answer_window = 0.5;      ///< "can" in real time: share of the period to wait for answers
  std::uint32_t delay_cycles = 0;  ///< between the controllers and the limits
  double settle_s = 0.0;           ///< every joint is held, from enabled until controllers start
};

/// [sim]. Its `order` and `noise` are already applied to Experiment::robot.
struct SimOptions {
  std::string engine = sim::kOwnEngine;  ///< who moves the bodies
  sim::Integrator integrator = sim::Integrator::kLeapfrog;
  std::int64_t substep_ns = 250'000;  ///< divides the period and every board's control period
  int order = -1;                     ///< 0 to 3 for every actuator; -1: as robot.toml says
  bool noise = true;                  ///< false: sensors and torque measurement without noise
  bool ground_truth = true;           ///< log the plant's true state beside the measured one
  bool hoist = true;                  ///< hold base and joints until every drive is enabled
  bool bus_timing = false;            ///< frames take the time that they need on a real bus
  std::int64_t bus_latency_ns = 0;    ///< with it: of every node's driver or firmware
  double hoist_release_s = 1.0;       ///< then let the base down over this time
  double hoist_lift_m = 0.0;          ///< not 0: it hangs so much higher, to the end
};

/// [remote]: what peers may ask over DDS. Reading, and stopping the robot, they may always.
enum class RemoteAccess : std::uint8_t {
  kOff,      ///< nothing that changes the run
  kLocal,    ///< everything; nobody on another machine can reach it, or the files are refused
  kNetwork,  ///< everything, from wherever [dds] reaches
};
/// Whose commands those are. DDS knows no users; DDS Security, and the control socket, do.
enum class RemoteTrust : std::uint8_t {
  kAdmitted,  ///< participants that this user, or root, has admitted over the control socket
  kDomain,    ///< everybody in the domain
};
struct RemoteOptions {
  std::optional<RemoteAccess> command{};  ///< empty: off in `run`, local in `serve`
  std::optional<RemoteTrust> trust{};     ///< empty: the domain where DDS Security keeps it
  bool load = false;                      ///< controllers may be loaded over DDS, by name
  // Settings for an owner (docs/remote.md).
  bool lockstep = false;               ///< each cycle waits for its command
  double lease_timeout_s = 1.0;        ///< one that is silent for so long has lost the robot
  double lockstep_timeout_s = 60.0;    ///< that a cycle waits for a command
  std::uint64_t max_age_cycles = 100;  ///< of the state that a command answers
  hal::StopCategory on_lost = hal::StopCategory::kWarn;  ///< kWarn: every joint is held
};

/// [log]
enum class LogCompression : std::uint8_t { kNone, kLz4, kZstd };
/// Whose files the limits of [log] are for.
enum class LogBudget : std::uint8_t { kRun, kExperiment };
struct LogConfig {
  std::string folder = "runs";  ///< relative to the working directory
  LogCompression compression = LogCompression::kNone;
  /// Cycles whose number is a multiple are logged; 0: none.
  std::uint32_t state_every = 1, command_every = 1, truth_every = 1, estimate_every = 1;
  std::vector<std::string> without{};  ///< "state.acceleration_rad_s2"
  bool viewers = true;                 ///< the topics of ROS viewers
  double file_MB = 0.0;                ///< messages of one file; 0: no limit
  double total_MB = 0.0;               ///< of all files of the run; 0: no limit
  double keep_free_MB = 0.0;           ///< that the disk keeps
  double keep_free_share = 0.0;        ///< the same of its size
  double file_s = 0.0;                 ///< log time of one file; 0: no limit
  double total_s = 0.0;                ///< log time after which a file is removed; 0: no limit
  double keep_before_fault_s = 120.0;  ///< of log time, whose files are never removed
  LogBudget budget = LogBudget::kRun;
};

/// [report]: what the four plots show. Empty: the report chooses.
struct ReportConfig {
  std::string position_of;  ///< joint whose position is drawn, with its reference
  std::string torque_of;    ///< joint whose torque is drawn, beside inverse dynamics
  std::string foot;         ///< force/torque sensor
};

/// [parallel]: a second robot, simulated in this process, that gets what the first one gets.
struct ParallelOptions {
  std::string robot_file;  ///< resolved; the experiment's own unless it says another
  hal::RobotConfig robot;  ///< with [parallel.link.NAME]; to be completed with those
};

/// The length of a run that has no end: it runs until it is stopped.
inline constexpr double kEndless_s = std::numeric_limits<double>::infinity();

/// The whole experiment.toml with the robot it names.
struct Experiment {
  std::string file;        ///< the TOML's path
  std::string robot_file;  ///< resolved against the TOML's folder
  hal::RobotConfig robot;  ///< completed from its description
  robot::FileTexts files;  ///< all that was read, the TOML itself first; with what was set
  std::vector<std::string> settings;  ///< what of it is otherwise than in the files: "--set …"
  std::shared_ptr<const model::UrdfModel> description;  ///< null when none was read
  double duration_s = 0.0;  ///< that controllers run, after the bring-up; or kEndless_s
  std::uint64_t seed = 1;
  std::string posture;         ///< where the robot starts; empty: every joint at 0
  std::string kernel_variant;  ///< empty: the best that this CPU runs
  HalOptions hal;
  SimOptions sim;
  rt::CyclicLoopConfig loop;  ///< period, [overrun] and [clock]; the caller sets the pacing
  rt::ThreadConfig thread;    ///< [realtime]; nothing is asked for without that table
  std::optional<AfterStop> after_stop;  ///< [faults]; empty: wait on the wall clock, else end
  AfterReset after_reset = AfterReset::kHold;  ///< [faults]
  double retreat_s = 5.0;                      ///< [faults]: at most, in a stop of category 2
  hal::StopCategory on_stray = hal::StopCategory::kWarn;  ///< [faults] stray_writes
  bool falls_are_faults = true;                           ///< [faults] fall = "stop", or "allow"
  std::optional<double> watchdog_s;  ///< [faults]; empty: 0.5 on the wall clock, else 5
  RemoteOptions remote;
  std::optional<Teleoperation> teleoperation;  ///< empty: the robot is at hand
  LogConfig log;
  ReportConfig report;
  estimation::EstimationConfig estimation;         ///< nothing without the table
  std::shared_ptr<const sim::PlantChanges> plant;  ///< [sim.link] and its like; null: none
  std::optional<ParallelOptions> parallel;         ///< empty: there is no second robot
  dds::Config dds;                                 ///< off without the table
  std::vector<ExpectationSpec> expectations;       ///< [[expect]]
  std::vector<sim::ScenarioFault> faults;          ///< [[push]] and [[fault]] at a time
  std::vector<std::string> fault_rows;             ///< of each of those: "push[0]"
  std::vector<EventSpec> events;                   ///< [[event]], and those at a condition
  std::vector<std::string> pushes;                 ///< names of [[push]] and kind = "push"
  std::vector<DueRow> due;                         ///< those of all these rows that have a time
  std::vector<std::string> happens;                ///< every one of these rows, for people
  std::vector<ControllerSpec> controllers;
  TomlDocument document;  ///< its diagnostics() grow while controllers read parameters

  /// The description's tree; null when none was read.
  [[nodiscard]] std::shared_ptr<const model::Tree> tree() const;
  [[nodiscard]] bool endless() const { return duration_s == kEndless_s; }
  /// Cycles that controllers run: duration over period, rounded; 0 in a run without an end.
  [[nodiscard]] std::uint64_t cycles() const;
  /// Cycles that every joint is held before they do: settle_s over period, rounded up.
  [[nodiscard]] std::uint64_t settle_cycles() const;
  /// When its robot has fallen: of one with a floating base and feet, unless falls are allowed.
  [[nodiscard]] FallLimits fall_limits() const;
  /// How to simulate it, with the seed and the period as they are now.
  [[nodiscard]] sim::SimRobotConfig sim_robot_config() const;
};

/// Reads an experiment, its robot and the robot's description. Errors, all of the files at once:
/// as TOML's, read_robot_config()'s and complete_robot()'s; a period of 0; periods and sub-step
/// that do not divide; an unknown posture, joint or sensor; a backend that this version lacks; no
/// controller, or two of a name.
/// @param settings  what is otherwise than in the file; those of "robot.…" in its robot.toml
[[nodiscard]] std::expected<Experiment, Diagnostics> read_experiment(
    const std::string& file, std::vector<TomlSetting> settings = {});

/// The same from memory, for a robot at hand: `robot = …` of the text is not followed, and the
/// robot stays as it is.
[[nodiscard]] std::expected<Experiment, Diagnostics> parse_experiment(
    std::string_view text, const std::string& file, const hal::RobotConfig& robot);

}  // namespace tandem::runtime
