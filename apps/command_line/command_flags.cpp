#include "apps/command_line/command_flags.hpp"

#include <limits>
#include <optional>
#include <string>

#include "rt/clock_control.hpp"

namespace tandem::apps {
namespace {

const char kServeExamples[] = R"(Examples:
  tandem serve config/coman/squat.toml                          in one terminal, and in another
  tandem run config/coman/squat.toml --hal dds                  in real time: serve --realtime
  tandem serve config/coman/squat.toml --lockstep --once        the same bits as in one process:
  tandem run config/coman/squat.toml --hal dds --lockstep
  tandem serve config/coman/robot.toml --hal can                the robot itself
[remote] of the experiment: who may command, and the reaction when an owner vanishes.)";

const char kRunExamples[] = R"(Examples:
  tandem run config/coman/squat.toml --report        and draw the plots
  tandem run config/coman/squat.toml --rate 0.1      ten times slower than real time
  tandem run config/coman/squat.toml --start-paused  then `tandem clock step 10`, `clock resume`
  tandem run config/coman/squat.toml --studio        look at it in a browser, while it runs
  tandem run config/coman/squat.toml --dds --realtime      publish to ROS 2 and `tandem topic`
  tandem run config/coman/squat.toml --hal dds       the robot of `tandem serve`
  tandem run config/coman/squat.toml --seed 7 --log /tmp/runs
  tandem run config/suite/coman_push.toml --set 'push[0].impulse_Ns[0]=-4'  another value
  tandem run config/coman/squat.toml --json - --quiet | jq .realtime_factor
  tandem run config/coman/squat.toml --trace squat.json    open it on https://ui.perfetto.dev
The same experiment and seed give the same bytes at every rate.)";

const char kAskExamples[] = R"(Examples:
  tandem ask '{"do": "help"}'                        what the running process can be asked
  tandem ask '{"do": "status"}' --socket /tmp/run.sock
  tandem ask '{"do": "status"}' --dds --domain 7     of the only run in that DDS domain
Without --socket or --dds it is the only running process of this user.)";

const char kTestExamples[] = R"(Examples:
  tandem test config/suite/coman_squat.toml          one experiment
  tandem test config/suite --junit results.xml       every experiment of a folder that expects something
  tandem test config --jobs 1 --timeout 60

Each runs in simulation, without the wall clock, in a process of its own: a crash or a hang costs
that one. The exit status is 1 when one fails. docs/expectations.md)";

const char kCheckExamples[] = R"(Examples:
  tandem check config/coman/squat.toml               an experiment: robot, description, plugins
  tandem check config/coman/robot.toml               a robot by itself
  tandem check --bus config/coman/squat.toml         the load of every bus, worst case
  tandem check my_robot.toml --repair                what inertia = "repair" would make of it
  tandem check my_robot.toml --json -                errors with file, line, key and hint)";

const char kControllerCheckExamples[] = R"(Examples:
  tandem controller check ./nod.so --experiment nod.toml
  tandem controller check ./nod.so --robot robot.toml --set 'joint = "joint2"' --set 'depth_rad = 0.3'
It runs on a simulated robot: no heap, lock, system call, thread or page fault in its calls, and the
same commands once more after a rewind. Exit status: 0 every rule is kept; 1 one is broken, or the
run ended in a fault. docs/controllers.md#controller-check)";

const char kNewExamples[] = R"(Examples:
  tandem new my_robot.urdf                           writes my_robot/, then
  tandem run my_robot/hold.toml                      the robot holds a posture, or stands
  tandem new my_robot.urdf --like coman -o soft      springs and ground in proportion to COMAN's
  tandem new my_robot.urdf --base fixed --force
  tandem new my_robot.urdf --lock caster --drop gripper_base_link
  tandem new my_arm.urdf --density 2700              an arm whose links have no masses, as aluminium
Every figure that is guessed is marked so in robot.toml. Rules: docs/robots.md.)";

const char kControllerNewExamples[] = R"(Examples:
  tandem controller new nod                          writes nod/: source, tests, experiment, build
  cd nod && cmake --workflow --preset run            builds and tests it, and runs it
  tandem controller new reach --robot panda          on another robot
  tandem controller new reach --robot my/robot.toml -o controllers/reach)";

const char kEdsExamples[] = R"(Examples:
  tandem eds config/coman/robot.toml                 data sheets of its boards and sensors into eds/
  tandem eds my_robot.toml -o sheets --json -        the files and the nodes that each is for
  tandem eds show drive.eds                          what the drive of a sheet is and can)";

const char kEdsShowExamples[] = R"(Examples:
  tandem eds show drive.eds                          identity, modes, PDOs, units, oddities
  tandem eds show drive.dcf --json - | jq .modes     the same for programs
  tandem eds show maker.xml --product 0x200          a device of an EtherCAT maker's file (ESI))";

const char kLatencyExamples[] = R"(Examples:
  tandem latency                                     ours beside cyclictest, idle, then under load
  tandem latency --load idle --duration 60 --cpu 2,3
  tandem latency --mode turns --cpu 3                one after the other on one CPU
  tandem latency --json - --quiet | jq '.loads[].ratio'
In mode `swap` both run at once and exchange their CPUs each slice; in `together` each keeps its
own. cyclictest is in Debian's rt-tests; the load is made by stress-ng. The result is not judged.)";

const char kDoctorExamples[] = R"(Examples:
  tandem doctor                                      kernel, CPUs, interrupts, limits, memory
  tandem doctor config/coman/robot.toml              and the interfaces of its buses
  tandem doctor config/coman/robot_ethercat.toml     and the slaves behind an EtherCAT interface
  tandem doctor --fix fixes                          what it advises, as files to look at
  tandem doctor --json - | jq '.findings[] | select(.health != "ok")'
Each finding comes with the command that fixes it. The exit status does not depend on them.)";

const char kNoBuildHelp[] = "Refuse when the robot's kernels are missing, instead of building them";
const char kInterfaceHelp[] = "Another interface than robot.toml's: can0=vcan0; may be repeated";

const char kScenarioHelp[] = "Faults to inject: TOML (docs/configuration.md, scenario.toml)";

const char kEmulateExamples[] = R"(Examples:
  tandem emulate config/coman/squat.toml --lockstep        in one terminal, and in another
  tandem run config/coman/squat.toml --hal can --lockstep  the same bits as without --hal can
  tandem emulate config/coman/robot.toml                   in real time, for `run --hal can`
  tandem emulate config/coman/robot.toml --studio          and the robot in a browser
Its studio shows the simulated robot and its boards, and leads nothing: control is on the other side
of the wire, `tandem run … --hal can --studio`.
Interfaces without hardware:
  ip link add can0 type vcan && ip link set can0 mtu 72 up)";

CLI::Validator is_rate() {
  const auto check = [](const std::string& text) -> std::string {
    double rate = -1.0;
    if (CLI::detail::lexical_cast(text, rate) && rt::check_rate(rate)) return "";
    return "'" + text + "' is neither 0 nor from 0.01 to 1000";
  };
  return {check, "0, 0.01 to 1000"};
}

/// The length of a run: a duration, or "endless".
CLI::Validator a_run_length() {
  const auto check = [](std::string& text) -> std::string {
    const std::string problem = text == "endless" ? "" : a_duration()(text);
    return problem.empty() ? "" : problem + ", nor endless";
  };
  return {check, "above 0, to 1e6, or endless"};
}

/// --set, as often as one likes.
void add_settings(CLI::App& app, std::vector<TomlSetting>& settings) {
  const auto check = [](const std::string& text) -> std::string {
    const auto setting = read_setting(text);
    return setting ? "" : setting.error().to_string();
  };
  app.add_option_function<std::vector<std::string>>(
         "--set",
         [&settings](const std::vector<std::string>& texts) {
           for (const std::string& text : texts) settings.push_back(read_setting(text).value());
         },
         "Another value than the file's, or below \"robot\" than its robot's; may be repeated")
      ->allow_extra_args(false)
      ->check(CLI::Validator(check, ""))
      ->option_text("KEY=VALUE");
}

/// What `run` and `serve` share.
void add_loop_flags(CLI::App& app, RunOptions& o) {
  CLI::Option* rate = app.add_option("--rate", o.rate,
                                     "Simulated seconds per wall second; 0: free running (default)")
                          ->check(is_rate());
  app.add_flag_callback(
         "--realtime", [&o] { o.rate = 1.0; }, "The same as --rate 1")
      ->excludes(rate);
  app.add_flag("--start-paused", o.start_paused, "Pause before the first cycle: tandem clock step");
  app.add_option(
         "--checkpoints", o.checkpoints_bytes,
         "Memory for going back in time (tandem clock rewind), as 512MB. Without it 64MB, once "
         "the run is paced or paused, has a studio, or gets a clock command")
      ->transform(a_memory_size())
      ->option_text("SIZE");
  app.add_option("--from", o.from,
                 "Go on from a moment of a simulated run's log, which keeps its state every 5 s")
      ->option_text("LOG@TIME");
  app.add_option("--seed", o.seed, "Seed of noise, instead of the experiment's")->check(is_seed());
  add_settings(app, o.settings);
  app.add_option("--interface", o.interfaces, kInterfaceHelp);
  app.add_option("--record-frames", o.record_frames,
                 "CAN: write every frame to this file, as candump -L does");
  app.add_option("--scenario", o.scenario, kScenarioHelp)->transform(a_bundled(Bundled::kScenario));
  CLI::Option* log = app.add_option(
      "--log", o.log_folder,
      "Folder of the log, instead of the experiment's (else runs, below the current folder)");
  log->check(is_given("name a folder, or leave it out"));
  app.add_flag("--no-log", o.no_log, "Write no log")->excludes(log);
  app.add_option("--kernel-variant", o.kernel_variant,
                 "Kernels to use: baseline, x86-64-v3, … (default: the best of this CPU)");
  app.add_flag("--no-build", o.no_build, kNoBuildHelp);
  CLI::Option* trace =
      app.add_option("--trace", o.trace, "Write the last cycles' stages for ui.perfetto.dev");
  app.add_option("--trace-cycles", o.trace_cycles, "Cycles that the trace holds (default: 10000)")
      ->needs(trace)
      ->check(CLI::Range(1, 1'000'000));
  app.add_flag("--quiet,-q", o.quiet, "Neither progress nor table");
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  CLI::Option* socket = app.add_option("--socket", o.socket, kSocketHelp);
  app.add_flag("--no-socket", o.no_socket, "Open no control socket")->excludes(socket);
  add_run_studio_flags(app, o.studio);
  app.add_option("--domain", o.domain,
                 "DDS domain, instead of the experiment's (else: ROS_DOMAIN_ID, else 0)")
      ->check(CLI::Range(0, 232));
}

}  // namespace

CLI::Option* add_place(CLI::App& app, DdsPlace& place, CLI::Option* dds) {
  CLI::Option* domain =
      app.add_option("--domain", place.domain, "DDS domain (default: ROS_DOMAIN_ID, else 0)")
          ->check(CLI::Range(0, 232));
  CLI::Option* interface = app.add_option("--interface", place.interfaces,
                                          "Network interface of DDS (default: lo); may be repeated")
                               ->allow_extra_args(false);
  CLI::Option* from =
      app.add_option("--dds-from", place.from,
                     "Domain, interfaces, peers and DDS Security as [dds] of this TOML has them")
          ->excludes(domain)
          ->excludes(interface);
  if (dds != nullptr) {
    domain->needs(dds);
    interface->needs(dds);
  }
  return from;
}

void add_target(CLI::App& app, ControlTarget& target) {
  CLI::Option* socket = app.add_option("--socket", target.socket, kAskedSocketHelp);
  CLI::Option* dds =
      app.add_flag("--dds", target.dds, "Ask over DDS instead: the service tandem/ask")
          ->excludes(socket);
  add_place(app, target.place, dds)->excludes(socket)->each([&target](const std::string&) {
    target.dds = true;
  });
  app.add_option("--namespace", target.name_space,
                 "Namespace of the process (default: of the only one)")
      ->needs(dds);
}

void add_flags(CLI::App& app, RunOptions& o) {
  app.add_option("experiment", o.experiment, "Experiment: its TOML, or the name of a bundled one")
      ->required()
      ->transform(a_bundled(Bundled::kExperiment));
  add_loop_flags(app, o);
  const auto run_for = [&o](const std::string& text) {
    double seconds = std::numeric_limits<double>::infinity();  // which no number may be
    if (text != "endless") CLI::detail::lexical_cast(text, seconds);
    o.duration_s = seconds;
  };
  app.add_option_function<std::string>("--duration", run_for,
                                       "Seconds to run instead of the experiment's, or endless: "
                                       "until it is stopped, or its controllers are done")
      ->type_name("SECONDS")
      ->check(a_run_length());
  app.add_option("--hal", o.hal, "Backend: where the robot is (default: the experiment's, or sim)")
      ->check(CLI::IsMember({"sim", "can", "ethercat", "dds"}));
  app.add_flag(
      "--lockstep", o.lockstep,
      "CAN, DDS: wait for `tandem emulate --lockstep` or `serve --lockstep`, at any speed");
  app.add_option("--delay-cycles", o.delay_cycles,
                 "Whole cycles between controllers and limits (default: the experiment's, or 0)")
      ->check(CLI::Range(0, 1000));
  app.add_flag("--gate", o.gate,
               "Watch what controllers do in a cycle, as `tandem controller check` (status 1: a "
               "rule is broken)");
  app.add_flag("--debug", o.debug,
               "For work in a debugger, in simulation only: no limit of time ends a configure(), "
               "a cycle or the run (one that gdb holds is noticed without)");
  app.add_flag("--report", o.report, "Draw the report after the run, from its log")
      ->excludes("--no-log");
  app.add_option("--on-fault", o.on_fault,
                 "After a stop: end the run, or wait for `tandem fault reset` (default: wait with "
                 "boards on a bus in real time; end in simulation, with --realtime, too)")
      ->check(CLI::IsMember({"end", "wait"}));
  app.add_flag("--wait-for-start", o.waits_for_start,
               "Open no bus and enable no drive before `tandem controller start`; wait again where "
               "the drives could not be enabled")
      ->excludes("--no-socket")
      ->excludes("--from");
  CLI::Option* dds = app.add_flag_callback(
      "--dds", [&o] { o.dds = true; }, "Publish the robot to ROS 2 and `tandem topic`");
  app.add_flag_callback(
         "--no-dds", [&o] { o.dds = false; }, "No DDS, whatever the experiment says")
      ->excludes(dds)
      ->excludes("--domain");
  app.footer(kRunExamples);
}

void add_flags(CLI::App& app, ServeOptions& o) {
  app.add_option("file", o.run.experiment, "Experiment or robot: its TOML, or a bundled name")
      ->required()
      ->transform(a_bundled(Bundled::kRobotOrExperiment));
  add_loop_flags(app, o.run);
  app.add_option("--hal", o.run.hal,
                 "Backend: where the robot is (default: the experiment's, or sim)")
      ->check(CLI::IsMember({"sim", "can", "ethercat"}));
  app.add_flag("--lockstep", o.run.lockstep, "Each cycle waits for its owner's command");
  app.add_flag("--once", o.run.once, "End when an owner gives the robot back");
  app.footer(kServeExamples);
}

void add_flags(CLI::App& app, AskOptions& o) {
  app.add_option("question", o.question, "JSON object, \"do\" names the command")->required();
  add_target(app, o.target);
  app.footer(kAskExamples);
}

void add_flags(CLI::App& app, EmulateOptions& o) {
  app.add_option("file", o.file, "Robot or experiment: its TOML, or a bundled name")
      ->required()
      ->transform(a_bundled(Bundled::kRobotOrExperiment));
  app.add_flag("--lockstep", o.lockstep, "One step per SYNC, independent of the wall clock");
  app.add_option("--scenario", o.scenario, kScenarioHelp)->transform(a_bundled(Bundled::kScenario));
  app.add_option("--posture", o.posture,
                 "Start posture (default: the experiment's, or the robot's first)");
  app.add_option("--seed", o.seed, "Seed of noise (default: the experiment's, or 1)")
      ->check(is_seed());
  app.add_option("--period-ns", o.period_ns,
                 "Period of a step (default: the experiment's, or 1 ms)")
      ->check(CLI::Range(10'000, 1'000'000'000));
  app.add_option("--interface", o.interfaces, kInterfaceHelp);
  app.add_option("--kernel-variant", o.kernel_variant,
                 "Kernels to use: baseline, x86-64-v3, … (default: the best of this CPU)");
  app.add_flag("--no-build", o.no_build, kNoBuildHelp);
  CLI::Option* socket = app.add_option("--socket", o.socket, kSocketHelp);
  app.add_flag("--no-socket", o.no_socket, "Open no control socket")->excludes(socket);
  app.add_flag("--quiet,-q", o.quiet, "Neither progress nor table");
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  add_emulation_studio_flags(app, o.studio);
  app.footer(kEmulateExamples);
}

void add_flags(CLI::App& app, CheckOptions& o) {
  app.add_option("file", o.file, "Experiment or robot: its TOML, or a bundled name")
      ->required()
      ->transform(a_bundled(Bundled::kRobotOrExperiment));
  app.add_flag("--bus", o.bus, "Show the load of every bus (a robot's: at 1 kHz)");
  app.add_flag("--repair", o.repair, "Read a robot as if it said inertia = \"repair\" in [model]");
  add_settings(app, o.settings);
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  app.footer(kCheckExamples);
}

void add_flags(CLI::App& app, TestOptions& o) {
  app.add_option("paths", o.paths,
                 "Experiments with [[expect]], or folders of them; or bundled names")
      ->required()
      ->transform(a_bundled(Bundled::kTests));
  app.add_option("--jobs,-j", o.jobs, "Experiments at once (default: one for each core)")
      ->check(is_count());
  app.add_option("--timeout", o.timeout_s, "End one that takes longer [s, 300]")
      ->check(a_duration());
  app.add_option("--junit", o.junit, "Write JUnit's XML for a CI server")
      ->check(is_given(kNameAFile));
  app.add_flag("--quiet,-q", o.quiet, "Neither progress nor table");
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  app.footer(kTestExamples);
}

void add_flags(CLI::App& app, ControllerCheckOptions& o) {
  app.add_option("plugin", o.plugin, "Shared library of the controller")->required();
  CLI::Option* experiment =
      app.add_option("--experiment", o.experiment, "Experiment that has it among its controllers")
          ->transform(a_bundled(Bundled::kExperiment))
          ->check(is_given("name an experiment, or leave it out"));
  app.add_option("--robot", o.robot, "A bundled robot, or a robot.toml (default: double_pendulum)")
      ->transform(a_bundled(Bundled::kRobot))
      ->check(is_given("name a robot, or leave it out"))
      ->excludes(experiment);
  app.add_option("--set", o.set, "One of its parameters, KEY = VALUE as in TOML")
      ->allow_extra_args(false)
      ->excludes(experiment);
  app.add_option("--duration", o.seconds, "Simulated seconds under the controllers (default: 2)")
      ->check(CLI::Range(0.01, 3600.0));
  app.add_flag("--quiet,-q", o.quiet, "No table");
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  app.footer(kControllerCheckExamples);
}

void add_flags(CLI::App& app, NewOptions& o) {
  app.add_option("urdf", o.urdf, "Robot description (URDF, or .xacro where xacro is installed)")
      ->required();
  app.add_option("-o,--output", o.output, "Folder to write (default: the name of the URDF's file)");
  app.add_option("--lock", o.lock, "JOINT or JOINT=rad: it stands still there, or at 0; repeatable")
      ->allow_extra_args(false);
  app.add_option("--drop", o.drop,
                 "LINK or JOINT: leave it out with all that hangs on it; repeatable")
      ->allow_extra_args(false);
  app.add_option("--density", o.density_kg_m3,
                 "kg/m^3: links without mass get that of their shapes (boxes, cylinders, spheres, "
                 "STL)")
      ->check(CLI::Range(1.0, 3e4));
  CLI::Option* like =
      app.add_option("--like", o.like,
                     "Series elastic drives in proportion to this robot's: its name or robot.toml")
          ->check(a_bundled(Bundled::kRobot));
  app.add_flag("--dynamics", o.dynamics,
               "Put damping and friction of the URDF's <dynamics> into the drives")
      ->excludes(like);
  app.add_option("--base", o.base, "Kind of base (default: floating if it has feet)")
      ->check(CLI::IsMember({"floating", "fixed"}));
  app.add_flag("--force", o.force,
               "Write into an existing folder; files that differ are kept as FILE~");
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  app.footer(kNewExamples);
}

void add_flags(CLI::App& app, ControllerNewOptions& o) {
  app.add_option("name", o.name, "Of the controller: a class and files are called so")->required();
  app.add_option("--robot", o.robot, "Robot that it moves: a bundled one, or a robot.toml")
      ->capture_default_str()
      ->transform(a_bundled(Bundled::kRobot))
      ->check(is_given("name a robot"));
  app.add_option("-o,--output", o.output, "Folder to write (default: the name)")
      ->check(is_given("name a folder"));
  app.footer(kControllerNewExamples);
}

void add_flags(CLI::App& app, EdsOptions& o) {
  CLI::Option* robot =
      app.add_option("robot", o.robot, "Robot: its TOML, or a bundled name; needed without `show`")
          ->transform(a_bundled(Bundled::kRobot));
  CLI::Option* output = app.add_option("-o,--output", o.output, "Folder to write (default: eds)");
  CLI::Option* json = app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  app.footer(kEdsExamples);
  CLI::App* show = app.add_subcommand("show", "What the drive of a sheet is and can");
  show->add_option("sheet", o.sheet, "EDS or DCF; of an EtherCAT slave also its ESI (XML)")
      ->required();
  show->add_option("--product", o.product, "Of an ESI with several devices: the product code");
  show->add_option("--revision", o.revision, "Of an ESI with several devices: the revision");
  show->add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  show->footer(kEdsShowExamples);
  show->excludes(robot)->excludes(output)->excludes(json);
  show->callback([&o] { o.action = EdsOptions::Action::kShow; });
  // A positional that is required would take the word `show`.
  app.callback([robot, show] {
    if (!show->parsed() && robot->empty()) throw CLI::RequiredError(robot->get_name());
  });
}

void add_flags(CLI::App& app, LatencyOptions& o) {
  app.add_option("--period-us", o.period_us, "Period of both loops (default: 1000)")
      ->check(CLI::Range(50, 1'000'000));
  app.add_option("--duration", o.duration_s, "Seconds per load (default: 30)")->check(a_duration());
  app.add_option("--mode", o.mode, "How the two share the CPUs (default: swap)")
      ->check(CLI::IsMember({"swap", "together", "turns"}));
  app.add_option("--slices", o.slices, "Parts of the duration, for swap and turns (default: 10)")
      ->check(CLI::Range(1, 1000));
  app.add_option("--cpu", o.cpus, "CPUs: ours,cyclictest's (default: the first two)")
      ->delimiter(',')
      ->expected(1, 2)
      ->check(CLI::NonNegativeNumber);
  app.add_option("--policy", o.policy, "Scheduling of both (default: fifo)")
      ->check(CLI::IsMember({"fifo", "rr", "other"}));
  app.add_option("--priority", o.priority, "Real-time priority of both (default: 80)")
      ->check(CLI::Range(1, 99));
  CLI::Option* load = app.add_option("--load", o.load,
                                     "idle, stress, both (default: both if stress-ng is installed)")
                          ->check(CLI::IsMember({"idle", "stress", "both"}));
  app.add_flag_callback(
         "--stress", [&o] { o.load = "stress"; }, "The same as --load stress")
      ->excludes(load);
  app.add_option("-o,--output", o.output, "Folder of page and plots (default: runs/latency)");
  app.add_flag("--quiet,-q", o.quiet, "Neither progress nor table");
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  app.footer(kLatencyExamples);
}

void add_flags(CLI::App& app, DoctorOptions& o) {
  app.add_option("robot", o.robot,
                 "Robot whose buses and EtherCAT slaves are looked at: its TOML, or its name")
      ->transform(a_bundled(Bundled::kRobot));
  app.add_option("--interface", o.interfaces, kInterfaceHelp);
  app.add_option("--fix", o.fix,
                 "New folder for what is advised as files, with how to install and to undo each; "
                 "nothing of the system is changed")
      ->type_name("FOLDER")
      ->check(is_given("name a new folder"));
  app.add_option("--root", o.root, "Folder with copies of /proc and /sys")->group("");
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  app.footer(kDoctorExamples);
}

}  // namespace tandem::apps
