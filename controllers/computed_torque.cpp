// computed_torque: joints to and fro, by the inverse dynamics of the described robot.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "controllers/controller.hpp"
#include "controllers/model_map.hpp"

namespace tandem {
namespace {

/// Parameters: way_rad (by joint: from where it starts, and back), period_s (4) of one to and fro,
/// bandwidth_rad_s (10, by joint).
///
/// tau = M(q) (a_ref + 2 w (v_ref - v) + w^2 (q_ref - q)) + h(q, v), with which a joint's error
/// decays with its w, whatever the others do, as long as the robot is the described one. The
/// references are in the command, too, for logs and reports; the drives add nothing to the torque.
class ComputedTorque : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    Result<ModelMap> map = ModelMap::make(setup.robot, setup.kernels);
    if (!map) return std::unexpected(map.error());
    if (setup.kernels->floating_base != 0) {
      return fail("computed_torque needs a fixed base", "nothing drives a floating one");
    }
    map_ = std::move(*map);
    kernels_ = setup.kernels;
    std::vector<std::size_t> joints(map_.joints());
    std::iota(joints.begin(), joints.end(), std::size_t{0});
    way_rad_ = setup.joint_parameters("way_rad", joints,
                                      {{.unit = "rad", .doc = "from where it starts, and back"}});
    rate_rad_s_ =
        2.0 * std::numbers::pi /
        setup.parameter(
            "period_s",
            {.unit = "s", .min = 0, .above_min = true, .otherwise = 4, .doc = "of one to and fro"});
    bandwidth_rad_s_ = setup.joint_parameters("bandwidth_rad_s", joints,
                                              {{.unit = "rad/s",
                                                .min = 0,
                                                .above_min = true,
                                                .otherwise = 10,
                                                .live = true,
                                                .doc = "at which errors decay"}});
    for (const std::size_t j : joints)
      setup.claim(j, hal::ControlMode::kPosition, hal::InteractionMode::kCompliant);
    start_rad_.assign(map_.joints(), 0.0);
    q_.assign(kernels_->nq, 0.0);
    for (auto* rates : {&v_, &vdot_, &tau_}) rates->assign(kernels_->nv, 0.0);
    wrench_.assign(6 * kernels_->wrenches, 0.0);
    return {};
  }

  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    start_ns_ = time.time_ns;
    std::ranges::copy(state.position_rad().first(start_rad_.size()), start_rad_.begin());
  }

  Code update(const hal::CycleTime& time, const hal::StateImage& state,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    const double phase = rate_rad_s_ * static_cast<double>(time.time_ns - start_ns_) * 1e-9;
    map_.positions_to_q(state.position_rad(), q_);
    for (std::size_t j = 0; j < map_.joints(); ++j) {
      const double half = 0.5 * way_rad_[j], w = bandwidth_rad_s_[j];
      const double position = start_rad_[j] + half * (1.0 - std::cos(phase));
      const double velocity = half * rate_rad_s_ * std::sin(phase);
      const double acceleration = half * rate_rad_s_ * rate_rad_s_ * std::cos(phase);
      command.position_rad()[j] = position;
      command.velocity_rad_s()[j] = velocity;
      const std::size_t i = map_.v_index(j);
      v_[i] = state.velocity_rad_s()[j];
      vdot_[i] = acceleration + 2.0 * w * (velocity - v_[i]) +
                 w * w * (position - state.position_rad()[j]);
    }
    kernels_->inverse_dynamics(q_.data(), v_.data(), vdot_.data(), wrench_.data(), tau_.data());
    for (std::size_t j = 0; j < map_.joints(); ++j) {
      command.stiffness_Nm_rad()[j] = command.damping_Nms_rad()[j] = 0.0;
      command.torque_Nm()[j] = tau_[map_.v_index(j)];
    }
    return Code::kOk;
  }

  void archive(Archive& ar) override { ar(start_ns_, start_rad_); }

 private:
  const tandem_kernels* kernels_ = nullptr;
  ModelMap map_;
  double rate_rad_s_ = 0.0;
  std::vector<Parameter> way_rad_, bandwidth_rad_s_;  // by joint
  std::vector<double> start_rad_;
  std::int64_t start_ns_ = 0;
  std::vector<double> q_, v_, vdot_, tau_, wrench_;
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::ComputedTorque, "computed_torque",
                  "Moves joints to and fro by the inverse dynamics of the described robot.")
