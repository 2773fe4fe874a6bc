// Joints grouped by effort into drive sizes, motors from voltage, effort and speed, gains from
// inertia and delay.
#include "scaffold/drives.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tandem::scaffold {
namespace {

// Sizes.
constexpr double kSameSize = 0.6;        // least share of a size's effort that it serves
constexpr double kEmfShare = 0.6;        // of the voltage, at the largest speed
constexpr double kDropShare = 0.3;       // of the voltage, in the winding at the largest effort
constexpr double kCurrentMargin = 1.25;  // of the current limit
constexpr double kMostCurrent_A = 60.0;  // before a higher voltage is taken
constexpr double kRunUp_s = 9e-3;        // the rotor alone, from rest to the largest speed
constexpr double kAlikeRotors = 0.5;     // least share of a size's rotor, and its inverse the most
constexpr double kSlowest = 0.05;   // [rad/s or m/s] of a drive: a slower joint has some to spare
constexpr double kFriction = 0.02;  // of the back-EMF's damping
constexpr double kGear = 100.0;
constexpr double kGearPerMetre = 1000.0;  // [rad/m] of a slide
constexpr double kInductanceTime_s = 0.5e-3;
constexpr double kHeating_K = 80.0;  // in the end, at kContinuous of the largest effort
constexpr double kContinuous = 0.6;

// Gains.
constexpr double kEmfCompensation = 0.9;
constexpr double kEstimator_Hz = 150.0;  // cut-off of the firmware's velocity estimate
constexpr double kLagMargin = 0.4;       // [rad]: phase that the lag may take at the crossover
constexpr double kDamping = 0.7;         // of the heaviest load
constexpr double kLegDamping = 0.48;     // the same, of what stands on a leg: it has to be carried
constexpr double kImpedance_rad_s = 53.0;  // a rotor alone on its impedance's spring
constexpr double kIntegralMargin = 4.0;    // in Routh's criterion
constexpr double kSwayMargin = 2.0;        // in the same, for the whole robot on a leg
constexpr double kIntegralRate_1_s = 2.0;
constexpr double kSag_rad = 0.016;  // of a leg's joint before its integral has what it bears
constexpr double kSameGains = 2.5;
constexpr double kChatter = 0.02;  // of the effort: what one count of the encoder may ask for

struct Range {
  double least = 0.0, most = 0.0, fall = 0.0;
  double sway = 0.0, sway_fall = 0.0;  ///< of all that stands on a leg
  double stand = 0.0;
};

Range range_of(const std::vector<int>& joints, const std::vector<JointLoad>& loads, double rotor) {
  Range range{.least = 1e300};
  for (const int j : joints) {
    range.least = std::min(range.least, rotor + loads[j].least_inertia);
    range.most = std::max(range.most, rotor + loads[j].most_inertia);
    range.fall = std::max(range.fall, loads[j].fall_Nm_rad);
    range.stand = std::max(range.stand, loads[j].stand_Nm);
    range.sway = std::max(range.sway, loads[j].sway_inertia);
    range.sway_fall = std::max(range.sway_fall, loads[j].sway_Nm_rad);
  }
  return range;
}

/// What the firmware's low-pass of the velocity keeps of its last value, cycle by cycle.
double estimator_memory(double period_s) {
  return std::exp(-2.0 * std::numbers::pi * kEstimator_Hz * period_s);
}

double estimator_lag_s(double period_s) {
  const double a = estimator_memory(period_s);
  return 0.5 * period_s + a * period_s / (1.0 - a);
}

/// One count of the encoder in the velocity estimate [rad/s, or m/s].
double velocity_step(double period_s) {
  const double count = 2.0 * std::numbers::pi / kEncoderCounts;
  return (1.0 - estimator_memory(period_s)) * count / period_s;
}

struct PositionGains {
  double kp = 0.0, ki = 0.0, kd = 0.0, damping = 0.0;
};

PositionGains position_gains(const hal::ActuatorConfig& drive, const Range& inertia,
                             const Tuning& tuning) {
  const double period_s = tuning.period_s;
  const double crossover = kLagMargin / (0.5 * period_s + estimator_lag_s(period_s));
  const double motor_constant = drive.torque_per_A();
  const double emf = motor_constant * motor_constant / drive.resistance_ohm;
  const double effort = motor_constant * drive.current_limit_A / kCurrentMargin;
  PositionGains g;
  g.kd = kEmfCompensation * emf +
         std::min(crossover * inertia.least, kChatter * effort / velocity_step(period_s));
  g.damping = g.kd + drive.damping_Nms_rad - kEmfCompensation * emf;
  const double fastest = g.damping * crossover / tuning.cascade;
  const double ratio = inertia.fall > 0.0 ? kLegDamping : kDamping;
  const double damped = g.damping * g.damping / (4.0 * ratio * ratio * inertia.most);
  g.kp = std::min(fastest,
                  std::max({damped, tuning.fall_margin * inertia.fall, inertia.stand / kSag_rad}));
  const double routh = g.damping * (g.kp - inertia.fall) / (kIntegralMargin * inertia.most);
  g.ki = std::min(kIntegralRate_1_s * g.kp, routh);
  if (inertia.sway > 0.0) {
    const double held = std::min(g.kp - inertia.sway_fall, tuning.reserve * inertia.sway_fall);
    g.ki = std::min(g.ki, g.damping * held / (kSwayMargin * inertia.sway));
  }
  g.ki = std::max(0.0, g.ki);
  return g;
}

hal::ActuatorConfig motor(double effort, double velocity, bool slides) {
  hal::ActuatorConfig m;
  m.order = 0;
  velocity = std::max(velocity, kSlowest);
  double current = 0.0, motor_constant = 0.0;
  for (const double volts : {24.0, 48.0, 96.0, 192.0}) {
    m.voltage_limit_V = volts;
    motor_constant = kEmfShare * volts / velocity;
    current = effort / motor_constant;
    if (kCurrentMargin * current <= kMostCurrent_A) break;
  }
  m.gear_ratio = slides ? kGearPerMetre : kGear;
  m.torque_constant_Nm_A = rounded(motor_constant / m.gear_ratio);
  motor_constant = m.torque_constant_Nm_A * m.gear_ratio;
  current = effort / motor_constant;
  m.resistance_ohm = rounded(kDropShare * m.voltage_limit_V / current);
  m.inductance_H = rounded(kInductanceTime_s * m.resistance_ohm);
  m.inertia_kg_m2 = rounded(effort * kRunUp_s / velocity);
  m.damping_Nms_rad =
      rounded((1.0 + kFriction) * motor_constant * motor_constant / m.resistance_ohm);
  m.current_limit_A = rounded(kCurrentMargin * current);
  const double heat_W = m.resistance_ohm * std::pow(kContinuous * current, 2.0);
  m.thermal_resistance_K_W = rounded(kHeating_K / heat_W);
  return m;
}

GainSet gain_set(const DriveSize& drive, std::vector<int> joints,
                 const std::vector<JointLoad>& loads, const Tuning& tuning) {
  const hal::ActuatorConfig& m = drive.actuator;
  const Range inertia = range_of(joints, loads, m.inertia_kg_m2);
  const PositionGains p = position_gains(m, inertia, tuning);
  GainSet set;
  hal::GainsConfig& g = set.gains;
  g.position.gains = {rounded(p.kp), rounded(p.ki), rounded(p.kd)};
  g.velocity.gains = {rounded(p.damping), rounded(5.0 * p.damping), 0.0};
  g.current.gains = {rounded(0.3 * m.resistance_ohm), rounded(200.0 * m.resistance_ohm), 0.0};
  g.emf_compensation = kEmfCompensation;
  g.stiffness_Nm_rad = rounded(std::min(p.kp, m.inertia_kg_m2 * std::pow(kImpedance_rad_s, 2.0)));
  g.damping_Nms_rad = rounded(std::min(p.kd, 2.0 * m.inertia_kg_m2 * kImpedance_rad_s));
  set.remark = fmt::format("inertia with its rotor {:.3g} to {:.3g}", inertia.least, inertia.most);
  if (inertia.fall > 0.0) {
    set.remark += fmt::format("; standing needs more than {:.3g} Nm/rad", inertia.fall);
  }
  set.joints = std::move(joints);
  return set;
}

/// Takes from `joints`, the strongest first, those that one drive serves.
DriveSize next_size(std::vector<int>& joints, const std::vector<JointLimits>& limits, bool slides,
                    const std::vector<DriveSize>& before) {
  const JointLimits& first = limits[joints.front()];
  const auto served = [&](int j) {
    const double strength = limits[j].effort / first.effort;
    const double rotor = strength * first.velocity / limits[j].velocity;
    return strength >= kSameSize && rotor >= kAlikeRotors && rotor * kAlikeRotors <= 1.0;
  };
  DriveSize size;
  double velocity = 0.0;
  for (const int j : joints) {
    if (!served(j)) continue;
    velocity = std::max(velocity, limits[j].velocity);
    size.joints.push_back(j);
  }
  size.actuator = motor(first.effort, velocity, slides);
  size.actuator.name = fmt::format("drive_{:.6g}{}", rounded(first.effort, 2), slides ? "N" : "Nm");
  const auto is_no_key = [](char c) { return c == '.' || c == '+'; };  // of TOML, without quotes
  std::ranges::replace_if(size.actuator.name, is_no_key, '_');
  const auto same = std::ranges::count_if(before, [&](const DriveSize& other) {
    return other.actuator.name.starts_with(size.actuator.name);
  });
  if (same > 0) size.actuator.name += fmt::format("_no{}", same + 1);
  size.remark = fmt::format("{:.3g} {} at {:.3g} {}", first.effort, slides ? "N" : "Nm", velocity,
                            slides ? "m/s" : "rad/s");
  std::erase_if(joints, [&](int j) { return std::ranges::count(size.joints, j) > 0; });
  std::ranges::sort(size.joints);
  return size;
}

}  // namespace

double rounded(double value, int digits) {
  if (value == 0.0 || !std::isfinite(value)) return value;
  const double scale = std::pow(10.0, digits - 1 - std::floor(std::log10(std::abs(value))));
  return std::round(value * scale) / scale;
}

std::vector<DriveSize> size_drives(const model::Tree& tree,
                                   const std::vector<JointLimits>& limits) {
  std::vector<DriveSize> sizes;
  for (const bool slides : {false, true}) {
    std::vector<int> joints;
    for (std::size_t j = 0; j < limits.size(); ++j) {
      if (tree.joints[j].follows()) continue;
      if ((tree.joints[j].type == model::JointType::kPrismatic) == slides) {
        joints.push_back(static_cast<int>(j));
      }
    }
    std::ranges::stable_sort(joints, std::greater{}, [&](int j) { return limits[j].effort; });
    while (!joints.empty()) sizes.push_back(next_size(joints, limits, slides, sizes));
  }
  return sizes;
}

std::vector<GainSet> tune(const std::vector<DriveSize>& drives, const std::vector<JointLoad>& loads,
                          const Tuning& tuning) {
  std::vector<GainSet> sets;
  for (const DriveSize& drive : drives) {
    const auto stiffness = [&](int j) {
      const Range inertia = range_of({j}, loads, drive.actuator.inertia_kg_m2);
      return position_gains(drive.actuator, inertia, tuning).kp;
    };
    std::vector<int> joints = drive.joints;
    std::ranges::stable_sort(joints, std::greater{}, stiffness);
    std::vector<GainSet> own;
    for (std::size_t first = 0, end = 0; first < joints.size(); first = end) {
      const double stiffest = stiffness(joints[first]);
      for (end = first; end < joints.size() && kSameGains * stiffness(joints[end]) >= stiffest;) {
        ++end;
      }
      std::vector<int> group(joints.begin() + static_cast<std::ptrdiff_t>(first),
                             joints.begin() + static_cast<std::ptrdiff_t>(end));
      std::ranges::sort(group);
      own.push_back(gain_set(drive, std::move(group), loads, tuning));
    }
    for (std::size_t i = 0; i < own.size(); ++i) {
      own[i].gains.name =
          drive.actuator.name + (own.size() == 1 ? "" : "_" + std::to_string(i + 1));
      sets.push_back(std::move(own[i]));
    }
  }
  return sets;
}

}  // namespace tandem::scaffold
