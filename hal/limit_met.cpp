// Names and units of the fields of a command, and a sentence for each kind of limit.
#include "hal/limit_met.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>

namespace tandem::hal {
namespace {

struct FieldRow {
  const char* name;
  const char* turns;   // its unit, of a joint that turns
  const char* slides;  // and of one that slides
  int per_s;           // that unit is by s to that power
};
constexpr std::array<FieldRow, 9> kFields{{{"position reference", "rad", "m", 0},
                                           {"velocity reference", "rad", "m", 1},
                                           {"torque", "Nm", "N", 0},
                                           {"voltage", "V", "V", 0},
                                           {"current", "A", "A", 0},
                                           {"stiffness", "Nm/rad", "N/m", 0},
                                           {"damping", "Nms/rad", "Ns/m", 0},
                                           {"mode", "", "", 0},
                                           {"interaction", "", "", 0}}};

const FieldRow& row_of(const LimitMet& met) {
  return kFields.at(static_cast<std::size_t>(met.field));
}

/// "3.142 rad/s2"; a number that is not finite has no unit.
std::string with_unit(const LimitMet& met, double value, int derivative) {
  if (std::isnan(value)) return "nan";
  const FieldRow& field = row_of(met);
  const std::string unit = met.slides != 0 ? field.slides : field.turns;
  char number[32];
  std::snprintf(number, sizeof number, "%.4g", value);
  if (unit.empty() || std::isinf(value)) return number;
  const int power = field.per_s + derivative;
  const std::string per = power == 0 ? "" : power == 1 ? "/s" : "/s" + std::to_string(power);
  return number + (" " + unit) + per;
}

}  // namespace

std::string value_in_words(const LimitMet& met) {
  return row_of(met).name + (" " + with_unit(met, met.value, 0));
}

std::string in_words(const LimitMet& met) {
  const std::string value = "the " + value_in_words(met);
  const std::string limit = with_unit(met, met.limit, met.derivative);
  const char* const followed = ": it is followed as fast as the joint's limits allow";
  switch (met.kind) {
    case LimitKind::kNone: return {};
    case LimitKind::kTooFast: return value + " asks for more than " + limit + followed;
    case LimitKind::kAtEnd:
      return value + " is more than " + limit + ", with which the joint stops within its range";
    case LimitKind::kRange: return value + " is beyond the limit " + limit;
    case LimitKind::kNotFinite: break;
  }
  const bool is_number = met.field < CommandField::kMode;
  return value + (is_number ? " is not finite" : " does not exist");
}

}  // namespace tandem::hal
