// All that a run estimates of its robot in a cycle. Start here to read the room.
// Layer: estimation.  Thread: made non-RT; the rest RT.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "estimation/base_estimator.hpp"
#include "estimation/collision.hpp"
#include "estimation/config.hpp"
#include "estimation/momentum_observer.hpp"
#include "estimation/robot_model.hpp"
#include "estimation/site_wrenches.hpp"
#include "hal/estimate.hpp"
#include "model/sines.hpp"

namespace tandem::estimation {

/// Base, then external torques and wrenches, then collisions, from one state image:
///
///   estimator.update(state);          // every cycle, after the robot was read
///   estimator.image();                // what controllers, log, DDS and report see
///   estimator.collision();            // while controllers run
///
/// No clock, no heap after make(); archived. On a floating base the observer takes the base from
/// the estimate and the ground from the feet's sensors, so that what is left is neither, and runs
/// from where the estimate starts.
class Estimator {
 public:
  /// @param kernels  outlive it
  /// Errors, with the key's table and what to do: BaseEstimator::make()'s, ModelJoints::make()'s;
  /// an observer on a floating base without [estimation.base]; collisions or wrenches without an
  /// observer; a joint or a site that the robot lacks.
  [[nodiscard]] static Result<std::unique_ptr<Estimator>> make(const hal::Robot& robot,
                                                               const tandem_kernels* kernels,
                                                               const EstimationConfig& config,
                                                               std::int64_t period_ns);

  /// What can be said before there are kernels, which take minutes to build.
  /// Errors: of [estimation.base], a base that does not move, and no foot, IMU or six-axis sensor.
  [[nodiscard]] static Status check(const hal::Robot& robot, const EstimationConfig& config);

  void update(const hal::StateImage& state) noexcept TANDEM_RT;
  [[nodiscard]] const hal::EstimateImage& image() const noexcept { return image_; }

  /// A joint that has just been found in collision. Call in cycles in which the robot is under
  /// control: one that lies feels the ground.
  [[nodiscard]] std::optional<CollisionWatch::Found> collision() noexcept TANDEM_RT;
  [[nodiscard]] hal::StopCategory reaction() const noexcept { return reaction_; }
  [[nodiscard]] double threshold_Nm(std::size_t joint) const noexcept {
    return watch_->threshold_Nm(joint);
  }
  /// Null without [estimation.base].
  [[nodiscard]] const BaseEstimator* base() const noexcept { return base_ ? &*base_ : nullptr; }

  void archive(Archive& ar);

 private:
  Estimator(const tandem_kernels& kernels, const ModelJoints& joints,
            const hal::EstimateShape& shape);
  void observe(const hal::StateImage& state) noexcept;
  void explain() noexcept;

  /// Sines of the joints' positions: from the base's estimate when there is one.
  [[nodiscard]] const double* sines() const noexcept {
    return base_ ? base_->sines() : sines_.data();
  }

  const tandem_kernels* kernels_;
  model::Sines sines_;  // without a base
  ModelJoints joints_;
  hal::EstimateImage image_;
  std::optional<BaseEstimator> base_;
  std::optional<MomentumObserver> observer_;
  std::optional<SiteWrenches> wrenches_;  // all of it is scratch: nothing to archive
  std::optional<CollisionWatch> watch_;
  hal::StopCategory reaction_ = hal::StopCategory::kWarn;
  std::vector<double> q_, v_, tau_, wrench_;
  std::vector<double> felt_;         // by joint, then the base's: scratch
  std::vector<std::uint8_t> found_;  // the same
};

}  // namespace tandem::estimation
