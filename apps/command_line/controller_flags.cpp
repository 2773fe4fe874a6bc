// Flags of the commands that change a running run: tandem controller, joint, sensor.
#include <cmath>

#include "apps/command_line/command_flags.hpp"

namespace tandem::apps {
namespace {

const char kControllerExamples[] = R"(Examples:
  tandem controller list                             loaded controllers, active or not, their joints
  tandem controller load hold --name rest --set 'duration_s = 2.0'
  tandem controller switch --stop squat --start rest in one cycle, or not at all
  tandem controller start                            after `fault reset`: those active before
  tandem controller stop rest                        its joints are held where they are
  tandem controller unload rest                      then `load` runs a new build of it
Without --socket or --dds it is the only `tandem run` of this user.)";

const char kJointExamples[] = R"(Examples:
  tandem joint list                                  every joint: its controller, mode, measurements
  tandem joint list LKneeSag RKneeSag --gains        and the gains of their loops
  tandem joint show LElbj                            its encoders, its drive, its fault
  tandem joint set LElbj --mode torque               a joint that no active controller claims
  tandem joint set LElbj --interaction compliant --stiffness 40 --damping 2
  tandem controller stop hold                        first: frees the joints that it claims
  tandem joint move LElbj --to -30deg --speed 20deg/s
                                                     a free joint to a place, and `joint stop LElbj`
  tandem joint move LElbj --to 0 --wait              until it is there; Ctrl-C ends only the waiting
  tandem joint home LElbj                            let its drive find the joint's place
  tandem joint reset LElbj                           clear the fault of its drive alone
  tandem joint recover LElbj                         outside its limits: slowly back inside
  tandem joint gains LElbj position --kp 150         to its drive, by SDO, when the loop is stable
  tandem joint gains LElbj position --kp 9e4 --anyway
                                                     also when the model finds that it is not
Without --socket or --dds it is the only `tandem run` of this user.)";

const char kSensorExamples[] = R"(Examples:
  tandem sensor list                                 every IMU and force/torque sensor
  tandem sensor list imu --json -                    one of them, for a program
Without --socket or --dds it is the only `tandem run` of this user.)";

CLI::Validator is_finite() {
  const auto check = [](const std::string& text) -> std::string {
    double number = 0.0;
    if (CLI::detail::lexical_cast(text, number) && std::isfinite(number)) return "";
    return "'" + text + "' is no finite number";
  };
  return {check, ""};
}

/// What every subcommand has.
template <class Options>
CLI::App* add_command(CLI::App& app, const char* name, const char* doc, const char* examples,
                      Options& o) {
  CLI::App* command = app.add_subcommand(name, doc);
  add_target(*command, o.target);
  command->add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  command->footer(examples);
  return command;
}

}  // namespace

void add_flags(CLI::App& app, ControllerOptions& o) {
  using Action = ControllerOptions::Action;
  app.require_subcommand(1);
  app.footer(kControllerExamples);
  const auto add = [&](const char* name, const char* doc, Action action) {
    CLI::App* command = add_command(app, name, doc, kControllerExamples, o);
    command->callback([&o, action] { o.action = action; });
    return command;
  };
  add("list", "What is loaded: active or not, and the joints it claims", Action::kList);
  CLI::App* load =
      add("load", "Load a controller; it is inactive until it is started", Action::kLoad);
  load->add_option("plugin", o.plugin, "Name of a controller, or path of its library")->required();
  load->add_option("--name", o.name, "Name of the controller (default: the plugin's)");
  load->add_option("--parameters", o.parameters, "TOML file of its [controller.parameters]")
      ->check(CLI::ExistingFile);
  load->add_option("--set", o.set,
                   "One parameter, 'key = value', beside the file's; may be repeated")
      ->allow_extra_args(false);
  load->add_flag("--start", o.start_it, "Start it as well");
  add("unload", "Free an inactive controller", Action::kUnload)
      ->add_option("name", o.name, "Its name")
      ->required();
  add("start", "Start controllers, all in one cycle; after a reset those that were active",
      Action::kStart)
      ->add_option("names", o.start, "Their names; none: those that were active before the reset");
  add("stop", "Stop controllers; joints without a controller are held", Action::kSwitch)
      ->add_option("names", o.stop, "Their names")
      ->required();
  CLI::App* change =
      add("switch", "Stop some and start others in one cycle, all or none", Action::kSwitch);
  change->add_option("--stop", o.stop, "Controllers to stop, by comma")->delimiter(',');
  change->add_option("--start", o.start, "Controllers to start, by comma")->delimiter(',');
}

// NOLINTNEXTLINE(readability-function-size): a table
void add_flags(CLI::App& app, JointOptions& o) {
  using Action = JointOptions::Action;
  app.require_subcommand(1);
  app.footer(kJointExamples);
  const auto add = [&](const char* name, const char* doc, Action action) {
    CLI::App* command = add_command(app, name, doc, kJointExamples, o);
    command->callback([&o, action] { o.action = action; });
    return command;
  };
  CLI::App* list = add("list", "Controller, mode and measurements of each joint", Action::kList);
  list->add_option("joints", o.joints, "Only these");
  list->add_flag("--drives", o.drives, "Motor position, current, voltage and winding instead")
      ->excludes(list->add_flag("--gains", o.gains, "The gains of its drive's loops instead"));
  add("show", "One joint: encoders on both sides, drive, its fault in words", Action::kShow)
      ->add_option("joint", o.joint, "Its name")
      ->required();
  CLI::App* set =
      add("set", "Mode and interaction of a free joint, impedance of any", Action::kSet);
  set->add_option("joint", o.joint, "Its name")->required();
  set->add_option("--mode", o.mode, "idle, position, velocity, torque, open_loop, current");
  set->add_option("--interaction", o.interaction, "stiff, compliant");
  set->add_option("--stiffness", o.stiffness_Nm_rad,
                  "Of the virtual spring [Nm/rad, of a slide N/m]")
      ->check(is_finite());
  set->add_option("--damping", o.damping_Nms_rad,
                  "Of the virtual damper [Nms/rad, of a slide Ns/m]")
      ->check(is_finite());
  CLI::App* move = add("move", "Lead a free joint to a place, at a steady speed", Action::kMove);
  move->add_option("joint", o.joint, "Its name")->required();
  move->add_option("--to", o.to,
                   "30deg, '30 deg', 0.5rad or 0.5; of a slide 20mm, 2cm, 0.02m or 0.02")
      ->required()
      ->check(is_given("say where to: 30deg"));
  move->add_option("--speed", o.speed, "20deg/s, 0.3 (default: a quarter of the joint's limit)")
      ->check(is_given("leave it out for the default"));
  move->add_option("--acceleration", o.acceleration,
                   "40deg/s2, 0.6 (default: reaches the speed in half a second)")
      ->check(is_given("leave it out for the default"));
  move->add_flag("--shortest", o.shortest,
                 "To the same angle by whole turns that is nearest, within the joint's limits");
  move->add_flag(
      "--wait", o.wait,
      "Until it has arrived: status 0; 1 when the motion ended elsewhere. Ctrl-C ends the "
      "waiting, not the motion: tandem joint stop");
  add("stop", "Brake a joint that `joint move` or `joint home` leads", Action::kStop)
      ->add_option("joint", o.joint, "Its name")
      ->required();
  add("home",
      "Let a joint's drive find the joint's place, as its `homing` in robot.toml says; until it is "
      "done: status 0, or 1 when it failed. Ctrl-C ends the waiting alone",
      Action::kHome)
      ->add_option("joint", o.joint, "Its name")
      ->required();
  add("recover", "Lead a free joint back inside its limits, slowly", Action::kRecover)
      ->add_option("joint", o.joint, "Its name")
      ->required();
  add("reset", "Clear the fault of a free joint's drive; a run in fault stays stopped",
      Action::kReset)
      ->add_option("joint", o.joint, "Its name")
      ->required();
  CLI::App* gains =
      add("gains", "Gains of a loop in its drive; those not given stay", Action::kGains);
  gains->add_option("joint", o.joint, "Its name")->required();
  gains->add_option("loop", o.loop, "position, velocity, torque, current")->required();
  gains->add_option("--kp", o.kp, "Units as in [gains], docs/configuration.md")->check(is_finite());
  gains->add_option("--ki", o.ki, "Of the integral: kp's units per second")->check(is_finite());
  gains->add_option("--kd", o.kd, "Of the derivative: kp's units times seconds")
      ->check(is_finite());
  gains->add_flag("--anyway", o.anyway,
                  "Also when the model finds the loop unstable; at your own risk");
}

void add_flags(CLI::App& app, SensorOptions& o) {
  app.require_subcommand(1);
  app.footer(kSensorExamples);
  add_command(app, "list", "Frame, values and age of each sensor", kSensorExamples, o)
      ->add_option("sensors", o.sensors, "Only these");
}

}  // namespace tandem::apps
