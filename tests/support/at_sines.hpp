// The _at forms of kernels that a test writes by hand: they leave the sines and compute their own.
#pragma once

#include "model/kernels.h"

namespace tandem::test {

template <auto kernel>
struct AtSines;
template <class... Arrays, void (*kernel)(Arrays...)>
struct AtSines<kernel> {
  static void call(const double*, Arrays... arrays) { kernel(arrays...); }
};

/// `kernel` as an _at form.
template <auto kernel>
inline constexpr auto at_sines = &AtSines<kernel>::call;

inline void no_sines(const double*, double*) {}

}  // namespace tandem::test
