// gravity_compensation: carries the robot's weight, so that a hand can move it.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "controllers/controller.hpp"
#include "controllers/feet.hpp"
#include "controllers/min_jerk.hpp"
#include "controllers/model_map.hpp"
#include "controllers/parameters.hpp"
#include "controllers/support.hpp"
#include "model/sines.hpp"

namespace tandem {
namespace {

/// The model has an IMU as a site: one that stands in its link's frame, or else one of its name.
std::string imu_site(const hal::Robot& robot, const hal::Sensor& sensor) {
  const std::array<double, 3> none{};
  for (const hal::Site& site : robot.sites) {
    if (site.link == sensor.link && site.xyz_m == none && site.rpy_rad == none) return site.name;
  }
  return sensor.name;
}

/// Parameters: mode ("compliant": a virtual spring and damper about the start posture, "torque":
/// none), joints (all), effort (false), effort_timeout_s (0.5), stiffness_Nm_rad and
/// damping_Nms_rad (by joint, the robot's), ramp_s (1), feet (all; floating base only).
///
/// tau = h(q, 0) for a fixed base. A floating base is taken to stand on its feet, turned as its
/// IMU says, or upright when it has none.
class GravityCompensation : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    Result<ModelMap> map = ModelMap::make(setup.robot, setup.kernels, PassiveJoints::kClosed);
    if (!map) return std::unexpected(map.error());
    map_ = std::move(*map);
    kernels_ = setup.kernels;
    weight_ = setup.joint_signals("weight", "Nm", "torque that holds the measured posture");
    ramp_s_ = setup.parameter("ramp_s", {.unit = "s",
                                         .min = 0,
                                         .above_min = true,
                                         .otherwise = 1,
                                         .doc = "from the torque at the start to the weight's"});
    compliant_ = setup
                     .parameter("mode", {.choices = {"compliant", "torque"},
                                         .otherwise = "compliant",
                                         .doc = "with a virtual spring and damper, or without"})
                     .is("compliant");
    if (const Status standing = stand(setup); !standing) return standing;
    claim_joints(setup);
    take_effort(setup);
    sines_ = model::Sines(*kernels_);
    q_.assign(kernels_->nq, 0.0);
    map_.passive_to_q(q_);
    rest_.assign(kernels_->nv, 0.0);
    tau_.assign(kernels_->nv, 0.0);
    pose_.assign(12 * kernels_->sites, 0.0);
    twist_.assign(6 * kernels_->sites, 0.0);
    J_.assign(6 * kernels_->nv * kernels_->sites, 0.0);
    return {};
  }

  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    start_ns_ = time.time_ns;
    for (ClaimedJoint& joint : joints_) {
      joint.position_rad = state.position_rad()[joint.index];
      joint.torque_Nm = state.torque_Nm()[joint.index];
    }
  }

  Code update(const hal::CycleTime& time, const hal::StateImage& state,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    weigh(state);
    const double since_s = static_cast<double>(time.time_ns - start_ns_) * 1e-9;
    const double share = min_jerk(since_s / ramp_s_).s;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const ClaimedJoint& joint = joints_[i];
      const std::size_t j = joint.index;
      const double weight = tau_[map_.v_index(j)];
      weight_.set(j, weight);
      if (compliant_) command.position_rad()[j] = joint.position_rad;
      command.velocity_rad_s()[j] = 0.0;
      command.stiffness_Nm_rad()[j] = stiffness_Nm_rad_[i];
      command.damping_Nms_rad()[j] = damping_Nms_rad_[i];
      command.torque_Nm()[j] =
          joint.torque_Nm + (weight - joint.torque_Nm) * share + (effort_ ? (*effort_)[i] : 0.0);
    }
    return Code::kOk;
  }

  void archive(Archive& ar) override { ar(start_ns_, joints_, q_); }

 private:
  struct ClaimedJoint {
    std::size_t index = 0;
    double position_rad = 0.0;  // at the start
    double torque_Nm = 0.0;     // at the start
  };

  Status stand(ControllerSetup& setup) {
    if (kernels_->floating_base == 0) return {};
    const std::vector<std::string> names =
        setup.parameters.texts_or("feet", foot_names(setup.robot));
    const Result<std::vector<FootContact>> feet = find_feet(setup.robot, *kernels_, names);
    if (!feet) return std::unexpected(feet.error());
    support_.emplace(*feet);
    for (std::size_t i = 0; i < setup.robot.sensors.size(); ++i) {
      const hal::Sensor& sensor = setup.robot.sensors[i];
      if (sensor.type != hal::SensorType::kImu) continue;
      if (const Result<std::size_t> site = site_index(*kernels_, imu_site(setup.robot, sensor))) {
        imu_ = Imu{i, *site};
      }
    }
    return {};
  }

  /// An input is there only where it is asked for: the robot's end of a link can have none.
  void take_effort(ControllerSetup& setup) {
    const double timeout_s =
        setup.parameter("effort_timeout_s", {.unit = "s",
                                             .min = 0.01,
                                             .max = 60,
                                             .otherwise = 0.5,
                                             .doc = "that a sample of the input `effort` counts"});
    const bool takes =
        setup.parameter("effort", {.otherwise = false, .doc = "an input `effort` adds torques"})
            .on();
    if (!takes) return;
    InputOptions options{.doc = "torques of the joints, beside those of the weight",
                         .unit = "Nm",
                         .timeout_s = timeout_s,
                         .after = AfterTimeout::kZero};
    for (const ClaimedJoint& joint : joints_) {
      const hal::DrivenJoint& limit = setup.robot.joints[joint.index];
      options.names.push_back(limit.name);
      options.max.push_back(limit.max_torque_Nm);
    }
    effort_ = setup.input("effort", InputKind::kNumbers, std::move(options));
  }

  void claim_joints(ControllerSetup& setup) {
    const std::vector<std::size_t> joints = joints_parameter(setup);
    std::vector<ParameterFacts> stiffness, damping;
    for (const std::size_t j : joints) {
      if (compliant_) {
        setup.claim(j, hal::ControlMode::kPosition, hal::InteractionMode::kCompliant);
      } else {
        setup.claim(j, hal::ControlMode::kTorque);
      }
      joints_.push_back({.index = j});
      const hal::DrivenJoint& limit = setup.robot.joints[j];
      stiffness.push_back({.unit = "Nm/rad",
                           .min = 0,
                           .max = limit.max_stiffness_Nm_rad,
                           .otherwise = limit.stiffness_Nm_rad,
                           .live = true,
                           .doc = "of the virtual spring; else robot.toml's"});
      damping.push_back({.unit = "Nms/rad",
                         .min = 0,
                         .max = limit.max_damping_Nms_rad,
                         .otherwise = limit.damping_Nms_rad,
                         .live = true,
                         .doc = "of the virtual damper; else robot.toml's"});
    }
    stiffness_Nm_rad_ = setup.joint_parameters("stiffness_Nm_rad", joints, stiffness);
    damping_Nms_rad_ = setup.joint_parameters("damping_Nms_rad", joints, damping);
  }

  /// The torques that hold the measured posture, in tau_.
  void weigh(const hal::StateImage& state) noexcept TANDEM_RT {
    map_.positions_to_q(state.position_rad(), q_);
    if (kernels_->floating_base == 0) {
      close_loops();
      kernels_->bias(q_.data(), rest_.data(), tau_.data());
      map_.carry_passive(tau_);
      return;
    }
    q_[3] = q_[4] = q_[5] = 0.0;
    q_[6] = 1.0;
    if (imu_) turn_base(state.sensor_values(imu_->sensor));
    close_loops();
    locate();
    kernels_->bias_at(sines_.data(), q_.data(), rest_.data(), tau_.data());
    kernels_->site_jacobians_at(sines_.data(), q_.data(), J_.data());
    support_->carry(*kernels_, q_, pose_, J_, tau_);
    map_.carry_passive(tau_);
  }

  /// From where the loops were closed last, or else from where robot.toml has them. Positions that
  /// no posture closes (a linkage stretched by noise) leave them as near as they get.
  void close_loops() noexcept TANDEM_RT {
    if (map_.close(q_)) return;
    map_.passive_to_q(q_);
    (void)map_.close(q_);
  }

  void locate() noexcept TANDEM_RT {
    sines_.take(q_.data());
    kernels_->site_twists_at(sines_.data(), q_.data(), rest_.data(), pose_.data(), twist_.data());
  }

  /// The base's orientation from the IMU's: R_WB = R_WS R_BS^T.
  void turn_base(std::span<const double> imu) noexcept TANDEM_RT {
    locate();  // with the base along W, so that the site's pose is R_BS
    using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const Eigen::Matrix3d base_imu = Eigen::Map<const RowMajor3>(&pose_[12 * imu_->site]);
    const Eigen::Quaterniond world_imu(imu[3], imu[0], imu[1], imu[2]);
    const Eigen::Quaterniond world_base =
        (world_imu * Eigen::Quaterniond(base_imu).conjugate()).normalized();
    q_[3] = world_base.x();
    q_[4] = world_base.y();
    q_[5] = world_base.z();
    q_[6] = world_base.w();
  }

  struct Imu {
    std::size_t sensor = 0;
    std::size_t site = 0;
  };
  const tandem_kernels* kernels_ = nullptr;
  model::Sines sines_;  // of locate()'s posture
  ModelMap map_;
  std::optional<Support> support_;  // of a floating base
  std::optional<Imu> imu_;
  Signal weight_;
  std::optional<Input> effort_;
  bool compliant_ = true;
  double ramp_s_ = 1.0;
  std::int64_t start_ns_ = 0;
  std::vector<ClaimedJoint> joints_;
  std::vector<Parameter> stiffness_Nm_rad_, damping_Nms_rad_;  // of these
  std::vector<double> q_, rest_, tau_, pose_, twist_, J_;
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::GravityCompensation, "gravity_compensation",
                  "Carries the robot's weight, so that a hand can move it.")
