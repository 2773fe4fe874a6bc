// Makes the four figures of the joints and feet that subjects.hpp chooses.
#include "report/run_figures.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <utility>

#include "log/run_window.hpp"
#include "report/logged_torque.hpp"
#include "report/posture.hpp"

namespace tandem::report {
namespace {

constexpr double kMillimetres = 1e3;
constexpr double kMoves = 0.01;  // [rad, m]: less between two postures is none that one can see

std::size_t at(int index) { return static_cast<std::size_t>(index); }

bool has_numbers(const std::vector<double>& values) {
  return std::ranges::any_of(values, [](double value) { return std::isfinite(value); });
}

/// Whether nobody knows where the base was.
bool unplaced(const RunData& run) { return run.robot.model.floating_base && !run.motion_known(); }

/// @param log  its letter where there are several, else 0
Curve curve_of(const RunData& run, std::string label, char log, CurveStyle style,
               const std::vector<double>& values, double factor) {
  Curve curve{std::move(label), style, {}, {}, log};
  for (std::size_t row = 0; row < std::min(values.size(), run.rows()); ++row) {
    if (!run.is_drawn(run.time_s[row])) continue;
    curve.x.push_back(run.drawn(run.time_s[row]));
    curve.y.push_back(values[row] * factor);
  }
  return curve;
}

/// 'A' of the first of several runs; 0 when it is alone.
char letter_of(std::size_t index, const OtherRuns& others) {
  return others.empty() ? '\0' : static_cast<char>('A' + index);
}

/// How the runs after the first look.
constexpr CurveStyle kOthers[] = {CurveStyle::kSecond, CurveStyle::kFourth};
static_assert(std::size(kOthers) == kMostOthers);

/// What was done to a run while it is drawn: each kind has one label, and the first few marks.
void add_marks(const RunData& run, const std::string& side, Figure& figure) {
  constexpr std::size_t kMostOfAKind = 12;
  std::map<std::string, std::size_t> drawn;
  for (const RunMark& one : run.marks) {
    const bool seen = one.time_s >= run.time_s.front() && one.time_s <= run.time_s.back();
    if (!seen || !run.is_drawn(one.time_s)) continue;
    const std::size_t before = drawn[one.kind]++;
    if (before >= kMostOfAKind) continue;
    figure.marks.push_back({before == 0 ? one.kind + side : "", run.drawn(one.time_s), false});
  }
}

/// What every figure over time has: its axis, and where runs had faults. The plots show all that
/// led to the one that stopped a run; what follows does not widen them.
void add_time(const RunData& run, const OtherRuns& others, Figure& figure) {
  figure.x_label = time_label(run);
  for (std::size_t i = 0; i <= others.size(); ++i) {
    const RunData& one = i == 0 ? run : *others[i - 1];
    const RunFault* const stop = one.stop();
    const std::string side = others.empty() ? "" : std::string(", ") + letter_of(i, others);
    add_marks(one, side, figure);
    std::string reported = "fault, reported" + side;
    for (std::size_t f = 0; f < std::min(kFaultsShown, one.faults.size()); ++f) {
      const RunFault& fault = one.faults[f];
      if (fault.stops || (stop != nullptr && fault.time_s > stop->time_s)) continue;
      figure.marks.push_back({std::exchange(reported, ""), one.drawn(fault.time_s)});
    }
    if (stop == nullptr) continue;
    const double stop_s = one.drawn(stop->time_s);
    figure.marks.push_back({"fault" + side, stop_s});
    figure.range_until_x = std::min(figure.range_until_x, stop_s + log::kHalfNanosecond);
  }
}

/// A tele-operator's state is a prediction, or late.
std::string name_of_state(const RunData& run) {
  return run.info.operators_view ? "as the operator saw it" : "measured";
}

Figure position_figure(const RunData& run, const OtherRuns& others, const Subjects& subjects) {
  const std::size_t joint = at(subjects.position_of);
  const std::string& name = run.robot.joints[joint].name;
  Figure figure;
  figure.name = "joint_position";
  figure.title = name + (has_numbers(run.reference_rad[joint]) ? ": position against its reference"
                                                               : ": position");
  add_time(run, others, figure);
  const bool slides = run.slides(joint);
  const double factor = slides ? kMillimetres : kDegrees;
  figure.y_label = slides ? "position [mm]" : "position [deg]";
  figure.curves.push_back(curve_of(run, name_of_state(run), letter_of(0, others),
                                   CurveStyle::kMeasured, run.measured(run.position_rad, joint),
                                   factor));
  for (std::size_t i = 0; i < others.size(); ++i) {
    figure.curves.push_back(curve_of(*others[i], name_of_state(*others[i]),
                                     letter_of(i + 1, others), kOthers[i],
                                     others[i]->measured(others[i]->position_rad, joint), factor));
  }
  figure.curves.push_back(curve_of(run, "reference", letter_of(0, others), CurveStyle::kReference,
                                   run.reference_rad[joint], factor));
  return figure;
}

double gravity_m_s2(const RunData& run) {
  const auto& g = run.robot.model.gravity_m_s2;
  return std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
}

/// Weight of everything that moves [N]: as the run says it where its plant was another one.
double weight_N(const RunData& run) {
  const std::string said = log::value_of(run.result, "weight_N");
  if (!said.empty()) return std::strtod(said.c_str(), nullptr);
  double mass_kg = 0.0;
  for (const model::Body& body : run.tree.bodies) mass_kg += body.inertia.mass_kg;
  return mass_kg * gravity_m_s2(run);
}

/// Weight of the links beyond a sensor's joint [N]: what a foot's sensor does not carry.
double weight_beyond_N(const RunData& run, int sensor) {
  const std::vector<bool> beyond = links_beyond(run, run.robot.sensors[at(sensor)].joint);
  double mass_kg = 0.0;
  for (std::size_t i = 0; i < beyond.size(); ++i) {
    if (beyond[i]) mass_kg += run.tree.links[i].inertia.mass_kg;
  }
  return mass_kg * gravity_m_s2(run);
}

/// The share of the weight that every foot carries when all carry alike.
std::string share_text(std::size_t feet) {
  if (feet == 1) return "the weight";
  return feet == 2 ? "half the weight" : fmt::format("1/{} of the weight", feet);
}

/// One vertical force per sensor or, without sensors, per foot by the log's truth.
struct Force {
  std::string name;
  std::vector<double> up_N;
};
std::vector<Force> foot_forces(const RunData& run, const std::vector<int>& sensors) {
  std::vector<Force> forces;
  for (const int sensor : sensors) {
    forces.push_back({run.robot.sensors[at(sensor)].name, vertical_force(run, sensor)});
  }
  if (!forces.empty() || !run.truth()) return forces;
  for (std::size_t foot = 0; foot < run.robot.contact.feet.size(); ++foot) {
    forces.push_back({run.robot.contact.feet[foot].site, run.foot_force_N[3 * foot + 2]});
  }
  return forces;
}

Figure force_figure(const RunData& run, const OtherRuns& others, const std::vector<int>& sensors) {
  constexpr CurveStyle kForceStyles[] = {CurveStyle::kMeasured, CurveStyle::kSecond,
                                         CurveStyle::kThird,    CurveStyle::kFourth,
                                         CurveStyle::kFifth,    CurveStyle::kSixth};
  const std::vector<Force> forces = foot_forces(run, sensors);
  const std::size_t feet = run.robot.contact.feet.size();
  Figure figure;
  figure.name = sensors.empty() || legged(run) ? "foot_force" : "sensor_force";
  figure.title = sensors.empty() ? "Vertical force of the ground on the feet (simulated)"
                                 : fmt::format("Vertical force in the {}six-axis sensors",
                                               legged(run) ? "legs' " : "");
  if (!sensors.empty() && unplaced(run)) figure.title += ", the base taken as upright";
  add_time(run, others, figure);
  figure.y_label = "force [N]";
  const std::size_t shown =
      others.empty() ? std::min(std::size(kForceStyles), forces.size()) : std::size_t{1};
  if (shown < forces.size()) figure.title += fmt::format(", {} of {}", shown, forces.size());
  for (std::size_t i = 0; i < shown; ++i) {
    figure.curves.push_back(
        curve_of(run, forces[i].name, letter_of(0, others), kForceStyles[i], forces[i].up_N, 1.0));
  }
  for (std::size_t i = 0; i < others.size(); ++i) {
    const std::vector<Force> more = foot_forces(*others[i], sensors);
    if (more.empty()) continue;
    figure.curves.push_back(curve_of(*others[i], more.front().name, letter_of(i + 1, others),
                                     kOthers[i], more.front().up_N, 1.0));
  }
  if (!run.robot.model.floating_base || feet == 0 || forces.size() != feet) return figure;
  const double share = weight_N(run) / static_cast<double>(feet);
  if (sensors.empty()) {
    figure.levels.push_back({share_text(feet), share});
  } else {
    // No sensor feels the foot below it, so none comes to the whole share.
    figure.levels.push_back({share_text(feet) + " without the foot beyond the sensor",
                             share - weight_beyond_N(run, sensors.front())});
  }
  return figure;
}

Figure torque_figure(const RunData& run, const OtherRuns& others, const Subjects& subjects,
                     const tandem_kernels* kernels) {
  const std::size_t joint = at(subjects.torque_of);
  const std::string& name = run.robot.joints[joint].name;
  Figure figure;
  const bool slides = run.slides(joint);
  figure.name = "joint_torque";
  const char* const measured = has_numbers(run.torque_Nm[joint]) ? ", measured" : "";
  figure.title = name + (slides ? ": force" : ": torque") + measured;
  add_time(run, others, figure);
  figure.y_label = slides ? "force [N]" : "torque [Nm]";
  figure.curves.push_back(curve_of(run, name_of_state(run), letter_of(0, others),
                                   CurveStyle::kMeasured, run.measured(run.torque_Nm, joint), 1.0));
  for (std::size_t i = 0; i < others.size(); ++i) {
    figure.curves.push_back(curve_of(*others[i], name_of_state(*others[i]),
                                     letter_of(i + 1, others), kOthers[i],
                                     others[i]->measured(others[i]->torque_Nm, joint), 1.0));
  }
  if (kernels == nullptr) return figure;
  Result<Curve> computed = inverse_dynamics_curve(run, subjects.torque_of, *kernels);
  if (!computed) {
    figure.title += " (no inverse dynamics: " + computed.error().message + ")";
  } else {
    figure.title += *measured != 0 ? " and by inverse dynamics" : " by inverse dynamics";
    computed->log = letter_of(0, others);
    figure.curves.push_back(std::move(*computed));
  }
  return figure;
}

/// The row in which `values` comes nearest to `wanted`, between two rows.
std::size_t nearest_row(const std::vector<double>& values, double wanted, std::size_t begin,
                        std::size_t end) {
  std::size_t best = begin;
  for (std::size_t row = begin; row < end; ++row) {
    if (std::abs(values[row] - wanted) < std::abs(values[best] - wanted)) best = row;
  }
  return best;
}

/// How high the base was at every row; where nobody knows, above its feet. Empty: it has none.
std::vector<double> base_height(const RunData& run) {
  if (!run.robot.model.floating_base) return {};
  if (!unplaced(run)) return run.base[2];
  std::vector<double> height_m;
  for (std::size_t row = 0; row < run.rows(); ++row) {
    const PostureSample sample{"", run.time_s[row], {}, run.positions(row)};
    const std::optional<double> foot_m = lowest_foot_m(run.tree, run.robot, sample);
    if (!foot_m) return {};
    height_m.push_back(-*foot_m);
  }
  return height_m;
}

/// Whether the base goes down, and not only gives way: by more than a fiftieth of its height.
bool squats(const std::vector<double>& height_m, std::size_t rows) {
  if (height_m.empty()) return false;
  const auto first = height_m.begin();
  const auto [low, high] = std::minmax_element(first, first + static_cast<std::ptrdiff_t>(rows));
  return *high - *low > 0.02 * std::abs(*first);
}

/// Moments of the first half cycle and the end, which may be a fault: by the base's height, or by
/// `joint`'s position.
/// @param suffix  behind each label, when two runs stand beside each other: then fewer moments.
std::vector<PostureSample> moments(const RunData& run, int joint, const std::string& suffix) {
  const std::vector<double> height_m = base_height(run);
  const bool base = squats(height_m, run.rows_before_stop());
  const std::vector<double>& whole = base ? height_m : run.position_rad[at(joint)];
  std::vector<std::size_t> rows;  // that are drawn
  std::vector<double> depth;
  for (std::size_t row = 0; row < run.rows_before_stop(); ++row) {
    if (!run.is_drawn(run.time_s[row])) continue;
    rows.push_back(row);
    depth.push_back(whole[row]);
  }
  std::vector<PostureSample> samples;
  if (rows.empty()) return samples;
  const auto add = [&](const char* what, std::size_t shown) {
    const std::size_t row = rows[shown];
    samples.push_back({what + suffix, run.drawn(run.time_s[row]), run.base_placement(row),
                       run.positions(row), !unplaced(run), &run.robot.contact,
                       run.robot.contact.terrain.motion_at(run.time_s[row]).position_m});
  };
  const std::size_t last = depth.size() - 1;
  const double start = depth.front();
  const auto far = std::ranges::max_element(
      depth, {}, [start](double value) { return std::abs(value - start); });
  const double turn = *far;
  // The first time that the run comes to within a hundredth of its farthest point.
  const auto arrived = std::ranges::find_if(
      depth, [&](double value) { return std::abs(value - turn) <= 0.01 * std::abs(turn - start); });
  const auto lowest = static_cast<std::size_t>(arrived - depth.begin());
  const std::size_t half = nearest_row(depth, 0.5 * (start + turn), 0, lowest + 1);
  add("start", 0);
  const bool moves = base || std::abs(turn - start) > kMoves;
  if (suffix.empty() && moves) add("half way", half);
  if (moves) add(base ? "lowest" : "farthest", lowest);
  if (suffix.empty()) add(run.stop() == nullptr ? "end" : "fault", last);
  return samples;
}

}  // namespace

std::string time_label(const RunData& run) {
  return run.info.hal == "import" ? "time since the recording's start [s]"
                                  : "time since the first SYNC [s]";
}

std::vector<double> vertical_force(const RunData& run, int sensor) {
  const hal::SensorConfig& config = run.robot.sensors[at(sensor)];
  const std::size_t first = run.first_channel(at(sensor));
  const int link = run.tree.link_index(config.link);
  std::vector<double> force(run.rows());
  for (std::size_t row = 0; row < run.rows(); ++row) {
    const PostureSample sample{"", run.time_s[row], run.base_placement(row), run.positions(row)};
    const auto bodies = body_placements(run.tree, run.robot, sample);
    const model::Link& frame = run.tree.links[at(std::max(link, 0))];
    const Eigen::Vector3d measured(run.sensor[first][row], run.sensor[first + 1][row],
                                   run.sensor[first + 2][row]);
    force[row] = (bodies[at(frame.body)].R * frame.in_body.R * measured).z();
  }
  return force;
}

std::vector<Figure> figures_of(const RunData& run, const OtherRuns& others,
                               const tandem_kernels* kernels) {
  const Subjects subjects = subjects_of(run);
  std::vector<Figure> figures;
  figures.push_back(position_figure(run, others, subjects));
  if (!subjects.foot_sensors.empty() || (run.truth() && legged(run))) {
    figures.push_back(force_figure(run, others, subjects.foot_sensors));
  }
  figures.push_back(torque_figure(run, others, subjects, kernels));
  std::vector<PostureSample> samples =
      moments(run, subjects.position_of, others.empty() ? "" : " A");
  for (std::size_t i = 0; i < others.size(); ++i) {
    const auto more =
        moments(*others[i], subjects.position_of, std::string(" ") + static_cast<char>('B' + i));
    samples.insert(samples.end(), more.begin(), more.end());
  }
  figures.push_back(posture_figure(run.tree, run.robot, samples));
  for (Figure& figure : figures) drop_empty_curves(figure);
  std::erase_if(figures, [](const Figure& figure) { return figure.curves.empty(); });
  return figures;
}

}  // namespace tandem::report
