// A pair that would stand at an odd place gets a gap before it, which the next single angle fills.
#include "model/sine_table.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace tandem::model {

std::uint32_t SineTable::index(const std::string& angle) {
  if (const auto found = index_.find(angle); found != index_.end()) return found->second;
  auto place = std::ranges::find(angles_, std::string());
  if (place == angles_.end()) place = angles_.insert(place, std::string());
  *place = angle;
  const auto at = static_cast<std::uint32_t>(place - angles_.begin());
  index_.emplace(angle, at);
  return at;
}

void SineTable::add_pair(const std::string& first, const std::string& second) {
  if (first == second || index_.contains(first) || index_.contains(second)) return;
  if (angles_.size() % 2 != 0) angles_.emplace_back();
  for (const std::string& angle : {first, second}) {
    index_.emplace(angle, static_cast<std::uint32_t>(angles_.size()));
    angles_.push_back(angle);
  }
}

std::uint32_t SineTable::rounded() const {
  return static_cast<std::uint32_t>(std::max<std::size_t>(4, (angles_.size() + 3) / 4 * 4));
}

std::uint32_t SineTable::doubles() const { return kBlock / 4 * rounded(); }

std::string SineTable::source() const {
  std::vector<std::string> angles = angles_;
  angles.resize(rounded());
  std::string text = fmt::format(
      "constexpr uint32_t sine_count = {};\nvoid sines(const double* q, double* s) {{\n"
      "  alignas(32) double x[{}];\n",
      doubles(), angles.size());
  for (std::string& angle : angles)
    if (angle.empty()) angle = "0.0";
  for (std::size_t k = 0; k < angles.size(); k += 4)  // as vectors, as they are read
    text += fmt::format("  put(x + {}, four{{{}, {}, {}, {}}});\n", k, angles[k], angles[k + 1],
                        angles[k + 2], angles[k + 3]);
  return text +
         fmt::format("  sines_and_cosines<four, four_bits, 3>({}, x, s);\n}}\n\n", angles.size());
}

}  // namespace tandem::model
