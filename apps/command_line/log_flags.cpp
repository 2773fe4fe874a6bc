// Flags of the commands that write, read or make motions for logs: log, report, excite, identify.
#include "apps/command_line/command_flags.hpp"

namespace tandem::apps {
namespace {

const char kLogExamples[] = R"(Examples:
  tandem log info runs/coman-squat-001.mcap          topics, messages, time, digest
  tandem log csv runs/coman-squat-001.mcap --fields position_rad > q.csv
  tandem log export runs/coman-squat-001.mcap --rate 100  a smaller copy, for viewers
  tandem log diff runs/a.mcap runs/b.mcap            equal bit by bit, or the first difference
  tandem log thresholds a.mcap b.mcap c.mcap         [estimation.collision] from free motion
  tandem log import q.csv --robot config/ur5e/robot.toml --map ur5e_csv.toml
  tandem log replay runs/ur5e-q.mcap --robot config/ur5e/robot.toml --out replay.toml
`tandem log SUBCOMMAND --help` shows more of each.)";

const char kLogInfoExamples[] = R"(Examples:
  tandem log info runs/coman-squat-001.mcap              topics, messages, time, digest
  tandem log info runs/coman-squat-001.mcap --topic truth  its fields: how many values, units)";

const char kLogCsvExamples[] = R"(Examples:
  tandem log csv runs/coman-squat-001.mcap > state.csv
  tandem log csv runs/coman-squat-001.mcap --topic command --every 10 -o ref.csv)";

const char kLogExportExamples[] = R"(Examples:
  tandem log export runs/coman-squat-001.mcap --rate 100
  tandem log export runs/coman-squat-001.mcap --rate 50 --from 2 --to 5 -o part.mcap
  tandem log export runs/coman-squat-001.mcap --rate 100 --topics state,joint_states,tf,tf_static
Of every 1/RATE each image, signal, joint state and transform keeps its first message: shorter peaks
are gone. Events, words, inputs, marks and what is there once are whole. The copy says what it is:
`tandem identify`, `log replay` and `log thresholds` refuse it.)";

const char kLogDiffExamples[] = R"(Examples:
  tandem log diff runs/a.mcap runs/b.mcap            equal bit by bit, or the first difference

Exit status: 0 the same; 1 they differ; 2 a log that cannot be read.)";

const char kLogThresholdsExamples[] = R"(Examples:
  tandem log thresholds runs/coman-squat-001.mcap            [estimation.collision] for one an hour
  tandem log thresholds a.mcap b.mcap c.mcap --per-hour 0.1 --from 5 >> my_experiment.toml
  tandem log thresholds a.mcap b.mcap c.mcap --against free.mcap pushed.mcap -o alarms
The logs are of free motion with [estimation.observer], at least 8 s each. What was not moved there
is not known: docs/estimation.md.)";
const char kLogImportExamples[] = R"(Examples:
  tandem log import q.csv --robot config/ur5e/robot.toml --map ur5e_csv.toml
  tandem log import bag_0.mcap bag_1.mcap --robot my_robot/robot.toml --map bag.toml -o runs/a.mcap
The map says what columns or topics mean: units, times, joints, gaps (docs/import.md). What it does
not say is asked for.

Exit status: 0 done; 2 a file, a map or a robot that is wrong; then there is no log.)";

const char kLogReplayExamples[] = R"(Examples:
  tandem log replay runs/panda-trajectory-001.mcap --robot config/panda/robot.toml --out replay.toml
  tandem run replay.toml                             and then, one over the other:
  tandem report runs/panda-trajectory-001.mcap runs/panda-replay-001.mcap
  tandem log replay runs/ur5e-q.mcap --robot config/ur5e/robot.toml --out q.toml --source state
  tandem log replay run.mcap --robot robot.toml --out r.toml --from 2 --to 5 --joints elbow,wrist
  tandem log replay squat.mcap --robot config/coman/robot.toml --out again.toml --torque
  tandem log replay fast.mcap --robot robot.toml --out slow.toml --speed 0.5
The experiment is an ordinary one with the controller `recorded_motion`: `tandem check replay.toml`
(docs/import.md, docs/controllers.md).

Exit status: 0 done; 2 a log, a robot or a motion that is wrong; then there is no experiment.)";

const char kReportExamples[] = R"(Examples:
  tandem report runs/coman-squat-001.mcap                report.html and PNG files beside the log
  tandem report runs/a.mcap runs/b.mcap -o compare   the second log over the first
  tandem report measured.mcap simulated.mcap identified.mcap  three, such as after `tandem identify`)";

const char kIdentifyExamples[] = R"(Examples:
  tandem excite config/panda/robot.toml --out excite.toml   the experiment
  tandem run excite.toml                                    its log: runs/panda-excite-001.mcap
  tandem identify runs/panda-excite-001.mcap --robot config/panda/robot.toml --out identified
  tandem identify a.mcap b.mcap --robot robot.toml --out identified --json result.json
The folder gets report.html, the robot with the identified masses and inertias, and the experiments
of the logs with that robot. Of every log the last third is held back, and compared with.)";

const char kExciteExamples[] = R"(Examples:
  tandem excite config/panda/robot.toml --out excite.toml
  tandem excite config/coman/robot.toml --out excite.toml --period 12   it stands while it moves
  tandem excite config/coman/robot.toml --out hung.toml --hung         from its hoist, feet in the air
  tandem excite robot.toml --out excite.toml --seed 7 --share 0.4       gently, in another way
  tandem excite robot.toml --out excite.toml --joints elbow,wrist       the others are held
  tandem excite robot.toml --out excite.toml --joints elbow --joints 'wrist,left'
The experiment is an ordinary one: `tandem check excite.toml`, `tandem run excite.toml`.)";

void add_replay_flags(CLI::App& replay, LogOptions& o) {
  replay.add_option("log", o.log, "MCAP file, of a run or of `tandem log import`")->required();
  replay.add_option("--robot", o.robot, "The robot that plays it: its TOML, or a bundled name")
      ->required()
      ->transform(a_bundled(Bundled::kRobot));
  replay.add_option("--out", o.output, "Experiment to write")
      ->required()
      ->check(is_given(kNameAFile));
  replay
      .add_option("--source", o.source,
                  "What is played (default: the commands where the log has them)")
      ->check(CLI::IsMember({"command", "state"}));
  replay.add_option("--joints", o.joints,
                    "Joints that are led, by comma (default: all); may be repeated: a name that "
                    "has a comma stands alone");
  replay.add_option("--from", o.begin_s, "Of the log's time [s] (default: the controllers' start)");
  replay.add_option("--to", o.end_s, "Of the log's time [s] (default: the controllers' end)");
  replay
      .add_option("--speed", o.speed,
                  "Times as fast as recorded, 0.01 to 10 (default: 1): 0.5 takes twice as long")
      ->check(CLI::Range(0.01, 10.0));  // log::kReplaySlowest, kReplayFastest
  replay.add_flag("--torque", o.torque, "Play the torques, too, as feed-forward");
  replay.add_option("--posture", o.posture,
                    "Start posture (default: the recording's, or the robot's first)");
  replay.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  replay.footer(kLogReplayExamples);
  replay.callback([&o] { o.action = LogOptions::Action::kReplay; });
}

void add_export_flags(CLI::App& copy, LogOptions& o) {
  copy.add_option("log", o.log, "MCAP file")->required();
  copy.add_option("--rate", o.rate_Hz, "Messages a second of each image [Hz]")->required();
  copy.add_option("-o,--output", o.output,
                  "MCAP file to write (default: NAME-100Hz.mcap beside the log)")
      ->check(is_given(kNameAFile));
  copy.add_option("--topics", o.topics, "Topics that are copied, by comma (default: all)")
      ->delimiter(',')
      ->allow_extra_args(false);
  copy.add_option("--from", o.begin_s, "Of the log's time [s] (default: its begin)");
  copy.add_option("--to", o.end_s, "Of the log's time [s] (default: its end)");
  copy.footer(kLogExportExamples);
  copy.callback([&o] { o.action = LogOptions::Action::kExport; });
}

void add_thresholds_flags(CLI::App& thresholds, LogOptions& o) {
  thresholds.add_option("logs", o.files, "MCAP files of such runs, better three than one")
      ->required();
  thresholds.add_option("--against", o.against,
                        "MCAP files of other runs, with pushes or without: count and time alarms");
  thresholds.add_option("-o,--output", o.output, "Folder for that as a page with figures")
      ->needs("--against")
      ->check(is_given(kNameAFile));
  thresholds
      .add_option("--per-hour", o.alarms_per_hour,
                  "False alarms per hour of all joints together (default: 1)")
      ->check(CLI::Range(1e-6, 3600.0));
  thresholds.add_option("--from", o.from_s, "Leave out what was before [s] (default: 0)")
      ->check(CLI::Range(0.0, 1e6));
  thresholds.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  thresholds.footer(kLogThresholdsExamples);
  thresholds.callback([&o] { o.action = LogOptions::Action::kThresholds; });
}

void add_import_flags(CLI::App& taken, LogOptions& o) {
  taken.add_option("files", o.files, "CSV tables side by side, or MCAP bags one after another")
      ->required();
  taken.add_option("--robot", o.robot, "The robot that was recorded: its TOML, or a bundled name")
      ->required()
      ->transform(a_bundled(Bundled::kRobot));
  taken.add_option("--map", o.map, "TOML that says what columns or topics mean")->required();
  taken.add_option("-o,--output", o.output, "Log to write (default: runs/ROBOT-FILE.mcap)")
      ->check(is_given(kNameAFile));
  taken.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  taken.footer(kLogImportExamples);
  taken.callback([&o] { o.action = LogOptions::Action::kImport; });
}

}  // namespace

void add_flags(CLI::App& app, LogOptions& o) {
  app.require_subcommand(1);
  app.footer(kLogExamples);
  CLI::App* info = app.add_subcommand("info", "What a log holds");
  info->add_option("log", o.log, "MCAP file")->required();
  info->add_option("--topic", o.topic, "List the fields of this topic instead, with their units");
  info->add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  info->footer(kLogInfoExamples);
  info->callback([&o] { o.action = LogOptions::Action::kInfo; });
  CLI::App* csv = app.add_subcommand("csv", "One topic as comma-separated values");
  csv->add_option("log", o.log, "MCAP file")->required();
  csv->add_option("--topic", o.topic, "Topic to write (default: the state)");
  csv->add_option("--fields", o.fields, "Fields to write, by comma (default: all)")->delimiter(',');
  csv->add_option("--every", o.every, "Write each n-th message")->check(is_count());
  csv->add_option("-o,--output", o.output, "File to write (default: standard output)");
  csv->footer(kLogCsvExamples);
  csv->callback([&o] { o.action = LogOptions::Action::kCsv; });
  add_export_flags(*app.add_subcommand("export", "A copy at a lower rate, for viewers"), o);
  CLI::App* diff = app.add_subcommand("diff", "Compare two runs bit by bit");
  diff->add_option("log", o.log, "MCAP file")->required();
  diff->add_option("other", o.other, "MCAP file")->required();
  diff->add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  diff->footer(kLogDiffExamples);
  diff->callback([&o] { o.action = LogOptions::Action::kDiff; });
  add_thresholds_flags(
      *app.add_subcommand("thresholds", "Collision thresholds from runs that touched nothing"), o);
  add_import_flags(
      *app.add_subcommand("import", "A recording of another program (CSV, ROS bag) as a log"), o);
  add_replay_flags(*app.add_subcommand("replay", "An experiment that plays the motion of a log"),
                   o);
}

void add_flags(CLI::App& app, ReportOptions& o) {
  app.add_option("log", o.log, "MCAP file")->required();
  app.add_option("others", o.others, "One or two more logs, laid over the first")->expected(0, 2);
  app.add_option("-o,--output", o.output, "Folder to write (default: beside the log)");
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  // Which a run gives, and no help shows.
  app.add_option("--after-run", o.after_run)->group("");
  app.add_option("--interrupted", o.interrupted)->group("");
  app.add_flag("--quiet", o.quiet)->group("");
  app.footer(kReportExamples);
}

void add_flags(CLI::App& app, IdentifyOptions& o) {
  app.add_option("logs", o.logs, "MCAP files of the same robot")->required();
  app.add_option("--robot", o.robot,
                 "Robot to start from, whose joints are the logs': its TOML, or a bundled name")
      ->required()
      ->transform(a_bundled(Bundled::kRobot));
  app.add_option("--out", o.output, "Folder to write")
      ->required()
      ->check(is_given("name a folder"));
  app.add_option("--cutoff", o.cutoff_Hz, "Cut-off of the low pass over every signal [Hz]")
      ->check(CLI::Range(0.5, 200.0));
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  app.footer(kIdentifyExamples);
}

void add_flags(CLI::App& app, ExciteOptions& o) {
  app.add_option("robot", o.robot, kRobotHelp)->required()->transform(a_bundled(Bundled::kRobot));
  app.add_option("--out", o.output, "Experiment to write")->required()->check(is_given(kNameAFile));
  app.add_option("--posture", o.posture, "Start posture (default: the robot's first, or all at 0)");
  app.add_option("--joints", o.joints,
                 "Joints that move, by comma (default: all that can); may be repeated: a name that "
                 "has a comma stands alone");
  app.add_option("--period", o.period_s, "Seconds of a period (default: 10, with --hung 3)")
      ->check(CLI::Range(2.0, 120.0));
  app.add_option("--periods", o.periods, "Periods (default: 3, with --hung 20)")
      ->check(CLI::Range(1, 100));
  app.add_option("--harmonics", o.harmonics, "Harmonics of each series (default: 5)")
      ->check(CLI::Range(2, 20));
  app.add_option("--seed", o.seed, "Seed of the search (default: 1)")->check(is_seed());
  app.add_option("--share", o.share, "Share of the limits of speed and torque (default: 0.7)")
      ->check(CLI::Range(0.05, 1.0));
  app.add_flag("--hung", o.hung,
               "A robot that stands: it hangs from its hoist instead, and moves every joint");
  app.add_option("--tries", o.tries,
                 "Candidates that are compared (default: 300; of more than 12 joints 60)")
      ->check(CLI::Range(1, 100'000));
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  app.footer(kExciteExamples);
}

}  // namespace tandem::apps
