// The command line of `tandem`, read into plain options. `tandem --help` is its documentation.
// Layer: apps/command_line.  Thread: main.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "apps/command_line/control_target.hpp"
#include "apps/command_line/dds_place.hpp"
#include "apps/control/command_rows.hpp"
#include "apps/text/console.hpp"
#include "runtime/run/overrides.hpp"

namespace tandem::runtime {
struct Trunk;
}

namespace tandem::apps {

/// tandem run EXPERIMENT
/// --studio and its like.
struct StudioOptions {
  bool wanted = false;
  std::optional<std::uint16_t> port{};  ///< empty: the first that is free from 8642 on; 0: any
  std::string address = "127.0.0.1";    ///< where it listens
  std::string page{};                   ///< folder of the page; empty: the program's own
  std::vector<std::string> origins{};   ///< of pages elsewhere that may look by Foxglove's protocol
};

struct RunOptions : runtime::Overrides {
  RunOptions() { trace_cycles = 10'000; }

  std::string experiment;
  std::string log_folder;  ///< empty: the experiment's
  bool no_log = false;
  bool once = false;          ///< ends when an owner gives the robot back
  std::string record_frames;  ///< file of the bus' frames; empty: none
  bool report = false;        ///< draw the report after the run
  bool gate = false;          ///< controllers under the traps of `controller check`
  std::string trace;          ///< file of trace events, of the last `trace_cycles`; empty: none
  bool quiet = false;         ///< neither progress nor table
  std::string json;           ///< file, "-" for standard output, empty for none
  std::string socket;         ///< of the run's control; empty: default_control_path("run")
  bool no_socket = false;
  bool waits_for_start = false;                    ///< touches no robot before somebody asks for it
  std::optional<std::size_t> checkpoints_bytes{};  ///< to go back in time by; empty: where useful
  std::string from{};  ///< "LOG@12.3s": goes on from there; empty: from the beginning
  StudioOptions studio{};
  // For one of many runs that differ in `later` rows alone; no flags of the command line.
  std::shared_ptr<const runtime::Trunk> trunk{};  ///< goes on from a state of it, where one fits
  std::string
      lacks_kernels{};       ///< is made where no kernels fit, and none are built; empty: they are
  std::string trunk_file{};  ///< gets the states of this one, in which those rows never come
};

/// tandem serve EXPERIMENT|ROBOT
struct ServeOptions {
  RunOptions run;  ///< with what fits to it
};

/// A command to a running process, `tandem joint move …`: one of command_rows().
struct AskedOptions {
  const CommandRow* row = nullptr;
  /// By the keys of the row: what stood on the line; a number with a unit as it was written.
  Json given = Json::object();
  ControlTarget target{};
  std::string json{};
};

/// tandem studio: of a run that goes on; of logs
struct StudioCommandOptions {
  std::vector<std::string> logs{};  ///< one to three; empty: of a run
  ControlTarget target{};
  std::optional<std::uint16_t> port{};  ///< as StudioOptions'; empty: the run chooses
  std::string address{};                ///< empty: 127.0.0.1
  std::string page{};                   ///< empty: the run's own
  std::vector<std::string> origins{};   ///< as StudioOptions'
};

/// tandem ask QUESTION
struct AskOptions {
  std::string question;  ///< JSON
  ControlTarget target;
};

/// tandem check FILE
struct CheckOptions {
  std::string file;                     ///< an experiment or a robot
  bool bus = false;                     ///< show the load of every bus
  bool repair = false;                  ///< of a robot: as if it said inertia = "repair"
  std::vector<TomlSetting> settings{};  ///< what is otherwise than in the files
  std::string json;
};

/// tandem test PATH…
struct TestOptions {
  std::vector<std::string> paths;  ///< experiments, or folders of them
  std::size_t jobs = 0;            ///< at once; 0: as many as there are cores
  double timeout_s = 300.0;        ///< of each, on the wall clock
  std::string junit;               ///< file of JUnit's XML; empty: none
  bool quiet = false;              ///< neither progress nor table
  std::string json;
};

/// tandem sweep STUDY; tandem sweep status|collect|cancel FOLDER
struct SweepOptions {
  enum class Action : std::uint8_t { kRun, kStatus, kCollect, kCancel };
  Action action = Action::kRun;
  std::string study;                ///< study.toml
  std::string folder;               ///< of what it comes to; empty: sweeps/STUDY
  std::size_t jobs = 0;             ///< points at once; 0: as many as there are cores
  double at_least = 0.0;            ///< share of points that have to pass, or the status is 1
  std::string kernel_variant;       ///< of every point; empty: as the folder, else this CPU's best
  bool slurm = false;               ///< submit it instead
  bool dry_run = false;             ///< of `slurm`: print what would be submitted
  std::uint64_t chunk_points = 0;   ///< of each element of an array; 0: as usual
  std::vector<std::string> sbatch;  ///< its options, without dashes
  std::optional<std::uint64_t> chunk;  ///< run this one alone: what an element does
  bool branches = true;                ///< common beginnings are simulated once
  bool quiet = false;                  ///< neither progress nor table
  std::string json;
};

/// tandem shrink SCENARIO
struct ShrinkOptions {
  std::string scenario;      ///< an experiment that fails
  std::string output;        ///< the smaller one; empty: NAME.small.toml, here
  std::string expect;        ///< which expectation has to fail; empty: the first that does
  std::size_t jobs = 0;      ///< as TestOptions'
  double timeout_s = 300.0;  ///< as TestOptions'
  bool branches = true;      ///< common beginnings are simulated once
  bool quiet = false;        ///< neither progress nor result
  std::string json;
};

/// tandem search STUDY
struct SearchOptions {
  std::string study;         ///< as of `tandem sweep`
  std::string output;        ///< the worst point as a scenario; empty: none
  std::string expect;        ///< whose margin; empty: the least of all
  std::string method;        ///< empty: the first of search_methods()
  std::string along;         ///< key of a phase sweep; empty: the only one
  std::string limit;         ///< instead: key whose values are scaled until it fails
  double up_to = 0.0;        ///< greatest factor of `limit`
  std::string svg;           ///< file of its picture; empty: none
  std::size_t halvings = 5;  ///< of the interval in which its limit lies
  std::size_t runs = 200;    ///< at most
  std::uint64_t seed = 1;    ///< of the method
  std::size_t jobs = 0;      ///< as TestOptions'
  bool branches = true;      ///< common beginnings are simulated once
  bool quiet = false;        ///< neither progress nor result
  std::string json;
};

/// tandem replay LOG
struct ReplayCommandOptions {
  std::string log;
  std::vector<std::pair<std::string, std::string>> plugins;  ///< --plugin NAME=FILE
  std::string output;          ///< log of what is commanded; empty: with plugins beside `log`
  bool watch = false;          ///< once more whenever a plugin's file changes
  std::optional<double> to_s;  ///< the last cycle is not later
  bool no_build = false;       ///< missing kernels are an error
  bool quiet = false;          ///< no table
  std::string json;
};

/// tandem controller check PLUGIN
struct ControllerCheckOptions {
  std::string plugin;            ///< shared library
  std::string robot;             ///< robot.toml; empty: a bundled one
  std::string experiment;        ///< instead of robot and parameters; one of its controllers is it
  std::vector<std::string> set;  ///< parameters, "depth_rad = 0.1"
  double seconds = 2.0;          ///< simulated, under the controllers
  bool quiet = false;
  std::string json;
};

/// tandem emulate ROBOT|EXPERIMENT
struct EmulateOptions {
  std::string file;                       ///< a robot, or an experiment for posture, seed and [sim]
  std::optional<std::string> posture;     ///< instead of the experiment's
  std::optional<std::uint64_t> seed;      ///< instead of the experiment's
  std::optional<std::int64_t> period_ns;  ///< instead of the experiment's
  bool lockstep = false;                  ///< a step per SYNC, whatever the clock says
  std::string scenario;                   ///< TOML of faults to inject; empty: none
  std::vector<std::string> interfaces;    ///< "can0=vcan0"
  std::string kernel_variant;             ///< empty: the best that this CPU runs
  bool no_build = false;                  ///< missing kernels are an error
  std::string socket;                     ///< of the control socket; empty: the default path
  bool no_socket = false;
  bool quiet = false;  ///< neither progress nor table
  std::string json;
  StudioOptions studio{};
};

/// tandem model build|info|ros2 ROBOT
struct ModelOptions {
  enum class Action : std::uint8_t { kBuild, kInfo, kRos2 } action = Action::kBuild;
  std::string robot;   ///< robot.toml
  std::string output;  ///< library; empty: beside `tandem` or in the cache. kRos2: folder; empty:
                       ///< the package's name
  std::string controller = "trajectory";  ///< kRos2: whose action moves the robot
  std::string kernel_variant;
  bool force = false;
  std::string json;
};

/// tandem new URDF
struct NewOptions {
  std::string urdf;
  std::string output;             ///< folder; empty: the description's name, here
  std::string like;               ///< a bundled robot or a robot.toml; empty: rigid drives
  std::string base;               ///< "floating", "fixed"; empty: found out
  std::vector<std::string> lock;  ///< "JOINT" or "JOINT=0.5" [rad or m]
  std::vector<std::string> drop;  ///< links or joints: they and what hangs on them are left out
  double density_kg_m3 = 0.0;     ///< of links that have shapes and no mass; 0: they stay so
  bool dynamics = false;          ///< the description's damping goes into the drives
  bool force = false;             ///< write into a folder that exists
  std::string json;
};

/// tandem controller new NAME
struct ControllerNewOptions {
  std::string name;                       ///< of the controller, its class and its files
  std::string robot = "double_pendulum";  ///< that it moves: a bundled one, or a robot.toml
  std::string output;                     ///< folder; empty: the name, here
};

/// tandem log info|csv|export|diff LOG [LOG_B], tandem log import FILE..., tandem log thresholds
/// LOG...
struct LogOptions {
  enum class Action : std::uint8_t {
    kInfo,
    kCsv,
    kDiff,
    kImport,
    kReplay,
    kThresholds,
    kExport
  } action = Action::kInfo;
  double alarms_per_hour = 1.0;  ///< thresholds: false ones, of all joints together
  double from_s = 0.0;           ///< thresholds: leave out what was before, of the log's time
  std::string log;
  std::string other;                ///< diff: the log that `log` is compared with
  std::string topic;                ///< csv: empty is the state; info: whose fields are listed
  std::vector<std::string> fields;  ///< empty: all
  std::vector<std::string> topics;  ///< export: empty: all
  double rate_Hz = 0.0;             ///< export: of images
  std::size_t every = 1;            ///< n: each n-th message
  std::string output;  ///< csv: empty is standard output; export: beside the log; import: runs/;
                       ///< replay: experiment; thresholds: a folder, or empty
  std::vector<std::string> files;        ///< import: tables or bags; thresholds: runs to learn from
  std::vector<std::string> against;      ///< thresholds: other runs
  std::string robot;                     ///< import, replay: robot.toml
  std::string map;                       ///< import: what the columns or topics mean
  std::string source;                    ///< replay: "command", "state"; empty: what the log has
  std::string posture;                   ///< replay: to start from; empty: the recording's
  std::vector<std::string> joints;       ///< replay: that are led, as given; empty: all
  std::optional<double> begin_s, end_s;  ///< replay, export: of the log's time
  double speed = 1.0;                    ///< replay: times as fast as recorded
  bool torque = false;                   ///< replay: torques as feed-forward
  std::string json;
};

/// tandem eds ROBOT, tandem eds show SHEET
struct EdsOptions {
  enum class Action : std::uint8_t { kWrite, kShow } action = Action::kWrite;
  std::string robot;                      ///< robot.toml
  std::string sheet;                      ///< show: EDS, DCF or ESI
  std::optional<std::uint32_t> product;   ///< show: which device of an ESI
  std::optional<std::uint32_t> revision;  ///< show: the same
  std::string output = "eds";             ///< folder
  std::string json;
};

/// tandem report LOG [LOG_B [LOG_C]]
struct ReportOptions {
  std::string log;
  std::vector<std::string> others;  ///< up to two, laid over `log`
  std::string output;               ///< folder; empty: beside the log
  std::optional<int> after_run;     ///< drawn by `run --report`, which ends with this status
  std::string interrupted;          ///< is said when a signal ends it; empty: as of any draft
  bool quiet = false;               ///< says not where it is
  std::string json;
};

/// tandem identify LOG…
struct IdentifyOptions {
  std::vector<std::string> logs;
  std::string robot;        ///< robot.toml: the description to start from
  std::string output;       ///< folder
  double cutoff_Hz = 10.0;  ///< of the low pass over every signal
  std::string json;
};

/// tandem excite ROBOT
struct ExciteOptions {
  std::string robot;                ///< robot.toml
  std::string output;               ///< experiment; "-" for standard output
  std::string posture;              ///< start; empty: the robot's first, else every joint at 0
  std::vector<std::string> joints;  ///< that move, as given; empty: all that can
  double period_s = 0.0;            ///< of the series; 0: 10, of a robot that hangs 3
  int periods = 0;                  ///< 0: 3, of a robot that hangs 20
  int harmonics = 5;
  std::uint64_t seed = 1;
  double share = 0.7;  ///< of limits of speed and torque that are used
  int tries = 0;       ///< candidates; 0: 300, of many joints 60
  bool hung = false;   ///< from its hoist
  std::string json;
};

/// tandem latency
struct LatencyOptions {
  std::int64_t period_us = 1000;
  double duration_s = 30.0;   ///< per load
  std::string mode = "swap";  ///< swap, together, turns
  int slices = 10;
  std::vector<int> cpus;        ///< empty: the first two that may be used
  std::string policy = "fifo";  ///< fifo, rr, other
  int priority = 80;
  std::string load;  ///< idle, stress, both; empty: both with stress-ng, else idle
  std::string output = "runs/latency";  ///< folder of plots and page
  bool quiet = false;
  std::string json;
};

/// tandem bench engines
struct BenchOptions {
  std::vector<std::string> engines;   ///< besides Tandem's own; empty: all that are installed
  std::vector<std::string> scenes;    ///< empty: all
  std::string output = "runs/bench";  ///< folder of the page and its figures
  bool quiet = false;
  std::string json;
};

/// tandem doctor [ROBOT]
struct DoctorOptions {
  std::string robot;                    ///< robot.toml, whose buses are looked at; may be empty
  std::vector<std::string> interfaces;  ///< "can0=vcan0"
  std::string root = "/";               ///< of the files that are read
  std::string fix;                      ///< folder for files that do what is advised; empty: none
  std::string json;
};

/// tandem topic list|echo|hz
struct TopicOptions {
  enum class Action : std::uint8_t { kList, kEcho, kHz } action = Action::kList;
  std::string topic;  ///< echo, hz: "/joint_states"
  DdsPlace place;
  std::optional<double> wait_s;        ///< for discovery; empty: 1 (list), 5 (echo, hz)
  std::optional<std::uint64_t> count;  ///< echo, hz: samples, then it ends
  std::string field;                   ///< echo: "position[2]"; empty: all
  bool all = false;                    ///< list: not only ROS 2's topics
  std::size_t window = 10'000;         ///< hz: intervals that the rate is of
  std::string json;
};

/// What was asked for; an `Exit` when nothing is left to do (help, version, wrong usage).
// clang-format off: one a line, so that additions meet without conflict
using Command =
    std::variant<Exit, RunOptions, ServeOptions, AskOptions, AskedOptions, CheckOptions,
                 ModelOptions, NewOptions, LogOptions, EdsOptions, ReportOptions, IdentifyOptions,
                 ExciteOptions, LatencyOptions, DoctorOptions, EmulateOptions, TopicOptions,
                 BenchOptions, ControllerCheckOptions, ControllerNewOptions, StudioCommandOptions,
                 TestOptions, SweepOptions, ReplayCommandOptions, ShrinkOptions, SearchOptions>;
// clang-format on

/// Prints help and version on standard output, usage errors on standard error: with the nearest
/// flag or subcommand for one that does not exist.
[[nodiscard]] Command parse_command_line(int argc, const char* const* argv);

}  // namespace tandem::apps
