#include "report/run_figures.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "model/closed_loops.hpp"
#include "report/inverse_dynamics.hpp"
#include "report/posture.hpp"

namespace tandem::report {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kMotionStep_s = 0.005;  // of the inverse dynamics

std::size_t at(int index) { return static_cast<std::size_t>(index); }

/// The joints of the tree from the root to the link of the first foot's site.
std::vector<int> first_leg(const RunData& run) {
  std::vector<int> joints;
  if (run.robot.contact.feet.empty()) return joints;
  for (const hal::SiteConfig& site : run.robot.model.sites) {
    const int link = run.tree.link_index(site.link);
    if (site.name != run.robot.contact.feet.front().site || link < 0) continue;
    for (int body = run.tree.links[at(link)].body; body > 0;
         body = run.tree.joints[at(body) - 1].parent) {
      joints.insert(joints.begin(), body - 1);
    }
  }
  return joints;
}

/// Joints (image) of the first leg that turn about the robot's lateral axis.
std::vector<int> pitch_joints(const RunData& run) {
  PostureSample zero{"", 0.0, {}, std::vector<double>(run.robot.joints.size(), 0.0)};
  const auto bodies = body_placements(run.tree, run.robot, zero);
  std::vector<int> found;
  for (const int joint : first_leg(run)) {
    const model::Joint& j = run.tree.joints[at(joint)];
    const int index = run.robot.joint_index(j.name);
    if (index >= 0 && std::abs((bodies[at(joint) + 1].R * j.axis).y()) > 0.9) {
      found.push_back(index);
    }
  }
  return found;
}

/// Joints by how far they moved, the widest first.
std::vector<int> widest_joints(const RunData& run) {
  std::vector<double> range;
  for (const std::vector<double>& q : run.position_rad) {
    const auto [low, high] = std::ranges::minmax_element(q);
    range.push_back(*high - *low);
  }
  std::vector<int> order(range.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, std::ranges::greater{}, [&](int j) { return range[at(j)]; });
  return order;
}

bool legged(const RunData& run) { return !run.robot.contact.feet.empty(); }

Curve curve_of(const RunData& run, std::string label, CurveStyle style,
               const std::vector<double>& values, double factor) {
  Curve curve{std::move(label), style, run.time_s, values};
  for (double& value : curve.y) value *= factor;
  return curve;
}

Figure hip_figure(const RunData& run, const RunData* other, const Subjects& subjects) {
  const std::size_t joint = at(subjects.hip);
  const std::string& name = run.robot.joints[joint].name;
  Figure figure;
  figure.name = "hip_position";
  figure.title = (subjects.leg ? "Hip" : "Joint") + std::string(" position against its reference");
  figure.x_label = "time [s]";
  figure.y_label = name + " [deg]";
  figure.curves.push_back(curve_of(run, other == nullptr ? "measured" : "measured, A",
                                   CurveStyle::kMeasured, run.position_rad[joint], kDegrees));
  if (other != nullptr) {
    figure.curves.push_back(curve_of(*other, "measured, B", CurveStyle::kSecond,
                                     other->position_rad[joint], kDegrees));
  }
  figure.curves.push_back(curve_of(run, other == nullptr ? "reference" : "reference, A",
                                   CurveStyle::kReference, run.reference_rad[joint], kDegrees));
  return figure;
}

double gravity_m_s2(const RunData& run) {
  const auto& g = run.robot.model.gravity_m_s2;
  return std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
}

/// Weight of everything that moves [N].
double weight_N(const RunData& run) {
  double mass_kg = 0.0;
  for (const model::Body& body : run.tree.bodies) mass_kg += body.inertia.mass_kg;
  return mass_kg * gravity_m_s2(run);
}

/// Which links lie beyond a joint, away from the root.
std::vector<bool> links_beyond(const RunData& run, const std::string& joint) {
  std::vector<bool> beyond(run.tree.links.size(), false);
  const int first = run.tree.child_link_index(joint);
  for (std::size_t i = at(std::max(first, 0)); first >= 0 && i < beyond.size(); ++i) {
    const int parent = run.tree.links[i].parent;
    beyond[i] = i == at(first) || (parent >= 0 && beyond[at(parent)]);
  }
  return beyond;
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

/// Whether a sensor measures what a foot carries; on a robot without feet, whether it is six-axis.
bool on_a_leg(const RunData& run, const hal::SensorConfig& sensor) {
  if (sensor.type != hal::SensorType::kForceTorque) return false;
  if (!legged(run)) return true;
  const std::vector<bool> beyond = links_beyond(run, sensor.joint);
  return std::ranges::any_of(run.robot.contact.feet, [&](const hal::FootConfig& foot) {
    return std::ranges::any_of(run.robot.model.sites, [&](const hal::SiteConfig& site) {
      const int link = run.tree.link_index(site.link);
      return site.name == foot.site && link >= 0 && beyond[at(link)];
    });
  });
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

Figure force_figure(const RunData& run, const RunData* other, const std::vector<int>& sensors) {
  constexpr CurveStyle kStyles[] = {CurveStyle::kMeasured, CurveStyle::kSecond, CurveStyle::kThird,
                                    CurveStyle::kFourth,   CurveStyle::kFifth,  CurveStyle::kSixth};
  const std::vector<Force> forces = foot_forces(run, sensors);
  const std::size_t feet = run.robot.contact.feet.size();
  Figure figure;
  figure.name = "foot_force";
  figure.title = sensors.empty() ? "Vertical force of the ground on the feet (simulated)"
                                 : fmt::format("Vertical force in the {}six-axis sensors",
                                               legged(run) ? "feet's " : "");
  figure.x_label = "time [s]";
  figure.y_label = "force [N]";
  const std::size_t shown =
      other == nullptr ? std::min(std::size(kStyles), forces.size()) : std::size_t{1};
  if (shown < forces.size()) figure.title += fmt::format(", {} of {}", shown, forces.size());
  for (std::size_t i = 0; i < shown; ++i) {
    figure.curves.push_back(curve_of(run, forces[i].name + (other == nullptr ? "" : ", A"),
                                     kStyles[i], forces[i].up_N, 1.0));
  }
  if (other != nullptr) {
    const std::vector<Force> more = foot_forces(*other, sensors);
    if (!more.empty()) {
      figure.curves.push_back(curve_of(*other, more.front().name + ", B", CurveStyle::kSecond,
                                       more.front().up_N, 1.0));
    }
  }
  if (!run.robot.model.floating_base || feet == 0 || forces.size() != feet) return figure;
  const double share = weight_N(run) / static_cast<double>(feet);
  if (sensors.empty()) {
    figure.levels.push_back({share_text(feet), share, true});
  } else {
    figure.levels.push_back(
        {share_text(feet) + "; lower line: less the foot beyond the sensor", share, true});
    figure.levels.push_back({"", share - weight_beyond_N(run, sensors.front()), true});
  }
  return figure;
}

Figure torque_figure(const RunData& run, const RunData* other, const Subjects& subjects,
                     const tandem_kernels* kernels) {
  const std::size_t joint = at(subjects.knee);
  const std::string& name = run.robot.joints[joint].name;
  Figure figure;
  figure.name = "knee_torque";
  figure.title = (subjects.leg ? "Knee" : "Joint") + std::string(" torque: measured");
  figure.x_label = "time [s]";
  figure.y_label = name + " [Nm]";
  figure.curves.push_back(curve_of(run, other == nullptr ? "measured" : "measured, A",
                                   CurveStyle::kMeasured, run.torque_Nm[joint], 1.0));
  if (other != nullptr) {
    figure.curves.push_back(
        curve_of(*other, "measured, B", CurveStyle::kSecond, other->torque_Nm[joint], 1.0));
  }
  if (kernels == nullptr) return figure;
  Curve computed = inverse_dynamics_curve(run, subjects.knee, *kernels);
  if (computed.x.empty()) {
    figure.title += " (no inverse dynamics: the log lacks the ground's forces)";
  } else {
    figure.title += ", and by inverse dynamics";
    figure.curves.push_back(std::move(computed));
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

/// Moments of the first half cycle and the end: by the base's height, or by `joint`'s position.
/// @param suffix  behind each label, when two runs stand beside each other: then fewer moments.
std::vector<PostureSample> moments(const RunData& run, int joint, const std::string& suffix) {
  const bool base = run.truth() && run.robot.model.floating_base;
  const std::vector<double>& depth = base ? run.base[2] : run.position_rad[at(joint)];
  const double start = depth.front();
  const auto far = std::ranges::max_element(
      depth, {}, [start](double value) { return std::abs(value - start); });
  const double turn = *far;
  // The first time that the run comes to within a hundredth of its farthest point.
  const auto arrived = std::ranges::find_if(
      depth, [&](double value) { return std::abs(value - turn) <= 0.01 * std::abs(turn - start); });
  const auto lowest = static_cast<std::size_t>(arrived - depth.begin());
  const std::size_t half = nearest_row(depth, 0.5 * (start + turn), 0, lowest + 1);
  const std::size_t last = run.rows() - 1;
  std::vector<PostureSample> samples;
  const auto add = [&](const char* what, std::size_t row) {
    samples.push_back(
        {what + suffix, run.time_s[row], run.base_placement(row), run.positions(row)});
  };
  add("start", 0);
  if (suffix.empty()) add("half way", half);
  add(base ? "lowest" : "farthest", lowest);
  if (suffix.empty()) add("end", last);
  return samples;
}

/// Where joint `name` stands in run.positions(); none: neither driven nor known to the truth.
std::optional<std::size_t> position_index(const RunData& run, const std::string& name) {
  if (const int driven = run.robot.joint_index(name); driven >= 0) return at(driven);
  const auto passive = std::ranges::find(run.robot.passive, name, &hal::PassiveConfig::name);
  const auto index = static_cast<std::size_t>(passive - run.robot.passive.begin());
  if (index >= run.passive_rad.size()) return std::nullopt;
  return run.robot.joints.size() + index;
}

/// What inverse dynamics needs to know of closed loops; nothing for a robot without passive joints.
/// None: the forces in the loops cannot be told from those that force sensors measure.
std::optional<model::ClosedLoops> loops_of(const RunData& run, const tandem_kernels& kernels) {
  if (run.robot.passive.empty()) return model::ClosedLoops();
  if (kernels.sensors > 0) return std::nullopt;
  auto loops =
      model::ClosedLoops::create(run.robot.loop_specs(), run.robot.passive_names(), kernels);
  return loops ? std::optional(std::move(*loops)) : std::nullopt;
}

}  // namespace

Subjects subjects_of(const RunData& run) {
  Subjects subjects;
  std::vector<int> joints = pitch_joints(run);
  subjects.leg = joints.size() >= 2;
  if (!subjects.leg) joints = widest_joints(run);
  subjects.hip = run.robot.joint_index(run.hip);
  subjects.knee = run.robot.joint_index(run.knee);
  if (subjects.hip < 0) subjects.hip = joints.front();
  if (subjects.knee < 0) subjects.knee = joints[std::min<std::size_t>(1, joints.size() - 1)];
  for (std::size_t i = 0; i < run.robot.sensors.size(); ++i) {
    const hal::SensorConfig& sensor = run.robot.sensors[i];
    const bool first = sensor.name == run.foot;
    if (!first && !on_a_leg(run, sensor)) continue;
    subjects.foot_sensors.insert(
        first ? subjects.foot_sensors.begin() : subjects.foot_sensors.end(), static_cast<int>(i));
  }
  return subjects;
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

namespace {

/// The foot at each wrench site of the kernels; -1: no foot, nothing acts there.
std::vector<int> feet_of_wrenches(const RunData& run, const tandem_kernels& kernels) {
  std::vector<int> feet;
  const auto& all = run.robot.contact.feet;
  for (std::uint32_t w = 0; w < kernels.wrenches; ++w) {
    const auto foot = std::ranges::find(all, kernels.wrench_names[w], &hal::FootConfig::site);
    feet.push_back(foot == all.end() ? -1 : static_cast<int>(foot - all.begin()));
  }
  return feet;
}

/// What the ground did at each wrench site: force and moment in W's axes.
std::vector<double> ground_wrenches(const RunData& run, const std::vector<int>& feet,
                                    std::size_t row) {
  std::vector<double> wrenches(6 * feet.size(), 0.0);
  for (std::size_t w = 0; w < feet.size(); ++w) {
    for (std::size_t k = 0; feet[w] >= 0 && k < 3; ++k) {
      wrenches[6 * w + k] = run.foot_force_N[3 * at(feet[w]) + k][row];
      wrenches[6 * w + 3 + k] = run.foot_moment_Nm[3 * at(feet[w]) + k][row];
    }
  }
  return wrenches;
}

}  // namespace

Curve inverse_dynamics_curve(const RunData& run, int joint, const tandem_kernels& kernels) {
  const auto stride = static_cast<std::size_t>(std::max(1.0, kMotionStep_s / run.step_s));
  const std::size_t base_q = kernels.floating_base != 0 ? 7 : 0;
  const std::size_t base_v = kernels.floating_base != 0 ? 6 : 0;
  Motion motion;
  motion.step_s = run.step_s * static_cast<double>(stride);
  Curve curve{"inverse dynamics", CurveStyle::kComputed, {}, {}};
  std::vector<std::size_t> model_order(kernels.joints);
  std::size_t wanted = 0;
  for (std::size_t i = 0; i < kernels.joints; ++i) {
    const std::optional<std::size_t> index = position_index(run, kernels.joint_names[i]);
    if (!index) return curve;  // not this robot's kernels, or a log without truth
    model_order[i] = *index;
    if (*index == at(joint)) wanted = base_v + i;
  }
  std::optional<model::ClosedLoops> loops = loops_of(run, kernels);
  if (!loops || (base_q > 0 && !run.truth())) return curve;
  const std::vector<int> feet = feet_of_wrenches(run, kernels);
  for (std::size_t row = 0; row < run.rows(); row += stride) {
    std::vector<double> q(base_q);
    std::vector<double> v(base_v);
    for (std::size_t i = 0; i < base_q; ++i) q[i] = run.base[i][row];
    for (std::size_t i = 0; i < base_v; ++i) v[i] = run.base[7 + i][row];
    const std::vector<double> positions = run.positions(row);
    for (const std::size_t j : model_order) {
      q.push_back(positions[j]);
      v.push_back(j < run.velocity_rad_s.size() ? run.velocity_rad_s[j][row] : 0.0);
    }
    loops->move(q.data(), v.data());
    loops->differentiate(q.data());
    loops->close_rates(v.data());
    std::vector<double> sensors;
    for (std::size_t s = 0; s < kernels.sensors; ++s) {
      const int index = run.robot.sensor_index(kernels.sensor_names[s]);
      const std::size_t first = run.first_channel(at(std::max(index, 0)));
      for (std::size_t i = 0; i < 6; ++i) sensors.push_back(run.sensor[first + i][row]);
    }
    motion.q.push_back(std::move(q));
    motion.v.push_back(std::move(v));
    motion.sensors.push_back(std::move(sensors));
    if (run.truth()) motion.wrenches.push_back(ground_wrenches(run, feet, row));
    curve.x.push_back(run.time_s[row]);
  }
  if (!wrenches_known(kernels, motion)) return {};
  std::vector<std::vector<double>> torques = inverse_dynamics(kernels, motion);
  for (std::size_t row = 0; row < torques.size(); ++row) {
    loops->move(motion.q[row].data(), motion.v[row].data());
    loops->differentiate(motion.q[row].data());
    loops->carry_passive(torques[row].data());
    curve.y.push_back(torques[row][wanted]);
  }
  return curve;
}

std::vector<Figure> figures_of(const RunData& run, const RunData* other,
                               const tandem_kernels* kernels) {
  const Subjects subjects = subjects_of(run);
  std::vector<Figure> figures;
  figures.push_back(hip_figure(run, other, subjects));
  if (!subjects.foot_sensors.empty() || (run.truth() && legged(run))) {
    figures.push_back(force_figure(run, other, subjects.foot_sensors));
  }
  figures.push_back(torque_figure(run, other, subjects, kernels));
  std::vector<PostureSample> samples = moments(run, subjects.hip, other == nullptr ? "" : " A");
  if (other != nullptr) {
    const auto more = moments(*other, subjects.hip, " B");
    samples.insert(samples.end(), more.begin(), more.end());
  }
  figures.push_back(posture_figure(run.tree, run.robot, samples));
  return figures;
}

}  // namespace tandem::report
