// A controller's own numbers, for log, report, DDS and `tandem signal`: what it holds of them.
// Layer: controllers.  Thread: declared in configure(); written RT.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>

#include "base/realtime.hpp"

namespace tandem {

/// A signal that ControllerSetup declared: `depth_ = 0.1`. It keeps its number until another is
/// written; before the first it is NaN. Any number may be written, NaN as well. The numbers are
/// kept for as long as a handle is: one cannot dangle. One that was not declared takes nothing.
class Signal {
 public:
  Signal() = default;
  /// ControllerSetup's.
  Signal(std::shared_ptr<double> at, std::size_t count) : at_(std::move(at)), count_(count) {}

  /// The first number, of a scalar the only one. @rt a store
  Signal& operator=(double value) noexcept TANDEM_RT { return set(0, value), *this; }
  /// Number `index`; beyond size() nothing. @rt a store
  void set(std::size_t index, double value) noexcept TANDEM_RT {
    if (index < count_) at_.get()[index] = value;
  }
  /// The first numbers, as many as both have. @rt a copy
  void set(std::span<const double> values) noexcept TANDEM_RT {
    std::copy_n(values.begin(), std::min(values.size(), count_), at_.get());
  }
  [[nodiscard]] std::size_t size() const noexcept TANDEM_RT { return count_; }

 private:
  std::shared_ptr<double> at_;
  std::size_t count_ = 0;
};

}  // namespace tandem
