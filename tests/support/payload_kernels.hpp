// A robot that holds something: its dynamics with one more mass, without a compiler.
// Layer: tests.  Thread: one, one robot at a time (model::InterpretedKernels).
#pragma once

#include <Eigen/Core>
#include <string>

#include "hal/config/robot_config.hpp"
#include "model/interpreted_kernels.hpp"

namespace tandem::test {

/// A ball of 1 kg and 4 cm radius, with its inertia, fixed to a link. For one simulated robot: what
/// its plant calls in the cycle takes heap here, and the traps let it.
class PayloadKernels {
 public:
  /// @param in_link_m  the ball's centre in the frame of `link`
  PayloadKernels(const hal::RobotConfig& robot, const std::string& link,
                 const Eigen::Vector3d& in_link_m);
  /// Forgets what the trap of the tests has seen.
  ~PayloadKernels();
  PayloadKernels(const PayloadKernels&) = delete;
  PayloadKernels& operator=(const PayloadKernels&) = delete;
  [[nodiscard]] const tandem_kernels* get() const { return &kernels_; }

 private:
  model::InterpretedKernels interpreted_;
  tandem_kernels kernels_;
};

}  // namespace tandem::test
