// `tandem log replay`: an experiment that plays the motion of a log.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "apps/text/draft.hpp"
#include "apps/text/figures.hpp"
#include "apps/text/relative_path.hpp"
#include "apps/tools/carried_settings.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/listed_names.hpp"
#include "apps/tools/opened_log.hpp"
#include "base/counted.hpp"
#include "base/nearest.hpp"
#include "base/quoting.hpp"
#include "controllers/motion_plan.hpp"
#include "hal/config/capabilities.hpp"
#include "log/joint_motion.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {
namespace {

constexpr const char* kReplayHead = "# Replays a log";
constexpr std::int64_t kCycle_ns = 1'000'000;  // of an experiment that says nothing of it
constexpr double kHeld_s = 1.0;                // at the end

/// All that the experiment says.
struct Replay {
  LogOptions options;
  hal::Robot robot;
  std::vector<std::size_t> joints;
  log::MotionRequest request;
  log::JointMotion motion;
  CarriedSettings carried;
  std::string data_sha256, posture;
  double approach_s = 0.0, duration_s = 0.0;
};

/// The posture that the recorded run began in, if the robot has it; else its first; or what is
/// asked for.
Result<std::string> posture_of(const LogOptions& options, const hal::Robot& robot,
                               const log::RunInfo& info) {
  std::vector<std::string> known;
  for (const hal::Posture& one : robot.postures) known.push_back(one.name);
  if (!options.posture.empty()) {
    if (robot.posture(options.posture) != nullptr) return options.posture;
    return std::unexpected(Error{"the robot has no posture '" + options.posture + "'",
                                 suggest(options.posture, known),
                                 robot.file,
                                 0,
                                 {}});
  }
  if (const auto experiment = experiment_of(info)) {
    std::string posture = experiment->root().text_or("posture", "");
    if (robot.posture(posture) != nullptr) return posture;
  }
  return known.empty() ? std::string() : known.front();
}

/// Indices of the joints that are played. Errors: one that the robot lacks, or that stands twice;
/// the recording has others, and none were chosen.
Result<std::vector<std::size_t>> joints_of(const LogOptions& options, const hal::Robot& robot,
                                           const log::RunInfo& info) {
  std::vector<std::string> known;
  for (const hal::DrivenJoint& joint : robot.joints) known.push_back(joint.name);
  std::vector<std::string> names = listed_names(options.joints, known);
  if (names.empty()) {
    names = known;
    for (const std::string& joint : info.joints) {
      if (robot.joint_index(joint) >= 0) continue;
      return std::unexpected(
          Error{"is a recording of another robot: " + robot.file + " has no joint '" + joint + "'",
                "give the robot that was recorded, or name the joints that both have with --joints",
                options.log,
                0,
                {}});
    }
  }
  std::vector<std::size_t> joints;
  for (const std::string& name : names) {
    const int index = robot.joint_index(name);
    if (index < 0) {
      Error none = robot.no_joint(name);
      none.file = robot.file;
      none.key.clear();
      return std::unexpected(std::move(none));
    }
    if (std::ranges::find(joints, static_cast<std::size_t>(index)) != joints.end()) {
      return fail("joint '" + name + "' stands twice", "name it once in --joints");
    }
    joints.push_back(static_cast<std::size_t>(index));
  }
  return joints;
}

/// What the controller's parameters are called on this command line.
Error with_options(Error error) {
  const std::pair<std::string_view, std::string_view> names[] = {
      {"from_s and to_s", "--from and --to"},
      {"from_s", "--from"},
      {"to_s", "--to"},
      {"(speed)", "(--speed)"},
      {"source = \"state\"", "--source state"},
      {"`joints`", "--joints"},
      {"play it without: torque = false", "leave out --torque"}};
  for (const auto& [key, option] : names) {
    std::size_t at = error.hint.find(key);
    for (; at != std::string::npos; at = error.hint.find(key, at + option.size())) {
      error.hint.replace(at, key.size(), option);
    }
  }
  return error;
}

/// Reads and checks everything, as the run will.
Result<Replay> plan(const LogOptions& options) {
  const auto files = robot::read_robot(options.robot);
  if (!files) return std::unexpected(files.error().front());
  const auto file = opened_log(options.log);
  if (!file) return std::unexpected(file.error());
  Replay replay;
  replay.options = options;
  replay.robot = hal::robot_of(files->config);
  replay.data_sha256 = file->data_sha256();
  replay.carried = carried_settings(file->info(), *files);
  auto posture = posture_of(options, replay.robot, file->info());
  if (!posture) return std::unexpected(posture.error());
  replay.posture = std::move(*posture);
  auto joints = joints_of(options, replay.robot, file->info());
  if (!joints) return std::unexpected(joints.error());
  replay.joints = std::move(*joints);
  log::MotionRequest& request = replay.request;
  if (options.source == "command") request.source = log::MotionSource::kCommand;
  if (options.source == "state") request.source = log::MotionSource::kState;
  request.from_s = options.begin_s;
  request.to_s = options.end_s;
  request.torque = options.torque;
  for (const std::size_t joint : replay.joints) {
    request.joints.push_back(replay.robot.joints[joint].name);
  }
  auto motion = log::read_joint_motion(*file, request);
  if (!motion) return std::unexpected(with_options(motion.error()));
  replay.motion = std::move(*motion);
  if (request.torque && options.speed > 1.0) {
    return fail("--torque plays the torques of a slower motion",
                "leave --torque out, or play it not faster than recorded: --speed 1");
  }
  const auto made = MotionPlan::make(replay.motion, replay.robot, replay.joints,
                                     replay.carried.period_ns.value_or(kCycle_ns), options.speed);
  if (!made) {
    return std::unexpected(with_options(
        Error{made.error().message, made.error().hint, options.log, 0, made.error().key}));
  }
  const hal::Posture* start = replay.robot.posture(replay.posture);
  replay.approach_s = log::kReplayApproach_s;
  for (std::size_t k = 0; k < replay.joints.size(); ++k) {
    const std::size_t joint = replay.joints[k];
    const double from = start == nullptr ? 0.0 : start->position_rad[joint];
    const double time_s = approach_time_s(made->position(k, 0) - from, replay.robot.joints[joint]);
    replay.approach_s = std::max(replay.approach_s, std::ceil(10.0 * time_s + 1.0) / 10.0);
  }
  replay.duration_s = replay.approach_s + made->duration_s() + kHeld_s;
  return replay;
}

std::string quoted(const std::string& text) { return json_text(Json(text)); }

/// The damping of the joints that are led: one number when all have the same, else each its own.
std::string damping_text(const Replay& replay) {
  std::vector<double> each;
  std::string table;
  for (const std::string& joint : replay.request.joints) {
    const auto found = replay.carried.damping_Nms_rad.find(joint);
    if (found == replay.carried.damping_Nms_rad.end()) continue;
    table += fmt::format("{}{} = {:.9g}", table.empty() ? "" : ", ", quoted(joint), found->second);
    each.push_back(found->second);
  }
  if (each.empty()) return {};
  const bool same = each.size() == replay.request.joints.size() &&
                    std::ranges::count(each, each.front()) == std::ssize(each);
  return "link_damping_Nms_rad = " +
         (same ? fmt::format("{:.9g}", each.front()) : "{ " + table + " }") + "\n";
}

/// What stands before the controller.
std::string head_text(const Replay& replay, const LogOptions& options) {
  const CarriedSettings& carried = replay.carried;
  const double lead_s = replay.approach_s + log::kReplayRunUp_s;
  return fmt::format(
             "{}, written by `tandem log replay`: the joints' {} from {:.3f} to {:.3f} s.\n"
             "# The recording begins {:.1f} s after the controllers: {:.1f} s to its first place, "
             "{:.1f} s\n"
             "# to its first speed. From a place farther away it takes longer: raise duration_s "
             "then.\n{}"
             "robot = {}\n{}duration_s = {:.9g}\n{}seed = {}\n",
             kReplayHead,
             replay.motion.source == log::MotionSource::kCommand ? "commands"
                                                                 : "measured positions",
             static_cast<double>(replay.motion.begin_ns) * 1e-9,
             static_cast<double>(replay.motion.end_ns) * 1e-9, lead_s, replay.approach_s,
             log::kReplayRunUp_s,
             carried.keys.empty() ? "" : "# It is simulated as the recording's run was.\n",
             quoted(relative_path(options.output, options.robot)),
             replay.posture.empty() ? "" : "posture = " + quoted(replay.posture) + "\n",
             replay.duration_s,
             carried.period_ns ? fmt::format("period_ns = {}\n", *carried.period_ns) : "",
             carried.seed) +
         carried.tables;
}

std::string experiment_text(const Replay& replay, const LogOptions& options) {
  std::string text = head_text(replay, options) +
                     fmt::format(
                         "\n[[controller]]\nplugin = \"recorded_motion\"\n[controller.parameters]\n"
                         "log = {}\ndata_sha256 = \"{}\"\nsource = \"{}\"\napproach_s = {:.9g}\n",
                         quoted(relative_path(options.output, options.log)), replay.data_sha256,
                         log::to_string(replay.motion.source), replay.approach_s) +
                     damping_text(replay);
  if (options.speed != 1.0) text += fmt::format("speed = {}\n", options.speed);
  if (options.torque) text += "torque = true\n";
  if (options.begin_s) text += fmt::format("from_s = {:.9g}\n", *options.begin_s);
  if (options.end_s) text += fmt::format("to_s = {:.9g}\n", *options.end_s);
  if (options.joints.empty()) return text;
  std::string names;
  for (const std::string& joint : replay.request.joints) {
    names += (names.empty() ? "" : ", ") + quoted(joint);
  }
  return text + "joints = [" + names + "]\n";
}

}  // namespace

static void figures(Figures& f, const Replay& replay) {
  f("experiment", "path of the experiment", replay.options.output);
  f("log", "the recording", replay.options.log);
  f("data_sha256", replay.data_sha256);
  f("source", "`command` or `state`", log::to_string(replay.motion.source));
  f("from_ns", "what is played, of the recording's time", replay.motion.begin_ns);
  f("to_ns", replay.motion.end_ns);
  f("joints", "that are led", replay.request.joints);
  f("speed", "times as fast as recorded", replay.options.speed);
  f("torque", "whether torques are played", replay.options.torque);
  f("posture", "that the run starts in; empty: every joint at 0", replay.posture);
  f("carried", "keys of the recording's experiment that it takes over", replay.carried.keys);
  f("lead_in_s", "from the start of the controllers to the recording's first sample",
    replay.approach_s + log::kReplayRunUp_s);
  f("duration_s", "of the experiment", replay.duration_s);
}

std::vector<Figures::Row> replay_figures() { return Figures::rows_of<Replay>(); }

static void print_facts(const Replay& replay, const Json& json, std::FILE* out) {
  const LogOptions& options = replay.options;
  Facts facts;
  const bool commanded = replay.motion.source == log::MotionSource::kCommand;
  add_figures(
      facts, json,
      {{"experiment", "{experiment}"}, {"plays", "{from_ns:.3f} to {to_ns:.3f s} of {log}"}});
  if (options.speed != 1.0)
    add_figures(facts, json, "speed", "{speed:.4g} times as fast as recorded");
  facts.add("references", commanded ? "the recorded commands (--source state: what was measured)"
                                    : "what was measured of the joints");
  const std::size_t held = replay.robot.joints.size() - replay.joints.size();
  facts.add("joints", counted(replay.joints.size(), "joint") +
                          (held == 0 ? "" : fmt::format(", {} more are held", held)));
  facts.add("torques", options.torque ? "played as feed-forward" : "not played (--torque)");
  facts.add("begins",
            fmt::format("{:.1f} s after the controllers, from {}",
                        replay.approach_s + log::kReplayRunUp_s,
                        replay.posture.empty() ? "every joint at 0" : "posture " + replay.posture));
  add_figures(facts, json, "as recorded", "{carried}");
  facts.add("next", "tandem run " + shell_word(options.output));
  facts.add("", fmt::format("tandem report {} RUN, RUN being the log that this writes: one over "
                            "the other",
                            shell_word(options.log)));
  facts.print(out);
}

Exit log_replay_command(const LogOptions& options) {
  const auto replay = plan(options);
  if (!replay) return refuse(replay.error());
  if (const Status kept =
          check_overwrites(options.output, kReplayHead, "experiment of `tandem log replay`");
      !kept) {
    return refuse(kept.error());
  }
  Draft draft = Draft::file(options.output);
  if (const Status s = write_file(draft.path(), experiment_text(*replay, options)); !s) {
    return refuse(draft.placed(s.error()));
  }
  if (const Status s = draft.place(); !s) return refuse(s.error());
  const Json json = figures_json(*replay);
  print_facts(*replay, json, human_output(options.json));
  return end_with_json(options.json, json);
}

}  // namespace tandem::apps
