// tandem excite: searches an exciting trajectory and writes it as an experiment.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/text/draft.hpp"
#include "apps/text/figures.hpp"
#include "apps/text/relative_path.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/listed_names.hpp"
#include "base/counted.hpp"
#include "base/quoting.hpp"
#include "identification/excite.hpp"
#include "identification/identify.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {
namespace {

constexpr const char* kExciteHead = "# Excites the dynamics for `tandem identify`";
/// What of a spring a standing robot's legs are damped by: without it they swing for long.
constexpr double kDamped_s = 0.03;

/// One controller: these joints along their series.
std::string controller_text(const std::string& name, const identification::ExcitingSeries& series,
                            const std::vector<std::string>& all,
                            const std::vector<std::string>& joints, int periods,
                            double link_damping_Nms_rad) {
  std::string names;
  std::vector<Eigen::Index> columns;
  for (std::size_t j = 0; j < all.size(); ++j) {
    if (std::ranges::find(joints, all[j]) == joints.end()) continue;
    names += (names.empty() ? "" : ", ") + quoted_text(all[j]);
    columns.push_back(static_cast<Eigen::Index>(j));
  }
  std::string text = fmt::format(
      "\n[[controller]]\nplugin = \"joint_trajectory\"\nname = \"{}\"\n[controller.parameters]\n"
      "interpolation = \"fourier\"\nperiod_s = {:.9g}\nperiods = {}\n{}joints = [{}]\n",
      name, series.period_s, periods,
      link_damping_Nms_rad > 0.0
          ? fmt::format("link_damping_Nms_rad = {:.3g}\n", link_damping_Nms_rad)
          : "",
      names);
  const auto row = [&](const Eigen::MatrixXd& values, Eigen::Index k) {
    std::string out;
    for (const Eigen::Index column : columns)
      out += fmt::format("{}{:.9g}", out.empty() ? "" : ", ", values(k, column));
    return out;
  };
  for (Eigen::Index k = 0; k < series.a.rows(); ++k) {
    text += fmt::format("[[controller.parameters.harmonic]]\ncos_rad = [{}]\nsin_rad = [{}]\n",
                        row(series.a, k), row(series.b, k));
  }
  return text;
}

/// By how much the legs' links are damped: a share of their softest spring; 0 without springs.
double leg_damping(const hal::RobotConfig& robot, const std::vector<std::string>& legs) {
  double softest = std::numeric_limits<double>::infinity();
  for (const std::string& name : legs) {
    const auto& joint = robot.joints[static_cast<std::size_t>(robot.joint_index(name))];
    const hal::ActuatorConfig& actuator = robot.actuator_of(joint);
    if (actuator.order >= 2) softest = std::min(softest, actuator.spring_Nm_rad);
  }
  return std::isfinite(softest) ? kDamped_s * softest : 0.0;
}

/// "9.3 of 69 base parameters".
std::string condition_text(const identification::Excitation& result) {
  if (std::isfinite(result.condition_number))
    return fmt::format("{:.1f} of {} base parameters", result.condition_number,
                       result.base_parameters);
  return fmt::format("infinite: of {} base parameters these joints leave some untouched",
                     result.base_parameters);
}

std::string experiment_text(const identification::Excitation& result, const ExciteOptions& options,
                            const hal::RobotConfig& robot, const std::string& posture) {
  std::string text = fmt::format(
      "{}, written by `tandem excite --seed {}`.\n"
      "# Condition number {}.\n# At most {:.0f} % of a joint's way to its limits, {:.0f} % of its "
      "speed, {:.0f} % of its torque.\n"
      "robot = {}\n{}duration_s = {:.9g}\nseed = 1\n",
      kExciteHead, options.seed, condition_text(result), 100.0 * result.position_share,
      100.0 * result.speed_share, 100.0 * result.torque_share,
      quoted_text(relative_path(options.output, options.robot)),
      posture.empty() ? "" : fmt::format("posture = {}\n", quoted_text(posture)),
      options.periods * options.period_s + 1.0);
  if (options.hung) {
    text += fmt::format(
        "\n[sim]\nhoist.lift_m = {:.2f}   # it hangs: a real robot's feet must be in the air, "
        "too\n",
        result.lift_m);
  }
  std::vector<std::string> others;
  for (const std::string& joint : result.joints)
    if (std::ranges::find(result.legs, joint) == result.legs.end()) others.push_back(joint);
  const auto add = [&](const char* name, const std::vector<std::string>& joints, double damping) {
    if (joints.empty()) return;
    text += controller_text(name, result.series, result.joints, joints, options.periods, damping);
  };
  add("excite", others, 0.0);
  add("excite_legs", result.legs, leg_damping(robot, result.legs));
  return text;
}

/// A robot that stands or hangs on soft springs sways, which the search does not know: it is
/// simulated, and excited more gently until it runs through.
constexpr int kTrials = 8;
constexpr double kGentler = 0.8;

struct Found {
  std::string experiment{};  // its path
  identification::Excitation excitation{};
  double share = 0.0;
  std::string refused{};  // what ended the last trial that failed
};

/// @param file  to write it to; its robot's path is from options.output
Result<Found> search(const robot::RobotFiles& robot, const ExciteOptions& options,
                     const std::string& posture, const std::string& file, const Trial& trial) {
  identification::ExciteRequest request{.posture = posture,
                                        .joints = options.joints,
                                        .period_s = options.period_s,
                                        .harmonics = options.harmonics,
                                        .seed = options.seed,
                                        .share = options.share,
                                        .tries = options.tries,
                                        .hung = options.hung};
  Found found{.experiment = options.output};
  for (int attempt = 0; attempt < kTrials; ++attempt) {
    auto result = identification::excite(robot.config, robot.tree, request);
    if (!result && found.refused.empty()) return std::unexpected(result.error());
    if (!result) break;
    found.excitation = std::move(*result);
    found.share = request.share;
    const std::string text = experiment_text(found.excitation, options, robot.config, posture);
    if (const Status s = write_file(file, text); !s) return std::unexpected(s.error());
    if (!robot.tree.floating_base || options.output == "-") return found;
    auto end = trial(file);
    if (!end) return std::unexpected(end.error());
    if (end->empty()) return found;
    found.refused = std::move(*end);
    request.share *= kGentler;
  }
  return fail("no experiment completes in simulation; the gentlest ended with: " + found.refused,
              "give another --seed, a longer --period, or --share less");
}

}  // namespace

static void figures(Figures& f, const Found& found) {
  const identification::Excitation& result = found.excitation;
  f("experiment", "path of the experiment", found.experiment);
  f("condition_number", "of columns of unit length; null: infinite", result.condition_number);
  f("base_parameters", "how many there are", result.base_parameters);
  f("joints", "that move", result.joints);
  f("held", "that do not", result.still);
  f("position_share", "largest share of a joint's way to its limit", result.position_share);
  f("speed_share", "the same of its speed", result.speed_share);
  f("torque_share", "and of its torque", result.torque_share);
  f("share", "`--share`, or less: what ran through in simulation", found.share);
  f("lift_m", "by which a robot that hangs is lifted; else 0", result.lift_m);
  f("room_m", "self-distance beyond the 2 cm required; null: no links to look at", result.room_m);
  f("margin_m", "zero-moment point inside the feet; 0: it does not stand", result.margin_m);
}

std::vector<Figures::Row> excite_figures() { return Figures::rows_of<Found>(); }

static void print_found(const robot::RobotFiles& robot, const ExciteOptions& options,
                        const Found& found, const Json& json) {
  Facts facts;
  add_figures(
      facts, json,
      {{"experiment", "{experiment}"},
       {"condition number", condition_text(found.excitation)},
       {"joints", fmt::format("{} move, {} are held", json["joints"].size(), json["held"].size())},
       {"way to limits", "{position_share:.0f %} at most"},
       {"speed", "{speed_share:.0f %} of a limit at most"},
       {"torque", "{torque_share:.0f %} of a limit at most"},
       {"self-distance", "{room_m:.0f mm} more than required"}});
  if (options.hung) add_figures(facts, json, "hoist", "lifts it {lift_m:.2f m}");
  if (robot.tree.floating_base && !options.hung)
    add_figures(facts, json, "balance", "{margin_m:.0f mm} inside the feet");
  if (robot.tree.floating_base && options.output != "-") {
    facts.add("simulated",
              found.refused.empty()
                  ? std::string("it runs through")
                  : fmt::format("it runs through with --share {:.3g}; more ended with: {}",
                                found.share, found.refused));
  }
  facts.print(human_output(options.json));
}

Exit excite_command(const ExciteOptions& given, const Trial& trial) {
  ExciteOptions options = given;
  if (options.period_s <= 0.0) options.period_s = options.hung ? 3.0 : 10.0;
  if (options.periods <= 0) options.periods = options.hung ? 20 : 3;
  const double needed_s = identification::shortest_motion_s();
  if (options.periods * options.period_s < needed_s) {
    return refuse(
        Error{fmt::format("too short for `tandem identify`: {} of {} s, and it needs {:.1f} s",
                          counted(static_cast<std::size_t>(options.periods), "period"),
                          options.period_s, needed_s),
              fmt::format("give --periods {} or more, or a longer --period",
                          std::ceil(needed_s / options.period_s)),
              {},
              0,
              {}});
  }
  const auto robot = robot::read_robot(options.robot);
  if (!robot) return refuse(robot.error());
  if (const Status s =
          check_overwrites(options.output, kExciteHead, "experiment of `tandem excite`");
      !s)
    return refuse(s.error());
  std::vector<std::string> joints;
  for (const hal::JointConfig& joint : robot->config.joints) joints.push_back(joint.name);
  options.joints = listed_names(options.joints, joints);
  std::string posture = options.posture;
  if (posture.empty() && !robot->config.postures.empty())
    posture = robot->config.postures.front().name;
  if (options.tries <= 0) options.tries = robot->config.joints.size() > 12 ? 60 : 300;
  Draft draft = Draft::file(options.output);
  auto found = search(*robot, options, posture, draft.path(), trial);
  if (!found) {
    Error error = draft.placed(found.error());
    if (error.file.empty()) error.file = options.robot;
    return refuse(error);
  }
  if (const Status placed = draft.place(); !placed) return refuse(placed.error());
  found->refused = draft.placed(found->refused);
  const Json json = figures_json(*found);
  print_found(*robot, options, *found, json);
  return end_with_json(options.json, json);
}

}  // namespace tandem::apps
