#include "identification/answer.hpp"

#include <fmt/core.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "identification/estimate.hpp"

namespace tandem::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kTrained = 2.0 / 3.0;   // share of every log
constexpr double kBetween_s = 1.2;       // of filter windows: neither trained nor held out
constexpr double kIdentifiable = 0.3;    // of a link's scale
constexpr double kNarrowed = 2.0 / 3.0;  // of the interval that the description has by itself
constexpr double kStill_rad = 0.02;
constexpr double kMuchLeftOver = 0.3;  // of a joint's torque: a warning
constexpr double kNoTorque = 1e-3;     // of a joint's limit: a residual below it matters to nobody
constexpr double kWorse = 1.2;         // times the residual of the description: a warning
constexpr double kFelt = 5e-3;         // of a joint's limit: friction that matters
constexpr double kFeltRotor = 0.1;     // of the described one

/// Which instants train, and which are held back.
struct Split {
  std::vector<bool> trained, held;
  double held_s = 0.0;
};

Split split_of(const Equations& equations) {
  const std::size_t n = equations.time_s.size();
  Split split{std::vector<bool>(n, false), std::vector<bool>(n, false)};
  const double per_instant = equations.usable_s / static_cast<double>(std::max<std::size_t>(1, n));
  for (std::size_t l = 0; l < equations.first_of_log.size(); ++l) {
    const std::size_t begin = equations.first_of_log[l];
    const std::size_t end =
        l + 1 < equations.first_of_log.size() ? equations.first_of_log[l + 1] : n;
    const auto border =
        begin + static_cast<std::size_t>(kTrained * static_cast<double>(end - begin));
    for (std::size_t i = begin; i < end; ++i) {
      split.trained[i] = i < border;
      const bool held = i >= border && equations.time_s[i] > equations.time_s[border] + kBetween_s;
      split.held[i] = held;
      if (held) split.held_s += per_instant;
    }
  }
  return split;
}

/// Standard deviation of a quantity with this gradient.
double deviation(const VectorXd& gradient, const MatrixXd& covariance) {
  return std::sqrt(std::max(0.0, gradient.dot(covariance * gradient)));
}

using Ten = Eigen::Matrix<double, 10, 1>;

/// Mass, center of mass, inertia about it.
Ten physical(const LinkParameters& p) {
  const model::Inertia inertia = inertia_of(p);
  const Eigen::Matrix3d& I = inertia.about_com_kg_m2;
  Ten out;
  out << inertia.mass_kg, inertia.com_m, I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2);
  return out;
}

/// @param covariance  of the ten parameters by data and description; @param believed  by the latter
void describe_link(const LinkParameters& p, const Matrix10& covariance, const Matrix10& believed,
                   double quantile, LinkResult& link) {
  link.changed = true;
  link.identified = inertia_of(p);
  Matrix10 J;
  for (int k = 0; k < 10; ++k) {
    const double step = 1e-6 * std::max(std::abs(p[k]), 1e-3 * p[0]);
    const LinkParameters change = step * LinkParameters::Unit(k);
    J.col(k) = (physical(p + change) - physical(p - change)) / (2.0 * step);
  }
  const auto interval = [&](const Matrix10& of) -> Ten {
    return quantile * (J * of * J.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
  };
  const Ten ci = interval(covariance), before = interval(believed);
  const double mass = link.described.mass_kg;
  const double moment = std::max(link.described.about_com_kg_m2.trace() / 2.0, 1e-6 * mass);
  const double radius = std::max(std::sqrt(moment / mass), 0.01);
  // Known is what is narrow, and narrow because of the data.
  const auto known = [&](int k, double scale) {
    return ci[k] <= kIdentifiable * scale && ci[k] <= kNarrowed * before[k];
  };
  link.mass_ci95 = ci[0];
  link.com_ci95 = ci.segment<3>(1);
  link.inertia_ci95 = ci.tail<6>();
  link.mass_identifiable = known(0, mass);
  link.com_identifiable = link.inertia_identifiable = true;
  for (int k = 1; k < 4; ++k) link.com_identifiable &= known(k, radius);
  for (int k = 4; k < 10; ++k) link.inertia_identifiable &= known(k, moment);
}

/// What goes into the result, from the estimates.
class Answer {
 public:
  Answer(const hal::RobotConfig& config, const model::Tree& tree, IdentifiedRobot& robot,
         const Equations& equations, const Split& split)
      : config_(config), tree_(tree), robot_(robot), equations_(equations), split_(split) {
    base_ = structural_base(robot_, tree_);
    prior_ = make_prior(robot_);
    data_ = estimate_from_data(equations_, split_.trained, prior_, base_);
    believed_ = prior_.metric.inverse() / kBelieved;
    links_ = robot_.regressor.columns();
    possible_ = possible_parameters(data_, prior_, links_);
    described_ = VectorXd::Zero(equations_.columns);
    described_.head(links_) = robot_.regressor.described();
    for (std::size_t c = 0; c < robot_.facts.joint.size(); ++c)
      if (robot_.facts.rigid[c])
        described_[joint_column(c, JointColumn::kRotor)] = robot_.facts.rotor_kg_m2[c];
  }

  [[nodiscard]] const VectorXd& possible() const { return possible_; }

  void fill(Identification& out) {
    out.condition_number = data_.condition;
    out.usable_s = equations_.usable_s;
    out.held_out_s = split_.held_s;
    fill_links(out);
    fill_joints(out);
    fill_base(out);
    fill_mass(out);
    warn(out);
  }

 private:
  [[nodiscard]] Index joint_column(std::size_t coordinate, JointColumn column) const {
    return links_ + kJointColumns * static_cast<Index>(coordinate) + static_cast<Index>(column);
  }

  void fill_links(Identification& out) const {
    for (std::size_t l = 0; l < tree_.links.size(); ++l) {
      const model::Link& link = tree_.links[l];
      if (!(link.inertia.mass_kg > 0.0)) continue;
      LinkResult result;
      result.name = link.name;
      result.described = result.identified = link.inertia;
      result.mass_ci95 = kNone;
      result.com_ci95.setConstant(kNone);
      result.inertia_ci95.setConstant(kNone);
      for (std::size_t i = 0; i < robot_.regressor.pieces().size(); ++i) {
        if (robot_.regressor.pieces()[i].link != static_cast<int>(l)) continue;
        const Index at = 10 * static_cast<Index>(i);
        describe_link(possible_.segment<10>(at), data_.link_covariance.block<10, 10>(at, at),
                      believed_.block<10, 10>(at, at), data_.quantile, result);
        describe_sight(at, result);
      }
      out.links.push_back(std::move(result));
    }
  }

  /// Says how the ten columns from `at` are seen: a moment of inertia about the centre of mass
  /// shows by itself when the mass, the first moments and the second ones do.
  void describe_sight(Index at, LinkResult& link) const {
    const auto seen = [&](Index from, Index to) {
      bool any = false, alone = true;
      for (Index k = at + from; k < at + to; ++k) {
        any = any || !base_.combination.col(k).isZero(0.0);
        const auto found = std::ranges::find(base_.independent, k);
        const Index row = found - base_.independent.begin();
        alone = alone && found != base_.independent.end() &&
                (base_.combination.row(row).array() != 0.0).count() == 1;
      }
      return alone ? Seen::kAlone : any ? Seen::kInSums : Seen::kNot;
    };
    link.mass_seen = seen(0, 1);
    link.com_seen = seen(1, 4) == Seen::kNot ? Seen::kNot : seen(0, 4);
    link.inertia_seen = seen(4, 10) == Seen::kNot ? Seen::kNot : seen(0, 10);
    for (Index i = 0; i < base_.count(); ++i)
      if (!base_.combination.row(i).segment<10>(at).isZero(0.0))
        link.base_parameters.push_back(
            column_name(robot_, tree_, base_.independent[static_cast<std::size_t>(i)]));
  }

  /// A column's estimate; not identifiable where the joint does not move.
  [[nodiscard]] Estimate of_column(std::size_t coordinate, JointColumn column, double scale) const {
    const Index at = joint_column(coordinate, column);
    Estimate one{possible_[at], data_.quantile * std::sqrt(data_.covariance(at, at)), false};
    const bool moves =
        equations_.travel_rad[coordinate] > kStill_rad || column == JointColumn::kOffset;
    one.identifiable = moves && known(one.value, one.ci95, scale);
    return one;
  }

  /// What the link's row and the motor's lose together, of those that are known.
  static Estimate together(const Estimate& link, const Estimate& motor) {
    if (!link.identifiable && !motor.identifiable) return {kNone, kNone, false};
    if (!link.identifiable) return motor;
    if (!motor.identifiable) return link;
    return {link.value + motor.value, std::hypot(link.ci95, motor.ci95), true};
  }

  void fill_joints(Identification& out) const {
    for (std::size_t j = 0; j < config_.joints.size(); ++j) {
      JointResult result;
      result.name = config_.joints[j].name;
      result.slides = config_.joints[j].slides;
      const auto found = std::ranges::find(robot_.facts.joint, static_cast<int>(j));
      if (found != robot_.facts.joint.end())
        fill_joint(static_cast<std::size_t>(found - robot_.facts.joint.begin()), result);
      out.joints.push_back(std::move(result));
    }
  }

  void fill_joint(std::size_t c, JointResult& out) const {
    const RobotFacts& facts = robot_.facts;
    out.behind_rotor = !facts.behind_rotor.empty() && facts.behind_rotor[c];
    const double torque = facts.max_torque_Nm[c];
    const double viscous = torque / facts.max_velocity_rad_s[c];
    const double rotor = facts.rotor_kg_m2[c] > 0.0 ? facts.rotor_kg_m2[c] : 1e-2;
    const MotorEstimate motor = estimate_motor(equations_.motors[c], facts.rigid[c],
                                               {rotor, viscous, 0.3 * torque, 0.3 * torque});
    out.link_viscous_Nms_rad = of_column(c, JointColumn::kViscous, viscous);
    out.link_coulomb_Nm = of_column(c, JointColumn::kCoulomb, 0.3 * torque);
    const Estimate offset = of_column(c, JointColumn::kOffset, 0.3 * torque);
    const ChannelRows* rows = rows_of(c);
    if (rows == nullptr)
      out.link_viscous_Nms_rad.identifiable = out.link_coulomb_Nm.identifiable = false;
    out.motor_viscous_Nms_rad = motor.viscous_Nms_rad;
    out.motor_coulomb_Nm = motor.coulomb_Nm;
    out.viscous_Nms_rad = together(out.link_viscous_Nms_rad, motor.viscous_Nms_rad);
    out.coulomb_Nm = together(out.link_coulomb_Nm, motor.coulomb_Nm);
    out.offset_Nm = together(rows == nullptr ? Estimate{} : offset, motor.offset_Nm);
    out.rotor_inertia_kg_m2 =
        facts.rigid[c] ? of_column(c, JointColumn::kRotor, rotor) : motor.rotor_kg_m2;
    if (!out.rotor_inertia_kg_m2.identifiable) out.rotor_inertia_kg_m2 = {kNone, kNone, false};
    out.delay_s = possible_[joint_column(c, JointColumn::kDelay)];
    if (rows != nullptr) compare(*rows, out);
  }

  [[nodiscard]] const ChannelRows* rows_of(std::size_t coordinate) const {
    for (std::size_t c = 0; c < equations_.channels.size(); ++c) {
      const Channel& channel = robot_.regressor.channels()[c];
      if (channel.kind == Channel::Kind::kJoint && channel.index == static_cast<int>(coordinate) &&
          equations_.channels[c].rows() > 0)
        return &equations_.channels[c];
    }
    return nullptr;
  }

  void compare(const ChannelRows& rows, JointResult& out) const {
    double ours = 0.0, theirs = 0.0, all = 0.0;
    for (Index i = 0; i < rows.rows(); ++i) {
      const std::size_t at = rows.instant[static_cast<std::size_t>(i)];
      const std::vector<std::size_t>& logs = equations_.first_of_log;
      while (out.first_of_log.size() < logs.size() && at >= logs[out.first_of_log.size()])
        out.first_of_log.push_back(out.time_s.size());
      if (!split_.held[at]) continue;
      const double given = rows.measured[i] - rows.y[i];
      const double identified = given + rows.X.row(i).dot(possible_);
      const double described = given + rows.X.row(i).dot(described_);
      out.time_s.push_back(equations_.time_s[at]);
      out.measured_Nm.push_back(rows.measured[i]);
      out.identified_Nm.push_back(identified);
      out.described_Nm.push_back(described);
      ours += (rows.measured[i] - identified) * (rows.measured[i] - identified);
      theirs += (rows.measured[i] - described) * (rows.measured[i] - described);
      all += rows.measured[i] * rows.measured[i];
    }
    const auto n = static_cast<double>(out.time_s.size());
    out.rms_Nm = n > 0.0 ? std::sqrt(ours / n) : kNone;
    out.described_rms_Nm = n > 0.0 ? std::sqrt(theirs / n) : kNone;
    out.relative_error = all > 0.0 ? std::sqrt(ours / all) : kNone;
    out.described_relative_error = all > 0.0 ? std::sqrt(theirs / all) : kNone;
  }

  void fill_base(Identification& out) const {
    const MatrixXd& C = base_.combination;
    for (Index i = 0; i < base_.count(); ++i) {
      BaseParameter one;
      one.name = column_name(robot_, tree_, base_.independent[static_cast<std::size_t>(i)]);
      for (Index k = 0; k < C.cols(); ++k)
        if (C(i, k) != 0.0) one.terms.emplace_back(column_name(robot_, tree_, k), C(i, k));
      const VectorXd combination = C.row(i).transpose();
      one.described = combination.dot(described_);
      one.estimate.value = combination.dot(data_.mean);
      one.estimate.ci95 = data_.quantile * deviation(combination, data_.covariance);
      one.estimate.identifiable =
          one.estimate.ci95 <= kIdentifiable * data_.quantile * deviation(combination, believed_);
      out.base.push_back(std::move(one));
    }
  }

  void fill_mass(Identification& out) const {
    VectorXd masses = VectorXd::Zero(equations_.columns);
    for (Index i = 0; i < links_; i += 10) masses[i] = 1.0;
    for (const LinkResult& link : out.links) {
      const int in_tree = tree_.link_index(link.name);
      const bool moves =
          tree_.floating_base || tree_.links[static_cast<std::size_t>(in_tree)].body > 0;
      if (!moves) continue;
      out.described_mass_kg += link.described.mass_kg;
      out.identified_mass_kg += link.identified.mass_kg;
    }
    const double described = masses.dot(described_);
    out.mass_kg = {masses.dot(possible_), data_.quantile * deviation(masses, data_.covariance),
                   false};
    out.mass_kg.identifiable = out.mass_kg.ci95 <= 0.05 * described;
  }

  void warn(Identification& out) const {
    const double moved = out.identified_mass_kg - out.described_mass_kg;
    if (std::abs(moved) > 0.01 * out.described_mass_kg) {
      out.warnings.push_back(fmt::format(
          "the total mass moves from {:.3f} to {:.3f} kg ({:+.3f} kg): {}", out.described_mass_kg,
          out.identified_mass_kg, moved,
          out.mass_kg.identifiable
              ? "weigh the robot to check it"
              : "the data do not determine it; weigh the robot before you use these masses"));
    }
    std::string still;
    for (std::size_t c = 0; c < equations_.travel_rad.size(); ++c) {
      if (equations_.travel_rad[c] > kStill_rad) continue;
      still += (still.empty() ? "" : ", ") + robot_.regressor.coordinates()[c];
    }
    if (!still.empty()) {
      out.warnings.push_back(
          "these joints hardly move, so the data say nothing of their friction "
          "and little of what they carry: " +
          still);
    }
    std::string assumed;
    for (const JointResult& joint : out.joints)
      if (!joint.rotor_inertia_kg_m2.identifiable && !joint.behind_rotor)
        assumed += (assumed.empty() ? "" : ", ") + joint.name;
    if (!assumed.empty()) {
      out.remarks.push_back(
          "the log does not show these joints' rotors: their inertia is assumed "
          "to be the description's: " +
          assumed);
    }
    for (const JointResult& joint : out.joints) warn_of(joint, out);
    std::string unseen;
    for (const int l : robot_.regressor.unseen_links())
      if (tree_.floating_base)
        unseen += (unseen.empty() ? "" : ", ") + tree_.links[static_cast<std::size_t>(l)].name;
    if (!unseen.empty())
      out.remarks.push_back(
          "beyond the sensors in the feet nothing is measured, and stays as "
          "described: " +
          unseen);
  }
  /// Bodies are kept possible, friction and rotors are not: they show a sign that is wrong.
  void warn_of_sign(const JointResult& joint, Identification& out) const {
    const auto& config = config_.joints[static_cast<std::size_t>(config_.joint_index(joint.name))];
    const double rotor = config_.actuator_of(config).inertia_kg_m2;
    struct Named {
      const char* name;
      const Estimate& found;
      double felt;  // what would matter
      const char *turning, *sliding;
    };
    const double torque = kFelt * config.max_torque_Nm;
    for (const auto& [name, found, felt, turning, sliding] :
         {Named{"Coulomb friction", joint.link_coulomb_Nm, torque, "Nm", "N"},
          Named{"viscous friction", joint.link_viscous_Nms_rad, torque / config.max_velocity_rad_s,
                "Nms/rad", "Ns/m"},
          Named{"rotor", joint.rotor_inertia_kg_m2, kFeltRotor * rotor, "kg m2", "kg"}}) {
      if (!found.identifiable || !(found.value < -std::max(felt, found.ci95))) continue;
      out.warnings.push_back(fmt::format(
          "the {} of joint '{}' is {:.3g} +- {:.2g} {}, and none can be below zero: its torque or "
          "its "
          "position may have the other sign. Then nothing of this result is true: record or "
          "import them with the right sign",
          name, joint.name, found.value, found.ci95, joint.slides ? sliding : turning));
      return;
    }
  }
  void warn_of(const JointResult& joint, Identification& out) const {
    warn_of_sign(joint, out);
    if (!(joint.rms_Nm > kNoTorque * torque_of(joint.name))) return;
    const char* unit = joint.slides ? "N" : "Nm";
    if (joint.relative_error > kMuchLeftOver) {
      out.warnings.push_back(fmt::format(
          "the model does not explain the torque of joint '{}': {:.0f} % of it is left over "
          "({:.2f} {}); look for contact, a wrong joint axis or a torque that is not the joint's",
          joint.name, 100.0 * joint.relative_error, joint.rms_Nm, unit));
    }
    if (joint.rms_Nm > kWorse * joint.described_rms_Nm &&
        joint.relative_error > joint.described_relative_error + 0.01) {
      out.warnings.push_back(fmt::format(
          "the result is worse than the description: of the torque of joint '{}' {:.1f} % is left "
          "over, by the description {:.1f} %; part of the log is wrong, or the held back part is "
          "another motion: do not use it",
          joint.name, 100.0 * joint.relative_error, 100.0 * joint.described_relative_error));
    }
  }
  [[nodiscard]] double torque_of(const std::string& joint) const {
    return config_.joints[static_cast<std::size_t>(config_.joint_index(joint))].max_torque_Nm;
  }

  const hal::RobotConfig& config_;
  const model::Tree& tree_;
  IdentifiedRobot& robot_;
  const Equations& equations_;
  const Split& split_;
  BaseParameters base_;
  Prior prior_;
  DataEstimate data_;
  MatrixXd believed_;  // covariance of the description by itself
  Index links_ = 0;
  VectorXd possible_, described_;
};

}  // namespace

const char* to_string(Seen seen) noexcept {
  switch (seen) {
    case Seen::kNot: return "not";
    case Seen::kInSums: return "in sums";
    case Seen::kAlone: return "alone";
  }
  return "not";
}

void answer(const hal::RobotConfig& config, const model::Tree& tree, IdentifiedRobot& robot,
            const Equations& equations, Identification& out) {
  const Split split = split_of(equations);
  Answer(config, tree, robot, equations, split).fill(out);
}

VectorXd fitted(const hal::RobotConfig& config, const model::Tree& tree, IdentifiedRobot& robot,
                const Equations& equations) {
  const Split split = split_of(equations);
  return Answer(config, tree, robot, equations, split).possible();
}

}  // namespace tandem::identification
