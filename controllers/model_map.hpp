// Between the image's order of joints and the model's, by name.
// Layer: controllers.  Thread: non-RT to make; then any.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/robot.hpp"
#include "model/closed_loops.hpp"
#include "model/kernels.h"

namespace tandem {

/// Whether a controller can do with joints that have no motor.
enum class PassiveJoints : std::uint8_t { kRefused, kClosed };

/// Where each joint of the image stands in q, v and tau of the kernels. Passive joints are not in
/// the image: where they stand and what they carry follows from the closed loops.
class ModelMap {
 public:
  /// Errors: there are no kernels; a joint of one side that the other lacks; a passive joint where
  /// they are refused.
  [[nodiscard]] static Result<ModelMap> make(const hal::Robot& robot, const tandem_kernels* kernels,
                                             PassiveJoints passive = PassiveJoints::kRefused);

  [[nodiscard]] std::size_t joints() const noexcept { return index_.size(); }
  /// Index in v and tau of the image's joint `j`.
  [[nodiscard]] std::size_t v_index(std::size_t j) const noexcept { return index_[j] + base_; }
  /// Index in q of the image's joint `j`.
  [[nodiscard]] std::size_t q_index(std::size_t j) const noexcept {
    return index_[j] + (base_ == 0 ? 0 : 7);
  }
  /// Writes the joints' part of q from values in the image's order.
  void positions_to_q(std::span<const double> image, std::span<double> q) const noexcept TANDEM_RT;

  /// Writes the positions from which close() starts, as robot.toml gives them.
  void passive_to_q(std::span<double> q) const noexcept TANDEM_RT;
  /// Moves the passive joints from where q has them until the loops are closed.
  /// @return whether they close; true without loops.
  [[nodiscard]] bool close(std::span<double> q) noexcept TANDEM_RT;
  /// Moves what `tau` asks of passive joints to the driven ones, through the loops.
  /// @pre close() at tau's q
  void carry_passive(std::span<double> tau) noexcept TANDEM_RT { loops_.carry_passive(tau.data()); }

 private:
  std::vector<std::size_t> index_;  // per joint of the image, in the model's joints
  std::size_t base_ = 0;            // 6 for a floating base
  model::ClosedLoops loops_;
  std::vector<double> passive_rad_;  // where close() starts
};

/// Index of a site by its name. Errors: no such site (with the nearest).
[[nodiscard]] Result<std::size_t> site_index(const tandem_kernels& kernels,
                                             const std::string& name);

}  // namespace tandem
