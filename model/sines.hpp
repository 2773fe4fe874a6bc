// A posture's sines and cosines, for several kernels at it.
// Layer: model.  Thread: any; made non-RT.
#pragma once

#include <cstddef>
#include <vector>

#include "base/realtime.hpp"
#include "model/kernels.h"

namespace tandem::model {

/// What the kernels' _at forms take (model/kernels.h).
///
/// ```
/// sines.take(q);
/// kernels.bias_at(sines.data(), q, v, h);
/// kernels.mass_matrix_at(sines.data(), q, M);
/// ```
class Sines {
 public:
  /// Sines of no robot: only to be replaced.
  Sines() = default;
  /// @param kernels  outlive it
  explicit Sines(const tandem_kernels& kernels)
      : kernels_(&kernels), table_(std::size_t{kernels.sine_count} / 4 + 1) {}

  /// Computes those of q(nq). Of a floating base's posture they are the joints' alone.
  void take(const double* q) noexcept TANDEM_RT { kernels_->sines(q, table_.data()->value); }
  /// @pre take()
  [[nodiscard]] const double* data() const noexcept { return table_.data()->value; }

 private:
  struct alignas(32) Vector {
    double value[4] = {};
  };
  const tandem_kernels* kernels_ = nullptr;
  std::vector<Vector> table_;
};

}  // namespace tandem::model
