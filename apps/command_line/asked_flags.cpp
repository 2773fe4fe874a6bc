// Flags of the commands to a running process: what command_rows() say.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "apps/command_line/command_flags.hpp"
#include "apps/command_line/help_text.hpp"

namespace tandem::apps {
namespace {

/// First words of the commands, with their help.
struct Group {
  const char* name;
  Task task;
  const char* doc;
  const char* examples;
};
constexpr Group kGroups[]{
    {"top", Task::kSee, "A live table of a running run: loop, faults, controllers, every joint",
     R"(Examples:
  tandem top                                         in the terminal, until `q`; `?` lists the keys
  tandem top --once > picture.txt                    one table, as without a terminal
  tandem top --json -                                what the table is made of
  tandem top --dds --namespace left                  of the run with this [dds] namespace
It asks five times a second, and only what reads. Without --socket or --dds it is the only
`tandem run` of this user.)"},
    {"fault", Task::kStop, "Faults of a running run", R"(Examples:
  tandem fault show                                  what has been latched, and what was cleared
  tandem fault reset                                 clears and holds; exit status 1: it failed
  tandem controller start                            then starts the controllers again
  tandem fault show --dds --namespace left           of the run with this [dds] namespace
Without --socket or --dds it is the only `tandem run` of this user.)"},
    {"estop", Task::kStop, "Emergency stop of every run of this user", R"(Examples:
  tandem estop                                       every run of this user on this machine, with
                                                     the category of robot.toml's [safety]
  tandem estop --socket /tmp/run.sock                this one alone
  tandem estop --category 0                          take the torque away at once
  tandem estop --category 2                          a safe posture first, where a controller has one

Exit status: 0 each loop has carried it out, or does so first when its paused time goes on.
1 a stop is not confirmed, or there is no run. Over DDS, a confirmation counts from a run of this
user on this machine, or from one that DDS Security has authenticated. `kill -USR1 PID` asks for the
same without a socket, and gets no answer.)"},
    {"controller", Task::kMove, "Controllers of a running run", R"(Examples:
  tandem controller new mine                         a project of your own; needs no run
  tandem controller list                             loaded controllers, active or not, their joints
  tandem controller load hold --name rest --set 'duration_s = 2.0'
  tandem controller switch --stop squat --start rest
                                                     in one cycle, or not at all
  tandem controller shadow squat2                    beside the active ones, without commanding
  tandem controller difference squat2                how far it is from what is commanded
  tandem controller switch --stop squat --start squat2 --when-within 10mrad
                                                     once they agree; Ctrl-C ends only the waiting
  tandem controller switch --cancel                  gives up the one that waits
  tandem controller show squat                       its parameters: unit, range, value, live or not
  tandem controller set squat link_damping_Nms_rad=2
                                                     between two cycles; several: all or none
  tandem controller set arm kp_Nm_rad.elbow=20       of a parameter by joint one; kp_Nm_rad=20: all
  tandem controller start                            after `fault reset`: those active before
  tandem controller stop rest                        its joints are held where they are
  tandem controller reload mine                      goes on with its new build, in its state
  tandem controller unload rest                      then it can be loaded once more
Without --socket or --dds it is the only `tandem run` of this user.)"},
    {"joint", Task::kMove, "Joints of a running run", R"(Examples:
  tandem joint list                                  every joint: its controller, mode, measurements
  tandem joint list LKneeSag RKneeSag --gains        and the gains of their loops
  tandem joint show LElbj                            its encoders, its drive, its fault
  tandem joint set LElbj --mode torque               a joint that no active controller claims
  tandem joint set LElbj --interaction compliant --stiffness 40 --damping 2
  tandem controller stop hold                        first: frees the joints that it claims
  tandem joint move LElbj --to -30deg --speed 20deg/s
                                                     a free joint to a place, and `joint stop LElbj`
  tandem joint move LElbj --to 0 --wait              until it is there; Ctrl-C ends only the waiting
  tandem joint posture ready --speed 0.2             free joints to a posture: all arrive together
  tandem joint tuning > gains.toml                   the gains in force, for robot.toml
  tandem joint home LElbj                            let its drive find the joint's place
  tandem joint reset LElbj                           clear the fault of its drive alone
  tandem joint recover LElbj                         outside its limits: slowly back inside
  tandem joint gains LElbj position --kp 150         to its drive, by SDO, when the loop is stable
  tandem joint gains LElbj position --kp 9e4 --anyway
                                                     also when the model finds that it is not
Without --socket or --dds it is the only `tandem run` of this user.)"},
    {"input", Task::kMove,
     "Inputs of a running run's controllers: `tandem input NAME x=0.2`, `tandem input list`",
     R"(Examples:
  tandem input list                                  every input: who feeds it, what it holds
  tandem input rate joint2=0.3                       one sample, which counts until its time-out
  tandem input rate joint2=0.3 --for 2               again and again, for two seconds
  tandem input jog/rate joint2=0.3                   of the controller `jog`, where several have it
  tandem input way --point 1.0,0.3,0.2 --point 2,0,0
                                                     way-points: after 1 s, and after 2 s
Without --socket or --dds it is the only `tandem run` of this user. Whose source is another in the
experiment's [controller.inputs] is refused: docs/controllers.md)"},
    {"site", Task::kMove, "Leads a place on a running robot", R"(Examples:
  tandem controller stop hold                        first: frees the joints that it claims
  tandem site move hand z --by 0.02                  up by 20 mm, along the base's axes
  tandem site move hand yaw --by 0.1 --axes site     turns about its own z axis
  tandem joint halt                                  brakes what moves
A step near a singular posture, or beyond a joint's limit, is refused.
Without --socket or --dds it is the only `tandem run` of this user.)"},
    {"sensor", Task::kSee, "Sensors of a running run", R"(Examples:
  tandem sensor list                                 every IMU and force/torque sensor
  tandem sensor list imu --json -                    one of them, for a program
Without --socket or --dds it is the only `tandem run` of this user.)"},
    {"signal", Task::kSee, "Signals of a running run's controllers", R"(Examples:
  tandem signal list                                 what the loaded controllers tell of themselves
  tandem signal watch squat                          all of one, a line every 0.1 s
  tandem signal watch squat.depth --every 1 --count 10
Without --socket or --dds it is the only `tandem run` of this user.)"},
    {"clock", Task::kDebug, "Simulated time of a run", R"(Examples:
  tandem clock show                                  time, paused or not, rate, measured speed
  tandem clock pause
  tandem clock step 10                               ten cycles, then paused again
  tandem clock rate 0.1                              ten times slower than real time
  tandem clock rate 0                                as fast as possible
  tandem clock resume
  tandem clock rewind 2.5s                           back, by checkpoints that the run keeps
  tandem clock goto 12.3s
  tandem clock step --to 12.5s                       on from there, to the same bits
  tandem clock back-until 'torque(LKneeSag) > 40Nm'  where that became true last
  tandem clock until 'position(joint1) < 0 rad'
The results are the same bits. Only simulated time can be paused; on a robot it is refused.
Without --socket or --dds it is the only `tandem run` of this user.)"},
    {"link", Task::kTest, "The declared link of a simulated tele-operation", R"(Examples:
  tandem link set --delay 400ms --loss 0.3           both ways, from now on
  tandem link set --way up --jitter 20ms             commands alone
What is left out stays: docs/teleoperation.md.
Without --socket or --dds it is the only `tandem run` of this user.)"},
    {"predict", Task::kDebug, "What a running robot will do: runs its model ahead", R"(Examples:
  tandem predict                                     one second ahead, of the run that goes on
  tandem predict --horizon 0.2 --json -              every row, for programs
  tandem predict --horizon 5 --every 50              a row every 50 cycles
A simulated robot is predicted by a copy of it, a real one by the robot of [parallel]:
docs/internal-model.md)"},
    {"push", Task::kMove, "Push a simulated robot", R"(Examples:
  tandem push imu --force 40,0,0 --for 0.2s          at a site, along the world's x axis
  tandem push hand --impulse 0,2,0 --for 50ms --shape half_sine
                                                     2 Ns, whatever the shape
  tandem push --link LForearm --point 0,0,-0.1 --force 0,0,-20
                                                     on a link, until the run ends
  tandem push hand --torque 0,0,1 --frame local --for 1s
                                                     about the site's own z axis
The robot of another process is pushed by `tandem inject kind=push …` there: docs/scenarios.md.
Without --socket or --dds it is the only `tandem run` of this user.)"},
    {"inject", Task::kTest, "Inject a fault into a running emulated or simulated robot",
     R"(Examples:
  tandem inject kind=board_kill board=left_leg_1 for_s=0.5
  tandem inject kind=encoder_jump joint=LKneeSag rad=0.05
  tandem inject kind=frame_drop board=left_arm_1 direction=to_master probability=0.01
  tandem inject 'kind = "bus_down"
                 bus = "left_leg"'
Every kind and key: docs/configuration.md, scenario.toml. Reactions: docs/faults.md.)"},
};

std::string sentence(std::string words) {
  if (!words.empty()) words.front() = static_cast<char>(std::toupper(words.front()));
  return words;
}

/// How a number may be written that has a unit.
const char* unit_words(ControlKey::Unit unit) {
  switch (unit) {
    case ControlKey::Unit::kNone: break;
    case ControlKey::Unit::kPlace:
      return ": 30deg, '30 deg', 0.5rad or 0.5; of a slide 20mm, 2cm, 0.02m or 0.02";
    case ControlKey::Unit::kSpeed: return ": 20deg/s, 0.3";
    case ControlKey::Unit::kTime: return ": 2.5s, 300ms, 1min; 2.5 is seconds";
    case ControlKey::Unit::kAcceleration: return ": 40deg/s2, 0.6";
  }
  return "";
}

/// What check_value() says of a text on the line.
CLI::Validator fits(const ControlKey& key) {
  const auto check = [&key](const std::string& text) -> std::string {
    if (key.type == ControlKey::Type::kText) {
      const Status fits = check_value(key, text);
      return fits ? "" : fits.error().message + ": " + fits.error().hint;
    }
    double number = 0.0;
    if (!CLI::detail::lexical_cast(text, number)) number = std::nan("");
    const bool whole = key.type == ControlKey::Type::kInteger && std::abs(number) < 1e15 &&
                       number == std::floor(number);
    const Status fits = check_value(key, whole ? Json(std::llround(number)) : Json(number));
    return fits ? "" : "'" + text + "' " + fits.error().message;
  };
  return {check, ""};
}

/// The option of `app` that writes `given[key]`.
CLI::Option* add_key(CLI::App& app, const ControlKey& key, Json& given) {
  using Type = ControlKey::Type;
  Json& to = given;
  const std::string doc =
      (key.choices.empty() ? sentence(key.doc) : key.doc) + unit_words(key.unit);
  const auto put = [&to, &key](const auto& value) { to[key.name] = value; };
  const bool flag = key.line.starts_with("--");
  if (key.type == Type::kBoolean) {
    return app.add_flag_callback(
        key.line, [put] { put(true); }, doc);
  }
  if (key.type == Type::kTexts) {
    CLI::Option* list = app.add_option_function<std::vector<std::string>>(key.line, put, doc);
    if (flag) key.sent ? list->delimiter(',') : list->allow_extra_args(false);
    return list;
  }
  if (key.type == Type::kNumbers) {
    return app.add_option_function<std::vector<double>>(key.line, put, doc)->delimiter(',');
  }
  if (key.unit != ControlKey::Unit::kNone || key.type == Type::kText) {
    CLI::Option* text = app.add_option_function<std::string>(key.line, put, doc)
                            ->check(is_given("give a value, or leave it out"));
    return key.unit == ControlKey::Unit::kNone ? text->check(is_one_of(key.choices, fits(key)))
                                               : text;
  }
  if (key.type == Type::kInteger) {
    return app.add_option_function<std::int64_t>(key.line, put, doc)->check(fits(key));
  }
  return app.add_option_function<double>(key.line, put, doc)->check(fits(key));
}

void add_row(CLI::App& app, const CommandRow& row, const char* examples, AskedOptions& o) {
  for (const ControlKey& key : row.keys) {
    if (key.line.empty()) continue;
    // Beside the group's verbs the words of its own line are optional: the question is looked at.
    add_key(app, key, o.given)->required(key.required && !row.more.of_group);
  }
  add_target(app, o.target);
  if (row.effect != ControlEffect::kStops) {  // of each run it prints a line
    app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  }
  app.footer(examples);
  app.callback([&app, &o, &row] {
    if (app.get_subcommands().empty()) o.row = &row;
  });
}

}  // namespace

void add_asked(CLI::App& app, AskedOptions& o) {
  for (const Group& group : kGroups) {
    CLI::App* first = app.add_subcommand(group.name, group.doc)->group(to_string(group.task));
    first->footer(group.examples);
    std::vector<std::string> verbs;
    bool own_line = false;
    for (const CommandRow& row : command_rows()) {
      const std::size_t dot = std::min(row.name.find('.'), row.name.size());
      if (!row.more.on_line || row.name.substr(0, dot) != group.name) continue;
      if (dot == row.name.size() || row.more.of_group) {
        own_line = own_line || row.more.of_group;
        add_row(*first, row, group.examples, o);
        continue;
      }
      verbs.push_back(row.name.substr(dot + 1));
      add_row(*first->add_subcommand(verbs.back(), sentence(row.doc)), row, group.examples, o);
    }
    if (verbs.empty() || own_line) continue;
    first->require_subcommand(1);
    first->description(fmt::format("{}: {}", group.doc, fmt::join(verbs, ", ")));
  }
}

}  // namespace tandem::apps
