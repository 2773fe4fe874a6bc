// A robot's images in the coordinates of its kernels, and where its sensors stand in them.
// Layer: estimation.  Thread: made non-RT; the rest RT.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/image.hpp"
#include "hal/robot.hpp"
#include "model/kernels.h"

namespace tandem::estimation {

/// Why a robot with passive joints has no estimates. @pre it has some
[[nodiscard]] Error passive_joint(const hal::Robot& robot);

/// Where the image's joints stand among the kernels'. Every joint of the model has a motor, so that
/// its position, velocity and torque are measured.
class ModelJoints {
 public:
  /// Errors: there are no kernels; a joint of one side that the other lacks; a passive joint.
  [[nodiscard]] static Result<ModelJoints> make(const hal::Robot& robot,
                                                const tandem_kernels* kernels);
  /// Numbers by joint of the image, to those by joint of the kernels.
  void to_model(std::span<const double> image, double* model) const noexcept TANDEM_RT {
    for (std::size_t j = 0; j < index_.size(); ++j) model[index_[j]] = image[j];
  }
  void to_image(const double* model, std::span<double> image) const noexcept TANDEM_RT {
    for (std::size_t j = 0; j < index_.size(); ++j) image[j] = model[index_[j]];
  }
  [[nodiscard]] std::size_t size() const noexcept { return index_.size(); }

 private:
  std::vector<std::size_t> index_;
};

/// Index of `name`, or -1.
[[nodiscard]] int index_of(const char* const* names, std::size_t count, const std::string& name);

/// The kernels' site of an IMU: that of its link's frame, or the one that has its name; -1: none.
[[nodiscard]] int imu_site(const hal::Robot& robot, const hal::Sensor& imu,
                           const tandem_kernels& kernels);

}  // namespace tandem::estimation
