// Units of quantities in conditions and expectations: what each is in SI.
// Layer: runtime/condition.  Thread: non-RT only.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tandem::runtime {

/// One of it is `factor` of `base`.
struct Unit {
  std::string base;  ///< "Nm", "rad/s"; empty: a plain number
  double factor = 1.0;

  /// So many of it. Decimal ones divide: 700 mm is 0.7 m to the bit.
  [[nodiscard]] double in_base(double amount) const {
    return factor < 1.0 ? amount / (1.0 / factor) : amount * factor;
  }
};

/// "mNm" is 0.001 Nm, "deg/s" 0.0175 rad/s, "%" 0.01. Empty: there is no such unit.
[[nodiscard]] std::optional<Unit> unit_of(std::string_view text);

/// The units of that base, for an error: "Nm, mNm, kNm".
[[nodiscard]] std::string units_like(std::string_view base);

}  // namespace tandem::runtime
