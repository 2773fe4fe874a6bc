#include "estimation/estimator.hpp"

#include <algorithm>
#include <limits>

#include "base/nearest.hpp"

namespace tandem::estimation {
namespace {

constexpr double kQuiet_s = 0.2;  // a joint that collides is found again after so long without

std::unexpected<Error> in_table(Error error, const char* key) {
  if (error.key.empty()) error.key = key;
  return std::unexpected(std::move(error));
}

/// @param of_base  the base floats, and is estimated
Result<std::vector<double>> thresholds(const hal::Robot& robot, const CollisionConfig& config,
                                       bool of_base) {
  const std::size_t joints = robot.joints.size();
  std::vector<double> all(joints + (of_base ? kBaseChannels.size() : 0),
                          std::numeric_limits<double>::infinity());
  for (const auto& [joint, torque_Nm] : config.thresholds) {
    const int at = robot.joint_index(joint);
    const auto channel = std::ranges::find(kBaseChannels, joint) - kBaseChannels.begin();
    if (at < 0 && of_base && channel < 6) {
      all[joints + static_cast<std::size_t>(channel)] = torque_Nm;
      continue;
    }
    if (at < 0) return std::unexpected(robot.no_joint(joint));
    all[static_cast<std::size_t>(at)] = torque_Nm;
  }
  return all;
}

Result<SiteWrenches> wrenches_of(const tandem_kernels& kernels, const EstimationConfig& config) {
  if (!config.observer)
    return fail("wrenches explain the observer's torques", "add [estimation.observer]");
  return SiteWrenches::make(kernels, config.wrench_sites());
}

}  // namespace

Estimator::Estimator(const tandem_kernels& kernels, const ModelJoints& joints,
                     const hal::EstimateShape& shape)
    : kernels_(&kernels),
      sines_(kernels),
      joints_(joints),
      image_(shape),
      q_(kernels.nq),
      v_(kernels.nv),
      tau_(kernels.nv),
      wrench_(6 * kernels.wrenches) {}

Result<std::unique_ptr<Estimator>> Estimator::make(const hal::Robot& robot,
                                                   const tandem_kernels* kernels,
                                                   const EstimationConfig& config,
                                                   std::int64_t period_ns) {
  const auto joints = ModelJoints::make(robot, kernels);
  if (!joints) return in_table(joints.error(), "estimation");
  const double step_s = static_cast<double>(period_ns) * 1e-9;
  std::optional<BaseEstimator> base;
  if (config.base) {
    auto made = BaseEstimator::make(robot, *kernels, *joints, *config.base, step_s);
    if (!made) return in_table(made.error(), "estimation.base");
    base.emplace(std::move(*made));
  }
  if (config.observer && kernels->floating_base != 0 && !base) {
    return in_table(
        fail("the observer of a floating base needs the base's motion", "add [estimation.base]")
            .error(),
        "estimation.observer");
  }
  if (config.collision && !config.observer) {
    return in_table(
        fail("collisions are found in the observer's torques", "add [estimation.observer]").error(),
        "estimation.collision");
  }
  std::optional<SiteWrenches> wrenches;
  if (!config.wrenches.empty()) {
    auto made = wrenches_of(*kernels, config);
    if (!made) return in_table(made.error(), "estimation.wrench");
    wrenches.emplace(std::move(*made));
  }
  const hal::EstimateShape shape{.base = base ? 1U : 0U,
                                 .feet = base ? base->feet().feet() : 0U,
                                 .joints = config.observer ? robot.joints.size() : 0U,
                                 .wrenches = config.wrenches.size()};
  std::unique_ptr<Estimator> made(new Estimator(*kernels, *joints, shape));
  made->base_ = std::move(base);
  made->wrenches_ = std::move(wrenches);
  if (config.observer) made->observer_.emplace(*kernels, config.observer->bandwidth_Hz, step_s);
  if (config.collision) {
    auto limits = thresholds(robot, *config.collision, made->image_.estimates_base());
    if (!limits) return in_table(limits.error(), "estimation.collision.threshold_Nm");
    made->felt_.resize(limits->size());
    made->found_.resize(limits->size());
    made->watch_.emplace(std::move(*limits), made->image_.joints(),
                         static_cast<std::uint32_t>(kQuiet_s / step_s));
    made->reaction_ = config.collision->reaction;
  }
  return made;
}

Status Estimator::check(const hal::Robot& robot, const EstimationConfig& config) {
  if (config.any() && !robot.passive.empty()) return in_table(passive_joint(robot), "estimation");
  if (!config.base) return {};
  const auto imu = BaseEstimator::find_imu(robot, *config.base);
  if (!imu) return in_table(imu.error(), "estimation.base");
  if (Status feet = FootSensors::check(robot); !feet) {
    return in_table(feet.error(), "estimation.base");
  }
  return {};
}

void Estimator::update(const hal::StateImage& state) noexcept TANDEM_RT {
  image_.cycle()[0] = state.cycle()[0];
  image_.time_ns()[0] = state.time_ns()[0];
  if (base_) base_->update(state, image_);
  if (observer_ && (!base_ || base_->started())) observe(state);
}

void Estimator::observe(const hal::StateImage& state) noexcept {
  const bool floats = kernels_->floating_base != 0;
  if (floats) {
    const hal::EstimateImage& now = image_;
    std::ranges::copy(now.base_position_m(), q_.begin());
    std::ranges::copy(now.base_quaternion(), q_.begin() + 3);
    std::ranges::copy(now.base_velocity(), v_.begin());
    for (std::size_t i = 0; i < base_->feet().feet(); ++i)
      std::copy_n(base_->ground(i).data(), 6,
                  wrench_.begin() + static_cast<std::ptrdiff_t>(6 * base_->feet().wrench(i)));
  }
  joints_.to_model(state.position_rad(), q_.data() + (floats ? 7 : 0));
  joints_.to_model(state.velocity_rad_s(), v_.data() + (floats ? 6 : 0));
  joints_.to_model(state.torque_Nm(), tau_.data() + (floats ? 6 : 0));
  if (!base_) sines_.take(q_.data());
  observer_->update(sines(), q_.data(), v_.data(), tau_.data(), wrench_.data());
  joints_.to_image(observer_->residual().data() + (floats ? 6 : 0), image_.external_torque_Nm());
  if (floats) std::copy_n(observer_->residual().data(), 6, image_.external_base_wrench().data());
  if (wrenches_) explain();
}

void Estimator::explain() noexcept {
  wrenches_->solve(sines(), q_.data(), observer_->residual());
  for (std::size_t i = 0; i < wrenches_->size(); ++i) {
    const auto wrench = wrenches_->wrench(i);
    std::copy_n(wrench.data(), 3, image_.external_force_N().data() + 3 * i);
    std::copy_n(wrench.data() + 3, 3, image_.external_moment_Nm().data() + 3 * i);
  }
  image_.unexplained_torque_Nm()[0] = wrenches_->unexplained_Nm();
}

std::optional<CollisionWatch::Found> Estimator::collision() noexcept TANDEM_RT {
  if (!watch_) return std::nullopt;
  const std::size_t joints = image_.joints();
  std::ranges::copy(image_.external_torque_Nm(), felt_.begin());
  std::ranges::copy(image_.external_base_wrench(),
                    felt_.begin() + static_cast<std::ptrdiff_t>(joints));
  const auto found = watch_->look(felt_, found_);
  std::copy_n(found_.begin(), joints, image_.collided().begin());
  if (image_.estimates_base())
    image_.base_collided()[0] =
        *std::max_element(found_.begin() + static_cast<std::ptrdiff_t>(joints), found_.end());
  return found;
}

void Estimator::archive(Archive& ar) {
  image_.archive(ar);
  if (base_) base_->archive(ar);
  if (observer_) observer_->archive(ar);
  if (watch_) watch_->archive(ar);
}

}  // namespace tandem::estimation
