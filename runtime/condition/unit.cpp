#include "runtime/condition/unit.hpp"

#include <algorithm>
#include <iterator>
#include <numbers>

namespace tandem::runtime {
namespace {

struct UnitRow {
  std::string_view name, base;
  double factor;
};

constexpr UnitRow kUnitRows[] = {
    {"rad", "rad", 1.0},   {"deg", "rad", std::numbers::pi / 180.0},
    {"mrad", "rad", 1e-3}, {"m", "m", 1.0},
    {"cm", "m", 1e-2},     {"mm", "m", 1e-3},
    {"Nm", "Nm", 1.0},     {"mNm", "Nm", 1e-3},
    {"kNm", "Nm", 1e3},    {"N", "N", 1.0},
    {"mN", "N", 1e-3},     {"kN", "N", 1e3},
    {"A", "A", 1.0},       {"mA", "A", 1e-3},
    {"V", "V", 1.0},       {"mV", "V", 1e-3},
    {"degC", "degC", 1.0}, {"s", "s", 1.0},
    {"ms", "s", 1e-3},     {"us", "s", 1e-6},
    {"ns", "s", 1e-9},     {"W", "W", 1.0},
    {"mW", "W", 1e-3},     {"kW", "W", 1e3},
    {"J", "J", 1.0},       {"mJ", "J", 1e-3},
    {"kJ", "J", 1e3},      {"Nms", "Nms", 1.0},
    {"Ns", "Ns", 1.0},     {"kg", "kg", 1.0},
    {"%", "", 1e-2},
};
constexpr std::string_view kPer[] = {"/s2", "/s", "/rad", "/m"};

const UnitRow* row_of_unit(std::string_view name) {
  const auto* row = std::ranges::find(kUnitRows, name, &UnitRow::name);
  return row == std::end(kUnitRows) ? nullptr : row;
}

/// "/s" of "deg/s".
std::string_view divisor_of(std::string_view text) {
  for (const std::string_view per : kPer) {
    if (text.ends_with(per)) return per;
  }
  return {};
}

}  // namespace

std::optional<Unit> unit_of(std::string_view text) {
  const std::string_view per = divisor_of(text);
  const UnitRow* row = row_of_unit(text.substr(0, text.size() - per.size()));
  if (row == nullptr || (row->base.empty() && !per.empty())) return std::nullopt;
  return Unit{std::string(row->base) + std::string(per), row->factor};
}

std::string units_like(std::string_view base) {
  const std::string_view per = divisor_of(base);
  const std::string_view of = base.substr(0, base.size() - per.size());
  std::string names;
  for (const UnitRow& row : kUnitRows) {
    if (row.base != of || of.empty()) continue;
    if (!names.empty()) names += ", ";
    names += std::string(row.name) + std::string(per);
  }
  return names.empty() ? std::string(base) : names;
}

}  // namespace tandem::runtime
